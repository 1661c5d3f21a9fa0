"""The command line from case file to saved folder, with a toy model in place of the FE model."""

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from rail_fem import hierarchy
from rail_fem.case import estimate
from rail_fem.processes.progress import read_status
from rail_fem.result.result import load
from rail_fem.run import job
from rail_fem.scene.scene import GRAVITY
from tests.commands import call
from tests.rail_fem.toy_model import ToySettings
from tests.ranks import run_on_ranks

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def drawn_case(tmp_path, monkeypatch):
    """A case of the toy model; its runs draw their figures."""
    monkeypatch.setitem(
        hierarchy.MODELS, "toy", hierarchy.Model("tests.rail_fem.toy_model", ToySettings, False, "a mass on a spring")
    )
    monkeypatch.delenv("RAIL_FEM_SMOKE", raising=False)
    text = (ROOT / "cases" / "nose_transfer.toml").read_text().partition("[run.fe_full]")[0] + "[run.toy]\n"
    path = tmp_path / "case.toml"
    path.write_text(text)
    return path


@pytest.fixture
def case(drawn_case, undrawn):
    return drawn_case


def test_run_leaves_history_result_and_status_in_the_folder(drawn_case, tmp_path):
    out = tmp_path / "out"
    answer = call("run", drawn_case, "--out", out)
    assert {"case.json", "history.csv", "history.npz", "result.json", "status.json"} <= {
        path.name for path in out.iterdir()
    }
    result = load(out)
    mass, stiffness = result.scene.vehicle.wheel_unsprung_mass, result.scene.foundation.stiffness
    exact = mass * GRAVITY * (1 - np.cos(np.sqrt(stiffness / mass) * result.history["time"]))
    # semi-implicit Euler is first order: step * omega = 0.1
    assert np.abs(result.history["force"] - exact).max() < 0.1 * exact.max()
    assert read_status(out)["state"] == "finished"
    assert "peaks" in answer.output and "finished" in call("show", out).output


def test_second_run_into_the_same_folder_is_refused_and_changes_nothing(case, tmp_path):
    out = tmp_path / "out"
    call("run", case, "--out", out)
    before = {path.relative_to(out): path.read_bytes() for path in out.rglob("*") if path.is_file()}
    assert "--overwrite begins again" in call("run", case, "--out", out, code=2).stderr
    assert {path.relative_to(out): path.read_bytes() for path in out.rglob("*") if path.is_file()} == before
    call("run", case, "--out", out, "--overwrite")


def test_a_run_that_max_steps_ends_is_not_called_finished_and_goes_on(case, tmp_path):
    out, text = tmp_path / "out", case.read_text()
    case.write_text(text + "max_steps = 7\n")
    answer = call("run", case, "--out", out)
    assert "CUT OFF: max_steps = 7 ended it" in answer.output and "finished" not in answer.output
    status = read_status(out)
    assert status["state"] == "cut off" and status["percent"] < 100 and "--restart goes on" in status["message"]
    assert load(out).cut_off and "CUT OFF" in call("show", out).output
    case.write_text(text)
    call("run", case, "--out", out, "--restart")
    assert read_status(out)["state"] == "finished" and not load(out).cut_off


@pytest.mark.parametrize("taken", [False, True])
def test_a_folder_that_went_away_while_it_ran_gets_no_half_result(case, tmp_path, monkeypatch, taken):
    """Removed, or made again by another run, which has it then."""
    out, solve = tmp_path / "out", hierarchy.solve

    def removed_meanwhile(*asked, **named):
        result = solve(*asked, **named)
        shutil.rmtree(out)
        if taken:
            out.mkdir()
            (out / "run.lock").write_text(json.dumps({"host": "elsewhere", "pid": 1, "began": None}))
        return result

    monkeypatch.setattr(hierarchy, "solve", removed_meanwhile)
    assert "was removed or emptied while the run went on" in call("run", case, "--out", out, code=1).stderr
    assert not any(path.suffix in (".npz", ".csv") or path.name == "result.json" for path in tmp_path.glob("out/*"))


def test_figure_that_cannot_be_drawn_does_not_cost_the_run(case, tmp_path, monkeypatch):
    def fail(*asked):
        raise IndexError("an empty axis")

    monkeypatch.setattr(job, "draw_run", fail)
    assert "no figures: IndexError: an empty axis" in call("run", case, "--out", tmp_path / "out").output
    assert read_status(tmp_path / "out")["state"] == "finished" and load(tmp_path / "out").history["force"].size


def test_restart_after_a_fault_gives_the_same_answer_bit_for_bit(case, tmp_path, monkeypatch):
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    call("run", case, "--out", whole)
    monkeypatch.setenv("TOY_FAULT", "20")
    assert "unstable at step 20, x = 0.095 m" in call("run", case, "--out", cut, code=1).stderr
    assert "ArithmeticError" in (cut / "traceback.0.txt").read_text() and read_status(cut)["state"] == "failed"
    assert "unstable at step 20" in read_status(cut)["message"] and "failed" in call("show", cut).output
    monkeypatch.delenv("TOY_FAULT")
    call("run", case, "--out", cut, "--restart")
    for name, values in load(whole).history.items():
        np.testing.assert_array_equal(load(cut).history[name], values)


def everything(folder):
    """Names, contents and times of all files."""
    return {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in sorted(folder.rglob("*")) if path.is_file()}


def test_restart_of_a_finished_run_changes_nothing_but_missing_figures(drawn_case, tmp_path):
    out = tmp_path / "out"
    call("run", drawn_case, "--out", out)
    (out / "figures" / "force.png").unlink()
    before = everything(out)
    assert f"{out}: finished already" in call("run", drawn_case, "--out", out, "--restart").output
    after = everything(out)
    assert set(after) - set(before) == {out / "figures" / "force.png"}
    changed = {path.name for path in before if after[path] != before[path]}
    assert changed == {"case.json"} and after[out / "case.json"][0] == before[out / "case.json"][0]


def test_run_killed_while_it_drew_is_finished_by_a_restart(case, tmp_path):
    out = tmp_path / "out"
    call("run", case, "--out", out)
    result = (out / "result.json").read_bytes()
    (out / "status.json").write_text(
        (out / "status.json").read_text().replace("finished", "running").replace(str(os.getpid()), "1")
    )
    assert "finished already" in call("run", case, "--out", out, "--restart").output
    assert read_status(out)["state"] == "finished" and (out / "result.json").read_bytes() == result


def test_a_number_changed_by_hand_is_not_shown_as_the_runs(case, tmp_path):
    """Nor a history of another run."""
    out = tmp_path / "out"
    call("run", case, "--out", out)
    summary = json.loads((out / "result.json").read_text())
    summary["peaks"]["largest_force"] = {"value": 999e3, "unit": "N"}
    (out / "result.json").write_text(json.dumps(summary))
    answer = call("show", out, code=2)
    assert "was changed after the run had written it" in answer.stderr
    assert "999" not in answer.output
    assert "--restart writes them again" in answer.stderr
    call("run", case, "--out", out, "--restart")
    assert "largest_force" not in load(out).peaks
    history = dict(load(out).history)
    np.savez_compressed(out / "history.npz", **history | {"force": 2 * history["force"]})
    with pytest.raises(ValueError, match="history.npz was changed"):
        load(out)


@pytest.mark.parametrize("name", ["result.json", "history.npz"])
@pytest.mark.parametrize(
    "damage", [lambda data: b"", lambda data: data[: len(data) // 2], lambda data: b"[]", lambda data: bytes(len(data))]
)
def test_damaged_result_is_named_by_show_and_written_again_by_restart(case, tmp_path, name, damage):
    out = tmp_path / "out"
    call("run", case, "--out", out)
    whole = load(out)
    (out / name).write_bytes(damage((out / name).read_bytes()))
    answer = call("show", out, code=2)
    assert "result.json or history.npz is damaged" in answer.stderr and "--restart writes them again" in answer.stderr
    call("run", case, "--out", out, "--restart")
    assert all(
        np.array_equal(load(out).history[name], values, equal_nan=True) for name, values in whole.history.items()
    )


def test_more_steps_than_before_are_no_finished_run(case, tmp_path):
    out, text = tmp_path / "out", case.read_text()
    case.write_text(text + "max_steps = 15\n")
    call("run", case, "--out", out)
    assert len(load(out).history["time"]) == 15
    case.write_text(text + "max_steps = 25\n")
    assert "finished already" not in call("run", case, "--out", out, "--restart").output
    assert len(load(out).history["time"]) == 25


def test_show_reads_only_when_asked_and_draws_only_what_is_missing(drawn_case, tmp_path):
    out = tmp_path / "out"
    call("run", drawn_case, "--out", out)
    (out / "figures" / "force.png").unlink()
    before = everything(out)
    call("show", out, "--figures", "none")
    assert everything(out) == before
    assert "force.png" in call("show", out).output
    once = everything(out)
    assert set(once) - set(before) == {out / "figures" / "force.png"}
    call("show", out)
    assert everything(out) == once
    call("show", out, "--figures", "anew")
    assert everything(out)[out / "figures" / "force.png"][1] != once[out / "figures" / "force.png"][1]


def test_show_lists_the_runs_below_a_folder(case, tmp_path):
    call("run", case, "--out", tmp_path / "sweep" / "toy")
    answer = call("show", tmp_path / "sweep")
    assert "1 run(s) below" in answer.output and "sweep/toy: toy: finished" in answer.output


def test_failed_result_is_saved_and_ends_non_zero(case, tmp_path, monkeypatch):
    monkeypatch.setenv("TOY_RESULT_FAULT", "unstable at x = 0.3 m")
    assert "unstable at x = 0.3 m" in call("run", case, "--out", tmp_path / "out", code=1).stderr
    assert (
        load(tmp_path / "out").fault == "unstable at x = 0.3 m" and read_status(tmp_path / "out")["state"] == "failed"
    )


def test_smoke_takes_few_steps(case, tmp_path, monkeypatch):
    monkeypatch.setenv("RAIL_FEM_SMOKE", "1")
    assert "no meaning" in call("run", case, "--out", tmp_path / "out").output
    assert load(tmp_path / "out").cost.steps == 10


@pytest.mark.parametrize("command", [["check"], ["run", "--out", "OUT"]])
def test_faulty_case_ends_non_zero_before_anything_is_written(case, tmp_path, command):
    case.write_text(case.read_text().replace("speed =", "sped ="))
    out = tmp_path / "out"
    answer = call(command[0], case, *(str(out) if word == "OUT" else word for word in command[1:]), code=2)
    assert "scene.sped: unknown key, did you mean 'speed'?" in answer.stderr
    assert not out.exists()


@pytest.mark.parametrize("command", [["check"], ["run", "--out", "OUT"]])
def test_size_that_needs_more_memory_than_there_is_says_how_much(case, tmp_path, monkeypatch, command):
    monkeypatch.setattr(estimate, "available_memory", lambda: 4e9)
    case.write_text(case.read_text() + 'element_size = "0.1 mm"\n')
    out = tmp_path / "out"
    answer = call(command[0], case, *(str(out) if word == "OUT" else word for word in command[1:]), code=2)
    assert not out.exists()
    assert (
        "run.toy.element_size: 0.1 mm makes about" in answer.stderr
        and "4 GB are free" in answer.stderr
        and "fits" in answer.stderr
    )


@pytest.mark.parametrize("command", [["check"], ["run", "--out", "OUT"]])
def test_cells_of_a_plastic_half_space_that_need_too_much_are_refused_before_anything_is_rolled(tmp_path, command):
    out = tmp_path / "out"
    words = [str(out) if word == "OUT" else word for word in command[1:]]
    finest = ("--model", "bem_plastic", "--set", "run.bem_plastic.cell_size=0.1 mm")
    answer = call(command[0], ROOT / "cases" / "nose_transfer.toml", *words, *finest, code=2)
    assert not out.exists()
    assert "run.bem_plastic.cell_size: 0.1 mm:" in answer.stderr and "take larger cells" in answer.stderr


@pytest.mark.parametrize("window, said", [('start = "900 mm"\nend = "1400 mm"', "leaves the modelled crossing")])
def test_window_that_leaves_the_crossing_is_refused_before_meshing(case, tmp_path, window, said):
    case.write_text(case.read_text() + window)
    answer = call("run", case, "--out", tmp_path / "out", code=2)
    assert "run.toy.start, end:" in answer.stderr and said in answer.stderr and not (tmp_path / "out").exists()


def test_window_without_a_load_transfer_is_doubted(case):
    case.write_text(case.read_text() + 'start = "-300 mm"\nend = "0 mm"\n')
    assert "a rigid wheel stays on the wing" in call("check", case).output


def test_case_with_several_models_asks_which(case):
    case.write_text(case.read_text() + "[run.fe_full]\n")
    assert "choose one with --model" in call("check", case, code=2).stderr
    call("check", case, "--model", "toy")
    assert "--model other: no such model" in call("check", case, "--model", "other", code=2).stderr


def test_check_shows_units_derived_numbers_cost_and_warnings(case, tmp_path):
    answer = call("check", case)
    for words in (
        "75 mph",
        "66.25 t",
        "160 kN/mm",
        "static wheel load",
        "86.144 kN",
        "rigid wheel changes body at",
        "cells",
        "steps",
        "memory",
        "wall time",
        "is a surrogate",
    ):
        assert words in answer.output, words
    flexible = call("check", case, "--set", "scene.wheel_body={}").output
    assert "the wheel condensed" in flexible and "the wheel condensed" not in answer.output
    deep = call("check", ROOT / "cases" / "nose_transfer.toml", "--set", "run.fe_full.foot_depth=400 mm").output
    assert (
        "the casting condensed" in deep and "foot_depth 400 mm: to 70, 4" in deep and "condensed" not in answer.output
    )
    assert sorted(path.name for path in tmp_path.iterdir()) == ["case.toml"]


def test_missing_library_of_a_model_is_a_sentence(case, tmp_path, monkeypatch):
    broken = tmp_path / "model_without_library.py"
    broken.write_text("import library_that_is_not_there\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(hierarchy.MODELS, "toy", hierarchy.Model("model_without_library", ToySettings, False, ""))
    answer = call("run", case, "--out", tmp_path / "out", code=2)
    assert "needs library_that_is_not_there" in answer.stderr and "./setup.sh" in answer.stderr
    assert not (tmp_path / "out").exists()


def test_show_of_a_folder_without_a_run_says_so(tmp_path):
    assert "neither a result nor a run" in call("show", tmp_path, code=2).stderr


ON_RANKS = """
import sys
from rail_fem import cli, hierarchy
from tests.rail_fem.toy_model import ToySettings
toy = "a mass on a spring, the same on every rank"
hierarchy.MODELS["toy"] = hierarchy.Model("tests.rail_fem.toy_model", ToySettings, True, toy)
sys.argv = ["rail-fem", *sys.argv[1:]]
cli.main()
"""


def call_on_ranks(ranks, *arguments, **variables):
    return run_on_ranks(ranks, "-c", ON_RANKS, *arguments, **variables)


@pytest.mark.mpi
def test_two_ranks_write_one_folder_and_refuse_it_with_one_voice(case, tmp_path):
    out = tmp_path / "out"
    answer = call_on_ranks(2, "run", case, "--out", out, RAIL_FEM_SMOKE="1")
    assert answer.returncode == 0, answer.stderr
    assert (
        answer.stdout.count("peaks") == 1
        and load(out).history["time"].size > 0
        and read_status(out)["state"] == "finished"
    )
    again = call_on_ranks(2, "run", case, "--out", out, RAIL_FEM_SMOKE="1")
    assert (
        again.returncode == 2
        and again.stderr.count("--overwrite begins again") == 1
        and "MPI_ABORT" not in again.stderr
    )


@pytest.mark.mpi
@pytest.mark.parametrize("guilty", [pytest.param("0", marks=pytest.mark.validate), "1"])
def test_fault_of_any_rank_ends_the_job_and_is_heard(case, tmp_path, guilty):
    answer = call_on_ranks(2, "run", case, "--out", tmp_path / "out", TOY_FAULT="20", TOY_RANK=guilty)
    assert answer.returncode != 0 and "unstable at step 20" in answer.stderr
    assert (tmp_path / "out" / f"traceback.{guilty}.txt").is_file()
    assert read_status(tmp_path / "out")["state"] == "failed"


def test_mark_in_the_folder_holds_the_case(case, tmp_path):
    call("run", case, "--out", tmp_path / "out")
    assert json.loads((tmp_path / "out" / "case.json").read_text())["scene"]["speed"] == pytest.approx(33.528)
