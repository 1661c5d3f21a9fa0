"""Normal contact of half-spaces against Hertz and other exact solutions, and the invariants of contact."""

import numpy as np
import pytest

from bem.exact.hertz import point_contact
from bem.halfspace.normal import normal_contact
from bem.halfspace.pressure import NormalOperator
from bem.material import STEEL, Elastic, Pair, contact_modulus
from bem.patch import Grid
from tests.order import assert_order

MODULUS = STEEL.plane_modulus / 2


def ellipse_patch(cells: int, radii=(0.46, 0.30), load=1e5, stretch=1.17, **options):
    exact = point_contact(load, *radii, MODULUS)
    grid = Grid.over(
        (-stretch * exact.semi_x, stretch * exact.semi_x),
        (-stretch * exact.semi_y, stretch * exact.semi_y),
        cells,
        cells,
    )
    x, y = grid.points()
    return normal_contact(
        x**2 / (2 * radii[0]) + y**2 / (2 * radii[1]), STEEL, STEEL, load=load, grid=grid, **options
    ), exact


def radii_of_ratio(ratio: float) -> tuple[float, float]:
    """Relative radii whose contact ellipse has a/b = ratio, found by bisection of the closed form."""
    low, high = 1e-5, 1e5
    for _ in range(80):
        middle = np.sqrt(low * high)
        contact = point_contact(1.0, 0.3 * middle, 0.3, MODULUS)
        low, high = (middle, high) if contact.semi_x / contact.semi_y < ratio else (low, middle)
    return 0.3 * middle, 0.3


def test_wheel_on_rail_ellipse_of_the_verification_table():
    """Radii 460 and 300 mm, 100 kN, 210 GPa: a 7.1617, b 5.3872 mm, p0 1237.56 MPa; 0.1 % at 44 cells, area 0.2 %."""
    patch, _ = ellipse_patch(44)
    assert patch.max_pressure == pytest.approx(1237.56e6, rel=1e-3)
    assert patch.contact_area == pytest.approx(np.pi * 7.1617e-3 * 5.3872e-3, rel=2e-3)
    cell = patch.grid.dx / 7.1617e-3
    assert patch.extent[0] / 2 == pytest.approx(7.1617e-3, rel=0.3 * cell)
    assert patch.extent[1] / 2 == pytest.approx(5.3872e-3, rel=0.3 * cell)


@pytest.mark.parametrize("ratio", [0.2, 0.5, 1.0, 2.0, 5.0])
def test_hertz_ellipses(ratio):
    """At 44 cells: pressure and approach 0.1 %, area 0.5 %: (1/40 of the axis)^2 and ^1.5."""
    patch, exact = ellipse_patch(44, radii_of_ratio(ratio))
    assert exact.semi_x / exact.semi_y == pytest.approx(ratio, rel=1e-9)
    assert patch.max_pressure == pytest.approx(exact.max_pressure, rel=1.2e-3)
    assert patch.approach == pytest.approx(exact.approach, rel=5e-4)
    assert patch.contact_area == pytest.approx(exact.area, rel=5e-3)


def test_largest_pressure_and_approach_converge_in_second_order_and_the_field_in_first():
    sizes, peak, approach, field = [], [], [], []
    for cells in (24, 48, 96, 192):
        patch, exact = ellipse_patch(cells, estimate=False)
        expected = exact.pressure(*patch.grid.points())
        sizes.append(1 / cells)
        peak.append(patch.max_pressure / exact.max_pressure - 1)
        approach.append(patch.approach / exact.approach - 1)
        field.append(np.linalg.norm(patch.pressure - expected) / np.linalg.norm(expected))
    assert_order(sizes, peak, expected=2, slack=0.4)
    assert_order(sizes, approach, expected=2, slack=0.5)
    assert_order(sizes, field, expected=1, slack=0.25)


def test_error_estimate_is_above_the_true_error_and_not_absurd():
    for cells in (24, 48, 96):
        patch, exact = ellipse_patch(cells)
        true = abs(patch.max_pressure / exact.max_pressure - 1)
        assert true <= patch.error.max_pressure <= 20 * true


def test_load_and_approach_are_two_ways_to_the_same_patch():
    by_load, _ = ellipse_patch(44)
    by_approach = normal_contact(by_load.gap, STEEL, STEEL, approach=by_load.approach, grid=by_load.grid)
    np.testing.assert_allclose(by_approach.pressure, by_load.pressure, atol=1e-4 * by_load.max_pressure)
    assert by_approach.normal_force == pytest.approx(1e5, rel=2e-5)


def test_load_is_met_to_round_off():
    patch, _ = ellipse_patch(44)
    assert patch.normal_force == pytest.approx(1e5, rel=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_pressure_and_gap_complement_each_other(seed):
    """Rough random gaps: p >= 0; e = 0 where p > 0; e >= 0 elsewhere; to the solver's 1e-6 of the approach (rms)."""
    rng = np.random.default_rng(seed)
    cells = 61
    grid = Grid.over((-8e-3, 8e-3), (-8e-3, 8e-3), cells, cells)
    x, y = grid.points()
    waves = sum(
        rng.standard_normal() / k * np.cos(2 * np.pi * k * (x * np.cos(a) + y * np.sin(a)) / 16e-3 + rng.uniform(0, 6))
        for k in range(1, 12)
        for a in [rng.uniform(0, np.pi)]
    )
    patch = normal_contact(x**2 / 0.9 + y**2 / 0.6 + 5e-6 * waves, STEEL, STEEL, load=5e4, grid=grid, cut=True)
    opening = NormalOperator(grid, Pair.of(STEEL, STEEL)).displacement(patch.pressure) + patch.gap - patch.approach
    scale = patch.approach - patch.gap.min()
    assert patch.warnings == () and patch.pressure.min() == 0.0
    assert np.sqrt((opening[patch.contact] ** 2).mean()) < 2e-6 * scale
    assert opening[~patch.contact].min() > -2e-6 * scale


def test_flat_round_punch():
    """Boussinesq: approach = P / (2 a E*), p = P / (2 pi a^2) / sqrt(1 - (r/a)^2); the body ends at r = a (gap +inf).
    The staircase of cells makes the effective radius uncertain by a fraction of a cell: 1/80."""
    cells, radius, load = 80, 5e-3, 1e4
    grid = Grid.over((-radius, radius), (-radius, radius), cells, cells)
    x, y = grid.points()
    distance = np.hypot(x, y)
    patch = normal_contact(np.where(distance < radius, 0.0, np.inf), STEEL, STEEL, load=load, grid=grid, cut=True)
    assert patch.approach == pytest.approx(load / (2 * radius * MODULUS), rel=1 / 80)
    inner = distance < 0.7 * radius
    expected = load / (2 * np.pi * radius**2) / np.sqrt(1 - (distance[inner] / radius) ** 2)
    np.testing.assert_allclose(patch.pressure[inner], expected, rtol=2 / 80)


def test_unlike_materials_have_hertz_pressure_of_their_contact_modulus():
    aluminium = Elastic(70e9, 0.33)
    exact = point_contact(2e4, 0.3, 0.3, contact_modulus(STEEL, aluminium))
    patch = normal_contact(
        lambda x, y: (x**2 + y**2) / 0.6, STEEL, aluminium, load=2e4, window=((-0.02, 0.02), (-0.02, 0.02))
    )
    assert patch.max_pressure == pytest.approx(exact.max_pressure, rel=1e-3)


def test_two_equal_patches_share_the_load_and_distant_ones_are_hertz():
    """Two spheres 60 mm apart on one body: each carries half; neighbours add P/(pi E* d) of approach and ~ (a/d)^2 of
    pressure."""
    half, radius, away = 2e3, 0.05, 30e-3
    exact = point_contact(half, radius, radius, MODULUS)
    grid = Grid.over((-1.2 * exact.semi_x, 1.2 * exact.semi_x), (-away - 1.5e-3, away + 1.5e-3), 24, 630)
    x, y = grid.points()
    patch = normal_contact(
        (x**2 + (np.abs(y) - away) ** 2) / (2 * radius), STEEL, STEEL, load=2 * half, grid=grid, estimate=False
    )
    first, second = patch.parts()
    assert first.normal_force == pytest.approx(half, rel=1e-6) and second.normal_force == pytest.approx(half, rel=1e-6)
    assert sorted([first.centre[1], second.centre[1]]) == pytest.approx([-away, away], rel=1e-3)
    assert [first.centre[0], second.centre[0]] == pytest.approx([0.0, 0.0], abs=1e-6)
    assert patch.approach == pytest.approx(exact.approach + half / (np.pi * MODULUS * 2 * away), rel=2e-3)
    assert first.max_pressure == pytest.approx(exact.max_pressure, rel=5e-3)


@pytest.mark.parametrize("load", [1e-6, 1.0, 1e5, 1e9])
def test_placed_grid_gives_the_same_relative_error_at_any_load(load):
    """From a patch of micrometres in a window of 10 cm to one of 0.2 m: the cells follow the patch."""
    exact = point_contact(load, 0.46, 0.30, MODULUS)
    side = 5.0 if load > 1e8 else 0.05
    patch = normal_contact(
        lambda x, y: (x - 1e-3) ** 2 / 0.92 + (y + 2e-3) ** 2 / 0.6,
        STEEL,
        STEEL,
        load=load,
        window=((-side, side), (-side, side)),
        cells=44,
    )
    assert patch.max_pressure == pytest.approx(exact.max_pressure, rel=1e-3)
    assert 36 <= np.count_nonzero(patch.contact.any(axis=1)) <= 43
    assert patch.centre_of_pressure == pytest.approx((1e-3, -2e-3), abs=0.02 * exact.semi_x)


def test_grid_is_refined_until_the_asked_accuracy():
    exact = point_contact(1e5, 0.46, 0.30, MODULUS)
    gap, window = (lambda x, y: x**2 / 0.92 + y**2 / 0.6), ((-0.05, 0.05), (-0.05, 0.05))
    patch = normal_contact(gap, STEEL, STEEL, load=1e5, window=window, cells=22, accuracy=1e-4)
    assert patch.error.max_pressure <= 1e-4 and patch.grid.nx > 22
    assert patch.max_pressure == pytest.approx(exact.max_pressure, rel=1e-4)


def test_force_and_moments_belong_to_the_centre_of_pressure():
    patch = normal_contact(
        lambda x, y: (x - 2e-3) ** 2 / 0.9 + (y + 3e-3) ** 2 / 0.6,
        STEEL,
        STEEL,
        load=1e4,
        window=((-0.02, 0.02), (-0.02, 0.02)),
    )
    x, y = patch.centre_of_pressure
    assert patch.moment[0] == pytest.approx(y * 1e4, rel=1e-12) and patch.moment[1] == pytest.approx(
        -x * 1e4, rel=1e-12
    )
    assert np.isnan(patch.moment[2]) and np.isnan(patch.tangential_force).all() and patch.traction is None
