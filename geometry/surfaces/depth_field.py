"""Depth worn off a running surface in plan, d(x, y) as a smooth field. Axes: geometry.axes.

The depths of an even grid are the coefficients of cubic B-splines, not values at its nodes: the field is continuous in
curvature, nowhere negative, nowhere above the largest coefficient, and its volume is the sum of the coefficients times
the cell to round-off. What that costs is width: a depth is spread by a standard deviation of SPREAD times the spacing.
Source: the cubic B-spline is the density of a sum of four even variables, variance 4/12 of the spacing squared.
"""

from typing import NamedTuple

import numpy as np

from kernel_cache import njit

STEEPEST = np.radians(60)  # angle of a face, beyond which a plan is too coarse to say much
SPREAD = 1 / np.sqrt(3)  # of a depth, over the spacing of the grid
EDGE = 2  # lines at each border that must hold no depth, so that the volume lies within the grid


class DepthField(NamedTuple):
    """Even grid of depths below the unworn surface, counted vertically.

    x0, dx, y0, dy : of the grid [m];  depth : (m, n) coefficients [m];  0 beyond the grid
    """

    x0: float
    dx: float
    y0: float
    dy: float
    depth: np.ndarray

    @property
    def volume(self) -> float:
        """Between the unworn and the worn surface [m3]."""
        return float(self.depth.sum()) * self.dx * self.dy


@njit(cache=True, forceinline=True, error_model="numpy")
def _weight(t, k):
    """Cubic B-spline of the k-th of four neighbours at the part t of an interval."""
    if k == 0:
        return (1.0 - t) ** 3 / 6.0
    if k == 1:
        return (4.0 - 6.0 * t * t + 3.0 * t**3) / 6.0
    if k == 2:
        return (1.0 + 3.0 * t + 3.0 * t * t - 3.0 * t**3) / 6.0
    return t**3 / 6.0


@njit(cache=True, forceinline=True, error_model="numpy")
def depth_at(x, y, field):
    """Depth [m] at one point."""
    m, n = field.depth.shape
    at, across = (x - field.x0) / field.dx, (y - field.y0) / field.dy
    if not (at > -2.0 and at < m + 1.0 and across > -2.0 and across < n + 1.0):
        return 0.0
    i, j = int(np.floor(at)), int(np.floor(across))
    s, t = at - i, across - j
    total = 0.0
    for a in range(4):
        row = i - 1 + a
        if row < 0 or row >= m:
            continue
        line = 0.0
        for b in range(4):
            column = j - 1 + b
            if 0 <= column < n:
                line += _weight(t, b) * field.depth[row, column]
        total += _weight(s, a) * line
    return total


@njit(cache=True)
def depths_at(x, y, field):
    """(n,) depths at n points."""
    out = np.empty(len(x))
    for i in range(len(x)):
        out[i] = depth_at(x[i], y[i], field)
    return out
