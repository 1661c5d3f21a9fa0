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

ROWS = 14  # of cells, along the longest strip
LOW, HIGH, X, Y, Z, NX, NY, NZ, WIDTH, DEPTH, BEND, BEHIND, AHEAD, SLOPE, PART, BASE, STRIP = range(17)
# of a strip: stations of its edges; position and unit normal; width along the surface; depth along the normal and what
# the wheel takes from it along x, 1/2 BEND x^2; reach of the overlap behind and ahead; dz/dx; part of the profile it
# lies on; height of a lofted rail there; STRIP: their number
ITERATIONS = 300
RESIDUAL = 1e-9  # of the largest depth
NEAR = 1.6  # cells from which the first two terms of the series are good to 0.3 %
GUESS = 0.45  # the first patch is where the depth is larger than this part of the largest


@njit(cache=True, error_model="numpy")
def corner(x, y):
    """Love's double antiderivative of 1 / r, x asinh(y / |x|) + y asinh(x / |y|), odd in both."""
    wide, high = abs(x), abs(y)
    radius, total = np.sqrt(x * x + y * y), 0.0
    if wide > 0:
        total += wide * np.log((high + radius) / wide)
    if high > 0:
        total += high * np.log((wide + radius) / high)
    return total if (x < 0) == (y < 0) else -total


@njit(cache=True, error_model="numpy")
def edge_integral(x, y, width):
    """Difference of Love's antiderivative along an edge at x across a strip of this width about y."""
    return corner(x, y + 0.5 * width) - corner(x, y - 0.5 * width)


@njit(cache=True, error_model="numpy")
def far_inverse(x, y, length, width_square):
    """Mean of 1 / r over a rectangle about (x, y), far from it, by 1 / r and its second derivatives [1/m]."""
    square = x * x + y * y
    along, across = 3 * x * x / square - 1, 3 * y * y / square - 1
    return (1 + (along * length**2 + across * width_square) / (24 * square)) / np.sqrt(square)


@njit(cache=True, error_model="numpy")
def fill_pair(table, shift, apart, length, one, other):
    """Mean of 1 / r over the cells of one strip and of the other, for every number of rows that lie between them, into
    (2 ROWS - 1,) [1/m]: Love's integral near by, whose edges neighbours share; beyond NEAR cells the series."""
    near = NEAR * max(length, one), NEAR * max(length, other)
    known, right = -2, (0.0, 0.0)
    for k in range(2 * ROWS - 1):
        x = (k - ROWS + 1) * length + shift
        square = x * x + apart * apart
        if square > near[0] ** 2 and square > near[1] ** 2:
            table[k] = far_inverse(x, apart, length, 0.5 * (one * one + other * other))
            continue
        left = right
        if known != k - 1:
            left = edge_integral(x - 0.5 * length, apart, one), edge_integral(x - 0.5 * length, apart, other)
        right = edge_integral(x + 0.5 * length, apart, one), edge_integral(x + 0.5 * length, apart, other)
        known = k
        first, second = (right[0] - left[0]) / (length * one), (right[1] - left[1]) / (length * other)
        if square > near[0] ** 2:
            first = far_inverse(x, apart, length, one * one)
        if square > near[1] ** 2:
            second = far_inverse(x, apart, length, other * other)
        table[k] = 0.5 * (first + second)


@njit(cache=True, error_model="numpy")
def first_cells(strip, count):
    """First cell of each of `count` strips (count + 1,), from the strip of each cell, in order."""
    first = np.zeros(count + 1, np.int64)
    for i in strip:
        first[i + 1] += 1
    for i in range(count):
        first[i + 1] += first[i]
    return first


@njit(cache=True, error_model="numpy")
def influence(strips, strip, row, length, modulus):
    """(c, c) depth that 1 N in one cell takes from another [m/N], symmetric.

    strips : (STRIP, m);  strip, row : (c,) of each cell, `length` [m] along x
    """
    m, c = strips.shape[1], len(strip)
    first, matrix, table = first_cells(strip, m), np.empty((c, c)), np.empty(2 * ROWS - 1)
    for i in range(m):
        for j in range(i, m):
            facing = (strips[NX, i] * strips[NX, j] + strips[NY, i] * strips[NY, j] + strips[NZ, i] * strips[NZ, j]) / (
                np.pi * modulus
            )
            apart, shift = (
                np.hypot(strips[Y, i] - strips[Y, j], strips[Z, i] - strips[Z, j]),
                strips[X, i] - strips[X, j],
            )
            fill_pair(table, shift, apart, length, strips[WIDTH, i], strips[WIDTH, j])
            for a in range(first[i], first[i + 1]):
                for b in range(first[j], first[j + 1]):
                    matrix[a, b] = matrix[b, a] = facing * table[row[a] - row[b] + ROWS - 1]
    return matrix


@njit(cache=True, error_model="numpy")
def multiply(matrix, vector, out):
    """out = matrix vector for a symmetric matrix; zeros are passed over."""
    out[:] = 0.0
    for j in range(len(vector)):
        if vector[j] != 0.0:
            factor, line = vector[j], matrix[j]
            for i in range(len(out)):
                out[i] += factor * line[i]


@njit(cache=True, error_model="numpy")
def first_forces(matrix, depth, guess):
    """Forces (c,) about as large as those sought, and what they press down (c,): a guess where it says anything,
    scaled."""
    force, product = guess.copy(), np.empty(len(depth))
    if not (force * depth).sum() > 0:
        force[:] = np.sqrt(np.maximum(depth / depth.max() - GUESS, 0.0))
    multiply(matrix, force, product)
    size = (force * depth).sum() / (force * product).sum()
    return force * size, product * size


@njit(cache=True, error_model="numpy")
def solve_forces(matrix, depth, guess, residual):
    """Forces (c,) [N] and the largest error left over the largest depth, which is below `residual` unless ITERATIONS
    were too few.

    matrix : (c, c) [m/N], symmetric and positive;  depth : (c,) > 0 [m];  guess : (c,) forces >= 0 to begin with, zeros
        for none
    Conjugate gradients on the cells that carry; negative ones leave, those that overlap join.
    """
    slack = residual * depth.max()
    force, product = first_forces(matrix, depth, guess)
    direction, deflection, error = np.zeros(len(depth)), np.empty(len(depth)), np.empty(len(depth))
    before, restart, largest = 1.0, True, 1.0
    for _ in range(ITERATIONS):
        square, largest = 0.0, 0.0
        for i in range(len(depth)):
            error[i] = product[i] - depth[i]
            if force[i] > 0:
                square += error[i] * error[i] / matrix[i, i]
            if force[i] > 0 or error[i] < 0:
                largest = max(largest, abs(error[i]))
        if largest <= slack:
            break
        keep, before = (0.0 if restart else square / before), square
        for i in range(len(depth)):
            direction[i] = error[i] / matrix[i, i] + keep * direction[i] if force[i] > 0 else 0.0
        multiply(matrix, direction, deflection)
        bottom = (direction * deflection).sum()
        step, restart = ((error * direction).sum() / bottom if bottom > 0 else 0.0), False
        for i in range(len(depth)):
            product[i] -= step * deflection[i]
            if force[i] > 0:
                force[i] -= step * direction[i]
                if force[i] <= 0:
                    force[i], restart = 0.0, True
            elif product[i] < depth[i] - slack:
                force[i], restart = 0.5 * (depth[i] - product[i]) / matrix[i, i], True
        if restart:
            multiply(matrix, force, product)
    return force, largest / depth.max()
