"""A crossing from its own measured or drawn sections, and the rigid wheel's path over it. Axes: geometry.axes.

Between two sections each body (wing, nose) keeps its shape beside its gauge face: the face's position and the heights
at equal distances from it are linear in x. So a face that runs aslant stays sharp, where interpolation at equal y would
smear it over its shift between sections.
"""

from dataclasses import dataclass

import numpy as np

from geometry.profiles.formats.slices import RailSlices
from geometry.profiles.profile import Profile, ProfileError
from geometry.surfaces.bodies import NO_METAL
from geometry.wheelset import check_range

FACE_DEPTH = 0.014  # below the section's own top, where a gauge face is placed [m]
FLOOR = 0.025  # deeper than this between two bodies is a flangeway [m]
NARROWEST = 2e-3  # of a body [m]


@dataclass(frozen=True, eq=False)
class SectionBody:
    """One body of one section: distances u (n,) from its gauge face, growing, and heights z (n,) [m]; face : y of the
    face [m]."""

    face: float
    u: np.ndarray
    z: np.ndarray


@dataclass(frozen=True, eq=False)
class SectionCrossing:
    """x : (m,) stations, growing [m];  wings, noses : the body of each station, None where it has none."""

    x: np.ndarray
    wings: tuple[SectionBody | None, ...]
    noses: tuple[SectionBody | None, ...]

    @classmethod
    def from_slices(cls, slices: RailSlices) -> "SectionCrossing":
        """Sections as read_slices gives them (vertical axis as each says)."""
        return cls.from_points(slices.x, [raw.points * [1.0, raw.up or -1] for raw in slices.sections])

    @classmethod
    def from_points(cls, x: np.ndarray, sections: list[np.ndarray]) -> "SectionCrossing":
        """Sections (n, 2) of y, z up [m], y growing. Raises ProfileError where a section turns back or holds no
        body."""
        pairs = tracked([split(points, float(at)) for at, points in zip(x, sections)])
        return cls(np.asarray(x, float), tuple(wing for wing, _ in pairs), tuple(nose for _, nose in pairs))

    def height(self, x: float, y: np.ndarray, body: str) -> np.ndarray:
        """Heights (n,) [m] of "wing" or "nose" at one x and many y; NO_METAL beside it."""
        bodies = self.wings if body == "wing" else self.noses
        i = int(np.clip(np.searchsorted(self.x, x, side="right") - 1, 0, len(self.x) - 2))
        first, second = bodies[i], bodies[i + 1]
        if first is None or second is None:
            return np.full(len(y), NO_METAL)
        t = (x - self.x[i]) / (self.x[i + 1] - self.x[i])
        u = y - ((1 - t) * first.face + t * second.face)
        low, high = (np.interp(u, b.u, b.z, left=NO_METAL, right=NO_METAL) for b in (first, second))
        return np.where((low > NO_METAL) & (high > NO_METAL), (1 - t) * low + t * high, NO_METAL)


def split(points: np.ndarray, x: float) -> tuple[SectionBody | None, SectionBody | None]:
    """Wing (always the body nearest to the field side) and nose (the one before it, if any) of a section."""
    y, z = points.T
    if np.any(np.diff(y) <= 0):
        at = int(np.argmax(np.diff(y) <= 0))
        raise ProfileError(
            f"section at x = {x:g} m: turns back at y = {y[at]:.5f} m: it must run from the gauge side to the field"
            " side"
        )
    metal = np.concatenate([[False], z > -FLOOR, [False]])
    starts, ends = np.flatnonzero(~metal[:-1] & metal[1:]), np.flatnonzero(metal[:-1] & ~metal[1:])
    found = [body_of(y, z, a, b) for a, b in zip(starts, ends) if y[b - 1] - y[a] > NARROWEST]
    if not found:
        raise ProfileError(
            f"section at x = {x:g} m: nothing is wider than {NARROWEST * 1e3:g} mm within {FLOOR * 1e3:g} mm of rail"
            " level: is its vertical axis up?"
        )
    return found[-1], (found[-2] if len(found) > 1 else None)


def points_up(z: np.ndarray) -> int:
    """+1 where the middle of a rail's section, heights z (n,), lies above its ends, else -1."""
    middle = np.median(z[len(z) // 3 : 2 * len(z) // 3])
    return 1 if middle > 0.5 * (z[0] + z[-1]) else -1


def tracked(
    pairs: list[tuple[SectionBody | None, SectionBody | None]],
) -> list[tuple[SectionBody | None, SectionBody | None]]:
    """Bodies told apart along the track: where the wing has ended, the one body that is left is the nose."""
    found: list[tuple[SectionBody | None, SectionBody | None]] = []
    wing = nose = None
    for last, before in pairs:
        if before is None and nose is not None and last is not None:
            ended = wing is None or abs(last.face - nose.face) < abs(last.face - wing.face)
            last, before = (None, last) if ended else (last, None)
        found.append((last, before))
        wing, nose = last, before or nose
    return found


def body_of(y: np.ndarray, z: np.ndarray, start: int, end: int) -> SectionBody:
    """The body of the points start..end with its flank down to the flangeway, seen from where its gauge face passes
    FACE_DEPTH."""
    low = max(start - 1, 0)
    top = start + int(np.argmax(z[start:end]))
    face = (
        float(np.interp(-FACE_DEPTH, np.maximum.accumulate(z[low : top + 1]), y[low : top + 1]))
        if z[low] < -FACE_DEPTH
        else float(y[start])
    )
    return SectionBody(face, y[low:end] - face, z[low:end])


@dataclass(frozen=True, eq=False)
class SectionPath:
    """height (n,) of the axle over where it stands at `plain` [m]; on_nose (n,); point (n, 3) of contact."""

    x: np.ndarray
    height: np.ndarray
    on_nose: np.ndarray
    point: np.ndarray


def section_path(
    crossing: SectionCrossing,
    wheel: Profile,
    x: np.ndarray,
    datum: float,
    radius: float = 0.425,
    plain: float = -0.9,
    spacing: float = 2e-3,
    lateral: float = 0.05e-3,
    reach: float = 0.1,
) -> SectionPath:
    """Path of a rigid wheel, not yawed, with its tread datum at y = datum [m], over axle positions x (n,) [m].

    spacing : of the cuts between which contact ahead and behind is looked for;  lateral : of the positions across [m]
    Error: spacing^2 / (8 radius), 1.2 um, and slope times half of `lateral` at edges, on surfaces as interpolated
    between the sections.
    Raises ProfileError where x leaves the sections.
    """
    check_range(
        "section_path",
        (("radius", radius, 0.1, 1.0), ("spacing", spacing, 1e-4, 0.02), ("lateral", lateral, 1e-6, 1e-3)),
    )
    x = np.asarray(x, float)
    if x.min() - reach < crossing.x[0] or x.max() + reach > crossing.x[-1]:
        raise ProfileError(
            f"path from x = {x.min():g} to {x.max():g} m with reach {reach:g} m leaves the sections, {crossing.x[0]:g}"
            f" to {crossing.x[-1]:g} m"
        )
    s = np.arange(wheel.points[0, 0], wheel.points[-1, 0], lateral)
    tread, y = wheel.height(s), s + datum
    cuts = np.unique(
        np.concatenate(
            [
                np.arange(x.min() - reach, x.max() + reach + spacing, spacing),
                crossing.x[np.abs(crossing.x - x.mean()) < np.ptp(x) / 2 + reach],
            ]
        )
    )
    tops = np.array(
        [[_top(crossing.height(c, y, body), tread) for body in ("wing", "nose")] for c in np.append(cuts, plain)]
    )
    height, which, at = np.empty(len(x)), np.empty(len(x), int), np.empty(len(x), int)
    for k, here in enumerate(x):
        near = np.flatnonzero(np.abs(cuts - here) <= reach)
        rolling = radius - tread[tops[near, :, 1].astype(int)]
        rise = rolling - np.sqrt(rolling**2 - (cuts[near, None] - here) ** 2)
        best = int(np.argmax(tops[near, :, 0] - rise))
        at[k], which[k] = near[best // 2], best % 2
        height[k] = (tops[near, :, 0] - rise).ravel()[best]
    position = tops[at, which, 1].astype(int)
    point = np.column_stack([cuts[at], y[position], tops[at, which, 0] + tread[position]])
    return SectionPath(x, height - tops[-1, 0, 0], which == 1, point)


def _top(height: np.ndarray, tread: np.ndarray) -> tuple[float, int]:
    """Highest of surface less tread, and its index."""
    clear = np.where(height > NO_METAL, height - tread, NO_METAL)
    best = int(np.argmax(clear))
    return float(clear[best]), best
