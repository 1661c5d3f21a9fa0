"""What a rail that changes along x adds to a contact: its curvature along x over the patch, and the ridge between two points ahead of and behind each other."""

import numpy as np
from numba import types
from numba.extending import overload

from geometry.contact.gap_kernel import NO_RAIL
from geometry.surfaces.loft_kernel import circle_place, loft_at
from geometry.contact.rail_kinds import branch, meet
from geometry.contact.wheel_outline import cubic
from kernel_cache import njit

VIRTUAL = 0.55  # of the penetration: Kik and Piotrowski's virtual penetration
NODES = 16  # of half a cut along x
BETWEEN = 24  # places looked at between two points
ROUNDS = 3  # of the cut's length


def bow(station, steep, depth, wheel, track, pose):
    """What the rail adds to the curvature of the gap along x [1/m] at a station on the wheel, at a slope dz/dx of about `steep`.

    depth : of penetration, vertical [m]. Prismatic rails add nothing.
    """
    raise NotImplementedError("compiled code only")


@overload(bow)
def _bow(station, steep, depth, wheel, track, pose):
    if isinstance(track, types.Array):
        return lambda station, steep, depth, wheel, track, pose: 0.0
    return lambda station, steep, depth, wheel, track, pose: bow_of_loft(station, steep, depth, wheel, track, pose)


@njit(cache=True, error_model="numpy")
def bow_of_loft(station, steep, depth, wheel, track, pose):
    """Of the parabola whose cut, VIRTUAL of the penetration deep, has the area of the true cut along x."""
    tread, slope, bend = cubic(station, wheel)
    track[3][0] = steep
    there, _, x, y, z, height, tangent, _, _, sine, cosine, steep, _, _, _ = meet(station, tread, slope, bend, track, pose)
    if not there:
        return 0.0
    forward, left, up = cosine * pose[2] + sine * pose[3] * pose[1], cosine * pose[1] - sine * pose[3] * pose[2], sine * pose[4]
    lean = np.sqrt(1 + steep * steep)
    size = np.sqrt(lean * lean + tangent * tangent)
    stretch = np.sqrt(1 + slope * slope)
    about, meridian = 1 / ((pose[7] - tread) * stretch), bend / stretch**3
    along, across = (forward + up * steep) / lean, (lean * lean * left + tangent * up - steep * tangent * forward) / (size * lean)
    wheel_bend = max(about * along**2 + meridian * across**2, 0.1) * lean * lean * size  # d2z/dx2 of the wheel at fixed y
    bend_of_cut = wheel_bend
    for _ in range(ROUNDS):
        half = 1.25 * np.sqrt(2 * VIRTUAL * depth / bend_of_cut)
        area, parabola = 0.0, 0.0
        for way in (-1.0, 1.0):
            ridge = depth
            for k in range(NODES):
                away = half * (k + 0.5) / NODES
                beyond, aside, at, _, _, _, _, _ = loft_at(track[4][0] + x + way * away, y, track)
                deep = depth - 0.5 * wheel_bend * away * away + (at - height - way * steep * away) if beyond == 0 and aside == 0 else -1.0
                ridge = min(ridge, deep)
                share = 1.0 if deep <= ridge else max(ridge, 0.0) / max(min(depth, deep), 1e-300)
                area += share * max(deep - (1 - VIRTUAL) * depth, 0.0)
                parabola += max(VIRTUAL * depth - 0.5 * bend_of_cut * away * away, 0.0)
        ratio = min(max(area / parabola, 0.2), 5.0)
        bend_of_cut /= ratio * ratio
        bend_of_cut = min(max(bend_of_cut, 0.01 * wheel_bend), 1e4 * wheel_bend)
        if abs(ratio - 1) < 1e-9:
            break
    return (bend_of_cut - wheel_bend) / (lean * lean * size)


def same_body(rail, first, second):
    """Whether two branches are of one body."""
    raise NotImplementedError("compiled code only")


@overload(same_body)
def _same_body(rail, first, second):
    if isinstance(rail, types.Array):
        return lambda rail, first, second: False
    return lambda rail, first, second: rail[3][first, 6] == rail[3][second, 6]


def ridge_height(one, other, wheel, rail, pose):
    """Highest gap on the way from one place (PLACE,) to another [m], of a pivot at height 0."""
    raise NotImplementedError("compiled code only")


@overload(ridge_height)
def _ridge_height(one, other, wheel, rail, pose):
    if isinstance(rail, types.Array):
        return lambda one, other, wheel, rail, pose: NO_RAIL
    return lambda one, other, wheel, rail, pose: ridge_of_loft(one, other, wheel, rail, pose)


@njit(cache=True, error_model="numpy")
def ridge_of_loft(one, other, wheel, rail, pose):
    """On the straight way in station and slope dz/dx."""
    highest = -NO_RAIL
    track = branch(rail, int(one[4]), one[3])
    for k in range(BETWEEN + 1):
        share = k / BETWEEN
        s, p = (1 - share) * one[0] + share * other[0], (1 - share) * one[3] + share * other[3]
        tread, slope, _ = cubic(s, wheel)
        there, x, y, z, _, _, _, _, _, _ = circle_place(p, s, tread, slope, pose)
        if not there:
            return NO_RAIL
        beyond, aside, height, _, _, _, _, _ = loft_at(track[4][0] + x, y, track)
        if beyond != 0 or aside != 0:
            return NO_RAIL
        highest = max(highest, z - height)
    return highest
