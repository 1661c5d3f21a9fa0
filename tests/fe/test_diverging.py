"""The diverging route by the explicit model: what holds the wheelset across the track, and a coarse pass."""

import numpy as np
import pytest

from rail_fem.case.casefile import load_case
from rail_fem.case.examples import example
from rail_fem.fe.contact.friction import material_flow
from rail_fem.fe.lateral_guide import LateralGuide
from rail_fem.fe.pass_supports import guide_across
from rail_fem.fe.supports import RigidGroup, Supports
from rail_fem.models import fe_full, rigid_hertz
from rail_fem.passes.lateral_start import LateralStart, lateral_start

ROUTE = {"radius": "645 m", "angle_of_attack": "3 mrad", "check_rail": "41 mm"}
HELD = LateralStart(
    across=3.6e-3,
    heading=0.0,
    force=0.0,
    clearance=3.5e-3,
    check_stiffness=50e6,
    other_force=80e3,
    other_push=0.0,
    creep=(7e6, 7e6),
    creep_along=0.0,
)


def axle(**changes):
    return RigidGroup("axle", np.empty(0, np.int64), 500.0, (False, True, True), lateral_mass=500.0, **changes)


def scene():
    return load_case("nose_transfer", {"scene.speed": "40 mph", "scene.diverging": ROUTE}).scene


def test_vehicle_and_other_wheel_push_the_axle_together():
    group = axle()
    guide = guide_across(scene(), HELD._replace(force=4e3, other_push=-1.5e3), group)
    assert guide.axle is group and group.load[1] == 2.5e3
    assert group.lateral_mass == scene().vehicle.wheel_unsprung_mass


def test_without_creep_the_wheelset_swings_on_the_check_rail_with_its_whole_mass():
    """k = 50 MN/m and 1,000 kg, from where it comes on: half a period pi sqrt(m / k), and back as fast."""
    group = axle(velocity=np.array([0.0, 0.1, 0.0]))
    guide = LateralGuide(group, HELD._replace(across=3.5e-3), 17.9, 0.0)
    supports, dt, count = Supports([group], guides=[guide]), 1e-6, 0
    while group.displacement[1] >= 0:
        supports.advance(np.zeros((1, 3)), dt)
        supports.drift(dt)
        count += 1
    assert count * dt == pytest.approx(np.pi * np.sqrt(1000.0 / 50e6), rel=1e-3)
    assert group.velocity[1] == pytest.approx(-0.1, rel=1e-3) and guide.dissipated == 0.0
    assert supports.energies()["lumped_kinetic"] == pytest.approx(0.5 * 1000.0 * 0.1**2, rel=1e-3)


def test_creep_of_the_other_wheel_brakes_as_kalker_and_ends_at_friction():
    """Linear at a small speed; at a large one mu N; what it takes is what the wheelset loses."""
    group = axle(velocity=np.array([0.0, 1e-6 * 17.9, 0.0]))
    guide = LateralGuide(group, HELD._replace(clearance=1.0), 17.9, 0.3)
    assert guide.creep_force() == pytest.approx(-7.0, rel=1e-3)  # saturation: 7 N over 3 mu N
    group.velocity[1] = 1.0
    assert guide.creep_force() == pytest.approx(-0.3 * 80e3, rel=1e-12)
    supports = Supports([group], guides=[guide])
    for _ in range(1000):
        supports.advance(np.zeros((1, 3)), 1e-6)
    lost = 0.5 * 1000.0 * (1.0 - group.velocity[1] ** 2)
    assert guide.dissipated == pytest.approx(lost, rel=1e-9) and lost > 20.0
    assert LateralGuide(axle(), HELD._replace(heading=1e-6), 17.9, 0.3).creep_force() == pytest.approx(7.0, rel=1e-3)


def test_material_of_a_wheel_that_heads_aside_flows_aside():
    """Under the axle, at (0, y, -R), of spin 1 rad/s: R backwards and R times the angle to the other side."""
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * 1e-3
    quad, weight = np.arange(4), np.full(4, 0.25)
    places = corners + [0.0, 0.0, -0.425]
    for yaw in (0.0, 3e-3):
        flow, scratch = np.zeros(3), [np.empty(3) for _ in range(5)]
        material_flow(places, places, quad, weight, yaw, flow, *scratch)
        np.testing.assert_allclose(flow, [-0.425, -0.425 * yaw, 0.0], atol=1e-15)


def test_the_start_of_the_explicit_model_is_that_of_the_light_one():
    """One search over the start, another over the whole pass: the same equilibrium to 1e-6."""
    case = load_case(
        example("nose_transfer"),
        {
            "scene.speed": "40 mph",
            "scene.diverging": ROUTE,
            "run": {
                "rigid_hertz": {
                    "start": "240 mm",
                    "end": "260 mm",
                    "path_spacing": "5 mm",
                    "degrees_of_freedom": "lateral_roll",
                    "lateral_range": "5 mm",
                }
            },
        },
    )
    start = lateral_start(case.scene, 0.24, 0.46)
    history = rigid_hertz.solve(case.scene, case.runs["rigid_hertz"]).history
    assert start.across == pytest.approx(history["wheel_lateral"][0], rel=1e-3)
    assert start.check_stiffness * (start.across - start.clearance) == pytest.approx(
        history["force_check"][0], rel=5e-3
    )
    assert start.other_force == pytest.approx(history["force_other"][0], rel=5e-3)
    # to the outside act the vehicle and creep of two wheels, at most friction; the check rail carries both
    check = start.check_stiffness * (start.across - start.clearance)
    assert start.force < check < start.force + 2 * 0.3 * 1.05 * case.scene.static_wheel_load


def test_the_explicit_wheelset_stays_on_the_check_rail(tmp_path):
    """Elements of 6 mm, 30 mm of the wing, mesh and light model held against each other: once creep has built up, the
    check rail carries what it does by the light model."""
    case = load_case("nose_transfer", {"scene.speed": "40 mph", "scene.diverging": ROUTE})
    settings = case.runs["fe_full"].replace(
        element_size="6 mm",
        element_aspect=1.0,
        wheel_element_ratio=1.0,
        error_twin=False,
        start="200 mm",
        end="240 mm",
        window_ahead=None,
        window_behind=None,
        field_frames=1,
    )
    result = fe_full.solve(case.scene, settings)
    start, history = lateral_start(case.scene, 0.2, 0.24), result.history
    assert result.scene == case.scene
    assert history["wheel_lateral"][0] == pytest.approx(start.across, abs=1e-6)
    expected = start.check_stiffness * (start.across - start.clearance)
    late = history["x"] > 0.225
    assert history["force_check"][late].mean() == pytest.approx(expected, rel=0.15)
    assert -history["force_lateral"][late].mean() != 0.0


def test_no_diverging_route_has_no_start():
    with pytest.raises(ValueError, match="no diverging route"):
        lateral_start(load_case("nose_transfer", {}).scene, 0.1, 0.2)
