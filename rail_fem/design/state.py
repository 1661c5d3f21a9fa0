"""The state of a crossing from records of accelerometers: a case, its records and its unknowns as a design file would
hold them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from rail_fem.case.casefile import load_case
from rail_fem.design.problem import RECORDED_BY, Design, DesignError, Problem, checked, fault_of
from rail_fem.measurement.record import read_notes
from rail_fem.scene.input_errors import describe_errors
from rail_fem.scene.units import typed

CARRIED = 0.0, 1.3  # factor on a bearer's ballast: of one that hangs, and of one packed harder than the others
ROUNDS = 3
BEARERS = "scene.bearers.unlike"


def state_problem(
    case: Path,
    records: Sequence[Path],
    find: Sequence[str],
    each: Sequence[str],
    bearers: str | None,
    trials: int,
    reach: str | None,
) -> Problem:
    """What `invert` takes.

    find, each : "KEY=LOW..HIGH", of all passes and of each by itself;  bearers : numbers of those whose ballast may be
    unlike the others', "0,1,2"
    Errors: DesignError, CaseError, RecordError, OSError.
    """
    numbers = [] if bearers is None else _numbers(bearers)
    known = load_case(case).scene.bearers
    if numbers and (known is None or known.unlike):
        has = "no [scene.bearers]" if known is None else f"bearers {list(known.unlike)} of their own in unlike"
        raise DesignError(f"{case}: --bearers: has {has}: write them there, or vary their factors by a design file")
    common: dict[str, Any] = {BEARERS: numbers, f"{BEARERS}_ballast": [1.0] * len(numbers)} if numbers else {}
    passes = [{"name": path.stem, "record": str(path.resolve()), "set": common | _noted(path)} for path in records]
    vary = [_variable(text) for text in find]
    vary += [{"key": f"{BEARERS}_ballast.{k}", "low": CARRIED[0], "high": CARRIED[1]} for k in range(len(numbers))]
    vary += [_variable(text) | {"only": one["name"]} for one in passes for text in each]
    given = {"case": str(case), "model": RECORDED_BY, "trials": trials, "rounds": ROUNDS, "vary": vary, "pass": passes}
    try:
        design = Design.model_validate(
            given | ({} if reach is None else {"reach": reach}), context={"units_required": True}
        )
    except ValidationError as error:
        raise DesignError(
            "\n  ".join([f"{case}: cannot be searched so", *describe_errors(error, Design, "")])
        ) from error
    return checked(Problem(design, Path(case)), Path(case))


def _variable(text: str) -> dict[str, Any]:
    key, equals, bounds = text.partition("=")
    low, dots, high = bounds.partition("..")
    if not (equals and dots and key.strip() and low.strip() and high.strip()):
        raise DesignError(
            f'--find {typed(text)}: write KEY=LOW..HIGH, e.g. --find "scene.foundation.stiffness=60 kN/mm..300 kN/mm"'
        )
    return {"key": key.strip(), "low": low.strip(), "high": high.strip()}


def _numbers(text: str) -> list[int]:
    try:
        return [int(word) for word in text.split(",")]
    except ValueError as error:
        raise DesignError(f'--bearers {typed(text)}: write their numbers, as "0,1,2"') from error


def _noted(record: Path) -> dict[str, str]:
    """What a record says of its pass: quantities of the case, no files."""
    said = {name: value for name, value in read_notes(record).items() if name.startswith("scene.")}
    if faults := [fault for name, value in said.items() if (fault := fault_of(name, value))]:
        raise DesignError(f"{record}: {'; '.join(faults)}")
    return said
