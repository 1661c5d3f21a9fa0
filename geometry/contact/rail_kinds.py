"""Where a circle of the wheel is closest to a rail, for both kinds of rail that the contact kernels know.

rail, of one side : a table (4, n) of a prismatic rail, or the LoftRail of a surface
track, of one branch of the gap : the table itself, or the LoftTrack of the body with the window of slopes dz/dx that
    the branch lies in
"""

import functools
import inspect
from collections.abc import Callable

import numpy as np
from numba import types
from numba.extending import overload

from geometry.contact.wheel_outline import cubic, outline_at
from geometry.hermite import cubic_between
from geometry.surfaces.loft_kernel import (
    AXLE_X,
    BODY,
    BRANCHES,
    SLOPE_X,
    WIDEST,
    ClosestPoint,
    LoftTrack,
    closest_on_loft,
    loft_at,
    no_point,
    slope_excess,
)
from kernel_cache import njit

SCANNED = 49  # slopes dz/dx between -WIDEST and WIDEST at which further branches are looked for
EVERY = 4  # th station only
MOST_WINDOWS = 8


def for_each_rail(prism: Callable, loft: Callable) -> Callable:
    """Decorator: compiled code that calls the function runs `prism` where its argument `rail` or `track` is that of a
    prismatic rail, and `loft` where it is that of a lofted one. Both take the function's own arguments. Called
    elsewhere it raises NotImplementedError."""

    def declare(function: Callable) -> Callable:
        signature = inspect.signature(function)
        deciding = next(k for k, name in enumerate(signature.parameters) if name in ("rail", "track"))

        @functools.wraps(function)
        def dispatched(*arguments):
            raise NotImplementedError(f"{function.__name__} is for compiled code only")

        def chosen(*kinds):
            return prism if isinstance(kinds[deciding], types.Array) else loft

        chosen.__signature__ = signature  # type: ignore[attr-defined]  # numba holds those of prism and loft to it
        overload(dispatched)(chosen)
        return dispatched

    return declare


@njit(cache=True, error_model="numpy")
def closest_on_prism(s, tread, slope, bend, rail, pose):
    of = outline_at(s, tread, slope, bend, pose)
    if not of.found:
        return no_point(0.0)
    if of.y < rail[0, 0] or of.y > rail[0, rail.shape[1] - 1]:
        return no_point(-1.0 if of.y < rail[0, 0] else 1.0)
    (height, slope, bend), (_, x, y, z, wheel_slope, advance, sine, cosine) = cubic(of.y, rail), of
    return ClosestPoint(True, 0.0, x, y, z, height, wheel_slope, slope, advance, sine, cosine, 0.0, 0.0, 0.0, bend)


@for_each_rail(
    prism=lambda s, tread, slope, bend, track, pose: closest_on_prism(s, tread, slope, bend, track, pose),
    loft=lambda s, tread, slope, bend, track, pose: closest_on_loft(s, tread, slope, bend, track, pose),
)
def closest_point(s, tread, slope, bend, track, pose):
    """ClosestPoint of the wheel's circle at station s, its height, slope and second derivative given, to the rail at
    fixed y."""


@for_each_rail(prism=lambda rail: 1, loft=lambda rail: int(rail.position[BRANCHES]))
def branches(rail):
    """Number of branches of the gap."""


@for_each_rail(prism=lambda rail, index, slope: rail, loft=lambda rail, index, slope: loft_branch(rail, index, slope))
def branch(rail, index, slope):
    """Track of one branch, to be followed from where dz/dx = slope."""


@njit(cache=True, error_model="numpy")
def loft_branch(rail, index, slope):
    rail.windows[index, SLOPE_X] = slope
    return track_on(rail, int(rail.windows[index, BODY]), index)


@njit(cache=True, error_model="numpy")
def track_on(rail, body, index):
    """LoftTrack of a body, with the memory of one branch."""
    return LoftTrack(rail.x, rail.nodes, rail.bodies[body], rail.windows[index], rail.position, rail.ridges)


@for_each_rail(prism=lambda track: 0.0, loft=lambda track: track.memory[SLOPE_X])
def steepness(track):
    """dz/dx where the branch was last followed to."""


@for_each_rail(
    prism=lambda rail, index, x, y, z: False, loft=lambda rail, index, x, y, z: covered_by_loft(rail, index, x, y, z)
)
def covered(rail, index, x, y, z):
    """Whether another body of the rail lies higher over (x, y)."""


@njit(cache=True, error_model="numpy")
def covered_by_loft(rail, index, x, y, z):
    body = int(rail.windows[index, BODY])
    for k in range(int(rail.position[BRANCHES])):
        other = int(rail.windows[k, BODY])
        if other != body:
            found = loft_at(rail.position[AXLE_X] + x, y, track_on(rail, other, k))
            if found.beyond == 0 and found.aside == 0 and found.z > z + 1e-9:
                return True
    return False


@for_each_rail(
    prism=lambda stations, rail, pose: None, loft=lambda stations, rail, pose: find_branches(stations, rail, pose)
)
def prepare(stations, rail, pose):
    """Find the branches of the gap: one for every body in reach, two where the gap along x has two minima. A prismatic
    rail needs none."""


@njit(cache=True, error_model="numpy")
def start_branch(rail, count, body, side, seed):
    first, sections, n = rail.bodies[body, 0], rail.bodies[body, 1], rail.bodies[body, 2]
    before = np.searchsorted(rail.x[first : first + sections], rail.position[AXLE_X]) - 1
    section = min(max(before, 0), sections - 2) + first
    row = 0.0 if side == 0 else count + 1.0
    rail.windows[count] = np.array([0.0, section, n // 2, row, side, seed, body, 0.0])


@njit(cache=True, error_model="numpy")
def find_branches(stations, rail, pose):
    """Branches of all bodies within reach of the wheel."""
    ridges, axle = rail.ridges, rail.position[AXLE_X]
    count, reach = 0, 1.2 * WIDEST * pose.radius
    for b in range(rail.bodies.shape[0]):
        first, end = rail.bodies[b, 0], rail.bodies[b, 0] + rail.bodies[b, 1]
        if rail.x[first] > axle + reach or rail.x[end - 1] < axle - reach or count > MOST_WINDOWS - 2:
            continue
        start_branch(rail, count, b, 0, 0.0)
        near = (rail.x[first:end] > axle - reach) & (rail.x[first:end] < axle + reach)
        seed = -1
        if rail.wavy[first:end][near].any():
            track = track_on(rail, b, count)
            seed = find_ridges(stations, track, ridges[count + 1], ridges[count + 1 + MOST_WINDOWS], pose)
        if seed >= 0:
            ridges[count + 2], ridges[count + 2 + MOST_WINDOWS] = ridges[count + 1], ridges[count + 1 + MOST_WINDOWS]
            start_branch(rail, count, b, -1, stations[0, seed])
            start_branch(rail, count + 1, b, 1, stations[0, seed])
            count += 1
        count += 1
    rail.position[BRANCHES] = count


@njit(cache=True, error_model="numpy")
def find_ridges(stations, track, ridge, ends, pose):
    """Fill ridge (stations,): p at which the gap along x is highest between two minima; WIDEST or -WIDEST where all
    lies below or above it; and ends (stations,): where in the interval behind a station the ridge begins or ends.
    Returns the station where the wheel is nearest among those with a ridge, -1: none. Of several ridges that nearest to
    the neighbour's; where it has ended, what is left belongs to one side.
    """
    n, best, seed = stations.shape[1], 1e300, -1
    ridge[:] = np.inf
    for k in range(0, n, EVERY):
        at = ridge_at(stations[0, k], stations[1, k], stations[2, k], 0.0, track, pose)
        if at < np.inf:
            track.memory[SLOPE_X] = 0.0
            point = closest_on_loft(stations[0, k], stations[1, k], stations[2, k], stations[3, k], track, pose)
            if point.found and point.z - point.rail_z < best:
                best, seed = point.z - point.rail_z, k
                ridge[k] = at
    if seed < 0:
        return seed
    for step in (-1, 1):
        last, k = ridge[seed], seed + step
        while 0 <= k < n:
            at = np.inf
            if abs(ridge[k - step]) < WIDEST:
                at = ridge_at(stations[0, k], stations[1, k], stations[2, k], last, track, pose)
            if at < np.inf:
                ridge[k] = last = at
            elif abs(ridge[k - step]) < WIDEST:
                track.memory[SLOPE_X] = last
                point = closest_on_loft(stations[0, k], stations[1, k], stations[2, k], stations[3, k], track, pose)
                ridge[k] = WIDEST if not point.found or point.slope_x < last else -WIDEST
                ends[min(k, k - step)] = ridge_end(stations, k - step, k, last, track, pose)
            else:
                ridge[k] = ridge[k - step]
            k += step
    return seed


@njit(cache=True, error_model="numpy")
def ridge_end(stations, inside, outside, last, track, pose):
    """Station between two at which a ridge ends, by halving; the wheel a cubic between them."""
    a, b = min(inside, outside), max(inside, outside)
    d, low, high = stations[0, b] - stations[0, a], stations[0, inside], stations[0, outside]
    for _ in range(16):
        s = 0.5 * (low + high)
        tread = cubic_between(
            (s - stations[0, a]) / d, d, stations[1, a], stations[1, b], stations[2, a], stations[2, b]
        )
        at = ridge_at(s, tread.value, tread.slope, last, track, pose)
        if at < np.inf:
            low = s
        else:
            high = s
    return 0.5 * (low + high)


@njit(cache=True, error_model="numpy")
def ridge_at(s, tread, slope, near, track, pose):
    """The ridge at station s nearest to a slope p; inf: none."""
    found, falls, before = np.inf, 0.0, 0.0
    for m in range(SCANNED):
        t = 2 * m / (SCANNED - 1) - 1
        p = WIDEST * t * (0.15 + 0.85 * t * t)  # dense about 0, where two minima may be near to each other
        excess, over = slope_excess(p, s, tread, slope, track, pose)
        if not over:
            falls = 0.0
            continue
        if falls > 0 and excess < 0:
            low, high = before, p
            for _ in range(20):
                middle = 0.5 * (low + high)
                if slope_excess(middle, s, tread, slope, track, pose)[0] > 0:
                    low = middle
                else:
                    high = middle
            if abs(low - near) < abs(found - near):
                found = low
        if excess != 0:
            falls, before = excess, p
    return found
