"""What the patch solvers refuse, with a reason that names the position and the size; and what they answer empty."""

import numpy as np
import pytest

from bem.halfspace.fastsim import fastsim
from bem.halfspace.normal import normal_contact
from bem.halfspace.tangential import rolling_contact, shift_contact
from bem.material import STEEL, Elastic
from bem.patch import ContactInputError, Creepage, Grid, NoContactError, PatchCutError

GRID = Grid.over((-0.012, 0.012), (-0.012, 0.012), 24, 24)
X, Y = GRID.points()
GAP = X**2 / 0.9 + Y**2 / 0.6


def solved():
    return normal_contact(GAP, STEEL, STEEL, load=1e5, grid=GRID, estimate=False)


def test_gap_with_nan_is_refused_with_count_and_place():
    gap = GAP.copy()
    gap[3, 5] = gap[7, 7] = np.nan
    with pytest.raises(ContactInputError, match=r"2 of 576 cells NaN.*x = -0.0085 m, y = -0.0065 m"):
        normal_contact(gap, STEEL, STEEL, load=1e3, grid=GRID)


@pytest.mark.parametrize(
    "gap, words",
    [
        (GAP[:5], "shape"),
        (np.full(GRID.shape, np.inf), "no surface"),
        (-np.inf + 0 * GAP, "-inf"),
        (GAP + 0j, "real numbers"),
        (np.full(GRID.shape, "1 mm"), "real numbers"),
        ([[1, 2], [3]], "real numbers"),
    ],
)
def test_other_impossible_gaps_are_refused(gap, words):
    with pytest.raises(ContactInputError, match=words):
        normal_contact(gap, STEEL, STEEL, load=1e3, grid=GRID)


@pytest.mark.parametrize("cells", [0, 2, 2.5, None, (44, -1), (8, 8, 8)])
def test_cells_that_hold_no_patch_are_refused(cells):
    with pytest.raises(ContactInputError, match="cells = "):
        normal_contact(
            lambda x, y: x**2 + y**2, STEEL, STEEL, load=1e4, window=((-0.05, 0.05), (-0.05, 0.05)), cells=cells
        )


@pytest.mark.parametrize("friction", ["dry", None, 0.3j, [0.3], -0.1, np.nan, np.inf])
def test_impossible_friction_is_refused(friction):
    for solve in (rolling_contact, shift_contact):
        with pytest.raises(ContactInputError, match="friction"):
            solve(solved(), STEEL, STEEL, friction, Creepage(1e-6))


@pytest.mark.parametrize(
    "control, words",
    [
        ({"load": -1.0}, "no tension"),
        ({"load": np.nan}, "finite"),
        ({}, "exactly one"),
        ({"load": 1.0, "approach": 1e-6}, "exactly one"),
        ({"approach": np.inf}, "finite"),
        ({"load": "10 kN"}, "finite number"),
        ({"load": [1e3]}, "finite number"),
        ({"load": 1j}, "finite number"),
        ({"approach": "deep"}, "finite number"),
    ],
)
def test_impossible_drives_are_refused(control, words):
    with pytest.raises(ContactInputError, match=words):
        normal_contact(GAP, STEEL, STEEL, grid=GRID, **control)


def test_load_zero_is_an_empty_patch_that_says_why():
    patch = normal_contact(GAP, STEEL, STEEL, load=0.0, grid=GRID)
    assert patch.normal_force == 0 and patch.contact_area == 0 and "load 0" in patch.warnings[0]
    assert np.isnan(patch.centre_of_pressure).all() and np.isnan(patch.extent).all() and patch.parts() == []
    rolled = rolling_contact(patch, STEEL, STEEL, 0.3, Creepage(1e-3))
    assert (rolled.tangential_force == 0).all() and rolled.stick_area == 0


def test_no_contact_at_the_approach_says_how_far_it_is():
    with pytest.raises(NoContactError, match="does not close the least gap"):
        normal_contact(GAP, STEEL, STEEL, approach=1e-9, grid=GRID)
    with pytest.raises(NoContactError, match="x = .* y = "):
        normal_contact(lambda x, y: 1e-3 + x**2 + y**2, STEEL, STEEL, approach=1e-6, window=((-1, 1), (-1, 1)))
    for least in (0.0, 1e-3):  # which is just touched
        with pytest.raises(NoContactError, match="does not close the least gap"):
            normal_contact(lambda x, y: least + x**2 + y**2, STEEL, STEEL, approach=least, window=((-1, 2), (-1, 1)))


def test_grid_that_cuts_the_patch_says_where_and_by_how_much():
    """The patch reaches to x = 7.2 mm; the grid ends at 5 mm: the advice must cover the missing 2.2 mm and not ten
    times that."""
    grid = Grid.over((-0.012, 0.005), (-0.012, 0.012), 34, 48)
    x, y = grid.points()
    with pytest.raises(PatchCutError, match=r"x_max: \d+ cells.*extend by about") as error:
        normal_contact(x**2 / 0.92 + y**2 / 0.6, STEEL, STEEL, load=1e5, grid=grid)
    advice = float(str(error.value).split("extend by about ")[1].split(" m")[0])
    assert 2.2e-3 <= advice <= 22e-3
    assert normal_contact(
        x**2 / 0.92 + y**2 / 0.6, STEEL, STEEL, load=1e5, grid=grid, cut=True
    ).normal_force == pytest.approx(1e5)


def test_window_that_cuts_the_patch_is_refused():
    with pytest.raises(PatchCutError):
        normal_contact(
            lambda x, y: x**2 / 0.92 + y**2 / 0.6, STEEL, STEEL, load=1e5, window=((-0.02, 0.02), (-0.02, 0.003))
        )


@pytest.mark.parametrize(
    "window, words",
    [
        (((1.0, -1.0), (-1.0, 1.0)), "window along x"),
        (((np.nan, 1.0), (-1.0, 1.0)), "window along x"),
        ((-0.02, 0.02, -0.02, 0.02), "x_min, x_max"),
        ((-0.02, 0.02), "x_min, x_max"),
        (0.02, "x_min, x_max"),
    ],
)
def test_impossible_windows_are_refused(window, words):
    with pytest.raises(ContactInputError, match=words):
        normal_contact(lambda x, y: x**2 + y**2, STEEL, STEEL, load=1.0, window=window)


def test_what_is_masked_of_a_gap_is_no_surface_that_is_known():
    with pytest.raises(ContactInputError, match="288 of 576 cells NaN"):
        normal_contact(np.ma.array(GAP, mask=Y > 0), STEEL, STEEL, load=1e3, grid=GRID)


@pytest.mark.parametrize("shape", [(0, 3), (3, -1), (3.0, 3), (2.5, 3), ("3", 3)])
def test_grid_without_cells_is_refused(shape):
    with pytest.raises(ContactInputError, match="at least one"):
        Grid.over((0, 1), (0, 1), *shape)


def test_spin_per_millimetre_and_creepage_in_percent_are_caught():
    """A spin of 0.5/m given as 500, a creepage of 120 % given as 120; a doubtful one is only warned of."""
    with pytest.raises(ContactInputError, match="1/m"):
        rolling_contact(solved(), STEEL, STEEL, 0.3, Creepage(spin=500.0))
    with pytest.raises(ContactInputError, match="percent"):
        rolling_contact(solved(), STEEL, STEEL, 0.3, Creepage(longitudinal=120.0))
    assert "check the units" in rolling_contact(solved(), STEEL, STEEL, 0.3, Creepage(longitudinal=0.5)).warnings[-1]
    assert rolling_contact(solved(), STEEL, STEEL, 0.3, Creepage(spin=3.0)).warnings == ()


def test_other_impossible_tangential_input_is_refused():
    patch = solved()
    with pytest.raises(ContactInputError, match="mu N = 30000 N"):
        rolling_contact(patch, STEEL, STEEL, 0.3, force=(3e4, None))
    with pytest.raises(ContactInputError, match="longer than the patch"):
        shift_contact(patch, STEEL, STEEL, 0.3, Creepage(longitudinal=10.0))
    with pytest.raises(ContactInputError, match="direction"):
        rolling_contact(patch, STEEL, STEEL, 0.3, Creepage(1e-3), direction=0)
    for force in (1e3, (1e3, None, None)):
        with pytest.raises(ContactInputError, match="two along x and y"):
            rolling_contact(patch, STEEL, STEEL, 0.3, force=force)
    for motion in (1e-3, (1e-3, 0.0, 0.0)):
        with pytest.raises(ContactInputError, match="give a Creepage"):
            rolling_contact(patch, STEEL, STEEL, 0.3, motion)
    for tolerance in (0, np.nan, "1e-5"):
        with pytest.raises(ContactInputError, match="tolerance"):
            shift_contact(patch, STEEL, STEEL, 0.3, Creepage(1e-6), tolerance=tolerance)
    with pytest.raises(TypeError, match="an Elastic, not float"):
        rolling_contact(patch, 210e9, STEEL, 0.3)
    with pytest.raises(ContactInputError, match="previous"):
        shift_contact(patch, STEEL, STEEL, 0.3, Creepage(1e-6), previous=patch)
    with pytest.raises(ContactInputError, match="finite"):
        rolling_contact(patch, STEEL, STEEL, 0.3, Creepage(np.nan))


@pytest.mark.parametrize("solve", [rolling_contact, shift_contact, fastsim])
def test_other_bodies_than_those_of_the_pressure_are_refused(solve):
    softer = Elastic(70e9, 0.3)
    rolled = solve(solved(), STEEL, STEEL, 0.3, Creepage(1e-6))
    with pytest.raises(ContactInputError, match=r"E\* = 3.84615e\+10 Pa .* 1.15385e\+11 Pa"):
        solve(rolled, softer, softer, 0.3, Creepage(1e-6))


def test_a_pressure_beyond_small_strains_is_said():
    """10 MN on radii of 50 mm: Hertz' pressure is 0.12 of Young's modulus."""
    x, y = np.meshgrid(np.linspace(-0.03, 0.03, 20), np.linspace(-0.03, 0.03, 20), indexing="ij")
    grid = Grid.over((-0.03 - 0.03 / 19, 0.03 + 0.03 / 19), (-0.03 - 0.03 / 19, 0.03 + 0.03 / 19), 20, 20)
    patch = normal_contact((x**2 + y**2) / 0.1, STEEL, STEEL, load=1e7, grid=grid, estimate=False)
    assert patch.max_pressure > 0.05 * STEEL.young and "small strains" in patch.warnings[-1]


def test_a_pressure_that_rail_steel_does_not_bear_is_said():
    """5.4 GPa, elastic as computed, is far above the limit of any rail steel; at 1.2 GPa nothing is said."""
    notes = {}
    for load in (1e3, 1e5):
        patch = normal_contact(
            lambda x, y: (x**2 + y**2) / 0.08,
            STEEL,
            STEEL,
            load=load,
            window=((-0.02, 0.02), (-0.02, 0.02)),
            cells=24,
            estimate=False,
        )
        notes[round(patch.max_pressure / 1e9, 1)] = patch.warnings
    low, high = sorted(notes)
    assert low < 2.0 < 2.2 < high < 8 and notes[low] == () and "yield" in notes[high][-1]


def test_single_cells_between_gaps_without_surface_are_solved_with_an_estimate_or_none():
    """On doubled cells they vanish: there is no estimate then, and no fault."""
    gap = np.full(GRID.shape, np.inf)
    gap[4:20:4, 4:20:4] = 0.0
    patch = normal_contact(gap, STEEL, STEEL, load=1e3, grid=GRID)
    assert patch.normal_force == pytest.approx(1e3, rel=1e-6) and np.isnan(patch.error.max_pressure)


def test_an_estimate_that_is_not_made_is_said():
    patch = normal_contact(GAP, STEEL, STEEL, load=2e3, grid=GRID)
    assert min(patch.contact.sum(axis=0).max(), patch.contact.sum(axis=1).max()) < 12
    rolled = rolling_contact(patch, STEEL, STEEL, 0.3, Creepage(1e-3))
    assert np.isnan(rolled.error.tangential_force) and "not estimated" in rolled.warnings[-1]


def test_a_force_that_vanishes_has_no_relative_error_and_none_is_left_of_a_roll_before():
    """A turn of the upper body on the spot makes a moment alone."""
    rolled = rolling_contact(solved(), STEEL, STEEL, 0.3, Creepage(1e-3))
    assert rolled.error.tangential_force < 0.2
    again = fastsim(rolled, STEEL, STEEL, 0.3, Creepage(1e-3), estimate=False)
    assert np.isnan(again.error.tangential_force)
    turned = shift_contact(rolled, STEEL, STEEL, 0.3, Creepage(spin=1e-4))
    assert np.isnan(turned.error.tangential_force) and "vanishes" in turned.warnings[-1]
