"""The mesh chosen from an accuracy: it is reached where the pressure peaks over a part of the patch only, and not
promised at edges."""

import numpy as np
import pytest

from bem.exact.conformal import pin_clearance, pin_pressure
from bem.material import STEEL, Elastic, contact_modulus
from bem.plane.contact import Settings, solve_contact
from bem.plane.coulomb import Control
from bem.plane.zone import NARROWEST, peak_sharpness
from bem.verification.cases import CASES, LOAD, blocks
from bem.verification.exact_problems import PIN_CLEARANCE, PIN_RADIUS, pin_and_hole
from rail_fem.contact.contact_pairs import plain_rail_pair
from rail_fem.contact.patch_methods import plain_rail_section

ASKED = [0.03, 0.01, 0.002]


def misses(fixed, moving, control, exact):
    """Errors of the largest pressure over what was asked for, one for each of ASKED; nothing may be warned of."""
    found = []
    for accuracy in ASKED:
        result = solve_contact(fixed, moving, control, settings=Settings(accuracy=accuracy))
        assert not result.warnings
        found.append(abs(result.last.pressure.max() / exact - 1) / accuracy)
    return found


@pytest.mark.parametrize("degrees", [30, 45, 60, 75])
def test_pins_in_holes(degrees):
    angle = np.radians(degrees)
    load = contact_modulus(STEEL, STEEL) * PIN_CLEARANCE / pin_clearance(angle)
    exact = pin_pressure(0.0, angle) * load / PIN_RADIUS
    assert max(misses(*pin_and_hole(PIN_RADIUS, PIN_CLEARANCE, STEEL), Control.of(force=(None, -load)), exact)) < 1


def wheel_on_rail():
    """P8 on BS113A in place, rail of 190 GPa."""
    return plain_rail_section(plain_rail_pair(rail_steel=Elastic(190e9, 0.3)))


@pytest.mark.parametrize(
    "case", [*CASES.values(), pytest.param(wheel_on_rail, marks=pytest.mark.validate)], ids=[*CASES, "wheel on rail"]
)
def test_case_studies_and_a_wheel_on_a_rail(case):
    """Against 0.07 mm, itself within 0.1 %. The wheel peaks over 1.2 mm of a patch of 13
    mm."""
    control = Control.of(force=(None, -4e6)) if case not in CASES.values() else LOAD
    fine = solve_contact(*case(), control, settings=Settings(size=0.07e-3)).last.pressure.max()
    assert max(misses(*case(), control, fine)) < 1


def test_sharpness_of_an_ellipse_is_its_half_width():
    """Linear between samples h: within h^2."""
    x = np.linspace(-1.02, 1.02, 103)
    points, pressure = np.column_stack([x, 0 * x]), np.sqrt(np.clip(1 - x**2, 0, None))
    assert peak_sharpness(points, pressure, 1.0) == pytest.approx(1, abs=0.02**2)
    assert peak_sharpness(points, np.where(np.abs(x) < 0.001, 1.0, 0.1), 1.0) == NARROWEST


def test_a_peak_at_an_edge_is_warned_of():
    flat, wide = np.array([[-0.005, 0.0], [0.005, 0.0]]), np.array([[-0.05, 0.0], [0.05, 0.0]])
    result = solve_contact(*blocks(flat, wide, Elastic(210e13, 0.3), height=0.05), Control.of(force=(None, -1e6)))
    assert any("as at an edge" in note for note in result.warnings)
