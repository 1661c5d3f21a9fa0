"""Wheels that wear on straight line and are turned at a limit: what they lose, steps and positions halved, refusals."""

import numpy as np
import pytest

from geometry.profiles.wheel import wheel_profile
from rail_fem.case.casefile import CaseError, load_case
from rail_fem.damage import turning
from rail_fem.damage.sites import wheels_of
from rail_fem.damage.study import run_study, study_mark
from rail_fem.damage.turning import FLANGE, LINES, STEP, flange_height, hollow, lost_in_a_turn, lowered, worn_on_line
from rail_fem.damage.wear import dry_laws, laws_of
from rail_fem.damage.wheel_wear import wheel_lines
from rail_fem.result.runfolder import digest

CASE = "damage/crossing_transfer"
Y = wheel_lines(LINES)
TURNING = {"line": {"hollow": "0.05 mm"}, "ages": 2}


def turned(wheel="P8", hollow="0.05 mm", **changes):
    line = {"hollow": hollow, **changes.pop("line", {})}
    return load_case(CASE, {"scene.wheel.profile": wheel, "damage.turning": {"line": line, "ages": 2} | changes})


def way_of(case):
    """What its wheel's way goes by."""
    return case.scene, laws_of(case.damage, wheels=True)[case.damage.law], case.damage.factor, case.damage.turning.line


def test_limits_of_a_wheel_are_those_of_its_drawing_and_of_what_was_taken_off():
    """S1002: flange 28 mm (EN 13715); 1 mm off a band of the tread that is conical: 1 mm hollow, and the flange 1 mm
    higher where the band holds the datum."""
    new = wheel_profile("S1002")
    assert flange_height(new) == pytest.approx(28e-3, abs=1e-5) and hollow(new) < 1e-9
    band = np.where(np.abs(Y - 2e-3) < 8e-3, 1e-3, 0.0)
    worn = lowered(new, Y, band)
    assert flange_height(worn) - flange_height(new) == pytest.approx(1e-3, rel=1e-3)
    slope = new.height(np.array([11e-3]))[0] - new.height(np.array([10e-3]))[0]
    assert hollow(worn) == pytest.approx(1e-3 - slope, abs=0.1e-3)


def test_a_turn_takes_what_its_patches_take_and_no_friction_takes_nothing(monkeypatch):
    """Of one position: the section lost is that of the strips of the left wheel; positions of a normal law count by
    it."""
    case = turned()
    line, law, wheel = case.damage.turning.line, dry_laws(case.damage.wheel_hardness)["archard"], case.scene.wheel.shape
    seen, rolled = [], turning.roll

    def record(*args):
        seen.append(rolled(*args))
        return seen[-1]

    monkeypatch.setattr(turning, "roll", record)
    lost = lost_in_a_turn(wheel, case.scene, law, line, Y)
    shares = np.exp(-(np.linspace(-3, 3, 33) ** 2) / 2)
    shares[[max(abs(p.angle) for p in points) > FLANGE for points in seen]] = 0.0
    assert 25 < np.count_nonzero(shares) <= 33
    left = [[p for p in points if p.side == "left"] for points in seen]
    own = [sum((law.depth(p.patch, p.speed) * p.patch.grid.dy * np.cos(p.angle)).sum() for p in side) for side in left]
    assert lost.sum() * LINES == pytest.approx(np.dot(shares / shares.sum(), own), rel=0.02)
    slippery = case.scene.replace(friction=0.0)
    assert not lost_in_a_turn(wheel, slippery, law, line, Y).any()
    with pytest.raises(ValueError, match="meets no limit, for nothing wears it"):
        worn_on_line(slippery, law, 1.0, line)


def test_positions_behind_the_flange_s_face_wear_no_tip():
    """30 mm to each side: a flange that stands on the rail is flat there; worn six times as deep as the tread."""
    case = turned(line={"deviation": "10 mm"})
    scene, law, _, line = way_of(case)
    lost = lost_in_a_turn(scene.wheel.shape, scene, law, line, Y)
    assert lost.max() > 0 and not lost[Y < -40e-3].any()


def test_wheels_come_at_all_ages_of_their_way():
    """Equal parts of the way, not of the wear: deeper with age, each as frequent; up to half of it, the first half."""
    case = turned()
    way = worn_on_line(*way_of(case))
    assert way.limit == "hollow 0.05 mm" and (np.diff(way.distance) > 0).all() and way.distance[-1] > 100e3
    young, old = (own.wheel for own, _ in wheels_of(case.scene, case.damage))
    assert [share for _, share in wheels_of(case.scene, case.damage)] == [0.5, 0.5]
    at = np.array([way.y[way.lost[-1].argmax()]])
    rose = lambda wheel: wheel.shape.height(at)[0] - case.scene.wheel.shape.height(at)[0]
    assert 0 < rose(young) < rose(old) < way.lost[-1].max()
    assert way.after(1.0) == pytest.approx(way.lost[-1]) and not way.after(0.0).any()
    assert "25.0% of" in young.name and "km to hollow" in young.name
    half = wheels_of(case.scene, turned(until=0.5).damage)
    assert "12.5% of" in half[0][0].wheel.name
    told = load_case(CASE, {"scene.wheel.profile": "P8", "damage.wear_coefficient": 1e-4, "damage.turning": TURNING})
    assert worn_on_line(*way_of(told)).distance[-1] != pytest.approx(way.distance[-1], rel=0.1)
    assert (
        f"{worn_on_line(*way_of(told)).distance[-1] / 1e3:.3g} km"
        in wheels_of(told.scene, told.damage)[0][0].wheel.name
    )


def test_a_study_tells_that_wheels_wear_which_takes_minutes(tmp_path, caplog):
    """It was silent until its first block."""
    caplog.set_level("INFO", logger="rail_fem")
    quick = {"damage.turning": TURNING, "damage.cells": 10, "damage.patch_spacing": "20 mm"}
    case = load_case(CASE, {"scene.wheel.profile": "P8", "damage.sensitivities": False} | quick)
    run_study(case, 1.0, tmp_path / "study", False, False, lambda words: None)
    told = [record.message for record in caplog.records]
    assert told[:2] == [
        "wheels wear on straight line until they are turned",
        "2 wheels of all ages; contacts on the first shape",
    ]


def test_a_study_is_another_one_by_each_key_and_what_does_not_fit_is_refused():
    marks = [
        turned(),
        turned(hollow="0.06 mm"),
        turned(line={"deviation": "2 mm"}),
        turned(line={"flange_height": "32 mm"}),
    ]
    assert len({digest(study_mark(case, case.damage)) for case in marks}) == 4
    for table in ({}, {"worn": "P1", "line": {}}):
        with pytest.raises(CaseError, match="either worn, a profile, or a table turning.line"):
            load_case(CASE, {"damage.turning": table})
    with pytest.raises(ValueError, match="due for turning as it is: hollow 0.5 mm"):
        wheels_of(turned("P8-hollow", "0.5 mm").scene, turned("P8-hollow", "0.5 mm").damage)


@pytest.mark.validate
@pytest.mark.parametrize(("name", "finer"), [("STEP", STEP / 2), ("POSITIONS", 65)])
def test_half_the_step_and_twice_the_positions_change_little(monkeypatch, name, finer):
    """To 0.3 mm of hollow: the way, and the shape in parts of its deepest, by a tenth at most."""
    case = turned(hollow="0.3 mm")
    asked = way_of(case)
    first = worn_on_line(*asked)
    monkeypatch.setattr(turning, name, finer)
    second = worn_on_line.__wrapped__(*asked)
    assert second.distance[-1] == pytest.approx(first.distance[-1], rel=0.1)
    assert np.abs(second.lost[-1] - first.lost[-1]).max() < 0.1 * first.lost[-1].max()
