"""Profile doctor: judge a raw profile, mend what can be mended and say so, refuse the rest with file, line and reason."""

from dataclasses import dataclass, field

import numpy as np

from geometry.profiles.faults import first_crossing, gaps, kinks, noise_level, repeated, reversals, without_zigzag
from geometry.profiles.smoothing import smoothed
from geometry.profiles.profile import Piece, Profile, ProfileError, line
from geometry.profiles.formats.raw import RawProfile

UNITS = {"mm": 1e-3, "m": 1.0, "inch": 0.0254}
WIDTHS = {"wheel": (0.090, 0.200), "rail": (0.035, 0.300)}  # between the outermost points [m]
FLANGE = (0.020, 0.045)  # height of a flange over its tread [m]
BACK_TO_DATUM = 0.070
NOISE = 5e-6  # scatter that is smoothed [m]; finer is the print of a standard
OFF_DATUM = 0.2e-3  # of the tread from a file's own datum that is worth saying [m]
WIDEST_GAP = 25e-3
MOST_TAKEN_OUT = 0.05  # share of points that mending may take out


@dataclass(frozen=True, eq=False)
class Finding:
    """One thing said about a profile. weight: "found", "mended" or "doubt"."""

    weight: str
    text: str


@dataclass(eq=False)
class Diagnosis:
    """What the doctor found and the profile after mending.

    profile : Profile  in geometry.axes [m];  raw_points : (n, 2) as read, in metres and in the same axes, before mending
    kind, unit_name, noise [m] : what it is
    """

    kind: str
    unit_name: str
    raw_points: np.ndarray
    findings: list[Finding] = field(default_factory=list)
    noise: float = 0.0
    profile: Profile | None = None

    def say(self, weight: str, text: str) -> None:
        self.findings.append(Finding(weight, text))

    def report(self) -> str:
        """All findings, one a line."""
        width = max(len(f.weight) for f in self.findings)
        return "\n".join(f"  {f.weight:<{width}}  {f.text}" for f in self.findings)


def examine(raw: RawProfile, smooth: bool = True) -> Diagnosis:
    """Diagnose and mend; the result's profile lies in geometry.axes, for a wheel with its datum at (0, 0).

    smooth : take out scatter above 5 um (kinks stay)

    Raises ProfileError (file, line, reason) for loops, gaps above 25 mm, no possible unit, zig-zag beyond 5 % of points.
    """
    points, lines = raw.points.astype(float), raw.lines
    kind = raw.kind or guess_kind(raw)
    unit, name, remark = find_unit(raw, kind)
    points = points * unit
    out = Diagnosis(kind, name, points)
    out.say("found", f"{len(points)} points as {raw.layout}, taken as a {kind} in {name}{remark}")
    if raw.kind is None:
        out.say("doubt", f"rail or wheel is not said: taken as a {kind} by its shape; name the kind if that is wrong")
    for note in raw.notes:
        out.say("found", note)
    points, lines = without_repeats(points, lines, out)
    points, lines = upright(points, lines, raw, kind, out)
    points, lines = untangled(points, lines, raw, out)
    refuse_loops(points, lines, raw)
    judge_gaps(points, lines, raw, out)
    points, corners = quietened(points, smooth, out)
    if kind == "wheel":
        points = on_datum(points, out)
    judge_walls(points, out)
    out.profile = with_corners(points, corners, raw.path.name)
    return out


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


def guess_kind(raw: RawProfile) -> str:
    """Wheel where the line is wider than a rail head by any unit's measure and carries a flange at one end."""
    y, z = raw.points.T
    width = np.ptp(y)
    middle = z[np.abs(y - (y.min() + width / 2)) < 0.2 * width]
    ends = [z[y < y.min() + 0.3 * width], z[y > y.max() - 0.3 * width]]
    over = [np.abs(e - np.median(middle)).max() / width if len(middle) and len(e) else 0.0 for e in ends]
    return "wheel" if min(over) < 0.1 and 0.12 < max(over) < 0.4 else "rail"


def find_unit(raw: RawProfile, kind: str) -> tuple[float, str, str]:
    """Length of the unit [m], its name, a remark. The declared unit must fit; else the one unit that makes the width fit."""
    low, high = WIDTHS[kind]
    width = np.ptp(raw.points[:, 0])
    fitting = [name for name, unit in UNITS.items() if low <= width * unit <= high]
    if raw.unit is not None:
        name = next((n for n, u in UNITS.items() if np.isclose(u, raw.unit)), f"units of {raw.unit:g} m")
        if low <= width * raw.unit <= high:
            return raw.unit, name, ""
        hint = f"; it would fit in {fitting[0]}" if fitting else ""
        raise ProfileError(f"{raw.path}: in {name} as declared the {kind} is {1e3 * width * raw.unit:.4g} mm wide, "
                           f"one is {1e3 * low:g} to {1e3 * high:g} mm{hint}: state the unit")  # fmt: skip
    if len(fitting) != 1:
        raise ProfileError(f"{raw.path}: the points span {width:.4g}; a {kind} is {1e3 * low:g} to {1e3 * high:g} mm wide, which fits "
                           f"{'neither mm, m nor inch' if not fitting else ' and '.join(fitting)}: state the unit")  # fmt: skip
    return UNITS[fitting[0]], fitting[0], f" (by its width of {1e3 * width * UNITS[fitting[0]]:.4g} mm)"


def without_repeats(points, lines, out):
    same = repeated(points)
    if same.any():
        out.say("mended", f"{same.sum()} repeated point(s) taken out, the first on line {lines[np.argmax(same)]}")
    points, lines = points[~same], lines[~same]
    if len(points) < 3:
        raise ProfileError(f"{len(points)} different point(s) left; a profile needs at least 3")
    if len(points) < 30:
        out.say("doubt", f"only {len(points)} points: curvature, and with it pressure, is a guess")
    return points, lines


def upright(points, lines, raw, kind, out):
    """z up, y towards the field side, order from the gauge side (wheel: flange back) to the field side."""
    up = raw.up if raw.up is not None else (rail_up(points) if kind == "rail" else wheel_up(points))
    if up < 0:
        points = points * [1.0, -1.0]
        out.say("found", f"vertical axis points down {'by its format' if raw.up else 'by its shape'}: turned up")
    if kind == "wheel":
        flange = points[np.argmin(points[:, 1]), 0]
        field_side = np.median(points[:, 0]) > flange
        if not field_side:
            points = points * [-1.0, 1.0]
            out.say("mended", "mirrored: the flange lay on the side of +y")
    if points[0, 0] > points[-1, 0]:
        points, lines = points[::-1], lines[::-1]
        out.say("mended" if raw.layout != "Simpack" else "found", "order reversed: it ran from the field side")
    if kind == "rail":
        judge_gauge_side(points, out)
    return points.copy(), lines.copy()


def rail_up(points: np.ndarray) -> int:
    """+1 where the ends hang below the middle: a head is convex."""
    y, z = points.T
    chord = np.interp(y, [y[0], y[-1]] if y[0] < y[-1] else [y[-1], y[0]], [z[0], z[-1]] if y[0] < y[-1] else [z[-1], z[0]])
    return 1 if np.median(z - chord) > 0 else -1


def wheel_up(points: np.ndarray) -> int:
    """+1 where the flange, which stands farthest from the tread, points down."""
    z = points[:, 1] - np.median(points[:, 1])
    return 1 if -z.min() > z.max() else -1


def judge_gauge_side(points, out):
    """The gauge side of a measured rail reaches lower; where neither does the file's own side is kept."""
    left, right = points[0, 1], points[-1, 1]
    if abs(left - right) < 2e-3:
        out.say("doubt", "gauge side not to be told (both sides reach equally low): taken at -y")
    elif left > right:
        out.say("doubt", "the side of +y reaches lower, as gauge sides do: if gauge lies there, mirror the profile")


def untangled(points, lines, raw, out):
    before = reversals(points)
    if len(before) == 0:
        return points, lines
    keep = without_zigzag(points, int(max(3, MOST_TAKEN_OUT * len(points))))
    if len(reversals(points[keep])):
        at = lines[before[0]]
        raise ProfileError(f"{raw.path}: line {at}: the line turns back on itself here and at {len(before) - 1} more place(s); "
                           "more than 5 % of its points would have to go: measure again, or smooth it first")  # fmt: skip
    out.say("mended", f"zig-zag: {len(points) - len(keep)} point(s) that turned back taken out, the first on line {lines[before[0]]}")
    return points[keep], lines[keep]


def refuse_loops(points, lines, raw):
    i, j = first_crossing(points)
    if i >= 0:
        y, z = 1e3 * points[i]
        raise ProfileError(f"{raw.path}: line {lines[i]}: the profile crosses itself with line {lines[j]} near y={y:.2f} z={z:.2f} mm: a loop; "
                           "take out the points between")  # fmt: skip


def judge_gaps(points, lines, raw, out):
    for i in gaps(points):
        size = np.hypot(*(points[i + 1] - points[i]))
        text = f"gap of {1e3 * size:.1f} mm between lines {lines[i]} and {lines[i + 1]} (y={1e3 * points[i, 0]:.1f} mm)"
        if size > WIDEST_GAP:
            raise ProfileError(f"{raw.path}: {text}: wider than {1e3 * WIDEST_GAP:g} mm, too wide to bridge")
        out.say("doubt", f"{text}: bridged by the curve through its ends")


def quietened(points, smooth, out):
    out.noise = noise_level(points)
    corners = kinks(points, out.noise)
    if len(corners):
        where = ", ".join(f"{1e3 * points[k, 0]:.1f}" for k in corners[:5])
        out.say("found", f"{len(corners)} kink(s), kept: y = {where}{' ...' if len(corners) > 5 else ''} mm")
    if out.noise <= NOISE:
        out.say("found", f"scatter {1e6 * out.noise:.2g} um: not smoothed")
        return points, corners
    if not smooth:
        out.say("doubt", f"scatter {1e6 * out.noise:.2g} um, left as it is")
        return points, corners
    quiet, all_corners = smoothed(points, corners, out.noise)
    if len(all_corners) > len(corners):
        new = ", ".join(f"{1e3 * points[k, 0]:.1f}" for k in np.setdiff1d(all_corners, corners)[:5])
        out.say("found", f"{len(all_corners) - len(corners)} corner(s) that smoothing would have rounded off, kept: y = {new} mm")
    moved = np.hypot(*(quiet - points).T)
    out.say("mended", f"scatter {1e6 * out.noise:.2g} um smoothed: points moved by {1e6 * moved.max():.2g} um at most, {1e6 * np.sqrt(np.mean(moved**2)):.2g} um rms")
    return quiet, all_corners


def on_datum(points, out):
    """Wheel set so that its flange back lies at y = -70 mm and the tread passes (0, 0); a file's own datum within 2 mm is kept."""
    y, z = points.T
    tread = np.interp(0.0, y, z) if y[0] < 0 < y[-1] else np.nan
    tip = z.min()
    if abs(tread) < 2e-3 and abs(y[0] + BACK_TO_DATUM) < 5e-3 and FLANGE[0] < -tip < FLANGE[1]:
        out.say("found", f"tread datum at the file's own (0, 0): flange {1e3 * -tip:.2f} mm high")
        if abs(tread) > OFF_DATUM:
            out.say("doubt", f"the tread passes {1e3 * tread:+.2f} mm off the file's datum: the wheel's radius is then taken at the datum, not on the tread")
        return points
    y_shift = -BACK_TO_DATUM - y.min()
    moved = points + [y_shift, 0.0]
    top = np.argmin(moved[:, 1])
    z_shift = -np.interp(0.0, moved[top:, 0], moved[top:, 1])
    height = -(moved[:, 1].min() + z_shift)
    if not FLANGE[0] < height < FLANGE[1]:
        raise ProfileError(f"the flange stands {1e3 * height:.4g} mm over the tread 70 mm from its back; one is {1e3 * FLANGE[0]:g} to "
                           f"{1e3 * FLANGE[1]:g} mm: is the whole flange measured, and is it a wheel?")  # fmt: skip
    out.say("mended", f"set on the tread datum 70 mm from the first point: shifted by {1e3 * y_shift:.3f}, {1e3 * z_shift:.3f} mm; flange {1e3 * height:.2f} mm high")
    return moved + [0.0, z_shift]


def judge_walls(points, out):
    angle = np.degrees(np.arctan2(*np.diff(points, axis=0).T[::-1]))
    over = np.abs(angle) > 90.0
    wall = np.abs(np.abs(angle) - 90.0) < 2.0
    for name, where in (("overhanging", over & ~wall), ("vertical", wall)):
        if where.any():
            y = 1e3 * points[:-1][where, 0]
            out.say("found", f"{name} over {where.sum()} step(s), y {y.min():.2f} to {y.max():.2f} mm")
