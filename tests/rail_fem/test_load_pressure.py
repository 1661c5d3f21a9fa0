"""Pressures between strips of cells: Love's integral against its textbook form, means of 1 / r against quadrature, the
answer's conditions of contact on every cell."""

import numpy as np
import pytest
from scipy.integrate import quad

from rail_fem.contact.load_pressure import HIGH, LOW, NZ, RESIDUAL, STRIP, WIDTH, X, Y, Z, influence, solve_cells
from rail_fem.contact.strip_influence import LINE, NEAR, ROWS, corner, fill_pair

MODULUS = 115e9


def love(x: float, y: float) -> float:
    """Johnson's form of the double antiderivative of 1 / r."""
    return x * np.arcsinh(y / abs(x)) + y * np.arcsinh(x / abs(y))


def test_a_corner_is_loves_antiderivative():
    random = np.random.default_rng(3)
    sizes = 10 ** random.uniform(-7, -1, (2000, 2)) * random.choice([-1, 1], (2000, 2))
    for x, y in sizes:
        # round-off of a sum of logarithms up to ln 1e6
        assert corner(x, y, np.log(abs(x)), np.log(abs(y))) == pytest.approx(love(x, y), rel=3e-14)
    assert corner(0.0, 1e-3, -np.inf, np.log(1e-3)) == 0.0


def mean_inverse(x: float, apart: float, length: float, width: float) -> float:
    """Mean of 1 / r from the origin over a rectangle about (x, apart): the integral along x closed, that across by
    quadrature."""
    along = lambda y: np.arcsinh((x + length / 2) / abs(y)) - np.arcsinh((x - length / 2) / abs(y))
    low, high = apart - width / 2, apart + width / 2
    cuts = [low, 0.0, high] if low < 0 < high else [low, high]
    return sum(quad(along, a, b, epsrel=1e-11)[0] for a, b in zip(cuts, cuts[1:])) / (length * width)


@pytest.mark.parametrize("shift, apart", [(0.0, 0.0), (0.1e-3, 0.0), (-0.2e-3, 0.4e-3), (0.0, 1.1e-3), (0.3e-3, 4e-3)])
def test_means_of_inverse_distance_are_those_of_quadrature(shift, apart):
    """Love's integral to the quadrature's error, beyond NEAR cells the series to 0.3 %."""
    length, one, other, table = 0.8e-3, 0.3e-3, 0.5e-3, np.empty(LINE)
    fill_pair(table, 0, LINE - 1, shift, apart, length, one, other)
    for k in range(LINE):
        x = (k - ROWS + 1) * length + shift
        mean = 0.5 * (mean_inverse(x, apart, length, one) + mean_inverse(x, apart, length, other))
        assert table[k] == pytest.approx(mean, rel=3e-3 if np.hypot(x, apart) > NEAR * length else 1e-9)


def cells_of_a_patch(second: float):
    """Strips of a dome 100 um deep, and beside it another one `second` [m] deep: strips, cells, depths."""
    edges, length = np.concatenate([np.linspace(-7e-3, 7e-3, 21), 20e-3 + np.linspace(-3e-3, 3e-3, 9)]), 1.3e-3
    strips, strip, row, depth = [], [], [], []
    for k, (low, high) in enumerate(zip(edges, edges[1:])):
        if k == 20:  # between them
            continue
        y, i = 0.5 * (low + high), len(strips)
        deepest = 100e-6 * (1 - (y / 7e-3) ** 2) if k < 20 else second * (1 - ((y - 20e-3) / 3e-3) ** 2)
        one = np.zeros(STRIP)
        one[[LOW, HIGH, X, Y, Z, WIDTH, NZ]] = low, high, 0.05 * y, y, 0.0, high - low, 1.0
        strips.append(one)
        deep = deepest - ((np.arange(ROWS) + 0.5 - ROWS / 2) * length) ** 2 / 0.9
        overlaps = np.flatnonzero(deep > 0)
        strip += [i] * len(overlaps)
        row += list(overlaps)
        depth += list(deep[overlaps])
    strips = np.array(strips).T.copy()
    return strips, np.array(strip), np.array(row), np.array(depth), length


@pytest.mark.parametrize("second", [0.0, 20e-6, 60e-6, 99e-6])
@pytest.mark.parametrize("begun", ["without a guess", "with another's forces", "in one corner"])
def test_every_cell_either_carries_without_gap_or_is_free(second, begun):
    """Of all cells, also of those that were left out of the solution; whatever it begins with."""
    strips, strip, row, depth, length = cells_of_a_patch(second)
    of_strips = [row[strip == i] for i in range(strips.shape[1])]
    rows = np.array([[some.min(initial=ROWS - 1), some.max(initial=0)] for some in of_strips]).T.copy()
    lines = influence(strips, rows, length, MODULUS)
    guess = np.zeros(len(depth))
    if begun == "with another's forces":
        guess = solve_cells(lines, strip, row, 100e-6 - depth, strips[WIDTH][strip], guess, 1e-3)[0]
    elif begun == "in one corner":
        guess[:3] = 1.0
    force, left_over = solve_cells(lines, strip, row, depth, strips[WIDTH][strip], guess, RESIDUAL)
    offset = strip * LINE + row + ROWS - 1
    matrix = np.array([lines[i, offset - k] for i, k in zip(strip, row)])
    assert matrix == pytest.approx(matrix.T, rel=1e-13)
    error = matrix @ force - depth
    slack = 1.01 * RESIDUAL * depth.max()
    assert left_over <= RESIDUAL and (force >= 0).all() and error.min() > -slack
    assert np.abs(error[force > 0]).max() < slack
    assert 0 < (force > 0).sum() < len(force)
