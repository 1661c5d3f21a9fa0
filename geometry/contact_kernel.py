"""Outline of a yawed, rolled wheel seen along a prismatic rail, and the places where it comes nearest to the rail.

A prismatic rail and a body of revolution touch where their common normal has no part along the rail. On the wheel's circle of
radius r(s), r' = dr/ds, the normal m(theta) - r' e has none where

    C sin(theta - theta0) = -r' cos(roll) sin(yaw),  C^2 = cos^2 yaw + sin^2 roll sin^2 yaw,  tan theta0 = sin(roll) tan(yaw),

theta forward from the lowest point of the circle, e the axle's direction. Seen along the rail these points are the wheel's outline
(Y, Z)(s), with slope -n_y / n_z, so that contact is a problem of two plane curves. Side axes of geometry.wheelset.

pose : (8,)  lateral place of the pivot, sin and cos of yaw, sin and cos of roll, height of the axle over the pivot, distance along
the axle to the tread datum, radius there. wheel, rail : (4, n) rows of Profile.hermite_table. Heights are over the pivot's.
"""

import numpy as np
from numba import njit

MOST_POINTS = 24
NO_RAIL = 1e3  # gap where there is no rail or no outline [m]


@njit(cache=True, error_model="numpy")
def cubic(at, table):
    """Height, slope, second derivative of a Hermite table at one place inside it; beyond its ends those of the ends."""
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
    return table[1, i] + t * (m0 + t * (c2 + t * c3)), (m0 + t * (2 * c2 + t * 3 * c3)) / h, (2 * c2 + 6 * c3 * t) / (h * h)


@njit(cache=True, error_model="numpy")
def outline(s, wheel, pose):
    """Point of the outline at station s: (there is one, x, y, z, slope dz/dy, dy/ds, sin, cos of theta)."""
    tread, slope, bend = cubic(s, wheel)
    return outline_of(s, tread, slope, bend, pose)


@njit(cache=True, error_model="numpy")
def outline_of(s, tread, slope, bend, pose):
    """The same from the wheel's height, slope and second derivative there."""
    place, sy, cy, sr, cr, lever, arm, datum_radius = pose
    radius, tilt, along = datum_radius - tread, -slope, arm + s
    size = np.sqrt(cy * cy + sr * sr * sy * sy)
    part = -tilt * cr * sy / size
    if abs(part) >= 1.0:
        return False, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0
    rest = np.sqrt(1 - part * part)
    sine, cosine = (part * cy + rest * sr * sy) / size, (rest * cy - part * sr * sy) / size
    # forward f, downward d, axle e; the wheel's circle is along e + radius (sine f + cosine d), the axle lever above the pivot
    mx, my, mz = sine * cy - cosine * sr * sy, sine * sy + cosine * sr * cy, -cosine * cr
    ny, nz = my - tilt * cr * cy, mz - tilt * sr
    x = -along * cr * sy + radius * mx + lever * sr * sy
    y = place + along * cr * cy + radius * my - lever * sr * cy
    z = along * sr + radius * mz + lever * cr
    advance = cr * cy + tilt * my + radius * (cosine * sy - sine * sr * cy) * bend * cr * sy / (size * rest)
    return nz < -1e-3, x, y, z, (-ny / nz if nz < -1e-3 else 0.0), advance, sine, cosine


@njit(cache=True, error_model="numpy")
def gap_at(s, wheel, rail, pose, tip):
    """Vertical gap and its derivative to the station s; where there is no gap the derivative's sign points to where there is."""
    there, _, y, z, slope, advance, _, _ = outline(s, wheel, pose)
    if not there:
        return NO_RAIL, (-1.0 if s < tip else 1.0)
    if y < rail[0, 0]:
        return NO_RAIL, -1.0
    if y > rail[0, rail.shape[1] - 1]:
        return NO_RAIL, 1.0
    height, rail_slope, _ = cubic(y, rail)
    return z - height, (slope - rail_slope) * advance


@njit(cache=True, error_model="numpy")
def gaps_at(stations, wheel, rail, pose, tip):
    """Gap and its derivative (n,) at all stations (4, n): place and the wheel's height, slope, bend there."""
    count, last = stations.shape[1], rail.shape[1] - 1
    gap, tilt = np.empty(count), np.empty(count)
    i = 0
    for k in range(count):
        s = stations[0, k]
        there, _, y, z, slope, advance, _, _ = outline_of(s, stations[1, k], stations[2, k], stations[3, k], pose)
        if not there:
            gap[k], tilt[k] = NO_RAIL, (-1.0 if s < tip else 1.0)
        elif y < rail[0, 0] or y > rail[0, last]:
            gap[k], tilt[k] = NO_RAIL, (-1.0 if y < rail[0, 0] else 1.0)
        else:
            while i > 0 and y < rail[0, i]:
                i -= 1
            while i < last - 1 and y >= rail[0, i + 1]:
                i += 1
            height, rail_slope, _ = cubic_in(y, i, rail)
            gap[k], tilt[k] = z - height, (slope - rail_slope) * advance
    return gap, tilt


@njit(cache=True, error_model="numpy")
def turning_place(low, high, tilt_low, tilt_high, wheel, rail, pose, tip):
    """Station in [low, high] where the gap's derivative changes sign, by Illinois with every fourth step a halving.

    Returns the station, the gap there (NO_RAIL: none found), the derivative. Ends at a width of 1e-13 m, where it stands at a kink.
    """
    side, best, place, least = 0, NO_RAIL, low, 1e300
    for count in range(90):
        s = 0.5 * (low + high) if count % 4 == 3 else low + tilt_low / (tilt_low - tilt_high) * (high - low)
        gap, tilt = gap_at(s, wheel, rail, pose, tip)
        if gap < NO_RAIL and abs(tilt) < least:
            best, place, least = gap, s, abs(tilt)
        if least < 1e-15 or high - low < 1e-13:
            break
        if (tilt > 0) == (tilt_high > 0):
            high, tilt_high = s, tilt
            tilt_low = 0.5 * tilt_low if side == 1 else tilt_low
            side = 1
        else:
            low, tilt_low = s, tilt
            tilt_high = 0.5 * tilt_high if side == -1 else tilt_high
            side = -1
    return place, best, least


@njit(cache=True, error_model="numpy")
def edge_place(s, tread, low, high, rail, pose):
    """Gap and slope of a wheel's edge: the circle at s touches with that slope between low and high at which it lies along the rail.

    NO_RAIL where there is none: the edge is not what touches.
    """
    best, place = NO_RAIL, 0.0
    for _ in range(56):  # a convex edge: the outline is flatter than the rail at `low`, steeper at `high`
        slope = 0.5 * (low + high)
        there, _, y, z, tangent, _, _, _ = outline_of(s, tread, slope, 0.0, pose)
        if not there:
            steeper = slope > 0
        elif y < rail[0, 0] or y > rail[0, rail.shape[1] - 1]:
            steeper = y > rail[0, 0]
        else:
            height, rail_slope, _ = cubic(y, rail)
            steeper = tangent > rail_slope
            best, place = z - height, slope
        if steeper:
            high = slope
        else:
            low = slope
    return best, place


@njit(cache=True, error_model="numpy")
def may_reach(k, gap, tilt, step, level):
    """False where the gap between stations k - 1 and k stays above the level: it falls no faster than the steeper of its ends."""
    if gap[k - 1] >= NO_RAIL or gap[k] >= NO_RAIL:
        return True
    return min(gap[k - 1], gap[k]) - step * max(abs(tilt[k - 1]), abs(tilt[k])) <= level


@njit(cache=True, error_model="numpy")
def nearest_places(stations, wheel, rail, pose, tip, level):
    """Local minima of the gap (3, k): station, gap, wheel's slope there, in order of station, those that may lie below `level` only.

    level : gap [m]; pass -NO_RAIL for the lowest minimum alone
    """
    gap, tilt = gaps_at(stations, wheel, rail, pose, tip)
    last = stations.shape[1] - 1
    found, count = np.empty((3, MOST_POINTS)), 0
    lowest = np.argmin(gap)
    best = gap[lowest]
    if best >= NO_RAIL:
        return found[:, :0]
    for k in range(last + 2):
        if k == 0 or k == last + 1:  # the rims
            i = min(k, last)
            if gap[i] >= NO_RAIL or (tilt[i] > 0) != (k == 0):
                continue
            at, value, rest = stations[0, i], gap[i], 1.0
            steepest = min(10.0, 0.9 / (abs(pose[1]) + 1e-3))
            low, high = (-steepest, stations[2, 0]) if k == 0 else (stations[2, last], steepest)
        elif tilt[k - 1] <= 0 and tilt[k] > 0 and may_reach(k, gap, tilt, stations[0, k] - stations[0, k - 1], max(level, best)):
            at, value, rest = turning_place(stations[0, k - 1], stations[0, k], tilt[k - 1], tilt[k], wheel, rail, pose, tip)
            if value >= NO_RAIL:
                continue
            low, high = cubic(max(at - 1e-9, wheel[0, 0]), wheel)[1], cubic(min(at + 1e-9, wheel[0, wheel.shape[1] - 1]), wheel)[1]
        else:
            continue
        tread, slope, _ = cubic(at, wheel)
        if rest > 1e-9:
            edge, edge_slope = edge_place(at, tread, low, high, rail, pose)
            if edge < NO_RAIL:
                value, slope = edge, edge_slope
        best = min(best, value)
        count = keep(found, count, at, value, slope)
    if count == 0:  # between a fold of the outline and the end of the rail
        count = keep(found, count, stations[0, lowest], gap[lowest], stations[2, lowest])
    return found[:, :count]


@njit(cache=True, error_model="numpy")
def keep(found, count, at, value, slope):
    """Append a place; with the list full the shallowest gives way."""
    if count == found.shape[1]:
        worst = np.argmax(found[1])
        if value >= found[1, worst]:
            return count
        count -= 1
        for k in range(worst, count):
            found[:, k] = found[:, k + 1]
    found[0, count], found[1, count], found[2, count] = at, value, slope
    return count + 1


@njit(cache=True, error_model="numpy")
def roll_arm(s, slope, wheel, pose):
    """d gap / d roll about the pivot at a fixed station [m/rad]: the rotation's displacement normal to the rail's slope."""
    tread, _, _ = cubic(s, wheel)
    _, x, y, z, slope, _, _, _ = outline_of(s, tread, slope, 0.0, pose)
    return pose[2] * (y - pose[0]) - pose[1] * x + slope * pose[2] * z


@njit(cache=True, error_model="numpy")
def side_pose(sign, lateral, yaw, roll, lever, arm, radius):
    """Pose in side axes of a wheelset in track axes."""
    return (sign * lateral, np.sin(sign * yaw), np.cos(yaw), np.sin(sign * roll), np.cos(roll), lever, arm, radius)


@njit(cache=True, error_model="numpy")
def lowest(stations, wheel, rail, pose, tip):
    """Least gap of a side, and its change with roll [m/rad]; NO_RAIL where the wheel stands over no rail."""
    found = nearest_places(stations, wheel, rail, pose, tip, -NO_RAIL)
    if found.shape[1] == 0:
        return NO_RAIL, 0.0
    i = np.argmin(found[1])
    return found[1, i], roll_arm(found[0, i], found[2, i], wheel, pose)


@njit(cache=True, error_model="numpy")
def roll_and_height(left, right, lateral, yaw, roll, lever, arm):
    """Roll at which both wheels are equally near to their rails, height of the pivot at which they touch, what is left of the
    difference [m]. Newton from `roll`: the difference of the least gaps is continuous and grows by about 1.5 m/rad.
    """
    height, difference = 0.0, NO_RAIL
    gap, slope = np.empty(2), np.empty(2)
    for _ in range(60):
        for i in range(2):
            stations, wheel, rail, tip, radius = left if i == 0 else right
            pose = side_pose(1.0 - 2.0 * i, lateral, yaw, roll, lever, arm, radius)
            gap[i], slope[i] = lowest(stations, wheel, rail, pose, tip)
            if gap[i] >= NO_RAIL:
                return roll, 0.0, NO_RAIL
        height, difference = -0.5 * (gap[0] + gap[1]), gap[0] - gap[1]
        step = -difference / max(slope[0] + slope[1], 0.1)
        if abs(difference) < 2e-15 or abs(step) < 1e-16:
            break
        roll += min(max(step, -0.02), 0.02)
    return roll, height, difference


@njit(cache=True, error_model="numpy")
def contact_row(s, slope, wheel, rail, pose):
    """At station s, where the wheel's slope is taken as given (at an edge it is any between two): x, y of the wheel's point from the pivot, z, contact angle, rolling radius, vertical gap, relative curvatures A_xx, A_xt, A_tt.

    t lies in the tangent plane across the rail. Curvatures [1/m] of the gap 1/2 A : (x, t)(x, t), both bodies taken together.
    """
    tread, _, bend = cubic(s, wheel)
    _, x, y, z, tangent, _, sine, cosine = outline_of(s, tread, slope, bend, pose)
    height, rail_slope, rail_bend = cubic(y, rail)
    radius, stretch = pose[7] - tread, np.sqrt(1 + slope * slope)
    round_axle, meridian = 1.0 / (radius * stretch), bend / stretch**3
    # the circle's tangent cos f - sin d: its part along x, and the rest across
    sy, cy, sr, cr = pose[1], pose[2], pose[3], pose[4]
    along = cosine * cy + sine * sr * sy
    angle = np.arctan(tangent)
    across = (cosine * sy - sine * sr * cy) * np.cos(angle) + sine * cr * np.sin(angle)
    rail_curvature = -rail_bend / (1 + rail_slope * rail_slope) ** 1.5
    return (x, y, z, angle, radius, z - height, round_axle * along**2 + meridian * across**2, (round_axle - meridian) * along * across,
            round_axle * across**2 + meridian * along**2 + rail_curvature)
