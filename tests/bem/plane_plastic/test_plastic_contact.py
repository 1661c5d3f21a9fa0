"""Two blocks in contact of which one yields: line contact's first yield, balance, Newton through contact, unloading."""

import numpy as np
import pytest

from bem.material import STEEL
from bem.plane.boundary import EquilibriumError
from bem.plane.contact import Settings
from bem.plane.coulomb import Control
from bem.plane.internal import field_at, grid_below
from bem.plane.mesh import Sizing, mesh_outline
from bem.plane_plastic.cells import CellError, cells_below
from bem.plane_plastic.yielding_contact import PlasticContact, Region
from bem.steel.hardening import Hardening
from bem.verification.cases import non_conformal
from bem.verification.exact_problems import two_discs

YIELD = 1e9  # the blocks' elastic peak under LOAD is 2.1 of it, first yield 1.79 of it
LOAD = 10e6


WHOLE = Region(6e-3, 9e-3, 0.75e-3)


def press(load: float, friction=0.0, hardening=Hardening.linear(YIELD), yields="fixed", region=WHOLE):
    fixed, moving = non_conformal()
    greatest = Control.of(force=(None, -load))
    settings = Settings(size=0.375e-3, coarse=0.15)
    return PlasticContact(fixed, moving, greatest, hardening, region, friction, settings, yields)


def down(load: float) -> Control:
    return Control.of(force=(None, -load))


def von_mises(stress: np.ndarray) -> np.ndarray:
    xx, yy, zz, xy = stress.T
    return np.sqrt(((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2 + 3 * xy**2)


@pytest.fixture(scope="module")
def loaded():
    contact = press(LOAD)
    for share in (0.5, 1.0):
        contact.go_to(down(share * LOAD))
    return contact


def test_it_yields_where_and_when_the_elastic_field_first_says_so():
    """Largest von Mises stress of the elastic field on a fine grid; the pressure goes with the root of the load, cells
    take means, so that a fifth more load surely flows; half a cell in depth."""
    contact = press(LOAD)
    fixed = contact.body.body
    grid = grid_below(fixed.outline, "face", np.zeros(2), 3e-3, 5e-3, 0.25e-3)[2:]
    field = field_at(contact.elastic.solution("fixed"), grid)
    first = LOAD * (YIELD / np.nanmax(field.von_mises)) ** 2
    assert contact.go_to(down(0.95 * first)).step.peeq.max() == 0
    assert contact.go_to(down(1.2 * first)).step.peeq.max() > 0
    width = contact.elastic.patches()[0].width / 2 * np.sqrt(1.2 * first / LOAD)
    depth = -contact.section.cells.centers[np.argmax(contact.steps[-1].step.peeq), 1]
    assert depth == pytest.approx(0.7 * width, abs=0.75e-3)


def test_pressure_carries_the_load_and_spreads_when_the_block_yields(loaded):
    state, elastic = loaded.steps[-1].contact, loaded.elastic.last
    force = loaded.elastic.system.forces @ np.r_[state.pressure, state.shear]
    assert force[1] == pytest.approx(LOAD, rel=1e-9)
    assert state.pressure.max() < 0.99 * elastic.pressure.max()
    assert (state.pressure > 0).sum() >= (elastic.pressure > 0).sum()
    stress = von_mises(loaded.steps[-1].stress)
    assert stress.max() < YIELD * (1 + 1e-6)


def test_vertical_stress_below_the_patch_carries_the_load(loaded):
    """The first row of cells is wider than the patch and shallow: what it carries is the load, plastic strain and
    all."""
    cells, stress = loaded.section.cells, loaded.steps[-1].stress
    row = np.abs(cells.centers[:, 1] - cells.centers[:, 1].max()) < 0.1e-3
    assert -(stress[row, 1] * cells.areas[row]).sum() / 0.75e-3 == pytest.approx(LOAD, rel=0.02)


def test_newton_through_the_contact_is_quadratic():
    contact = press(LOAD, hardening=Hardening.linear(YIELD, 20e9))
    contact.section.grow(np.ones(contact.section.cells.count, bool))
    found = contact.go_to(down(LOAD), 1e-10).step.residuals
    last = [r for r in found if r < 1e-2]
    assert len(last) > 1 and all(b < 100 * a**2 + 1e-11 for a, b in zip(last, last[1:])), found


def test_unloading_leaves_a_dent_and_stress_in_balance(loaded):
    """Nothing touches, the face lies lower; vertical stress over the first row sums up to 0.5 % of the load or less; a
    second pressing hardly flows."""
    step = loaded.go_to(down(0.0))
    assert not step.contact.pressure.any()
    assert step.contact.gap[np.argmax(loaded.steps[-2].contact.pressure)] > 0
    cells = loaded.section.cells
    row = np.abs(cells.centers[:, 1] - cells.centers[:, 1].max()) < 0.1e-3
    assert abs((step.stress[row, 1] * cells.areas[row]).sum() / 0.75e-3) < 5e-3 * LOAD
    assert step.stress[:, 0].min() < -0.02 * YIELD
    again = loaded.go_to(down(LOAD))
    assert again.step.peeq.max() < 1.05 * loaded.steps[1].step.peeq.max(), "the second pressing is nearly elastic"


def test_the_moving_body_may_yield_instead_and_friction_is_kept():
    contact = press(LOAD, 0.3, yields="moving")
    for share in (0.4, 0.7, 1.0):
        step = contact.go_to(down(share * LOAD))
    assert step.step.peeq.max() > 0
    state = step.contact
    assert (np.abs(state.shear) <= 0.3 * state.pressure * (1 + 1e-9) + 1e-3).all()


def test_cells_that_end_above_where_steel_yields_say_so(loaded):
    """0.78 half-widths below a line contact; shallower cells, or one alone, stay elastic."""
    assert loaded.steps[0].step.warnings == loaded.steps[1].step.warnings == ()
    for region in (Region(6e-3, 0.6e-3, 0.3e-3), Region(9e-3, 9e-3, 90e-3)):
        step = press(LOAD, region=region).go_to(down(LOAD)).step
        assert not step.peeq.any() and "larger region" in step.warnings[0]


def test_bad_cells_are_refused_in_words():
    with pytest.raises(CellError, match="yields = 'both'"):
        press(LOAD, yields="both")
    contact = press(LOAD)
    with pytest.raises(EquilibriumError, match="what the greatest control gave"):
        contact.go_to(Control.of(motion=(None, -1e-5)))
    with pytest.raises(CellError, match="depth = -0.001"):
        cells_below(contact.body.mesh, "face", np.zeros(2), 5e-3, -1e-3, 1e-4)
    disc = mesh_outline(two_discs(1.0, STEEL, STEEL)[0].outline, Sizing(0.2))
    with pytest.raises(CellError, match="half_width = 9 m reaches all around the face"):
        cells_below(disc, "face", np.zeros(2), 9.0, 1.0, 0.5)
    with pytest.raises(CellError, match="widen it"):
        cells_below(contact.body.mesh, "face", np.zeros(2), 1e-6, 1e-3, 1e-4)
    with pytest.raises(CellError, match="boundary"):
        cells_below(contact.body.mesh, "face", np.zeros(2), 5e-3, 1.0, 1e-2)
    with pytest.raises(CellError, match="more than"):
        cells_below(contact.body.mesh, "face", np.zeros(2), 5e-3, 1.0, 1e-9)
