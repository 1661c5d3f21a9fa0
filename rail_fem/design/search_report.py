"""What a search found: a table of start and best over all passes and checks, how robust the gain is, how far the shapes
are apart, the best as a command, and two figures."""

import shlex
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rail_fem.case.variations import as_setting
from rail_fem.contact.rigid import rigid_path
from rail_fem.design.problem import Pass, Problem
from rail_fem.design.search import Found, Trial
from rail_fem.design.shape import ShapeDifference, shape_difference, told
from rail_fem.files.markdown import markdown_table, page_of
from rail_fem.show.panels import Panel, panels_figure
from rail_fem.show.table_and_figure import write_figure, write_table_and_figure
from rail_fem.sweeps.trends import MEASURES

SHAPE_SPACING = 5e-3  # of the long section that is drawn [m]
MOST_LEVEL = 6  # names beneath an axis that do not run into each other


def write_report(problem: Problem, found: Found, out: Path) -> str:
    """design.md, design.png, design_forces.png in `out`; returns the text. Errors: OSError."""
    design = problem.design
    checked = [_checked(problem, values) for values in (None, found.best.values)] if design.checks else []
    text = report(problem, found, checked)
    folder = Path(out)
    write_table_and_figure(folder / "design.md", text, folder / "design.png", lambda: design_figure(problem, found))
    write_figure(folder / "design_forces.png", lambda: force_figure(problem, found, checked))
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
    none_better = "" if best.score < found.start.score else ": no trial is better than the start"
    variables = [
        [variable.words, f"{value:.4g} {variable.unit}".strip(), f"{variable.low} to {variable.high}"]
        for variable, value in zip(design.vary, best.values)
    ]
    blocks: list[str | list[str]] = [
        f"# Search of {problem.case.name} by {design.model}",
        f"{len(found.trials)} trials (seed {design.seed}), score"
        f" {found.start.score:.4f} at the start, {best.score:.4f} at best (by {found.best_by}){none_better}.",
        markdown_table(["variable", "best", "bounds"], variables),
        _side_by_side(problem, problem.columns, found.start.numbers, best.numbers),
    ]
    if best.corrected is not None:
        blocks.append("As the proofs so far correct it, by which the search went:")
        blocks.append(_side_by_side(problem, problem.columns, found.start.expected, best.expected))
    if len(checked):
        blocks.append("Passes that were not searched on:")
        blocks.append(_side_by_side(problem, problem.columns_of(design.checks), *checked))
    shapes = [told(one) for one in shape_differences(problem, found)]
    failed = [trial for trial in found.trials if trial.fault]
    cut = [
        f"{name}: {doubt}."
        for name, values in (("start", None), ("best", best.values))
        for doubt in problem.cut_short(values)
    ]
    last = f", the last: {failed[-1].fault}" if failed else ""
    return page_of(
        [
            *blocks,
            robustness(problem, found, checked),
            cut,
            "Running surfaces, best less start:",
            markdown_table(["body", "most added [mm]", "most taken away [mm]"], shapes),
            "The best by an explicit model:",
            f"```\n{command(problem, found)}\n```",
            f"{len(failed)} of {len(found.trials)} trials could not be run{last}.",
        ]
    )


def _side_by_side(problem: Problem, columns: list[tuple[str, str]], start: np.ndarray, best: np.ndarray) -> list[str]:
    """Markdown: each quantity of each pass at the start and at best."""
    targets = {objective.quantity: objective.target for objective in problem.design.objective}
    rows = []
    for (name, quantity), a, b in zip(columns, start, best):
        unit, change = MEASURES[quantity].unit, f"{100 * (b / a - 1):+.1f} %" if a else "-"
        rows.append([name, quantity, f"{a:.3g} {unit}", f"{b:.3g} {unit}", change, str(targets[quantity] or "")])
    head = ["pass", "quantity", "start", "best", "change", "target"]
    told = len(head) - (not any(targets.values()))  # no column of targets where there are none
    return markdown_table(head[:told], [row[:told] for row in rows])


def command(problem: Problem, found: Found) -> str:
    """What runs the best, in the scene that all passes have in common."""
    common = {key: value for key, value in problem.design.set.items() if key.startswith("scene.")}
    changes = common | problem.changes(found.best.values)
    keys = " ".join(f"--set {shlex.quote(as_setting(key, value))}" for key, value in changes.items())
    return f"rail-fem run {shlex.quote(str(problem.case))} --model fe_full --out runs/best {keys}"


def shape_differences(problem: Problem, found: Found) -> list[ShapeDifference]:
    """Of the bodies over the first pass's window."""
    cases = [problem.changed(values, problem.design.passes[0]) for values in (None, found.best.values)]
    settings: Any = cases[0].runs[problem.design.model]
    low, high = sorted(settings.window(cases[0].scene))
    before, after = (case.scene.crossing for case in cases)
    bodies = shape_difference(before.surface, after.surface, low, high)
    return [one._replace(body=before.told(one.body)) for one in bodies]


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
            ends = dict.fromkeys(f"{end:+.1f}" for end in (known.min(), known.max()))  # one pass, or all alike: one
            change = f"change {'from ' if len(ends) > 1 else ''}{' to '.join(ends)} %"
            lines.append(f"{objective.quantity}: lower in {int((best < start).sum())} of {len(own)} passes, {change}.")
    return lines


def design_figure(problem: Problem, found: Found) -> Figure:
    """All trials by their first two quantities (means over the passes), one alone over their order; the rigid wheel's
    path of the first pass at the start and at best, which is the shape that it feels; how far the running surfaces are
    apart."""
    quantities = list(dict.fromkeys(objective.quantity for objective in problem.design.objective))
    alone, pair = len(quantities) == 1, (quantities * 2)[:2]
    order = {tuple(trial.values): number for number, trial in enumerate(found.trials, 1)}

    def at(trial: Trial) -> list[float]:
        means = [_mean(problem, trial, quantity) for quantity in pair]
        return [order[tuple(trial.values)] if trial is not found.start else 0, means[1]] if alone else means

    cloud = np.array([at(trial) for trial in found.trials if not trial.fault])
    front = cloud[_front(cloud)]
    goals = [
        objective.goal for quantity in pair for objective in problem.design.objective if objective.quantity == quantity
    ]
    trials: dict[str, tuple] = {"trials": (*cloud.T, "."), "start: the case as it is": (*at(found.start), "s")}
    trials[f"best by {found.best_by}"] = *at(found.best), "D"
    if None not in goals:
        trials["target"] = ([0, len(found.trials)], [goals[0]] * 2, "--") if alone else (goals[0], goals[1], "*")
    else:
        words = "no trial before is below" if alone else "no trial is below both"
        trials[words] = *front[np.argsort(front[:, 0])].T, "-"
    first = problem.design.passes[0]
    ends = ("start", None), ("best", found.best.values)
    paths = {words: 1e3 * np.array(_path(problem, values, first)) for words, values in ends}
    apart = {
        one.body: (1e3 * one.x, (1e3 * one.taken, 1e3 * one.added), "band") for one in shape_differences(problem, found)
    }
    along, title = "position x [mm]", f"running surface, best less start: {', '.join(apart)}"
    panels = [
        Panel("trial, in the order made" if alone else _axis(pair[0]), _axis(pair[1]), trials),
        Panel(along, "axle height [mm]", paths, f"path of the rigid wheel, {first.name}"),
        Panel(along, "metal added (+) or taken away (-) [mm]", apart, title),
    ]
    title = f"Search of {problem.case.name} by {problem.design.model}: {len(found.trials)} trials"
    return panels_figure(panels, title, columns=1)


def force_figure(problem: Problem, found: Found, checked: Sequence[np.ndarray] = ()) -> Figure:
    """Each quantity at the start and at best, pass by pass; checks behind them."""
    design, panels = problem.design, []
    names = [textwrap.fill(one.name, 14) for one in (*design.passes, *(design.checks if len(checked) else ()))]
    numbers = [
        np.concatenate([own, *checked[k : k + 1]]) for k, own in enumerate((found.start.numbers, found.best.numbers))
    ]
    for k, objective in enumerate(design.objective):
        of = [own.reshape(-1, len(design.objective))[:, k] for own in numbers]
        lines = {words: (names, own, look) for words, own, look in zip(("start", "best"), of, ("s", "D"))}
        panels.append(Panel("", f"{objective.quantity} [{MEASURES[objective.quantity].unit}]", lines))
    behind = f"; behind {design.passes[-1].name}: not searched on" if len(checked) else ""
    figure = panels_figure(panels, f"Start and best of {problem.case.name} by {design.model}{behind}", columns=1)
    if len(names) > MOST_LEVEL:
        for axes in figure.axes:
            axes.tick_params(axis="x", labelrotation=90.0)
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


def _path(problem: Problem, values: np.ndarray | None, one: Pass) -> tuple[np.ndarray, np.ndarray]:
    case = problem.changed(values, one)
    settings: Any = case.runs[problem.design.model]
    start, end = settings.window(case.scene)
    x = np.arange(min(start, end), max(start, end), SHAPE_SPACING)
    return x, rigid_path(case.scene, x).height
