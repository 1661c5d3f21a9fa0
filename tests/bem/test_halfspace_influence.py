"""Influence coefficients against quadrature, and the FFT products against direct sums."""

import numpy as np
import pytest
from scipy.integrate import dblquad

from bem.exact.hertz import point_contact
from bem.halfspace.friction import TangentialOperator
from bem.halfspace.influence import backward, forward, kernel_spectrum, padded_shape, rectangle_integrals
from bem.halfspace.tangential import CouplingOperator
from bem.material import STEEL, Elastic, Pair, contact_modulus
from bem.patch import Grid

KERNELS = {
    "1/r": lambda x, y: 1 / np.hypot(x, y),
    "xx/r3": lambda x, y: x**2 / np.hypot(x, y) ** 3,
    "xy/r3": lambda x, y: x * y / np.hypot(x, y) ** 3,
    "x/r2": lambda x, y: x / (x**2 + y**2),
    "y/r2": lambda x, y: y / (x**2 + y**2),
}
GRID = Grid.over((-1.0, 1.2), (-0.5, 0.7), 7, 5)


@pytest.mark.parametrize("name", KERNELS)
def test_rectangle_integrals_equal_quadrature(name):
    """Away from the singularity, where adaptive quadrature is good to 1e-10."""
    dx, dy = 0.3, 0.2
    table = rectangle_integrals(name, dx, dy, 4, 5)
    for i, j in ((1, 0), (0, 2), (3, 4), (2, 1)):
        exact = dblquad(
            lambda y, x: KERNELS[name](x, y), (i - 0.5) * dx, (i + 0.5) * dx, (j - 0.5) * dy, (j + 0.5) * dy
        )[0]
        assert table[i, j] == pytest.approx(exact, abs=1e-9)


def test_a_loaded_square_sinks_in_its_middle_by_loves_value():
    """Love (1929): integral of 1/r over a square of side 2c from its middle is 8 c ln(1 + sqrt 2)."""
    assert rectangle_integrals("1/r", 2.0, 2.0, 1, 1)[0, 0] == pytest.approx(8 * np.log(1 + np.sqrt(2)), rel=1e-14)


@pytest.mark.parametrize("name", KERNELS)
def test_product_by_fft_equals_the_direct_sum(name):
    field = np.random.default_rng(1).standard_normal(GRID.shape)
    size = padded_shape(*GRID.shape)
    product = backward(kernel_spectrum(name, GRID) * forward(field, size), GRID.shape, size)
    table = rectangle_integrals(name, GRID.dx, GRID.dy, *GRID.shape)
    odd_x, odd_y = name in ("xy/r3", "x/r2"), name in ("xy/r3", "y/r2")
    direct = np.zeros(GRID.shape)
    for i, j in np.ndindex(GRID.shape):
        for k, m in np.ndindex(GRID.shape):
            sign = (np.sign(i - k) if odd_x else 1) * (np.sign(j - m) if odd_y else 1)
            direct[i, j] += sign * table[abs(i - k), abs(j - m)] * field[k, m]
    np.testing.assert_allclose(product, direct, atol=1e-12 * np.abs(direct).max())


@pytest.mark.parametrize("ratio", [0.02, 0.2, 1.0, 5.0, 50.0])
@pytest.mark.parametrize("poisson", [0.0, 0.28, 0.4999])
@pytest.mark.parametrize("cells", [(20, 31), (28, 20), (41, 41)])
def test_periodic_influence_is_positive_so_that_friction_converges(ratio, poisson, cells):
    """Every 2 x 2 block of the tangential spectrum and every entry of the normal one is positive: C is monotone."""
    grid = Grid.over((-1, 1), (-1 / ratio, 1 / ratio), *cells)
    assert kernel_spectrum("1/r", grid).min() > 0
    operator = TangentialOperator(grid, Pair(1.0, poisson, 0.0), direction=0)
    assert (operator.xx + operator.yy).min() > 0
    assert (operator.xx * operator.yy - operator.xy**2).min() > 0


def test_slip_per_metre_rolled_is_the_difference_of_displacements():
    pair = Pair.of(STEEL, STEEL)
    traction = np.random.default_rng(2).standard_normal((2, *GRID.shape))
    wide = Grid(GRID.x_first, GRID.y_first, GRID.dx, GRID.dy, GRID.nx + 1, GRID.ny)
    padded = np.zeros((2, *wide.shape))
    padded[:, :-1] = traction
    displacement = TangentialOperator(wide, pair, direction=0).product(padded)
    slip = TangentialOperator(GRID, pair, direction=1).product(traction)
    expected = (displacement[:, :-1] - displacement[:, 1:]) / GRID.dx
    np.testing.assert_allclose(slip, expected, atol=1e-11 * np.abs(expected).max())


def test_coupling_is_reciprocal():
    """Betti: work of the pressure on the opening by tractions = minus work of the tractions on the shift by pressure,
    as u_n counts opening positive and pressure closes."""
    pair = Pair.of(STEEL, Elastic(70e9, 0.33))
    coupling = CouplingOperator(GRID, pair)
    rng = np.random.default_rng(3)
    pressure, traction = rng.random(GRID.shape), rng.standard_normal((2, *GRID.shape))
    normal = (pressure * coupling.normal_displacement(traction)).sum()
    tangential = (traction * coupling.tangential_motion(pressure, direction=0)).sum()
    assert normal == pytest.approx(tangential, rel=1e-11)
    assert abs(normal) > 0


def test_pair_gives_the_contact_modulus_and_no_coupling_for_like_materials():
    aluminium = Elastic(70e9, 0.33)
    assert Pair.of(STEEL, aluminium).modulus == pytest.approx(contact_modulus(STEEL, aluminium), rel=1e-14)
    assert Pair.of(STEEL, STEEL).coupling == 0
    assert Pair.of(STEEL, aluminium).coupling == -Pair.of(aluminium, STEEL).coupling != 0


def test_hertz_pressure_makes_hertz_displacement():
    """Under the ellipsoid the displacement is approach - gap; second-order midpoint rule with a root edge: h^1.5."""
    pair = Pair.of(STEEL, STEEL)
    exact = point_contact(1e5, 0.3, 0.3, pair.modulus)
    grid = Grid.over((-1.05 * exact.semi_x, 1.05 * exact.semi_x), (-1.05 * exact.semi_y, 1.05 * exact.semi_y), 81, 81)
    x, y = grid.points()
    size = padded_shape(*grid.shape)
    spectrum = kernel_spectrum("1/r", grid) / (np.pi * pair.modulus)
    displacement = backward(spectrum * forward(exact.pressure(x, y), size), grid.shape, size)
    inside = x**2 + y**2 < (0.8 * exact.semi_x) ** 2
    expected = exact.approach - (x**2 + y**2) / 0.6
    np.testing.assert_allclose(displacement[inside], expected[inside], atol=(1 / 81) ** 1.5 * exact.approach)
