"""Height of a lofted rail body with its derivatives, and where a wheel's circle comes nearest to it along x.

A circle of the wheel (station s, geometry.contact.wheel_outline) and a surface z(x, y) are nearest to each other, at
fixed y, where both have the same slope p = dz/dx. With p given the position on the circle is closed:

    C sin(theta - theta0) = -r' b,  b = cos(roll) sin(yaw) - p sin(roll),  q = sin(roll) sin(yaw) + p cos(roll),  C^2 =
    cos^2 yaw + q^2, tan theta0 = q / cos(yaw),

so that p is all there is to find: p = dz/dx at the position that p leads to. For p = 0 this is the outline on a
prismatic rail.

track : LoftTrack, of one branch of the gap; memory : what its rows are stands at SLOPE_X and after
"""

from typing import NamedTuple

import numpy as np

from geometry.hermite import cubic_between
from geometry.surfaces.bodies import NO_METAL
from kernel_cache import njit

# Rows of the memory of a branch: slope p, section and node of the last evaluation, row of `ridges` (0: none), -1 or 1
# below or above that ridge, station of the branch, body.
SLOPE_X, SECTION, NODE, RIDGE, SIDE, STATION, BODY = range(7)
MEMORY = 8
AXLE_X, BRANCHES = 0, 1  # rows of `position`
WIDEST = 0.25  # largest slope dz/dx of a surface at a contact
CLOSE = 1e-12  # of the slope p: moves the position by radius times that [m]


class LoftTrack(NamedTuple):
    """One body of a lofted rail under one branch of the gap, see geometry.surfaces.lofted_rail.

    x : (S,) of all sections [m];  nodes : (N, 8);  body : (4,) first section, number of sections, nodes of each, first
        node;  memory : (MEMORY,)
    position : (2,) x of the axle's middle [m], number of branches
    ridges : (1 + 2 windows, stations) stations; for each branch, p at which the gap along x is highest between it and
        its neighbour; for each, where that ridge ends
    """

    x: np.ndarray
    nodes: np.ndarray
    body: np.ndarray
    memory: np.ndarray
    position: np.ndarray
    ridges: np.ndarray


class LoftRail(NamedTuple):
    """All bodies of a lofted rail and the branches of the gap over them: as LoftTrack, with bodies (b, 4), windows
    (branches, MEMORY), one memory each, and wavy (S,)."""

    x: np.ndarray
    nodes: np.ndarray
    bodies: np.ndarray
    windows: np.ndarray
    position: np.ndarray
    ridges: np.ndarray
    wavy: np.ndarray


class SurfacePoint(NamedTuple):
    """Height z [m] of a lofted body and its derivatives at one x, y; beyond, aside : -1 before, 1 behind its ends, 0
    over it. Aside it is level, at NO_METAL."""

    beyond: int
    aside: int
    z: float
    z_x: float
    z_y: float
    z_xx: float
    z_xy: float
    z_yy: float


class CirclePoint(NamedTuple):
    """Point x, y, z [m] of a wheel's circle, n_y and n_z of its normal, sine and cosine of theta, C cos(theta -
    theta0) (steering) and b; `found`: there is one."""

    found: bool
    x: float
    y: float
    z: float
    n_y: float
    n_z: float
    sine: float
    cosine: float
    steering: float
    b: float


class ClosestPoint(NamedTuple):
    """Where a wheel's circle is nearest to a rail at fixed y: x, y, z of the wheel's point and height of the rail [m],
    slopes dz/dy of wheel and rail, dy/ds (advance), sine and cosine of theta, dz/dx of both, the rail's second
    derivatives [1/m].

    Not found: away is -1 or 1 on this or that side of the rail, 0 where the wheel has no outline, NaN beyond the end of
    a branch.
    """

    found: bool
    away: float
    x: float
    y: float
    z: float
    rail_z: float
    wheel_slope: float
    rail_slope: float
    advance: float
    sine: float
    cosine: float
    slope_x: float
    z_xx: float
    z_xy: float
    z_yy: float


@njit(cache=True, error_model="numpy")
def no_point(away):
    """ClosestPoint where there is none."""
    return ClosestPoint(False, away, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0)


@njit(cache=True, error_model="numpy")
def loft_at(x, y, track):
    """SurfacePoint at (x, y) [m].

    Between two sections every node's y, z and chord slopes run along a cubic in x; between two nodes z is a cubic in y.
    """
    xs, nodes, body, memory = track.x, track.nodes, track.body, track.memory
    first, last, n = body[0], body[0] + body[1] - 1, body[2]
    beyond = 0
    if x < xs[first]:
        x, beyond = xs[first], -1
    elif x > xs[last]:
        x, beyond = xs[last], 1
    i = int(memory[SECTION])
    while i > first and x < xs[i]:
        i -= 1
    while i < last - 1 and x > xs[i + 1]:
        i += 1
    d = xs[i + 1] - xs[i]
    t = (x - xs[i]) / d
    row, next_row = body[3] + (i - first) * n, body[3] + (i - first + 1) * n
    j = int(memory[NODE])
    near, far = row + j, next_row + j
    y0, y1 = _along_x(nodes, near, far, 0, t, d), _along_x(nodes, near + 1, far + 1, 0, t, d)
    while y < y0.value and j > 0:
        j, near, far, y1 = j - 1, near - 1, far - 1, y0
        y0 = _along_x(nodes, near, far, 0, t, d)
    while y > y1.value and j < n - 2:
        j, near, far, y0 = j + 1, near + 1, far + 1, y1
        y1 = _along_x(nodes, near + 1, far + 1, 0, t, d)
    memory[SECTION], memory[NODE] = i, j
    if y < y0.value:
        return SurfacePoint(beyond, -1, NO_METAL, 0.0, 0.0, 0.0, 0.0, 0.0)
    if y > y1.value:
        return SurfacePoint(beyond, 1, NO_METAL, 0.0, 0.0, 0.0, 0.0, 0.0)
    z0, z1 = _along_x(nodes, near, far, 1, t, d), _along_x(nodes, near + 1, far + 1, 1, t, d)
    m0, m1 = _along_x(nodes, near, far, 2, t, d), _along_x(nodes, near, far, 3, t, d)
    # z = F(u, x), y = G(u, x) = y0 + u h
    h, h_x, h_xx = y1.value - y0.value, y1.slope - y0.slope, y1.second - y0.second
    u = (y - y0.value) / h
    f = cubic_between(u, 1.0, z0.value, z1.value, m0.value, m1.value)
    f_x = cubic_between(u, 1.0, z0.slope, z1.slope, m0.slope, m1.slope)
    f_xx = cubic_between(u, 1.0, z0.second, z1.second, m0.second, m1.second)
    g_x, g_xx = y0.slope + u * h_x, y0.second + u * h_xx
    z_y = f.slope / h
    z_x = f_x.value - z_y * g_x
    z_xy = (f_x.slope - f.second / h * g_x - z_y * h_x) / h
    u_x = -g_x / h
    z_xx = f_xx.value + f_x.slope * u_x - z_xy * g_x - z_y * (g_xx + h_x * u_x)
    return SurfacePoint(beyond, 0, f.value, z_x, z_y, z_xx, z_xy, f.second / (h * h))


@njit(cache=True, error_model="numpy", forceinline=True)
def _along_x(nodes, near, far, column, t, d):
    """A node's y, z or chord slope between two sections, d [m] apart, and its derivatives by x."""
    return cubic_between(t, d, nodes[near, column], nodes[far, column], nodes[near, column + 4], nodes[far, column + 4])


@njit(cache=True, error_model="numpy")
def circle_point(p, s, tread, slope, pose):
    """CirclePoint at station s where the wheel has the slope dz/dx = p."""
    position, sy, cy, sr, cr, lever, arm, datum_radius = pose
    radius, tilt, along = datum_radius - tread, -slope, arm + s
    q, b = sr * sy + p * cr, cr * sy - p * sr
    size = np.sqrt(cy * cy + q * q)
    part = -tilt * b / size
    if abs(part) >= 1.0:
        return CirclePoint(False, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0)
    other = np.sqrt(1 - part * part)
    sine, cosine = (part * cy + other * q) / size, (other * cy - part * q) / size
    # forward f, downward d, axle e; the wheel's circle is along e + radius (sine f + cosine d), the axle lever above
    # the pivot
    mx, my, mz = sine * cy - cosine * sr * sy, sine * sy + cosine * sr * cy, -cosine * cr
    x = -along * cr * sy + radius * mx + lever * sr * sy
    y = position + along * cr * cy + radius * my - lever * sr * cy
    z = along * sr + radius * mz + lever * cr
    return CirclePoint(True, x, y, z, my - tilt * cr * cy, mz - tilt * sr, sine, cosine, size * other, b)


@njit(cache=True, error_model="numpy")
def closest_on_loft(s, tread, slope, bend, track, pose):
    """As geometry.contact.rail_kinds.closest_point, on a lofted body: Newton on p, kept between a position where the
    gap falls with p and one where it rises.

    On an edge that runs across, dz/dx jumps past p: there the surface's slope is that mean of both sides' with dz/dx =
    p.
    """
    memory, radius, tilt = track.memory, pose.radius - tread, -slope
    sy, cy, sr, cr = pose.sin_yaw, pose.cos_yaw, pose.sin_roll, pose.cos_roll
    low, high = window(s, track)
    first, last = low, high
    if low >= high:
        return no_point(np.nan)
    p = min(max(memory[SLOPE_X], low), high)
    tried_low, tried_high, at_edge = False, False, False
    # surface's slopes at both ends of the bracket, where there is a surface
    low_x, low_y, high_x, high_y = np.inf, 0.0, -np.inf, 0.0
    while True:
        circle = circle_point(p, s, tread, slope, pose)
        if not circle.found:
            return no_point(0.0)
        sine, cosine = circle.sine, circle.cosine
        rail = loft_at(track.position[AXLE_X] + circle.x, circle.y, track)
        beyond, zx, zy = rail.beyond, rail.z_x, rail.z_y
        turn = -circle.n_z / circle.steering  # d theta / dp
        forth, left = radius * (cosine * cy + sine * sr * sy), radius * (cosine * sy - sine * sr * cy)
        rate = 1 - (rail.z_xx * forth + rail.z_xy * left) * turn
        miss = p - zx if beyond == 0 else float(beyond)
        if abs(miss) < CLOSE and rate > 0 or at_edge:
            break
        # on the ridge that bounds the branch from below the gap falls too
        if miss < 0 or abs(miss) < CLOSE and p <= first:
            low, low_x, low_y = p, (zx if beyond == 0 else np.inf), zy
        else:
            high, high_x, high_y = p, (zx if beyond == 0 else -np.inf), zy
        if low == last or high == first:  # steeper than looked for
            return no_point(np.nan)
        newer = p - miss / rate
        if high - low < CLOSE:
            at_edge = True
            newer = high if beyond < 0 else (low if beyond > 0 else p)
            if newer == p:
                break
        elif beyond != 0 or rate < 0.05:
            newer = 0.5 * (low + high)
        elif newer <= low and low == first and not tried_low:
            newer, tried_low = low, True
        elif newer >= high and high == last and not tried_high:
            newer, tried_high = high, True
        elif not low < newer < high:
            newer = 0.5 * (low + high)
        p = newer
    memory[SLOPE_X] = p
    if beyond != 0 or circle.n_z > -1e-3:
        return no_point(0.0)
    if rail.aside != 0:
        return no_point(float(rail.aside))
    spin = bend * circle.b / circle.steering  # d theta / ds at fixed p
    mx, my = sine * cy - cosine * sr * sy, sine * sy + cosine * sr * cy
    x_s, y_s = -cr * sy + tilt * mx + forth * spin, cr * cy + tilt * my + left * spin
    if abs(miss) < CLOSE and rate > 0:
        p_s = (rail.z_xx * x_s + rail.z_xy * y_s) / rate
    else:
        jump_x, jump_y = 1.0, 0.0
        if np.isfinite(low_x) and np.isfinite(high_x):
            share = (p - high_x) / (low_x - high_x)
            zy = share * low_y + (1 - share) * high_y
            jump_x, jump_y = low_x - high_x, low_y - high_y
        p_s = -(jump_x * x_s + jump_y * y_s) / (turn * (jump_x * forth + jump_y * left))
    x, y, z, slope, advance = circle.x, circle.y, circle.z, -circle.n_y / circle.n_z, y_s + left * turn * p_s
    bends = rail.z_xx, rail.z_xy, rail.z_yy
    return ClosestPoint(True, 0.0, x, y, z, rail.z, slope, zy, advance, sine, cosine, p, bends[0], bends[1], bends[2])


@njit(cache=True, error_model="numpy")
def window(s, track):
    """Least and largest slope p of a branch at a station."""
    memory, ridges = track.memory, track.ridges
    row = int(memory[RIDGE])
    if row == 0:
        return -WIDEST, WIDEST
    k = min(max(np.searchsorted(ridges[0], s) - 1, 0), ridges.shape[1] - 2)
    here, there = ridges[row, k], ridges[row, k + 1]
    if abs(here) >= WIDEST or abs(there) >= WIDEST:
        ridge = here if s <= ridges[row + ridges.shape[0] // 2, k] else there
    else:
        ridge = here + (s - ridges[0, k]) / (ridges[0, k + 1] - ridges[0, k]) * (there - here)
    return (-WIDEST, ridge) if memory[SIDE] < 0 else (ridge, WIDEST)


@njit(cache=True, error_model="numpy")
def slope_excess(p, s, tread, slope, track, pose):
    """p less the surface's slope at the position that p leads to, and whether there is such a position: the gap along x
    falls where it is negative."""
    circle = circle_point(p, s, tread, slope, pose)
    if not circle.found or circle.n_z > -1e-3:
        return 0.0, False
    rail = loft_at(track.position[AXLE_X] + circle.x, circle.y, track)
    return (p - rail.z_x if rail.beyond == 0 else float(rail.beyond)), rail.aside == 0
