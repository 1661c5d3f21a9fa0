"""Forces between two bodies that overlap by a little: the half-space on cells that follow the patch.

The positions that overlap come as strips across, each cut into cells along its lowest line. In every cell with a force
F >= 0

    e = sum_j G_ij F_j - depth_i >= 0,   e F = 0,   G_ij = n_i . n_j <1 / r> / (pi E*),

depth and displacement along the cell's own normal n, <1 / r> the mean over a cell (Love's integral where near). On one
plane this is the half-space of Boussinesq; positions that face each other at an angle press each other down by its
cosine. G is the product, entry by entry, of two positive matrices and so positive itself (Schur): there is one answer,
and it changes continuously with the depths.

Error against Hertz: 0.3 % of the force (tests/rail_fem/test_load_sharing.py); against bem.halfspace.normal:
tests/rail_fem/test_load_merge.py.
Source: Johnson, Contact Mechanics (1985), sections 3.2 and 3.3 (displacement under pressure); Polonsky and Keer, Wear
231 (1999) 206 (solution).
"""

import numpy as np

from kernel_cache import njit
from rail_fem.contact.strip_influence import LINE, ROWS, fill_pair

LOW, HIGH, X, Y, Z, NX, NY, NZ, WIDTH, DEPTH, BEND, BEHIND, AHEAD, SLOPE, PART, BASE, STRIP = range(17)
# of a strip: stations of its edges; position and unit normal; width along the surface; depth along the normal and what
# the wheel takes from it along x, 1/2 BEND x^2; reach of the overlap behind and ahead; dz/dx; part of the profile it
# lies on; height of a lofted rail there; STRIP: their number
ITERATIONS = 300
JOININGS = 40  # times that cells may join those that are solved for
RESIDUAL = 1e-9  # of the largest depth
GUESS = 0.45  # the first patch is where the depth is larger than this part of the largest


@njit(cache=True, error_model="numpy")
def influence(strips, rows, length, modulus):
    """(m, m LINE) depth that 1 N in a cell of one strip takes from the cells of all others [m/N]: row i, entry j LINE +
    ROWS - 1 + k for the cell of strip j that lies k rows ahead of that of strip i.

    strips : (STRIP, m);  rows : (2, m) first and last row of each that may carry, for which alone it is found
    length : of a cell along x [m]
    """
    m = strips.shape[1]
    lines, table = np.empty((m, m * LINE)), np.zeros(LINE)
    for i in range(m):
        for j in range(i, m):
            facing = (strips[NX, i] * strips[NX, j] + strips[NY, i] * strips[NY, j] + strips[NZ, i] * strips[NZ, j]) / (
                np.pi * modulus
            )
            apart, shift = (
                np.hypot(strips[Y, i] - strips[Y, j], strips[Z, i] - strips[Z, j]),
                strips[X, j] - strips[X, i],
            )
            first, last = ROWS - 1 + rows[0, j] - rows[1, i], ROWS - 1 + rows[1, j] - rows[0, i]
            table[:first], table[last + 1 :] = 0.0, 0.0
            fill_pair(table, first, last, shift, apart, length, strips[WIDTH, i], strips[WIDTH, j])
            for k in range(LINE):
                lines[i, j * LINE + k] = facing * table[k]
                lines[j, i * LINE + LINE - 1 - k] = facing * table[k]
    return lines


@njit(cache=True, error_model="numpy")
def chosen_matrix(lines, strip, row, chosen):
    """(n, n) influence between chosen cells (n,), from that of all strips; strip, row : (c,) of each cell."""
    n = len(chosen)
    matrix, offset = np.empty((n, n)), strip[chosen] * LINE + row[chosen] + ROWS - 1
    for a in range(n):
        line, into = lines[strip[chosen[a]]], matrix[a]
        back = row[chosen[a]]
        for b in range(n):
            into[b] = line[offset[b] - back]
    return matrix


@njit(cache=True, error_model="numpy")
def pressed_down(lines, strip, row, force):
    """(m ROWS,) what forces (c,) of cells take from the depth of the cells of all strips, row by row; it has no meaning
    where none overlaps."""
    m = len(lines)
    total = np.zeros(m * ROWS)
    for c in range(len(force)):
        if force[c] > 0:
            factor, line, back = force[c], lines[strip[c]], ROWS - 1 - row[c]
            for j in range(m):
                for k in range(ROWS):
                    total[j * ROWS + k] += factor * line[j * LINE + back + k]
    return total


@njit(cache=True, error_model="numpy")
def multiply(matrix, vector, out):
    """out = matrix vector for a symmetric matrix, four of its lines at a time."""
    n = len(vector)
    out[:] = 0.0
    for j in range(0, n - n % 4, 4):
        f, g, h, k = vector[j], vector[j + 1], vector[j + 2], vector[j + 3]
        first, second, third, fourth = matrix[j], matrix[j + 1], matrix[j + 2], matrix[j + 3]
        for i in range(n):
            out[i] += f * first[i] + g * second[i] + h * third[i] + k * fourth[i]
    for j in range(n - n % 4, n):
        f, first = vector[j], matrix[j]
        for i in range(n):
            out[i] += f * first[i]


@njit(cache=True, error_model="numpy")
def solve_forces(matrix, depth, guess, slack):
    """Forces (n,) [N] and the largest error left [m], which is below `slack` unless ITERATIONS were too few.

    matrix : (n, n) [m/N], symmetric and positive;  depth : (n,) > 0 [m];  guess : (n,) forces >= 0 to begin with, some
        of them > 0, of any size in all
    Conjugate gradients on the cells that carry; negative ones leave, those that overlap join, and then it begins anew.
    """
    n = len(depth)
    force, product = guess.copy(), np.empty(n)
    multiply(matrix, force, product)
    size = (force * depth).sum() / (force * product).sum()
    force *= size
    product *= size
    own = 1.0 / np.diag(matrix)
    direction, deflection = np.zeros(n), np.empty(n)
    before, anew, largest = 1.0, True, np.inf
    for _ in range(ITERATIONS):
        square, largest = 0.0, 0.0
        for i in range(n):
            error = product[i] - depth[i]
            if force[i] > 0:
                square += error * error * own[i]
                largest = max(largest, abs(error))
            else:
                largest = max(largest, -error)
        if largest <= slack:
            break
        keep, before, falls = (0.0 if anew else square / before), square, 0.0
        for i in range(n):
            error = product[i] - depth[i]
            direction[i] = error * own[i] + keep * direction[i] if force[i] > 0 else 0.0
            falls += error * direction[i]
        multiply(matrix, direction, deflection)
        bottom = (direction * deflection).sum()
        step = falls / bottom if bottom > 0 else 0.0
        anew = not falls > 0
        for i in range(n):
            product[i] -= step * deflection[i]
            if force[i] > 0:
                force[i] -= step * direction[i]
        changed = False
        for i in range(n):
            change = 0.0
            if force[i] < 0:
                change, force[i] = -force[i], 0.0
            elif force[i] == 0 and product[i] < depth[i] - slack:
                change, anew = 0.5 * (depth[i] - product[i]) * own[i], True
                force[i] = change
            if change != 0:
                changed = True
        if changed:
            multiply(matrix, force, product)
    return force, largest


@njit(cache=True, error_model="numpy")
def solve_cells(lines, strip, row, depth, width, guess, residual):
    """Forces (c,) of all cells [N] and the largest error left over the largest depth, which is below `residual` unless
    ITERATIONS were too few.

    lines : influence;  strip, row, depth, width : (c,) of each cell, depths > 0 [m]
    guess : (c,) forces >= 0 to begin with, zeros for none
    Only cells that are thought to carry are solved for. Those that still overlap then join them and those that carry
    nothing leave, until none overlaps: what is left out is looked at too, each time.
    """
    slack, force = residual * depth.max(), guess.copy()
    if not (force * depth).sum() > 0:
        force[:] = width * np.sqrt(np.maximum(depth / depth.max() - GUESS, 0.0))
    left_over = np.inf
    for _ in range(JOININGS):
        chosen = np.flatnonzero(force > 0)
        matrix = chosen_matrix(lines, strip, row, chosen)
        solved, left_over = solve_forces(matrix, depth[chosen], force[chosen], slack)
        force[chosen] = solved
        pressed, joined = pressed_down(lines, strip, row, force), False
        for c in range(len(force)):
            if force[c] == 0:
                short = depth[c] - pressed[strip[c] * ROWS + row[c]]
                if short > slack:
                    force[c], joined = 0.5 * short / lines[strip[c], strip[c] * LINE + ROWS - 1], True
                    left_over = max(left_over, short)
        if not joined:
            break
    return force, left_over / depth.max()
