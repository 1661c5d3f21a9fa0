"""One pass at several element sizes: its runs, and the limit that each reported quantity tends to."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import typer

from rail_fem.case.casefile import CaseError, load_case
from rail_fem.processes.launcher import on_root
from rail_fem.result.error_bars import ORDER, error_bars
from rail_fem.result.extrapolation import Limit, limit_of
from rail_fem.result.quantities import REPORTED, reported
from rail_fem.result.result import PassResult, load
from rail_fem.run.job import run_case
from rail_fem.settings.explicit import WINDOW_ENDS, FeSettings

MODEL = "fe_full"
TWIN = 1.2, 2.6  # ratio of sizes with which the coarser run serves as the finer one's twin


def read_sizes(text: str) -> list[float]:
    """ "4,2,1" [mm] to element sizes [m], coarse to fine. Errors: typer.BadParameter."""
    try:
        sizes = [float(size) * 1e-3 for size in text.split(",")]
    except ValueError:
        sizes = []
    if not sizes or not all(0 < size < 1 for size in sizes) or len(set(sizes)) < len(sizes):
        raise typer.BadParameter(f'--sizes "{text}": write different element sizes in mm, e.g. --sizes 4,2,1')
    return sorted(sizes, reverse=True)


def run_at(
    case_path: Path, changes: Mapping[str, Any], size: float, folder: Path, say: Callable[[str], None]
) -> PassResult:
    """The case with these changes at an element size [m], without a twin. Collective.

    A run that the folder holds is not run again, one that was stopped or killed goes on.
    Errors: CaseError for a case with a mesh; JobError where the folder holds another case. Ends the program with exit
    code 1 where a run fails.
    """
    keys = {f"run.{MODEL}.element_size": f"{size * 1e3:g} mm", f"run.{MODEL}.error_twin": False}
    case = load_case(case_path, {**changes, **keys, **_windows(case_path, changes, size)})
    if getattr(case.runs[MODEL], "mesh", ""):
        raise CaseError(
            case_path, [f"run.{MODEL}.mesh has one element size, a study of sizes meshes itself: leave it out"]
        )
    if fault := run_case(case, MODEL, folder, True, False, say):
        typer.echo(f"{folder}: {fault}", err=True)
        raise typer.Exit(1)
    return on_root(lambda: load(folder))


def _windows(case_path: Path, changes: Mapping[str, Any], size: float) -> dict[str, str]:
    """Keys of a travelling window where elements are larger than the case's: longer by as much as its slabs are."""
    own = load_case(case_path, changes).runs.get(MODEL)
    if not isinstance(own, FeSettings) or size <= own.element_size:
        return {}
    coarse = own.coarser(size / own.element_size)
    given = {name: length for name in WINDOW_ENDS if isinstance(length := getattr(coarse, name), float)}
    return {f"run.{MODEL}.{name}": f"{length * 1e3:g} mm" for name, length in given.items()}


def run_sizes(
    case_path: Path, changes: Mapping[str, Any], sizes: Sequence[float], out: Path, say: Callable[[str], None]
) -> list[PassResult]:
    """Results at each size [m], coarse to fine, in folders such as out/2mm; bars by the next coarser one. Collective.
    Errors: as `run_at`."""
    ordered = sorted(sizes, reverse=True)
    return with_twins([run_at(case_path, changes, size, out / f"{size * 1e3:g}mm", say) for size in ordered])


def size_of(result: PassResult) -> float:
    """Element size of an explicit run [m]."""
    return float(result.settings["element_size"])


def with_twins(results: Sequence[PassResult]) -> list[PassResult]:
    """The same results, each with the error bars that the one among them nearest to twice its size gives; without bars
    where there is none between TWIN."""
    found = []
    for result in results:
        ratios = [(abs(math.log(size_of(one) / size_of(result) / 2)), one) for one in results]
        near = [(away, one) for away, one in ratios if TWIN[0] <= size_of(one) / size_of(result) <= TWIN[1]]
        bars = error_bars(result, min(near, key=lambda pair: pair[0])[1]) if near else {}
        found.append(replace(result, error_bars=bars))
    return found


def limits(results: Sequence[PassResult]) -> dict[str, Limit]:
    """Of the quantities that all results resolve and any has more than nothing of, by name [SI]."""
    values, sizes = [reported(result) for result in results], [size_of(result) for result in results]
    return {
        name: limit_of(sizes, [own[name] for own in values], ORDER)
        for name in REPORTED
        if all(name in own for own in values) and any(own[name] for own in values)
    }
