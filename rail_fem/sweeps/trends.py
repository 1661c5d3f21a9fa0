"""Trends over cases: a sentence like "a faster wheel strikes the nose harder", checked on the results of every model
that resolves it.

Read from a TOML file, so that a study of one's own can state its own:

    [[group]]
    title = "Vehicle speed"
    cases = ["case_03", "case_02", "case_01"]

    [[group.trend]]
    says = "a faster wheel strikes the nose harder"
    quantity = "impact on the wheel"
    order = ["case_03", "case_02", "case_01"]    # from the smallest to the largest
    published = "129.0, 172.5, 234.0 kN"         # what a source found, as text
    because = "why a model differs"               # shown where one does

    [[group.trend.control]]                      # an experiment that changes one thing (rail_fem.sweeps.controls)
    says = "begun on the falling wing, the force rises with speed"
    change = { "run.rigid_hertz.start" = "300 mm" }

Beside the groups, [[published]] rows hold what a source gives for each case (rail_fem.sweeps.published_table), and the
file may change the cases that it is about, each before it is run (`rail-fem sweep CASE... --groups FILE`):

    change = { "run.fe_full.element_size" = "2 mm" }            # in all
    only.case_05 = { "run.fe_full.end" = "-1100 mm" }           # in one
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Self

import numpy as np
from pydantic import Field, model_validator

from geometry.path.wheel_path import WheelPath
from rail_fem.case.casetext import read_as
from rail_fem.hierarchy import MODELS
from rail_fem.light.rigid import rigid_path
from rail_fem.output.events import leg_flight, longest_flight
from rail_fem.output.low_pass import filtered_force
from rail_fem.output.quantities import REPORTED, two_now
from rail_fem.output.result import NAN, PassResult
from rail_fem.scene.scene import Frozen
from rail_fem.sweeps.compare import IMPACT, peak

SAME = 0.01  # relative change below which two values say nothing of a trend

Results = Mapping[str, Mapping[str, PassResult]]  # case -> model -> result


class TrendError(ValueError):
    """A file of trends that cannot be used; the message holds all input errors."""


@dataclass(frozen=True)
class Measure:
    """A number of a result, NaN where it is not resolved; value * factor is in `unit`. reported : its name among
    rail_fem.output.quantities.REPORTED, under which a result has its error bar"""

    of: Callable[[PassResult], float]
    unit: str
    factor: float
    reported: str = ""

    def bar(self, result: PassResult) -> float:
        """The result's error bar [SI], 0 where it claims none."""
        return result.error_bars.get(self.reported, 0.0)


def largest_dip(result: PassResult) -> float:
    """How far the crossing's base goes down below its position at the start [m]."""
    height = result.history["crossing_height"]
    return float(height[np.isfinite(height)][0] - np.nanmin(height)) if np.isfinite(height).any() else np.nan


def deepest(result: PassResult) -> float:
    """How far the crossing's base goes down below its position without load [m]."""
    height = result.history["crossing_height"]
    return float(-np.nanmin(height)) if np.isfinite(height).any() else np.nan


def swing(result: PassResult) -> float:
    """From the highest position of the crossing's base before its lowest to the lowest [m]."""
    height = result.history["crossing_height"]
    height = height[np.isfinite(height)]
    return float(height[: height.argmin() + 1].max() - height.min()) if len(height) else np.nan


def length_off_leg(result: PassResult) -> float:
    """Of the longest flight that begins on the leg [m]; NaN for a pass that does not run over it, or whose model knows
    no leg."""
    flight = leg_flight(result) if "largest_force_wing" in result.peaks else None
    return NAN if flight is None else flight.length


def _first_impact(body: str, result: PassResult) -> float:
    """On the nose or the wing, which takes the wheel over; the formula knows no bodies."""
    return peak(result, f"first_impact_on_{body}", "p2")


def launch_speed(result: PassResult) -> float:
    """Of the wheel, upwards, as the longest flight off the leg begins [m/s]; NaN without a flight."""
    flight = leg_flight(result)
    return flight.launch_speed if flight is not None and flight.length else NAN


def over_leg(result: PassResult) -> WheelPath:
    """The rigid wheel's path from before the leg to the knuckle."""
    surface = result.scene.crossing.surface
    return rigid_path(result.scene, np.arange(surface.leg_range[0] - 0.1, result.scene.crossing.leg_end, 2e-3))


def falls_away(result: PassResult) -> float:
    """Largest V^2 |h''| of the rigid path over the leg where it bends downwards, over P0 / Mu, with which load and mass
    let a wheel fall [1]: above 1 it flies. Over chords of 2 mm."""
    scene, path = result.scene, over_leg(result)
    able = scene.static_wheel_load / scene.vehicle.wheel_unsprung_mass
    return float(scene.speed**2 * max(-np.diff(path.slope).min() / 2e-3, 0.0) / able)


def check_rail_force(result: PassResult) -> float:
    """Largest of the check rail on the other wheel [N]; NaN where there is none."""
    force = result.history.get("force_check", np.array([]))
    return float(np.nanmax(force)) if np.isfinite(force).any() else NAN


MEASURES: dict[str, Measure] = {
    "impact on the wheel": Measure(lambda r: peak(r, *IMPACT), "kN", 1e-3, "impact_on_wheel"),
    **{
        f"first impact on the {body}": Measure(partial(_first_impact, body), "kN", 1e-3, f"first_impact_on_{body}")
        for body in ("nose", "wing")
    },
    "largest force": Measure(lambda r: peak(r, "largest_force"), "kN", 1e-3, "largest_force"),
    "largest leg force": Measure(lambda r: peak(r, "largest_force_leg"), "kN", 1e-3, "largest_force_leg"),
    "longest flight": Measure(lambda r: longest_flight(r).length if len(r.history["x"]) else np.nan, "mm", 1e3),
    "flight off the leg": Measure(length_off_leg, "mm", 1e3),
    "longest flight time": Measure(lambda r: longest_flight(r).duration if len(r.history["x"]) else np.nan, "ms", 1e3),
    "largest wing force": Measure(lambda r: peak(r, "largest_force_wing"), "kN", 1e-3, "largest_force_wing"),
    "largest nose force": Measure(lambda r: peak(r, "largest_force_nose"), "kN", 1e-3, "largest_force_nose"),
    "nose strain": Measure(REPORTED["block_nose"].of, "%", 100.0, "block_nose"),
    "wing strain": Measure(REPORTED["block_wing"].of, "%", 100.0, "block_wing"),
    "leg strain": Measure(REPORTED["block_leg"].of, "%", 100.0, "block_leg"),
    # of small elements alone the block has a bar
    **{
        f"{body} strain of 1000 mm3": Measure(REPORTED[f"worst_1000_{body}"].of, "%", 100.0, f"worst_1000_{body}")
        for body in ("leg", "wing", "nose")
    },
    "crossing dip": Measure(largest_dip, "mm", 1e3),
    "crossing depth": Measure(deepest, "mm", 1e3),
    "crossing swing": Measure(swing, "mm", 1e3),
    "transfer x": Measure(lambda r: r.transfer_x, "mm", 1e3, "transfer_x"),
    "launch speed": Measure(launch_speed, "m/s", 1.0),
    "climb of the leg's path": Measure(lambda r: over_leg(r).slope.max(), "mrad", 1e3),
    "lift of the leg's path": Measure(lambda r: np.subtract(*over_leg(r).height[[-1, 0]]), "mm", 1e3),
    "leg's path falls away": Measure(falls_away, "of what the load can", 1.0),
    "check rail force": Measure(check_rail_force, "kN", 1e-3),
    "lateral position at the start": Measure(lambda r: r.history["wheel_lateral"][0], "mm", 1e3),
    "force of the track on its spring": Measure(lambda r: peak(r, "force_foundation"), "kN", 1e-3),
    "stress in the foot": Measure(lambda r: peak(r, "foot_stress"), "MPa", 1e-6),
    **{
        f"force at {cutoff:g} Hz": Measure(partial(filtered_force, cutoff=cutoff), "kN", 1e-3)
        for cutoff in (500.0, 50.0, 20.0)
    },
}


Change = str | float | int | bool | dict


class CaseChanges(Frozen):
    """Values in place of the case files': `change` in all cases, `only` in one."""

    change: dict[str, Change] = {}
    only: dict[str, dict[str, Change]] = {}

    def of(self, case: str) -> dict[str, Change]:
        """By key, e.g. "scene.speed"."""
        return self.change | self.only.get(case, {})

    @property
    def changes_cases(self) -> bool:
        """Whether there are any."""
        return bool(self.change or self.only)

    def with_settings(self, settings: dict[str, Any]) -> Self:
        """The same with these before its own, in every case."""
        only = {case: {**values, **settings} for case, values in self.only.items()}
        return self.model_copy(update={"change": {**self.change, **settings}, "only": only})


class ControlExperiment(CaseChanges):
    """An experiment by a light model on the trend's cases with its changes made in them; quantity, order: as the
    trend's unless given."""

    says: str
    model: str = "rigid_hertz"
    quantity: str = ""
    order: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _runs_here(self) -> ControlExperiment:
        if self.model not in MODELS or MODELS[self.model].parallel:
            raise ValueError(
                f"model '{self.model}' of a control is none of the light models"
                f" {', '.join(m for m, model in MODELS.items() if not model.parallel)}"
            )
        return self


class Trend(Frozen):
    """quantity : of MEASURES;  order : cases from the smallest to the largest value;  unchanged : instead, all values
    lie within so much of one another, relative;  because : why models differ"""

    says: str
    quantity: str
    order: tuple[str, ...] = Field(min_length=2)
    unchanged: float = Field(0.0, ge=0.0, le=1.0)
    published: str = ""
    because: str = ""
    control: tuple[ControlExperiment, ...] = ()

    @model_validator(mode="after")
    def _of_known_quantities(self) -> Trend:
        for quantity in (self.quantity, *(control.quantity or self.quantity for control in self.control)):
            if quantity not in MEASURES:
                raise ValueError(f"quantity '{quantity}'{two_now(quantity) or ' is not one of ' + ', '.join(MEASURES)}")
        return self


class Group(Frozen):
    """Cases that belong on one figure, and what is said of them. figures : what of a source the figure of histories,
    and of strain, stands for"""

    title: str
    cases: tuple[str, ...] = Field(min_length=1)
    figures: tuple[str, str] = ("", "")
    trend: tuple[Trend, ...] = ()


class Published(Frozen):
    """What a source gives for a case: dip angle [mrad], P2 and largest force [kN]; on the leg largest force [kN],
    plastic strain [%]. None: not printed there."""

    case: str
    dip: float | None = None
    p2: float | None = None
    peak: float | None = None
    leg_force: float | None = None
    leg_strain: float | None = None


class Source(CaseChanges):
    """A file of groups. reference : the case whose models are drawn beside one another, and what these figures stand
    for; absent : source's figures that have no like here, and why"""

    group: tuple[Group, ...]
    title: str = "Report of a sweep"
    intro: str = ""
    published: tuple[Published, ...] = ()
    reference: str = ""
    reference_figures: tuple[str, str] = ("", "")
    summary_figures: str = ""
    absent: tuple[str, ...] = ()


def load_source(path: Path) -> Source:
    """A TOML file of groups and trends. Errors: TrendError with the key and what to do."""
    path = Path(path)
    source = read_as(path, Source, TrendError)
    if absent := [case for case in source.only if not (path.parent / f"{case}.toml").is_file()]:
        raise TrendError(f"{path}: only.{absent[0]}: there is no {absent[0]}.toml beside it")
    return source


@dataclass(frozen=True)
class TrendFinding:
    """What one model says of a trend. verdict : agrees, differs, same (no change above SAME);  values in the trend's
    order, shown units, and their error bars, 0 where none is claimed"""

    model: str
    verdict: str
    values: tuple[float, ...]
    bars: tuple[float, ...] = ()

    @property
    def sure(self) -> bool:
        """Whether first and last value lie apart by more than their error bars."""
        return abs(self.values[-1] - self.values[0]) > sum(self.bars[:1] + self.bars[-1:])

    def words(self, unit: str) -> str:
        """The finding as a line of the page."""
        bars = self.bars or (0.0,) * len(self.values)
        shown = [f"{v:.4g}" + (f" +- {bar:.2g}" if bar else "") for v, bar in zip(self.values, bars)]
        within = "" if self.sure or not any(bars) else " (first and last are not apart by more than their bars)"
        return f"{self.model} {self.verdict}: {', '.join(shown)} {unit}{within}"


def check(trend: Trend, results: Results) -> list[TrendFinding]:
    """A finding for every model that resolves the quantity in all cases of the trend, least expensive first."""
    measure, found = MEASURES[trend.quantity], []
    for model in MODELS:
        values = [
            measure.of(results[case][model]) if model in results.get(case, {}) else np.nan for case in trend.order
        ]
        if np.isfinite(values).all():
            bars = tuple(measure.factor * measure.bar(results[case][model]) for case in trend.order)
            found.append(
                TrendFinding(
                    model, verdict(np.array(values), trend.unchanged), tuple(measure.factor * v for v in values), bars
                )
            )
    return found


def verdict(values: np.ndarray, unchanged: float = 0.0) -> str:
    """Of values (n,) that should grow: a step down by more than SAME contradicts; none up by more than SAME says
    nothing. unchanged : of values that should not change, by how much of their largest they may"""
    if unchanged:
        return "agrees" if np.ptp(values) <= unchanged * np.abs(values).max() else "differs"
    steps = np.diff(values) / np.maximum(np.abs(values[:-1]), 1e-300)
    if (steps < -SAME).any():
        return "differs"
    return "agrees" if (steps > SAME).any() and values[-1] > values[0] else "same"
