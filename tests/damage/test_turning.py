"""Wheels that are turned: what they have lost at each age, the traffic that they make, what stays as it was."""

import numpy as np
import pytest
from scipy.integrate import trapezoid

from geometry.profiles.wheel import wheel_profile
from rail_fem.case.casefile import CaseError, load_case
from rail_fem.damage.evolution import begin
from rail_fem.damage.sites import crossing_site, traffic_of, wheels_of
from rail_fem.damage.study import study_mark
from rail_fem.damage.summary import summary
from rail_fem.damage.turning import between
from rail_fem.result.runfolder import digest

CASE = "damage/crossing_transfer"
QUICK = {"damage.cells": 12, "damage.patch_spacing": "8 mm", "damage.plan_spacing": "0.5 mm"}
QUICK |= {"scene.wheel.profile": "P8"}
RUN = {"start": "310 mm", "end": "390 mm"}
TURNING = {"damage.turning.worn": "P8-hollow", "damage.turning.ages": 2}


def turned(**changes):
    return load_case(CASE, QUICK | TURNING | {f"damage.turning.{key}": value for key, value in changes.items()})


def test_the_worn_section_is_the_part_of_the_whole_wear():
    """Heights are linear in the part, so is the section between them: to round-off."""
    new, worn = wheel_profile("P8"), wheel_profile("P8-hollow")
    y = new.points[:, 0]
    area = lambda line: trapezoid(line.points[:, 1] - new.points[:, 1], y)
    for part in (0.0, 0.25, 0.7, 1.0):
        assert area(between(new, worn, part)) == pytest.approx(part * area(worn), rel=1e-12, abs=1e-18)


def test_a_line_between_meets_the_heights_between_everywhere():
    """Between its points a line is a cubic through blended heights and slopes: linear in both, as they are."""
    new, worn = wheel_profile("P8"), wheel_profile("P8-hollow")
    y = np.linspace(-0.025, 0.055, 3001)
    wanted = 0.6 * new.height(y) + 0.4 * worn.height(y)
    np.testing.assert_allclose(between(new, worn, 0.4).height(y), wanted, atol=1e-15)


def test_wheels_that_do_not_wear_or_are_turned_at_once_are_todays_traffic():
    never, at_once = load_case(CASE, QUICK), turned(until=0.0)
    assert wheels_of(never.scene, never.damage) == traffic_of(never.scene, never.damage)
    assert wheels_of(at_once.scene, at_once.damage) == traffic_of(never.scene, never.damage)


def test_wheels_come_at_all_ages_each_as_frequent():
    """Mean wear of all of them is half of that at which they are turned, whatever their number: middles of equal parts
    meet a linear function exactly."""
    for ages, until in ((1, 1.0), (2, 0.5), (5, 0.8)):
        case = turned(ages=ages, until=until)
        kinds = wheels_of(case.scene, case.damage)
        new, worn = (wheel_profile(name).height(np.array([0.0]))[0] for name in ("P8", "P8-hollow"))
        lost = [(own.wheel.shape.height(np.array([0.0]))[0] - new, share) for own, share in kinds]
        assert len(kinds) == ages and sum(share for _, share in kinds) == pytest.approx(1.0, rel=1e-14)
        assert sum(loss * share for loss, share in lost) == pytest.approx(until * (worn - new) / 2, rel=1e-12)


def test_a_study_is_another_one_by_each_key_of_turning():
    """So a restart of another turning is refused."""
    marks = [load_case(CASE, QUICK), turned(), turned(until=0.5), turned(ages=3), turned(worn="P8-worn")]
    assert len({digest(study_mark(case, case.damage)) for case in marks}) == len(marks)


def test_a_crossing_is_worn_by_wheels_of_all_ages():
    """The mean pass removes the mean of what they remove one by one; the summary tells the share of each."""
    case = turned()
    site = crossing_site(case.scene, case.damage, RUN)
    rate = site.rate(site.first())
    assert len(rate.kinds) == 2 and len({own.label for _, own in rate.kinds}) == 2
    law = case.damage.law
    assert rate.removed[law] == pytest.approx(np.mean([own.removed[law] for _, own in rate.kinds]), rel=1e-12)
    told = summary(case.damage, begin(site), rate, rate)["removed_by_kind"]["first"]
    assert sum(share for _, share in told) == pytest.approx(1.0, rel=1e-12)
    assert told[0][1] != pytest.approx(told[1][1], rel=1e-3)


def test_a_fleet_with_its_own_wear_is_refused():
    drawn = {"damage.fleet.draw": {"scene.speed": {"low": "20 mph", "high": "90 mph"}}}
    with pytest.raises(CaseError, match="drawn with their wear"):
        load_case(CASE, QUICK | TURNING | drawn)
