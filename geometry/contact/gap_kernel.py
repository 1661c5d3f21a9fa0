"""Positions where a wheel comes nearest to a rail, and the initial position of a wheelset on two.

The gap is taken as a function of the station s on the wheel alone: at every station at that position of the wheel's
circle that is nearest to the rail along x (geometry.contact.wheel_outline for prismatic rails,
geometry.surfaces.loft_kernel for lofted ones). A lofted rail has a branch of the gap for each of its bodies, and more
where a wheel can touch one body ahead of and behind the axle. Side axes of geometry.wheelset; pose, wheel and prismatic
rail as in geometry.contact.wheel_outline. Heights are over the pivot's. A side of a wheelset is a Side.
"""

from typing import Any, NamedTuple

import numpy as np

from geometry.contact.rail_kinds import branch, branches, closest_point, covered, for_each_rail, prepare, steepness
from geometry.contact.wheel_outline import Pose, cubic, cubic_in, outline_at
from kernel_cache import njit

MOST_POINTS = 24
STATION, GAP, WHEEL_SLOPE, SLOPE_X, BRANCH = range(5)  # rows of a position: the slopes are dz/dy and dz/dx
POSITION = 5
NO_RAIL = 1e3  # gap where there is no rail or no outline [m]
# of `nearby`: by how much the gap may exceed the least [m]; roll [rad] and lowering [m] over which no other station can
# come to touch, up to a slope of 10 of the bodies
NEAR_GAP, NEAR_ROLL, NEAR_LOWERING = 2e-3, 2.5e-4, 0.5e-3


class Side(NamedTuple):
    """One wheel over one rail. stations : (4, n) of the first search: position and the wheel's height, slope, second
    derivative there;  wheel : (4, m) table;  rail : (4, p) table or LoftRail;  tip : station of the flange tip [m];
    radius : at the tread datum [m]"""

    stations: np.ndarray
    wheel: np.ndarray
    rail: Any
    tip: float
    radius: float


class Touch(NamedTuple):
    """Two wheels that just touch: roll, height of the pivot, what is left of the difference of both gaps [m], d gap / d
    roll of each side [m/rad], roll at which the stations near the contact were looked for, Side of each with these
    alone, inf for all stations."""

    roll: float
    height: float
    difference: float
    arm_left: float
    arm_right: float
    scanned: float
    left: Any
    right: Any


class ContactRow(NamedTuple):
    """A position of least gap, or (n,) of them.

    x, y, z : of the wheel's point from the pivot [m];  slope_x, slope_y : dz/dx, dz/dy;  radius : of rolling [m]
    gap : vertical [m];  a_xx, a_xt, a_tt : of the gap 1/2 A : (x, t)(x, t), both bodies taken together, x and t in the
        tangent plane along the rail and across it [1/m]
    """

    x: Any
    y: Any
    z: Any
    slope_x: Any
    slope_y: Any
    radius: Any
    gap: Any
    a_xx: Any
    a_xt: Any
    a_tt: Any


@njit(cache=True, error_model="numpy")
def gap_at(s, wheel, rail, pose, tip):
    """Vertical gap and its derivative to the station s; where there is no gap the derivative's sign points to where
    there is."""
    tread, slope, bend = cubic(s, wheel)
    point = closest_point(s, tread, slope, bend, rail, pose)
    if not point.found:
        return NO_RAIL, (point.away if point.away != 0 else (-1.0 if s < tip else 1.0))
    return point.z - point.rail_z, (point.wheel_slope - point.rail_slope) * point.advance


@njit(cache=True, error_model="numpy")
def gaps_on_prism(stations, wheel, rail, pose, tip):
    """Gap and its derivative (n,) at all stations (4, n): position and the wheel's height, slope, bend there. As
    gap_at, but in one walk along the rail."""
    count, last = stations.shape[1], rail.shape[1] - 1
    gap, tilt = np.empty(count), np.empty(count)
    i = 0
    for k in range(count):
        s = stations[0, k]
        of = outline_at(s, stations[1, k], stations[2, k], stations[3, k], pose)
        y = of.y
        if not of.found:
            gap[k], tilt[k] = NO_RAIL, (-1.0 if s < tip else 1.0)
        elif y < rail[0, 0] or y > rail[0, last]:
            gap[k], tilt[k] = NO_RAIL, (-1.0 if y < rail[0, 0] else 1.0)
        else:
            while i > 0 and y < rail[0, i]:
                i -= 1
            while i < last - 1 and y >= rail[0, i + 1]:
                i += 1
            height, rail_slope, _ = cubic_in(y, i, rail)
            gap[k], tilt[k] = of.z - height, (of.slope - rail_slope) * of.advance
    return gap, tilt


@njit(cache=True, error_model="numpy")
def gaps_on_loft(stations, wheel, rail, pose, tip):
    """The same on a lofted body."""
    count = stations.shape[1]
    gap, tilt = np.empty(count), np.empty(count)
    for k in range(count):
        s = stations[0, k]
        point = closest_point(s, stations[1, k], stations[2, k], stations[3, k], rail, pose)
        if point.found:
            gap[k], tilt[k] = point.z - point.rail_z, (point.wheel_slope - point.rail_slope) * point.advance
        else:
            gap[k], tilt[k] = NO_RAIL, (point.away if point.away != 0 else (-1.0 if s < tip else 1.0))
    return gap, tilt


@for_each_rail(
    prism=lambda stations, wheel, rail, pose, tip: gaps_on_prism(stations, wheel, rail, pose, tip),
    loft=lambda stations, wheel, rail, pose, tip: gaps_on_loft(stations, wheel, rail, pose, tip),
)
def gaps_at(stations, wheel, rail, pose, tip):
    """Gap and its derivative (n,) at all stations (4, n) on either kind of rail."""


@njit(cache=True, error_model="numpy")
def stationary_gap(low, high, tilt_low, tilt_high, wheel, rail, pose, tip):
    """Station in [low, high] where the gap's derivative changes sign, by Illinois with every fourth step a halving.

    Returns the station, the gap there (NO_RAIL: none found), the derivative. Ends at a width of 1e-13 m, where it
    stands at a kink.
    """
    side, best, position, least = 0, NO_RAIL, low, 1e300
    for count in range(90):
        s = (
            0.5 * (low + high)
            if count % 4 == 3 or count > 24
            else low + tilt_low / (tilt_low - tilt_high) * (high - low)
        )
        gap, tilt = gap_at(s, wheel, rail, pose, tip)
        if gap < NO_RAIL and abs(tilt) < least:
            best, position, least = gap, s, abs(tilt)
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
    if least > 1e-9:  # a kink: of both its sides the lower one
        for s in (low, high):
            gap, tilt = gap_at(s, wheel, rail, pose, tip)
            if gap < NO_RAIL and (s == low or gap < best or best >= NO_RAIL):
                best, position, least = gap, s, abs(tilt)
    return position, best, least


@njit(cache=True, error_model="numpy")
def edge_gap(s, tread, low, high, rail, pose):
    """Gap and slope of a wheel's edge: the circle at s touches with that slope between low and high at which it lies
    along the rail.

    NO_RAIL where there is none: the edge is not what touches.
    """
    best, position = NO_RAIL, 0.0
    for _ in range(56):  # a convex edge: the outline is flatter than the rail at `low`, steeper at `high`
        slope = 0.5 * (low + high)
        point = closest_point(s, tread, slope, 0.0, rail, pose)
        if not point.found:
            steeper = point.away > 0 if point.away != 0 else slope > 0
        else:
            steeper = point.wheel_slope > point.rail_slope
            best, position = point.z - point.rail_z, slope
        if steeper:
            high = slope
        else:
            low = slope
    return best, position


@njit(cache=True, error_model="numpy")
def may_reach(k, gap, tilt, step, level):
    """False where the gap between stations k - 1 and k stays above the level: it falls no faster than the steeper of
    its ends."""
    if gap[k - 1] >= NO_RAIL or gap[k] >= NO_RAIL:
        return True
    return min(gap[k - 1], gap[k]) - step * max(abs(tilt[k - 1]), abs(tilt[k])) <= level


@njit(cache=True, error_model="numpy")
def positions_on_branch(stations, wheel, rail, pose, tip, level):
    """Local minima (POSITION, k) of the gap on one branch, in order of station, those that may lie below `level` only.

    level : gap [m]; pass -NO_RAIL for the lowest minimum alone
    """
    gap, tilt = gaps_at(stations, wheel, rail, pose, tip)
    last = stations.shape[1] - 1
    found, count = np.zeros((POSITION, MOST_POINTS)), 0
    lowest = np.argmin(gap)
    best = gap[lowest]
    if best >= NO_RAIL:
        return found[:, :0]
    for k in range(last + 2):
        if k == 0 or k == last + 1:  # the rims
            i = min(k, last)
            if gap[i] >= NO_RAIL or (tilt[i] > 0) != (k == 0):
                continue
            at, value, tilt_left = stations[0, i], gap[i], 1.0
            steepest = min(10.0, 0.9 / (abs(pose.sin_yaw) + 1e-3))
            low, high = (-steepest, stations[2, 0]) if k == 0 else (stations[2, last], steepest)
        elif (
            tilt[k - 1] <= 0
            and tilt[k] > 0
            and may_reach(k, gap, tilt, stations[0, k] - stations[0, k - 1], max(level, best))
        ):
            at, value, tilt_left = stationary_gap(
                stations[0, k - 1], stations[0, k], tilt[k - 1], tilt[k], wheel, rail, pose, tip
            )
            if value >= NO_RAIL:
                continue
            low, high = (
                cubic(max(at - 1e-9, wheel[0, 0]), wheel)[1],
                cubic(min(at + 1e-9, wheel[0, wheel.shape[1] - 1]), wheel)[1],
            )
        else:
            continue
        tread, slope, _ = cubic(at, wheel)
        steep = steepness(rail)
        if tilt_left > 1e-9:
            edge, edge_slope = edge_gap(at, tread, low, high, rail, pose)
            if edge < NO_RAIL:
                value, slope = edge, edge_slope
                steep = steepness(rail)
        best = min(best, value)
        count = keep(found, count, at, value, slope, steep)
    # the branch ends there, not the gap's fall
    cut = np.isnan(tilt[max(lowest - 1, 0)]) or np.isnan(tilt[min(lowest + 1, last)])
    if count == 0 and not cut:  # between a fold of the outline and the end of the rail
        count = keep(found, count, stations[0, lowest], gap[lowest], stations[2, lowest], steepness(rail))
    return found[:, :count]


@njit(cache=True, error_model="numpy")
def nearest_positions(side, pose, level):
    """Local minima (POSITION, k) of a Side's gap on all branches, those that may lie below `level` only, each branch in
    order of station.

    level : gap [m]; pass -NO_RAIL for the lowest minimum alone. Positions that another body of the rail covers are left
        out.
    """
    stations, wheel, rail, tip, _ = side
    if branches(rail) == 1:
        return positions_on_branch(stations, wheel, branch(rail, 0, 0.0), pose, tip, level)
    found, count = np.zeros((POSITION, MOST_POINTS)), 0
    for index in range(branches(rail)):
        track = branch(rail, index, 0.0)
        part = positions_on_branch(stations, wheel, track, pose, tip, level)
        for k in range(part.shape[1]):
            s, gap, slope, steep = part[STATION, k], part[GAP, k], part[WHEEL_SLOPE, k], part[SLOPE_X, k]
            tread, _, bend = cubic(s, wheel)
            point = closest_point(s, tread, slope, bend, branch(rail, index, steep), pose)
            if not point.found or not covered(rail, index, point.x, point.y, point.rail_z):
                count = keep(found, count, s, gap, slope, steep, index)
    return found[:, :count]


@njit(cache=True, error_model="numpy")
def keep(found, count, at, value, slope, steep, index=0.0):
    """Append a position; with the list full the shallowest gives way."""
    if count == found.shape[1]:
        worst = np.argmax(found[GAP])
        if value >= found[GAP, worst]:
            return count
        count -= 1
        for k in range(worst, count):
            found[:, k] = found[:, k + 1]
    found[STATION, count], found[GAP, count] = at, value
    found[WHEEL_SLOPE, count], found[SLOPE_X, count], found[BRANCH, count] = slope, steep, index
    return count + 1


@njit(cache=True, error_model="numpy")
def ready(stations, rail, pose):
    """Make a rail ready for searches about a pose (geometry.contact.rail_kinds.prepare)."""
    prepare(stations, rail, pose)


@njit(cache=True, error_model="numpy")
def roll_arm(position, wheel, rail, pose):
    """d gap / d roll about the pivot at a fixed station of a position (POSITION,) [m/rad]: the rotation's displacement
    normal to the rail's slope."""
    tread = cubic(position[STATION], wheel).value
    track = branch(rail, int(position[BRANCH]), position[SLOPE_X])
    of = closest_point(position[STATION], tread, position[WHEEL_SLOPE], 0.0, track, pose)
    sy, cy = pose.sin_yaw, pose.cos_yaw
    return cy * (of.y - pose.lateral) - sy * of.x + (of.wheel_slope * cy - of.slope_x * sy) * of.z


@njit(cache=True, error_model="numpy")
def side_pose(sign, lateral, yaw, roll, lever, arm, radius):
    """Pose in side axes of a wheelset in track axes."""
    return Pose(sign * lateral, np.sin(sign * yaw), np.cos(yaw), np.sin(sign * roll), np.cos(roll), lever, arm, radius)


@njit(cache=True, error_model="numpy")
def least_gap(side, sign, lateral, yaw, roll, lever, arm):
    """Least gap of a Side, sign +1 left, -1 right, and its change with roll [m/rad]; NO_RAIL where the wheel stands
    over no rail."""
    pose = side_pose(sign, lateral, yaw, roll, lever, arm, side.radius)
    found = nearest_positions(side, pose, -NO_RAIL)
    if found.shape[1] == 0:
        return NO_RAIL, 0.0
    i = np.argmin(found[GAP])
    return found[GAP, i], roll_arm(found[:, i], side.wheel, side.rail, pose)


@njit(cache=True, error_model="numpy")
def nearby(side, sign, lateral, yaw, roll, lever, arm):
    """The Side with the stations only between which the gap is within NEAR_GAP of the least; all where there is no
    rail. Arguments of least_gap."""
    pose = side_pose(sign, lateral, yaw, roll, lever, arm, side.radius)
    least = np.full(side.stations.shape[1], NO_RAIL)
    for index in range(branches(side.rail)):
        track = branch(side.rail, index, 0.0)
        least = np.minimum(least, gaps_at(side.stations, side.wheel, track, pose, side.tip)[0])
    near = np.flatnonzero(least < min(least.min() + NEAR_GAP, NO_RAIL))
    if len(near) == 0:
        return side
    between = side.stations[:, max(near[0] - 1, 0) : near[-1] + 2].copy()
    return Side(between, side.wheel, side.rail, side.tip, side.radius)


@njit(cache=True, error_model="numpy")
def touch(left, right, lateral, yaw, roll, lever, arm):
    """Touch of two wheels that are equally near to their rails. Newton from `roll`: the difference of the least gaps is
    continuous and grows by about 1.5 m/rad.
    """
    height, difference, scanned = 0.0, NO_RAIL, np.inf
    near_left, near_right, gap, slope = left, right, np.empty(2), np.empty(2)
    # the sides may be of two kinds: no loop over them
    prepare(left.stations, left.rail, side_pose(1.0, lateral, yaw, roll, lever, arm, left.radius))
    prepare(right.stations, right.rail, side_pose(-1.0, lateral, yaw, roll, lever, arm, right.radius))
    for count in range(60):
        if count > 0 and abs(roll - scanned) > NEAR_ROLL:
            near_left, near_right = (
                nearby(left, 1.0, lateral, yaw, roll, lever, arm),
                nearby(right, -1.0, lateral, yaw, roll, lever, arm),
            )
            scanned = roll
        gap[0], slope[0] = least_gap(near_left, 1.0, lateral, yaw, roll, lever, arm)
        gap[1], slope[1] = least_gap(near_right, -1.0, lateral, yaw, roll, lever, arm)
        if gap.max() >= NO_RAIL:
            return Touch(roll, 0.0, NO_RAIL, 0.0, 0.0, scanned, left, right)
        height, difference = -0.5 * (gap[0] + gap[1]), gap[0] - gap[1]
        step = -difference / max(slope[0] + slope[1], 0.1)
        if abs(difference) < 2e-15 or abs(step) < 1e-16:
            break
        roll += min(max(step, -0.02), 0.02)
    return Touch(roll, height, difference, slope[0], slope[1], scanned, near_left, near_right)


@njit(cache=True, error_model="numpy")
def roll_and_height(left, right, lateral, yaw, roll, lever, arm):
    """Roll, height and difference of `touch`."""
    found = touch(left, right, lateral, yaw, roll, lever, arm)
    return found.roll, found.height, found.difference


@njit(cache=True, error_model="numpy")
def contact_row(position, wheel, rail, pose):
    """ContactRow at a position (POSITION,), where the wheel's slope is taken as given (at an edge it is any between
    two)."""
    slope = position[WHEEL_SLOPE]
    tread, _, bend = cubic(position[STATION], wheel)
    track = branch(rail, int(position[BRANCH]), position[SLOPE_X])
    of = closest_point(position[STATION], tread, slope, bend, track, pose)
    tangent, rail_slope, sine, cosine, steep = of.wheel_slope, of.rail_slope, of.sine, of.cosine, of.slope_x
    radius, stretch = pose.radius - tread, np.sqrt(1 + slope * slope)
    round_axle, meridian = 1.0 / (radius * stretch), bend / stretch**3
    # the circle's tangent cos f - sin d: its part along x, and the rest across
    sy, cy, sr, cr = pose.sin_yaw, pose.cos_yaw, pose.sin_roll, pose.cos_roll
    forward, left, up = cosine * cy + sine * sr * sy, cosine * sy - sine * sr * cy, sine * cr
    lean = np.sqrt(1 + steep * steep)
    size = np.sqrt(lean * lean + tangent * tangent)
    along = (forward + up * steep) / lean
    across = (-steep * tangent * forward + lean * lean * left + tangent * up) / (size * lean)
    size = np.sqrt(lean * lean + rail_slope * rail_slope)
    ex, ey = -steep * rail_slope / (size * lean), lean / size
    rail_xx, rail_xt = of.z_xx / (lean * lean), (of.z_xx * ex + of.z_xy * ey) / lean
    rail_tt = of.z_xx * ex * ex + 2 * of.z_xy * ex * ey + of.z_yy * ey * ey
    a_xx = round_axle * along**2 + meridian * across**2 - rail_xx / size
    a_xt = (round_axle - meridian) * along * across - rail_xt / size
    a_tt = round_axle * across**2 + meridian * along**2 - rail_tt / size
    return ContactRow(of.x, of.y, of.z, steep, tangent, radius, of.z - of.rail_z, a_xx, a_xt, a_tt)
