"""One run from a checked case to a saved result."""

import contextlib
import traceback
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from rail_fem import hierarchy
from rail_fem.case.casefile import Case
from rail_fem.case.preflight import preflight_errors
from rail_fem.case.warnings import case_warnings
from rail_fem.contact.rigid import with_path
from rail_fem.processes import launcher
from rail_fem.processes.progress import Progress, mark_ended, read_status
from rail_fem.result.result import PassResult, load
from rail_fem.result.runfolder import RunFolderError, fingerprint, held, lost, prepare_folder
from rail_fem.run.form import form
from rail_fem.scene.scene import Frozen
from rail_fem.show.figures import draw_run, titles
from rail_fem.show.report import result_report


class JobError(RuntimeError):
    """A run that cannot start; the message says what to do."""


class RunFailed(RuntimeError):
    """Carries a result's fault to the status file."""


# What a run may meet: bad input found late, an unstable step, a full disk, too little memory. All else is a bug and
# keeps its traceback.
EXPECTED = (ValueError, ArithmeticError, OSError, MemoryError)


def run_case(
    case: Case,
    model: str,
    folder: Path,
    restart: bool,
    overwrite: bool,
    say: Callable[[str], None],
    by_itself: bool = True,
) -> str:
    """Run one model of a case and save its result in `folder`; returns why it failed, or "". Collective for parallel
    models. by_itself : not one of many, which leave out what takes longer than a light pass: its figures (`show` draws
    them), those rows of the bar of form that take passes of their own, and words that nobody hears

    Nothing is meshed or written before everything that can be known has been checked.
    Errors: JobError when the run cannot start.
    """
    settings: Any = case.runs[model]
    if hierarchy.smoke_requested():
        settings = settings.smoke()
        say("RAIL_FEM_SMOKE: a few coarse steps only; the result has no meaning")
    ranks = launcher.rank_count()
    if ranks > 1 and not hierarchy.MODELS[model].parallel:
        raise JobError(f"model {model} runs on one rank, {ranks} were started: leave mpirun out")
    errors = launcher.on_root(lambda: preflight_errors(case.scene, settings, ranks, model))
    if errors:
        raise JobError("\n  ".join([f"{case.path}: {len(errors)} input error(s)", *errors]))
    mark = fingerprint(model, case.scene, settings)
    with contextlib.ExitStack() as stack:
        try:
            hierarchy.load(model)
            launcher.on_root(lambda: stack.enter_context(held(folder)))
            goes_on = launcher.on_root(lambda: prepare_folder(folder, mark, restart, overwrite))
            launcher.on_root(lambda: case.scene.keep_files(folder))
        except (RunFolderError, hierarchy.ModelUnavailable, OSError) as error:
            raise JobError(str(error)) from error
        if goes_on and (how := launcher.on_root(lambda: ended(folder, settings))):
            say(f"{folder}: {how} already; --overwrite begins again")
            _draw(folder, say, missing_only=True)
            return ""
        if restart and not goes_on:
            say(f"{folder} holds no run yet: starting afresh")
        return _solve_and_save(case, model, settings, folder, goes_on, say, by_itself)


def ended(folder: Path, settings: Frozen) -> str:
    """How the run in a folder of this very case has ended: "finished", "cut off" by the same number of steps as now, ""
    where there is something to do. Its status then says so too."""
    try:
        result = load(folder)
    except (OSError, ValueError):
        return ""
    if result.fault or result.settings.get("max_steps") != getattr(settings, "max_steps", None):
        return ""
    how = "cut off" if result.cut_off else "finished"
    with contextlib.suppress(OSError, ValueError):
        if read_status(folder)["state"] != how:  # killed while it drew
            mark_ended(folder, how, result.cut_off)
    return how


def _solve_and_save(
    case: Case, model: str, settings, folder: Path, goes_on: bool, say: Callable[[str], None], by_itself: bool
) -> str:
    try:
        with Progress(folder, title=case.title, active=launcher.rank() == 0) as progress:
            result: PassResult = hierarchy.solve(
                model, case.scene, settings, folder=folder, restart=goes_on, progress=progress
            )
            if hierarchy.smoke_requested():
                result = replace(result, cut_off="")  # it is all that was asked for
            if result.cut_off:
                progress.cut_off(f"{result.cut_off}; give more steps, or none, and --restart goes on")
            warnings = launcher.on_root(lambda: case_warnings(case.scene, with_path(case.scene, settings)))
            measured = case.scene.wheel.measured
            notes = () if measured is None else tuple(measured.notes)
            smoke = hierarchy.smoke_requested()
            moved = {} if smoke else form(result, by_itself)
            result = replace(result, warnings=(*warnings, *result.warnings), notes=(*notes, *result.notes))
            result = replace(result, title=case.title, form=moved)
            if gone := launcher.on_root(lambda: lost(folder)):
                raise RunFailed(gone)
            launcher.on_root(lambda: result.save(folder))
            if by_itself:
                say(result_report(result))
                progress.before_the_first_step("figures")
                _draw(folder, say)
            if result.fault:
                raise RunFailed(result.fault)
    except Exception as error:
        if launcher.rank() == 0 and (gone := lost(folder)):
            return gone
        _let_root_speak(folder, f"{type(error).__name__}: {error}")
        if isinstance(error, RunFailed):
            return str(error)
        if not isinstance(error, EXPECTED):
            raise
        return f"{error} ({_keep_trace(folder)})"
    return ""


def _draw(folder: Path, say: Callable[[str], None], missing_only: bool = False) -> None:
    """Figures of the run, each drawn by one rank, and the page of one whose fields are larger than it. What cannot be
    drawn is told of; the result is safe and `show` and `report` draw again. Collective."""
    try:
        found = launcher.on_root(lambda: titles(load(folder)))
        shares = [found[first :: launcher.rank_count()] for first in range(min(launcher.rank_count(), len(found)))]
        launcher.dealt_out([partial(draw_run, folder, missing_only, share) for share in shares])
    except Exception as error:
        say(
            f"no figures: {type(error).__name__}: {error} ({_keep_trace(folder)}); the result is saved, 'rail-fem show"
            f" {folder}' draws again"
        )
        return
    launcher.on_root(lambda: _write_page(folder, say))


def _write_page(folder: Path, say: Callable[[str], None]) -> None:
    if not (folder / "fields").is_dir():
        return
    from rail_fem.show.page import PAGE, write_page  # with the explicit models alone

    try:
        say(f"page for a browser: {write_page([folder], folder / PAGE)}")
    except (ModuleNotFoundError, OSError) as error:
        say(f"no page for a browser: {error}")


def _let_root_speak(folder: Path, message: str) -> None:
    """Mostly all ranks meet a fault and the root ends the job. A rank that outlives it met the fault alone, while the
    root waits for it in MPI."""
    launcher.let_root_end_first()
    if launcher.rank() != 0:
        mark_ended(folder, "failed", f"rank {launcher.rank()}: {message}")


def _keep_trace(folder: Path) -> str:
    """Where a fault came from is for the developer: into a file, not onto the terminal."""
    path = folder / f"traceback.{launcher.rank()}.txt"
    try:
        path.write_text(traceback.format_exc(), encoding="utf-8")
    except OSError as error:
        return f"no traceback written: {error.strerror}"
    return f"traceback in {path}"
