"""Searches between a few stations find what searches between all do: on both crossings, new, worn and hollow wheels,
either side, through the transfer from wing to nose."""

import numpy as np
import pytest

from geometry.contact.gap_kernel import (
    BRANCH,
    GAP,
    NO_RAIL,
    REACH,
    STATION,
    least_gap,
    near_stations,
    nearest_positions,
    roll_and_height,
    side_pose,
    still_near,
)
from geometry.contact.lofted_search import SurfaceSearch
from geometry.profiles.formats.slices import read_slices
from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.crossing import CastCrossing
from geometry.surfaces.lofted_rail import RailSurface
from geometry.surfaces.sections import SectionCrossing
from geometry.wheelset import SIDES, Track, Wheelset
from tests.outside import found

MM, UM = 1e-3, 1e-6
STATES = 25


def surface(name: str) -> RailSurface:
    if name == "sections":
        sections = SectionCrossing.from_slices(read_slices(found("formats/uk_crossing.slcs")))
        return RailSurface.of_sections(sections, -0.9, 0.75)
    return RailSurface.of_crossing(CastCrossing(float(name)), -0.85, 0.65)


def minima(stations, side, pose, level: float) -> np.ndarray:
    """(3, n) branch, station, gap of all minima below a level."""
    positions = nearest_positions(stations, side.wheel, side.rail, pose, side.tip, level)
    return positions[[BRANCH, STATION, GAP]][:, positions[GAP] < level]


@pytest.mark.parametrize("wheel", ["P8", "P8-worn", "P8-hollow", "P1"])
@pytest.mark.parametrize("rail, lies", [("9.25", "left"), ("10.75", "right"), ("sections", "left")])
def test_few_stations_find_the_minima_that_all_find(wheel, rail, lies):
    """Random positions, half of them about the transfer; a roll that differs by up to what the stations are good for.
    Minima agree to what their search leaves, 1e-13 m in station where the gap is smooth."""
    search = SurfaceSearch(Wheelset(wheel_profile(wheel)), Track.plain_line(), **{lies: surface(rail)})
    random, several, share = np.random.default_rng(11), 0, []
    for count in range(STATES):
        x = random.uniform(0.1, 0.45) if count % 2 else random.uniform(-0.65, 0.5)
        lateral, yaw = random.uniform(-9, 9) * MM, random.uniform(-0.02, 0.02)
        here = search.at(x)
        lever, arm, sides = search.wheelset.radius, search.wheelset.datum_arm, here.sides
        roll, height, left_over = roll_and_height(*sides.values(), lateral, yaw, 0.0, lever, arm)
        gaps = [least_gap(sides[s], SIDES[s], lateral, yaw, roll, lever, arm, False)[0] for s in SIDES]
        assert abs(left_over) < 1e-12 and gaps == pytest.approx([-height, -height], abs=1e-12)
        of, sign = sides[lies], SIDES[lies]
        pose = side_pose(sign, lateral, yaw, roll, lever, arm, of.radius)
        near = near_stations(of, pose, -height + REACH)
        share.append(near.stations.shape[1] / of.stations.shape[1])
        turned = side_pose(sign, lateral, yaw, roll + random.uniform(-1, 1) * 1e-4, lever, arm, of.radius)
        level = -height + random.uniform(20, 180) * UM
        assert still_near(near, of, turned, level)
        every, few = (minima(stations, of, turned, level) for stations in (of.stations, near.stations))
        assert few == pytest.approx(every, abs=1e-9)
        several += every.shape[1] > 1
    assert several > 0 and np.mean(share) < 0.6


def test_stations_are_chosen_anew_where_they_may_not_do():
    search = SurfaceSearch(Wheelset(wheel_profile("P8")), Track.plain_line(), left=surface("9.25")).at(0.3)
    of, arm, lever = search.sides["left"], search.wheelset.datum_arm, search.wheelset.radius
    roll, height, _ = roll_and_height(*search.sides.values(), 0.0, 0.0, 0.0, lever, arm)
    assert abs(height) < NO_RAIL
    pose = lambda turn: side_pose(1.0, 0.0, 0.0, roll + turn, lever, arm, of.radius)
    near = near_stations(of, pose(0.0), -height)
    assert near.level == pytest.approx(-height + REACH, abs=1e-6)  # the least of all stations is a little higher
    assert still_near(near, of, pose(1e-4), -height)
    assert not still_near(near, of, pose(1e-3), -height) and not still_near(
        near, of, pose(0.0), REACH + 2 * UM - height
    )
