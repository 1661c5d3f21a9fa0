"""A sphere pressed into an elastic-plastic half-space."""

import numpy as np
import pytest

from bem.halfspace.normal import normal_contact
from bem.material import Elastic, contact_modulus
from bem.patch import ContactInputError, Grid
from bem.plastic.body import PlasticBody
from bem.plastic.contact import MOST_PRESSURE, PlasticHalfSpace, pressure_warnings
from bem.plastic.increment import NoEquilibriumError, damped_newton
from bem.plastic.surface import LoadStress
from bem.steel.hardening import Hardening

STEEL, RIGID = Elastic(210e9, 0.3), Elastic(1e17, 0.3)
RADIUS, YIELD = 0.1, 310e6
MODULUS = contact_modulus(RIGID, STEEL)
FIRST = np.pi**3 * RADIUS**2 * (1.6 * YIELD) ** 3 / (6 * MODULUS**2)  # load of p0 = 1.6 Y; Johnson (1985), eq. 6.9


def sphere(load, cells_per_radius=8, width=1.7, depth=1.8, hardening=Hardening.linear(YIELD, 2e9)):
    radius = (0.75 * load * RADIUS / MODULUS) ** (1 / 3)
    n = 2 * int(np.ceil(width * cells_per_radius))
    half = n / 2 * radius / cells_per_radius
    grid = Grid.over((-half, half), (-half, half), n, n)
    x, y = grid.points()
    body = PlasticHalfSpace(grid, grid.dx, int(depth * cells_per_radius), RIGID, STEEL, hardening)
    return body, (x**2 + y**2) / (2 * RADIUS)


def test_below_first_yield_it_is_the_elastic_contact():
    body, gap = sphere(0.9 * FIRST)
    found = body.press(gap, 0.9 * FIRST)
    elastic = normal_contact(gap, RIGID, STEEL, load=0.9 * FIRST, grid=body.grid, estimate=False)
    assert found.state.peeq.max() == 0
    assert np.allclose(found.patch.pressure, elastic.pressure, rtol=1e-12, atol=1e-9 * YIELD)


def test_bumps_that_the_cells_do_not_resolve_are_said():
    """Waves of 0.9 and 1.5 Hertz radii, 5.4 cells the shorter: between steels the largest pressure is 5 % too large
    (3.085 Y by 6 cells a radius, 3.015 by 9, 2.958 by 12), a sphere's by 6 cells 0.4 %."""
    radius = (7.5 * FIRST * RADIUS / MODULUS) ** (1 / 3)
    for bumps in (0.0, 0.05):
        body, gap = sphere(10 * FIRST, 6, 1.7, 2.6, Hardening.linear(YIELD, 4e9))
        x, y = (2 * np.pi * axis / radius for axis in body.grid.points())
        rough = gap + bumps * radius**2 / RADIUS * (np.cos(x / 0.9 + 0.3) * np.cos(y / 1.5 + 0.4) + 1)
        said = body.press(rough, 10 * FIRST).warnings
        assert any("above the mean of the four cells beside it" in words for words in said) == (bumps > 0)


def test_yield_begins_at_a_pressure_of_1_60_yield_stresses():
    """nu = 0.3, at the depth 0.48 a; the layer nearest to it is off by a quarter of a cell at most."""
    for share, yields in ((0.97, False), (1.03, True)):
        body, gap = sphere(share**3 * FIRST, 12, 1.3, 1.2)
        peeq = body.press(gap, share**3 * FIRST).state.peeq
        assert (peeq.max() > 0) == yields
    k = np.unravel_index(peeq.argmax(), peeq.shape)[0]
    radius = (0.75 * 1.03**3 * FIRST * RADIUS / MODULUS) ** (1 / 3)
    assert body.depths[k] == pytest.approx(0.48 * radius, abs=1.01 * body.thickness)


@pytest.mark.parametrize("hardening", [Hardening.linear(YIELD), Hardening.linear(YIELD, 1e10, kinematic=True)])
def test_unloading_leaves_stress_in_balance(hardening):
    """Resultant of the residual normal stress over a plane through the middle is nothing beside its parts, von Mises
    stays below the yield stress, and reloading to the same load is elastic, as the patch is on the gap that is left."""
    body, gap = sphere(4 * FIRST, 6, 2.0, 2.2, hardening)
    body.press(gap, 2 * FIRST)
    pressed = body.press(gap, 4 * FIRST)
    elastic = normal_contact(pressed.patch.gap, RIGID, STEEL, load=4 * FIRST, grid=body.grid, estimate=False)
    assert np.abs(elastic.pressure - pressed.patch.pressure).max() < 1e-2 * YIELD  # the surface to 1e-4 of the approach
    left = body.press(gap, 1e-3 * FIRST)
    again = body.press(gap, 4 * FIRST)
    change = again.state.peeq - left.state.peeq
    assert pressed.surface.max() > 0 and pressed.surface[0].max() < 0.1 * pressed.surface.max()
    assert change.max() < 0.02 * pressed.state.peeq.max()
    assert again.patch.contact_area == pytest.approx(pressed.patch.contact_area, rel=0.03)


def test_cells_too_coarse_for_the_flow_at_the_edge_are_said():
    """Perfectly plastic, two cells over the radius of Hertz: edge cells carry more than the steel would; at four times
    first yield none does."""
    assert pressure_warnings(MOST_PRESSURE) == () and "3.40 times" in pressure_warnings(3.4)[0]
    body, gap = sphere(90 * FIRST, 2, 4.5, 6.5, Hardening.linear(YIELD))
    said = []
    for load in (4, 10, 20, 40, 90):
        found = body.press(gap, load * FIRST, 1e-3)
        said.append(any("too early" in words for words in found.warnings))
        assert said[-1] == (found.patch.max_pressure > MOST_PRESSURE * YIELD and found.state.peeq.max() > 0)
    assert not said[0] and said[-1]


def test_a_zone_that_reaches_the_edge_is_named():
    body, gap = sphere(8 * FIRST, 6, 1.7, 0.8)
    with pytest.raises(ContactInputError, match="deepest layer"):
        body.press(gap, 8 * FIRST)


def test_pressure_beyond_the_limit_load_is_said_and_does_not_hang():
    """A strip of uniform pressure 8 k, more than Prandtl's 5.14 k, on a perfectly plastic plane: no equilibrium."""
    grid = Grid.over((-6.0, 6.0), (-500.0, 500.0), 24, 1)
    body = PlasticBody(grid, 0.5, 12, STEEL, Hardening.linear(YIELD))
    pressure = 8 * YIELD / np.sqrt(3) * (np.abs(grid.x) < 1.5)
    deviator, _ = LoadStress(grid, body.depths, 0.3)((pressure[:, None],))
    with pytest.raises((NoEquilibriumError, ContactInputError), match="equilibrium|plastic zone reaches"):
        for share in np.linspace(0.3, 1, 8):
            body.look(share * deviator)
            body.accept(body.attempt(share * deviator, None))


def test_nearly_incompressible_and_perfectly_plastic_is_solved_with_a_warning():
    rubber = Elastic(210e9, 0.4999)
    grid = Grid.over((-1.2e-3, 1.2e-3), (-1.2e-3, 1.2e-3), 20, 20)
    x, y = grid.points()
    contact = PlasticHalfSpace(grid, grid.dx, 14, RIGID, rubber, Hardening.linear(YIELD))
    found = contact.press((x**2 + y**2) / (2 * RADIUS), 3 * FIRST)
    assert found.state.peeq.max() > 1e-5 and np.isfinite(found.stress).all()
    assert any("0.4999" in words for words in found.warnings)


def test_sliding_brings_the_flow_towards_the_surface():
    strains = []
    for share in (0.0, 0.4):
        body, gap = sphere(2 * FIRST, 6, 2.2, 2.0)
        contact = PlasticHalfSpace(
            body.grid, body.thickness, body.body.layers, RIGID, STEEL, body.body.hardening, (share, 0.0)
        )
        peeq = contact.press(gap, 2 * FIRST).state.peeq
        strains.append(peeq[0].max() / peeq.max())
    assert strains[0] < 0.5 < strains[1]


def test_a_million_cells_say_their_memory_before_anything_is_allocated():
    grid = Grid.over((-0.1, 0.1), (-0.1, 0.1), 400, 400)
    with pytest.raises(ContactInputError, match="400 x 400 x 60 cells need .* GB"):
        PlasticHalfSpace(grid, 1e-3, 60, RIGID, STEEL, Hardening.linear(YIELD))


@pytest.mark.parametrize("load", [-1.0, np.nan, np.inf])
def test_impossible_loads_are_refused(load):
    body, gap = sphere(FIRST, 6)
    with pytest.raises(ContactInputError, match="load"):
        body.press(gap, load)


@pytest.mark.parametrize("tolerance", [0.0, -1e-3, np.nan, 10.0])
def test_tolerances_that_are_no_part_of_the_approach_are_refused(tolerance):
    body, gap = sphere(2 * FIRST, 4)
    with pytest.raises(ContactInputError, match="between 0 and 1"):
        body.press(gap, 2 * FIRST, tolerance)


def test_layers_that_end_above_what_yields_are_named():
    """Yield begins at half a contact radius; layers down to a quarter of it would answer elastic without a word."""
    body, gap = sphere(2 * FIRST, 8, 1.7, 0.25)
    found = body.press(gap, 2 * FIRST)
    assert found.state.peeq.max() == 0 and "largest in the deepest of 2 layers" in "; ".join(found.warnings)
    thick = PlasticHalfSpace(body.grid, 0.5, 8, RIGID, STEEL, body.body.hardening)  # millimetres for metres
    assert "largest in the first of 8 layers, 250 mm down" in "; ".join(thick.press(gap, 2 * FIRST).warnings)
    body, gap = sphere(2 * FIRST)
    found = body.press(gap, 2 * FIRST)
    assert found.state.peeq.max() > 0 and not found.warnings


@pytest.mark.parametrize("layers", [1, 2.5, np.nan])
def test_layers_that_are_none_are_refused(layers):
    grid = Grid.over((-1e-3, 1e-3), (-1e-3, 1e-3), 8, 8)
    with pytest.raises(ContactInputError, match="at least two whole ones"):
        PlasticHalfSpace(grid, grid.dx, layers, RIGID, STEEL, Hardening.linear(YIELD))


def test_each_newton_step_begins_where_the_last_one_was_looked_at():
    """An error that no step lessens: what the next step is made of belongs to the place that it begins from."""
    begun = []

    def change(at, found):
        begun.append(at[0])
        assert found[0] == at[0]
        return (1.0,)

    with pytest.raises(NoEquilibriumError):
        damped_newton(lambda x: (x, 1.0 + x), change, (0.0,), 1e-9, 3)
    assert begun == [0.0, 0.5**5, 2 * 0.5**5]
