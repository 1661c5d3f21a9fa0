"""One run from a checked case to a saved result."""

from collections.abc import Callable
from pathlib import Path

from rail_fem import ladder, launcher
from rail_fem.casefile import Case
from rail_fem.estimate import impossible
from rail_fem.progress import Progress
from rail_fem.report import result_report
from rail_fem.result import PassResult
from rail_fem.runfolder import RunFolderError, fingerprint, prepare_folder


class JobFault(RuntimeError):
    """A run that cannot start; the message says what to do."""


class _RunFailed(RuntimeError):
    """Carries a result's fault to the status file."""


def run_case(case: Case, model: str, folder: Path, restart: bool, overwrite: bool, say: Callable[[str], None]) -> str:
    """Run one model of a case and save its result in `folder`; returns why it failed, or "". Collective for parallel models.

    Nothing is meshed or written before everything that can be known has been checked.
    Errors: JobFault when the run cannot start.
    """
    settings = case.runs[model]
    if ladder.smoke_requested():
        settings = settings.smoke()
        say("RAIL_FEM_SMOKE: a few coarse steps only; the result has no meaning")
    ranks = launcher.rank_count()
    if ranks > 1 and not ladder.LADDER[model].parallel:
        raise JobFault(f"model {model} runs on one rank, {ranks} were started: leave mpirun out")
    faults = launcher.on_root(lambda: impossible(case.scene, settings, ranks, model))
    if faults:
        raise JobFault("\n  ".join([f"{case.path}: {len(faults)} fault(s)", *faults]))
    mark = fingerprint(model, case.scene, settings)
    try:
        ladder.load(model)
        goes_on = launcher.on_root(lambda: prepare_folder(folder, mark, restart, overwrite), RunFolderError)
    except (RunFolderError, ladder.ModelUnavailable) as error:
        raise JobFault(str(error)) from error
    if restart and not goes_on:
        say(f"{folder} holds no run yet: starting afresh")
    return _solve_and_save(case, model, settings, folder, goes_on, say)


def _solve_and_save(case: Case, model: str, settings, folder: Path, goes_on: bool, say: Callable[[str], None]) -> str:
    root = launcher.rank() == 0
    try:
        with Progress(folder, title=case.title, active=root) as progress:
            result: PassResult = ladder.solve(model, case.scene, settings, folder=folder, restart=goes_on, progress=progress)
            launcher.on_root(lambda: result.save(folder), OSError)
            say(result_report(result))
            if result.fault:
                raise _RunFailed(result.fault)
    except _RunFailed as failure:
        return str(failure)
    return ""
