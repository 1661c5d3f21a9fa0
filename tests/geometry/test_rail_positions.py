"""Gauge, gauge point, cant and the three degrees of freedom of each rail: what each does, against the same state
reached another way."""

import numpy as np
import pytest

from geometry.contact.prismatic_search import ContactSearch
from geometry.profiles.rail import rail_head
from geometry.profiles.wheel import wheel_profile
from geometry.wheelset import RailPosition, Track, Wheelset

MM = 1e-3
TIGHT = 1e-9


def touching(track: Track, lateral: float = 0.0, yaw: float = 0.01):
    search = ContactSearch(Wheelset(wheel_profile("P8")), track)
    state = search.settle(lateral, yaw)
    return state, {side: search.contacts(state, side).lowest() for side in ("left", "right")}


def test_both_rails_aside_are_the_wheelset_aside_the_other_way():
    offset = RailPosition(lateral=1.5 * MM)
    moved, points = touching(Track.plain_line(left_position=offset, right_position=offset), lateral=3.5 * MM)
    plain, reference = touching(Track.plain_line(), lateral=2.0 * MM)
    assert (moved.z, moved.roll) == pytest.approx((plain.z, plain.roll), abs=TIGHT)
    for side in points:
        assert points[side].station == pytest.approx(reference[side].station, abs=TIGHT)
        assert points[side].rail_station == pytest.approx(reference[side].rail_station, abs=TIGHT)
        assert points[side].position[0] == pytest.approx(reference[side].position[0] + [0, 1.5 * MM, 0], abs=TIGHT)


def test_rails_apart_are_a_wider_gauge():
    wide, points = touching(
        Track.plain_line(left_position=RailPosition(lateral=2 * MM), right_position=RailPosition(lateral=-2 * MM))
    )
    gauge, reference = touching(Track.plain_line(gauge=1.439))
    assert (wide.z, wide.roll) == pytest.approx((gauge.z, gauge.roll), abs=TIGHT)
    assert all(points[s].position == pytest.approx(reference[s].position, abs=TIGHT) for s in points)


def test_rails_up_lift_the_wheelset_and_one_rail_up_rolls_it():
    up = RailPosition(vertical=4 * MM)
    lifted, _ = touching(Track.plain_line(left_position=up, right_position=up))
    plain, _ = touching(Track.plain_line())
    assert lifted.z - plain.z == pytest.approx(4 * MM, abs=TIGHT) and lifted.roll == pytest.approx(
        plain.roll, abs=TIGHT
    )
    left, _ = touching(Track.plain_line(left_position=up))
    assert left.roll == pytest.approx(4 * MM / 1.5, rel=0.03)  # over the distance of the contacts, about 1.5 m


@pytest.mark.parametrize("side, turn", [("left", 1.0), ("right", -1.0)])
def test_an_upright_rail_rolled_towards_the_track_is_an_inclined_one(side, turn):
    """Rolled about its crown point by atan 1:20; the inclined head's own origin is put where the rolled head's highest
    point is."""
    angle = np.arctan(1 / 20)
    track = Track(rail_head("56E1"), **{f"{side}_position": RailPosition(roll=turn * angle)})
    rolled = track.placed(side)
    top = rolled.points[np.argmax(rolled.points[:, 1])]
    head = rail_head("56E1", 1 / 20).points
    y = top[0] + np.linspace(-20, 20, 81) * MM
    own = rail_head("56E1", 1 / 20).graph_part()
    assert rolled.height(y) - top[1] == pytest.approx(
        own.height(y - top[0] + head[np.argmax(head[:, 1]), 0]), abs=TIGHT
    )
    assert top[0] > track.gauge_offset(side)  # its field side comes up, so that the highest point moves outwards


def test_the_rail_station_is_the_place_on_the_unmoved_profile():
    offset = RailPosition(lateral=1 * MM, vertical=-2 * MM, roll=0.02)
    track = Track.plain_line(left_position=offset)
    _, points = touching(track)
    own, at = track.left.graph_part(), points["left"].rail_station[0]
    turned = np.array([[np.cos(0.02), np.sin(0.02)], [-np.sin(0.02), np.cos(0.02)]])
    on_rail = np.array([at, float(own.height(np.array(at)))]) @ turned + [track.gauge_offset("left") + 1 * MM, -2 * MM]
    assert points["left"].position[0, 1:] == pytest.approx(on_rail, abs=TIGHT)


def test_the_gauge_is_met_at_the_gauge_point_whatever_its_depth():
    for depth in (10 * MM, 14 * MM, 16 * MM):
        track = Track.plain_line(gauge=1.432, gauge_point=depth)
        placed = rail_head("56E1", 1 / 20, 5e-6).points + [track.gauge_offset("left"), 0.0]
        rising = placed[: np.argmax(placed[:, 1]) + 1]
        # chords of 5 um on 12.7 mm: 0.3 nm; crowns sampled 0.1 mm apart: 4 nm of height
        assert np.interp(-depth, rising[:, 1], rising[:, 0]) == pytest.approx(0.716, abs=1e-8)


def test_cant_turns_vectors_from_the_track_plane_to_the_level():
    """Left rail higher: what points up from the track plane leans to the right, and the left rail lies higher."""
    track = Track.plain_line(cant=0.1)
    assert track.level([0, 0, 1.0]) == pytest.approx([0, -np.sin(0.1), np.cos(0.1)])
    assert track.level([5.0, 0.75, 0]) == pytest.approx([5.0, 0.75 * np.cos(0.1), 0.75 * np.sin(0.1)])
    assert np.array_equal(Track.plain_line().level(np.eye(3)), np.eye(3))
