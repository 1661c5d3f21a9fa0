"""Steady rolling by the full theory: Carter, Kalker's linear theory, symmetry, and hard cases."""

import numpy as np
import pytest

from bem.exact.hertz import line_contact_of_width, point_contact
from bem.exact.kalker_table import coefficients
from bem.exact.tangential import carter_creepage
from bem.halfspace.fastsim import elliptic_patch
from bem.halfspace.normal import normal_contact
from bem.halfspace.tangential import rolling_contact
from bem.material import STEEL, Elastic, Pair
from bem.patch import Creepage, Grid, Patch
from tests.bem.closed_forms import linear_creep_forces
from tests.order import assert_order

LOAD = 1e5


def crooked(cells: int = 32, first: Elastic = STEEL, second: Elastic = STEEL) -> Patch:
    """A patch without symmetry."""
    return normal_contact(
        lambda x, y: x**2 / 0.9 + y**2 / 0.6 + (x - 1e-3) ** 2 * y * 30 + np.maximum(y, 0) ** 3 * 40,
        first,
        second,
        load=LOAD,
        window=((-0.03, 0.03), (-0.03, 0.03)),
        cells=cells,
    )


def test_carter_of_the_verification_table():
    """Line contact R 500 mm, G 82 GPa, nu 0.28, half-width 1 mm, mu 0.3: creepage -2.4e-4 sticks over 0.6 a with
    Fx / (mu F) = 0.64, 2 % at 50 cells. One row of cells, 1 m wide: plane strain to (a / 1 m)^2."""
    steel = Elastic.from_shear(82e9, 0.28)
    exact = line_contact_of_width(1e-3, 0.5, steel.plane_modulus / 2)
    assert exact.force == pytest.approx(178.896e3, rel=1e-5) and exact.max_pressure == pytest.approx(
        113.889e6, rel=1e-5
    )
    assert carter_creepage(0.64, 1e-3, 0.5, 0.3) == pytest.approx(-2.4e-4, rel=1e-9)
    grid = Grid.over((-1.08e-3, 1.08e-3), (-0.5, 0.5), 50, 1)
    patch = normal_contact(grid.points()[0] ** 2, steel, steel, load=exact.force, grid=grid, cut=True)
    assert patch.max_pressure == pytest.approx(exact.max_pressure, rel=1e-3)
    rolled = rolling_contact(patch, steel, steel, 0.3, Creepage(-2.4e-4))
    assert rolled.tangential_force[0] == pytest.approx(0.64 * 0.3 * exact.force, rel=0.01)
    assert rolled.stick.sum() * grid.dx / 2e-3 == pytest.approx(0.6, abs=grid.dx / 2e-3)
    assert rolled.stick[:, 0][rolled.contact[:, 0]][-1] and not rolled.stick[:, 0][rolled.contact[:, 0]][0]


@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0])
def test_small_creepages_give_kalkers_coefficients_in_first_order(ratio):
    """Two routes that share nothing: cells by FFT and polynomials on the exact ellipse. The cells' area is taken
    out."""
    semi_x, semi_y, pair = 5e-3 * np.sqrt(ratio), 5e-3 / np.sqrt(ratio), Pair.of(STEEL, STEEL)
    exact = coefficients(ratio, pair.poisson)
    cells, errors = (16, 32, 64), {"C11": [], "C22": [], "C23": [], "C32": []}
    for count in cells:
        patch = elliptic_patch(semi_x, semi_y, LOAD, (count, count))
        size = np.sqrt(patch.contact.sum() * patch.grid.cell_area / (np.pi * semi_x * semi_y))
        for creepage, names in (
            (Creepage(1e-6), {"C11": 0}),
            (Creepage(0, 1e-6), {"C22": 1, "C32": 2}),
            (Creepage(0, 0, 1e-4), {"C23": 1}),
        ):
            rolled = rolling_contact(patch, STEEL, STEEL, 1e3, creepage, estimate=False)
            linear = linear_creep_forces(size * semi_x, size * semi_y, pair, creepage, exact)
            found = [*rolled.tangential_force, rolled.moment[2]]
            for name, axis in names.items():
                errors[name].append(found[axis] / linear[axis] - 1)
    for name, error in errors.items():
        assert abs(error[-1]) < 0.015, name
        assert_order(1 / np.array(cells), error, expected=1, slack=0.25)


def test_force_converges_in_first_order_and_the_estimate_covers_the_error():
    """Reference: 160 cells extrapolated in first order; stairs of the edge disturb the order of single pairs."""
    creepage = Creepage(5e-4, 5e-4, 0.3)
    patches = {
        cells: rolling_contact(elliptic_patch(7e-3, 5e-3, LOAD, (cells, cells)), STEEL, STEEL, 0.3, creepage)
        for cells in (20, 40, 80, 160)
    }
    force = {cells: patch.tangential_force for cells, patch in patches.items()}
    limit = 2 * force[160] - force[80]
    for cells in (20, 40, 80):
        true = np.linalg.norm(force[cells] - limit) / np.linalg.norm(limit)
        assert true < 0.7 / cells
        assert true < patches[cells].error.tangential_force


def test_estimate_covers_the_error_of_a_small_creepage():
    """Fx = -G a^2 C11 xi on a circle; among 20 to 68 cells the estimate lies nearest to the error at 52."""
    exact = point_contact(LOAD, 0.3, 0.3, STEEL.plane_modulus / 2)
    side = 1.17 * exact.semi_x
    grid = Grid.over((-side, side), (-side, side), 52, 52)
    patch = normal_contact(np.square(grid.points()).sum(axis=0) / 0.6, STEEL, STEEL, load=LOAD, grid=grid)
    rolled = rolling_contact(patch, STEEL, STEEL, 0.3, Creepage(1e-6))
    linear = -STEEL.shear * exact.semi_x**2 * coefficients(1.0, 0.3).c11 * 1e-6
    assert abs(rolled.tangential_force[0] / linear - 1) < rolled.error.tangential_force


@pytest.mark.parametrize("creepage", [Creepage(1e-3, 5e-4, 0.3), Creepage(0, 0, 1.0)])
def test_rolling_is_odd_in_the_creepages(creepage):
    patch = crooked()
    forward = rolling_contact(patch, STEEL, STEEL, 0.3, creepage, estimate=False)
    opposite = Creepage(-creepage.longitudinal, -creepage.lateral, -creepage.spin)
    backward = rolling_contact(patch, STEEL, STEEL, 0.3, opposite, estimate=False)
    np.testing.assert_allclose(backward.traction, -forward.traction, atol=1e-9 * 0.3 * patch.max_pressure)


def test_the_other_direction_is_the_mirror():
    """Rolling towards -x over the mirrored patch with mirrored creepages is the mirror image."""
    patch = crooked()
    mirror = Patch(
        Grid(-patch.grid.x[-1], patch.grid.y_first, patch.grid.dx, patch.grid.dy, *patch.grid.shape),
        patch.gap[::-1],
        patch.pressure[::-1],
        patch.approach,
        patch.method,
    )
    forward = rolling_contact(patch, STEEL, STEEL, 0.3, Creepage(1e-3, 5e-4, 0.3), estimate=False)
    backward = rolling_contact(mirror, STEEL, STEEL, 0.3, Creepage(-1e-3, 5e-4, -0.3), direction=-1, estimate=False)
    np.testing.assert_allclose(
        backward.traction[::-1], forward.traction * [-1, 1], atol=1e-9 * 0.3 * patch.max_pressure
    )
    same_way = rolling_contact(patch, STEEL, STEEL, 0.3, Creepage(1e-3, 5e-4, 0.3), direction=-1, estimate=False)
    assert abs(same_way.tangential_force[1] - forward.tangential_force[1]) > 0.01 * 0.3 * LOAD


def test_given_forces_come_back_from_the_creepages_found():
    patch = crooked()
    by_force = rolling_contact(patch, STEEL, STEEL, 0.3, Creepage(spin=0.1), force=(1e4, -5e3), estimate=False)
    assert by_force.tangential_force == pytest.approx([1e4, -5e3], rel=1e-4)
    again = rolling_contact(patch, STEEL, STEEL, 0.3, by_force.creepage, estimate=False)
    assert again.tangential_force == pytest.approx([1e4, -5e3], rel=1e-3)


@pytest.mark.parametrize("friction", [1e-4, 0.3, 10.0])
@pytest.mark.parametrize(
    "creepage", [Creepage(), Creepage(1e-8), Creepage(2e-3, -1e-3), Creepage(spin=2.0), Creepage(1e-3, 1e-3, -1.0)]
)
def test_coulombs_law_holds_in_hard_cases(friction, creepage):
    """No friction limit or creepage makes the solver fail: the bound holds in every cell, friction never feeds the
    motion."""
    patch = crooked(24)
    rolled = rolling_contact(patch, STEEL, STEEL, friction, creepage, estimate=False)
    assert not any("not converged" in note for note in rolled.warnings)
    size = np.linalg.norm(rolled.traction, axis=-1)
    assert (size <= friction * rolled.pressure * (1 + 1e-12)).all() and np.isfinite(rolled.slip).all()
    assert rolled.frictional_power >= -1e-4 * friction * LOAD * (
        abs(creepage.longitudinal) + abs(creepage.lateral) + abs(creepage.spin) * 5e-3
    )
    if creepage == Creepage():
        assert not rolled.traction.any() and rolled.stick[rolled.contact].all()
    elif friction == 1e-4 and creepage == Creepage(2e-3, -1e-3):
        assert np.linalg.norm(rolled.tangential_force) == pytest.approx(friction * LOAD, rel=1e-3)


def test_energy_lost_to_friction_is_what_the_creep_forces_put_in():
    """Steady state: rigid slip times tractions = slip times tractions, as elastic work returns; the difference, of the
    upwinded elastic slip, is of first order."""
    differences, cells = [], (24, 48, 96)
    for count in cells:
        rolled = rolling_contact(
            elliptic_patch(7e-3, 5e-3, LOAD, (count, count)), STEEL, STEEL, 0.3, Creepage(1e-3, 5e-4), estimate=False
        )
        given = -rolled.tangential_force @ [1e-3, 5e-4]
        differences.append(1 - rolled.frictional_power / given)
    assert 0 < differences[-1] < 0.1
    assert_order(1 / np.array(cells), differences, expected=1, slack=0.3)


def test_unlike_materials_press_sideways_and_the_turns_converge():
    """Free rolling of unlike bodies: tractions without any creepage; like bodies of the same E* have none. The sides'
    exchange changes the sign of the coupling: tractions are reversed, the pressure is the same."""
    soft = Elastic(70e9, 0.33)
    patch = crooked(24, STEEL, soft)
    rolled = rolling_contact(patch, STEEL, soft, 0.3, Creepage(), estimate=False)
    swapped = rolling_contact(patch, soft, STEEL, 0.3, Creepage(), estimate=False)
    assert rolled.warnings == () and rolled.normal_force == pytest.approx(LOAD, rel=1e-9)
    assert np.abs(rolled.traction).max() > 0.05 * 0.3 * patch.max_pressure
    np.testing.assert_allclose(swapped.traction, -rolled.traction, atol=2e-3 * 0.3 * patch.max_pressure)
    np.testing.assert_allclose(swapped.pressure, rolled.pressure, atol=1e-3 * patch.max_pressure)


def test_friction_raises_the_pressure_of_unlike_materials_as_the_turned_normal_problem_says():
    """After the turns the normal problem holds with the opening by tractions in it: complementarity to 1e-4 of the
    approach."""
    from bem.halfspace.pressure import NormalOperator
    from bem.halfspace.tangential import CouplingOperator

    soft = Elastic(70e9, 0.33)
    patch = crooked(24, STEEL, soft)
    rolled = rolling_contact(patch, STEEL, soft, 0.3, Creepage(1e-3), estimate=False)
    pair = Pair.of(STEEL, soft)
    opening = (
        NormalOperator(patch.grid, pair).displacement(rolled.pressure)
        + patch.gap
        - rolled.approach
        + CouplingOperator(patch.grid, pair).normal_displacement(np.moveaxis(rolled.traction, -1, 0))
    )
    assert np.abs(opening[rolled.contact]).max() < 1e-4 * (rolled.approach - patch.gap.min())
    assert np.abs(rolled.pressure - patch.pressure).max() > 1e-3 * patch.max_pressure


def test_hertz_ellipse_is_kept_by_rolling_of_like_materials():
    exact = point_contact(LOAD, 0.46, 0.3, STEEL.plane_modulus / 2)
    patch = normal_contact(
        lambda x, y: x**2 / 0.92 + y**2 / 0.6, STEEL, STEEL, load=LOAD, window=((-0.02, 0.02), (-0.02, 0.02))
    )
    rolled = rolling_contact(patch, STEEL, STEEL, 0.3, Creepage(1e-3))
    assert rolled.pressure is patch.pressure or (rolled.pressure == patch.pressure).all()
    assert rolled.max_pressure == pytest.approx(exact.max_pressure, rel=1e-3)


def test_tractions_of_unlike_materials_keep_within_the_pressure_they_come_with():
    """Normal and tangential problem turn about; the pressure returned is the one that bounded the tractions."""
    soft = Elastic(70e9, 0.25)
    rolled = rolling_contact(crooked(24, STEEL, soft), STEEL, soft, 0.4, Creepage(2e-3, 1e-3, 0.5), estimate=False)
    size = np.linalg.norm(rolled.traction, axis=-1)
    assert (size <= 0.4 * rolled.pressure * (1 + 1e-12)).all() and rolled.normal_force == pytest.approx(LOAD, rel=1e-6)
