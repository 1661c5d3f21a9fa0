"""Sections of a crossing, measured or drawn, told apart into wing and nose. Axes: geometry.axes."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from geometry.profiles.defects import noise_level, spikes, thinned, without_zigzag
from geometry.profiles.doctor import LAG, MOST_TAKEN_OUT, NOISE, SPIKE, scatter_and_kinks
from geometry.profiles.formats.slices import RailSlices
from geometry.profiles.profile import ProfileError, lengths

FACE_DEPTH = 0.014  # below the section's own top, where a gauge face is placed [m]
CLOSE = 0.15e-3  # of a section's points: where they scatter, those nearer to one another are left out [m]
FLOOR = 0.025  # deeper than this between two bodies is a flangeway [m]
NARROWEST = 2e-3  # of a body [m]
STEEPEST = 1.0  # slope across of a running surface: what is steeper is a face


@dataclass(frozen=True, eq=False)
class SectionBody:
    """One body of one section: distances u (n,) from its gauge face, growing, and heights z (n,) [m]; face : y of the
    face [m]."""

    face: float
    u: np.ndarray
    z: np.ndarray

    @cached_property
    def line(self) -> np.ndarray:
        """(k, 2)  u, z of the points; of those that scatter none nearer than CLOSE to the one before [m]."""
        points = np.column_stack([self.u, self.z])
        if np.diff(lengths(points)).min(initial=CLOSE) >= CLOSE:
            return points
        apart, farther = (points[thinned(points, np.empty(0, int), least)] for least in (CLOSE, LAG))
        return apart if max(noise_level(apart), noise_level(farther)) > NOISE else points

    @cached_property
    def scatter(self) -> tuple[float, np.ndarray]:
        """Scatter [m] and kinks of `line` (indices)."""
        return scatter_and_kinks(self.line)

    @property
    def sag(self) -> float:
        """Of the running surface's arcs over the chords between points, the largest [m]; one bend between straights is
        an edge."""
        step = np.diff(np.column_stack([self.u, self.z]), axis=0)
        turn = np.diff(np.arctan2(step[:, 1], step[:, 0]))
        arc = np.where(turn[1:] * turn[:-1] > 0, np.minimum(abs(turn[1:]), abs(turn[:-1])), 0.0)
        running = self.z[1:-2] > self.z.max() - FACE_DEPTH
        return float(np.max(arc * np.hypot(*step[1:-1].T) / 8, where=running, initial=0.0))


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

    def outliers(self) -> list[tuple[str, float, float, float]]:
        """Single points of running surfaces that stand out of the line of their section, as geometry.profiles.doctor
        finds them: "wing" or "nose", x, y and how far up [m]."""
        found = []
        for name, bodies in (("wing", self.wings), ("nose", self.noses)):
            for x, body in zip(self.x, bodies):
                if body is not None:
                    at, up = standing_out(body)
                    found += [(name, float(x), float(body.face + body.u[k]), float(off)) for k, off in zip(at, up)]
        return found

    def scatter(self) -> float:
        """Of the points across the line of their section, median of all bodies [m]."""
        return float(np.median([body.scatter[0] for body in self.bodies]))

    def sag(self) -> float:
        """Of the arcs over the chords between points, median of all bodies [m]."""
        return float(np.median([body.sag for body in self.bodies]))

    @property
    def bodies(self) -> list[SectionBody]:
        """All that there are."""
        return [body for body in (*self.wings, *self.noses) if body is not None]


def standing_out(body: SectionBody) -> tuple[np.ndarray, np.ndarray]:
    """Indices (k,) of points of a body's running surface that stand out of the line, and by how much in height [m]."""
    points, most = np.column_stack([body.u, body.z]), max(1, int(MOST_TAKEN_OUT * len(body.u)))
    kept = without_zigzag(points, most)
    kept = np.delete(kept, spikes(points[kept], max(SPIKE, 8.0 * noise_level(points)), most) if len(kept) > 8 else [])
    up = body.z - np.interp(body.u, *points[kept].T)
    running = (body.z > body.z.max() - FACE_DEPTH) & (np.abs(np.gradient(body.z, body.u)) < STEEPEST)
    at = np.setdiff1d(np.flatnonzero(running), kept)
    return at, up[at]


def split(points: np.ndarray, x: float) -> tuple[SectionBody | None, SectionBody | None]:
    """Wing (always the body nearest to the field side) and nose (the one before it, if any) of a section."""
    y, z = points.T
    if np.any(np.diff(y) <= 0):
        at = int(np.argmax(np.diff(y) <= 0))
        raise ProfileError(
            f"section at x = {x:g} m: turns back, or stands upright, at y = {y[at]:.5f} m: y must grow from point to"
            " point, from the gauge side to the field side"
        )
    metal = np.concatenate([[False], z > -FLOOR, [False]])
    starts, ends = np.flatnonzero(~metal[:-1] & metal[1:]), np.flatnonzero(metal[:-1] & ~metal[1:])
    found = [body_of(y, z, a, b) for a, b in zip(starts, ends) if y[b - 1] - y[a] > NARROWEST]
    if not found:
        raise ProfileError(
            f"section at x = {x:g} m: nothing is wider than {NARROWEST * 1e3:g} mm within {FLOOR * 1e3:g} mm of rail"
            f" level, its highest point lies at z = {z.max() * 1e3:.2f} mm: is its vertical axis up, and height right?"
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
    FACE_DEPTH; of a nose's tip, all lower than that, from half its height over FLOOR."""
    low = max(start - 1, 0)
    top = start + int(np.argmax(z[start:end]))
    depth = -FACE_DEPTH if z[top] > -FACE_DEPTH else 0.5 * (z[top] - FLOOR)
    face = (
        float(np.interp(depth, np.maximum.accumulate(z[low : top + 1]), y[low : top + 1]))
        if z[low] < depth
        else float(y[start])
    )
    return SectionBody(face, y[low:end] - face, z[low:end])
