"""A wheelset through a parametric switch: its geometry as stated, two points in between, load that goes over without a
gap."""

import numpy as np
import pytest

from geometry.contact.lofted_search import SurfaceSearch
from geometry.contact.prismatic_search import ContactSearch
from geometry.profiles.profile import ProfileError
from geometry.profiles.rail import gauge_face
from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.switch import Switch
from geometry.wheelset import Track, Wheelset, WheelsetError
from rail_fem.contact.load_sharing import static_equilibrium
from rail_fem.studies.switch import AXLE_LOAD, MM, panels, point_table, report, run_through

X = np.array([0.0, 0.3, 0.7, 1.2, 1.8, 2.0, 2.05, 2.1, 2.15, 2.4, 2.65, 3.0, 4.0])  # at 2.65 m a force jumps


@pytest.fixture(scope="module")
def passed():
    return run_through(Switch(), x=X)


@pytest.mark.parametrize("x", [1.6, 2.5, 4.0])
def test_the_switch_rail_has_the_width_and_height_that_it_is_given(x):
    """14 mm below the stock rail's crown, where gauges are measured; a quarter of a metre between sections: 0.25^2 / (8
    * 290 m) = 27 um."""
    switch = Switch()
    switch_rail = switch.switch_rail(x)
    assert switch.gauge_line - gauge_face(switch_rail) == pytest.approx(switch.entry * x + x**2 / 580, abs=30e-6)
    assert switch_rail.points[:, 1].max() == pytest.approx(switch.top(x), abs=30e-6)


def test_at_the_toe_the_wheel_meets_the_stock_rail_alone():
    switch = Switch()
    y = np.linspace(-34.9, 30, 500) * MM
    assert np.abs(switch.section(0.0).height(y) - switch.stock.height(y)).max() < 1e-9


def test_the_turnouts_own_middle_is_half_a_gauge_from_the_switch_rail():
    """The gauge holds at every x where the switch rail's face reaches gauge depth, and the right rail does not move."""
    for x in (1.0, 3.0):
        track = Switch().track(x)
        placed = track.gauge_offset("left") + track.left_position.lateral + gauge_face(track.left)
        assert placed == pytest.approx(0.7175, abs=30e-6)
        assert track.right_position.lateral == 0.0


def test_the_load_goes_from_the_stock_rail_to_the_switch_rail(passed):
    share = passed.share(True)
    assert share[0] == 0.0 and share[-1] == pytest.approx(1.0, abs=1e-12)
    assert (np.diff(share) > -1e-9).all()
    assert np.bincount(passed.index, passed.vertical) == pytest.approx(AXLE_LOAD / 2, rel=1e-6)


def test_in_between_the_wheel_stands_on_both_with_its_flange_on_the_switch_rail(passed):
    """Thesis 3.9: one point on the head of the stock rail, one at the gauge corner of the switch rail; more when the
    tread is reached."""
    for x in (0.7, 1.2, 1.8):
        mine = passed.index == np.argmin(np.abs(X - x))
        assert passed.on_switch_rail[mine].tolist() == [True, False]
        assert np.degrees(passed.angle[mine][0]) > 65 and np.degrees(passed.angle[mine][1]) < 15
    assert passed.points().max() == 3 and passed.points()[-1] == 1


def test_a_wheel_that_is_not_pushed_stays_on_the_stock_rail_until_its_tread_meets_the_switch_rail():
    """Held at 8.2 mm, the largest offset of thesis 3.9, at 0.7 m, it just touches the switch rail or not at all; the
    stock rail carries."""
    switch = Switch()
    search = ContactSearch(Wheelset(wheel_profile("P8")), switch.track(0.7))
    found = static_equilibrium(search, (AXLE_LOAD / 2, AXLE_LOAD / 2), 8.2 * MM, 2e-3)
    assert found.left.contacts.rail_station[np.argmax(found.left.normal_force)] > -20 * MM


def test_a_force_that_jumps_past_its_load_by_little_is_answered_and_said():
    """At 2.65 m the switch rail's profile ends within the contact: forces climb in steps of 1e-4 of the load."""
    search = ContactSearch(Wheelset(wheel_profile("P8")), Switch().track(2.65))
    for held_at in ("rail", "axle"):
        found = static_equilibrium(search, (100e3, 100e3), 0.010944997176383975, 8.55e-3, held_at)
        assert found.imbalance < 1e-3
        for side in (found.left, found.right):
            assert (found.imbalance > 1e-6) == any("jumps past its load" in text for text in side.warnings)
            assert side.force[:, 2].sum() == pytest.approx(100e3, rel=1.01 * max(found.imbalance, 1e-6))


def test_a_station_without_an_answer_is_named_and_the_others_go_on():
    """Pushed by 0.8 of its axle load the wheelset climbs the thin switch rail's stock rail, and not the full one."""
    found = run_through(Switch(), x=np.array([0.7, 2.0]), push=0.8)
    assert found.x.tolist() == [2.0] and len(found.states) == 1
    assert "no answer at x = 0.70 m: " in report(found) and "climbs the rail" in report(found)
    with pytest.raises(WheelsetError, match="no station has an answer; x = 0.70 m"):
        run_through(Switch(), x=np.array([0.7]), push=0.8)


def test_sections_one_by_one_stand_as_the_whole_surface_does():
    """In the straight track's axes the wheelset heads along the curve, by entry + x / R to the right of it. What prisms
    leave out: the switch rail's
    climb of 1 : 300 (0.25 mm of position on it, 12 um of height), and 1 - cos of the heading (8 um)."""
    switch = Switch()
    left, right = switch.surfaces()
    surface = SurfaceSearch(Wheelset(wheel_profile("P8")), Track(switch.stock), left, right)
    for x, lateral in ((1.0, 6 * MM), (1.9, 0.0), (2.1, 8 * MM), (2.3, 6 * MM), (3.0, 0.0), (4.0, 8 * MM)):
        here, attack = surface.at(x), 5e-3
        whole = here.settle(lateral - switch.width(x), attack - switch.entry - x / switch.radius)
        prism = ContactSearch(Wheelset(wheel_profile("P8")), switch.track(x))
        state = prism.settle(lateral, attack)
        assert whole.z == pytest.approx(state.z, abs=15e-6) and whole.roll == pytest.approx(state.roll, abs=20e-6)
        positions = [s.contacts(at, "left").lowest().rail_station[0] for s, at in ((here, whole), (prism, state))]
        assert positions[0] == pytest.approx(positions[1], abs=0.3 * MM)


def test_the_study_has_its_table_and_figure(passed):
    table = point_table(passed, Switch())
    force = table.head.index("normal force [kN]")
    assert np.allclose([row[force] for row in table.rows], passed.force / 1e3)
    assert "half of the wheel load from 2.10 m" in report(passed)
    plan, shares = panels(Switch(), passed)
    points = [len(plan.lines[f"contact on the {rail}"][0]) for rail in ("stock rail", "switch rail")]
    assert sum(points) == len(passed.index) and min(points) > 0
    both = [shares.lines[f"load on the {rail}"][1] for rail in ("stock rail", "switch rail")]
    assert sum(both) == pytest.approx(np.full(len(X), 100.0))


def test_switches_that_cannot_be_are_refused():
    for heights in (((0.0, -16e-3), (0.0, -5e-3)), ((0.0, np.nan), (0.05, 0.0)), ((0.0, 0.0),)):
        with pytest.raises(ProfileError, match="must grow in width"):
            Switch(heights=heights)
    with pytest.raises(WheelsetError, match="radius = 3"):
        Switch(radius=3.0)
