"""What an inversion found: unknowns and how well they are known, facts beside the scene that they make most likely,
which fact decides what; and a figure of the posterior."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from rail_fem.design.inversion import Inversion, facts_of
from rail_fem.design.posterior import form_of
from rail_fem.design.problem import Problem
from rail_fem.design.record_facts import RecordFact
from rail_fem.design.record_report import StateReport
from rail_fem.files.markdown import markdown_table, page_of
from rail_fem.show.style import GREY, NOSE, TOTAL, WING, new_figure
from rail_fem.show.table_and_figure import write_figure, write_table_and_figure

OPEN_WIDTH = 0.75  # of the bounds: an unknown whose 95 % interval is as wide is not known by these facts
DECIDES = 0.25  # change of an unknown's standard deviation or mean, in its own, that a group's absence has to make


def write_inversion(problem: Problem, found: Inversion, out: Path) -> str:
    """inversion.md and inversion.png in `out`; returns the text. Errors: OSError."""
    state, folder = StateReport(problem, found), Path(out)
    text = inversion_report(problem, found, state)
    draw = lambda: inversion_figure(problem, found)
    write_table_and_figure(folder / "inversion.md", text, folder / "inversion.png", draw)
    if problem.records:
        write_figure(folder / "state.png", state.figure)
    return text


def inversion_report(problem: Problem, found: Inversion, state: StateReport) -> str:
    """Markdown: unknowns, facts, influence."""
    design, width = problem.design, np.diff(found.interval, axis=0)[0]
    low, high = problem.scaled_back(found.interval[:, :-1])
    mean = problem.scaled_back(found.samples[:, :-1].mean(axis=0))
    rows = [
        [v.words, f"{v.low} to {v.high}", f"{m:.4g}", f"{a:.4g} to {b:.4g} {v.unit}", _share(w), f"{best:.4g} {v.unit}"]
        for v, m, a, b, w, best in zip(design.vary, mean, low, high, width, found.likely.values)
    ]
    form = 100 * form_of(np.r_[found.samples[:, -1].mean(), found.interval[:, -1]])
    failed = sum(bool(trial.fault) for trial in found.trials)
    return page_of(
        [
            f"# The scene behind {design.source}, by {design.model}",
            [
                f"{len(found.trials)} trials, {failed} of them could not be run (seed {design.seed}).",
                f"Relative error of the model's form: {form[0]:.1f} % ({form[1]:.1f} to {form[2]:.1f} %).",
            ],
            *(state.words() if problem.records else []),
            markdown_table(["unknown", "bounds", "mean", "95 %", "width over the bounds", "most likely trial"], rows),
            _fact_table(problem, found),
            *_without(problem, found),
        ]
    )


def _without(problem: Problem, found: Inversion) -> list[str | list[str]]:
    """Which group of facts decides what; none of one alone."""
    if not len(found.without):
        return []
    head = ["left out", *(v.label.replace("\n", " ") for v in problem.design.vary)]
    return [
        "Without one group of facts each, the standard deviation of each unknown over that with all, in brackets by how"
        f" many of these its mean moves; blank below {DECIDES:g}:",
        markdown_table(head, _influence(found)),
    ]


def coverage_words(problem: Problem, found: np.ndarray) -> str:
    """Of `covered`: how many unknowns of known scenes lie in their 95 % intervals, and how wide these are."""
    inside, width = found.transpose(2, 0, 1)
    told = (
        f"Scenes of known truth: {len(found)}; {100 * inside.mean():.1f} % of {inside.size} unknowns lie in their 95 %"
        f" intervals, which are {100 * width.mean():.0f} % of the bounds wide."
    )
    rows = [
        [v.name, f"{100 * own.mean():.0f} %", f"{100 * w.mean():.0f} %"]
        for v, own, w in zip(problem.design.vary, inside.T, width.T)
    ]
    return page_of([told, markdown_table(["unknown", "inside", "mean width over the bounds"], rows)])


def _share(width: float) -> str:
    return f"{100 * width:.0f} %" + (f" (not known, from {100 * OPEN_WIDTH:.0f} % on)" if width >= OPEN_WIDTH else "")


def _fact_table(problem: Problem, found: Inversion) -> list[str]:
    head = ["fact", "pass", "printed", "start", "most likely", "of it correction", "scatter of it"]
    rows = _facts(problem, found)
    return markdown_table(head, rows) if rows else []


def _facts(problem: Problem, found: Inversion) -> list[list[str]]:
    rows = []
    for one in found.known:
        group = one.group
        if isinstance(group, RecordFact):
            continue
        sides = [facts_of(problem, group, trial.expected[None])[0] for trial in (found.start, found.likely)]
        shifts = sides[1] - facts_of(problem, group, found.likely.numbers[None])[0]
        bound = {"": "", "least": ">= ", "most": "<= "}[group.bound]
        shown = lambda value: f"{np.exp(value) if group.relative else value:.4g}"
        change = lambda shift: f"{100 * np.expm1(shift):+.1f} %" if group.relative else f"{shift:+.3g}"
        for name, value, a, b, shift in zip(group.value, group.values, *sides, shifts):
            printed = f"{bound}{shown(value)} {group.unit} +- {group.sd}"
            told = [change(shift) if shift else "", change(one.scatter).lstrip("+") if one.scatter else ""]
            rows.append([group.name, name, printed, shown(a), shown(b), *told])
    return rows


def _influence(found: Inversion) -> list[list[str]]:
    mean, own = found.samples.mean(axis=0), found.samples.std(axis=0)
    rows = []
    for one, (means, deviations) in zip(found.known, found.without.transpose(0, 2, 1)):
        wider, moved = deviations / own, (means - mean) / own
        told = np.maximum(np.abs(wider - 1), np.abs(moved)) > DECIDES
        cells = [f"{w:.2f} ({m:+.1f})" if show else "" for w, m, show in zip(wider, moved, told)]
        rows.append([one.group.name, *cells[:-1]])
    return rows


def inversion_figure(problem: Problem, found: Inversion) -> Figure:
    """On the diagonal each unknown's posterior over its bounds with its 95 % interval, below it all pairs; above it how
    far the facts are met, by group."""
    vary = problem.design.vary
    count = len(vary)
    figure = new_figure(12.5)
    grid = figure.add_gridspec(count, count + 1)
    at = problem.scaled_back(found.samples[:, :-1])
    likely, (low, high) = found.likely.values, problem.scaled_back(found.interval[:, :-1])
    for i in range(count):
        for k in range(i + 1):
            axes = figure.add_subplot(grid[i, k])
            axes.set_xlim(vary[k].bounds)
            axes.grid(visible=False)
            if i == k:
                axes.hist(at[:, i], bins=24, range=vary[i].bounds, color=WING, alpha=0.6)
                axes.axvspan(low[i], high[i], color=GREY, alpha=0.2, zorder=0)
                axes.axvline(likely[i], color=NOSE, lw=2)
                axes.set_yticks([])
                axes.set_title(f"{low[i]:.3g} to {high[i]:.3g}", fontsize=9)
            else:
                axes.plot(at[:, k], at[:, i], ".", ms=2, color=WING, alpha=0.5)
                axes.plot(likely[k], likely[i], "D", ms=5, color=NOSE)
                axes.set_ylim(vary[i].bounds)
            axes.tick_params(labelsize=9, labelbottom=i == count - 1, labelleft=k == 0 and i > 0)
            axes.locator_params(nbins=3)
            if i == count - 1:
                axes.set_xlabel(vary[k].label, fontsize=9)
            if k == 0 and i > 0:
                axes.set_ylabel(vary[i].label, fontsize=9)
    _draw_facts(problem, found, figure.add_axes((0.7, 0.56, 0.29, 0.39)))
    place = problem.scaled(likely)
    beside = " (at a bound)" if ((place < 0.01) | (place > 0.99)).any() else ""
    figure.suptitle(
        f"What {problem.design.source} says of the scene, by {problem.design.model}: 95 % intervals"
        f" grey, the most likely trial orange{beside}",
        fontsize=13,
    )
    return figure


def _draw_facts(problem: Problem, found: Inversion, axes) -> None:
    """How many standard deviations of source and form each group's facts are missed by, start and most likely scene."""
    form = form_of(found.samples[:, -1].mean())
    names = [one.group.name for one in found.known]
    for trial, words, colour, marker in ((found.start, "start", GREY, "s"), (found.likely, "most likely", NOSE, "D")):
        for row, one in enumerate(found.known):
            group = one.group
            own = [problem.columns.index(column) for column in group.columns]
            beside = group.missed(trial.expected[own], form)
            label = words if not row else ""
            axes.plot(beside.clip(-6, 6), np.full(len(beside), row), marker, ms=5, color=colour, label=label)
    axes.axvspan(-2, 2, color=GREY, alpha=0.15, zorder=0)
    axes.axvline(0, color=TOTAL, lw=1)
    axes.set_yticks(range(len(names)), names, fontsize=9)
    axes.invert_yaxis()
    axes.set_xlabel("missed by, in standard deviations of source and form (6 and more at the edge)", fontsize=9, x=0.2)
    axes.legend(fontsize=9, loc="lower right")
