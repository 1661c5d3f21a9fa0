"""Outline of a yawed, rolled wheel seen along a prismatic rail.

A prismatic rail and a body of revolution touch where their common normal has no part along the rail. On the wheel's
circle of radius r(s), r' = dr/ds, the normal m(theta) - r' e has none where

    C sin(theta - theta0) = -r' cos(roll) sin(yaw),  C^2 = cos^2 yaw + sin^2 roll sin^2 yaw,  tan theta0 = sin(roll)
    tan(yaw),

theta forward from the lowest point of the circle, e the axle's direction. Seen along the rail these points are the
wheel's outline (Y, Z)(s), with slope -n_y / n_z, so that contact is a problem of two plane curves. Side axes of
geometry.wheelset.

pose : Pose. Tables: (4, n) rows of Profile.hermite_table. Heights are over the pivot's.
"""

from typing import NamedTuple

from geometry.hermite import cubic_between
from geometry.surfaces.loft_kernel import circle_point
from kernel_cache import njit


class Pose(NamedTuple):
    """How a wheel stands in side axes, about a pivot: lateral position of the pivot [m], sines and cosines of yaw and
    roll, height of the axle over the pivot (lever), distance along the axle to the tread datum (arm), radius there [m].
    """

    lateral: float
    sin_yaw: float
    cos_yaw: float
    sin_roll: float
    cos_roll: float
    lever: float
    arm: float
    radius: float


class OutlinePoint(NamedTuple):
    """Point x, y, z [m] of the outline, its slope dz/dy, dy/ds (advance), sine and cosine of theta; `found`: there is
    one."""

    found: bool
    x: float
    y: float
    z: float
    slope: float
    advance: float
    sine: float
    cosine: float


@njit(cache=True, error_model="numpy")
def cubic(at, table):
    """Height, slope, second derivative of a Hermite table at one position inside it; beyond its ends those of the
    ends."""
    low, high = 0, table.shape[1] - 1
    at = min(max(at, table[0, 0]), table[0, high])
    while high - low > 1:
        middle = (low + high) // 2
        if table[0, middle] > at:
            high = middle
        else:
            low = middle
    return cubic_in(at, low, table)


@njit(cache=True, error_model="numpy")
def cubic_in(at, i, table):
    """The same in interval i."""
    h = table[0, i + 1] - table[0, i]
    return cubic_between((at - table[0, i]) / h, h, table[1, i], table[1, i + 1], table[2, i], table[3, i + 1])


@njit(cache=True, error_model="numpy")
def outline_at(s, tread, slope, bend, pose):
    """OutlinePoint at station s from the wheel's height, slope, second derivative."""
    _, sy, cy, sr, cr, _, _, datum_radius = pose
    of = circle_point(0.0, s, tread, slope, pose)  # which has no slope along a prismatic rail
    if not of.found:
        return OutlinePoint(False, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    spin = (datum_radius - tread) * (of.cosine * sy - of.sine * sr * cy) * bend * of.b / of.steering
    advance = cr * cy - slope * (of.sine * sy + of.cosine * sr * cy) + spin
    below = of.n_z < -1e-3
    return OutlinePoint(below, of.x, of.y, of.z, (-of.n_y / of.n_z if below else 0.0), advance, of.sine, of.cosine)
