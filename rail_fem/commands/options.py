"""Arguments and options that several commands share, and how a case is read for them."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rail_fem.commands.ending import choose_json, refusing, stop, tell
from rail_fem.processes import launcher
from rail_fem.scene.input_errors import suggest

if TYPE_CHECKING:
    from rail_fem.case.casefile import Case

CaseArgument = Annotated[Path, typer.Argument(metavar="CASE", help="case file (TOML), e.g. cases/nose_transfer.toml")]
ModelOption = Annotated[
    str | None,
    typer.Option(
        "--model", help="which model; by its defaults where the case has no [run.MODEL]; needed when it has several"
    ),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", help='KEY=VALUE in place of the case file\'s: "scene.speed=60 mph"; may be given often'),
]
PoolOption = Annotated[
    str, typer.Option("--pool", help="where tasks run: processes, mpi, or package:callable that makes an Executor")
]
JsonOption = Annotated[
    bool, typer.Option("--json", callback=choose_json, help="the answer as one JSON object, all else on standard error")
]


def not_a_runs(path: Path | None) -> Path | None:
    """Callback of files that a command writes: refuses a run's own in its folder, which would be lost."""
    from rail_fem.result.runfolder import MARK, OWN

    if path is not None:
        folder, name = os.path.split(os.path.realpath(path))
        if name in OWN and any(os.path.exists(os.path.join(folder, mark)) for mark in (MARK, "result.json")):
            stop(f"{path}: is the run's own file, which would be lost: name another")
    return path


def read_case(path: Path, model: str | None, settings: list[str] | None = None) -> tuple[Case, str]:
    """The case with what --set changes and the name of the model to run; ends the program on a fault."""
    case = loaded_case(path, settings)
    if model is None and not case.runs:
        stop(f"{path}: has no table [run.MODEL], only [damage]: see 'rail-fem damage --help', or give --model")
    if model is None and len(case.runs) > 1:
        stop(f"{path}: has [run.*] for {', '.join(case.runs)}: choose one with --model")
    return by_model(case, model or next(iter(case.runs))), model or next(iter(case.runs))


def by_model(case: Case, model: str, told: set | None = None) -> Case:
    """The case, which runs this model; says so where that is by the model's defaults, ends the program on a fault.
    told : files and models of which it has been said"""
    from rail_fem.case.casefile import CaseError
    from rail_fem.hierarchy import MODELS

    if model not in MODELS:
        stop(f"--model {model}: no such model{suggest(model, MODELS)}; choose among {', '.join(MODELS)}")
    told = set() if told is None else told
    if model not in case.runs and (case.path, model) not in told:
        tell(f"{case.path}: has no [run.{model}], {model} runs by its defaults")
        told.add((case.path, model))
    with refusing(CaseError):
        return case.by(model)


def loaded_case(path: Path, settings: list[str] | None = None) -> Case:
    """The case with what --set changes, whatever models it has; ends the program on a fault."""
    from rail_fem.case.casefile import CaseError, load_case
    from rail_fem.case.variations import VariationError, read_settings

    with refusing(CaseError, VariationError):
        changes = read_settings(settings or ())
        return launcher.on_root(lambda: load_case(path, changes))  # once for all ranks: they work on the same content
