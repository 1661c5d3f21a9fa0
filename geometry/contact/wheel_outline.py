"""Outline of a yawed, rolled wheel seen along a prismatic rail.

A prismatic rail and a body of revolution touch where their common normal has no part along the rail. On the wheel's
circle of radius r(s), r' = dr/ds, the normal m(theta) - r' e has none where

    C sin(theta - theta0) = -r' cos(roll) sin(yaw),  C^2 = cos^2 yaw + sin^2 roll sin^2 yaw,  tan theta0 = sin(roll)
    tan(yaw),

theta forward from the lowest point of the circle, e the axle's direction. Seen along the rail these points are the
wheel's outline (Y, Z)(s), with slope -n_y / n_z, so that contact is a problem of two plane curves. Side axes of
geometry.wheelset.

pose : (8,)  lateral position of the pivot, sin and cos of yaw, sin and cos of roll, height of the axle over the pivot,
    distance along
the axle to the tread datum, radius there. Tables: (4, n) rows of Profile.hermite_table. Heights are over the pivot's.
"""

import numpy as np

from kernel_cache import njit


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
    t = (at - table[0, i]) / h
    m0, m1, rise = table[2, i] * h, table[3, i + 1] * h, table[1, i + 1] - table[1, i]
    c2, c3 = 3 * rise - 2 * m0 - m1, m0 + m1 - 2 * rise
    return (
        table[1, i] + t * (m0 + t * (c2 + t * c3)),
        (m0 + t * (2 * c2 + t * 3 * c3)) / h,
        (2 * c2 + 6 * c3 * t) / (h * h),
    )


@njit(cache=True, error_model="numpy")
def outline_of(s, tread, slope, bend, pose):
    """Point of the outline at station s from the wheel's height, slope, second derivative: (there is one, x, y, z,
    slope dz/dy, dy/ds, sin, cos of theta)."""
    position, sy, cy, sr, cr, lever, arm, datum_radius = pose
    radius, tilt, along = datum_radius - tread, -slope, arm + s
    size = np.sqrt(cy * cy + sr * sr * sy * sy)
    part = -tilt * cr * sy / size
    if abs(part) >= 1.0:
        return False, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0
    rest = np.sqrt(1 - part * part)
    sine, cosine = (part * cy + rest * sr * sy) / size, (rest * cy - part * sr * sy) / size
    # forward f, downward d, axle e; the wheel's circle is along e + radius (sine f + cosine d), the axle lever above
    # the pivot
    mx, my, mz = sine * cy - cosine * sr * sy, sine * sy + cosine * sr * cy, -cosine * cr
    ny, nz = my - tilt * cr * cy, mz - tilt * sr
    x = -along * cr * sy + radius * mx + lever * sr * sy
    y = position + along * cr * cy + radius * my - lever * sr * cy
    z = along * sr + radius * mz + lever * cr
    advance = cr * cy + tilt * my + radius * (cosine * sy - sine * sr * cy) * bend * cr * sy / (size * rest)
    return nz < -1e-3, x, y, z, (-ny / nz if nz < -1e-3 else 0.0), advance, sine, cosine
