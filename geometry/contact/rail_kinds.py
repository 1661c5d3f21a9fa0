"""Where a circle of the wheel meets a rail, for both kinds of rail that the contact kernels know.

rail, of one side : a table (4, n) of a prismatic rail, or a tuple of a lofted surface (geometry.surfaces.lofted_rail)
track, of one branch of the gap : the table itself, or the surface's body with the window of slopes dz/dx that the
    branch lies in
"""

import functools
import inspect
from collections.abc import Callable

import numpy as np
from numba import types
from numba.extending import overload

from geometry.contact.wheel_outline import cubic, outline_of
from geometry.surfaces.loft_kernel import WIDEST, loft_at, meet_loft, slope_excess
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
def meet_prism(s, tread, slope, bend, rail, pose):
    there, x, y, z, tangent, advance, sine, cosine = outline_of(s, tread, slope, bend, pose)
    if not there:
        return False, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0
    if y < rail[0, 0] or y > rail[0, rail.shape[1] - 1]:
        return False, (-1.0 if y < rail[0, 0] else 1.0), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0
    height, rail_slope, bend_of_rail = cubic(y, rail)
    return True, 0.0, x, y, z, height, tangent, rail_slope, advance, sine, cosine, 0.0, 0.0, 0.0, bend_of_rail


@for_each_rail(
    prism=lambda s, tread, slope, bend, track, pose: meet_prism(s, tread, slope, bend, track, pose),
    loft=lambda s, tread, slope, bend, track, pose: meet_loft(s, tread, slope, bend, track, pose),
)
def meet(s, tread, slope, bend, track, pose):
    """Where the wheel's circle at station s, its height, slope and second derivative given, is nearest to the rail at
    fixed y.

    Returns (there, away, x, y, z of the wheel's point, height of the rail, slopes dz/dy of wheel and rail, dy/ds, sin,
    cos of theta, dz/dx of both, rail's z_xx, z_xy, z_yy). Not there: away is -1 or 1 on this or that side of the rail,
    0 where the wheel has no outline, NaN beyond the end of a branch.
    """


@for_each_rail(prism=lambda rail: 1, loft=lambda rail: int(rail[4][1]))
def branches(rail):
    """Number of branches of the gap."""


@for_each_rail(prism=lambda rail, index, slope: rail, loft=lambda rail, index, slope: loft_branch(rail, index, slope))
def branch(rail, index, slope):
    """Track of one branch, to be followed from where dz/dx = slope."""


@njit(cache=True, error_model="numpy")
def loft_branch(rail, index, slope):
    xs, nodes, bodies, windows, position, ridges, _ = rail
    windows[index, 0] = slope
    return xs, nodes, bodies[int(windows[index, 6])], windows[index], position, ridges


@for_each_rail(prism=lambda track: 0.0, loft=lambda track: track[3][0])
def steepness(track):
    """dz/dx where the branch was last followed to."""


@for_each_rail(
    prism=lambda rail, index, x, y, z: False, loft=lambda rail, index, x, y, z: covered_by_loft(rail, index, x, y, z)
)
def covered(rail, index, x, y, z):
    """Whether another body of the rail lies higher over (x, y)."""


@njit(cache=True, error_model="numpy")
def covered_by_loft(rail, index, x, y, z):
    xs, nodes, bodies, windows, position, ridges, _ = rail
    body = int(windows[index, 6])
    for k in range(int(position[1])):
        other = int(windows[k, 6])
        if other != body:
            track = (xs, nodes, bodies[other], windows[k], position, ridges)
            beyond, aside, height, _, _, _, _, _ = loft_at(position[0] + x, y, track)
            if beyond == 0 and aside == 0 and height > z + 1e-9:
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
    xs, _, bodies, windows, position, _, _ = rail
    first, sections, n = bodies[body, 0], bodies[body, 1], bodies[body, 2]
    section = min(max(np.searchsorted(xs[first : first + sections], position[0]) - 1, 0), sections - 2) + first
    row = 0.0 if side == 0 else count + 1.0
    windows[count] = np.array([0.0, section, n // 2, row, side, seed, body, 0.0])


@njit(cache=True, error_model="numpy")
def find_branches(stations, rail, pose):
    """Branches of all bodies within reach of the wheel."""
    xs, nodes, bodies, windows, position, ridges, wavy = rail
    count, reach = 0, 1.2 * WIDEST * pose[7]
    for b in range(bodies.shape[0]):
        first, end = bodies[b, 0], bodies[b, 0] + bodies[b, 1]
        if xs[first] > position[0] + reach or xs[end - 1] < position[0] - reach or count > MOST_WINDOWS - 2:
            continue
        start_branch(rail, count, b, 0, 0.0)
        near = (xs[first:end] > position[0] - reach) & (xs[first:end] < position[0] + reach)
        seed = -1
        if wavy[first:end][near].any():
            track = (xs, nodes, bodies[b], windows[count], position, ridges)
            seed = find_ridges(stations, track, ridges[count + 1], ridges[count + 1 + MOST_WINDOWS], pose)
        if seed >= 0:
            ridges[count + 2], ridges[count + 2 + MOST_WINDOWS] = ridges[count + 1], ridges[count + 1 + MOST_WINDOWS]
            start_branch(rail, count, b, -1, stations[0, seed])
            start_branch(rail, count + 1, b, 1, stations[0, seed])
            count += 1
        count += 1
    position[1] = count


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
            track[3][0] = 0.0
            there, _, _, _, z, height, _, _, _, _, _, _, _, _, _ = meet_loft(
                stations[0, k], stations[1, k], stations[2, k], stations[3, k], track, pose
            )
            if there and z - height < best:
                best, seed = z - height, k
                ridge[k] = at
    if seed < 0:
        return seed
    for way in (-1, 1):
        last, k = ridge[seed], seed + way
        while 0 <= k < n:
            at = np.inf
            if abs(ridge[k - way]) < WIDEST:
                at = ridge_at(stations[0, k], stations[1, k], stations[2, k], last, track, pose)
            if at < np.inf:
                ridge[k] = last = at
            elif abs(ridge[k - way]) < WIDEST:
                track[3][0] = last
                there, _, _, _, _, _, _, _, _, _, _, p, _, _, _ = meet_loft(
                    stations[0, k], stations[1, k], stations[2, k], stations[3, k], track, pose
                )
                ridge[k] = WIDEST if not there or p < last else -WIDEST
                ends[min(k, k - way)] = ridge_end(stations, k - way, k, last, track, pose)
            else:
                ridge[k] = ridge[k - way]
            k += way
    return seed


@njit(cache=True, error_model="numpy")
def ridge_end(stations, inside, outside, last, track, pose):
    """Station between two at which a ridge ends, by halving; the wheel a cubic between them."""
    a, b = min(inside, outside), max(inside, outside)
    d, low, high = stations[0, b] - stations[0, a], stations[0, inside], stations[0, outside]
    for _ in range(16):
        s = 0.5 * (low + high)
        t = (s - stations[0, a]) / d
        m0, m1, rise = d * stations[2, a], d * stations[2, b], stations[1, b] - stations[1, a]
        c2, c3 = 3 * rise - 2 * m0 - m1, m0 + m1 - 2 * rise
        at = ridge_at(
            s, stations[1, a] + t * (m0 + t * (c2 + t * c3)), (m0 + t * (2 * c2 + t * 3 * c3)) / d, last, track, pose
        )
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
