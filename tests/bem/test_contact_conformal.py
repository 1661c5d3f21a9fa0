"""A pin in a hole of almost its own radius: Persson's closed form, and the boundary elements against it."""

import numpy as np
import pytest
from scipy.integrate import quad

from bem.exact.conformal import pin_clearance, pin_pressure
from bem.material import STEEL, contact_modulus
from bem.plane.contact import Settings, solve_contact
from bem.plane.coulomb import Control
from bem.verification.exact_problems import pin_and_hole
from tests.bem.closed_forms import pin_semi_angle

# VERIFICATION D: contact semi-angle [degrees], E* dR / P, p0 R / P
TABLE = [(30, 3.9718, 1.2603), (45, 1.4116, 0.8821), (60, 0.5336, 0.7117), (75, 0.1435, 0.6281)]
RADIUS, CLEARANCE = 0.05, 2e-5


@pytest.mark.parametrize("degrees, clearance, pressure", TABLE)
def test_closed_form_meets_the_table(degrees, clearance, pressure):
    assert pin_clearance(np.radians(degrees)) == pytest.approx(clearance, abs=6e-5)
    assert pin_pressure(0.0, np.radians(degrees)) == pytest.approx(pressure, abs=6e-5)
    assert np.degrees(pin_semi_angle(clearance)) == pytest.approx(degrees, abs=0.01)


def test_closed_form_balances_the_load_and_ends_at_848_degrees():
    for angle in (0.2, 1.0, 1.4):
        assert quad(lambda phi: pin_pressure(phi, angle) * np.cos(phi), -angle, angle)[0] == pytest.approx(1, rel=1e-7)
    assert np.degrees(pin_semi_angle(0.0)) == pytest.approx(84.8, abs=0.05)


def test_narrow_pin_contact_is_hertz():
    """E* dR / P = 4 / (pi angle^2) for a small angle."""
    assert pin_clearance(0.01) == pytest.approx(4 / (np.pi * 0.01**2), rel=1e-4)


def solve_pin(clearance, size):
    load = contact_modulus(STEEL, STEEL) * CLEARANCE / clearance
    return solve_contact(
        *pin_and_hole(RADIUS, CLEARANCE, STEEL), Control.of(force=(None, -load)), settings=Settings(size=size)
    ), load


@pytest.mark.parametrize("degrees, clearance, pressure", TABLE)
def test_pin_in_hole_is_perssons(degrees, clearance, pressure):
    """VERIFICATION D: 1 % up to 75 degrees; 24 elements to the half contact, edges within a quarter of an element."""
    result, load = solve_pin(clearance, RADIUS * np.radians(degrees) / 24)
    (patch,) = result.patches()
    assert patch.max_pressure * RADIUS / load == pytest.approx(pressure, rel=0.002)
    assert patch.width / 2 / RADIUS == pytest.approx(np.radians(degrees), rel=0.01)
    points, inner = result.interface.points, np.abs(result.last.pressure) > 0
    angle = np.arctan2(points[:, 0], -points[:, 1])
    miss = result.last.pressure * RADIUS / load - pin_pressure(angle, np.radians(degrees))
    away = inner & (np.abs(angle) < 0.9 * np.radians(degrees))
    assert np.abs(miss[away]).max() < 0.01 * pressure
    assert result.force()[1] == pytest.approx(load, rel=1e-11)


def test_pin_pressure_converges():
    """Error of the largest pressure at 60 degrees with 6, 12, 24, 48 elements to the half contact: within (h/a)^2 plus
    5e-4 of the phase."""
    for n in (6, 12, 24, 48):
        result, load = solve_pin(pin_clearance(np.pi / 3), RADIUS * np.pi / 3 / n)
        exact = pin_pressure(0.0, np.pi / 3)
        assert result.last.pressure.max() * RADIUS / load == pytest.approx(exact, rel=1 / n**2 + 5e-4)


def test_interference_is_pressed_all_round_by_no_load():
    """A pin too big for its hole, moved nowhere: uniform pressure p = E / (2 (1 - nu^2)) dR / R between plate and pin.

    Hoop strain of the hole p (1 + nu) / E, of the solid pin -p (1 + nu) (1 - 2 nu) / E: p = E dR / (2 R (1 - nu^2)).
    """
    hole, pin = pin_and_hole(RADIUS, -CLEARANCE, STEEL)
    result = solve_contact(hole, pin, Control.of(motion=(0.0, 0.0)), settings=Settings(coarse=0.03))
    expected = STEEL.plane_modulus / 2 * CLEARANCE / RADIUS
    np.testing.assert_allclose(result.last.pressure, expected, rtol=0.02)
    assert result.patches()[0].nodes.size == len(result.interface.nodes)
