"""Shift under load: Cattaneo and Mindlin, Spence, the path that friction remembers, and Coulomb's law itself."""

import numpy as np
import pytest

from bem.halfspace.normal import normal_contact
from bem.halfspace.tangential import rolling_contact, shift_contact
from bem.material import STEEL, Elastic
from bem.patch import Creepage, Grid, Patch
from tests.bem.closed_forms import cattaneo_sphere
from tests.order import assert_order

RUBBER = Elastic.from_shear(200e6, 0.42)
RADIUS, CONTACT_RADIUS, FRICTION = 50e-3, 1e-3, 0.4
LOAD = 4 / 3 * RUBBER.plane_modulus / 2 * CONTACT_RADIUS**3 / RADIUS


def sphere(cells: int, first: Elastic = RUBBER, second: Elastic = RUBBER, load: float = LOAD) -> Patch:
    grid = Grid.over((-1.13e-3, 1.13e-3), (-1.13e-3, 1.13e-3), cells, cells)
    x, y = grid.points()
    return normal_contact((x**2 + y**2) / (2 * RADIUS), first, second, load=load, grid=grid, estimate=False)


def test_cattaneo_mindlin_of_the_verification_table():
    """P 9.1954 N, p0 4.3905 MPa, stick radius 0.5 mm, shift 8.172e-3 mm (1 %): the closed form neglects the slip
    across, which costs it 0.2 %; stick radius within a cell."""
    patch = sphere(44)
    assert LOAD == pytest.approx(9.1954, rel=1e-5) and patch.max_pressure == pytest.approx(4.3905e6, rel=1e-3)
    shifted = shift_contact(patch, RUBBER, RUBBER, FRICTION, force=(7 / 8 * FRICTION * LOAD, 0.0))
    stick, shift = cattaneo_sphere(7 / 8 * FRICTION * LOAD, FRICTION * LOAD, CONTACT_RADIUS, RUBBER, RUBBER)
    assert shift == pytest.approx(8.172e-6, rel=1e-3) and stick == pytest.approx(0.5e-3, rel=1e-6)
    assert -shifted.creepage.longitudinal == pytest.approx(shift, rel=4e-3)
    assert np.sqrt(shifted.stick_area / np.pi) == pytest.approx(stick, abs=patch.grid.dx)
    assert shifted.tangential_force == pytest.approx([7 / 8 * FRICTION * LOAD, 0.0], abs=1e-5 * FRICTION * LOAD)
    assert shifted.error.tangential_force < 5e-3


def test_shift_without_slip_has_mindlins_stiffness_with_first_order_error():
    """Friction so large that all sticks: force = 4 a G shift / (2 - nu) for two like bodies (Johnson, eq. 7.43 at small
    Q). The cells' area error enters through the radius: the one that the cells have is taken."""
    errors, cells = [], (20, 40, 80)
    for count in cells:
        grid = Grid.over((-CONTACT_RADIUS, CONTACT_RADIUS), (-CONTACT_RADIUS, CONTACT_RADIUS), count, count)
        x, y = grid.points()
        inside = x**2 + y**2 < CONTACT_RADIUS**2
        patch = Patch(grid, None, inside * 1e6, 0.0, "disc")
        shifted = shift_contact(patch, RUBBER, RUBBER, 1e6, Creepage(-1e-9), estimate=False, tolerance=1e-7)
        radius = np.sqrt(inside.sum() * grid.cell_area / np.pi)
        errors.append(shifted.tangential_force[0] / (4 * radius * RUBBER.shear * 1e-9 / (2 - RUBBER.poisson)) - 1)
    assert abs(errors[-1]) < 0.4 / 80
    assert_order(1 / np.array(cells), errors, expected=1.1, slack=0.4)


def test_unloading_leaves_a_ring_that_remembers():
    """Mindlin and Deresiewicz: back to zero force after Q the shift is not zero: delta = 2 d(Q/2) - d(Q), the other way
    round."""
    patch = sphere(44)
    force = 7 / 8 * FRICTION * LOAD
    loaded = shift_contact(patch, RUBBER, RUBBER, FRICTION, force=(force, 0.0), estimate=False)
    unloaded = shift_contact(patch, RUBBER, RUBBER, FRICTION, force=(0.0, 0.0), previous=loaded, estimate=False)
    shifts = [cattaneo_sphere(q, FRICTION * LOAD, CONTACT_RADIUS, RUBBER, RUBBER)[1] for q in (force, force / 2)]
    remaining = -(loaded.creepage.longitudinal + unloaded.creepage.longitudinal)
    assert remaining == pytest.approx(shifts[0] - 2 * shifts[1], rel=0.02)
    assert np.abs(unloaded.traction[..., 0]).max() > 0.1 * FRICTION * patch.max_pressure


def test_spence_needs_steps_and_then_sticks_to_half_the_radius():
    """nu 0 on rigid, friction 0.2986: stick / contact radius 0.5 (2 %); one step gives a wrong stick area."""
    soft, rigid = Elastic(200e9, 0.0), Elastic(2e20, 0.0)
    load = 4 / 3 * soft.plane_modulus * CONTACT_RADIUS**3 / RADIUS
    ratios = {}
    for steps in (1, 16):
        last = None
        for step in range(1, steps + 1):
            patch = sphere(48, soft, rigid, load * (step / steps) ** 1.5)
            last = shift_contact(patch, soft, rigid, 0.2986, previous=last, estimate=False)
        assert not any("converged" in note or "turns" in note for note in last.warnings)
        ratios[steps] = np.sqrt(last.stick_area / last.contact_area)
    assert ratios[16] == pytest.approx(0.5, rel=0.02)
    assert ratios[1] < 0.3


@pytest.mark.parametrize("friction", [1e-4, 0.3, 10.0])
@pytest.mark.parametrize("shift", [Creepage(2e-6, 1e-6, 0.0), Creepage(0.0, 0.0, 5e-3), Creepage(1e-9, 0.0, 0.0)])
def test_coulombs_law_holds_in_every_cell(friction, shift):
    """|q| <= mu p; no slip where less; slip against the traction elsewhere. Tolerances: 1e-4 of the largest for 1e-6
    solved."""
    patch = sphere(32, STEEL, STEEL, 200.0)
    shifted = shift_contact(patch, STEEL, STEEL, friction, shift, estimate=False, tolerance=1e-7)
    size = np.linalg.norm(shifted.traction, axis=-1)
    bound = friction * shifted.pressure
    slip = np.linalg.norm(shifted.slip, axis=-1)
    scale = np.hypot(abs(shift.longitudinal) + abs(shift.spin) * 1e-3, abs(shift.lateral) + abs(shift.spin) * 1e-3)
    assert (size <= bound * (1 + 1e-12)).all()
    assert slip[shifted.stick].max(initial=0.0) < 1e-4 * scale
    across = np.abs(np.linalg.det(np.stack([shifted.traction, shifted.slip], axis=-2)))[shifted.sliding]
    assert across.max(initial=0.0) < 1e-4 * scale * bound.max()
    assert (np.einsum("ijk,ijk->ij", shifted.traction, shifted.slip) <= 1e-4 * scale * bound.max()).all()
    assert shifted.frictional_power >= -1e-6 * scale * bound.sum() * patch.grid.cell_area


def test_no_motion_and_no_friction_make_no_traction():
    patch = sphere(24)
    still = shift_contact(patch, RUBBER, RUBBER, FRICTION, Creepage())
    assert not still.traction.any() and still.stick[still.contact].all()
    slippery = rolling_contact(patch, RUBBER, RUBBER, 0.0, Creepage(1e-3))
    assert not slippery.traction.any() and not slippery.stick.any()


def test_full_sliding_carries_friction_times_load_against_the_motion():
    patch = sphere(24)
    slid = shift_contact(patch, RUBBER, RUBBER, FRICTION, Creepage(3e-4, -4e-4), estimate=False)
    assert slid.tangential_force == pytest.approx(FRICTION * LOAD * np.array([-0.6, 0.8]), rel=2e-3)
    assert slid.stick_area == 0
