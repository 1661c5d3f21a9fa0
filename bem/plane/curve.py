"""A smooth plane curve through given points, and its division into elements of a wanted size."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bem.checks import plane_points, point_text
from kernel_cache import njit

MOST_ELEMENTS = 200_000  # of one curve; dense matrices end far below


class CurveError(ValueError):
    """Points through which no curve can be laid."""


def _clean(points: np.ndarray) -> np.ndarray:
    """Points (n, 2) without consecutive duplicates; refuses what is no curve."""
    points = plane_points(points, CurveError)
    if len(points) < 2:
        raise CurveError(f"{len(points)} points: a curve needs two")
    extent = np.ptp(points, axis=0).max()
    step = np.hypot(*np.diff(points, axis=0).T)
    points = points[np.r_[True, step > 1e-12 * extent]]
    if len(points) < 2:
        raise CurveError(f"all points are the same, {point_text(points[0])} m: a curve needs two different ones")
    return points


def _tangents(points: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """Derivative at each point of the parabola through it and its neighbours (Bessel)."""
    step = np.diff(knots)[:, None]
    slope = np.diff(points, axis=0) / step
    if len(points) == 2:
        return np.vstack([slope, slope])
    inner = (step[1:] * slope[:-1] + step[:-1] * slope[1:]) / (step[:-1] + step[1:])
    return np.vstack([2 * slope[:1] - inner[:1], inner, 2 * slope[-1:] - inner[-1:]])


@dataclass(frozen=True)
class Curve:
    """Cubic Hermite curve with tangents from three points: no wiggles beyond the neighbours.

    points (n, 2) [m], knots (n,) chord length [m], tangents (n, 2).
    Error in position: fourth order in the spacing of points on a smooth curve (tests/bem/test_mesh.py).
    """

    points: np.ndarray
    knots: np.ndarray
    tangents: np.ndarray

    @classmethod
    def through(cls, points: np.ndarray) -> Curve:
        """Curve through points (n, 2) [m]; consecutive duplicates are dropped."""
        points = _clean(points)
        knots = np.r_[0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T))]
        return cls(points, knots, _tangents(points, knots))

    @property
    def length(self) -> float:
        """Length of the parameter [m]: the chords' length, just below the arc's."""
        return float(self.knots[-1])

    def at(self, s: np.ndarray) -> np.ndarray:
        """Points (m, 2) at parameters s (m,) [m]."""
        return self._positions(s)[..., :2]

    def direction(self, s: np.ndarray) -> np.ndarray:
        """Unit tangents (m, 2) at parameters s (m,) [m]."""
        return self._positions(s)[..., 2:]

    def _positions(self, s: np.ndarray) -> np.ndarray:
        s = np.asarray(s, float)
        return _positions(np.ascontiguousarray(s.ravel()), self.knots, self.points, self.tangents).reshape(*s.shape, 4)


@njit(cache=True, nogil=True)
def curve_position(s, knots, points, tangents):
    """Point x, y [m] and unit tangent of a Curve's arrays at one parameter s [m]."""
    i = min(max(np.searchsorted(knots, s, side="right") - 1, 0), len(knots) - 2)
    width = knots[i + 1] - knots[i]
    t = (s - knots[i]) / width
    first, leave = (1 + 2 * t) * (1 - t) ** 2, t * (1 - t) ** 2 * width
    second, reach = t**2 * (3 - 2 * t), t**2 * (t - 1) * width
    x = first * points[i, 0] + leave * tangents[i, 0] + second * points[i + 1, 0] + reach * tangents[i + 1, 0]
    y = first * points[i, 1] + leave * tangents[i, 1] + second * points[i + 1, 1] + reach * tangents[i + 1, 1]
    fall, leave, reach = 6 * t * (t - 1) / width, (1 - t) * (1 - 3 * t), t * (3 * t - 2)
    dx = fall * (points[i, 0] - points[i + 1, 0]) + leave * tangents[i, 0] + reach * tangents[i + 1, 0]
    dy = fall * (points[i, 1] - points[i + 1, 1]) + leave * tangents[i, 1] + reach * tangents[i + 1, 1]
    size = np.hypot(dx, dy)
    return x, y, dx / size, dy / size


@njit(cache=True, nogil=True)
def _positions(s, knots, points, tangents):
    positions = np.empty((len(s), 4))
    for k in range(len(s)):
        positions[k, 0], positions[k, 1], positions[k, 2], positions[k, 3] = curve_position(
            s[k], knots, points, tangents
        )
    return positions


def split_at_corners(points: np.ndarray, corner: float) -> list[np.ndarray]:
    """Cut points (n, 2) where the polyline turns by more than `corner` [rad]; the cut point belongs to both sides."""
    points = _clean(points)
    step = np.diff(points, axis=0)
    turn = np.angle((step[1:, 0] + 1j * step[1:, 1]) / (step[:-1, 0] + 1j * step[:-1, 1]))
    cuts = np.flatnonzero(np.abs(turn) > corner) + 1
    ends = np.r_[0, cuts, len(points) - 1]
    return [points[a : b + 1] for a, b in zip(ends[:-1], ends[1:])]


def divide(curve: Curve, size: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Parameters (k + 1,) [m] of the ends of elements of about the wanted size.

    size : points (m, 2) -> wanted element length (m,) [m]
    The count is rounded up, so elements are a little smaller than wanted.
    """
    fine = np.unique(np.concatenate([np.linspace(0, curve.length, 401), curve.knots]))
    density = 1 / size(curve.at(fine))
    while True:  # sample the wanted size finer until it is resolved by the samples
        coarse = np.diff(fine) * np.maximum(density[1:], density[:-1]) > 1.0
        if not coarse.any() or len(fine) > MOST_ELEMENTS:
            break
        middle = (fine[1:] + fine[:-1])[coarse] / 2
        order = np.argsort(np.r_[fine, middle], kind="stable")
        fine, density = np.r_[fine, middle][order], np.r_[density, 1 / size(curve.at(middle))][order]
    count = np.r_[0.0, np.cumsum(np.diff(fine) * (density[1:] + density[:-1]) / 2)]
    if count[-1] > MOST_ELEMENTS:
        raise CurveError(
            f"elements down to {1 / density.max():.3g} m cut a curve of {curve.length:.3g} m into {count[-1]:.3g}, more"
            f" than {MOST_ELEMENTS}: choose a larger size, or keep it to a part of the curve"
        )
    elements = max(int(np.ceil(count[-1] - 1e-9)), 1)
    return np.interp(np.linspace(0, count[-1], elements + 1), count, fine)


def arc(center: tuple[float, float], radius: float, begin: float, end: float, points: int = 181) -> np.ndarray:
    """Points (n, 2) [m] of a circular arc from the angle `begin` to `end` [rad]; ccw when end > begin."""
    angle = np.linspace(begin, end, points)
    return np.column_stack([center[0] + radius * np.cos(angle), center[1] + radius * np.sin(angle)])
