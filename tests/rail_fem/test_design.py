"""A design search: finds a known best, makes the same trials each time, goes on where it was."""

import re
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.crossing import CastCrossing
from rail_fem.case.casefile import CaseError
from rail_fem.design import search as search_module
from rail_fem.design.problem import DesignError, read_design
from rail_fem.design.search import TRIALS, Found, SearchRecord, Trial, rounded, search, trials_of
from rail_fem.design.search_report import command, report, shape_differences
from rail_fem.design.shape import shape_difference, told
from rail_fem.processes.pool import Workers
from rail_fem.result.runfolder import held
from tests.commands import call
from tests.rail_fem.test_casefile import ROOT
from tests.rail_fem.test_wheelshape import write

HERE = Workers(1)  # no process of its own
DESIGN = """
case = "{case}"
seed = 3
trials = {trials}
[[vary]]
key = "scene.crossing.nose_lowering"
low = "-1 mm"
high = "2 mm"
[[pass]]
name = "75 mph"
[pass.set]
"run.rigid_hertz.start" = "280 mm"
"run.rigid_hertz.end" = "420 mm"
"run.rigid_hertz.path_spacing" = "10 mm"
[[objective]]
quantity = "impact on the wheel"
"""


def design(tmp_path, trials=20, extra="", **changes):
    text = DESIGN.format(case=ROOT / "cases" / "nose_transfer.toml", trials=trials) + extra
    for old, new in changes.values():
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "design.toml"
    path.write_text(text, encoding="utf-8")
    return path


class Bowl:
    """In place of the model: a measure with a known least value, and no crossing beyond a bound."""

    def __init__(self, problem):
        self.calls = 0
        self.problem = problem

    def __call__(self, problem, values):
        self.calls += 1
        if values is None:
            return np.array([2.0]), ""
        if values[0] > 1.5:
            return np.array([np.nan]), "the wheel derails"
        return np.array([1.0 + (values[0] - 0.7) ** 2]), ""


@pytest.fixture
def bowl(tmp_path, monkeypatch):
    problem = read_design(design(tmp_path, trials=120))
    model = Bowl(problem)
    monkeypatch.setattr(search_module, "numbers_of", model)
    return problem, model


def test_the_search_finds_the_least_and_names_what_failed(bowl, tmp_path):
    problem, _ = bowl
    found = search(problem, tmp_path / "out", HERE, lambda text: None)
    assert found.best.values[0] == pytest.approx(0.7, abs=0.02) and found.best.score == pytest.approx(0.5, abs=1e-3)
    assert found.start.score == 1.0
    failed = [trial for trial in found.trials if trial.fault]
    assert failed and all(trial.score == 10.0 and trial.fault == "the wheel derails" for trial in failed)


def test_a_search_that_was_killed_goes_on_where_it_was(bowl, tmp_path):
    problem, model = bowl
    whole = search(problem, tmp_path / "whole", HERE, lambda text: None)
    calls, lines = model.calls, (tmp_path / "whole" / TRIALS).read_text().splitlines(True)
    (tmp_path / "cut").mkdir()
    (tmp_path / "cut" / TRIALS).write_text("".join(lines[:40]) + lines[40][:5])  # killed while it wrote a row
    again = search(problem, tmp_path / "cut", HERE, lambda text: None)
    assert model.calls == 2 * calls - 38  # 2 lines of heading; the start is one of the 38 rows that were done
    assert [tuple(t.values) for t in again.trials] == [tuple(t.values) for t in whole.trials]
    assert again.best.values == whole.best.values
    assert (tmp_path / "cut" / TRIALS).read_text() == (tmp_path / "whole" / TRIALS).read_text()


def test_trials_that_ended_before_a_kill_are_kept(bowl, tmp_path, monkeypatch):
    """The seventh trial of the first dozen is killed, by what no search catches: the six before it are not made
    again."""
    problem, model = bowl

    def killed(p, values):
        if model.calls == 7:  # and the start
            raise KeyboardInterrupt
        return model(p, values)

    monkeypatch.setattr(search_module, "numbers_of", killed)
    with pytest.raises(KeyboardInterrupt):
        search(problem, tmp_path / "out", HERE, lambda text: None)
    monkeypatch.setattr(search_module, "numbers_of", model)
    assert len(SearchRecord(problem, tmp_path / "out").trials) == 6
    search(problem, tmp_path / "out", HERE, lambda text: None)
    calls = model.calls
    search(problem, tmp_path / "whole", HERE, lambda text: None)
    assert model.calls == 2 * calls


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a file that is full")
def test_a_full_disk_is_told_with_the_file_of_the_trials(bowl, tmp_path):
    record = SearchRecord(bowl[0], tmp_path / "out")
    record.path = Path("/dev/full")
    with pytest.raises(OSError, match="No space left on device: '/dev/full'"):
        record._write(["1"])


def test_a_best_that_is_no_better_than_the_start_is_said_to_be_none(bowl, tmp_path):
    problem, _ = bowl
    found = search(problem, tmp_path / "out", HERE)
    worse = replace(found, best=replace(found.best, score=found.start.score))
    better, none = (report(problem, one).splitlines()[2] for one in (found, worse))
    assert "at best" in better and "no trial" not in better and none.endswith(": no trial is better than the start.")


def test_a_search_over_passes_that_end_too_soon_says_so(bowl, tmp_path):
    problem = read_design(design(tmp_path, changed=('"420 mm"', '"380 mm"')))
    text = report(problem, search(problem, tmp_path / "out", HERE))
    assert "start: 75 mph: the run ends at x = 380 mm with" in text


def test_a_search_in_which_nothing_can_be_run_says_why(bowl, tmp_path, monkeypatch):
    problem, model = bowl
    monkeypatch.setattr(search_module, "numbers_of", lambda p, v: model(p, None if v is None else np.array([2.0])))
    with pytest.raises(DesignError, match="none of the .* trials could be run, the last: the wheel derails"):
        search(problem, tmp_path / "out", HERE, lambda text: None)


def test_what_the_model_does_not_know_is_no_objective(tmp_path):
    """Else every shape scores alike and a random one is called the best."""
    problem = read_design(design(tmp_path, quantity=("impact on the wheel", "nose strain")))
    with pytest.raises(DesignError, match="rigid_hertz does not find nose strain in 75 mph"):
        search(problem, tmp_path / "out", HERE, lambda text: None)
    assert not SearchRecord(problem, tmp_path / "out").trials


def tried(out):
    with (out / TRIALS).open("a", encoding="utf-8") as file:
        file.write("0.7,1.0,\n")


def test_trials_of_another_search_are_not_taken(bowl, tmp_path):
    problem, _ = bowl
    SearchRecord(problem, tmp_path / "out")
    other = read_design(design(tmp_path, high=('high = "2 mm"', 'high = "3 mm"')))
    SearchRecord(other, tmp_path / "out")  # there are none
    with pytest.raises(DesignError, match="no trial in it"):
        trials_of(other, tmp_path / "out")
    tried(tmp_path / "out")
    assert len(SearchRecord(other, tmp_path / "out").trials) == 1
    with pytest.raises(DesignError, match="trials of another search"):
        SearchRecord(problem, tmp_path / "out")


def test_trials_are_of_what_a_file_of_the_case_held(tmp_path):
    """The sections or wheel of another file of the same name are another search."""
    wheel = tmp_path / "own.csv"
    path = design(tmp_path, own=("[pass.set]", f'[pass.set]\n"scene.wheel.profile" = "{wheel}"'))
    write(wheel)
    SearchRecord(read_design(path), tmp_path / "out")
    tried(tmp_path / "out")
    SearchRecord(read_design(path), tmp_path / "out")
    write(wheel, wheel_profile("S1002").points[::5])
    with pytest.raises(DesignError, match="trials of another search"):
        SearchRecord(read_design(path), tmp_path / "out")


def test_a_row_that_is_no_trial_is_told_with_its_line(bowl, tmp_path):
    problem, _ = bowl
    SearchRecord(problem, tmp_path / "out")
    kept = (tmp_path / "out" / TRIALS).read_text()
    for row in ("garbage", "0.5,1.0,2.0,", "\0\0\0", ""):
        (tmp_path / "out" / TRIALS).write_text(f"{kept}0.7,1.0,\n{row}\n")
        with pytest.raises(DesignError, match="line 4 is no trial"):
            SearchRecord(problem, tmp_path / "out")


def test_a_design_is_found_by_its_name_in_the_list_of_examples_and_a_misspelt_one_is_told():
    assert read_design("design/leg_and_nose").case.name == "whole_crossing.toml"
    with pytest.raises(
        DesignError, match="no such file, did you mean 'leg_and_nose.toml'.; beside it: casting.toml, leg"
    ):
        read_design(ROOT / "cases" / "design" / "leg_and_noze.toml")


def test_values_are_run_as_they_are_written(tmp_path):
    problem = read_design(design(tmp_path))
    value = rounded(np.array([0.123456789]))
    assert problem.changes(value) == {"scene.crossing.nose_lowering": "0.123457 mm"}


def test_the_start_is_the_case_and_unknown_where_the_case_has_no_such_table(tmp_path):
    assert read_design(design(tmp_path)).start_values == [0.0]
    bearers = (
        'key = "scene.crossing.nose_lowering"\nlow = "-1 mm"\nhigh = "2 mm"',
        'key = "scene.bearers.spacing"\nlow = "500 mm"\nhigh = "700 mm"',
    )
    assert np.isnan(read_design(design(tmp_path, change=bearers)).start_values).all()


def test_the_command_searches_with_a_light_model_and_reports(tmp_path):
    out = tmp_path / "out"
    done = call("design", design(tmp_path, trials=12), "--out", out, "--workers", "1")
    assert "12 trials asked for, 24 made: 2 generations of 12, two at least" in done.output
    assert "trials (seed 3)" in done.output and (out / "design.png").stat().st_size > 10_000
    assert re.search(
        r"impact on the wheel: lower in 1 of 1 passes, change -[\d.]+ %\.", (out / "design.md").read_text()
    )


CHECK = """
[[check]]
name = "as slow as 50 mph"
[check.set]
"scene.speed" = "50 mph"
"run.rigid_hertz.start" = "280 mm"
"run.rigid_hertz.end" = "420 mm"
"run.rigid_hertz.path_spacing" = "10 mm"
"""


def test_what_is_worse_in_a_pass_counts_more(tmp_path):
    start = np.array([100.0])
    even = read_design(design(tmp_path))
    strict = read_design(design(tmp_path, seed=("seed = 3", "seed = 3\nworse = 4")))
    for value, plain, weighted in ((80.0, 0.8, 0.8), (120.0, 1.2, 2.0)):
        assert even.score(np.array([value]), start) == pytest.approx(plain)
        assert strict.score(np.array([value]), start) == pytest.approx(weighted)


def test_keys_of_all_passes_stand_once_and_a_pass_s_own_go_before(tmp_path):
    common = 'set = { "scene.friction" = 0.2, "scene.speed" = "60 mph" }\nseed = 3'
    problem = read_design(design(tmp_path, seed=("seed = 3", common), extra=CHECK))
    (one,), (check,) = problem.design.passes, problem.design.checks
    assert one.set["scene.friction"] == 0.2 and one.set["scene.speed"] == "60 mph"
    assert check.set["scene.friction"] == 0.2 and check.set["scene.speed"] == "50 mph"
    trial = Trial(np.array([0.7]), np.array([1.0]), 1.0)
    words = shlex.split(command(problem, Found(trial, trial, [])))  # what runs the best has them, too
    assert words[-6::2] == ["--set"] * 3
    assert words[-5::2] == ["scene.friction=0.2", "scene.speed=60 mph", "scene.crossing.nose_lowering=0.7 mm"]


def test_a_guess_is_among_the_first_trials(bowl, tmp_path):
    guess = '[guess]\n"scene.crossing.nose_lowering" = "0.7 mm"\n[[vary]]'
    problem = read_design(design(tmp_path, trials=12, vary=("[[vary]]", guess)))
    found = search(problem, tmp_path / "guessed", HERE, lambda text: None)
    assert any(trial.values == 0.7 for trial in found.trials[:12])
    for old, new in (("0.7 mm", "3 mm"), ("nose_lowering", "wing_raise")):
        with pytest.raises(DesignError, match="guess"):
            read_design(design(tmp_path, vary=("[[vary]]", guess.replace(old, new))))


def test_shapes_are_apart_by_what_was_changed():
    """A topping line 1 mm lower takes 1 mm off the topped nose (up to 0.45 m), the wing nothing."""
    wing, nose = shape_difference(CastCrossing(), CastCrossing(nose_lowering=1e-3), 0.36, 0.45)
    assert nose.taken == pytest.approx(-1e-3, abs=1e-6) and nose.added == pytest.approx(0, abs=1e-6)
    assert wing.taken == pytest.approx(0, abs=1e-9) and wing.added == pytest.approx(0, abs=1e-9)
    place = re.fullmatch(r"-1.00 at x = (\d+), y = (-?\d+)", told(nose)[2])
    assert place and 360 <= int(place[1]) <= 450 and abs(int(place[2])) < 40
    assert told(nose)[1] == "none" and told(wing)[1:] == ["none", "none"]  # no place where nothing is
    assert told(shape_difference(CastCrossing(), CastCrossing(), -0.9, -0.8)[1])[1:] == ["-", "-"]


def test_shapes_and_bodies_are_those_of_a_pass_that_sets_a_table(tmp_path):
    """A joint of 10 mrad, of which 4 are taken: the rail is higher, and no wing rail."""
    joint = '"scene.crossing" = { family = "joint", dip_angle = "10 mrad" }'
    dip = {"key": ("nose_lowering", "dip_angle"), "low": ('"-1 mm"', '"1 mrad"'), "high": ('"2 mm"', '"12 mrad"')}
    path = design(tmp_path, **dip, end=('"420 mm"', '"600 mm"'), own=("[pass.set]", f"[pass.set]\n{joint}"))
    start = Trial(np.array([np.nan]), np.array([2.0]), 1.0)
    rail, nose = shape_differences(read_design(path), Found(start, replace(start, values=np.array([6.0])), []))
    assert (rail.body, nose.body) == ("rail", "rail at x > 0") and rail.added[0] > 1e-4


def test_checks_are_reported_and_not_searched_on(tmp_path):
    out = tmp_path / "out"
    path = design(tmp_path, trials=12, extra=CHECK)
    call("design", path, "--out", out, "--workers", "1")
    text = (out / "design.md").read_text()
    assert "as slow as 50 mph" in text and "of 2 passes" in text and "rail-fem run" in text
    assert "50 mph" not in (out / TRIALS).read_text() and (out / "design_forces.png").stat().st_size > 10_000
    twice = design(tmp_path, extra=CHECK.replace("as slow as 50", "75"))
    with pytest.raises(DesignError, match="stands twice"):
        read_design(twice)


@pytest.mark.parametrize(
    "old, new, complaint",
    [
        ('low = "-1 mm"', 'low = "3 mm"', "must lie below high"),
        ('low = "-1 mm"', 'low = "-1 kg"', "has the dimension"),
        ("impact on the wheel", "impact on the whel", "did you mean 'impact on the wheel'"),
        ("impact on the wheel", "first impact", "is not known, did you mean 'first impact on the"),
        ('"impact on the wheel"', '"impact on the wheel"\ntarget = "0 kN"', "target 0 kN: is counted by shares of it"),
        ('"impact on the wheel"', '"impact on the wheel"\ntarget = "1 mm"', "has the dimension"),
        ("seed = 3", 'model = "fe_full"', "is no light model"),
        ("seed = 3", "sed = 3", "sed: unknown key, did you mean 'seed'"),
        ("seed = 3", f"seed = {10**40}", "seed: 1(0)+.* must be less than or equal to 4294967295"),
        ("[[vary]]", '[proof]\n"run.fe_full.element_sise" = "4 mm"\n[[vary]]', "did you mean 'element_size'"),
        ("[[pass]]", "[[passes]]", "passes: unknown key, did you mean 'pass'"),
        ('low = "-1 mm"', "low = [1]", r"vary.0..low.*: .1. must be a valid number"),
        ("nose_lowering", "nose_lowerin", "did you mean 'nose_lowering'"),
        ("nose_lowering", "casting", "casting: is no physical quantity"),
        ('low = "-1 mm"', 'low = "-9 mm"', "nose_lowering: -9 mm is outside"),
        ('low = "-1 mm"\nhigh = "2 mm"', 'low = "-1 kg"\nhigh = "2 kg"', "nose_lowering: .*has the dimension"),
        ("nose_transfer.toml", "none.toml", None),
        ("trials = 20", "trials = 2", "greater than or equal to 10"),
        ('low = "-1 mm"', "low = -0.001", "1 input error.*\n.*-0.001 has no unit"),
        ("seed = 3", 'seed = 3\nset = { "scene.crossing.nose_lowering" = "1 mm" }', "is set by every pass"),
        ("[pass.set]", "proven = false\n[pass.set]", "proven = false in every pass"),
    ],
)
def test_a_design_that_cannot_be_searched_is_refused(tmp_path, old, new, complaint):
    path = design(tmp_path, change=(old, new))
    call("design", path, "--out", tmp_path / "out", "--workers", "1", code=2)
    if complaint is not None:  # else it is refused by the case itself
        with pytest.raises((DesignError, CaseError), match=complaint):
            read_design(path)


def test_a_folder_holds_one_search_at_a_time(tmp_path):
    """Two at once wrote each trial twice."""
    path, out = design(tmp_path), tmp_path / "found"
    with held(out):
        refused = call("design", path, "--out", out, "--workers", "1", code=2)
    assert "runs there: wait until it ends" in " ".join(refused.output.split())
    assert not (out / TRIALS).exists()
