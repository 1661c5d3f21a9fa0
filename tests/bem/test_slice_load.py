"""Slices under an assumed share of the load against the closed form of each slice, and what the method cannot know."""

import numpy as np
import pytest

from bem.exact.hertz import point_contact
from bem.patch import ContactInputError
from bem.slices.assumed_load import elliptic, hertz_of, loaded_slices, parabolic
from bem.slices.coupled import slice_contact
from bem.slices.slices import SliceGap, Slices
from tests.bem.test_slices import MODULUS, wheel_and_rail

LOAD, LATERAL = 1e5, 1 / (1 / 0.3 + 1e-4)
SLICES = wheel_and_rail(0.3, 0.46, 0.08, 0.12)  # the wheel's face has a radius of 10 km
HERTZ = point_contact(LOAD, 0.46, LATERAL, MODULUS)


def closed_form(line_load):
    """Largest pressure [Pa] and half-width [m] of a plane contact of the lateral radius under a line load [N/m]."""
    return np.sqrt(line_load * MODULUS / (np.pi * LATERAL)), np.sqrt(4 * line_load * LATERAL / (np.pi * MODULUS))


@pytest.mark.parametrize("sharing, law", [("elliptic", elliptic), ("parabolic", parabolic)])
def test_every_slice_of_hertz_ellipse_is_its_own_line_contact(sharing, law):
    """Pressure: n elements over a slice's half-width cost 1 / (2 n^2) of its peak, and its middle lies up to half a
    cell from a row, 1 / (8 n^2); the blocks, 20 half-widths deep, 0.1 % (0.25 / 20^2). Line load: the sum over cells of
    a half-ellipse is good to 0.5 / n^1.5. Width: a cell."""
    patch = loaded_slices(SLICES, load=LOAD, sharing=sharing, cells=(21, 44), estimate=False)
    edges = np.linspace(-HERTZ.semi_x, HERTZ.semi_x, 22)
    line_load = LOAD * np.diff(law(edges, HERTZ.semi_x)) / np.diff(edges)
    pressure, half_width = closed_form(line_load)
    n = half_width / patch.grid.dy
    assert (np.abs(patch.pressure.max(axis=1) / pressure - 1) < 0.625 / n**2 + 2e-3).all()
    assert (np.abs(patch.line_load / line_load - 1) < 0.5 / n**1.5 + 2e-3).all()
    assert patch.normal_force == pytest.approx(LOAD, rel=1e-3)
    assert patch.extent[1] / 2 == pytest.approx(half_width.max(), abs=patch.grid.dy / 2)
    row = patch.pressure[10]
    inside = np.abs(patch.grid.y) < 0.95 * half_width[10]
    exact = pressure[10] * np.sqrt(1 - (patch.grid.y[inside] / half_width[10]) ** 2)
    # an edge known to a quarter of an element shifts the pressure p0 sqrt(2 d / a) most at the outermost row, d = 0.05
    # a
    np.testing.assert_allclose(row[inside], exact, atol=pressure[10] / (4 * n[10] * np.sqrt(0.1)))
    middle = np.abs(patch.grid.y[inside]) < 0.7 * half_width[10]
    np.testing.assert_allclose(row[inside][middle], exact[middle], atol=0.01 * pressure[10])


def test_shares_add_up_and_follow_their_laws():
    x = np.linspace(-1, 1, 2001)
    for law, shape in ((elliptic, np.sqrt(1 - x**2)), (parabolic, 1 - x**2)):
        assert law(x, 1.0)[[0, -1]] == pytest.approx([0, 1], abs=1e-15)
        middle = (shape[1:] + shape[:-1]) / 2 * (x[1] - x[0])
        np.testing.assert_allclose(law(x, 1.0)[1:], np.cumsum(middle) / middle.sum(), atol=1e-4)


def test_the_exact_line_load_does_not_cure_the_missing_coupling():
    """Hertz' own line load is the parabola: the loss of pressure is that of slices which do not feel each other;
    coupled slices have none."""
    loaded = loaded_slices(SLICES, load=LOAD, cells=(21, 40), estimate=False)
    coupled = slice_contact(SLICES, load=LOAD, cells=(21, 40), threads=1, estimate=False)
    line_load = coupled.line_load
    given = loaded_slices(
        SLICES,
        load=LOAD,
        cells=(21, 40),
        estimate=False,
        semi_length=HERTZ.semi_x,
        sharing=lambda x: np.interp(x, coupled.grid.x, line_load),
    )
    expected = closed_form(0.75 * LOAD / HERTZ.semi_x)[0] / HERTZ.max_pressure
    assert expected == pytest.approx(0.915, abs=1e-3)
    assert loaded.max_pressure / HERTZ.max_pressure == pytest.approx(expected, rel=5e-3)
    assert given.max_pressure == pytest.approx(loaded.max_pressure, rel=0.01)
    assert coupled.max_pressure == pytest.approx(HERTZ.max_pressure, rel=5e-3)
    assert np.ptp(loaded.slice_approach) > 0.5 * loaded.slice_approach.max() and np.isnan(loaded.approach)


def test_the_length_is_hertz_and_the_error_estimate_judges_cells_only():
    assert hertz_of(SliceGap(SLICES), LOAD).semi_x == pytest.approx(HERTZ.semi_x, rel=1e-4)
    patch = loaded_slices(SLICES, load=LOAD, sharing="elliptic", cells=(21, 30))
    assert patch.extent[0] == pytest.approx(2 * HERTZ.semi_x, abs=2 * patch.grid.dx)
    assert patch.error.max_pressure < 0.02 and "not judged" in patch.error.note
    assert patch.cost.seconds > 0 and patch.normal_force == pytest.approx(LOAD, rel=1e-3)


def test_bad_input_says_what_is_wrong():
    with pytest.raises(ContactInputError, match="load > 0"):
        loaded_slices(SLICES, load=0.0)
    with pytest.raises(ContactInputError, match="'elliptic', 'parabolic'"):
        loaded_slices(SLICES, load=LOAD, sharing="triangular")
    with pytest.raises(ContactInputError, match="as many finite"):
        loaded_slices(SLICES, load=LOAD, sharing=lambda x: -np.ones_like(x))
    with pytest.raises(ContactInputError, match="half the patch's length"):
        loaded_slices(SLICES, load=LOAD, semi_length=-1e-3)
    with pytest.raises(ContactInputError, match="turn both bodies"):
        loaded_slices(Slices(SLICES.lower, SLICES.upper, direction=(0.1, -1.0)), load=LOAD)
    with pytest.raises(ContactInputError, match="give semi_length"):
        loaded_slices(Slices(SLICES.lower, SLICES.upper), load=LOAD)
    for cells in ((10, 2), 20, (8.5, 10), (8, 10, 12)):
        with pytest.raises(ContactInputError, match="at least 1 slice"):
            loaded_slices(SLICES, load=LOAD, cells=cells)


def test_a_pressure_beyond_small_strains_is_said():
    """1 GN: a twentieth of Young's modulus is passed; 100 kN is not near it."""
    assert "small strains" in loaded_slices(SLICES, load=1e9, cells=(5, 16), estimate=False).warnings[-1]
    assert not loaded_slices(SLICES, load=LOAD, cells=(5, 16), estimate=False).warnings
