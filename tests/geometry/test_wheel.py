"""Wheel profiles: facts of the standards, and the transcribed tables where they are at hand."""

import numpy as np
import pytest

from geometry.profiles.profile import ProfileError
from geometry.profiles.wheel import WHEEL_NAMES, flange_thickness, wheel_profile
from tests.outside import found

FILES = {
    "P8": "wheel_EPS_h30_e28p5_6p7pct.csv",
    "P8-worn": "wheel_P8_worn_SYNTHETIC_w0p8.csv",
    "P8-hollow": "wheel_P8_hollow_SYNTHETIC_w3.csv",
    "P1": "wheel_P1_like_APPROX.csv",
    "S1002": "wheel_S1002_h28_e32p5_analytic.csv",
}
PRINT = 1e-6  # the standard prints coordinates to 1 um
MM = 1e-3


@pytest.mark.parametrize("name", ["P8", "P1", "S1002"])
def test_the_tread_datum_of_a_new_wheel_is_the_origin(name):
    assert abs(float(wheel_profile(name).height(np.array(0.0)))) < PRINT


def test_worn_wheels_lose_the_stated_depth_and_nothing_at_the_flange_tip():
    new = wheel_profile("P8")
    for name, depth in (("P8-worn", 0.8 * MM), ("P8-hollow", 3.0 * MM)):
        loss = wheel_profile(name).height(new.points[:, 0]) - new.points[:, 1]
        assert loss.max() == pytest.approx(depth, abs=1e-9) and loss.min() > -1e-12
        assert np.abs(loss[new.points[:, 0] < -60 * MM]).max() < 1e-2 * depth
        assert "SYNTHETIC" in wheel_profile(name).label and "not a measurement" in wheel_profile(name).provenance


def test_flange_angle_and_height_of_p8():
    """EN 13715: flange face 70 degrees; the two R12 tip arcs of the thin flange meet 0.168 mm below their common
    top."""
    wheel = wheel_profile("P8")
    face = wheel.slope(np.linspace(-44.5, -42.5, 20) * MM)
    assert np.degrees(np.arctan(face)) == pytest.approx(np.full(20, 70.0), abs=0.03)  # 5.779 / 2.103 mm gives 70.004
    assert -wheel.points[:, 1].min() == pytest.approx((18 + np.sqrt(144 - 4)) * MM, abs=PRINT)


def test_p8_is_smooth_but_for_its_three_edges():
    """Flange tip, start of the far tread, chamfer; every other joint turns by less than the print allows (2 mrad)."""
    wheel = wheel_profile("P8")
    edges = wheel.points[wheel.angle_before != wheel.angle_after, 0]
    assert edges == pytest.approx(np.array([-57.0, 29.0, 60.0]) * MM, abs=PRINT)


def test_s1002_is_smooth_everywhere():
    wheel = wheel_profile("S1002")
    assert np.all(wheel.angle_before == wheel.angle_after)


def test_slopes_of_tread_and_far_tread():
    assert wheel_profile("P8").slope(np.array(0.0)) == pytest.approx(19 / np.sqrt(330**2 - 19**2), rel=2e-3)
    assert wheel_profile("P8", outer_slope=0.1).slope(np.array(40 * MM)) == pytest.approx(0.1)
    assert wheel_profile("P1").slope(np.array(0.0)) == pytest.approx(0.05)


def test_radii_of_root_and_tread_are_those_of_the_standard():
    wheel = wheel_profile("P8")
    for y, radius in ((-40.5, 13.0), (-22.0, 100.0), (0.0, 330.0)):
        at = int(np.argmin(np.abs(wheel.points[:, 0] - y * MM)))
        assert 1 / wheel.curvature[at] == pytest.approx(-radius * MM, rel=1e-12)


def test_profiles_run_from_flange_back_to_field_side():
    for name in WHEEL_NAMES:
        wheel = wheel_profile(name)
        assert wheel.is_graph and wheel.points[0, 0] == pytest.approx(-70 * MM)


@pytest.mark.parametrize("name, thickness", [("P8", 28.5e-3), ("S1002", 32.5e-3)])
def test_a_flange_is_as_thick_as_its_standard_says_10_mm_below_the_datum(name, thickness):
    wheel = wheel_profile(name)
    assert flange_thickness(wheel, 10e-3) == pytest.approx(thickness, abs=0.05e-3)
    assert flange_thickness(wheel) < flange_thickness(wheel, 10e-3) and flange_thickness(wheel, 0.1) == 0


def test_an_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(ProfileError, match="unknown wheel profile 'P9'; known: P8, P8-worn, P8-hollow, P1, S1002"):
        wheel_profile("P9")
    with pytest.raises(ProfileError, match="outer_slope 6.7"):
        wheel_profile("P8", outer_slope=6.7)


@pytest.mark.parametrize("name", WHEEL_NAMES)
def test_profiles_match_the_transcribed_tables(name):
    """1 um: the print of the standard (the tables' arcs keep its rounded centres, ours its points and radii).

    The worn tables stop their wear abruptly at y = -38 mm, a step of up to 0.8 mm; ours fades through the root.
    """
    table = np.loadtxt(found("profiles/" + FILES[name]), delimiter=",", comments=["#", "y"]) * MM
    if name in ("P8-worn", "P8-hollow"):
        table = table[table[:, 0] > -37.6 * MM]
    assert np.abs(wheel_profile(name).height(table[:, 0]) + table[:, 1]).max() < PRINT
