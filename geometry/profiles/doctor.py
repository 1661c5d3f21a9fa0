"""Profile doctor: examine a raw profile, repair what can be repaired and say so, refuse the rest with file, line and
reason."""

from dataclasses import dataclass, field

import numpy as np

from geometry.profiles.datum import on_crown, on_datum
from geometry.profiles.defects import (
    first_crossing,
    gaps,
    kinks,
    noise_level,
    overhang,
    repeated,
    reversals,
    spikes,
    thinned,
    without_zigzag,
)
from geometry.profiles.formats.raw import RawProfile
from geometry.profiles.profile import Piece, Profile, ProfileError, line
from geometry.profiles.shape import find_unit, guess_kind, rail_up, wheel_poses
from geometry.profiles.smoothing import from_neighbours, normals, smoothed

NOISE = 0.2e-6  # scatter that is smoothed [m], so the print in um; what finer scatter does to forces is below 0.5 %
LAG = 0.7e-3  # at which scatter is looked for besides; from 1 mm on it is the bends of a new wheel [m]
TAKEN = 1.1  # times the scatter is smoothed: it is known to 5 to 10 %, and with less than there is most of it stays
SPIKE = 5e-6  # the least by which a point stands out [m]
# scatter of which smoothing leaves what moves forces by more than some percent, of points so far apart [m]
ROUGH, APART = 10e-6, 0.25e-3
PRINTED = 1e-8  # scatter below which numbers are printed finely enough for any spacing [m]
DENSE = 1e-3, 0.05e-3  # points nearer than noise / first [m], but at most second [m], show their noise and no tangent
WIDEST_GAP = 25e-3
MOST_TAKEN_OUT = 0.05  # share of points that repairing may take out
ALIKE = 50e-6  # of a rail's top and its mirror image: less is said, and no warning [m]
LEANING = 0.1e-3  # of a face over its own foot that is worth saying [m]


@dataclass(frozen=True, eq=False)
class Finding:
    """One thing said about a profile. weight: "found", "repaired" or "warning"."""

    weight: str
    text: str


@dataclass(eq=False)
class Diagnosis:
    """What the doctor found and the profile after repairing.

    profile : Profile  in geometry.axes [m];  raw_points : (n, 2) as read, in metres and in the same axes, before
        repairing
    kind, unit_name, noise [m] : what it is
    """

    kind: str
    unit_name: str
    raw_points: np.ndarray
    findings: list[Finding] = field(default_factory=list)
    noise: float = 0.0
    profile: Profile = field(init=False)

    def say(self, weight: str, text: str) -> None:
        self.findings.append(Finding(weight, text))

    def report(self) -> str:
        """All findings, one a line."""
        width = max(len(f.weight) for f in self.findings)
        return "\n".join(f"  {f.weight:<{width}}  {f.text}" for f in self.findings)


def examine(
    raw: RawProfile,
    smooth: bool = True,
    *,
    smoothing: float | None = None,
    mirror: bool | None = None,
    flange_back: float | None = None,
    origin: str | tuple[float, float] = "crown",
) -> Diagnosis:
    """Diagnose and repair what was read.

    Parameters
    ----------
    raw : RawProfile
        As `read_raw` gives it.
    smooth : bool
        Take out scatter above 0.2 um (kinks stay).
    smoothing : float, optional
        The scatter to take out [m], whatever the points show; None: what they show.
    mirror : bool, optional
        Of a rail, exchange its sides (True) or keep them (False); None: kept, with a warning where its shape speaks
        against it.
    flange_back : float, optional
        Of a wheel, y of its flange back in the file [m]; None: see geometry.profiles.datum.
    origin : str or (float, float)
        Of a rail, what becomes (0, 0): "crown" in height only, "file" its own zero, or (y, z) in the file [m].

    Returns
    -------
    Diagnosis
        Its profile lies in geometry.axes: a wheel with its datum at (0, 0), a rail with its crown at z = 0.

    Raises
    ------
    ProfileError
        File, line and reason: loops, gaps above 25 mm, no possible unit, zig-zag beyond 5 % of points, a wheel whose
        flange cannot be told or whose flange back nothing says, a line that may be rail or wheel where nobody tells, an
        option that does not apply.

    Examples
    --------
    >>> np.savetxt("own.csv", geometry.wheel_profile("P8").points * 1e3, delimiter=",")  # [mm]
    >>> found = geometry.examine(geometry.read_raw("own.csv", kind="wheel"))
    >>> found.profile.is_graph
    True
    """
    kind = raw.kind or guess_kind(raw)
    refuse_options(raw, kind, smoothing, mirror, flange_back, origin)
    unit, name, remark, warning = find_unit(raw, kind)
    points, lines = raw.points.astype(float) * unit, raw.lines
    out = Diagnosis(kind, name, points)
    out.say("found", f"{len(points)} points as {raw.layout}, taken as a {kind} in {name}{remark}")
    if raw.kind is None:
        out.say("warning", f"rail or wheel is not said: taken as a {kind} by its shape; name the kind if that is wrong")
    if warning:
        out.say("warning", warning)
    for note in raw.notes:
        out.say("found", note)
    points, lines = without_repeats(points, lines, out)
    points, lines, turned = upright(points, lines, raw, kind, mirror, out)
    points, lines = without_loops(points, lines, raw, out)
    refuse_loops(points, lines, raw)
    examine_gaps(points, lines, raw, out)
    points, lines = without_crowd(points, lines, out)
    points, lines = without_spikes(points, lines, out)
    points, corners = smooth_points(points, smooth, smoothing, out)
    try:
        if kind == "wheel":
            said = None if raw.flange_back is None else raw.flange_back * unit
            backs = (None if back is None else turned[0] * back for back in (flange_back, said))
            points = on_datum(points, out, *backs)
        else:
            points = on_crown(
                points,
                out,
                origin if isinstance(origin, str) else turned * origin,
                raw.placed,
                out.noise if out.noise > NOISE else 0.0,
            )
    except ProfileError as error:
        raise ProfileError(f"{raw.path}: {error}") from None
    examine_walls(points, kind, out)
    out.profile = with_corners(points, corners, raw.path.name)
    return out


def refuse_options(raw, kind, smoothing, mirror, flange_back, origin) -> None:
    """Options of the other kind, and numbers that cannot be lengths [m]."""
    if kind == "rail" and flange_back is not None:
        raise ProfileError(f"{raw.path}: flange_back is given, but this is a rail")
    if kind == "wheel" and (mirror is not None or not (isinstance(origin, str) and origin == "crown")):
        raise ProfileError(
            f"{raw.path}: mirror and origin are for rails; a wheel is turned by its flange and set by its flange back"
            " (flange_back)"
        )
    if isinstance(origin, str) and origin not in ("crown", "file"):
        raise ProfileError(f"{raw.path}: origin {origin!r} is none of 'crown', 'file', (y, z) in m")
    if smoothing is not None and not 0 < smoothing < 1e-3:
        raise ProfileError(f"{raw.path}: smoothing = {smoothing!r} m: the scatter to take out lies between 0 and 1 mm")
    numbers = [] if flange_back is None else [flange_back]
    numbers += [] if isinstance(origin, str) else list(np.ravel(origin))
    if (not isinstance(origin, str) and np.shape(origin) != (2,)) or not all(
        np.isfinite(v) and abs(v) < 10.0 for v in numbers
    ):
        raise ProfileError(
            f"{raw.path}: flange_back = {flange_back!r}, origin = {origin!r}: lengths in m are asked for"
        )


def with_corners(points: np.ndarray, corners: np.ndarray, name: str) -> Profile:
    """Profile of splines between corners (indices), which stay kinks: no spline swings over an edge."""
    ends = [0, *corners.tolist(), len(points) - 1]
    pieces = []
    for a, b in zip(ends[:-1], ends[1:]):
        if b - a < 2:
            pieces.append(line(points[a], points[b], np.hypot(*(points[b] - points[a]))))
        else:
            part = Profile.from_points(points[a : b + 1], name)
            pieces.append(Piece(part.points, part.angle_after, part.curvature))
    return Profile.from_pieces(pieces, name, f"file {name}")


def without_repeats(points, lines, out):
    same = repeated(points)
    if same.any():
        out.say("repaired", f"{same.sum()} repeated point(s) taken out, the first on line {lines[np.argmax(same)]}")
    points, lines = points[~same], lines[~same]
    if len(points) < 3:
        raise ProfileError(f"{len(points)} different point(s) left; a profile needs at least 3")
    if len(points) < 30:
        out.say("warning", f"only {len(points)} points: curvature, and with it pressure, is a guess")
    return points, lines


def upright(points, lines, raw, kind, mirror, out):
    """z up, y towards the field side, order from the gauge side (wheel: flange back) to the field side; and the signs
    of y and z that were taken."""
    up, side = wheel_turn(points, raw, out) if kind == "wheel" else (rail_turn(points, raw, out), -1 if mirror else 1)
    points = points * [side, up]
    if up < 0:
        out.say("found", f"vertical axis points down {'by its format' if raw.up == up else 'by its shape'}: turned up")
    if side < 0:
        out.say(
            "repaired",
            "mirrored: the flange lay on the side of +y"
            if kind == "wheel"
            else "mirrored as told: its gauge side lay at +y",
        )
    if points[0, 0] > points[-1, 0]:
        points, lines = points[::-1], lines[::-1]
        out.say("repaired" if raw.layout != "Simpack" else "found", "order reversed: it ran from the field side")
    if kind == "rail" and mirror is None and not raw.placed:
        examine_gauge_side(points, out)
    return points.copy(), lines.copy(), np.array([side, up])


def wheel_turn(points, raw, out) -> tuple[int, int]:
    """(up, side) of a wheel: by its shape; where its format declares another axis, with a warning."""
    poses = wheel_poses(points)
    declared = [pose for pose in poses if raw.up in (None, pose[0])]
    if not poses:
        raise ProfileError(
            f"{raw.path}: no flange found: nothing at either end stands 20 to 45 mm over a tread and is 8 to 45 mm"
            f" thick 10 mm beyond it: is the whole flange measured, is the unit right, and is it a wheel?{raw.as_read}"
        )
    if len(declared or poses) > 1:
        raise ProfileError(f"{raw.path}: both ends look like a flange: cut the line behind the rim")
    if not declared:
        out.say(
            "warning",
            f"by its format the vertical axis points {'up' if raw.up > 0 else 'down'}, by its flange the other way:"
            " taken by its flange",
        )
    return (declared or poses)[0]


def rail_turn(points, raw, out) -> int:
    """+1 where a rail's axis points up: by its format, unless its head, convex, is certainly the other way."""
    shape, certain = rail_up(points)
    if raw.up is None:
        return shape
    if certain and shape != raw.up and not raw.placed:
        out.say(
            "warning",
            f"by its format the vertical axis points {'up' if raw.up > 0 else 'down'}, by its head the other way: taken"
            " by its head",
        )
        return shape
    return raw.up


def asymmetry(points) -> float:
    """How far a rail's top, to the end of its higher side, is from its mirror image in height, on 0.8 of its width
    [m]."""
    level = points[[0, -1], 1].max() + 1e-6
    top = points[points[:, 1] >= level]
    y, half = np.linspace(-0.8, 0.8, 201), np.ptp(top[:, 0]) / 2
    height = np.interp((top[0, 0] + top[-1, 0]) / 2 + half * y, top[:, 0], top[:, 1])
    return float(np.abs(height - height[::-1]).max())


def examine_gauge_side(points, out):
    """The gauge side of a measured rail reaches lower; where neither does the file's own side is kept, which matters
    where the rail is not its own mirror image."""
    left, right = points[0, 1], points[-1, 1]
    if abs(left - right) < 2e-3:
        apart = asymmetry(points)
        out.say(
            "found" if apart < ALIKE else "warning",
            f"gauge side not to be told (both sides reach equally low, the mirror image is {apart * 1e6:.0f} um off):"
            " taken at -y; option mirror says it",
        )
    elif left > right:
        out.say(
            "warning", "the side of +y reaches lower, as gauge sides do: if gauge lies there, use the option mirror"
        )


def without_loops(points, lines, raw, out):
    before = reversals(points)
    if len(before) == 0:
        return points, lines
    keep = without_zigzag(points, int(max(3, MOST_TAKEN_OUT * len(points))))
    if len(reversals(points[keep])):
        at = lines[before[0]]
        more = f" and at {len(before) - 1} more place(s)" if len(before) > 1 else ""
        raise ProfileError(
            f"{raw.path}: line {at}: the line turns back on itself here{more}; "
            "more than 5 % of its points would have to go: measure again, or smooth it first"
        )
    out.say(
        "repaired",
        f"zig-zag: {len(points) - len(keep)} point(s) that turned back taken out, the first on line {lines[before[0]]}",
    )
    return points[keep], lines[keep]


def refuse_loops(points, lines, raw):
    i, j = first_crossing(points)
    if i >= 0:
        y, z = 1e3 * points[i]
        raise ProfileError(
            f"{raw.path}: line {lines[i]}: the profile crosses itself with line {lines[j]} near y={y:.2f} z={z:.2f} mm:"
            " a loop; take out the points between"
        )


def examine_gaps(points, lines, raw, out):
    for i in gaps(points):
        size = np.hypot(*(points[i + 1] - points[i]))
        text = f"gap of {1e3 * size:.1f} mm between lines {lines[i]} and {lines[i + 1]} (y={1e3 * points[i, 0]:.1f} mm)"
        if size > WIDEST_GAP:
            raise ProfileError(f"{raw.path}: {text}: wider than {1e3 * WIDEST_GAP:g} mm, too wide to bridge")
        out.say("warning", f"{text}: bridged by the curve through its ends")


def without_crowd(points, lines, out):
    """Points so near to each other that their tangent is the print's rounding left out: their scatter is small, what it
    makes of a curve is not."""
    noise = noise_level(points)
    if len(points) < 30 or not PRINTED < noise <= SPIKE:
        return points, lines
    keep = thinned(points, kinks(points, noise), min(noise / DENSE[0], DENSE[1]))
    if len(keep) < len(points):
        out.say(
            "repaired",
            f"{len(points) - len(keep)} point(s) left out that lie nearer to their neighbour than"
            f" {1e3 * min(noise / DENSE[0], DENSE[1]):.2g} mm: with {1e6 * noise:.2g} um of scatter they show no"
            " tangent",
        )
    return points[keep], lines[keep]


def without_spikes(points, lines, out):
    """Single points that stand out of a line which is smooth without them, put back in line."""
    if len(points) < 30:
        return points, lines
    found = spikes(points, max(SPIKE, 8.0 * noise_level(points)), int(max(1, MOST_TAKEN_OUT * len(points))))
    if found:
        quiet = points.copy()
        for k in found:
            quiet[k] = from_neighbours(quiet, k)
        far = np.hypot(*(quiet - points).T)
        first = int(np.argmax(far))
        out.say(
            "repaired",
            f"{len(found)} point(s) stood out of the line by up to {1e6 * far.max():.2g} um (line {lines[first]}, y ="
            f" {1e3 * points[first, 0]:.1f} mm): put back in line",
        )
        points = quiet
    return points, lines


def scatter_and_kinks(points: np.ndarray) -> tuple[float, np.ndarray]:
    """Scatter of a line of points across it [m], and its kinks (indices).

    Points that lie dense may scatter together, so those LAG apart are looked at too. Of few points, what bends from one
    to the next is no scatter, and cross-validation leaves it.
    """
    noise = noise_level(points)
    corners, line = kinks(points, noise), points
    apart = points[thinned(points, corners, LAG)]
    if (together := noise_level(apart)) > 1.5 * noise:
        noise, line = together, apart
    if noise <= NOISE:
        return noise, corners
    moved = smoothed(line, kinks(line, noise), noise)[0] - line
    found = float(np.sqrt(np.mean((moved * normals(line)).sum(axis=1) ** 2)))
    return (noise if found > 0.4 * noise else found), corners


def smooth_points(points, smooth, smoothing, out):
    """Points on smoothing splines, and corners. The splines move them by their scatter, which is more than
    cross-validation does: it finds the best positions, but forces follow from slopes and curvatures, and of P8 and P1
    with 0.3 to 20 um of scatter are a third to a tenth as wrong so (tests/rail_fem/test_hard_profiles.py)."""
    out.noise, corners = scatter_and_kinks(points)
    if len(corners):
        where = ", ".join(f"{1e3 * points[k, 0]:.1f}" for k in corners[:5])
        out.say("found", f"{len(corners)} kink(s), kept: y = {where}{' ...' if len(corners) > 5 else ''} mm")
    if not smooth or smoothing is None and out.noise <= NOISE:
        out.say(
            "warning" if out.noise > NOISE else "found",
            f"scatter {1e6 * out.noise:.2g} um: " + ("left as it is" if out.noise > NOISE else "not smoothed"),
        )
        return points, corners
    amount = "smoothed" if smoothing is None else f"and {1e6 * smoothing:.3g} um taken out as told"
    taken = TAKEN * out.noise if smoothing is None else smoothing
    quiet, all_corners = smoothed(points, corners, taken, taken)
    if len(all_corners) > len(corners):
        new = ", ".join(f"{1e3 * points[k, 0]:.1f}" for k in np.setdiff1d(all_corners, corners)[:5])
        out.say(
            "found",
            f"{len(all_corners) - len(corners)} corner(s) that smoothing would have rounded off, kept: y = {new} mm",
        )
    moved = np.hypot(*(quiet - points).T)
    rms = np.sqrt(np.mean(moved**2))
    out.say(
        "repaired",
        f"scatter {1e6 * out.noise:.2g} um {amount}: points moved by {1e6 * moved.max():.2g} um at most,"
        f" {1e6 * rms:.2g} um rms",
    )
    apart = float(np.median(np.hypot(*np.diff(points, axis=0).T)))
    if out.noise > noise_level(points):  # what dense points have in common
        apart = max(apart, LAG)
    if (rough := out.noise * np.sqrt(apart / APART)) > ROUGH:  # a mean of n points scatters by a root of n less
        out.say(
            "warning",
            f"scatter {1e6 * out.noise:.2g} um of points {1e3 * apart:.2g} mm apart, as {1e6 * rough:.2g} um of"
            f" {1e3 * APART:g} mm, > {1e6 * ROUGH:g} um: what smoothing leaves of it moves forces (of four wheels, 20"
            " um an impact by up to 2 % and the largest force on the wing by up to 8 %, 30 um by 4 and 12 %): measure"
            " again, or run several measurements",
        )
    return quiet, all_corners


def examine_walls(points, kind, out):
    angle = np.degrees(np.arctan2(*np.diff(points, axis=0).T[::-1]))
    over = np.abs(angle) > 90.0
    wall = np.abs(np.abs(angle) - 90.0) < 2.0
    for name, where in (("overhanging", over & ~wall), ("vertical", wall)):
        if where.any():
            y = 1e3 * points[:-1][where, 0]
            out.say("found", f"{name} over {where.sum()} step(s), y {y.min():.2f} to {y.max():.2f} mm")
    lean, depth = overhang(points)
    if kind == "rail" and lean > LEANING:
        out.say(
            "warning",
            f"the gauge face leans over by {1e3 * lean:.2f} mm, {1e3 * depth:.1f} mm below the crown: a wheel that"
            " comes from above cannot reach what lies beneath",
        )
