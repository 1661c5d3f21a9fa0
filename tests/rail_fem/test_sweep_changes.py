"""A file of groups that changes the cases it is about, and what the page of a pass over the leg says of it."""

import re
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rail_fem.case.casefile import load_case
from rail_fem.result import versions
from rail_fem.result.events import leg_flight
from rail_fem.result.result import PassResult, Peak, load
from rail_fem.sweeps.published_table import beside_table, leg_table
from rail_fem.sweeps.results import SweepResults
from rail_fem.sweeps.sweep import read_cases
from rail_fem.sweeps.sweep_page import state_lines
from rail_fem.sweeps.sweep_report import force_table
from rail_fem.sweeps.trend_words import run_control
from rail_fem.sweeps.trends import (
    MEASURES,
    CaseChanges,
    ControlExperiment,
    Published,
    Trend,
    TrendError,
    check,
    load_source,
)
from tests.commands import call

THESIS = Path(__file__).resolve().parents[2] / "cases" / "thesis"
SCENE = load_case(THESIS / "case_02.toml").scene
LEG_END = SCENE.crossing.leg_end
CHANGES = CaseChanges(
    change={"run.rigid_hertz.start": "-940 mm"}, only={"case_05": {"run.rigid_hertz.start": "600 mm"}}
)


def over_the_leg(flight: tuple[float, float] = (-0.70, -0.60), leg: float = 3e5) -> PassResult:
    """A made pass from the plain line to the nose that is in the air between two x [m]."""
    x = np.linspace(-0.9, 0.8, 1701)
    force = np.where((x > flight[0]) & (x < flight[1]), 0.0, 1e5)
    height = 1e-3 * np.interp(x, [*flight], [0.0, 1.0])
    rows = {"time": (x - x[0]) / 33.5, "x": x, "force": force, "wheel_height": height, "crossing_height": 0 * x}
    peaks = {"largest_force_leg": Peak(leg, "N", x=-0.71)}
    peaks |= {"impact_on_wheel": Peak(1.3e5, "N", x=0.39), "first_impact_on_nose": Peak(1.2e5, "N", x=0.4)}
    peaks |= {f"largest_force_{part}": Peak(1.1e5, "N", x=0.1) for part in ("wing", "nose")}
    metal = {"leg": {"values": {"worst_1000": 0.04, "block": 0.05}, "maximum": 0.07, "position": [-0.69, 0, 0]}}
    metal["leg"]["size"] = 2e-3
    return PassResult("fe_full", SCENE, {}, rows, peaks, transfer_x=0.36, metal=metal, error_bars={})


def test_changes_of_a_groups_file_are_made_and_what_the_command_sets_goes_before():
    files = [THESIS / f"case_{number}.toml" for number in ("02", "05")]
    start = lambda cases: [case.runs["rigid_hertz"].start for case in cases]
    assert start(read_cases(files, changes=CHANGES)[0]) == pytest.approx([-0.94, 0.6])
    assert start(read_cases(files, {"run.rigid_hertz.start": "0.3 m"}, (), CHANGES)[0]) == pytest.approx([0.3, 0.3])
    varied = [("run.rigid_hertz.start", ["0.1 m", "0.2 m"])]
    assert start(read_cases(files[:1], {}, varied, CHANGES)[0]) == pytest.approx([0.1, 0.2])
    assert start(read_cases(files)[0]) == pytest.approx([0.095, 0.64])


def test_the_sixteen_cases_run_over_the_whole_crossing_each_in_its_direction():
    """From plain line to behind the nose or the other way, by every model that has a path."""
    source = load_source(THESIS / "whole_crossing.toml")
    cases, errors = read_cases(sorted(THESIS.glob("case_*.toml")), changes=source)
    assert len(cases) == 16 and not errors
    low, high = SCENE.crossing.surface.leg_range
    for case in cases:
        for model in ("lumped", "rigid_hertz", "bem_passage", "fe_full"):
            ends = sorted((case.runs[model].start, case.runs[model].end))
            assert ends[0] < low - 0.1 and ends[1] > 0.6 and high < 0
            assert (case.runs[model].start < 0) == (case.scene.direction == "facing")


def test_a_change_of_a_case_that_is_not_there_is_refused(tmp_path):
    path = tmp_path / "groups.toml"
    path.write_text("[only.case_5]\n'scene.speed' = '50 mph'\n[[group]]\ntitle='a'\ncases=['case_05']\n")
    with pytest.raises(TrendError, match="only.case_5: there is no case_5.toml"):
        load_source(path)


def test_a_control_changes_the_case_as_it_was_swept():
    """Swept at 50 mph, a control at 75 mph brings back what an unchanged sweep has; nothing changed keeps it."""
    trend = Trend(says="same", quantity="first impact on the nose", order=("case_02", "case_03"), unchanged=1e-9)
    swept = CaseChanges(change={"scene.speed": "50 mph"})
    kept = run_control(ControlExperiment(says="as it is"), trend, THESIS, swept)
    back = run_control(
        ControlExperiment(says="back", only={"case_02": {"scene.speed": "75 mph"}}), trend, THESIS, swept
    )
    plain = run_control(ControlExperiment(says="as it is"), trend, THESIS)
    assert kept.verdict == "agrees" and back.values == plain.values and back.verdict == plain.verdict == "differs"


def test_the_flight_off_the_leg_is_none_where_the_pass_does_not_run_over_it():
    result = over_the_leg()
    flight = leg_flight(result)
    assert flight is not None and flight.length == pytest.approx(0.1, abs=3e-3)
    behind = over_the_leg((LEG_END + 0.05, LEG_END + 0.2))  # that one begins on the wing rail
    assert leg_flight(behind).length == 0.0
    late = replace(result, history={name: rows[result.history["x"] > 0] for name, rows in result.history.items()})
    assert leg_flight(late) is None
    trend = Trend(says="farther", quantity="flight off the leg", order=("b", "a"))
    found = check(trend, {"a": {"fe_full": result}, "b": {"fe_full": behind}})
    assert found[0].verdict == "agrees" and found[0].values == pytest.approx((0.0, 100.0), abs=3.0)
    assert check(trend, {"a": {"fe_full": result}, "b": {"fe_full": late}}) == []


def test_the_dip_behind_the_leg_counts_from_the_static_sag():
    """A sag of 0.5 mm, 0.7 mm more behind the leg, 1.1 mm more at a later landing; trailing nothing is told."""
    result, dip = over_the_leg(), MEASURES["crossing dip behind the leg"]
    x = result.history["x"]
    height = -0.5e-3 - 1e-3 * np.interp(x, [-0.71, -0.6, -0.5, -0.3, -0.1], [0.0, 0.7, 0.2, 1.1, 0.0])
    sunk = replace(result, history=result.history | {"crossing_height": height})
    assert dip.factor * dip.of(sunk) == pytest.approx(0.7, abs=1e-3)
    back = replace(sunk, scene=sunk.scene.replace(direction="trailing"))
    assert all(np.isnan(MEASURES[name].of(back)) for name in ("crossing dip behind the leg", "flight onto the leg"))
    assert all(np.isnan(MEASURES[name].of(back)) for name in ("flight behind the nose", "force before the nose"))


def test_flights_have_their_place():
    """Ahead of the first blow on the leg, behind it, behind the transfer: none is another's."""
    told = lambda result: [
        MEASURES[f"flight {place}"].of(result) for place in ("onto the leg", "off the leg", "behind the nose")
    ]
    off = over_the_leg()
    struck = replace(
        off, history=off.history | {"force": np.where(off.history["x"] < -0.71, 2e5, off.history["force"])}
    )
    assert told(struck) == pytest.approx([0.0, 0.1, 0.0], abs=3e-3)
    onto = over_the_leg((-0.75, -0.72))
    blow = np.where(np.abs(onto.history["x"] + 0.70) < 0.01, 2e5, onto.history["force"])
    assert told(replace(onto, history=onto.history | {"force": blow}))[0] == pytest.approx(0.03, abs=3e-3)
    behind = over_the_leg((0.40, 0.45))
    assert told(behind) == pytest.approx([0.0, 0.0, 0.05], abs=3e-3)
    before = np.where(np.abs(off.history["x"] - 0.30) < 0.02, 1.7e5, 1e5)
    assert MEASURES["force before the nose"].of(replace(off, history=off.history | {"force": before})) == 1.7e5


def test_the_page_of_such_a_sweep_has_the_leg_in_its_tables(tmp_path):
    result = over_the_leg()
    table = leg_table((Published(case="a", leg_force=263.6),), {"a": {"fe_full": result}})
    assert "| a | 263.6, - | 300.0 at -710; 99," in table[2] and "4.0; 5.0; 7.0 at -690" in table[2]
    head, _, row = force_table({"a": {"fe_full": result}})
    assert "impact on the wheel, first on the body taking over; largest on leg/wing/nose [kN]" in head
    assert "| 130.0, 120.0; 300.0/110.0/110.0 |" in row
    other = over_the_leg()
    mine = {"a": {"fe_full": result}, "b": {"fe_full": result}}
    both = beside_table(mine, {"a": {"fe_full": other}})
    assert len(both) == 3 and both[2].count("130.0, 120.0; 300.0/110.0/110.0 | 360 |") == 2
    printed = beside_table(mine, {"a": {"fe_full": other}}, (Published(case="a", leg_force=263.6, peak=172.5),))
    assert printed[2].startswith("| a | fe_full | 263.6/-/172.5 | 130.0")
    assert leg_table((), {"a": {"fe_full": replace(result, peaks={})}}) == []


def test_a_sweep_says_where_its_peaks_and_flights_are_and_what_it_warns_of():
    result = replace(over_the_leg((-0.7005, -0.6005)), warnings=("too coarse", "ends in flight"))
    sweep = SweepResults({"a": {"fe_full": result}}, ())
    (row,) = sweep.rows()
    assert row["first_impact_on_nose [kN]"] == 120.0 and row["first_impact_on_nose, x [mm]"] == pytest.approx(400.0)
    assert row["flights [mm]"] == "-700.0 to -601.0" and row["warnings"] == 2
    assert row["words of the warnings"] == "too coarse; ends in flight" and "too coarse" in sweep.to_csv()
    assert "too coarse" not in sweep.to_markdown() and ", x [mm]" not in sweep.to_markdown()


def test_sweep_and_report_by_one_groups_file(tmp_path):
    """The command line: the sweep makes the changes, its page checks them, names what is missing, and sets another
    sweep of the same cases beside it, with what their scenes have otherwise."""
    for name in ("case_02", "case_03"):
        text = (THESIS / f"{name}.toml").read_text()
        (tmp_path / f"{name}.toml").write_text(text)
    groups = tmp_path / "groups.toml"
    groups.write_text(
        "[change]\n'scene.speed' = '60 mph'\n"
        "[[group]]\ntitle='Speed'\ncases=['case_02', 'case_03']\n"
        "[[group.trend]]\nsays='nothing changes'\nquantity='first impact on the nose'\norder=['case_02', 'case_03']\n"
        "unchanged=0.1\n"
    )
    light = ("--model", "p2_formula")
    call("sweep", tmp_path / "case_02.toml", "--groups", groups, "--out", tmp_path / "new", *light)
    assert load(tmp_path / "new" / "case_02" / "p2_formula").scene.speed == pytest.approx(60 * 0.44704)
    call("sweep", tmp_path / "case_02.toml", "--out", tmp_path / "old", *light)
    call("report", tmp_path / "new", "--groups", groups, "--beside", tmp_path / "old")
    page = (tmp_path / "new" / "report" / "report.md").read_text()
    assert f"--groups {groups}" in page and "p2_formula has not run case_03: `rail-fem sweep" in page
    assert f"Beside {tmp_path / 'old'}" in page and "speed: 33.5" in page and " there, 26.8" in page
    assert "(first impact on the nose: case_02 = case_03, within 10 %)" in page


def test_the_page_of_a_sweep_that_was_given_a_setting(tmp_path):
    """The scene that was swept is the file's with --set; so says the page, which names it in its commands."""
    (tmp_path / "case_02.toml").write_text((THESIS / "case_02.toml").read_text())
    groups = tmp_path / "groups.toml"
    groups.write_text("[[group]]\ntitle='Speed'\ncases=['case_02']\n")
    out, change = tmp_path / "out", ("--set", "scene.speed=60 mph")
    call("sweep", tmp_path / "case_02.toml", "--model", "p2_formula", "--out", out, *change)
    refused = " ".join(call("report", out, "--groups", groups, code=2).output.split())
    assert "give 'report' the --set of the sweep" in refused and "remove" not in refused
    call("report", out, "--groups", groups, *change)
    page = (out / "report" / "report.md").read_text()
    assert page.count("--set 'scene.speed=60 mph'") == 2 and "| case_02 |" in page


def test_a_page_that_is_written_leaves_the_state_of_the_program_clean(tmp_path, monkeypatch):
    """Documents compute nothing: the second of two pages is of the same state as the first."""
    (tmp_path / "docs").mkdir()
    source, page = tmp_path / "model.py", tmp_path / "docs" / "page.md"
    for file in (source, page):
        file.write_text("1")
    git = ("git", "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@b")
    for words in (["init", "-q"], ["add", "."], ["commit", "-qm", "first"]):
        subprocess.run([*git, *words], check=True)
    monkeypatch.setattr(versions, "__file__", str(tmp_path / "rail_fem" / "output" / "versions.py"))
    page.write_text("2")
    assert re.fullmatch("[0-9a-f]{12}", versions.git_revision())
    source.write_text("2")
    assert re.fullmatch("[0-9a-f]{12}-dirty", versions.git_revision())


def test_a_page_says_which_runs_are_of_which_state():
    at = lambda state: replace(over_the_leg(), versions={"git": state})
    clean = {"a": {"lumped": at("1" * 12), "fe_full": at("1" * 12)}}
    assert state_lines(clean) == [f"All runs at commit {'1' * 12}."]
    mixed = clean | {"b": {"lumped": at("1" * 12), "fe_full": at("2" * 12 + "-dirty")}}
    assert state_lines(mixed)[2:] == [f"- {'1' * 12}: a lumped, a fe_full, b lumped", f"- {'2' * 12}-dirty: b fe_full"]
    assert "Not of one committed state" in state_lines({"a": {"lumped": at("1" * 12 + "-dirty")}})[0]
