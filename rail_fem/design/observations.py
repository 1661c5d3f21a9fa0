"""What a source says of a crossing that is not known: forces, places, depths, each with its uncertainty, and how likely
a scene makes them.

A file of facts, groups of one quantity each:

[[group]]
name = "largest force on the nose"
quantity = "largest nose force"      # of rail_fem.sweeps.trends.MEASURES
over = "largest leg force"           # none: the quantity itself; else its ratio to this one, in the same pass ...
over_pass = "case_02"                # ... or in this one
sd = "6 %"                           # of the source: relative, or in the quantity's unit
why = "one of them is printed three times, as 165, 172.5 and 188.18 kN"
source = "Table 7-5"
bound = "least"                      # none: the value itself; "least", "most": it is so much or more, or less
value = { case_01 = "234 kN", case_02 = "172.5 kN" }       # by pass
"""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field, model_validator
from scipy.special import log_ndtr

from rail_fem.case.casetext import read_as
from rail_fem.scene.base import Frozen
from rail_fem.scene.units import parse
from rail_fem.sweeps.trends import MEASURES

Likelihood = Callable[[np.ndarray, np.ndarray], np.ndarray]  # numbers (m, n) and errors of form (m,) to logarithms (m,)
FORM = 0.03, 0.3  # between which the light model's relative error of form lies, evenly in its logarithm
SHARED = 0.5  # of that error's variance: the same in all passes of a group, as far as no proof tells it


class FactGroup(Frozen):
    """Facts of one kind, in the order of their passes."""

    name: str
    quantity: str
    over: str = ""
    over_pass: str = ""
    sd: str
    why: str
    source: str
    bound: Literal["", "least", "most"] = ""
    value: dict[str, str | float] = Field(min_length=1)

    @model_validator(mode="after")
    def _can_be_read(self) -> "FactGroup":
        if unknown := [name for name in (self.quantity, self.over) if name and name not in MEASURES]:
            raise ValueError(f'quantity "{unknown[0]}" of {self.name} is none of {", ".join(MEASURES)}')
        if not (self.spread > 0 and np.isfinite(self.values).all()):
            raise ValueError(f"{self.name}: sd and values must be numbers of this quantity, sd above 0")
        return self

    @property
    def unit(self) -> str:
        """In which values are read; none of a ratio."""
        return "" if self.over or self.over_pass else MEASURES[self.quantity].unit

    @property
    def relative(self) -> bool:
        """Whether its values are compared by their logarithms, with a relative uncertainty."""
        return self.sd.strip().endswith("%")

    @property
    def spread(self) -> float:
        """The standard deviation, of the logarithm or in `unit`."""
        return float(self.sd.strip()[:-1]) / 100 if self.relative else self._read(self.sd)

    @property
    def values(self) -> np.ndarray:
        """(n,)  as they are compared."""
        values = np.array([self._read(value) for value in self.value.values()])
        return np.log(values) if self.relative else values

    def _read(self, value: str | float) -> float:
        return parse(str(value), self.unit)[1] if self.unit else float(value)

    @property
    def columns(self) -> list[tuple[str, str]]:
        """Pass and quantity of the numbers that it needs: its own, then those that they are divided by."""
        own = [(one, self.quantity) for one in self.value]
        below = [(self.over_pass or one, self.over or self.quantity) for one in self.value] if not self.own else []
        return own + below

    @property
    def own(self) -> bool:
        """Whether it is no ratio."""
        return not (self.over or self.over_pass)

    def of(self, numbers: np.ndarray) -> np.ndarray:
        """(m, n)  what numbers (m, len(columns)) make of it, as they are compared; NaN where one is not known."""
        count = len(self.value)
        found = numbers[:, :count] if self.own else numbers[:, :count] / numbers[:, count:]
        with np.errstate(divide="ignore", invalid="ignore"):
            found = np.log(found) if self.relative else found
        return np.where(np.isfinite(found), found, np.nan)

    def places(self, passes: Iterable[str]) -> list[int]:
        """Which of the emulator's answers are those of some of its passes."""
        return [list(self.value).index(name) for name in passes]

    def missed(self, numbers: np.ndarray, form: float) -> np.ndarray:
        """(n,)  by how many standard deviations of source and form."""
        beside = (self.of(numbers[None])[0] - self.values) / np.hypot(self.spread, form if self.relative else 0.0)
        return {"least": np.minimum(beside, 0), "most": np.maximum(beside, 0)}.get(self.bound, beside)

    def log_likelihood(self, found: np.ndarray, error: np.ndarray, form: np.ndarray, proven: int = 0) -> np.ndarray:
        """(m,)  of `of` (m, n), up to a constant.

        error : (n, n) covariance of `found` beside the model's form;  form : (m,) the model's relative error of form,
        a share of it common to the group but for what `proven` passes have told
        """
        beside, count = found - self.values, len(self.value)
        form = np.where(self.relative, form, 0.0)[:, None, None]
        own = (1 - SHARED) * np.eye(count) + SHARED / (1 + proven)
        covariance = error + self.spread**2 * np.eye(count) + form**2 * own
        if self.bound:
            sign = 1.0 if self.bound == "least" else -1.0
            return log_ndtr(sign * beside / np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))).sum(axis=1)
        square = (beside * np.linalg.solve(covariance, beside[:, :, None])[:, :, 0]).sum(axis=1)
        return -0.5 * (square + np.linalg.slogdet(covariance)[1])

    def judge(self, error: np.ndarray, proven: int) -> Likelihood:
        """`log_likelihood` of this error."""
        return lambda found, form: self.log_likelihood(found, error, form, proven)

    def error_of(self, missed: np.ndarray) -> np.ndarray:
        """(n, n)  covariance about 0 of an emulator's residuals (m, n)."""
        return missed.T @ missed / len(missed)

    def drawn(self, truth: np.ndarray, form: float, rng: np.random.Generator) -> list["FactGroup"]:
        """The same facts as a source would print them of a scene whose numbers (len(columns),) are `truth`, seen with
        all the errors that `log_likelihood` counts; those of a bound by the side on which they lie."""
        wide = form if self.relative else 0.0
        seen = self.of(truth[None])[0] + wide * np.sqrt(SHARED) * rng.standard_normal()
        seen = seen + np.hypot(self.spread, wide * np.sqrt(1 - SHARED)) * rng.standard_normal(len(seen))
        if not self.bound:
            printed = np.exp(seen) if self.relative else seen
            return [self._with(dict(zip(self.value, (f"{value} {self.unit}".strip() for value in printed))))]
        sides = {"least": seen >= self.values, "most": seen < self.values}
        chosen = lambda side: {name: value for (name, value), held in zip(self.value.items(), side) if held}
        return [self._with(chosen(side), bound) for bound, side in sides.items() if side.any()]

    def _with(self, value: dict[str, str | float], bound: str = "") -> "FactGroup":
        return self.model_copy(update={"value": value, "bound": bound})


class Facts(Frozen):
    """A file of them."""

    group: tuple[FactGroup, ...] = Field(min_length=1)


def read_facts(path: Path, refused: type[ValueError]) -> tuple[FactGroup, ...]:
    """The groups of a file. Errors: `refused` with the file, each key and what to do."""
    groups = read_as(path, Facts, refused).group
    if len({group.name for group in groups}) < len(groups):
        raise refused(f"{path}: two groups have the same name")
    return groups
