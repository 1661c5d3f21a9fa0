"""What a search found: a table of start and best over all passes, how robust the gain is, and one figure."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rail_fem.case.casefile import load_case
from rail_fem.design.problem import Problem
from rail_fem.design.search import Found, Trial
from rail_fem.light.rigid import rigid_path
from rail_fem.output.markdown import markdown_table
from rail_fem.show.style import GREY, NOSE, PURPLE, TOTAL, WING, new_figure
from rail_fem.show.table_and_figure import write_table_and_figure
from rail_fem.sweeps.trends import MEASURES

SHAPE_SPACING = 5e-3  # of the long section that is drawn [m]


def write_report(problem: Problem, found: Found, out: Path) -> str:
    """design.md and design.png in `out`; returns the text. Errors: OSError."""
    text = report(problem, found)
    folder = Path(out)
    write_table_and_figure(folder / "design.md", text, folder / "design.png", lambda: design_figure(problem, found))
    return text


def report(problem: Problem, found: Found) -> str:
    """Start and best: variables, each measure of each pass, the gain's range over the passes, failed trials."""
    design, best = problem.design, found.best
    lines = [
        f"# Search of {problem.case.name} by {design.model}",
        "",
        f"{len(found.trials)} trials (seed {design.seed}), score"
        f" {found.start.score:.4f} at the start, {best.score:.4f} at best.",
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
    targets = {objective.quantity: objective.target for objective in design.objective}
    rows = []
    for (name, quantity), a, b in zip(problem.columns, found.start.numbers, best.numbers):
        unit, change = MEASURES[quantity].unit, f"{100 * (b / a - 1):+.1f} %" if a else "-"
        rows.append([name, quantity, f"{a:.4g} {unit}", f"{b:.4g} {unit}", change, str(targets[quantity] or "")])
    lines += markdown_table(["pass", "quantity", "start", "best", "change", "target"], rows)
    lines += ["", *robustness(problem, found)]
    failed = [trial for trial in found.trials if trial.fault]
    last = f", the last: {failed[-1].fault}" if failed else ""
    lines.append(f"{len(failed)} of {len(found.trials)} trials could not be run{last}.")
    return "\n".join(lines)


def robustness(problem: Problem, found: Found) -> list[str]:
    """For each quantity without a target: in how many passes the best is below the start, and the range of change."""
    lines = []
    for objective in problem.design.objective:
        if objective.target is not None:
            continue
        own = [k for k, (_, quantity) in enumerate(problem.columns) if quantity == objective.quantity]
        start, best = found.start.numbers[own], found.best.numbers[own]
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
    """Above: all trials by their first two quantities (means over the passes); below: the rigid wheel's path of the
    first pass at the start and at best, which is the shape that it feels."""
    figure = new_figure(10.5)
    above, below = figure.subplots(2, 1, gridspec_kw={"height_ratios": [1.5, 1]})
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
    above.plot(*at(found.best), "D", ms=11, color=TOTAL, label="best by the weighted score")
    above.set(xlabel=_axis(pair[0]), ylabel=_axis(pair[1]))
    above.legend()
    first = problem.design.passes[0]
    for trial, words, colour in ((found.start, "start", NOSE), (found.best, "best", TOTAL)):
        x, height = _path(problem, None if trial is found.start else trial.values, first.set)
        below.plot(1e3 * x, 1e3 * height, color=colour, lw=2, label=f"{words}: path of the rigid wheel, {first.name}")
    below.set(xlabel="position x of the wheel [mm], 0 where the gauge lines intersect", ylabel="axle height [mm]")
    below.legend()
    figure.suptitle(f"Search of {problem.case.name} by {problem.design.model}: {len(found.trials)} trials", fontsize=14)
    return figure


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
    case = load_case(problem.case, problem.changes(values) | changes)
    settings: Any = case.runs[problem.design.model]
    start, end = settings.window(case.scene)
    x = np.arange(min(start, end), max(start, end), SHAPE_SPACING)
    return x, rigid_path(case.scene, x).height
