"""Overlap of wheel and rail along x: a parabola on prismatic rails, on others a cut through the lofted body up to the
ridge before another position."""

import numpy as np

from geometry.contact.rail_kinds import branch, branches, for_each_rail
from geometry.surfaces.loft_kernel import AXLE_X, BODY, loft_at
from kernel_cache import njit
from rail_fem.contact.load_pressure import BASE, BEND, DEPTH, NZ, SLOPE, X, Y

STEPS = 8  # of the wheel's own half patch, in which the end of an overlap is looked for
LONGEST = 4  # times the wheel's own half patch


@for_each_rail(prism=lambda strip, index, rail: 0.0, loft=lambda strip, index, rail: base_on_loft(strip, index, rail))
def base_along(strip, index, rail):
    """Height of a lofted rail under a strip's lowest point [m], NaN beyond its ends; 0 of a prismatic one."""


@for_each_rail(
    prism=lambda strip, index, rail: (np.sqrt(2 * strip[DEPTH] / strip[BEND]), np.sqrt(2 * strip[DEPTH] / strip[BEND])),
    loft=lambda strip, index, rail: (reach_on_loft(strip, index, -1.0, rail), reach_on_loft(strip, index, 1.0, rail)),
)
def reach_along(strip, index, rail):
    """Reach of the overlap behind and ahead of a strip's lowest point [m]; index of its branch."""


@for_each_rail(
    prism=lambda strip, index, away, rail: strip[DEPTH] - 0.5 * strip[BEND] * away * away,
    loft=lambda strip, index, away, rail: depth_on_loft(strip, index, away, rail),
)
def depth_along(strip, index, away, rail):
    """Depth along the normal [m] at a distance along x from a strip's lowest point."""


@njit(cache=True, error_model="numpy")
def base_on_loft(strip, index, rail):
    track = branch(rail, index, strip[SLOPE])
    here = loft_at(track.position[AXLE_X] + strip[X], strip[Y], track)
    return np.nan if here.beyond != 0 or here.aside != 0 else here.z


@njit(cache=True, error_model="numpy")
def depth_on_loft(strip, index, away, rail):
    """Of the branch's body; none beyond its ends."""
    if np.isnan(strip[BASE]):
        return -1.0
    track = branch(rail, index, strip[SLOPE])
    there = loft_at(track.position[AXLE_X] + strip[X] + away, strip[Y], track)
    if there.beyond != 0 or there.aside != 0:
        return -1.0
    return strip[DEPTH] - 0.5 * strip[BEND] * away * away + (there.z - strip[BASE] - strip[SLOPE] * away) * strip[NZ]


@njit(cache=True, error_model="numpy")
def reach_on_loft(strip, index, sign, rail):
    """Ahead (sign 1) or behind (-1), to where the overlap ends, or to the ridge where it grows again if another branch
    of the body takes over there."""
    shared = False
    for other in range(branches(rail)):
        shared = shared or (other != index and rail.windows[other, BODY] == rail.windows[index, BODY])
    step, deep, before = np.sqrt(2 * strip[DEPTH] / strip[BEND]) / STEPS, strip[DEPTH], strip[DEPTH]
    for k in range(1, LONGEST * STEPS + 1):
        next_deep = depth_on_loft(strip, index, sign * k * step, rail)
        if next_deep <= 0:
            return (k - 1 + deep / max(deep - next_deep, 1e-300)) * step
        if shared and next_deep > deep and k > 1:
            return (k - 1 + 0.5 * (before - next_deep) / (before - 2 * deep + next_deep)) * step
        before, deep = deep, next_deep
    return LONGEST * STEPS * step
