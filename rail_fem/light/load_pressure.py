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
LOW, HIGH, X, Y, Z, NX, NY, NZ, WIDTH, DEPTH, BEND, BEHIND, AHEAD, SLOPE, PART, STRIP = range(16)
# of a strip: stations of its edges; position and unit normal; width along the surface; depth along the normal and what
# the wheel takes from it along x, 1/2 BEND x^2; reach of the overlap behind and ahead; dz/dx; part of the profile it
# lies on; STRIP: their number
ITERATIONS = 300
RESIDUAL = 1e-9  # of the largest depth
NEAR = 1.6  # cells from which the first two terms of the series are good to 0.3 %
GUESS = 0.45  # the first patch is where the depth is larger than this part of the largest


@njit(cache=True, error_model="numpy")
def corner(x, y):
    """Love's double antiderivative of 1 / r, odd in both."""
    total = 0.0
    if x != 0:
        total += x * np.arcsinh(y / abs(x))
    if y != 0:
        total += y * np.arcsinh(x / abs(y))
    return total


@njit(cache=True, error_model="numpy")
def mean_inverse(x, y, length, width):
    """Mean of 1 / r over a rectangle about (x, y) [1/m]; from NEAR cells away by 1 / r and its second derivatives."""
    square, near = x * x + y * y, NEAR * max(length, width)
    if square > near * near:
        return (
            1 + ((3 * x * x / square - 1) * length**2 + (3 * y * y / square - 1) * width**2) / (24 * square)
        ) / np.sqrt(square)
    a, b, c, d = x - 0.5 * length, x + 0.5 * length, y - 0.5 * width, y + 0.5 * width
    return (corner(b, d) - corner(a, d) - corner(b, c) + corner(a, c)) / (length * width)


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
            for k in range(2 * ROWS - 1):
                x = (k - ROWS + 1) * length + shift
                table[k] = (
                    0.5
                    * facing
                    * (
                        mean_inverse(x, apart, length, strips[WIDTH, i])
                        + mean_inverse(x, apart, length, strips[WIDTH, j])
                    )
                )
            for a in range(first[i], first[i + 1]):
                for b in range(first[j], first[j + 1]):
                    matrix[a, b] = matrix[b, a] = table[row[a] - row[b] + ROWS - 1]
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
def first_forces(matrix, depth):
    """Forces (c,) about as large as those sought, and what they press down (c,)."""
    force, product = np.sqrt(np.maximum(depth / depth.max() - GUESS, 0.0)), np.empty(len(depth))
    multiply(matrix, force, product)
    size = (force * depth).sum() / (force * product).sum()
    return force * size, product * size


@njit(cache=True, error_model="numpy")
def solve_forces(matrix, depth):
    """Forces (c,) [N] and the largest error left over the largest depth, which is below RESIDUAL unless ITERATIONS were
    too few.

    matrix : (c, c) [m/N], symmetric and positive;  depth : (c,) > 0 [m]
    Conjugate gradients on the cells that carry; negative ones leave, those that overlap join.
    """
    slack = RESIDUAL * depth.max()
    force, product = first_forces(matrix, depth)
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
