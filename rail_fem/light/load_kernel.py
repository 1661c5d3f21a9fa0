"""Force between a wheel and a rail that penetrate each other by a little, shared between all points where they do.

Every minimum of the gap owns the strip of the profile up to the saddles beside it. Its force is Hertz' for a paraboloid whose cross
section has the area, below 0.55 of the penetration (the virtual penetration of Kik and Piotrowski), of the true gap. Two strips that
penetrate at their saddle are partly one: with m the penetration at the saddle over the lesser of both, their force is (1 - m) times the
sum of both plus m times that of the paraboloid over both. So the force changes continuously when two points meet (m = 0), and when one of
two points vanishes at the saddle (m = 1); Hertz point by point jumps there. Forces point along the mean normal over a strip.

On a surface that changes along x (geometry.surfaces.loft_kernel) the gap's curvature along x is that of the parabola with the area of the cut along x
through the point, below the same 0.55; two points ahead of and behind each other on one body join by the same m, and a part of the cut that
lies beyond a ridge counts by the ridge's penetration. So the force is continuous there too, but for the integral's ten nodes: where an edge
that runs aslant passes one, on few of all ways over a crossing, the force jumps by up to 3 %.

One parabolic strip gives Hertz exactly. Error elsewhere: tests/rail_fem/test_load_sharing.py.
Source: Piotrowski and Kik, Vehicle Syst. Dyn. 46 (2008) 27 (idea of virtual penetration); the sharing is this project's own.
"""

import numpy as np
from numba import types
from numba.extending import overload

from geometry.contact.gap_kernel import NO_RAIL, gap_at, least_gap, nearest_places, roll_and_height, side_pose
from geometry.contact.rail_kinds import branch, branches, meet
from geometry.contact.wheel_outline import cubic
from kernel_cache import njit
from rail_fem.light.load_along import VIRTUAL, bow, ridge_height, same_body

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(10)
SUMS = 11  # of a strip: depth, depth times the normal's y, z and x, the wheel's A_xx and A_xt, the station, x, y, x y and y y of the place
MOST_ADVANCE = 1.5  # dy/ds; more of it is a narrow place where the points run along an edge, which ten nodes would over- or underrate
ROUNDS = 60
CLOSE = 1e-8  # relative, of the vertical force of each side


@njit(cache=True, error_model="numpy")
def saddle(low, high, wheel, rail, pose, tip):
    """Station of the highest gap between two minima, by halving on the sign of the derivative."""
    for _ in range(36):
        middle = 0.5 * (low + high)
        gap, tilt = gap_at(middle, wheel, rail, pose, tip)
        if gap >= NO_RAIL:
            return middle
        if tilt > 0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@njit(cache=True, error_model="numpy")
def level_station(bottom, bound, level, wheel, rail, pose, tip):
    """Station between a minimum and the bound of its strip where the gap reaches the level; the bound where it does not."""
    gap, _ = gap_at(bound, wheel, rail, pose, tip)
    if gap <= level:
        return bound
    inside, outside = bottom, bound
    for _ in range(26):
        middle = 0.5 * (inside + outside)
        gap, _ = gap_at(middle, wheel, rail, pose, tip)
        if gap < level:
            inside = middle
        else:
            outside = middle
    return 0.5 * (inside + outside)


@njit(cache=True, error_model="numpy")
def outer_bound(start, way, height, wheel, rail, pose, tip):
    """Station beside a minimum, in direction way, where the bodies no longer penetrate, or the wheel ends."""
    step, s = 0.02e-3, start
    end = wheel[0, 0] if way < 0 else wheel[0, wheel.shape[1] - 1]
    while (end - s) * way > 0:
        s = s + way * step if (end - s) * way > step else end
        step *= 1.3
        if gap_at(s, wheel, rail, pose, tip)[0] + height >= 0:
            break
    return s


@njit(cache=True, error_model="numpy")
def strip_sums(low, bottom, high, level, wheel, rail, pose, tip):
    """Integrals (SUMS,) over y of the depth below `level` on the strip low..high about a minimum."""
    sums = np.zeros(SUMS)
    for half in range(2):
        edge = level_station(bottom, low if half == 0 else high, level, wheel, rail, pose, tip)
        for k in range(len(_NODES)):
            s = 0.5 * (bottom + edge) + 0.5 * (edge - bottom) * _NODES[k]
            tread, slope, bend = cubic(s, wheel)
            there, _, x, y, z, height, tangent, rail_slope, advance, sine, cosine, steep, _, _, _ = meet(s, tread, slope, bend, rail, pose)
            if not there:
                continue
            weight = _WEIGHTS[k] * 0.5 * abs(edge - bottom) * min(max(advance, 0.0), MOST_ADVANCE) * max(level - (z - height), 0.0)
            tilt, lean = 0.5 * (tangent + rail_slope), np.sqrt(1 + steep * steep)
            nz = 1 / np.sqrt(lean * lean + tilt * tilt)
            forward, left, up = cosine * pose[2] + sine * pose[3] * pose[1], cosine * pose[1] - sine * pose[3] * pose[2], sine * pose[4]
            along, across = (forward + up * steep) / lean, (lean * lean * left + tilt * up - steep * tilt * forward) * nz / lean
            stretch = np.sqrt(1 + slope * slope)
            about, meridian = 1 / ((pose[7] - tread) * stretch), bend / stretch**3
            x, y = x * lean + (z - steep * x) * steep / lean, (y + tilt * z) * nz * lean  # along and across in the tangent plane
            sums += weight / lean * np.array([1.0, -tilt * nz, nz, -steep * nz, about * along**2 + meridian * across**2, (about - meridian) * along * across, s, x, y, x * y, y * y])
    return sums


def mixed_curvature(along, sums, track):
    """A_xt [1/m] of a strip: the wheel's on prismatic rails, which add none; from how the strip runs aslant on others."""
    raise NotImplementedError("compiled code only")


@overload(mixed_curvature)
def _mixed_curvature(along, sums, track):
    if isinstance(track, types.Array):
        return lambda along, sums, track: sums[5] / sums[0]
    return lambda along, sums, track: -along * (sums[9] - sums[7] * sums[8] / sums[0]) / max(sums[10] - sums[8] * sums[8] / sums[0], 1e-12 * sums[0])


@njit(cache=True, error_model="numpy")
def hertz_force(depth, sums, found, wheel, track, pose, modulus, constants, span):
    """Force [N] of the paraboloid with a strip's area: depth [m] is the vertical penetration, sums are those below VIRTUAL of it.

    found : (PLACE,) a place of the strip;  constants : (k,)  K for E* = 1 and mean radius 1 over the logarithm of the radii's ratio from 0 to span
    Along the strip the gap is least along x: its places run aslant by -A_xt / A_xx.
    """
    cosine = sums[2] / sums[0]
    along = max(sums[4] / sums[0] + bow(sums[6] / sums[0], found[3], depth, wheel, track, pose), 1e-9)
    mixed = mixed_curvature(along, sums, track)
    normal_depth = depth * cosine
    root = 0.75 * sums[0] / (VIRTUAL * normal_depth) ** 1.5  # sqrt(2 R) of the parabola
    bend = 2.0 / (root * root)
    across = bend + mixed * mixed / along
    middle, spread = 0.5 * (along + across), np.hypot(0.5 * (along - across), mixed)
    product = along * bend
    small = product / (middle + spread)
    place = min(np.log((middle + spread) / small) / span, 1.0) * (len(constants) - 1)
    i = min(int(place), len(constants) - 2)
    constant = constants[i] + (place - i) * (constants[i + 1] - constants[i])
    return modulus * constant * product**-0.25 * normal_depth**1.5


@njit(cache=True, error_model="numpy")
def side_forces(found, height, wheel, rail, pose, tip, modulus, constants, span):
    """Force at each penetrating minimum of a side: (4, n) normal force, its parts across, up and forward, in side axes [N].

    found : (PLACE, n) minima with negative gap + height, each branch in order
    """
    n = found.shape[1]
    force, depth = np.zeros((4, n)), -(found[1] + height)
    low, high, saddles = np.empty(n), np.empty(n), np.full(n + 1, -1.0)
    for k in range(n):
        track = branch(rail, int(found[4, k]), found[3, k])
        if k == 0 or found[4, k] != found[4, k - 1]:
            low[k] = outer_bound(found[0, k], -1.0, height, wheel, track, pose, tip)
        else:
            low[k] = saddle(found[0, k - 1], found[0, k], wheel, track, pose, tip)
            high[k - 1], saddles[k] = low[k], -(gap_at(low[k], wheel, track, pose, tip)[0] + height)
        if k == n - 1 or found[4, k] != found[4, k + 1]:
            track = branch(rail, int(found[4, k]), found[3, k])
            high[k] = outer_bound(found[0, k], 1.0, height, wheel, track, pose, tip)
    for k in range(n):
        track = branch(rail, int(found[4, k]), found[3, k])
        sums = strip_sums(low[k], found[0, k], high[k], -height - (1 - VIRTUAL) * depth[k], wheel, track, pose, tip)
        if sums[0] > 0:
            total = hertz_force(depth[k], sums, found[:, k], wheel, track, pose, modulus, constants, span)
            force[0, k] = total
            for c in range(1, 4):
                force[c, k] = total * sums[c] / sums[0]
    if n > 1:
        alone = force.copy()
        share = press_down(force, depth, found, wheel, rail, pose, modulus)
        for k in range(n):
            force[:, k] *= share[k, k]
        join(force, found, depth, low, high, saddles, share, height, wheel, rail, pose, tip, modulus, constants, span)
        if branches(rail) > 1:
            join_along(force, alone, found, depth, share, height, wheel, rail, pose)
    return force


@njit(cache=True, error_model="numpy")
def join_along(force, alone, found, depth, share, height, wheel, rail, pose):
    """Let points of one body on different branches, ahead of and behind each other, act as partly one; changes force (4, n)."""
    n = force.shape[1]
    for i in range(n):
        for j in range(i + 1, n):
            if found[4, i] == found[4, j] or not same_body(rail, int(found[4, i]), int(found[4, j])):
                continue
            merged = min(max(-(ridge_height(found[:, i], found[:, j], wheel, rail, pose) + height) / min(depth[i], depth[j]), 0.0), 1.0)
            deep = i if depth[i] >= depth[j] else j
            others = 0.0
            for k in range(n):
                if k != i and k != j:
                    others += share[deep, k]
            for c in range(4):
                whole = alone[c, deep] * max(1 - others, 0.0) ** 1.5
                for k in (i, j):
                    force[c, k] = (1 - merged) * force[c, k] + (merged * whole if k == deep else 0.0)


@njit(cache=True, error_model="numpy")
def sunk(distance, radius):
    """Displacement beside Hertz' circle of this radius over its approach. Source: Johnson (1985), eq. 3.42."""
    r = distance / radius
    if r <= 1:
        return 1 - 0.5 * r * r
    return ((2 - r * r) * np.arcsin(1 / r) + np.sqrt(r * r - 1)) / np.pi


@njit(cache=True, error_model="numpy")
def press_down(force, depth, found, wheel, rail, pose, modulus):
    """What each of n points keeps of its force for the others' sake, and how much each presses another down.

    Returns (n, n): on the diagonal the factor on the force, in row i and column j the sinking of i by j over the depth of i.
    """
    n = force.shape[1]
    place, share = np.empty((3, n)), np.zeros((n, n))
    for k in range(n):
        tread, _, bend = cubic(found[0, k], wheel)
        track = branch(rail, int(found[4, k]), found[3, k])
        _, _, place[0, k], place[1, k], _, _, tangent, _, _, _, _, _, _, _, _ = meet(found[0, k], tread, found[2, k], bend, track, pose)
        place[2, k] = np.arctan(tangent)
    left, new = np.ones(n), np.ones(n)  # of each depth
    for _ in range(100):  # all at once, so that what is symmetric stays so
        for i in range(n):
            total = 0.0
            for j in range(n):
                if j != i and left[j] > 0 and force[0, j] > 0:
                    facing = max(np.cos(place[2, i] - place[2, j]), 0.0)
                    radius = 0.75 * force[0, j] * left[j]**0.5 / (modulus * depth[j] * np.cos(place[2, j]))
                    distance = np.hypot(place[0, i] - place[0, j], place[1, i] - place[1, j])
                    share[i, j] = facing * left[j] * depth[j] * sunk(distance, radius) / depth[i]
                    total += share[i, j]
            new[i] = 0.5 * left[i] + 0.5 * max(1 - total, 0.0)
        moved = np.abs(new - left).max()
        left[:] = new
        if moved < 1e-11:
            break
    for i in range(n):
        share[i, i] = left[i]**1.5
    return share


@njit(cache=True, error_model="numpy")
def join(force, found, depth, low, high, saddles, share, height, wheel, rail, pose, tip, modulus, constants, span):
    """Let strips that penetrate at their saddles act as partly one, the deepest saddle first; changes force (4, n)."""
    n = found.shape[1]
    first, last = np.arange(n), np.arange(n)  # of the group each strip is in
    while True:
        k = np.argmax(saddles)
        if saddles[k] <= 0:
            return
        a, b = first[k - 1], last[k]
        merged = min(saddles[k] / min(depth[a:k].max(), depth[k:b + 1].max()), 1.0)
        saddles[k] = -1.0
        deepest = depth[a:b + 1].max()
        parts, total = np.zeros((b + 1 - a, SUMS)), np.zeros(SUMS)
        for i in range(a, b + 1):
            if depth[i] > (1 - VIRTUAL) * deepest:
                track = branch(rail, int(found[4, i]), found[3, i])
                parts[i - a] = strip_sums(low[i], found[0, i], high[i], -height - (1 - VIRTUAL) * deepest, wheel, track, pose, tip)
                total += parts[i - a]
        i = a + np.argmax(depth[a:b + 1])
        others = share[i, :a].sum() + share[i, b + 1:].sum()
        track = branch(rail, int(found[4, i]), found[3, i])
        whole = hertz_force(deepest, total, found[:, i], wheel, track, pose, modulus, constants, span) * max(1 - others, 0.0) ** 1.5
        for i in range(a, b + 1):
            for c in range(4):
                force[c, i] = (1 - merged) * force[c, i] + merged * whole * parts[i - a, c] / total[0]
            first[i], last[i] = a, b


@njit(cache=True, error_model="numpy")
def loaded_side(stations, wheel, rail, tip, pose, height, modulus, constants, span):
    """Penetrating minima (PLACE, n) and forces (4, n) of a side."""
    found = nearest_places(stations, wheel, rail, pose, tip, -height)
    keep = 0
    for k in range(found.shape[1]):
        if found[1, k] + height < 0:
            found[:, keep] = found[:, k]
            keep += 1
    found = found[:, :keep].copy()
    return found, side_forces(found, height, wheel, rail, pose, tip, modulus, constants, span)


@njit(cache=True, error_model="numpy")
def carried_by(side, sign, lateral, yaw, roll, lever, arm, height, modulus, constants, span):
    """Vertical force [N] that a side (stations, wheel, rail, tip, radius) carries at this roll and height of the pivot; sign +1 left, -1 right."""
    stations, wheel, rail, tip, radius = side
    _, force = loaded_side(stations, wheel, rail, tip, side_pose(sign, lateral, yaw, roll, lever, arm, radius), height, modulus, constants, span)
    return force[2].sum()


@njit(cache=True, error_model="numpy")
def settle_loaded(left, right, lateral, yaw, lever, arm, loads, modulus, constants, span):
    """Roll and pivot height at which both sides carry their vertical loads (2,) [N]; sides as in roll_and_height.

    Returns roll, height, worst relative imbalance (NO_RAIL: no rail), rounds. Each side is driven by its own lowering, along the
    secant of force^(2/3), which is straight for one Hertz contact.
    """
    roll, height, miss = roll_and_height(left, right, lateral, yaw, 0.0, lever, arm)
    if miss >= NO_RAIL:
        return roll, height, NO_RAIL, 0
    arms, down, slope = np.empty(2), np.empty(2), np.empty(2)
    _, arms[0] = least_gap(left, 1.0, lateral, yaw, roll, lever, arm, False)
    _, arms[1] = least_gap(right, -1.0, lateral, yaw, roll, lever, arm, False)
    for i in range(2):
        down[i] = (loads[i] / (0.7 * modulus)) ** (2 / 3)
        slope[i] = (0.7 * modulus) ** (2 / 3)
    base = max(arms[0] + arms[1], 0.1)
    before, carried = down.copy(), np.zeros(2)
    low, high = np.zeros(2), np.full(2, np.inf)
    worst = NO_RAIL
    for count in range(ROUNDS):
        turn = (down[1] - down[0]) / base
        at_roll, at_height = roll + turn, height - down[0] - arms[0] * turn
        worst = 0.0
        for i in range(2):
            if i == 0:  # the sides may be of two kinds
                total = carried_by(left, 1.0, lateral, yaw, at_roll, lever, arm, at_height, modulus, constants, span)
            else:
                total = carried_by(right, -1.0, lateral, yaw, at_roll, lever, arm, at_height, modulus, constants, span)
            if loads[i] > 0:
                worst = max(worst, abs(total / loads[i] - 1))
            root, target = max(total, 0.0) ** (2 / 3), loads[i] ** (2 / 3)
            if count > 0 and abs(down[i] - before[i]) > 1e-14 * max(down[i], 1e-9):
                secant = (root - carried[i]) / (down[i] - before[i])
                if secant > 0.05 * slope[i] and secant < 20 * slope[i]:
                    slope[i] = secant
            elif root > 0 and down[i] > 0:
                slope[i] = root / down[i]
            before[i], carried[i] = down[i], root
            down[i] = before[i] + (target - root) / slope[i] if loads[i] > 0 else 0.0
            down[i] = min(max(down[i], 0.2 * before[i]), 5 * before[i] + 1e-9)
            if total < loads[i]:
                low[i] = before[i]
            else:
                high[i] = before[i]
            if low[i] >= high[i]:  # the other side has moved this one
                low[i], high[i] = 0.5 * low[i], np.inf
            if count > 8 and loads[i] > 0 and high[i] < np.inf and not (low[i] < down[i] < high[i]):
                down[i] = 0.5 * (low[i] + high[i])
        if worst < CLOSE:
            return at_roll, at_height, worst, count + 1
    return at_roll, at_height, worst, ROUNDS
