"""Flange back as a stop: exact where the wheel runs straight, against all points of the wheel where it is yawed and
rolled."""

from dataclasses import replace

import numpy as np
import pytest

from geometry.contact.flange_back import back_gap
from geometry.contact.prismatic_search import ContactSearch
from geometry.profiles.wheel import wheel_profile
from geometry.wheelset import CheckRail, Track, Wheelset, WheelsetError

MM = 1e-3
FREE = (680.0 - 717.5 + 41.0) * MM  # half of back-to-back less half of gauge plus flangeway


def search(left=None, right=None, **wheelset) -> ContactSearch:
    return ContactSearch(
        Wheelset(wheel_profile("P8"), **wheelset), Track.plain_line(left_check=left, right_check=right)
    )


def test_a_straight_wheelset_has_the_gap_of_the_drawing():
    state = Wheelset(wheel_profile("P8"), y=1 * MM)
    assert back_gap(state, "left", CheckRail(), 0.7175 - 0.041) == pytest.approx(FREE + 1 * MM, abs=1e-9)
    assert back_gap(state, "right", CheckRail(), 0.7175 - 0.041) == pytest.approx(FREE - 1 * MM, abs=1e-9)
    assert back_gap(replace(state, z=0.5), "left", CheckRail(), 0.6765) == np.inf  # lifted off


@pytest.mark.parametrize("yaw, roll, top", [(0.02, 0.0, 0.0), (-0.05, 0.004, 25 * MM), (0.08, -0.02, -5 * MM)])
@pytest.mark.parametrize("side, sign", [("left", 1), ("right", -1)])
def test_the_gap_is_that_of_the_nearest_point_of_the_whole_wheel(yaw, roll, top, side, sign):
    """All points of the wheel's surface on a fine grid, written down in track axes; the grid's error is second order in
    its steps, but first order at the level of the check rail's top: r dtheta = 0.07 mm of length, times yaw."""
    state = Wheelset(wheel_profile("P8"), yaw=yaw, roll=roll, y=2 * MM)
    s = wheel_profile("P8").points[:, 0]
    theta = np.linspace(-1.2, 1.2, 16001)[:, None]
    forward, left = np.array([np.cos(yaw), np.sin(yaw), 0]), np.array([-np.sin(yaw), np.cos(yaw), 0])
    up = np.array([0, 0, 1.0])
    axle, down = np.cos(roll) * left + np.sin(roll) * up, np.sin(roll) * left - np.cos(roll) * up
    s = s[: np.argmin(wheel_profile("P8").points[:, 1]) + 1][::4]
    radius = state.radius - wheel_profile("P8").height(s)
    y, z = (
        sign * (state.datum_arm + s) * axle[i]
        + radius * (np.sin(theta) * forward[i] + np.cos(theta) * down[i])
        + (state.y, state.z)[i - 1]
        for i in (1, 2)
    )
    least = (sign * y)[z <= top].min()
    gap = back_gap(state, side, CheckRail(top=top), 0.6765)
    assert gap <= least - 0.6765 + 1e-9
    assert gap == pytest.approx(least - 0.6765, abs=0.07 * MM * abs(yaw) + 2e-6)


@pytest.mark.parametrize("lateral", [-10 * MM, -5 * MM])
def test_the_shift_ends_at_the_check_rail(lateral):
    """A left check rail holds the wheelset back from the right: at rail level it stays at -FREE, whatever is asked
    beyond."""
    held = search(left=CheckRail())
    state = held.settle(lateral)
    level = state.y + state.radius * np.sin(state.roll)
    assert level == pytest.approx(-FREE, abs=12 * MM * abs(state.roll))  # the back begins 11.9 mm below the pivot
    assert held.settle(lateral, held_at="axle").y == pytest.approx(state.y, abs=1e-9)
    check = held.track.check_rail("left")
    gap = back_gap(state, "left", check, held.track.gauge / 2 - check.flangeway)
    assert gap == pytest.approx(0, abs=1e-9) and held.track.check_rail("right") is None
    assert search().settle(lateral, held_at="axle").y == lateral


def test_a_shift_away_from_the_check_rail_is_left_alone():
    a, b = search(left=CheckRail()).settle(5 * MM, 0.01), search().settle(5 * MM, 0.01)
    assert (a.y, a.z, a.roll) == (b.y, b.z, b.roll)


def test_mirrored_check_rails_give_the_mirrored_answer():
    a, b = search(left=CheckRail()).settle(-8 * MM, 0.02), search(right=CheckRail()).settle(8 * MM, -0.02)
    assert (a.y, a.z, a.roll) == (-b.y, b.z, -b.roll)


def test_backs_that_do_not_fit_are_refused():
    with pytest.raises(WheelsetError, match="do not fit"):
        search(left=CheckRail(0.036), right=CheckRail(0.036)).settle(0.0)
    with pytest.raises(WheelsetError, match="flangeway"):
        CheckRail(41)
