"""Family "switch": from the stock rail to the switch rail."""

import numpy as np
import pytest

from geometry.path.wheel_path import wheel_path
from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.joint import Joint
from geometry.surfaces.switch import Switch, switch_rails
from rail_fem.case.preflight import preflight_errors
from rail_fem.models import rigid_hertz
from rail_fem.scene.scene import Crossing
from rail_fem.settings.light import P2Settings, RigidHertzSettings
from tests.rail_fem.joint_passes import joint_scene

TRANSFER = 2.734  # of a nominal P8, as the rigid path has it [m]


@pytest.fixture(scope="module")
def scene():
    return joint_scene(0.0).replace(crossing=Crossing(family="switch"))


def test_the_rigid_wheel_goes_from_stock_rail_to_switch_rail_once():
    """Ahead of the toe nothing happens; behind the transfer it stands on the switch rail alone."""
    x = np.r_[-1.0, -0.3, np.arange(2.4, 3.2, 0.1), 4.5, 5.5]
    path = wheel_path(wheel_profile("P8"), switch_rails(Switch()), x)
    assert path.height[:2] == pytest.approx(0.0, abs=1e-5)
    assert len(path.transfers) == 1 and path.transfers[0] == pytest.approx(TRANSFER, abs=5e-3)
    assert path.on_nose[x > TRANSFER].all() and not path.on_nose[x < TRANSFER].any()
    assert path.height[-1] == pytest.approx(path.height[-2], abs=1e-5)


def test_a_switch_is_told_apart_by_its_numbers(scene):
    other = scene.replace_si(crossing={"switch_radius": 500.0})
    assert scene.plain() != other.plain() and scene.crossing.name == "switch of R 290 m"


def test_a_wheel_passes_from_stock_rail_to_switch_rail_with_a_small_impact(scene):
    """The force goes over once, behind the rigid transfer; twice the spacing changes its largest value by 1e-3."""
    found = [
        rigid_hertz.solve(scene, RigidHertzSettings(start=2.4, end=3.1, path_spacing=spacing))
        for spacing in (2.5e-3, 5e-3)
    ]
    first = found[0].peaks["first_impact_on_nose"]
    assert found[0].transfer_x == pytest.approx(TRANSFER, abs=0.03)
    assert found[0].transfer_x < first.x < 3.0 and 1.1 < first.value / scene.static_wheel_load < 1.6
    assert found[1].peaks["first_impact_on_nose"].value == pytest.approx(first.value, rel=1e-3)
    behind = found[0].history["x"] > 3.0
    assert not found[0].history["force_wing"][behind].any()


def test_the_formula_is_refused_before_it_runs_where_no_dip_angle_is_given_and_none_is_found(scene):
    """It ended in the run; a crossing with a transfer, a joint and an angle of one's own are taken."""
    errors = lambda scene, **given: preflight_errors(scene, P2Settings(**given), 1, "p2_formula")
    (said,) = errors(scene)
    assert said.startswith("run.p2_formula: a rigid wheel never changes body") and said.endswith("give dip_angle")
    assert errors(scene, dip_angle=5e-3) == [] == errors(joint_scene(5e-3))
    assert errors(scene.replace(crossing=Crossing())) == []


def test_defaults_of_switch_and_joint_are_those_of_their_surfaces():
    """Told a second time, so that a scene of neither loads neither."""
    assert Crossing(family="switch").switch_radius == Switch.radius
    assert Crossing.model_fields["dip_bend"].default == Joint.bend
