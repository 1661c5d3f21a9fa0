"""What a search found: a table of start and best over all passes and checks, how robust the gain is, how far the shapes
are apart, the best as a command, and two figures."""

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rail_fem.case.casefile import load_case
from rail_fem.design.problem import Problem
from rail_fem.design.search import Found, Trial
from rail_fem.design.shape import ShapeDifference, shape_difference, told
from rail_fem.light.rigid import rigid_path
from rail_fem.output.markdown import markdown_table
from rail_fem.show.panels import new_panels, titled
from rail_fem.show.style import BODY, GREY, NOSE, PURPLE, TOTAL, WING, lettering, new_figure, save
from rail_fem.show.table_and_figure import write_table_and_figure
from rail_fem.sweeps.trends import MEASURES

SHAPE_SPACING = 5e-3  # of the long section that is drawn [m]


def write_report(problem: Problem, found: Found, out: Path) -> str:
    """design.md, design.png, design_forces.png in `out`; returns the text. Errors: OSError."""
    design = problem.design
    checked = [_checked(problem, values) for values in (None, found.best.values)] if design.checks else []
    text = report(problem, found, checked)
    folder = Path(out)
    write_table_and_figure(folder / "design.md", text, folder / "design.png", lambda: design_figure(problem, found))
    with lettering():
        save(force_figure(problem, found, checked), folder / "design_forces.png")
    return text


def _checked(problem: Problem, values: np.ndarray | None) -> np.ndarray:
    """The numbers of the checks; NaN for those that cannot be run."""
    parts = []
    for check in problem.design.checks:
        try:
            parts.append(problem.numbers(values, (check,)))
        except (ValueError, ArithmeticError):  # a wheel that derails on one of the two
            parts.append(np.full(len(problem.design.objective), np.nan))
    return np.concatenate(parts)


def report(problem: Problem, found: Found, checked: Sequence[np.ndarray] = ()) -> str:
    """Start and best: variables, each measure of each pass, the gain's range over the passes, failed trials.

    checked : the numbers of the checks at the start and at best
    """
    design, best = problem.design, found.best
    lines = [
        f"# Search of {problem.case.name} by {design.model}",
        "",
        f"{len(found.trials)} trials (seed {design.seed}), score"
        f" {found.start.score:.4f} at the start, {best.score:.4f} at best (by {found.best_by}).",
        "",
        *markdown_table(
            ["variable", "best", "bounds"],
            [
                [variable.key, str(variable.text(value)), f"{variable.low} to {variable.high}"]
                for variable, value in zip(design.vary, best.values)
            ],
        ),
        "",
    ]
    lines += _side_by_side(problem, problem.columns, found.start.numbers, best.numbers)
    if best.corrected is not None:
        lines += ["", "As the proofs so far correct it, by which the search went:", ""]
        lines += _side_by_side(problem, problem.columns, found.start.expected, best.expected)
    if len(checked):
        lines += ["", "Passes that were not searched on:", ""]
        lines += _side_by_side(problem, problem.columns_of(design.checks), *checked)
    lines += ["", *robustness(problem, found, checked)]
    lines += ["Running surfaces, best less start:", ""]
    shapes = shape_differences(problem, found)
    lines += markdown_table(["body", "most added [mm]", "most taken away [mm]"], [told(one) for one in shapes])
    lines += ["", "The best by an explicit model:", "", f"```\n{command(problem, found)}\n```", ""]
    failed = [trial for trial in found.trials if trial.fault]
    last = f", the last: {failed[-1].fault}" if failed else ""
    lines.append(f"{len(failed)} of {len(found.trials)} trials could not be run{last}.")
    return "\n".join(lines)


def _side_by_side(problem: Problem, columns: list[tuple[str, str]], start: np.ndarray, best: np.ndarray) -> list[str]:
    """Markdown: each quantity of each pass at the start and at best."""
    targets = {objective.quantity: objective.target for objective in problem.design.objective}
    rows = []
    for (name, quantity), a, b in zip(columns, start, best):
        unit, change = MEASURES[quantity].unit, f"{100 * (b / a - 1):+.1f} %" if a else "-"
        rows.append([name, quantity, f"{a:.4g} {unit}", f"{b:.4g} {unit}", change, str(targets[quantity] or "")])
    return markdown_table(["pass", "quantity", "start", "best", "change", "target"], rows)


def command(problem: Problem, found: Found) -> str:
    """What runs the best."""
    keys = " ".join(f'--set "{key}={value}"' for key, value in problem.changes(found.best.values).items())
    return f"rail-fem run {problem.case} --model fe_full --out runs/best {keys}"


def shape_differences(problem: Problem, found: Found) -> list[ShapeDifference]:
    """Of the bodies over the first pass's window."""
    first = problem.design.passes[0].set
    cases = [
        load_case(problem.case, problem.changes(v) | first).by(problem.design.model) for v in (None, found.best.values)
    ]
    settings: Any = cases[0].runs[problem.design.model]
    low, high = sorted(settings.window(cases[0].scene))
    before, after = (case.scene.crossing.surface for case in cases)
    return shape_difference(before, after, low, high)


def robustness(problem: Problem, found: Found, checked: Sequence[np.ndarray] = ()) -> list[str]:
    """For each quantity without a target: in how many passes and checks the best is below the start, and the range of
    change."""
    columns = problem.columns + (problem.columns_of(problem.design.checks) if len(checked) else [])
    at_start, at_best = (
        np.concatenate([own, checked[k]]) if len(checked) else own
        for k, own in enumerate((found.start.numbers, found.best.numbers))
    )
    lines = []
    for objective in problem.design.objective:
        if objective.target is not None:
            continue
        own = [k for k, (_, quantity) in enumerate(columns) if quantity == objective.quantity]
        start, best = at_start[own], at_best[own]
        with np.errstate(invalid="ignore", divide="ignore"):
            change = 100 * (best / start - 1)
        known = change[np.isfinite(change)]
        if len(known):
            lines.append(
                f"{objective.quantity}: lower in {int((best < start).sum())} of {len(own)} passes, change from"
                f" {known.min():+.1f} to {known.max():+.1f} %."
            )
    return [*lines, ""] if lines else []


def design_figure(problem: Problem, found: Found) -> Figure:
    """Above: all trials by their first two quantities (means over the passes); middle: the rigid wheel's path of the
    first pass at the start and at best, which is the shape that it feels; below: how far the running surfaces are
    apart."""
    figure, (above, below, shape) = new_panels(13.0, 3, 1, height_ratios=[1.5, 1, 1])
    shape.sharex(below)
    quantities = list(dict.fromkeys(objective.quantity for objective in problem.design.objective))
    pair = (quantities * 2)[:2]
    at = lambda trial: [_mean(problem, trial, quantity) for quantity in pair]
    cloud = np.array([at(trial) for trial in found.trials if not trial.fault])
    front = cloud[_front(cloud)]
    above.plot(*cloud.T, "o", ms=4, color=GREY, alpha=0.6, label="trials")
    goals = {objective.quantity: objective.goal for objective in problem.design.objective}
    if None not in (goals[pair[0]], goals[pair[1]]):
        above.plot(goals[pair[0]], goals[pair[1]], "*", ms=18, color=PURPLE, label="target")
    else:
        above.plot(*front[np.argsort(front[:, 0])].T, "-", color=WING, lw=1.5, label="no trial is below both")
    above.plot(*at(found.start), "s", ms=11, color=NOSE, label="start: the case as it is")
    above.plot(*at(found.best), "D", ms=11, color=TOTAL, label=f"best by {found.best_by}")
    above.set(xlabel=_axis(pair[0]), ylabel=_axis(pair[1]))
    above.legend()
    first = problem.design.passes[0]
    for trial, words, colour in ((found.start, "start", NOSE), (found.best, "best", TOTAL)):
        x, height = _path(problem, None if trial is found.start else trial.values, first.set)
        below.plot(1e3 * x, 1e3 * height, color=colour, lw=2, label=f"{words}: path of the rigid wheel, {first.name}")
    below.set(ylabel="axle height [mm]")
    below.legend()
    for one in shape_differences(problem, found):
        x, words = 1e3 * one.x, "leg and wing" if one.body == "wing" else one.body
        shape.fill_between(x, 1e3 * one.taken, 1e3 * one.added, color=BODY[one.body], alpha=0.5, label=words)
    shape.axhline(0, color=GREY, lw=1)
    shape.set(
        xlabel="position x [mm], 0 where the gauge lines intersect", ylabel="metal added (+) or\ntaken away (-) [mm]"
    )
    shape.legend(title="running surface, best less start")
    return titled(figure, f"Search of {problem.case.name} by {problem.design.model}: {len(found.trials)} trials")


def force_figure(problem: Problem, found: Found, checked: Sequence[np.ndarray] = ()) -> Figure:
    """Bars of each quantity at the start and at best, a pair a pass; checks beside them, hatched."""
    design = problem.design
    quantities = list(dict.fromkeys(objective.quantity for objective in design.objective))
    figure = new_figure(2.6 * len(quantities) + 1.4)
    names = [one.name for one in (*design.passes, *(design.checks if len(checked) else ()))]
    at = np.arange(len(names))
    for axes, quantity in zip(figure.subplots(len(quantities), 1, sharex=True, squeeze=False)[:, 0], quantities):
        k = quantities.index(quantity)
        for side, (trial, words, colour) in enumerate(((found.start, "start", NOSE), (found.best, "best", TOTAL))):
            values = trial.numbers.reshape(-1, len(design.objective))[:, k]
            if len(checked):
                values = np.concatenate([values, checked[side].reshape(-1, len(design.objective))[:, k]])
            bars = axes.bar(at + 0.4 * side - 0.2, values, width=0.38, color=colour, label=words)
            for bar in bars[len(design.passes) :]:
                bar.set(hatch="//", edgecolor="white")
        axes.set_ylabel(f"{quantity}\n[{MEASURES[quantity].unit}]")
        axes.grid(axis="x", visible=False)
    few = len(names) <= 9
    axes.set_xticks(at, [textwrap.fill(name, 14 if few else 8) for name in names], fontsize=10 if few else 9)
    figure.axes[0].legend(ncols=2, loc="upper left", bbox_to_anchor=(0, 1.28))
    hatched = "; hatched: not searched on" if len(checked) else ""
    return titled(figure, f"Start and best of {problem.case.name} by {design.model}{hatched}")


def _axis(quantity: str) -> str:
    return f"{quantity}, mean over the passes [{MEASURES[quantity].unit}]"


def _mean(problem: Problem, trial: Trial, quantity: str) -> float:
    weights = [one.weight for one in problem.design.passes]
    own = [k for k, (_, of) in enumerate(problem.columns) if of == quantity]
    return float(np.average(trial.numbers[own], weights=weights))


def _front(points: np.ndarray) -> np.ndarray:
    """Indices of the points below-left of which there is none."""
    beaten = lambda p: ((points <= p).all(axis=1) & (points < p).any(axis=1)).any()
    return np.array([k for k, p in enumerate(points) if not beaten(p)])


def _path(problem: Problem, values: np.ndarray | None, changes: dict) -> tuple[np.ndarray, np.ndarray]:
    case = load_case(problem.case, problem.changes(values) | changes).by(problem.design.model)
    settings: Any = case.runs[problem.design.model]
    start, end = settings.window(case.scene)
    x = np.arange(min(start, end), max(start, end), SHAPE_SPACING)
    return x, rigid_path(case.scene, x).height
