"""Trends over cases: a sentence like "a faster wheel strikes the nose harder", checked on the results of every model
that resolves it.

Read from a TOML file, so that a study of one's own can state its own:

    [[group]]
    title = "Vehicle speed"
    cases = ["case_03", "case_02", "case_01"]

    [[group.trend]]
    says = "a faster wheel strikes the nose harder"
    quantity = "impact on the wheel"
    order = ["case_03", "case_02", "case_01"]    # from the smallest to the largest; or of these cases, each:
                                                 #   exceeds = ["largest wing force"], within = [0, 0.2], in its unit
    published = "129.0, 172.5, 234.0 kN"         # what a source found, as text
    because = "why a model differs"               # shown where one does

    [[group.trend.control]]                      # an experiment that changes one thing (rail_fem.sweeps.trend_words)
    says = "begun on the falling wing, the force rises with speed"
    change = { "run.rigid_hertz.start" = "300 mm" }

Beside the groups, [[published]] rows hold what a source gives for each case (rail_fem.sweeps.published_table), and the
file may change the cases that it is about, each before it is run (`rail-fem sweep CASE... --groups FILE`):

    change = { "run.fe_full.element_size" = "2 mm" }            # in all
    only.case_05 = { "run.fe_full.end" = "-1100 mm" }           # in one
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Self

import numpy as np
from pydantic import Field, model_validator

from geometry.path.wheel_path import WheelPath
from rail_fem.case.casetext import read_as
from rail_fem.contact.rigid import rigid_path
from rail_fem.hierarchy import MODELS
from rail_fem.result.events import first_maximum, flights, leg_flight, longest_flight
from rail_fem.result.low_pass import filtered_force
from rail_fem.result.quantities import REPORTED
from rail_fem.result.result import NAN, PassResult
from rail_fem.scene.scene import Frozen
from rail_fem.scene.units import SHOWN
from rail_fem.settings.draws import Change
from rail_fem.sweeps.compare import IMPACT, peak

FEW = 5  # cases from which on not each is told
SAME = 0.01  # relative change below which two values say nothing of a trend

Results = Mapping[str, Mapping[str, PassResult]]  # case -> model -> result


class TrendError(ValueError):
    """A file of trends that cannot be used; the message holds all input errors."""


@dataclass(frozen=True)
class Measure:
    """A number of a result, NaN where it is not resolved; value * factor is in `unit`. reported : its name among
    rail_fem.result.quantities.REPORTED, under which a result has its error bar"""

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


def dip_before_nose(result: PassResult) -> float:
    """How far the crossing's base goes down below its position at the start where the wheel has no nose below it
    [m]."""
    height = result.history["crossing_height"]
    own = height[(result.history["x"] < result.scene.crossing.surface.nose_x) & np.isfinite(height)]
    return float(height[np.isfinite(height)][0] - own.min()) if len(own) else np.nan


def behind_nose(result: PassResult, x: float) -> float:
    """Of a place, from where the nose begins [m]."""
    return x - result.scene.crossing.surface.nose_x


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


def knows_leg(result: PassResult) -> bool:
    """Whether a pass runs over the leg and its model parts it from the wing rail."""
    return {"largest_force_leg", "largest_force_wing"} <= set(result.peaks) and leg_flight(result) is not None


def _facing_over_leg(result: PassResult) -> bool:
    """The same of a facing wheel."""
    return result.scene.direction_sign > 0 and knows_leg(result)


def dip_behind_leg(result: PassResult) -> float:
    """How far the largest force on the leg brings the crossing's base down below its position at the start, at rest
    under the static load [m]: to where it first rises again, by more than a tenth of its static sag. NaN trailing, and
    for a pass that does not run over the leg."""
    height = result.history["crossing_height"]
    if not _facing_over_leg(result) or not np.isfinite(height).all():
        return NAN
    impact = int(np.searchsorted(result.history["x"], result.peaks["largest_force_leg"].x))
    rise = 0.1 * result.scene.static_wheel_load / result.scene.foundation.stiffness
    return float(height[0] - height[impact + first_maximum(-height[impact:], rise)])


def length_onto_leg(result: PassResult) -> float:
    """Of the longest flight that ends before the force first exceeds one and a half times the static load [m]: the
    wheel drops onto the ramp. NaN as for the dip behind it."""
    if not _facing_over_leg(result):
        return NAN
    struck = np.argmax(result.history["force"] > 1.5 * result.scene.static_wheel_load)
    onto = [flight for flight in flights(result) if flight.x_end < result.history["x"][struck]]
    return max((flight.length for flight in onto), default=0.0)


def length_behind_nose(result: PassResult) -> float:
    """Of a facing wheel's longest flight that begins behind the transfer [m]; NaN trailing and without a transfer."""
    if result.scene.direction_sign < 0 or np.isnan(result.transfer_x) or not len(result.history["x"]):
        return NAN
    return max((flight.length for flight in flights(result) if flight.x_start > result.transfer_x), default=0.0)


def force_before_nose(result: PassResult) -> float:
    """The largest within 100 mm before a facing wheel's transfer [N]."""
    x, force = result.history["x"], result.history.get("force", np.array([]))
    before = (x < result.transfer_x) & (x > result.transfer_x - 0.1) & (result.scene.direction_sign > 0)
    return float(np.nanmax(force[before])) if len(force) and before.any() else NAN


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


def measure_of(name: str) -> Measure:
    """Of a reported quantity, in engineers' units."""
    return Measure(REPORTED[name].of, *SHOWN[REPORTED[name].unit], name)


MEASURES: dict[str, Measure] = {
    "impact on the wheel": Measure(lambda r: peak(r, *IMPACT), "kN", 1e-3, "impact_on_wheel"),
    # the formula knows no bodies
    "first impact on the nose": Measure(
        lambda r: peak(r, "first_impact_on_nose", "p2"), "kN", 1e-3, "first_impact_on_nose"
    ),
    "first impact on the wing": Measure(
        lambda r: peak(r, "first_impact_on_wing", "p2"), "kN", 1e-3, "first_impact_on_wing"
    ),
    "largest force": measure_of("largest_force"),
    "largest leg force": measure_of("largest_force_leg"),
    "longest flight": Measure(lambda r: longest_flight(r).length if len(r.history["x"]) else np.nan, "mm", 1e3),
    "flight off the leg": Measure(length_off_leg, "mm", 1e3),
    "longest flight time": Measure(lambda r: longest_flight(r).duration if len(r.history["x"]) else np.nan, "ms", 1e3),
    "largest wing force": measure_of("largest_force_wing"),
    "largest nose force": measure_of("largest_force_nose"),
    "nose strain": measure_of("block_nose"),
    "wing strain": measure_of("block_wing"),
    "leg strain": measure_of("block_leg"),
    # of small elements alone the block has a bar
    **{f"{body} strain of 1000 mm3": measure_of(f"worst_1000_{body}") for body in ("leg", "wing", "nose")},
    "nose volume above 1 %": measure_of("volume_1_nose"),
    "integrated wing strain": measure_of("integral_wing"),
    "flight onto the leg": Measure(length_onto_leg, "mm", 1e3),
    "flight behind the nose": Measure(length_behind_nose, "mm", 1e3),
    "force before the nose": Measure(force_before_nose, "kN", 1e-3),
    "crossing dip behind the leg": Measure(dip_behind_leg, "mm", 1e3),
    "crossing dip": Measure(largest_dip, "mm", 1e3),
    "crossing dip before the nose": Measure(dip_before_nose, "mm", 1e3),
    "crossing swing": Measure(swing, "mm", 1e3),
    "transfer x": Measure(lambda r: r.transfer_x, "mm", 1e3, "transfer_x"),
    "transfer behind the nose's beginning": Measure(lambda r: behind_nose(r, r.transfer_x), "mm", 1e3),
    "largest nose force behind the nose's beginning": Measure(
        lambda r: behind_nose(r, r.peaks["largest_force_nose"].x) if "largest_force_nose" in r.peaks else NAN, "mm", 1e3
    ),
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


class CaseChanges(Frozen):
    """Values in place of the case files': `change` in all cases, `only` in one."""

    change: dict[str, Change] = {}
    only: dict[str, dict[str, Change]] = {}

    def of(self, case: str) -> dict[str, Change]:
        """By key, e.g. "scene.speed"."""
        return self.change | self.only.get(case, {})

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
    """quantity : of MEASURES;  order : cases from the smallest to the largest value;  instead of that order:
    unchanged : all values lie within so much of one another, relative;  exceeds : in each case the quantity is larger
    than these;  within : in each case it lies there, in its unit;  because : why models differ"""

    says: str
    quantity: str
    order: tuple[str, ...] = Field(min_length=1)
    unchanged: float = Field(0.0, ge=0.0, le=1.0)
    exceeds: tuple[str, ...] = ()
    within: tuple[float, float] | None = None
    published: str = ""
    because: str = ""
    control: tuple[ControlExperiment, ...] = ()

    @model_validator(mode="after")
    def _of_known_quantities(self) -> Trend:
        controls = (control.quantity or self.quantity for control in self.control)
        for quantity in (self.quantity, *self.exceeds, *controls):
            if quantity not in MEASURES:
                raise ValueError(f"quantity '{quantity}' is not one of {', '.join(MEASURES)}")
        if len(self.order) < 2 and not self.of_each_case:
            raise ValueError("one case has no order: name two, or say what it exceeds or lies within")
        return self

    @property
    def of_each_case(self) -> bool:
        """Whether it says something of each case by itself."""
        return bool(self.exceeds) or self.within is not None

    @property
    def statement(self) -> str:
        """What is to hold, of which cases."""
        unit = MEASURES[self.quantity].unit
        if self.of_each_case:
            held = [f"above {' and '.join(self.exceeds)}"] if self.exceeds else []
            if self.within:
                low, high = self.within
                both = f"{low:g} to {high:g} {unit}" if high > low else f"{low:g} {unit}"
                held.append(f"at least {low:g} {unit}" if np.isinf(high) else both)
            cases = ", ".join(self.order) if len(self.order) < FEW else f"{len(self.order)} cases"
            return f"{self.quantity} {', '.join(held)}: {cases}"
        within = f", within {100 * self.unchanged:g} %" if self.unchanged else ""
        return f"{self.quantity}: {(' = ' if self.unchanged else ' < ').join(self.order)}{within}"


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
    order, shown units, and their error bars, 0 where none is claimed;  sure : whether more than the bars decides;
    against : cases that speak against a statement of each case"""

    model: str
    verdict: str
    values: tuple[float, ...]
    bars: tuple[float, ...] = ()
    sure: bool = True
    against: tuple[str, ...] = ()

    def words(self, unit: str, like: str = "") -> str:
        """The finding as a line of the page. like : which models find the same"""
        bars = self.bars or (0.0,) * len(self.values)
        shown = [f"{v:.4g}" + (f"±{bar:.3g}" if bar else "") for v, bar in zip(self.values, bars)]
        against = f" in {len(self.against)} of {len(shown)} ({', '.join(self.against)})" if self.against else ""
        values = f": {', '.join(shown)} {unit}" if len(shown) < FEW else ""
        return f"{self.model} {self.verdict}{like}{against}{values}{'' if self.sure else ' (within bars)'}"


def check(trend: Trend, results: Results) -> list[TrendFinding]:
    """A finding for every model that resolves the quantity in all cases of the trend, least expensive first."""
    findings = (_finding(trend, model, [results.get(case, {}).get(model) for case in trend.order]) for model in MODELS)
    return [finding for finding in findings if finding is not None]


def _finding(trend: Trend, model: str, found: list[PassResult | None]) -> TrendFinding | None:
    """Of one model's results in the trend's order; None where one is missing or does not resolve a quantity."""
    runs = [result for result in found if result is not None]
    quantities = [
        np.array([(m.factor * m.of(run), m.factor * m.bar(run)) for run in runs])
        for m in (MEASURES[name] for name in (trend.quantity, *trend.exceeds))
    ]
    if len(runs) < len(found) or not all(np.isfinite(q[:, 0]).all() for q in quantities):
        return None
    (values, bars), others = quantities[0].T, [q.T for q in quantities[1:]]
    told = TrendFinding(model, "", tuple(map(float, values)), tuple(map(float, bars)))
    if trend.of_each_case:
        margins = [(values - other, bars + bar) for other, bar in others]
        margins += [] if trend.within is None else [(values - trend.within[0], bars), (trend.within[1] - values, bars)]
        against = [any(margin[i] < 0 for margin, _ in margins) for i in range(len(runs))]
        sure = all((np.abs(margin) >= bar).all() for margin, bar in margins)
        cases = tuple(case for case, contradicts in zip(trend.order, against) if contradicts)
        return replace(told, verdict="differs" if cases else "agrees", sure=sure, against=cases)
    low, high = (values.argmin(), values.argmax()) if trend.unchanged else (0, -1)
    apart = abs(values[high] - values[low]) - trend.unchanged * np.abs(values).max()
    sure = bool(abs(apart) > bars[low] + bars[high] or not bars.any())
    return replace(told, verdict=verdict(values, trend.unchanged), sure=sure)


def verdict(values: np.ndarray, unchanged: float = 0.0) -> str:
    """Of values (n,) that should grow: a step down by more than SAME contradicts; none up by more than SAME says
    nothing. unchanged : of values that should not change, by how much of their largest they may"""
    if unchanged:
        return "agrees" if np.ptp(values) <= unchanged * np.abs(values).max() else "differs"
    steps = np.diff(values) / np.maximum(np.abs(values[:-1]), 1e-300)
    if (steps < -SAME).any():
        return "differs"
    return "agrees" if (steps > SAME).any() and values[-1] > values[0] else "same"
