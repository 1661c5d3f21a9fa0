"""Many cases, one after the other or by several workers: each [run.MODEL] of each case file in OUT/CASE/MODEL.

A sweep says at the start what it cannot run, goes on after a failure, and when it is started again passes over what is
finished and goes on with what was cut off. What another sweep is running is left to it, so that several machines may
share one folder. Figures of light models are left to `show`, which draws what is missing: they take ten times the
pass. Light models run in their worker's process, parallel ones under mpirun.
"""

import functools
import itertools
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TextIO

from rail_fem.case.casefile import Case
from rail_fem.case.estimate import available_memory, estimate_run, memory_of
from rail_fem.case.preflight import preflight_errors
from rail_fem.case.variations import as_setting, vary_case
from rail_fem.files import lock
from rail_fem.hierarchy import MODELS
from rail_fem.processes.launcher import mpi_command, rank_environment
from rail_fem.processes.pool import PROCESSES, Lost, Workers, each
from rail_fem.processes.progress import duration
from rail_fem.processes.stopping import end_with_parent
from rail_fem.result.result import PassResult, load
from rail_fem.result.runfolder import MARK, FolderHeld, differences, digest, fingerprint, only_profile_differs, owned
from rail_fem.run.job import JobError, run_case
from rail_fem.settings.explicit import FeSettings
from rail_fem.settings.light import unfit_parts
from rail_fem.sweeps.trends import CaseChanges

FINISHED, FAILED, SKIPPED, ELSEWHERE = "finished", "FAILED", "finished before", "left to another sweep"
LATER = "started again, this sweep tells its result"
BY_A_SIGNAL = 128  # exit codes above it, and negative ones


@dataclass(frozen=True)
class Job:
    """One model of one case and the folder that takes its result."""

    case: Case
    model: str
    folder: Path


@dataclass(frozen=True)
class Outcome:
    """What became of a job: FINISHED, SKIPPED, or FAILED and ELSEWHERE with the reason, and the wall time of this sweep
    [s]."""

    job: Job
    state: str
    reason: str = ""
    wall_time: float = 0.0

    @property
    def has_result(self) -> bool:
        return self.state in (FINISHED, SKIPPED)

    @functools.cached_property
    def result(self) -> PassResult:
        """What lies in the job's folder, read once. Errors: as load."""
        return load(self.job.folder)


def read_cases(
    paths: Iterable[Path],
    settings: Mapping[str, Any] | None = None,
    variations: Sequence[tuple[str, list[Any]]] = (),
    changes: CaseChanges | None = None,
) -> tuple[list[Case], list[str]]:
    """Cases that can be read, and the errors of the others.

    settings, variations : of every file, as rail_fem.case.variations.vary_case takes them
    changes : of each file by its name; settings and variations go before them
    Errors: ValueError when two cases have one name, VariationError.
    """
    paths, cases, errors = [Path(p) for p in paths], [], []
    _refuse_twice([path.stem for path in paths])
    varied = {key for key, _ in variations}
    for path in paths:
        own = {} if changes is None else changes.of(path.stem)
        asked = {key: value for key, value in own.items() if key not in varied} | dict(settings or {})
        found, wrong = vary_case(path, asked, variations)
        cases += found
        errors += wrong
    _refuse_twice([case.name for case in cases])
    return cases, errors


def _refuse_twice(names: list[str]) -> None:
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ValueError(f"case files of one name would share a folder: {', '.join(twice)}; rename one")


def jobs_of(cases: Iterable[Case], out: Path, models: Iterable[str] = ()) -> list[Job]:
    """Jobs from the least expensive model to the most expensive, so that the quick answers come first. models : only
    these models; none: all that a case has."""
    wanted = tuple(models) or tuple(MODELS)
    cases = list(cases)
    return [
        Job(case, model, Path(out) / case.name / model)
        for model in MODELS
        if model in wanted
        for case in cases
        if model in case.runs
    ]


def cannot_start(jobs: list[Job], ranks: int) -> list[str]:
    """Why runs of parallel models will not start, known before the first does, by case and model; light models say it
    soon enough at their turn."""
    due = [job for job in jobs if MODELS[job.model].parallel and not (job.folder / "result.json").is_file()]
    return [
        f"{job.case.name} {error}"
        for job in due
        for error in preflight_errors(job.case.scene, job.case.runs[job.model], ranks, job.model)
    ]


def run_sweep(jobs: list[Job], ranks: int, say: Callable[[str], None], workers: Workers = Workers()) -> list[Outcome]:
    """Run all jobs, model by model, no more at a time than this machine holds; a line for each with the time that is
    left. ranks : for parallel models. Errors: PoolError."""
    outcomes: dict[int, Outcome] = {}
    started = time.perf_counter()
    for model in MODELS:
        at = [number for number, job in enumerate(jobs) if job.model == model]
        own, there = [jobs[number] for number in at], len(outcomes)
        times: list[float] = []
        fewer, why = at_a_time(own, ranks, workers)
        if why:
            say(f"{model}: {why}")
        for number, answer in each(functools.partial(run_job, ranks=ranks, tries=workers.tries), own, fewer):
            outcome = Outcome(own[number], FAILED, str(answer)) if isinstance(answer, Lost) else answer
            outcomes[at[number]] = outcome
            times += [outcome.wall_time] if outcome.state == FINISHED else []
            left = len(own) - len(outcomes) + there
            later = left * sum(times) / len(times) / fewer.count if left and times else 0.0
            eta = f"  {model}: {left} left, about {duration(later)}" if later else ""
            reason = f": {outcome.reason}" if outcome.reason else ""
            say(
                f"[{len(outcomes)}/{len(jobs)}] {duration(time.perf_counter() - started)}  {outcome.job.case.name}"
                f" {model}: {outcome.state} in {outcome.wall_time:.1f} s{reason}{eta}"
            )
    return [outcomes[number] for number in range(len(jobs))]


def at_a_time(jobs: list[Job], ranks: int, workers: Workers) -> tuple[Workers, str]:
    """As many workers as this machine has memory and cores for, by what `check` foretells of the largest of these jobs
    of one model, and why they are fewer than asked for. Of other machines nobody here knows."""
    if workers.count == 1 or workers.pool != PROCESSES or not jobs:
        return workers, ""
    memory = max(memory_of(job.case.scene, job.case.runs[job.model], ranks) for job in jobs)
    each_has = ranks if MODELS[jobs[0].model].parallel else 1
    cores, free = len(os.sched_getaffinity(0)), available_memory()
    fit = max(1, min(int(free / memory), cores // each_has))
    why = (
        f" at a time in place of {workers.count}: each needs {memory / 1e9:.2g} GB and {each_has} core(s),"
        f" {free / 1e9:.3g} GB and {cores} core(s) are free"
    )
    there, free = on_card(jobs, ranks)
    if there > 0 and (fit_there := max(1, int(free / there))) < fit:
        fit = fit_there
        why = f" at a time in place of {workers.count}: each needs {there / 1e9:.2g} of {free / 1e9:.3g} GB of the card"
    return (replace(workers, count=fit), f"{fit}{why}") if fit < workers.count else (workers, "")


def on_card(jobs: list[Job], ranks: int) -> tuple[float, float]:
    """What the largest of these jobs takes of a graphics card's memory, 0 where none asks for one or none is there, and
    what is free there [B]."""
    explicit = ((job.case.scene, job.case.runs[job.model]) for job in jobs)
    asks = [(scene, own) for scene, own in explicit if isinstance(own, FeSettings) and own.device == "cuda"]
    if not asks:
        return 0.0, 0.0
    from rail_fem.fe.card.device import card_facts, missing
    from rail_fem.fe.card.fits import room_on_card

    if missing():  # the runs say it
        return 0.0, 0.0
    return max(room_on_card(estimate_run(*ask, ranks).cells, *ask) for ask in asks), float(card_facts().free)


def run_job(job: Job, ranks: int, tries: int = 1) -> Outcome:
    """Run a job, or pass over it when its folder holds the finished result of this very case. tries : of one whose
    ranks are ended from outside."""
    started = time.perf_counter()
    try:
        if unfit := unfit_parts(job.case.scene, job.case.runs[job.model]):
            raise JobError(unfit[0])
        anew = profile_changed(job)
        if not anew and is_finished(job):
            return Outcome(job, SKIPPED)
        if other := lock.owner(job.folder):
            return Outcome(job, ELSEWHERE, owned(job.folder, other, LATER))
        if MODELS[job.model].parallel:
            failure = _under_mpirun(job, ranks, anew, tries)
            if failure and (other := lock.owner(job.folder)):  # it came first, while the ranks started
                return Outcome(job, ELSEWHERE, owned(job.folder, other, LATER))
        else:
            failure = run_case(job.case, job.model, job.folder, not anew, anew, lambda text: None, False)
    except (JobError, ValueError, ArithmeticError, OSError) as error:
        if isinstance(error.__cause__, FolderHeld):  # since it was looked at
            return Outcome(job, ELSEWHERE, f"{error}; {LATER}")
        anew, failure = False, f"{type(error).__name__}: {error}" if not isinstance(error, JobError) else str(error)
    return Outcome(
        job,
        FAILED if failure else FINISHED,
        failure or ("its profile file had changed" if anew else ""),
        time.perf_counter() - started,
    )


def _unlike(job: Job) -> list[str]:
    """How the case that a folder holds differs from this job's."""
    mark = job.folder / MARK
    there = json.loads(mark.read_text(encoding="utf-8")) if mark.is_file() else {}
    return differences(there, _mark(job))


def _mark(job: Job) -> dict:
    return fingerprint(job.model, job.case.scene, job.case.runs[job.model])


def profile_changed(job: Job) -> bool:
    """Whether the folder holds this very case with another content of its profile file: then what lies there answers
    nothing any more."""
    return (job.folder / MARK).is_file() and only_profile_differs(_unlike(job))


def is_finished(job: Job) -> bool:
    """Whether the folder holds a result of this case. Errors: ValueError when it holds one of another case or of an
    older scene, named key by key."""
    if not (job.folder / "result.json").is_file():
        return False
    unlike = _unlike(job)
    if unlike:
        raise ValueError(
            f"{job.folder} holds the result of another case or of an older version of it: {'; '.join(unlike[:5])}:"
            " remove the folder to run it again"
        )
    result = load(job.folder)
    more = result.cut_off and result.settings.get("max_steps") != getattr(job.case.runs[job.model], "max_steps", None)
    return not (result.fault or more)


def _under_mpirun(job: Job, ranks: int, anew: bool, tries: int) -> str:
    """Run as `rail-fem run` in processes of their own, words into run.log beside the folder; returns the failure.

    They read the case again, and refuse another content than this sweep has read.
    """
    options = {"--model": job.model, "--out": str(job.folder), "--digest": digest(_mark(job))}
    told = [*options.items(), *(("--set", as_setting(key, value)) for key, value in job.case.changes.items())]
    run = ["-P", "-m", "mpi4py", "-m", "rail_fem", "run"]  # -P: nothing is imported from the current folder
    program = [sys.executable, *run, str(job.case.path), *itertools.chain(*told)]
    job.folder.parent.mkdir(parents=True, exist_ok=True)
    log = job.folder.parent / f"{job.model}.log"
    how, code = "--overwrite" if anew else "--restart", 0
    for _ in range(tries):
        with log.open("a", encoding="utf-8") as stream:
            code = run_bound([*mpi_command(ranks), *program, how], stream, rank_environment())
        if 0 <= code <= BY_A_SIGNAL:
            break
        how = "--restart"
    return f"exit code {code}, see {log}" if code else ""


def run_bound(command: list[str], stream: TextIO, environment: Mapping[str, str]) -> int:
    """Exit code of a command that is told to end when this process dies: else it would go on writing where a second
    sweep does."""
    with subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=stream,
        stderr=subprocess.STDOUT,
        env=environment,
        preexec_fn=functools.partial(end_with_parent, signal.SIGTERM) if sys.platform == "linux" else None,
    ) as process:
        try:
            return process.wait()
        except BaseException:  # it took too long: mpirun ends its ranks when it is told, not when it is killed
            process.terminate()
            raise
