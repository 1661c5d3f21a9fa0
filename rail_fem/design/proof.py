"""The start and the best trials by the explicit model: whether what a search on a light model has found is so.

Each pass of each shape is a run in a folder of its own, OUT/proof/SIZE/SHAPE/PASS/fe_full, made as a sweep makes it:
one that is finished is passed over, one that was stopped or killed goes on, one that fails is told of by name.
"""

import contextlib
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from rail_fem.case.casefile import CaseError, load_case
from rail_fem.case.preflight import preflight_errors
from rail_fem.design.problem import RECORDED_BY, DesignError, Pass, Problem
from rail_fem.design.search import Found, Trial
from rail_fem.processes.pool import Lost, Workers, each
from rail_fem.processes.progress import duration, read_status
from rail_fem.result.quantities import BODIES
from rail_fem.result.result import PassResult, load
from rail_fem.settings.explicit import FeSettings
from rail_fem.sweeps.sweep import Job, Outcome, run_job
from rail_fem.sweeps.trends import MEASURES, Measure, measure_of

MODEL = "fe_full"
SIZE, TWIN = (f"run.{MODEL}.{key}" for key in ("element_size", "error_twin"))
LONGEST_REASON = 200  # characters
PROVEN: dict[str, Measure] = {
    "impact on the wheel": MEASURES["impact on the wheel"],
    **{name: MEASURES[f"largest {name}"] for name in ("leg force", "wing force", "nose force")},
    "longest flight": MEASURES["longest flight"],
    **{
        f"PEEQ {words} of {body}": measure_of(f"{name}_{body}")
        for body in reversed(BODIES)
        for name, words in (("block", "worst 5 x 5 x 3 mm"), ("integral", "integral"))
    },
}
SEARCHED = {"leg force": "largest leg force", "wing force": "largest wing force", "nose force": "largest nose force"}
SEARCHED |= {name: name for name in ("impact on the wheel", "longest flight")}  # name here -> quantity of a design


@dataclass(frozen=True)
class ProvenShape:
    """A crossing that is proven: the name of its folder, what it is called, and its trial."""

    name: str
    words: str
    trial: Trial

    @property
    def values(self) -> np.ndarray | None:
        """Of the design's variables; None for the case as it is."""
        return None if np.isnan(self.trial.values).all() else self.trial.values


@dataclass(frozen=True)
class ProofRun:
    """One pass of one shape. size : of its elements [m], NaN where the case could not be read;  result : None where it
    failed, and why"""

    shape: ProvenShape
    one: Pass
    size: float
    result: PassResult | None
    fault: str = ""

    def value(self, name: str) -> tuple[float, float]:
        """A quantity of PROVEN and its bar in the measure's unit; NaN where it is not known, no bar (0) where none is
        claimed."""
        if self.result is None:
            return np.nan, 0.0
        measure = PROVEN[name]
        return measure.factor * measure.of(self.result), measure.factor * measure.bar(self.result)


def without_finer(runs: Sequence[ProofRun]) -> list[ProofRun]:
    """Of each pass of each shape the run at the pass' own element size, which every shape has; `finer` ones come
    after."""
    first: dict[tuple[str, str], ProofRun] = {}
    for run in runs:
        first.setdefault((run.shape.name, run.one.name), run)
    return list(first.values())


def shapes(problem: Problem, found: Found, count: int) -> list[ProvenShape]:
    """The start, the `count` trials of least score, and of those that are worse than the start in no pass that is
    proven the one of least score, where there is one."""
    proven = {one.name for one in problem.design.proven}
    own = [k for k, (name, _) in enumerate(problem.columns) if name in proven]
    good = [(trial.score, number, trial) for number, trial in enumerate(found.trials, 1) if not trial.fault]
    good.sort(key=lambda entry: entry[:2])
    chosen = [(number, trial, "") for _, number, trial in good[:count]]
    even = [(n, t, ", worse nowhere") for _, n, t in good if (t.expected <= found.start.expected)[own].all()]
    if even and even[0][0] not in [number for number, *_ in chosen]:
        chosen.append(even[0])
    named = [ProvenShape(f"trial_{number:04d}", f"trial {number}{words}", trial) for number, trial, words in chosen]
    return [ProvenShape("start", "start", found.start), *named]


def prove_design(
    problem: Problem,
    found: Found | Sequence[ProvenShape],
    out: Path,
    count: int = 1,
    settings: Mapping[str, Any] | None = None,
    finer: Sequence[str] = (),
    ranks: int = 1,
    say: Callable[[str], None] = print,
    workers: Workers = Workers(),
) -> list[ProofRun]:
    """Run what is to be proven, or go on with it.

    found : of a search, or the shapes themselves;  count : how many of the best of a search
    settings : keys of the case in place of the design's `proof` and of what a pass sets
    finer : element sizes at which the first pass of start and best is run, too, with error bars by a twin
    Errors: those of `check_proof`.
    """
    changes = check_proof(problem, settings or {}, finer, ranks)
    chosen = shapes(problem, found, count) if isinstance(found, Found) else found
    tasks = [(shape, one, changes) for one in problem.design.proven for shape in chosen]
    first = problem.design.proven[0]
    tasks += [(shape, first, {TWIN: True, **changes, SIZE: size}) for size in finer for shape in chosen[:2]]
    done: dict[int, ProofRun] = {}
    prove = partial(_run, problem, Path(out) / "proof", ranks)
    for number, answer in each(prove, tasks, workers):
        shape, one, _ = tasks[number]
        run, wall = (ProofRun(shape, one, np.nan, None, str(answer)), 0.0) if isinstance(answer, Lost) else answer
        done[number] = run
        ended = f"FAILED: {run.fault}" if run.fault else f"done in {duration(wall)}"
        say(f"[{len(done)}/{len(tasks)}] {shape.words}, {one.name}, {1e3 * run.size:g} mm: {ended}")
    return [done[number] for number in range(len(tasks))]


def check_proof(problem: Problem, settings: Mapping[str, Any], finer: Sequence[str], ranks: int = 1) -> dict[str, Any]:
    """The settings of a proof, looked at before anything is searched or run. Errors: DesignError for records, a key
    that varies or a start that cannot be meshed so, CaseError for what no shape could be run with."""
    if problem.records:
        raise DesignError(
            f"{problem.records[0].name}: records are held against {RECORDED_BY}, {MODEL} has no accelerometer: leave"
            f" --prove out, and run {MODEL} with the most likely trial's values"
        )
    varied = sorted({variable.key for variable in problem.design.vary} & {*problem.design.proof, *settings})
    if varied:
        raise DesignError(f"{varied[0]} is what the search varies: a proof cannot set it")
    for one in problem.design.proven:
        for size in ({}, *({SIZE: size} for size in finer)):
            case = load_case(problem.case, {**keys_of(problem, one, settings), **size}).by(MODEL)
            if errors := preflight_errors(case.scene, case.runs[MODEL], ranks, MODEL):
                raise DesignError(f"the start, {one.name}, cannot be proven: {'; '.join(errors)}")
    return dict(settings)


def keys_of(problem: Problem, one: Pass, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Keys of the case for a pass' proof: the design's `proof`, before it what the pass itself sets, before both the
    settings that are given now."""
    return {**problem.design.proof, **one.set, **settings}


def _run(
    problem: Problem, out: Path, ranks: int, task: tuple[ProvenShape, Pass, Mapping[str, Any]]
) -> tuple[ProofRun, float]:
    """A run and its wall time [s]."""
    shape, one, changes = task
    try:
        case = load_case(problem.case, problem.changes(shape.values, one.name) | keys_of(problem, one, changes)).by(
            MODEL
        )
    except CaseError as error:
        return ProofRun(shape, one, np.nan, None, "; ".join(error.errors)[:LONGEST_REASON]), 0.0
    size = case.settings(FeSettings).element_size
    folder = out / f"{1e3 * size:g}mm" / shape.name / re.sub(r"[^\w.+-]+", "_", one.name) / MODEL
    outcome = run_job(Job(case, MODEL, folder), ranks)
    if not outcome.has_result:
        return ProofRun(shape, one, size, None, _reason(outcome)), outcome.wall_time
    return ProofRun(shape, one, size, load(folder)), outcome.wall_time


def _reason(outcome: Outcome) -> str:
    """Why a run failed, in its own words where it left any."""
    folder = outcome.job.folder
    with contextlib.suppress(OSError, ValueError, KeyError):
        status = read_status(folder)
        if status["state"] in ("failed", "stopped") and status["message"]:
            return " ".join(str(status["message"]).split())[:LONGEST_REASON]
    return " ".join(outcome.reason.split())[:LONGEST_REASON]
