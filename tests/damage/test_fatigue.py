"""Fatigue and heat: published regions and limits, closed forms, inputs refused."""

import numpy as np
import pytest

from bem.halfspace.fastsim import elliptic_patch, fastsim
from bem.material import STEEL
from bem.patch import Creepage, Grid, Patch
from rail_fem.damage.fatigue import WholeLifeRail, shakedown_limits, shakedown_point
from rail_fem.damage.heat import EFFUSIVITY, flash_temperature

MODEL = WholeLifeRail()


def sliding(creepage=0.05):
    patch = elliptic_patch(6e-3, 4e-3, 80e3)
    return fastsim(patch, STEEL, STEEL, 0.3, Creepage(creepage), bound="elliptic", estimate=False)


def test_regions_of_the_thesis_example():
    """5.43 N on the stock rail's head: no fatigue; 210.17 N on the switch rail: wear takes cracks away."""
    assert (MODEL.region(5.43), float(MODEL.damage(5.43))) == ("none", 0.0)
    assert MODEL.region(210.17) == "wear" and float(MODEL.damage(210.17)) < 0
    assert [MODEL.region(x) for x in (15.0, 40.0, 65.0, 100.0, 175.0, 180.0)] == [
        "none", "fatigue", "fatigue", "mixed", "mixed", "wear",
    ]  # fmt: skip


def test_corners_and_slopes_of_the_damage_function():
    assert MODEL.damage([0, 15, 40, 65, 120, 175]) == pytest.approx([0, 0, 5e-6, 1e-5, 5e-6, 0], abs=1e-20)
    assert float(MODEL.damage(285)) == pytest.approx(-1e-5)
    assert float(WholeLifeRail(peak=75.0).damage(75.0)) == pytest.approx(1e-5)  # the thesis' print


def test_the_function_is_that_of_a_public_code_that_begins_at_20_newton():
    """2.22e-7 x - 4.44e-6 from 20 to 65 N, 1.59e-5 - 9.09e-8 x to 175 N, to the three digits that it has."""
    model = WholeLifeRail(onset=20.0)
    x = np.array([20.0, 40.0, 64.9, 65.1, 120.0, 175.0])
    published = np.where(x < 65, 2.22e-7 * x - 4.44e-6, 1.59e-5 - 9.09e-8 * x)
    assert model.damage(x) == pytest.approx(published, abs=2e-8)


def test_fatigue_index_is_the_maps_right_border():
    """mu - 2 pi a b k / (3 N) = mu - k / p0: 0 where p0/k = 1/mu."""
    patch = sliding()
    p0 = 1.5 * 80e3 / (np.pi * 6e-3 * 4e-3)
    found = shakedown_point(patch, 300e6)
    assert found.traction == pytest.approx(0.3, rel=1e-6)
    assert found.index == pytest.approx(0.3 - 2 * np.pi * 6e-3 * 4e-3 * 300e6 / (3 * 80e3), rel=5e-3)
    assert shakedown_point(patch, 0.3 * p0).index == pytest.approx(0.0, abs=2e-3)


def test_line_contact_shakes_down_to_four_k():
    """Johnson (1985), section 9.2: elastic shakedown up to p0 = 4.0 k without traction; with it the surface limits,
    1 / mu, from mu = 0.367 on."""
    limits = shakedown_limits(np.array([0.0, 0.367, 0.5]), line=True)
    assert limits[0] == pytest.approx(4.0, rel=2e-3)
    assert limits[1] == pytest.approx(1 / 0.367, rel=0.01)
    assert limits[2] == pytest.approx(2.0)
    assert shakedown_limits(np.array([0.0]))[0] == pytest.approx(4.7)


def test_flash_temperature_of_an_even_flux_is_carslaw_and_jaegers():
    """2 q sqrt(t / pi) / sqrt(lambda rho c) at the rear of a patch that slides evenly, whichever way it rolls."""
    grid = Grid.over((-5e-3, 5e-3), (-4e-3, 4e-3), 40, 4)
    pressure = np.full(grid.shape, 1e9)
    traction = np.stack([np.full(grid.shape, -3e8), np.zeros(grid.shape)], axis=2)
    slip = np.stack([np.full(grid.shape, 0.02), np.zeros(grid.shape)], axis=2)
    patch = Patch(grid, None, pressure, 0.0, "even", traction, slip)
    for speed in (20.0, -20.0):
        exact = 2 * (3e8 * 0.02 * 20.0 / 2) * np.sqrt(10e-3 / 20.0 / np.pi) / EFFUSIVITY
        rise = flash_temperature(patch, speed)
        assert rise.max() == pytest.approx(exact, rel=1e-12)
        assert rise[0 if speed > 0 else -1] == pytest.approx(exact, rel=1e-12)
        assert (np.diff(rise[::-1] if speed > 0 else rise, axis=0) > 0).all()


def test_flash_temperature_of_a_hertz_patch_converges():
    rise = []
    for n in (25, 50, 100):
        patch = elliptic_patch(6e-3, 4e-3, 80e3, (n, n))
        rolled = fastsim(patch, STEEL, STEEL, 0.3, Creepage(0.02), estimate=False)
        rise.append(flash_temperature(rolled, 20.0).max())
    assert abs(rise[1] / rise[2] - 1) < 0.01 and 100 < rise[2] < 2000
