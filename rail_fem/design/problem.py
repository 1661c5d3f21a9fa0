"""A design file: a case, keys of it that may vary between bounds, passes with weights, and what is wanted.

case = "whole_crossing.toml"          # beside this file
model = "rigid_hertz"
seed = 1
trials = 400                          # rounded up to whole generations of six a variable, two at least
set = { "run.rigid_hertz.path_spacing" = "5 mm" }   # in all passes and checks, before what each sets itself

[[vary]]
key = "scene.crossing.transition_length"
low = "60 mm"
high = "500 mm"

[[pass]]
name = "worn, 75 mph"
weight = 2.0
set = { "scene.wheel.profile" = "P8-worn", "scene.speed" = "75 mph" }
proven = true                         # false: searched on, left out of the proof

[guess]                               # one of the first trials, e.g. what another search has found
"scene.crossing.transition_length" = "405 mm"

[[check]]                             # passes of the report alone: what was found, on wheels that were not searched on
name = "as fast as 100 mph"
set = { "scene.speed" = "100 mph" }

[proof]                               # keys for the runs of the explicit model that prove what was found
"run.fe_full.element_size" = "4 mm"

[[objective]]
quantity = "largest leg force"        # of rail_fem.sweeps.trends.MEASURES
weight = 1.0
target = "263.6 kN"                   # none: as small as can be

In place of objectives a file of facts (rail_fem.design.observations), of passes of these names: then the trials say how
likely each scene is by them (rail_fem.design.inversion).

observations = "../thesis/observations.toml"
rounds = 4                            # of `trials` / 4 each, drawn where the scenes are likely

Or records of accelerometers (rail_fem.measurement.record), one a pass, alone or beside such a file:

[[pass]]
name = "bearer 1, first train"
record = "bearer_1.csv"               # beside this file
set = { "scene.speed" = "62 mph" }

[[vary]]
key = "scene.gauge"                   # half of it is a lateral position
only = "bearer 1, first train"        # an unknown of this pass alone
low = "1431 mm"
high = "1437 mm"
"""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from rail_fem.case.casefile import Case, load_case
from rail_fem.case.casetext import located, read_as
from rail_fem.case.variations import VariationError, field_of, quantity_at, value_of
from rail_fem.design.observations import FactGroup, read_facts
from rail_fem.design.record_facts import RecordFact
from rail_fem.hierarchy import MODELS, solve
from rail_fem.measurement.record import RecordError, read_record
from rail_fem.measurement.trace import Trace, trace_of
from rail_fem.scene.base import Count, Frozen
from rail_fem.scene.input_errors import meaning, suggest
from rail_fem.scene.units import NUMBER_THEN_UNIT, Quantity, QuantityError, parse, si_factor
from rail_fem.settings.light import RigidHertzSettings
from rail_fem.sweeps.trends import MEASURES

RECORDED_BY = "rigid_hertz"  # the model that knows where an accelerometer is
FAILED = 10.0  # objective of a trial that cannot be run: ten times the start's
LARGEST_SEED = 2**32 - 1  # that NumPy's generator takes


class DesignError(ValueError):
    """A design file that cannot be searched; the message holds all faults."""


class Variable(Frozen):
    """A key of the case file and the bounds between which it may lie, as text with its unit."""

    key: str
    low: str | float
    high: str | float
    only: str = ""  # the pass that has it; none: all

    @property
    def name(self) -> str:
        """Key, and of a pass alone the pass."""
        return f"{self.key} of {self.only}" if self.only else self.key

    @property
    def unit(self) -> str:
        """The unit of `low`, in which values are written."""
        found = NUMBER_THEN_UNIT.fullmatch(str(self.low))
        return found[2] if found else ""

    @property
    def bounds(self) -> tuple[float, float]:
        """Low and high in `unit`."""
        return self.read(self.low), self.read(self.high)

    @property
    def title(self) -> str:
        """Key without its section, what it is of, and unit."""
        entry = self.key.rsplit(".", 2 if self.key[-1].isdecimal() else 1)[1:]
        words = " ".join([*entry, *(["of", self.only] if self.only else [])])
        return f"{words} [{self.unit}]" if self.unit else words

    @property
    def label(self) -> str:
        """The title as an axis has it."""
        return self.title.replace("_", " ").replace(" [", "\n[")

    @property
    def words(self) -> str:
        """What it is, and its key."""
        return f"{meaning(field_of(self.key)).partition(';')[0]} ({self.name})"

    def read(self, value: str | float) -> float:
        """A case file's value in `unit`. Errors: ValueError that names the key."""
        try:
            return parse(str(value), self.unit)[1]
        except QuantityError as error:
            raise ValueError(f"{self.key}: {error}") from error

    def text(self, value: float) -> str | float:
        """A value in `unit` as a case file's."""
        return f"{value:.6g} {self.unit}" if self.unit else float(f"{value:.6g}")

    @model_validator(mode="after")
    def _bounds_are_in_order(self) -> "Variable":
        if fault := fault_of(self.key, self.low, self.high):
            raise ValueError(fault)
        low, high = self.bounds
        if not low < high:
            raise ValueError(f"{self.key}: low {self.low} must lie below high {self.high}")
        return self


class Pass(Frozen):
    """One wheel at one speed (or any other change of the case), and how much it counts."""

    name: str
    weight: Annotated[float, Field(gt=0, le=1e6)] = 1.0
    set: dict[str, Any] = Field(default_factory=dict)
    proven: bool = True  # by --prove; else it is searched on alone
    record: str = ""  # a file of what was measured of it, beside this one


class Objective(Frozen):
    """A measure that is to be small, or near a target."""

    quantity: str
    weight: Annotated[float, Field(gt=0, le=1e6)] = 1.0
    target: str | float | None = None

    @model_validator(mode="after")
    def _is_known(self) -> "Objective":
        if self.quantity not in MEASURES:
            raise ValueError(
                f'quantity "{self.quantity}" is not known{suggest(self.quantity, MEASURES)}: {", ".join(MEASURES)}'
            )
        if self.goal == 0:
            raise ValueError(f"target {self.target}: is counted by shares of it: without a target it is to be small")
        return self

    @property
    def goal(self) -> float | None:
        """The target in the measure's unit."""
        return None if self.target is None else parse(str(self.target), MEASURES[self.quantity].unit)[1]


class Design(Frozen):
    """What is searched."""

    case: str
    model: str = "rigid_hertz"
    seed: Annotated[Count, Field(ge=0, le=LARGEST_SEED)] = 1
    trials: Annotated[Count, Field(ge=10, le=1_000_000)] = 400  # rounded up to whole generations, two at least
    worse: Annotated[float, Field(ge=0, le=1e3)] = 0.0  # weight of whatever is worse in a pass than at the start
    set: dict[str, Any] = Field(default_factory=dict)  # keys in all passes and checks, before their own
    guess: dict[str, str | float] = Field(default_factory=dict)  # values of all variables for one of the first trials
    proof: dict[str, Any] = Field(default_factory=dict)  # keys of the case for the runs that prove what was found
    vary: Annotated[tuple[Variable, ...], Field(min_length=1, max_length=30)]
    passes: Annotated[tuple[Pass, ...], Field(min_length=1, alias="pass")]
    checks: Annotated[tuple[Pass, ...], Field(alias="check")] = ()
    objective: tuple[Objective, ...] = ()
    observations: str = ""  # a file of facts in place of objectives
    rounds: Annotated[Count, Field(ge=0, le=100)] = 4  # of trials where the facts make scenes likely
    reach: Annotated[
        float, Quantity("mm", 1e-3, 1e6, "how far a record's positions, where it has such, may be off")
    ] = 0.1

    @model_validator(mode="after")
    def _model_is_light(self) -> "Design":
        if self.model not in MODELS or MODELS[self.model].parallel:
            light = [name for name, entry in MODELS.items() if not entry.parallel]
            raise ValueError(
                f'model "{self.model}" is no light model{suggest(self.model, light)}: a search takes {", ".join(light)}'
            )
        if bool(self.objective) == bool(self.source):
            raise ValueError("give objectives, or observations or records in their place")
        if self.recorded and self.model != RECORDED_BY:
            raise ValueError(f"records are held against {RECORDED_BY}: leave {self.model} out, or the records")
        passes = [p.name for p in (*self.passes, *self.checks)]
        for what, names in (("key", [v.name for v in self.vary]), ("pass", passes)):
            if len(set(names)) < len(names):
                raise ValueError(f"{what} {sorted(n for n in names if names.count(n) > 1)[0]} stands twice")
        if self.guess and {*self.guess} != {v.name for v in self.vary}:
            raise ValueError("guess: give a value for every key that varies and for no other")
        for v, x in zip(self.vary, self.guessed):
            if not v.bounds[0] <= x <= v.bounds[1]:
                raise ValueError(f"guess: {v.name} = {self.guess[v.name]} lies outside {v.low} to {v.high}")
        for v in self.vary:
            if all(v.key in self.set | one.set for one in self.passes if v.only in ("", one.name)):
                raise ValueError(f"vary: {v.name} is set by every pass: leave it out there, or here")
        if not any(one.proven for one in self.passes):
            raise ValueError("proven = false in every pass: leave it out of those that --prove is to run")
        if strange := [v.only for v in self.vary if v.only and v.only not in passes]:
            raise ValueError(f"only = {strange[0]} is none of the passes{suggest(strange[0], passes)}")
        return self

    @property
    def guessed(self) -> list[float]:
        """(k,)  `guess` in the variables' units, empty without one."""
        return [v.read(self.guess[v.name]) for v in self.vary] if self.guess else []

    @property
    def recorded(self) -> tuple[Pass, ...]:
        """The passes that have a record."""
        return tuple(one for one in self.passes if one.record)

    @property
    def source(self) -> str:
        """Names of the files that an inversion goes by."""
        return ", ".join(Path(name).name for name in (self.observations, *(p.record for p in self.recorded)) if name)

    @property
    def proven(self) -> tuple[Pass, ...]:
        """The passes that a proof runs."""
        return tuple(one for one in self.passes if one.proven)


@dataclass(frozen=True)
class Problem:
    """A design and where its case lies."""

    design: Design
    case: Path
    facts: tuple[FactGroup | RecordFact, ...] = ()

    @property
    def columns(self) -> list[tuple[str, str]]:
        """Pass and quantity of each number of a trial."""
        return self.columns_of(self.design.passes)

    def columns_of(self, passes: tuple[Pass, ...]) -> list[tuple[str, str]]:
        """The same for other passes."""
        asked = {column for group in self.facts for column in group.columns}
        quantities = [objective.quantity for objective in self.design.objective] or sorted({q for _, q in asked})
        return [(one.name, q) for one in passes for q in quantities if not asked or (one.name, q) in asked]

    def changes(self, values: np.ndarray | None, of: str = "") -> dict[str, Any]:
        """Keys of the case with their values, of all passes and of the one named; none for the case as it is."""
        own = lambda variable: variable.only in ("", of)
        return {} if values is None else {v.key: v.text(x) for v, x in zip(self.design.vary, values) if own(v)}

    def changed(self, values: np.ndarray | None, one: Pass) -> Case:
        """The case in a pass. Errors: CaseError."""
        # what the pass sets may be a list of which an entry varies
        changes = one.set | self.changes(values, one.name) | one.set
        return load_case(self.case, changes).by(self.design.model)

    @property
    def records(self) -> list[RecordFact]:
        """Those of the facts that are records."""
        return [fact for fact in self.facts if isinstance(fact, RecordFact)]

    @cached_property
    def bounds(self) -> np.ndarray:
        """(2, k)  low and high of the variables, in their units."""
        return np.array([variable.bounds for variable in self.design.vary]).T

    def scaled(self, values: np.ndarray) -> np.ndarray:
        """Values (..., k) of the variables between their bounds 0 and 1."""
        low, high = self.bounds
        return (values - low) / (high - low)

    def scaled_back(self, points: np.ndarray) -> np.ndarray:
        """The inverse, in the variables' units."""
        low, high = self.bounds
        return low + points * (high - low)

    @cached_property
    def start_values(self) -> np.ndarray:
        """(k,)  of the variables in the case as it is, NaN for one that it leaves to the program. Errors: CaseError."""
        case = load_case(self.case, {})
        values = [(value_of(case, v.key), si_factor(v.unit)) for v in self.design.vary]
        return np.array([value / unit if isinstance(value, (int, float)) else np.nan for value, unit in values])

    def numbers(self, values: np.ndarray | None, passes: tuple[Pass, ...] = ()) -> np.ndarray:
        """(k,)  the measures of `columns` in their units, or of other passes. Errors: those of load_case and of the
        model."""
        found: dict[tuple[str, str], float] = {}
        passes = passes or self.design.passes
        columns = self.columns_of(passes)
        for one in passes:
            case = self.changed(values, one)
            if own := [(name, quantity) for name, quantity in columns if name == one.name and quantity in MEASURES]:
                result = solve(self.design.model, case.scene, case.runs[self.design.model])
                measures = [MEASURES[quantity] for _, quantity in own]
                found |= {
                    column: measure.of(result) / si_factor(measure.unit) for column, measure in zip(own, measures)
                }
            for fact in self.records:
                if fact.name == one.name:
                    found |= dict(zip(fact.columns, fact.measured(case.scene, case.settings(RigidHertzSettings))))
        return np.array([found[column] for column in columns])

    def cut_short(self, values: np.ndarray | None) -> list[str]:
        """What the passes may lack, of each that begins or ends where more goes on. Errors: as of `numbers`."""
        cases = [(one.name, self.changed(values, one)) for one in self.design.passes]
        found = [(name, solve(self.design.model, case.scene, case.runs[self.design.model])) for name, case in cases]
        return [f"{name}: {said}" for name, result in found for said in result.warnings if said.startswith("the run ")]

    def score(self, numbers: np.ndarray, start: np.ndarray, counted: np.ndarray | None = None) -> float:
        """Weighted mean over passes and objectives: value over the start's, or squared distance from a target; what is
        above the start's counts `worse` times more. counted (m,) : which of the numbers, all if None"""
        total = weights = 0.0
        for k, (one, objective) in enumerate((p, o) for p in self.design.passes for o in self.design.objective):
            if counted is not None and not counted[k]:
                continue
            weight = one.weight * objective.weight
            goal = objective.goal
            part = self._part(numbers[k], start[k]) if goal is None else ((numbers[k] - goal) / goal) ** 2
            total, weights = total + weight * (FAILED if np.isnan(part) else min(part, FAILED)), weights + weight
        return total / weights

    def _part(self, number: float, start: float) -> float:
        ratio = number / max(abs(start), 1e-9)
        return ratio + self.design.worse * max(ratio - 1, 0.0)


def read_design(path: Path | str) -> Problem:
    """Read and check a design file, or an example by its name, and that its case can be loaded in all passes and
    proofs. Errors: DesignError, CaseError."""
    path = located(path)
    design = _with_common_keys(read_as(path, Design, DesignError))
    facts = read_facts(path.parent / design.observations, DesignError) if design.observations else ()
    return checked(Problem(design, path.parent / design.case, facts), path)


def checked(problem: Problem, path: Path) -> Problem:
    """A problem whose case can be loaded in all passes, with its records. path : the file that messages name, records
    lie beside it. Errors: DesignError, CaseError, OSError."""
    design, facts = problem.design, problem.facts
    names = [one.name for one in design.passes]
    if strange := [name for group in facts for name, _ in group.columns if name not in names]:
        raise DesignError(
            f"{path}: observations of {strange[0]}, which is none of the passes{suggest(strange[0], names)}"
        )
    for one in (*design.passes, *design.checks):
        load_case(problem.case, design.proof | one.set).by(design.model)
    try:
        found = [RecordFact(one.name, _trace(problem, one, path.parent / one.record)) for one in design.recorded]
    except RecordError as error:
        raise DesignError(str(error)) from error
    return replace(problem, facts=(*facts, *found))


def _trace(problem: Problem, one: Pass, record: Path) -> Trace:
    """A pass's record beside the case as it is. Errors: RecordError, those of the model."""
    case = problem.changed(None, one)
    settings = case.settings(RigidHertzSettings)
    if settings.degrees_of_freedom != "vertical":
        raise RecordError(f"{record}: is held against degrees_of_freedom = vertical: leave the key out")
    return trace_of(read_record(record, case.scene.velocity), case.scene, settings, problem.design.reach)


def _with_common_keys(design: Design) -> Design:
    """What all passes and checks set, written into each of them."""
    own = lambda passes: tuple(one.model_copy(update={"set": design.set | one.set}) for one in passes)
    return design.model_copy(update={"passes": own(design.passes), "checks": own(design.checks)})


def fault_of(key: str, *values: str | float) -> str:
    """Why no case has this key or one of these values, "" where it has; values that no crossing has together fail
    their trial."""
    try:
        quantity = quantity_at(key)
        if quantity is None:
            return f"{key}: is no physical quantity, no bounds or note: set it by a pass of a design file"
        for value in values:
            quantity.read(value, units_required=True)
    except VariationError as error:
        return str(error)
    except QuantityError as error:
        return f"{key}: {error}"
    return ""
