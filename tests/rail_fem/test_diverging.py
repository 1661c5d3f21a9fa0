"""The diverging route: lateral equilibrium by hand, steering in a curve, the straight route bit by bit, refusals."""

import numpy as np
import pytest

from rail_fem.case.casefile import load_case
from rail_fem.case.preflight import preflight_errors
from rail_fem.case.warnings import scene_warnings
from rail_fem.hierarchy import solve
from rail_fem.models import rigid_hertz
from rail_fem.passes.lateral_equilibrium import lateral_equilibrium
from rail_fem.passes.lateral_start import lateral_start
from rail_fem.passes.plastic_indentation import contacts_of
from rail_fem.passes.vertical_pass import half_steps
from rail_fem.passes.wheelset_dynamics import HEIGHT, LATERAL, ROLL, YAW, for_kernels, static_forces
from rail_fem.passes.wheelset_pass import datum_arm, surfaces_of, wheelset_contacts
from rail_fem.scene.scene import GRAVITY
from tests.rail_fem.test_wheelset_dynamics import ARM, CONE, LOAD, RADIUS, cones

CASE = load_case("thesis/case_02")
SHORT = CASE.runs["rigid_hertz"].replace(end="110 mm", lateral_range="1 mm", degrees_of_freedom="lateral_roll")
STIFF = 1e11  # contacts that hardly give [N/m^1.5]
FLAT = 1e-12


def scene(speed="40 mph", **diverging):
    return CASE.scene.replace_si(speed=speed, diverging=diverging)


def standing(**changes):
    """Two cones on two rails, at rest under their load."""
    friction, slope = changes.pop("friction", 0.0), changes.pop("slope", FLAT)
    system, contacts = cones(1, friction=friction, stiffness=STIFF, slope=slope)
    start = np.zeros(8)
    start[HEIGHT] = -((LOAD / 2 / STIFF) ** (2 / 3))
    return system._replace(**changes), contacts, start


def pushed(system, force):
    load = system.load.copy()
    load[LATERAL] = force
    return system._replace(load=load)


def test_the_check_rail_alone_carries_the_force_on_level_rails():
    """No friction, no slope: k (u - clearance) is the force across it, with the weight's part along the rolled axle."""
    system, contacts, start = standing(stop=(3e-3, 50e6))
    found = lateral_equilibrium(pushed(system, 20e3), contacts, start)
    assert found.check == pytest.approx(20e3 - LOAD * found.position[ROLL], rel=1e-7)
    assert found.across == pytest.approx(3e-3 + found.check / 50e6, rel=1e-9)
    # the force acts at the axle, the check rail at rail level, and the weight stands aside
    couple = 20e3 * RADIUS + LOAD * found.position[LATERAL]
    assert found.contact[0] - found.contact[1] == pytest.approx(couple / ARM, rel=1e-4)
    assert found.contact.sum() == pytest.approx(LOAD, rel=1e-9)


@pytest.mark.parametrize("heading", [20e-3, -20e-3])
def test_an_axle_that_slides_presses_on_the_check_rail_with_friction_times_its_weight(heading):
    """At an angle of attack far beyond saturation creep is mu W, to the side that the axle heads to."""
    system, contacts, start = standing(stop=(1e-3, 50e6), friction=0.3)
    start[YAW] = heading
    force = 10e3 + 0.3 * LOAD
    found = lateral_equilibrium(pushed(system, force), contacts, start)
    expected = force + np.sign(heading) * 0.3 * LOAD - LOAD * found.position[ROLL]
    assert found.check == pytest.approx(expected, rel=1e-6)


def test_gravity_holds_cones_as_the_slope_of_their_contacts_says():
    """Symmetric cones: what is left across at rail level is the difference of both wheels' loads times the slope, which
    with the check rail carries the force."""
    system, contacts, start = standing(stop=(1e-3, 50e6), slope=CONE)
    found = lateral_equilibrium(pushed(system, 20e3), contacts, start)
    forces = static_forces(for_kernels(pushed(system, 20e3)), for_kernels(contacts), found.position)
    assert abs(forces.load[LATERAL]) < 1e-3 and abs(forces.load[ROLL]) < 1e-3
    roll = found.position[ROLL]
    across = forces.contact @ (contacts.side * CONE + roll)  # of the contacts, to the right
    assert found.check + across == pytest.approx(20e3, rel=1e-6)


def test_cones_that_stand_aside_by_curvature_arm_radius_over_slope_roll_round_the_curve():
    """The outer rail is longer by 2 arm / R; the difference of rolling radii at that position makes up for it."""
    system, contacts, start = standing(slope=CONE, friction=10.0)
    bent = for_kernels(system._replace(curvature=1 / 645.0))

    def turning(aside):
        position = start.copy()
        position[ROLL] = CONE * aside / ARM  # both wheels go on standing on their rails
        position[LATERAL] = aside - RADIUS * position[ROLL]
        position[HEIGHT] += position[ROLL] * position[LATERAL] + RADIUS * position[ROLL] ** 2 / 2
        return static_forces(bent, for_kernels(contacts), position).load[YAW]

    balanced = ARM * RADIUS / 645.0 / CONE
    centred = turning(0.0)
    assert centred > 0  # a wheelset that rolls straight turns to the outside of the track
    assert abs(turning(balanced)) < 1e-9 * centred
    assert turning(2 * balanced) == pytest.approx(-centred, rel=1e-6)


def test_a_straight_diverging_route_with_nothing_in_reach_is_the_through_route_to_the_last_bit():
    through = rigid_hertz.solve(CASE.scene.replace(speed="40 mph"), SHORT)
    for route in ({}, {"check_rail": "60 mm"}, {"cant": "0 mm", "lateral_force": "0 kN"}):
        found = rigid_hertz.solve(scene(**route), SHORT)
        for name in ("force", "force_nose", "force_other", "wheel_height", "wheel_lateral", "wheel_yaw"):
            np.testing.assert_array_equal(found.history[name], through.history[name])


def test_contacts_are_told_where_the_wheel_has_moved_to_and_no_lateral_force_without_its_creep():
    """As of a wheel that stands aside by half of what the track is narrower; those of the centred one were told."""
    found = rigid_hertz.solve(scene(lateral="0.5 mm"), SHORT)
    aside = rigid_hertz.solve(CASE.scene.replace(gauge="1434 mm"), SHORT.replace(degrees_of_freedom="vertical"))
    centred = rigid_hertz.solve(CASE.scene, SHORT.replace(degrees_of_freedom="vertical"))
    assert found.history["contact_y"][0] == pytest.approx(aside.history["contact_y"][0], abs=1e-5)
    assert found.patches[0].y == pytest.approx(aside.patches[0].y, abs=1e-5)
    assert abs(aside.patches[0].y - centred.patches[0].y) > 1e-4
    assert np.isnan(found.history["force_lateral"]).all()


def test_a_wheelset_rolls_through_a_dip_as_deep_as_a_joint_has():
    """2.5 mm under one wheel move both aside by 0.7 mm at rail level; with roll alone 0.5 mm were looked at."""
    dip = CASE.scene.replace_si(speed="5 mph", crossing={"family": "joint", "dip_angle": 10e-3, "dip_length": 0.6})
    settings = SHORT.replace_si(start=-0.61, end=-0.1, degrees_of_freedom="roll", lateral_range=1e-3, path_spacing=0.02)
    aside = rigid_hertz.solve(dip, settings).history["wheel_lateral"]
    assert aside[-1] == pytest.approx(-2.5e-3 / (2 * datum_arm(dip)) * dip.wheel.radius, rel=0.05)


def test_cant_that_balances_the_speed_leaves_no_force():
    """g cant / s = V^2 / R; without cant the axle's mass times V^2 / R."""
    speed = CASE.scene.replace(speed="40 mph").speed
    balanced = speed**2 / 645 * 1.505 / GRAVITY
    assert abs(scene(radius="645 m", cant=balanced).lateral_force) < 1e-9
    weight = 2 * CASE.scene.static_wheel_load
    assert scene(radius="645 m").lateral_force == pytest.approx(weight / GRAVITY * speed**2 / 645, rel=1e-12)
    assert scene(radius="645 m", lateral_force="-3 kN").lateral_force == -3e3


def test_a_curve_that_moves_much_load_to_the_outer_wheel_warns():
    """75 mph on 190 m: V^2 / R = 5.92 m/s^2, of g 0.603, by 1.5 m of height over half the distance of the contacts,
    (1435 + 70) / 2 mm: 1.20 of the wheel's load."""
    (said,) = [line for line in scene_warnings(scene("75 mph", radius="190 m")) if line.startswith("diverging: ")]
    assert "5.92 m/s^2" in said and "120 %" in said and "overturns" in said and "left out" in said
    for speed, radius in (("40 mph", "645 m"), ("75 mph", None)):
        assert not [line for line in scene_warnings(scene(speed, radius=radius)) if line.startswith("diverging: ")]


def test_a_pass_held_by_the_check_rail_begins_in_equilibrium():
    """With 1 kN of the vehicle, an angle of attack and a check rail 0.5 mm away: nothing moves at first."""
    route = dict(lateral_force="1 kN", angle_of_attack="0.2 mrad", check_rail="38 mm")
    found = rigid_hertz.solve(scene(**route), SHORT)
    check, across = found.history["force_check"], found.history["wheel_lateral"]
    assert 1e3 < check[0] < 1e3 + 2 * 0.3 * CASE.scene.static_wheel_load
    assert across[0] == pytest.approx(0.5e-3 + check[0] / 50e6, abs=1e-9)
    np.testing.assert_allclose(found.history["wheel_yaw"], 0.2e-3, rtol=1e-12)
    first = slice(0, 5)
    np.testing.assert_allclose(check[first], check[0], rtol=1e-2)
    there = rigid_hertz.solve(scene(**route, lateral=float(across[0])), SHORT)
    np.testing.assert_allclose(there.history["force_check"], check, rtol=1e-4)  # the row is half a step behind


@pytest.mark.parametrize("aside", ["-0.6 mm", "0.6 mm"])
def test_a_given_lateral_position_moves_the_wheelset_not_its_wheels_on_the_axle(aside):
    """Arms and rolling radii are those of the centred one; with the shift in them again, a wheel that the wing has let
    go had none, and a pass from y < 0 ended in NaN."""
    over_the_nose = SHORT.replace(start="540 mm", end="560 mm", path_spacing="10 mm")
    held, free = scene(lateral=aside), scene()
    surfaces = surfaces_of(free, over_the_nose)
    law, (_, x) = contacts_of(free, over_the_nose, surfaces.centred), half_steps(free, over_the_nose, None)
    for one, other in zip(*(wheelset_contacts(s, law(x), surfaces, x) for s in (held, free)), strict=True):
        np.testing.assert_array_equal(one, other)
    assert datum_arm(held) == datum_arm(free)
    assert np.isfinite(rigid_hertz.solve(held, over_the_nose).history["force"]).all()


def test_a_check_rail_that_reaches_the_centred_wheelset_has_pushed_it_aside_before_the_pass():
    """A flangeway of 37 mm, 0.5 mm less than there is to the centred flange's back: 25 kN at once, on any route."""
    through = rigid_hertz.solve(CASE.scene.replace(speed="40 mph"), SHORT.replace(check_rail="37 mm"))
    check, across = through.history["force_check"], through.history["wheel_lateral"]
    assert 0 < check[0] < 10e3 and across[0] == pytest.approx(-0.5e-3 + check[0] / 50e6, abs=1e-6)
    np.testing.assert_allclose(check[:5], check[0], rtol=1e-2)
    diverging = rigid_hertz.solve(scene(check_rail="37 mm"), SHORT)
    np.testing.assert_array_equal(diverging.history["force_check"], check)
    squeezed = SHORT.replace(check_rail="30 mm", lateral_range="8 mm")
    (said,) = preflight_errors(CASE.scene, squeezed, 1, "rigid_hertz")
    assert "the wheelset overturns" in said and "another check_rail" in said


@pytest.mark.parametrize("held", ["vertical", "roll"])
def test_a_wheelset_that_cannot_move_across_takes_no_check_rail(held):
    """It was ignored, or turned the axle over as a torque."""
    with pytest.raises(ValueError, match="check_rail is for degrees_of_freedom lateral_roll"):
        SHORT.replace(check_rail="36 mm", degrees_of_freedom=held)


def test_without_a_check_rail_nothing_holds_the_wheelset_on_the_wing():
    """The wing has no gauge face beside the flange; one that stands beyond what is looked at is none, either."""
    said = (
        r"no lateral equilibrium: .* kN still push the wheelset outwards at 0\.9\d mm.*give a larger lateral"
        ".*a nearer check"
    )
    for check_rail in ({}, {"check_rail": "80 mm"}):
        with pytest.raises(ValueError, match=said):
            rigid_hertz.solve(scene(lateral_force="20 kN", **check_rail), SHORT)


def test_a_flange_that_has_climbed_derails():
    """A rail whose slope rises to 1.5 over 10 mm and falls to nothing over the next: the flange holds 1.5 N, N is half
    the weight and H R / 2 arm, so H of 1.5 W / 2 / (1 - 1.5 R / 2 arm) = 224 kN derails."""
    system, contacts, start = standing()
    slope, height = np.zeros_like(contacts.slope), np.zeros_like(contacts.slope)
    slope[0, :, 3] = 1.5
    height[0, :, 3], height[0, :, 4] = 7.5e-3, 15e-3
    contacts = contacts._replace(slope=slope, height=height)
    held = lateral_equilibrium(pushed(system, 215e3), contacts, start)
    assert held.check == 0.0 and 9e-3 < held.across < 10e-3
    with pytest.raises(ValueError, match="derails: .* its flange has climbed the rail.*nearer check_rail"):
        lateral_equilibrium(pushed(system, 235e3), contacts, start)


def test_a_check_rail_that_lets_the_flange_on_the_nose_is_refused():
    settings = SHORT.replace(start="150 mm", end="180 mm", lateral_range="11.5 mm", path_spacing="10 mm")
    with pytest.raises(ValueError, match=r"flangeway 48 mm\): from 10.50 mm .* strikes the nose at x = .*narrower by"):
        rigid_hertz.solve(scene(lateral_force="20 kN", check_rail="48 mm"), settings)


def test_a_wheelset_that_cannot_begin_is_refused_before_the_run_and_by_its_sentence():
    """A curve pushes it to where no check rail is; of the explicit model at its own start, 95 mm, 10 mm from which
    round-off left less than the shortest window."""
    free, explicit = scene(check_rail="100 mm", radius="300 m"), CASE.runs["fe_full"].replace(start="95 mm")
    for model, run in (
        ("rigid_hertz", lambda: rigid_hertz.solve(free, SHORT)),
        ("fe_full", lambda: lateral_start(free, explicit.start, explicit.end)),
    ):
        with pytest.raises(ValueError, match="still push .* outwards") as found:
            run()
        asked = SHORT if model == "rigid_hertz" else explicit
        assert preflight_errors(free, asked, 1, model) == [f"run.{model}: {found.value}"]


@pytest.mark.parametrize(
    "changes, said",
    [
        ({"crossing": {"family": "switch"}}, "other switch rail"),
        ({"crossing": {"gauge_widening": "1 mm"}}, "through-route face"),
        ({"diverging": {"check_rail": "3 mm"}}, "check_rail"),
        ({"diverging": {"radius": "10 m"}}, "radius"),
        ({"diverging": {"lateral": "40 mm"}}, "lateral"),
    ],
)
def test_what_no_diverging_route_can_be_is_refused(changes, said):
    with pytest.raises(ValueError, match=said):
        CASE.scene.replace(**({"diverging": {}} | changes))


@pytest.mark.parametrize("model", ["p2_formula", "lumped", "rigid_hertz", "bem_passage", "bem_plastic", "fe_window"])
def test_models_without_lateral_motion_refuse_the_diverging_route(model):
    with pytest.raises(ValueError, match="scene.diverging is for rigid_hertz"):
        solve(model, scene())


def test_two_check_rails_are_refused():
    with pytest.raises(ValueError, match="the check rail is that of scene.diverging"):
        solve("rigid_hertz", scene(), SHORT.replace(check_rail="41 mm"))


def test_a_lateral_position_that_was_not_looked_at_is_refused():
    with pytest.raises(ValueError, match="lateral = 3 mm lies beyond the 1 mm that are looked at: widen lateral_range"):
        rigid_hertz.solve(scene(lateral="3 mm"), SHORT)
