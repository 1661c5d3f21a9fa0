"""What records of accelerometers say of a crossing, in a maintenance engineer's words: what is known, what cannot
be told apart, which bearer to pack, which metal to grind; and the figure of it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from matplotlib.figure import Figure

from rail_fem.design.inversion import Inversion
from rail_fem.design.observations import FORM
from rail_fem.design.posterior import form_of
from rail_fem.design.problem import Problem
from rail_fem.design.record_facts import RecordFact
from rail_fem.files.markdown import markdown_table
from rail_fem.result.low_pass import low_pass
from rail_fem.scene.units import si_factor
from rail_fem.settings.light import RigidHertzSettings
from rail_fem.show.panels import band, curve, titled
from rail_fem.show.style import NOSE, SKY, TOTAL, WING, new_figure

SURE = 0.95  # share of the posterior on one side, from which on a verdict is given
VERDICT = f"a verdict from {100 * SURE:.0f} % on"
HANGS = 0.5  # of the other bearers' ballast, below which a bearer is to be packed: our choice
WORTH = 0.3e-3  # height above or below the case's that is worth a grinder or a weld [m]: our choice
TOGETHER = 0.8  # correlation from which on two unknowns are not told apart
ALIEN = 0.12  # relative error of form that all of the posterior's 95 % exceed: the record is of another scene
ASTRAY = 0.05  # of the bounds, by which the most likely trial may lie outside the 95 % interval
ROUGH = 50.0  # of a record's size [%], beyond which an emulator's errors are no longer small beside what it tells
UNLIKELY = 1e-3  # probability of a chi-square, from which on it is no chance
BALLAST = "scene.bearers.unlike_ballast."
METAL = {  # key -> the metal, and whether a larger value is a higher one
    "scene.crossing.wing_raise": ("wing", 1.0),
    "scene.crossing.nose_lowering": ("nose", -1.0),
    "scene.crossing.leg_lowering": ("leg", -1.0),
}


@dataclass(frozen=True)
class Met:
    """How a record is met by the most likely trial. moved [m];  known, most : chi-square over its degrees of freedom at
    the smallest error of form and at the largest;  chance : of the latter"""

    name: str
    moved: float
    known: float
    most: float
    chance: float


@dataclass(frozen=True, eq=False)
class StateReport:
    """What an inversion by records says, each part found once."""

    problem: Problem
    found: Inversion

    @cached_property
    def met(self) -> list[Met]:
        """How each record is."""
        rows = []
        for fact in self.problem.records:
            numbers = self.found.likely.expected[[self.problem.columns.index(column) for column in fact.columns]]
            (known, _), (most, chance) = (fact.misfit(numbers, form) for form in FORM)
            rows.append(Met(fact.name, fact.offset(numbers), known, most, chance))
        return rows

    @cached_property
    def missed(self) -> list[float]:
        """By the emulator of each record, in per cent of its size."""
        errors = {one.group.name: np.trace(one.error) for one in self.found.known}
        return [100 * float(np.sqrt(errors[f.name] / (f.trace.reference**2).sum())) for f in self.problem.records]

    @cached_property
    def doubts(self) -> list[str]:
        """Why a record is none of any scene within the bounds, each with its threshold; none where all are met."""
        form = form_of(self.found.interval[:, -1])
        told = [
            f"{one.name}: chi-square is {one.most:.3g} for each of its numbers at an error of form of"
            f" {100 * FORM[1]:.0f} % (1 expected, chance {one.chance:.1g}, less than {UNLIKELY:g}): no scene within the"
            " bounds makes this record"
            for one in self.met
            if one.chance < UNLIKELY
        ]
        if form[0] > ALIEN:
            told.append(
                f"the error of form is {100 * form[0]:.0f} to {100 * form[1]:.0f} %, more than {100 * ALIEN:.0f} %:"
                " another wheel, speed, unit, sign, place of the sensor or unknown than the case has, or a second axle"
            )
        told += [
            f"{one.name}: the emulator misses trials by {missed:.0f} % of the record, more than {ROUGH:g} %: take more"
            " trials or narrower bounds"
            for one, missed in zip(self.met, self.missed)
            if missed > ROUGH
        ]
        return told + [
            f"{v.title}: of the most likely trial it lies {100 * far:.0f} % of its bounds, more than"
            f" {100 * ASTRAY:.0f} %, beyond its 95 % interval, where the emulator does not expect it: take more trials"
            " or narrower bounds"
            for v, far in zip(self.problem.design.vary, self._beyond())
            if far > ASTRAY
        ]

    def _beyond(self) -> np.ndarray:
        """(k,)  how far the most likely trial lies outside each interval, over the bounds."""
        low, high = self.found.interval[:, :-1]
        at = self.problem.scaled(self.found.likely.values)
        return np.maximum(np.maximum(low - at, at - high), 0.0)

    @cached_property
    def verdicts(self) -> list[str]:
        """Which bearer to pack and which metal to grind or weld, a sentence each, with its threshold; for records that
        are not met that there is none."""
        if self.doubts:
            return ["No verdict, nor are the intervals below to be trusted: " + "; ".join(self.doubts) + "."]
        problem, found, told = self.problem, self.found, []
        values = problem.scaled_back(found.samples[:, :-1])
        bearers = problem.changed(None, problem.design.passes[0]).scene.bearers
        for v, start, own, (low, high) in zip(
            problem.design.vary, problem.start_values, values.T, problem.scaled_back(found.interval[:, :-1]).T
        ):
            if v.key.startswith(BALLAST):
                number = bearers.unlike[int(v.key.removeprefix(BALLAST))] if bearers else "?"
                told.append(_packing(number, own, low, high))
            elif v.key in METAL and np.isfinite(start):
                metal, sign = METAL[v.key]
                factor = sign * si_factor(v.unit)
                sides = sorted(((low - start) * factor, (high - start) * factor))
                told.append(_grinding(metal, factor * (own - start), *sides))
        return told

    def words(self) -> list[str | list[str]]:
        """Blocks of Markdown: verdict, what is not told apart, how each record is met."""
        names = [v.title for v in self.problem.design.vary]
        like = np.atleast_2d(np.corrcoef(self.found.samples[:, : len(names)].T))
        pairs = [
            f"{names[i]} and {names[k]} ({like[i, k]:+.2f})"
            for i in range(len(names))
            for k in range(i)
            if abs(like[i, k]) > TOGETHER
        ]
        apart = f"Not told apart (correlation beyond {TOGETHER:g}): {', '.join(pairs)}." if pairs else ""
        rows = [
            [*fact.told().values(), f"{1e3 * m.moved:+.1f} mm", f"{missed:.0f} %", f"{m.known:.2f}", f"{m.most:.2f}"]
            for fact, m, missed in zip(self.problem.records, self.met, self.missed)
        ]
        sizes = [f"chi-square, form {100 * f:.0f} %" for f in FORM]
        head = ["record", "sensor", "wheel", "band", "noise", "moved", "emulator's error", *sizes]
        return [[f"- {line}" for line in self.verdicts], apart, markdown_table(head, rows)]

    def figure(self) -> Figure:
        """Each unknown's posterior beside its prior; each record and the most likely scene beside it."""
        problem, found = self.problem, self.found
        vary, records = problem.design.vary, problem.records
        columns = 3
        above = -(-len(vary) // columns)
        figure = new_figure(2.5 * above + 2.6 * len(records) + 0.8)
        grid = figure.add_gridspec(above + len(records), columns)
        axes = [figure.add_subplot(grid[divmod(k, columns)]) for k in range(len(vary))]
        values = problem.scaled_back(found.samples[:, :-1])
        for axis, v, own, (low, high), start in zip(
            axes, vary, values.T, problem.scaled_back(found.interval[:, :-1]).T, problem.start_values
        ):
            first, last = v.bounds
            axis.hist(own, bins=40, range=v.bounds, density=True, color=WING, alpha=0.6, label="posterior")
            axis.plot([first, first, last, last], [0, *[1 / (last - first)] * 2, 0], color=TOTAL, lw=1.5, label="prior")
            axis.axvspan(low, high, color=SKY, alpha=0.25, zorder=0, label="95 %")
            if first <= start <= last:
                axis.axvline(start, color=NOSE, ls="--", lw=1.5, label="the case")
            axis.set_yticks([])
            axis.set_xlabel(v.title.replace("_", " "))
        axes[0].legend(fontsize=9)
        for row, (fact, one) in enumerate(zip(records, self.met), above):
            _draw_record(figure.add_subplot(grid[row, :]), problem, found, fact, one)
        sure = "; ".join(line.split("**")[1] if "**" in line else "no verdict" for line in self.verdicts)
        return titled(figure, f"What {problem.design.source} says of the crossing\n{sure}")


def _packing(number: int | str, own: np.ndarray, low: float, high: float) -> str:
    chance = float((own < HANGS).mean())
    what = (
        f"pack bearer {number}"
        if chance >= SURE
        else f"bearer {number} is carried"
        if chance <= 1 - SURE
        else f"bearer {number}: not known"
    )
    return (
        f"**{what}**: its ballast has {low:.2g} to {high:.2g} of the others' stiffness, below {HANGS:g} with a"
        f" probability of {100 * chance:.0f} % ({VERDICT})"
    )


def _grinding(metal: str, above: np.ndarray, low: float, high: float) -> str:
    over, under = float((above > WORTH).mean()), float((above < -WORTH).mean())
    what = "not known"
    if over >= SURE:
        what = "grind it"
    elif under >= SURE:
        what = "weld it up"
    elif over + under <= 1 - SURE:
        what = "leave it"
    return (
        f"**{metal}: {what}**: {1e3 * low:+.2f} to {1e3 * high:+.2f} mm above the case's, by more than"
        f" {1e3 * WORTH:g} mm high with a probability of {100 * over:.0f} %, low {100 * under:.0f} %"
        f" ({VERDICT})"
    )


def _draw_record(axes, problem: Problem, found: Inversion, fact: RecordFact, one: Met) -> None:
    record, window = fact.trace.record, fact.trace.window
    own = next(p for p in problem.design.passes if p.name == fact.name)
    case = problem.changed(found.likely.values, own)
    fit = fact.trace.sensor.of(case.scene, case.settings(RigidHertzSettings))
    cutoff = window.frequencies[-1]
    noise = fact.trace.deviation * np.sqrt(min(1.0, 2 * cutoff / record.rate))
    seen, x = low_pass(record.values, record.rate, cutoff), 1e3 * (record.position + one.moved)
    band(axes, x, seen - 2 * noise, seen + 2 * noise, "record, two standard deviations of its noise", SKY, 0.5)
    curve(axes, x, seen, "", WING, 1.0)
    curve(axes, 1e3 * fit.position, low_pass(fit.values, fit.rate, cutoff), "most likely trial", NOSE, 1.6)
    axes.set_xlim(sorted((1e3 * window.start, 1e3 * window.end)))
    axes.set(xlabel="position x of the wheel [mm]", ylabel="[m/s^2]")
    axes.set_title(
        f"{fact.name}: {fact.trace.sensor.words}, below {cutoff:.0f} Hz; chi-square {one.known:.2f} at the smallest"
        " error of form",
        fontsize=10,
    )
    axes.legend(fontsize=9)
