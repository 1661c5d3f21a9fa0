"""Family "joint": plain line, and the P2 formula's own scene."""

import numpy as np
import pytest

from geometry.path.wheel_path import wheel_path
from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.crossing import CrossingError
from geometry.surfaces.joint import Joint, joint_rail
from rail_fem.case.casefile import CaseError, load_case
from rail_fem.models import lumped, p2_formula, rigid_hertz
from rail_fem.output.low_pass import filtered_peak
from rail_fem.settings.light import LumpedSettings, P2Settings, RigidHertzSettings
from rail_fem.studies.joint import formula, increment, joint_scene
from tests.rail_fem.test_crossing_section import case_with

WINDOW = {"start": -0.3, "end": 0.6}


def test_on_plain_line_nothing_happens():
    """A joint without a dip: the static load throughout, by every light model; no dip for the formula."""
    scene = joint_scene(0.0)
    assert scene.crossing.name == "plain line"
    for model, settings in ((lumped, LumpedSettings(**WINDOW)), (rigid_hertz, RigidHertzSettings(**WINDOW))):
        force = model.solve(scene, settings).history["force"]
        assert force == pytest.approx(scene.static_wheel_load, rel=1e-6)
    assert p2_formula.solve(scene, P2Settings()).trust["dip_angle"] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("shape, within", [("straight", 2e-7), ("parabolic", 1e-5)])
def test_the_rigid_wheel_sees_the_dip_as_it_is(shape, within):
    """Away from the bend its height is the rail's where it touches, and the slopes part by the dip angle."""
    joint = Joint(10e-3, 1.0, shape)
    path = wheel_path(
        joint_rail(joint), wheel_profile("P8"), np.r_[np.arange(-0.9, -0.01, 0.02), np.arange(0.02, 0.9, 0.02)]
    )
    radius = 0.425
    at, slope = path.contact_point[:, 0], path.slope
    exact = joint.height(at) + radius * (1 - np.sqrt(1 + slope**2))
    assert np.abs(path.height - exact).max() < within
    if shape == "straight":
        assert path.slope[0] == pytest.approx(-5e-3, rel=1e-3) and path.slope[-1] == pytest.approx(5e-3, rel=1e-3)


def test_the_formula_takes_the_joint_s_own_dip_angle():
    found = p2_formula.solve(joint_scene(8e-3), P2Settings())
    assert found.trust["dip_angle"] == pytest.approx(8e-3, rel=2e-3)
    assert abs(found.transfer_x) < 5e-3


def test_light_models_meet_the_formula_as_its_assumptions_come_to_hold():
    """The track's spring force; the contact's compliance costs the order of sqrt(Kt / k): less, the stiffer it is."""
    scene = joint_scene(0.2e-3, damping=False)
    found = []
    for stiffness in (1e11, 1e12, 1e13):
        settings = LumpedSettings(**WINDOW, contact="linear", contact_stiffness=stiffness, time_step=2e-6)
        found.append(increment(lumped.solve(scene, settings)) / formula(scene))
    error = np.abs(np.array(found) - 1)
    assert error[2] < error[1] < error[0] < 0.3
    assert error[2] < 0.08, found


def test_damping_takes_the_force_below_the_formula_and_a_low_pass_further():
    scene = joint_scene(4e-3)
    free = joint_scene(4e-3, damping=False)
    runs = [rigid_hertz.solve(s, RigidHertzSettings(**WINDOW)) for s in (free, scene)]
    assert increment(runs[1]) < 0.97 * increment(runs[0])
    peaks = [filtered_peak(runs[1], cutoff).value for cutoff in (500.0, 50.0, 20.0)]
    assert (np.diff(peaks) < 0).all() and peaks[-1] > scene.static_wheel_load


@pytest.mark.parametrize(
    "lines, complaint",
    [
        (['family = "joint"', 'dip_angle = "100 mrad"'], "dip_angle: .* is outside"),
        (['family = "joint"', "ratio = 9.25"], "ratio: does not belong to family joint"),
        (['family = "joint"', 'file = "x.csv"'], 'no file "x.csv"'),
        (["ratio = 9.25", 'dip_angle = "5 mrad"'], "dip_angle: does not belong to family UK-cast"),
    ],
)
def test_what_is_no_joint_is_refused(tmp_path, lines, complaint):
    with pytest.raises(CaseError, match=complaint):
        load_case(case_with(tmp_path, *lines))


def test_a_bend_longer_than_the_dip_is_refused():
    with pytest.raises(CrossingError, match="below a quarter"):
        Joint(5e-3, 0.1, "straight", 0.05)
    with pytest.raises(CrossingError, match="unknown shape"):
        Joint(5e-3, 1.0, "round")
