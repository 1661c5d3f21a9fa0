"""A profile: an ordered line in the (y, z) plane, built from arcs, straight lines and tables. Axes: geometry.axes.

Between its points a profile is a cubic Hermite curve through the exact tangents of the pieces it was built from. A kink
(two tangents at one point) stays a kink.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from geometry.hermite import cubic_between
from kernel_cache import njit

KINK = 2e-3  # standards print coordinates to 1 um: joints meant to be smooth turn by up to 1 um / 1 mm [rad]
APART = 1e-9  # width of a wall, so that z stays a function of y [m]
STEEP = 25.0  # beyond this slope z(y) is interpolated linearly: a cubic in y would overshoot [1]


class ProfileError(ValueError):
    """A profile that cannot be what it is meant to be: says what, where, how large.

    Examples
    --------
    >>> try:
    ...     geometry.wheel_profile("P9")
    ... except geometry.ProfileError as error:
    ...     print("P8" in str(error))
    True
    """


@dataclass(frozen=True)
class Piece:
    """Samples of one smooth curve, in order.

    points : (m, 2)  y, z [m];  angle : (m,)  of the tangent, from +y towards +z [rad]
    curvature : (m,)  d angle / d arc length, positive when turning left [1/m]; NaN where it is not known
    """

    points: np.ndarray
    angle: np.ndarray
    curvature: np.ndarray


def line(start: Sequence[float], end: Sequence[float], spacing: float) -> Piece:
    """Straight piece from start to end (each (2,) [m]), sampled no farther apart than spacing [m]."""
    a, b = np.asarray(start, float), np.asarray(end, float)
    count = max(2, int(np.ceil(np.hypot(*(b - a)) / spacing)) + 1)
    t = np.linspace(0, 1, count)[:, None]
    angle = np.full(count, np.arctan2(b[1] - a[1], b[0] - a[0]))
    return Piece(a + t * (b - a), angle, np.zeros(count))


def arc(start: Sequence[float], end: Sequence[float], radius: float, spacing: float) -> Piece:
    """Circular arc (shorter than a half circle) through start and end (each (2,) [m]).

    radius > 0 turns left (anticlockwise), < 0 turns right. The end points and the radius are exact, the centre follows.
    Raises ProfileError where no such circle exists.
    """
    a, b = np.asarray(start, float), np.asarray(end, float)
    chord = np.hypot(*(b - a))
    if not 0 < chord <= 2 * abs(radius):
        raise ProfileError(
            f"arc of radius {radius:g} m cannot join {tuple(a)} and {tuple(b)}: their distance is {chord:g} m"
        )
    direction = (b - a) / chord
    left = np.array([-direction[1], direction[0]])
    turn = np.sign(radius)
    centre = (a + b) / 2 + turn * left * np.sqrt(radius**2 - chord**2 / 4)
    first = np.arctan2(*(a - centre)[::-1])
    sweep = turn * 2 * np.arcsin(chord / (2 * abs(radius)))
    count = max(3, int(np.ceil(abs(sweep * radius) / spacing)) + 1)
    polar = first + np.linspace(0, sweep, count)
    points = centre + abs(radius) * np.column_stack([np.cos(polar), np.sin(polar)])
    points[0], points[-1] = a, b
    return Piece(points, polar + turn * np.pi / 2, np.full(count, 1 / radius))


def graph(y: np.ndarray, z: np.ndarray, slope: np.ndarray, bend: np.ndarray | None = None) -> Piece:
    """Piece of a function z(y) from its values, slopes dz/dy and (when known) second derivatives, each (m,)."""
    y, z, slope = (np.asarray(v, float) for v in (y, z, slope))
    bend = np.full(len(y), np.nan) if bend is None else np.asarray(bend, float)
    return Piece(np.column_stack([y, z]), np.arctan(slope), bend / (1 + slope**2) ** 1.5)


def spline(y: np.ndarray, z: np.ndarray, first_slope: float, last_slope: float, spacing: float) -> Piece:
    """Cubic spline through a table z(y) (each (m,) [m]) that leaves and arrives with the given slopes."""
    curve = CubicSpline(y, z, bc_type=((1, first_slope), (1, last_slope)))
    dense = np.linspace(y[0], y[-1], max(len(y), int(np.ceil((y[-1] - y[0]) / spacing)) + 1))
    return graph(dense, curve(dense), curve(dense, 1), curve(dense, 2))


@dataclass(frozen=True, eq=False)
class Profile:
    """An ordered line in the (y, z) plane; immutable. Two are equal, and one key of a cache, when their lines are the
    same to the last bit.

    Parameters
    ----------
    points : (n, 2) array
        y, z [m], all different.
    angle_before, angle_after : (n,) array
        Tangent angle on either side of each point [rad]; they differ at kinks only.
    curvature : (n,) array
        d angle / d arc length of the piece that leaves the point [1/m], NaN where not known.
    label, provenance : str
        What it is and where its numbers are from.

    Examples
    --------
    >>> y = np.linspace(-0.03, 0.03, 61)
    >>> crown = geometry.Profile.from_points(np.column_stack([y, -(y**2) / 0.6]))
    >>> crown.is_graph, round(float(crown.height(0.01)) * 1e3, 4)  # [mm]
    (True, -0.1667)
    """

    points: np.ndarray
    angle_before: np.ndarray
    angle_after: np.ndarray
    curvature: np.ndarray
    label: str = ""
    provenance: str = ""

    def __post_init__(self):
        check_points(self.points, self.label)
        for name in ("points", "angle_before", "angle_after", "curvature"):
            array = np.array(getattr(self, name), float)
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def _content(self) -> tuple[bytes, ...]:
        return tuple(array.tobytes() for array in (self.points, self.angle_before, self.angle_after, self.curvature))

    def __eq__(self, other: object) -> bool:
        return self._content() == other._content() if isinstance(other, Profile) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._content())

    @classmethod
    def from_pieces(
        cls, pieces: Sequence[Piece], label: str = "", provenance: str = "", tolerance: float = 2e-6
    ) -> "Profile":
        """Join pieces end to start.

        Parameters
        ----------
        pieces : sequence of Piece
            Arcs, lines and tables.
        label, provenance : str
            What it is and where its numbers are from.
        tolerance : float
            Within which two ends meet [m]; 2 um is twice the print.

        Returns
        -------
        Profile

        Raises
        ------
        ProfileError
            Where two do not meet.
        """
        first = pieces[0]
        angle = unwrap_to(first.angle, 0.0)
        points, before, after, curvature = (list(v) for v in (first.points, angle, angle, first.curvature))
        for piece in pieces[1:]:
            gap = np.hypot(*(piece.points[0] - points[-1]))
            if gap > tolerance:
                raise ProfileError(
                    f"{label}: pieces do not meet at y={points[-1][0]:.6f} z={points[-1][1]:.6f} m, gap {gap:.3g} m"
                )
            angle = unwrap_to(piece.angle, before[-1])
            smooth = abs(angle[0] - before[-1]) < KINK
            joint = (angle[0] + before[-1]) / 2
            before[-1], after[-1] = (joint, joint) if smooth else (before[-1], angle[0])
            curvature[-1] = piece.curvature[0]
            points += list(piece.points[1:])
            before += list(angle[1:])
            after += list(angle[1:])
            curvature += list(piece.curvature[1:])
        return cls(np.array(points), np.array(before), np.array(after), np.array(curvature), label, provenance)

    @classmethod
    def from_points(cls, points: np.ndarray, label: str = "", provenance: str = "") -> "Profile":
        """Profile of a plain point list: tangents from a natural parametric cubic spline.

        Parameters
        ----------
        points : (n, 2) array
            y, z [m], n >= 3.
        label, provenance : str
            What it is and where its numbers are from.

        Returns
        -------
        Profile
        """
        points = np.asarray(points, float)
        check_points(points, label)
        s = lengths(points)
        curve = CubicSpline(s, points, bc_type="natural")
        (dy, dz), (ddy, ddz) = curve(s, 1).T, curve(s, 2).T
        angle = np.unwrap(np.arctan2(dz, dy))
        return cls(points, angle, angle, (dy * ddz - dz * ddy) / np.hypot(dy, dz) ** 3, label, provenance)

    @property
    def arc_length(self) -> np.ndarray:
        """(n,)  length along the line from its first point [m]; chord corrected for the turn within each interval."""
        chord = np.hypot(*np.diff(self.points, axis=0).T)
        turn = self.angle_before[1:] - self.angle_after[:-1]
        return np.concatenate([[0.0], np.cumsum(chord * (1 + turn**2 / 24))])

    @property
    def tangent(self) -> np.ndarray:
        """(n, 2)  unit tangent on leaving each point."""
        return np.column_stack([np.cos(self.angle_after), np.sin(self.angle_after)])

    @property
    def is_graph(self) -> bool:
        """True when y grows along the whole line, so that z is a function of y."""
        return bool(np.all(np.diff(self.points[:, 0]) > 0))

    def graph_part(self) -> "Profile":
        """The longest stretch on which y grows: without the vertical or undercut sides, such as an inclined rail's."""
        grows = np.concatenate([[False], np.diff(self.points[:, 0]) > 1e-12, [False]])
        starts, ends = np.flatnonzero(~grows[:-1] & grows[1:]), np.flatnonzero(grows[:-1] & ~grows[1:])
        longest = int(np.argmax(ends - starts))
        keep = slice(starts[longest], ends[longest] + 1)
        fields = {name: getattr(self, name)[keep] for name in ("points", "angle_before", "angle_after", "curvature")}
        return replace(self, **fields)

    def from_above(self) -> "Profile":
        """What can be seen from above of a line with its metal beneath, such as a rail: z is a function of y.

        Where a side leans over its own foot, what lies beneath the lean is left out and a wall over 1e-9 m joins the
        lean to the foot, which is kept; where a side turns under and stays there, the line ends. Source of the wall: as
        section_loft.upper_line.
        """
        if self.is_graph:
            return self
        top = int(np.argmax(self.points[:, 1]))
        right = seen_outwards(self.points[top:], self.angle_after[top:], self.angle_before[top:])
        left = seen_outwards(self.points[top::-1] * [-1, 1], -self.angle_before[top::-1], -self.angle_after[top::-1])
        points = np.vstack([left[0][:0:-1] * [-1, 1], right[0]])
        after, before = np.concatenate([-left[2][:0:-1], right[1]]), np.concatenate([-left[1][:0:-1], right[2]])
        before[len(left[0]) - 1] = -left[1][0]
        curvature = np.full(len(points), np.nan)
        own = {tuple(p): c for p, c in zip(self.points, self.curvature)}
        curvature[:] = [own.get(tuple(p), np.nan) for p in points]
        return Profile(points, before, after, curvature, self.label, self.provenance)

    def shifted(self, y: float, z: float) -> "Profile":
        """The same line, moved.

        Parameters
        ----------
        y, z : float
            By how much [m].

        Returns
        -------
        Profile
        """
        return replace(self, points=self.points + [y, z])

    def turned(self, angle: float) -> "Profile":
        """The same line, turned about (0, 0) by this angle [rad], anticlockwise."""
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        angles = {"angle_before": self.angle_before + angle, "angle_after": self.angle_after + angle}
        return replace(self, points=self.points @ turn, **angles)

    def height(self, y: np.ndarray) -> np.ndarray:
        """Height by cubic Hermite interpolation. Error: O(spacing^4) on smooth pieces.

        Parameters
        ----------
        y : array
            [m]

        Returns
        -------
        array
            z(y) [m], NaN outside the profile.
        """
        return self._evaluate(y)[0]

    def slope(self, y: np.ndarray) -> np.ndarray:
        """dz/dy (y) [1], NaN outside the profile."""
        return self._evaluate(y)[1]

    def hermite_table(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """y, z, slope after, slope before, each (n,): what the compiled interpolation `hermite` needs.

        Raises ProfileError where y turns back, as z is no function of y there.
        """
        y, z, after, before = self._table
        return y.copy(), z.copy(), after.copy(), before.copy()

    @cached_property
    def _table(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        if not self.is_graph:
            where = self.points[np.argmax(np.diff(self.points[:, 0]) <= 0)]
            raise ProfileError(
                f"{self.label}: z is no function of y, the line turns back at y={where[0]:.6f} z={where[1]:.6f} m"
            )
        y, z = self.points.T
        secant = np.append(np.diff(z) / np.diff(y), 0.0)
        steep = (np.abs(np.tan(self.angle_after)) > STEEP) | (
            np.abs(np.tan(np.append(self.angle_before[1:], 0))) > STEEP
        )
        after = np.where(steep, secant, np.tan(self.angle_after))
        before = np.tan(self.angle_before)
        before[1:] = np.where(steep[:-1], secant[:-1], before[1:])
        return y.copy(), z.copy(), after, before

    def _evaluate(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        y = np.asarray(y, float)
        height, slope = hermite_many(y.ravel(), *self._table)
        return height.reshape(y.shape), slope.reshape(y.shape)


def lengths(line: np.ndarray) -> np.ndarray:
    """(n,)  length along a line (n, 2) from its first point."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])


def along(line: np.ndarray, length: np.ndarray) -> np.ndarray:
    """(m, 2)  points of a line at these lengths."""
    total = lengths(line)
    return np.column_stack([np.interp(length, total, line[:, 0]), np.interp(length, total, line[:, 1])])


def seen_outwards(
    points: np.ndarray, leaving: np.ndarray, reaching: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of one side, from its top towards +y, that no earlier one hides from above; angles on leaving and on
    reaching them.

    points (n, 2), angles (n,) [rad]. A hidden stretch is bridged by a wall: (y0, z0), then (y0 + APART, z) on the line
    where it comes out again.
    """
    seen, first, last, edge = [points[0]], [leaving[0]], [reaching[0]], points[0, 0]
    for i in range(1, len(points)):
        if points[i, 0] <= edge + 1e-12:
            continue
        if points[i - 1, 0] < edge:  # comes out from under the lean between i - 1 and i
            share = (edge + APART - points[i - 1, 0]) / (points[i, 0] - points[i - 1, 0])
            if share < 1:
                out = points[i - 1] + share * (points[i] - points[i - 1])
                chord = np.arctan2(*(points[i] - points[i - 1])[::-1])
                first[-1] = wall = np.arctan2(out[1] - seen[-1][1], APART)
                seen, first, last = [*seen, out], [*first, chord], [*last, wall]
        seen, first, last = [*seen, points[i]], [*first, leaving[i]], [*last, reaching[i]]
        edge = points[i, 0]
    return np.array(seen), np.array(first), np.array(last)


def check_points(points: np.ndarray, label: str) -> None:
    """Raise ProfileError unless points is (n >= 3, 2), finite, without a point repeated in sequence."""
    points = np.asarray(points, float)
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < 3:
        raise ProfileError(f"{label}: a profile needs at least 3 points as (n, 2), got shape {points.shape}")
    bad = ~np.isfinite(points).all(axis=1)
    if bad.any():
        raise ProfileError(f"{label}: {bad.sum()} point(s) not finite, the first at index {np.argmax(bad)}")
    same = np.hypot(*np.diff(points, axis=0).T) < 1e-12
    if same.any():
        at = int(np.argmax(same))
        raise ProfileError(
            f"{label}: point {at + 1} repeats point {at} at y={points[at, 0]:.6f} z={points[at, 1]:.6f} m; remove it"
        )


def unwrap_to(angle: np.ndarray, previous: float) -> np.ndarray:
    """Tangent angles (m,) shifted by whole turns so that the first is nearest to the previous one [rad]."""
    angle = np.unwrap(angle)
    return angle - 2 * np.pi * np.round((angle[0] - previous) / (2 * np.pi))


@njit(cache=True, forceinline=True, error_model="numpy")
def hermite(at, y, z, after, before):
    """Height and slope at one y; NaN outside. Table of Profile.hermite_table; points (n,) with y growing."""
    n = len(y)
    if not (y[0] <= at <= y[n - 1]):
        return np.nan, np.nan
    i = min(np.searchsorted(y, at, side="right"), n - 1) - 1
    h = y[i + 1] - y[i]
    found = cubic_between((at - y[i]) / h, h, z[i], z[i + 1], after[i], before[i + 1])
    return found.value, found.slope


@njit(cache=True, error_model="numpy")
def hermite_many(at, y, z, after, before):
    """Height and slope at many y (m,)."""
    height, slope = np.empty(len(at)), np.empty(len(at))
    for k in range(len(at)):
        height[k], slope[k] = hermite(at[k], y, z, after, before)
    return height, slope
