"""Kalker's coefficients: published rows, limits, reciprocity, convergence; and the table against fresh values."""

import numpy as np
import pytest

from bem.exact.kalker import CreepageCoefficients, creepage_coefficients
from bem.exact.kalker_table import coefficients
from bem.material import STEEL, Pair
from bem.patch import ContactInputError, Creepage
from tests.bem.closed_forms import linear_creep_forces

# a/b, nu: C11, C22, C23, C33 of Kalker (1990), Table E3; three digits are printed
PUBLISHED = {
    (0.2, 0.0): (2.59, 2.59, 0.483, 3.46),
    (0.5, 0.0): (2.88, 2.88, 0.827, 1.74),
    (1.0, 0.0): (3.40, 3.40, 1.33, 1.21),
    (0.2, 0.25): (3.37, 2.63, 0.603, 4.27),
    (0.5, 0.25): (3.62, 3.01, 0.929, 1.93),
    (0.7, 0.25): (3.81, 3.28, 1.14, 1.50),
    (1.0, 0.25): (4.12, 3.67, 1.47, 1.19),
    (1 / 0.7, 0.25): (4.54, 4.21, 1.95, 0.965),
    (2.0, 0.25): (5.10, 4.90, 2.62, 0.819),
    (5.0, 0.25): (7.78, 8.14, 6.63, 0.601),
    (0.2, 0.5): (4.81, 2.66, 0.809, 5.66),
    (1.0, 0.5): (5.20, 3.98, 1.63, 1.16),
    (2.0, 0.5): (6.11, 5.56, 2.96, 0.650),
    (0.1, 0.25): (3.31, 2.52, 0.473, 8.28),
    (10.0, 0.25): (11.7, 12.8, 14.6, 0.526),
}


def as_array(c: CreepageCoefficients) -> np.ndarray:
    return np.array([c.c11, c.c22, c.c23, c.c33])


@pytest.mark.parametrize("row", PUBLISHED)
def test_table_meets_kalkers_published_rows(row):
    """To 0.8 %; the rows at a/b = 10, computed in 1967 with few terms, to 1.5 %."""
    np.testing.assert_allclose(as_array(coefficients(*row)), PUBLISHED[row], rtol=0.015 if row[0] >= 10 else 0.008)


@pytest.mark.parametrize("ratio, poisson", [(1.0, 0.25), (0.3, 0.4), (4.0, 0.1)])
def test_coefficients_converge_with_the_degree(ratio, poisson):
    """Against degree 14: at degree 10 below 3e-4 in C11 and C22, 6e-4 in C23, 1e-3 in C33; a quarter of degree 4 at
    most."""
    best = as_array(creepage_coefficients(ratio, poisson, 14))
    errors = np.array(
        [np.abs(as_array(creepage_coefficients(ratio, poisson, degree)) / best - 1) for degree in (4, 6, 10)]
    )
    assert (errors[-1] < [3e-4, 3e-4, 6e-4, 1e-3]).all(), errors
    assert (errors[-1] < errors[0] / 4 + 1e-5).all(), errors


def test_without_poissons_ratio_the_two_directions_are_alike_and_c23_of_the_circle_is_four_thirds():
    c = creepage_coefficients(1.0, 0.0)
    assert c.c11 == pytest.approx(c.c22, rel=1e-10)
    assert c.c23 == pytest.approx(4 / 3, rel=1e-5)


def test_slender_ellipses_tend_to_the_line_contact():
    """a/b -> 0: C11 -> pi^2 / (4 (1 - nu)), C22 -> pi^2 / 4 (Kalker 1990, Table E3's asymptotes)."""
    c = creepage_coefficients(1 / 60, 0.25)
    assert c.c11 == pytest.approx(np.pi**2 / (4 * 0.75), rel=2e-3)
    assert c.c22 == pytest.approx(np.pi**2 / 4, rel=2e-3)


def test_lateral_creepage_makes_the_moment_that_spin_makes_as_force():
    """C32 = -C23, from the solution itself: the moment by lateral creepage against the force by spin; to the degree's
    error."""
    from bem.exact import kalker

    ratio, poisson, degree = 2.0, 0.3, 10
    a, b = np.sqrt(ratio), 1 / np.sqrt(ratio)
    system = kalker._stick_system(a, b, poisson, degree)
    side, count = np.concatenate([0 * system.x, system.x, np.zeros(system.edge_rows)]), system.basis
    solution = np.linalg.lstsq(system.matrix, side, rcond=None)[0]
    _, first_x, first_y = kalker._moments(a, b, degree)
    moment = first_x @ solution[count : 2 * count] - first_y @ solution[:count]
    assert moment == pytest.approx(creepage_coefficients(ratio, poisson, degree).c23, rel=5e-4)


@pytest.mark.parametrize("ratio, poisson", [(0.06, 0.07), (0.37, 0.29), (1.3, 0.45), (3.1, 0.5), (17.0, 0.0)])
def test_table_equals_fresh_values(ratio, poisson):
    """Interpolation 3e-5; rows of degree 12 against 10: their own error, above."""
    np.testing.assert_allclose(
        as_array(coefficients(ratio, poisson)), as_array(creepage_coefficients(ratio, poisson)), rtol=1.5e-3
    )


@pytest.mark.validate
def test_every_row_of_the_table_is_computed_anew():
    from bem.exact import kalker_table

    fresh = np.array(kalker_table.computed_rows().split(), dtype=float)
    np.testing.assert_allclose(np.loadtxt(kalker_table._ROWS).ravel(), fresh, rtol=2e-6)


def test_table_goes_on_beyond_its_range():
    inside, outside = as_array(coefficients(19.99, 0.3)), as_array(coefficients(20.01, 0.3))
    np.testing.assert_allclose(outside, inside, rtol=2e-3)


def test_linear_forces_have_kalkers_signs_and_scale_with_the_ellipse():
    pair = Pair.of(STEEL, STEEL)
    c = coefficients(1.5, 0.3)
    fx, fy, mz = linear_creep_forces(6e-3, 4e-3, pair, Creepage(1e-4, 2e-4, 0.1), c)
    assert fx == pytest.approx(-pair.shear * 24e-6 * c.c11 * 1e-4)
    assert fy == pytest.approx(-pair.shear * (24e-6 * c.c22 * 2e-4 + 24e-6**1.5 * c.c23 * 0.1))
    assert mz == pytest.approx(pair.shear * (24e-6**1.5 * c.c23 * 2e-4 - 24e-6**2 * c.c33 * 0.1))


@pytest.mark.parametrize(
    "ratio, poisson, words",
    [
        (0.0, 0.3, "axis ratio"),
        (np.nan, 0.3, "axis ratio"),
        (100.0, 0.3, "line contact"),
        (1.0, -0.1, "Poisson"),
        (1.0, 0.6, "Poisson"),
    ],
)
def test_impossible_ellipses_are_refused(ratio, poisson, words):
    for function in (coefficients, creepage_coefficients):
        with pytest.raises(ContactInputError, match=words):
            function(ratio, poisson)
