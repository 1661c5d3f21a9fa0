"""Where a circle of the wheel meets a rail, for both kinds of rail that the contact kernels know.

rail, of one side : a table (4, n) of a prismatic rail, or a tuple of a lofted surface (geometry.rail_surface)
track, of one branch of the gap : the table itself, or the surface's body with the window of slopes dz/dx that the branch lies in
"""

import numpy as np
from numba import njit, types
from numba.extending import overload

from geometry.loft_kernel import WIDEST, loft_at, meet_loft, slope_excess
from geometry.outline import cubic, outline_of

SCANNED = 17  # slopes dz/dx between -WIDEST and WIDEST at which further branches are looked for
EVERY = 4  # th station only
MOST_WINDOWS = 8


@njit(cache=True, error_model="numpy")
def meet_prism(s, tread, slope, bend, rail, pose):
    there, x, y, z, tangent, advance, sine, cosine = outline_of(s, tread, slope, bend, pose)
    if not there:
        return False, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0
    if y < rail[0, 0] or y > rail[0, rail.shape[1] - 1]:
        return False, (-1.0 if y < rail[0, 0] else 1.0), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0
    height, rail_slope, bend_of_rail = cubic(y, rail)
    return True, 0.0, x, y, z, height, tangent, rail_slope, advance, sine, cosine, 0.0, 0.0, 0.0, bend_of_rail


def meet(s, tread, slope, bend, track, pose):
    """Where the wheel's circle at station s, its height, slope and second derivative given, is nearest to the rail at fixed y.

    Returns (there, away, x, y, z of the wheel's point, height of the rail, slopes dz/dy of wheel and rail, dy/ds, sin, cos of theta,
    dz/dx of both, rail's z_xx, z_xy, z_yy). Not there: away is -1 or 1 on this or that side of the rail, 0 where the wheel has no outline.
    """
    raise NotImplementedError("compiled code only")


@overload(meet)
def _meet(s, tread, slope, bend, track, pose):
    if isinstance(track, types.Array):
        return lambda s, tread, slope, bend, track, pose: meet_prism(s, tread, slope, bend, track, pose)
    return lambda s, tread, slope, bend, track, pose: meet_loft(s, tread, slope, bend, track, pose)


def branches(rail):
    """Number of branches of the gap."""
    raise NotImplementedError("compiled code only")


@overload(branches)
def _branches(rail):
    if isinstance(rail, types.Array):
        return lambda rail: 1
    return lambda rail: int(rail[4][1])


def branch(rail, index, slope):
    """Track of one branch, to be followed from where dz/dx = slope."""
    raise NotImplementedError("compiled code only")


@overload(branch)
def _branch(rail, index, slope):
    if isinstance(rail, types.Array):
        return lambda rail, index, slope: rail
    return lambda rail, index, slope: loft_branch(rail, index, slope)


@njit(cache=True, error_model="numpy")
def loft_branch(rail, index, slope):
    xs, nodes, bodies, windows, place = rail
    windows[index, 0] = slope
    return xs, nodes, bodies[int(windows[index, 6])], windows[index], place


def steepness(track):
    """dz/dx where the branch was last followed to."""
    raise NotImplementedError("compiled code only")


@overload(steepness)
def _steepness(track):
    if isinstance(track, types.Array):
        return lambda track: 0.0
    return lambda track: track[3][0]


def covered(rail, index, x, y, z):
    """Whether another body of the rail lies higher over (x, y)."""
    raise NotImplementedError("compiled code only")


@overload(covered)
def _covered(rail, index, x, y, z):
    if isinstance(rail, types.Array):
        return lambda rail, index, x, y, z: False
    return lambda rail, index, x, y, z: covered_by_loft(rail, index, x, y, z)


@njit(cache=True, error_model="numpy")
def covered_by_loft(rail, index, x, y, z):
    xs, nodes, bodies, windows, place = rail
    body = int(windows[index, 6])
    for k in range(int(place[1])):
        other = int(windows[k, 6])
        if other != body:
            track = (xs, nodes, bodies[other], windows[k], place)
            beyond, aside, height, _, _, _, _, _ = loft_at(place[0] + x, y, track)
            if beyond == 0 and aside == 0 and height > z + 1e-9:
                return True
    return False


def prepare(stations, rail, pose):
    """Divide the slopes dz/dx of every body into windows that hold one minimum of the gap along x each. A prismatic rail needs none."""
    raise NotImplementedError("compiled code only")


@overload(prepare)
def _prepare(stations, rail, pose):
    if isinstance(rail, types.Array):
        return lambda stations, rail, pose: None
    return lambda stations, rail, pose: divide(stations, rail, pose)


@njit(cache=True, error_model="numpy")
def start_window(rail, count, body, low, high, seed):
    xs, _, bodies, windows, place = rail
    first, sections, n = bodies[body, 0], bodies[body, 1], bodies[body, 2]
    section = min(max(np.searchsorted(xs[first:first + sections], place[0]) - 1, 0), sections - 2) + first
    windows[count] = np.array([0.0, section, n // 2, low, high, seed, body, 0.0])
    return count + 1


@njit(cache=True, error_model="numpy")
def ridge(low, high, s, tread, slope, track, pose):
    """Slope dz/dx between two at which the gap along x is highest."""
    for _ in range(20):
        middle = 0.5 * (low + high)
        if slope_excess(middle, s, tread, slope, track, pose)[0] > 0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@njit(cache=True, error_model="numpy")
def divide(stations, rail, pose):
    """Windows of all bodies within reach of the wheel. A body whose gap along x has several minima gets one window for each at the station
    where the wheel is nearest to it among those with several."""
    xs, nodes, bodies, windows, place = rail
    count = 0
    steps = np.linspace(-WIDEST, WIDEST, SCANNED)
    for b in range(bodies.shape[0]):
        first, last = bodies[b, 0], bodies[b, 0] + bodies[b, 1] - 1
        if xs[first] > place[0] + 1.2 * WIDEST * pose[7] or xs[last] < place[0] - 1.2 * WIDEST * pose[7] or count >= MOST_WINDOWS - 2:
            continue
        start_window(rail, count, b, -WIDEST, WIDEST, stations[0, 0])
        best, ridges, found, seed = 1e300, np.zeros(2), 0, stations[0, 0]
        for k in range(0, stations.shape[1], EVERY):
            track = (xs, nodes, bodies[b], windows[count], place)
            falls, before, rises, here = 0.0, 0.0, 0, np.zeros(2)
            for m in range(SCANNED):
                excess, over = slope_excess(steps[m], stations[0, k], stations[1, k], stations[2, k], track, pose)
                if not over:
                    falls = 0.0
                    continue
                if falls > 0 and excess < 0 and rises < 2:
                    here[rises] = ridge(before, steps[m], stations[0, k], stations[1, k], stations[2, k], track, pose)
                    rises += 1
                if excess != 0:
                    falls, before = excess, steps[m]
            if rises > 0:
                windows[count, 0] = 0.0
                there, _, _, _, z, height, _, _, _, _, _, _, _, _, _ = meet_loft(stations[0, k], stations[1, k], stations[2, k], stations[3, k], track, pose)
                if there and z - height < best:
                    best, found, seed = z - height, rises, stations[0, k]
                    ridges[:] = here
        low = -WIDEST
        for m in range(found):
            count = start_window(rail, count, b, low, ridges[m], seed)
            low = ridges[m]
        count = start_window(rail, count, b, low, WIDEST, seed)
    place[1] = count
