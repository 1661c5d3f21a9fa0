"""Forces between a wheel and a rail that overlap each other by a little, shared between all positions where they do.

Every minimum of the gap owns the part of the profile up to the saddles beside it. All that overlaps is cut into strips
across, whose edges lie at equal shares of the width and of the rise and fall of the depth: both change
continuously as positions meet, begin and vanish, and with them the strips and the forces
(rail_fem.contact.load_pressure), whatever minima the search has told apart. A strip over a saddle gives each side its
share.

Error: tests/rail_fem/test_load_merge.py, test_load_sharing.py; on rails that change along x test_load_continuity.py.
"""

from typing import NamedTuple

import numpy as np

from geometry.contact.gap_kernel import (
    BRANCH,
    GAP,
    NEAR_LOWERING,
    NEAR_ROLL,
    NO_RAIL,
    POSITION,
    SLOPE_X,
    STATION,
    gap_at,
    nearest_positions,
    side_pose,
    touch,
)
from geometry.contact.rail_kinds import branch, closest_point
from geometry.contact.wheel_outline import cubic
from kernel_cache import njit
from rail_fem.contact.load_along import base_along, depth_along, reach_along
from rail_fem.contact.load_pressure import (
    AHEAD,
    BASE,
    BEHIND,
    BEND,
    DEPTH,
    HIGH,
    LOW,
    NX,
    NY,
    NZ,
    PART,
    RESIDUAL,
    SLOPE,
    STRIP,
    WIDTH,
    X,
    Y,
    Z,
    influence,
    solve_cells,
)
from rail_fem.contact.strip_influence import ROWS

STRIPS = 32  # across, on all positions together
POINTS = np.array([-1.0, 1.0]) / np.sqrt(3)  # of a strip, where the gap is taken
# of a position: normal force, its parts across, up and forward; the same times x, y, z, station; times x x, times (y y
# + z z); largest and least tilt;
CARRIED = 13
# overlap left where a profile ends [m]
MOST_ADVANCE = 1.5  # dy/ds; more of it is a narrow position where the points run along an edge
ROUNDS = 60
CLOSE = 1e-7  # relative, of the vertical force of each side
# strips of first rounds, imbalance from which on they are enough, how many there may be; error of their pressures, and
# of those of the round after them, over the largest depth
FEW_STRIPS, FAR_OFF, FIRST_ROUNDS, LOOSE = 16, 0.5, 3, 1e-6
# imbalance from which the cells stay, that to which those of first rounds are followed, and how often at most
NEARLY, FOLLOWED, LAST_STEPS = 1e-5, 1e-2, 3


class OverlapCells(NamedTuple):
    """Cells that overlap: strip and row (c,), distance from the strip's lowest point (c,) [m], depth (c,) [m]; length
    of all along x [m]."""

    strip: np.ndarray
    row: np.ndarray
    away: np.ndarray
    depth: np.ndarray
    length: float


class SideMesh(NamedTuple):
    """Cells of a side at one height: its minima that overlap (POSITION, n), where their parts begin and end (3, n), the
    overlap at ends of profiles (n,), strips (STRIP, m), cells, their influence on each other (m, m LINE) [m/N]."""

    found: np.ndarray
    ends: np.ndarray
    cut: np.ndarray
    strips: np.ndarray
    cells: OverlapCells
    lines: np.ndarray


class SideLoad(NamedTuple):
    """What a side carries: its minima that overlap (POSITION, n), what each carries (CARRIED, n) in side axes [N, m],
    the error left over the largest depth, forces of the cells (strips, ROWS) [N]."""

    found: np.ndarray
    carried: np.ndarray
    left_over: float
    cells: np.ndarray


class SettledSides(NamedTuple):
    """Roll and height of the pivot at which both sides carry their loads, worst relative imbalance (NO_RAIL: no rail),
    rounds, and what the sides carry there."""

    roll: float
    height: float
    worst: float
    rounds: int
    left: SideLoad
    right: SideLoad


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
    """Station between a minimum and the bound of its strip where the gap reaches the level; the bound where it does
    not."""
    gap, tilt = gap_at(bound, wheel, rail, pose, tip)
    if gap <= level:
        return bound
    inside, outside, at = bottom, bound, bound
    for count in range(60):  # Newton; halvings where it leaves the bracket or does not end
        newer = at - (gap - level) / tilt if gap < NO_RAIL and tilt != 0 and count % 8 < 6 else outside
        if not min(inside, outside) < newer < max(inside, outside):
            newer = 0.5 * (inside + outside)
        if abs(newer - at) < 1e-13:
            break
        at = newer
        gap, tilt = gap_at(at, wheel, rail, pose, tip)
        if gap < level:
            inside = at
        else:
            outside = at
    return at


@njit(cache=True, error_model="numpy")
def outer_bound(start, sign, height, wheel, rail, pose, tip):
    """Station beside a minimum, towards larger (sign 1) or smaller (-1) stations, where the bodies no longer penetrate,
    or the wheel ends."""
    step, s = 0.02e-3, start
    end = wheel[0, 0] if sign < 0 else wheel[0, wheel.shape[1] - 1]
    while (end - s) * sign > 0:
        s = s + sign * step if (end - s) * sign > step else end
        step *= 1.3
        if gap_at(s, wheel, rail, pose, tip)[0] + height >= 0:
            break
    return s


@njit(cache=True, error_model="numpy")
def parts_of(found, height, wheel, rail, pose, tip):
    """Where the part of each minimum begins, its bottom, where it ends: stations (3, n), and the overlap there (3, n),
    vertical.

    found : (POSITION, n) minima with negative gap + height, each branch in order
    """
    n = found.shape[1]
    ends, depths = np.zeros((3, n)), np.zeros((3, n))
    for k in range(n):
        track = branch(rail, int(found[BRANCH, k]), found[SLOPE_X, k])
        ends[1, k] = found[STATION, k]
        if k == 0 or found[BRANCH, k] != found[BRANCH, k - 1]:
            bound = outer_bound(found[STATION, k], -1.0, height, wheel, track, pose, tip)
        else:
            bound = saddle(found[STATION, k - 1], found[STATION, k], wheel, track, pose, tip)
            ends[2, k - 1] = level_station(found[STATION, k - 1], bound, -height, wheel, track, pose, tip)
        ends[0, k] = level_station(found[STATION, k], bound, -height, wheel, track, pose, tip)
        if k == n - 1 or found[BRANCH, k] != found[BRANCH, k + 1]:
            bound = outer_bound(found[STATION, k], 1.0, height, wheel, track, pose, tip)
            ends[2, k] = level_station(found[STATION, k], bound, -height, wheel, track, pose, tip)
    for k in range(n):
        track = branch(rail, int(found[BRANCH, k]), found[SLOPE_X, k])
        for c in (0, 2):
            # where a profile ends the bound itself may lie beyond it
            just_inside = ends[c, k] + 1e-6 * (found[STATION, k] - ends[c, k])
            depths[c, k] = max(-(gap_at(just_inside, wheel, track, pose, tip)[0] + height), 0.0)
        depths[1, k] = -(found[GAP, k] + height)
    return ends, depths


@njit(cache=True, error_model="numpy")
def edge_at(share, start, depth, low, high, station, width, change, height, wheel, rail, pose, tip):
    """Station between low and high up to which, from `start` with its depth, the shares of width and of the change of
    depth make `share`. Newton from `station`, with halvings where it leaves the bracket or does not end."""
    for count in range(60):
        gap, tilt = gap_at(station, wheel, rail, pose, tip)
        deep = -(gap + height)
        excess = 0.5 * (station - start) / width + 0.5 * abs(deep - depth) / change - share
        if abs(excess) < 1e-11 or high - low < 1e-13:
            break
        if excess < 0:
            low = station
        else:
            high = station
        station -= excess / (0.5 / width + (0.5 if deep < depth else -0.5) * tilt / change)
        if not low < station < high or count % 8 > 5:
            station = 0.5 * (low + high)
    return station


@njit(cache=True, error_model="numpy")
def strip_edges(found, ends, depths, number, height, wheel, rail, pose, tip):
    """Stations (k,) of the edges, the minimum (k,) on whose part the strip behind each lies; -1 where none does.

    number : of strips
    """
    n = ends.shape[1]
    width, change = (ends[2] - ends[0]).sum(), (2 * depths[1] - depths[0] - depths[2]).sum()
    edges, part, count, behind, line = np.empty(number + 2 * n), np.empty(number + 2 * n, np.int64), 0, 0.0, 1
    for k in range(n):
        track = branch(rail, int(found[BRANCH, k]), found[SLOPE_X, k])
        if k == 0 or found[BRANCH, k] != found[BRANCH, k - 1] or ends[0, k] > ends[2, k - 1] + 1e-12:
            edges[count], part[count], count = ends[0, k], k, count + 1
        for c in range(2):
            share = 0.5 * (ends[c + 1, k] - ends[c, k]) / width + 0.5 * abs(depths[c + 1, k] - depths[c, k]) / change
            first, deep, last = ends[c, k], depths[c, k], ends[c + 1, k]
            at, done = first, 0.0  # last edge, its share
            while line < number and line / number < behind + share:
                sought = line / number - behind
                trial = at + (sought - done) / (share - done) * (last - at)
                at = edge_at(sought, first, deep, at, last, trial, width, change, height, wheel, track, pose, tip)
                done = sought
                edges[count], part[count], count, line = at, k, count + 1, line + 1
            behind += share
        if k == n - 1 or found[BRANCH, k] != found[BRANCH, k + 1] or ends[0, k + 1] > ends[2, k] + 1e-12:
            edges[count], part[count], count = ends[2, k], -1, count + 1
    return edges[:count], part[:count]


@njit(cache=True, error_model="numpy")
def strip_row(low, high, height, wheel, rail, pose):
    """One strip (STRIP,) between two stations, but for its reach along x; its width is 0 where it does not count."""
    row, sums, total = np.zeros(STRIP), np.zeros(8), 0.0
    for point in POINTS:
        s = 0.5 * (low + high) + 0.5 * (high - low) * point
        tread, slope, bend = cubic(s, wheel)
        of = closest_point(s, tread, slope, bend, rail, pose)
        if not of.found:
            continue
        sine, cosine, steep = of.sine, of.cosine, of.slope_x
        tilt, lean = 0.5 * (of.wheel_slope + of.rail_slope), np.sqrt(1 + steep * steep)
        size = np.sqrt(lean * lean + tilt * tilt)
        forward = cosine * pose.cos_yaw + sine * pose.sin_roll * pose.sin_yaw
        left, up = cosine * pose.sin_yaw - sine * pose.sin_roll * pose.cos_yaw, sine * pose.cos_roll
        along = (forward + up * steep) / lean
        side = (lean * lean * left + tilt * up - steep * tilt * forward) / (size * lean)
        stretch = np.sqrt(1 + slope * slope)
        about, meridian = 1 / ((pose.radius - tread) * stretch), bend / stretch**3
        deep, bends = (of.rail_z - of.z - height) / size, (about * along**2 + meridian * side**2) * lean * lean
        sums += np.array([of.x, of.y, of.z, steep, tilt, deep, bends, min(max(of.advance, 0.0), MOST_ADVANCE)])
        total += 1
    if total == 0:
        return row
    sums /= total
    size = np.sqrt(1 + sums[3] ** 2 + sums[4] ** 2)
    row[LOW], row[HIGH], row[X], row[Y], row[Z], row[SLOPE] = low, high, sums[0], sums[1], sums[2], sums[3]
    row[NX], row[NY], row[NZ] = -sums[3] / size, -sums[4] / size, 1 / size
    row[DEPTH], row[BEND] = sums[5], max(sums[6], 0.1)
    row[WIDTH] = (high - low) * sums[7] * np.sqrt(1 + sums[4] ** 2) if sums[5] > 0 else 0.0
    return row


@njit(cache=True, error_model="numpy")
def strips_of(edges, part, found, height, wheel, rail, pose):
    """All strips (STRIP, m) that overlap."""
    strips, count = np.empty((STRIP, len(edges))), 0
    for k in range(len(edges) - 1):
        if part[k] < 0:
            continue
        index = int(found[BRANCH, part[k]])
        row = strip_row(edges[k], edges[k + 1], height, wheel, branch(rail, index, found[SLOPE_X, part[k]]), pose)
        if row[WIDTH] > 1e-12:
            row[PART] = part[k]
            row[BASE] = base_along(row, index, rail)
            row[BEHIND], row[AHEAD] = reach_along(row, index, rail)
            strips[:, count], count = row, count + 1
    return strips[:, :count]


@njit(cache=True, error_model="numpy")
def cells_of(strips, found, rail):
    """Cells of all strips that overlap."""
    m, length = strips.shape[1], 0.0
    for i in range(m):
        length = max(length, 2 * max(strips[BEHIND, i], strips[AHEAD, i]) / ROWS)
    strip, row, count = np.empty(m * ROWS, np.int64), np.empty(m * ROWS, np.int64), 0
    away, depth = np.empty(m * ROWS), np.empty(m * ROWS)
    for i in range(m):
        for k in range(ROWS):
            x = (k + 0.5 - 0.5 * ROWS) * length
            if -strips[BEHIND, i] < x < strips[AHEAD, i]:
                deep = depth_along(strips[:, i], int(found[BRANCH, int(strips[PART, i])]), x, rail)
                if deep > 0:
                    strip[count], row[count], away[count], depth[count], count = i, k, x, deep, count + 1
    return OverlapCells(strip[:count], row[:count], away[:count], depth[:count], length)


@njit(cache=True, error_model="numpy")
def add_carried(force, cells, strips, found, ends, carried):
    """Add the cells' forces (c,) to the positions (CARRIED, n) on whose parts they lie."""
    for c in range(len(force)):
        if force[c] == 0:
            continue
        of = strips[:, cells.strip[c]]
        x, station, tilt = of[X] + cells.away[c], 0.5 * (of[LOW] + of[HIGH]), np.arctan(-of[NY] / of[NZ])
        for k in range(found.shape[1]):
            if found[BRANCH, k] != found[BRANCH, int(of[PART])]:
                continue
            share = (min(of[HIGH], ends[2, k]) - max(of[LOW], ends[0, k])) / (of[HIGH] - of[LOW])
            if share <= 0:
                continue
            f = share * force[c]
            xx, across = x * x + cells.length**2 / 12, of[Y] ** 2 + of[Z] ** 2 + of[WIDTH] ** 2 / 12
            carried[:10, k] += f * np.array([1.0, of[NY], of[NZ], of[NX], x, of[Y], of[Z], station, xx, across])
            carried[10, k], carried[11, k] = max(carried[10, k], tilt), min(carried[11, k], tilt)


@njit(cache=True, error_model="numpy")
def side_mesh(found, number, height, side, pose, modulus):
    """SideMesh of the minima of a side that overlap.

    found : (POSITION, n) minima with negative gap + height, each branch in order
    """
    n, (_, wheel, rail, tip, _) = found.shape[1], side
    ends, cut, strips = np.zeros((3, n)), np.zeros(n), np.zeros((STRIP, 0))
    if n > 0:
        ends, depths = parts_of(found, height, wheel, rail, pose, tip)
        for k in range(n):
            if k == 0 or ends[0, k] > ends[2, k - 1] or found[BRANCH, k] != found[BRANCH, k - 1]:
                cut[k] = depths[0, k]
            if k == n - 1 or ends[2, k] < ends[0, k + 1] or found[BRANCH, k] != found[BRANCH, k + 1]:
                cut[k] = max(cut[k], depths[2, k])
        edges, part = strip_edges(found, ends, depths, number, height, wheel, rail, pose, tip)
        strips = strips_of(edges, part, found, height, wheel, rail, pose).copy()
    cells = cells_of(strips, found, rail)
    rows = np.zeros((2, strips.shape[1]), np.int64)
    rows[0] = ROWS - 1  # of strips without cells beyond their last one
    for strip, row in zip(cells.strip, cells.row):
        rows[0, strip], rows[1, strip] = min(rows[0, strip], row), max(rows[1, strip], row)
    return SideMesh(found, ends, cut, strips, cells, influence(strips, rows, cells.length, modulus))


@njit(cache=True, error_model="numpy")
def mesh_load(mesh, deeper, guess, residual):
    """SideLoad of a SideMesh once the wheel is lowered further by a little, over which strips and cells stay [m].

    guess : (any number of strips, ROWS) forces of cells to begin with, (0, ROWS) for none
    residual : as in solve_cells
    """
    strips, cells = mesh.strips, mesh.cells
    carried = np.zeros((CARRIED, mesh.found.shape[1]))
    carried[10], carried[11], carried[12] = -np.pi, np.pi, mesh.cut
    forces, c = np.zeros((strips.shape[1], ROWS)), len(cells.strip)
    if c == 0:
        return SideLoad(mesh.found, carried, 0.0, forces)
    start, depth, width = np.zeros(c), np.empty(c), np.empty(c)
    for k in range(c):
        strip = cells.strip[k]
        depth[k], width[k] = cells.depth[k] + deeper * strips[NZ, strip], strips[WIDTH, strip]
        if len(guess) > 0:
            start[k] = guess[strip * len(guess) // len(forces), cells.row[k]]
    force, left_over = solve_cells(mesh.lines, cells.strip, cells.row, depth, width, start, residual)
    add_carried(force, cells, strips, mesh.found, mesh.ends, carried)
    for k in range(c):
        forces[cells.strip[k], cells.row[k]] = force[k]
    return SideLoad(mesh.found, carried, left_over, forces)


@njit(cache=True, error_model="numpy")
def mesh_at(side, pose, number, height, modulus):
    """SideMesh of a Side with so many strips at a height of the pivot."""
    found = nearest_positions(side, pose, -height)
    keep = 0
    for k in range(found.shape[1]):
        if found[GAP, k] + height < 0:
            found[:, keep] = found[:, k]
            keep += 1
    return side_mesh(found[:, :keep].copy(), number, height, side, pose, modulus)


@njit(cache=True, error_model="numpy")
def loaded_side(side, pose, height, modulus):
    """SideLoad of a Side at a height of the pivot."""
    return mesh_load(mesh_at(side, pose, STRIPS, height, modulus), 0.0, np.zeros((0, ROWS)), RESIDUAL)


@njit(cache=True, error_model="numpy")
def carried_by(side, sign, lateral, yaw, roll, lever, arm, height, modulus):
    """Vertical force [N] that a Side carries at this roll and height of the pivot; sign +1 left, -1 right."""
    pose = side_pose(sign, lateral, yaw, roll, lever, arm, side.radius)
    return loaded_side(side, pose, height, modulus).carried[2].sum()


@njit(cache=True, error_model="numpy")
def nothing_carried():
    """SideLoad of a side that is not known yet."""
    return SideLoad(np.zeros((POSITION, 0)), np.zeros((CARRIED, 0)), 0.0, np.zeros((0, ROWS)))


@njit(cache=True, error_model="numpy")
def imbalance(total, loads):
    """Largest relative difference of vertical forces (2,) from loads (2,) that are not 0."""
    worst = 0.0
    for i in range(2):
        if loads[i] > 0:
            worst = max(worst, abs(total[i] / loads[i] - 1))
    return worst


@njit(cache=True, error_model="numpy")
def secant(slope, lowered, gained):
    """Slope over a lowering, where that is more than round-off and not far from the last one."""
    if abs(lowered) > 1e-14 and 0.05 * slope < gained / lowered < 20 * slope:
        return gained / lowered
    return slope


@njit(cache=True, error_model="numpy")
def settle_loaded(left, right, lateral, yaw, lever, arm, loads, modulus):
    """SettledSides under their vertical loads (2,) [N]; sides as in roll_and_height.

    Each side is driven by its own lowering, along the secant of force^(2/3), which is straight for one Hertz contact.
    A round cuts the overlaps into cells anew and begins with the pressures of the one before it. The few cells of
    first rounds stay until they carry the loads to FOLLOWED, and so do those of a round that has met the loads to
    NEARLY, for the lowering that is left: a change of the lowering by a part p changes their error of the force by 0.03
    p.
    """
    on_left, on_right = nothing_carried(), nothing_carried()
    roll, height, miss, arm_left, arm_right, scanned, near_left, near_right = touch(
        left, right, lateral, yaw, 0.0, lever, arm
    )
    if miss >= NO_RAIL:
        return SettledSides(roll, height, NO_RAIL, 0, on_left, on_right)
    down, slope, base = np.empty(2), np.empty(2), max(arm_left + arm_right, 0.1)
    for i in range(2):
        down[i] = (loads[i] / (0.7 * modulus)) ** (2 / 3)
        slope[i] = (0.7 * modulus) ** (2 / 3)
    before, carried, total, target = down.copy(), np.zeros(2), np.zeros(2), loads ** (2 / 3)
    low, high = np.zeros(2), np.full(2, np.inf)
    off, worst, few = NO_RAIL, NO_RAIL, True
    for count in range(ROUNDS):
        followed, few = few, few and off > FAR_OFF and count < FIRST_ROUNDS
        number, residual = FEW_STRIPS if few else STRIPS, LOOSE if few or followed else RESIDUAL
        turn = (down[1] - down[0]) / base
        at_roll, at_height = roll + turn, height - down[0] - arm_left * turn
        if abs(at_roll - scanned) > NEAR_ROLL or down.max() > NEAR_LOWERING:
            near_left, near_right = left, right
        # the sides may be of two kinds: no loop over them
        pose_left = side_pose(1.0, lateral, yaw, at_roll, lever, arm, left.radius)
        pose_right = side_pose(-1.0, lateral, yaw, at_roll, lever, arm, right.radius)
        mesh_left = mesh_at(near_left, pose_left, number, at_height, modulus)
        mesh_right = mesh_at(near_right, pose_right, number, at_height, modulus)
        on_left = mesh_load(mesh_left, 0.0, on_left.cells, residual)
        on_right = mesh_load(mesh_right, 0.0, on_right.cells, residual)
        total[0], total[1] = on_left.carried[2].sum(), on_right.carried[2].sum()
        off = worst = imbalance(total, loads)
        if worst < CLOSE and residual <= RESIDUAL:
            return SettledSides(at_roll, at_height, worst, count + 1, on_left, on_right)
        for i in range(2):
            root = max(total[i], 0.0) ** (2 / 3)
            if not followed:
                slope[i] = secant(slope[i], down[i] - before[i], root - carried[i])
            elif count == 0 and root > 0 and down[i] > 0:
                slope[i] = root / down[i]
            before[i], carried[i] = down[i], root
            down[i] = before[i] + (target[i] - root) / slope[i] if loads[i] > 0 else 0.0
            down[i] = min(max(down[i], 0.2 * before[i]), 5 * before[i] + 1e-9)
            if total[i] < loads[i]:
                low[i] = before[i]
            else:
                high[i] = before[i]
            if low[i] >= high[i]:  # the other side has moved this one
                low[i], high[i] = 0.5 * low[i], np.inf
            if count > 8 and loads[i] > 0 and high[i] < np.inf and not (low[i] < down[i] < high[i]):
                down[i] = 0.5 * (low[i] + high[i])
        if not few and not (worst < NEARLY and residual <= RESIDUAL):
            continue
        last, root_last = before.copy(), carried.copy()
        for _ in range(LAST_STEPS):
            on_left = mesh_load(mesh_left, down[0] - before[0], on_left.cells, residual)
            on_right = mesh_load(mesh_right, down[1] - before[1], on_right.cells, residual)
            total[0], total[1] = on_left.carried[2].sum(), on_right.carried[2].sum()
            worst = imbalance(total, loads)
            if worst < CLOSE and not few:
                turn = (down[1] - down[0]) / base
                at_roll, at_height = roll + turn, height - down[0] - arm_left * turn
                return SettledSides(at_roll, at_height, worst, count + 1, on_left, on_right)
            for i in range(2):
                root = max(total[i], 0.0) ** (2 / 3)
                slope[i] = secant(slope[i], down[i] - last[i], root - root_last[i])
                last[i], root_last[i] = down[i], root
                if loads[i] > 0:
                    down[i] = max(down[i] + (target[i] - root) / slope[i], 0.2 * before[i])
            if worst < FOLLOWED and few:
                break
        # else a step of the force within the cells: on with the next round
    return SettledSides(at_roll, at_height, worst, ROUNDS, on_left, on_right)
