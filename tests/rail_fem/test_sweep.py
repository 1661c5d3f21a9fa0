"""Sweeps: a faulty case is told of and passed over, a second start goes on, another case's result is never mixed in."""

import contextlib
import functools
import json
import os
import shlex
import signal
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rail_fem.case.casefile import load_case
from rail_fem.case.estimate import BYTES_LIGHT, estimate_run
from rail_fem.case.preflight import preflight_errors
from rail_fem.fe.card import device
from rail_fem.fe.card.fits import room_on_card
from rail_fem.hierarchy import MODELS
from rail_fem.processes.pool import Workers, executor
from rail_fem.result.result import PassResult, load
from rail_fem.result.runfolder import held
from rail_fem.sweeps.array import table_so_far
from rail_fem.sweeps.compare import compare
from rail_fem.sweeps.sweep import ELSEWHERE, FINISHED, SKIPPED, at_a_time, jobs_of, run_job
from rail_fem.sweeps.sweep_page import trust_lines
from rail_fem.sweeps.sweep_report import force_table
from tests.commands import call

pytestmark = pytest.mark.usefixtures("undrawn")
ROOT = Path(__file__).resolve().parents[2]
SETTINGS = """
from rail_fem.fe import compat
import ffcx
from petsc4py import PETSc
read = lambda module: getattr(module, "get_options", None) or module.get_parameters
print(PETSc.Options().getAll(), read(compat.jit)(), read(ffcx)())
"""
CASE = (ROOT / "cases" / "thesis" / "case_02.toml").read_text()


@pytest.fixture
def cases(tmp_path):
    """A good case, one with an unknown key, one whose window lies off the crossing, in this order."""
    short = CASE.split("[run.p2_formula]")[0] + '[run.lumped]\nstart = "300 mm"\nend = "400 mm"\n'
    (tmp_path / "good.toml").write_text(short + "\n[run.p2_formula]\n")
    (tmp_path / "faulty.toml").write_text(short.replace("speed =", "sped ="))
    (tmp_path / "outside.toml").write_text(short.replace('"400 mm"', '"2900 mm"'))
    return [tmp_path / f"{name}.toml" for name in ("faulty", "outside", "good")]


sweep = functools.partial(call, "sweep")


@pytest.mark.parametrize("workers", [1, 2])
def test_faults_do_not_stop_a_sweep_and_a_second_start_passes_over_what_is_done(cases, tmp_path, workers):
    out = tmp_path / "out"
    words = " ".join(sweep(*cases, "--out", out, "--workers", workers, code=1).output.split())
    assert words.index("left out:") < words.index("[1/3]") and "scene.sped: unknown key" in words
    assert "outside lumped: FAILED" in words and "1 run(s) failed, 1 case file(s) left out" in words
    assert load(out / "good" / "lumped").peaks["largest_force"].value > 86e3
    assert " (P2) | " in (out / "sweep.md").read_text(encoding="utf-8")
    before = (out / "good" / "lumped" / "result.json").stat().st_mtime_ns
    assert "good lumped: finished before" in sweep(*cases, "--out", out, code=1).output
    assert (out / "good" / "lumped" / "result.json").stat().st_mtime_ns == before
    assert set(compare([out / "good"]).names) == {"p2_formula", "lumped"}


def test_what_another_sweep_is_running_is_left_to_it(cases, tmp_path):
    """Two machines may be given one sweep and one folder."""
    out = tmp_path / "out"
    with held(out / "good" / "lumped"):
        found = sweep(cases[-1], "--out", out)
    words = " ".join(found.output.split())
    assert f"good lumped: left to another sweep in 0.0 s: process {os.getpid()} on" in words
    assert "0 run(s) failed, 1 left to another sweep" in words and load(out / "good" / "p2_formula").peaks
    assert "good lumped: finished in" in sweep(cases[-1], "--out", out).output


def test_of_two_sweeps_that_begin_a_run_at_once_none_tells_of_a_failure(cases, tmp_path):
    """Both have seen a free folder; one gets it."""
    jobs = jobs_of([load_case(cases[-1]).by("p2_formula")] * 40, tmp_path / "out", ["p2_formula"])
    jobs = [replace(job, folder=job.folder.with_name(str(number))) for number, job in enumerate(jobs)]
    together = threading.Barrier(2)

    def begin(job):
        together.wait()
        return run_job(job, 1)

    with ThreadPoolExecutor(2) as both:
        found = [outcome for job in jobs for outcome in both.map(begin, [job, job])]
    assert {outcome.state for outcome in found} <= {FINISHED, SKIPPED, ELSEWHERE}, {one.reason for one in found}


def test_a_job_array_has_a_task_for_each_case_and_its_tasks_do_the_sweep(cases, tmp_path):
    """Each task run as a queue would; then the table says so, and the sweep itself has nothing left to do."""
    out = tmp_path / "all out"
    words = [cases[2], "--vary", "scene.speed=40mph,50mph,60mph", "--set", "scene.friction=0.2", "--out", out]
    for queue, length in (("slurm", "#SBATCH --array=1-3\n"), ("pbs", "#PBS -J 1-3\n")):
        sweep(*words, "--array", queue, "--time-limit", "2 h")
        script = (out / "array.sh").read_text()
        assert length in script and "05:00:00" in script  # two models a case
        assert f"'{out}'/array-" in script
        assert subprocess.run(["bash", "-n", out / "array.sh"]).returncode == 0
    assert not list(out.glob("*/*/result.json"))
    task = script[script.index("exec ") :].replace('"$PBS_ARRAY_INDEX"', "{}")
    for number in (1, 2, 3):
        own = shlex.split(task.format(number))[4:]
        assert own[1] == "sweep"
        sweep(*own[2:])
        followed = table_so_far(out, {})
        assert followed[0][0].startswith(f"6 tasks: {2 * number} finished") and followed[1] == 6 - 2 * number
    assert call("show", out, "--follow").output.count("largest force") >= 3
    assert sweep(*words).output.count("finished before") == 6


def test_no_more_runs_at_a_time_than_memory_and_cores_hold(cases, tmp_path, monkeypatch):
    monkeypatch.setattr("rail_fem.sweeps.sweep.available_memory", lambda: 2.5 * BYTES_LIGHT)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: range(8))
    jobs = jobs_of([load_case(cases[2])], tmp_path)
    fewer, why = at_a_time(jobs[:1], 2, Workers(6))
    assert fewer.count == 2 and "2 at a time in place of 6: each needs 0.22 GB and 1 core(s), 0.55 GB" in why
    assert at_a_time(jobs[:1], 2, Workers(2)) == (Workers(2), "")
    assert at_a_time(jobs[:1], 2, Workers(6, "dask:Pool")) == (Workers(6, "dask:Pool"), "")


def test_no_more_runs_at_a_time_than_a_card_holds(tmp_path, monkeypatch):
    """Of workers that share a card, as many as there is room for on it, however much memory and cores there are."""
    case = load_case("nose_transfer", {"run.fe_full.device": "cuda"})
    jobs = jobs_of([case], tmp_path, ["fe_full"])
    asked = case.scene, case.runs["fe_full"]
    each = room_on_card(estimate_run(*asked).cells, *asked)
    card = device.CardFacts("one", (9, 0), "13.0", 8, int(2.5 * each))
    monkeypatch.setattr("rail_fem.sweeps.sweep.available_memory", lambda: 1e12)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: range(8))
    monkeypatch.setattr(device, "missing", lambda: "")
    monkeypatch.setattr(device, "card_facts", lambda: card)
    fewer, why = at_a_time(jobs, 1, Workers(6))
    assert fewer.count == 2 and why.startswith("2 at a time in place of 6: each needs") and why.endswith("of the card")
    assert at_a_time(jobs, 1, Workers(2)) == (Workers(2), "")


@pytest.fixture
def running(monkeypatch):
    """The executors of this program's pool that were made."""
    made = []

    def make(*given):
        made.append(executor(*given))
        return made[-1]

    monkeypatch.setattr("rail_fem.processes.pool.executor", make)
    return made


def kill_at_random(running, kills, rng, over):
    """As many workers as asked for, one after the other, each after a time by chance."""
    while over.done < kills and not over.wait(rng.exponential(0.6)):
        workers = [pid for one in running[-1:] for pid in list(one._processes or ())]
        if workers:
            with contextlib.suppress(ProcessLookupError):
                os.kill(int(rng.choice(workers)), signal.SIGKILL)
                over.done += 1


@pytest.mark.parametrize("kills", [3, pytest.param(50, marks=pytest.mark.validate)])
def test_workers_that_are_killed_at_random_cost_no_result_a_bit(cases, tmp_path, running, kills):
    """Sweeps again and again until so many workers have died, against a calm one: histories bit by bit. More tries than
    kills: a slow machine starts no worker between two of them."""
    speeds = "scene.speed=" + ",".join(f"{speed}mph" for speed in range(40, 64))
    words = [cases[2], "--vary", speeds, "--model", "lumped", "--out"]
    sweep(*words, tmp_path / "calm")
    calm = {path.parent.parent.name: load(path.parent) for path in (tmp_path / "calm").glob("*/*/result.json")}
    assert len(calm) == 24
    rng, died, number = np.random.default_rng(kills), 0, 0
    while died < kills:
        over, number = threading.Event(), number + 1
        over.done = 0
        killer = threading.Thread(target=kill_at_random, args=(running, kills - died, rng, over), daemon=True)
        killer.start()
        sweep(*words, tmp_path / str(number), "--workers", 2, "--tries", kills + 1)
        over.set()
        killer.join()
        died += over.done
        for name, expected in calm.items():
            own = load(tmp_path / str(number) / name / "lumped")
            assert repr(own.peaks) == repr(expected.peaks)  # y is NaN, which from Python 3.13 on equals nothing here
            assert all(np.array_equal(own.history[key], expected.history[key], equal_nan=True) for key in own.history)


def test_a_killed_job_is_done_again(cases, tmp_path):
    """A kill leaves the mark and the status of the run, but no result."""
    out = tmp_path / "out"
    sweep(cases[2], "--out", out, "--model", "lumped")
    (out / "good" / "lumped" / "result.json").unlink()
    again = sweep(cases[2], "--out", out, "--model", "lumped")
    assert "good lumped: finished in" in again.output and (out / "good" / "lumped" / "result.json").is_file()


@pytest.mark.skipif(sys.platform != "linux", reason="the death signal is Linux'")
def test_a_killed_sweep_takes_its_run_with_it():
    """Or the run would go on writing into the folder that the next sweep goes on in."""
    program = (
        "import os, sys; from rail_fem.sweeps.sweep import run_bound; run_bound([sys.executable, '-c', 'import os,"
        " time; print(os.getpid(), flush=True); time.sleep(3600)'], sys.stdout, os.environ)"
    )
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True, cwd=ROOT) as parent:
        child = int(parent.stdout.readline())
        os.kill(child, 0)  # it lives
        parent.kill()
        parent.wait()
        try:
            parent.communicate(timeout=60)  # ends with the child, which holds the pipe as long as it lives
        except subprocess.TimeoutExpired:
            os.kill(child, signal.SIGKILL)
            raise


def test_results_of_an_older_scene_are_named_and_kept_apart(cases, tmp_path):
    out = tmp_path / "out"
    sweep(cases[2], "--out", out, "--model", "lumped")
    mark = out / "good" / "lumped" / "case.json"
    held = json.loads(mark.read_text())
    held["scene"]["speed"] = 20.0
    mark.write_text(json.dumps(held))
    words = " ".join(sweep(cases[2], "--out", out, code=1).output.split())
    assert "holds the result of another case or of an older version of it: scene.speed: 20 there" in words
    assert "good p2_formula: finished in" in words


def test_arguments_that_cannot_be(cases, tmp_path):
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "good.toml").write_text(cases[2].read_text())
    for arguments, words in [
        ((cases[2], tmp_path / "b" / "good.toml"), "would share a folder: good"),
        ((cases[2], "--only", "2"), "there are 1 case(s)"),
        ((cases[2], "--model", "guess"), "no such model"),
    ]:
        assert words in " ".join(sweep(*arguments, "--out", tmp_path / "out", code=2).output.split())
    assert not (tmp_path / "out").exists()
    sweep(*cases, "--only", "3", "--out", tmp_path / "out", "--model", "p2_formula")


def test_a_sweep_runs_a_model_that_no_case_names_by_its_defaults_and_refuses_to_run_nothing(tmp_path):
    """Over the path of the models that it names: the shipped examples name one, and a life study none."""
    done = sweep(ROOT / "cases" / "nose_transfer.toml", "--model", "p2_formula", "--out", tmp_path / "out")
    assert "has no [run.p2_formula], p2_formula runs by its defaults" in done.output
    assert load(tmp_path / "out" / "nose_transfer" / "p2_formula").peaks
    whole = load_case("whole_crossing")
    ends = lambda case, model: (case.runs[model].start, case.runs[model].end)
    for name in set(MODELS) - {"p2_formula", "fe_window"}:
        assert ends(whole.by(name), name) == ends(whole, "fe_full"), name
    nothing = sweep(ROOT / "cases" / "damage" / "switch_section.toml", "--out", tmp_path / "none", code=2)
    assert "name models with --model" in " ".join(nothing.output.split())
    assert not (tmp_path / "none").exists()


def test_a_scene_that_one_of_its_models_does_not_take_runs_by_the_others(tmp_path):
    """A wheel that vibrates is not handed over to a window: [run.fe_window] of the same file is refused as it runs."""
    text = CASE.split("[run.p2_formula]")[0] + "[scene.wheel_body]\n[run.p2_formula]\n[run.fe_window]\n"
    text += '[run.lumped]\nstart = "300 mm"\nend = "400 mm"\n'
    (tmp_path / "soft.toml").write_text(text)
    case = load_case(tmp_path / "soft.toml")
    assert case.by("lumped") is case
    assert "scene.wheel_body is for lumped" in preflight_errors(case.scene, case.runs["fe_window"], 1, "fe_window")[0]
    sweep(tmp_path / "soft.toml", "--model", "lumped", "--out", tmp_path / "out")
    refused = sweep(tmp_path / "soft.toml", "--model", "fe_window", "--out", tmp_path / "out", code=1)
    assert "FAILED in 0.0 s: scene.wheel_body is for lumped" in " ".join(refused.output.split())


def test_no_child_reads_code_or_settings_from_the_current_folder(cases, tmp_path, monkeypatch):
    """Modules of the names of libraries; what tells PETSc and dolfinx's compiler of forms which libraries to load."""
    pytest.importorskip("dolfinx")
    commands = []
    monkeypatch.setattr("rail_fem.sweeps.sweep.run_bound", lambda command, *rest: commands.append(command) or 0)
    with cases[2].open("a") as stream:
        stream.write('\n[run.fe_full]\nelement_size = "6 mm"\nstart = "300 mm"\nend = "420 mm"\n')
    sweep(cases[2], "--out", tmp_path / "out", "--model", "fe_full", code=1)  # there is no result
    for name in ("pint", "random", "rail_fem", "mpi4py"):
        (tmp_path / f"{name}.py").write_text(f'raise SystemExit("{name}.py of the current folder")')
    python = commands[0][commands[0].index(sys.executable) : commands[0].index("rail_fem") + 1]
    run = functools.partial(subprocess.run, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert run([*python, "check", cases[2], "--model", "fe_full"]).returncode == 0
    (tmp_path / ".petscrc").write_text("-told 1\n")
    for name in ("options", "parameters"):
        (tmp_path / f"dolfinx_jit_{name}.json").write_text('{"cache_dir": "told"}')
        (tmp_path / f"ffcx_{name}.json").write_text('{"scalar_type": "told"}')
    answer = run([sys.executable, "-P", "-c", SETTINGS])
    assert answer.returncode == 0 and "{" in answer.stdout and "told" not in answer.stdout, answer.stderr


@pytest.mark.validate
def test_the_explicit_model_of_a_sweep_runs_under_mpirun(cases, tmp_path, monkeypatch):
    pytest.importorskip("dolfinx")
    monkeypatch.setenv("RAIL_FEM_SMOKE", "1")
    with cases[2].open("a") as stream:
        stream.write('\n[run.fe_full]\nelement_size = "6 mm"\nstart = "300 mm"\nend = "420 mm"\n')
    sweep(cases[2], "--out", tmp_path / "out", "--model", "fe_full", "--ranks", "2")
    assert load(tmp_path / "out" / "good" / "fe_full").cost.ranks == 2


def test_the_table_marks_other_element_sizes_and_shows_what_fails_of_the_trust_report():
    """Three runs at 4 mm and one at 2 mm, which alone meets its rules."""
    row = lambda name, verdict: {
        "name": name,
        "verdict": verdict,
        "short": "6.4%",
        "value": 0.064,
        "shown": "",
        "rule": "",
        "limit": 0.05,
    }
    scene = load_case("nose_transfer").scene
    made = lambda size, verdict: PassResult(
        "fe_full",
        scene,
        {"element_size": size},
        {"time": [], "x": []},
        trust={"rows": [row("hourglass energy", verdict), row("chatter", "good")]},
    )
    results = {f"case_{i}": {"fe_full": made(4e-3, "warning")} for i in range(3)} | {
        "fine": {"fe_full": made(2e-3, "good")}
    }
    table = {line.split(" | ")[0].strip("| "): line for line in force_table(results)[2:]}
    assert table["case_1"].endswith("| 4 | 1 of 2 rows fail: hourglass energy 6.4% |") and table["fine"].endswith(
        "| **2** | good |"
    )
    assert (
        "Of 4 explicit runs, 3 fail rows of their own trust report: hourglass energy in 3." in trust_lines(results)[0]
    )
    assert trust_lines({"a": {"lumped": PassResult("lumped", scene, {}, {"time": [], "x": []})}}) == []
