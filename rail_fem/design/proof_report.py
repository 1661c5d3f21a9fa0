"""What the explicit model says of a design: a table of the start against the best for each pass, what of the light
model's gain holds, and a figure."""

import textwrap
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from rail_fem.design.correction import proven_scores
from rail_fem.design.problem import Problem
from rail_fem.design.proof import MODEL, PROVEN, SEARCHED, ProofRun, ProvenShape, without_finer
from rail_fem.files.markdown import markdown_table, page_of
from rail_fem.result.trust import verdict_words
from rail_fem.show.panels import Panel, panels_figure
from rail_fem.show.table_and_figure import write_table_and_figure
from rail_fem.sweeps.compare import core_seconds

LOWER, HIGHER, WITHIN, SAME, UNKNOWN = "lower", "higher", "within the bars", "same", "-"


def write_proof(problem: Problem, runs: Sequence[ProofRun], out: Path) -> str:
    """proof.md and proof.png in `out`; returns the text. Errors: OSError."""
    text = proof_report(problem, runs)
    folder = Path(out)
    write_table_and_figure(folder / "proof.md", text, folder / "proof.png", lambda: proof_figure(problem, runs))
    return text


def verdict(start: tuple[float, float], best: tuple[float, float]) -> str:
    """Of a value and its bar at the start and at best: one of LOWER, HIGHER, WITHIN, SAME, UNKNOWN."""
    (a, own), (b, other) = start, best
    if not np.isfinite([a, b]).all():
        return UNKNOWN
    if a == b:
        return SAME
    if abs(b - a) <= own + other:
        return WITHIN
    return LOWER if b < a else HIGHER


def proof_report(problem: Problem, runs: Sequence[ProofRun]) -> str:
    """Markdown: a table for each size and shape, a line for each quantity, trust, failures, cost."""
    blocks: list[str | list[str]] = [f"# Proof of a search on {problem.case.name} by {MODEL}"]
    for size, shape in _pairs(runs):
        own = [(_start_of(runs, run), run) for run in runs if run.size == size and run.shape == shape]
        head = ["pass", "quantity", "start", shape.words, "change", MODEL, problem.design.model]
        rows = [row for start, run in own for row in _rows(problem, start, run)]
        blocks += [f"Elements of {1e3 * size:g} mm, {shape.words}:", markdown_table(head, rows), _summary(own)]
    seconds = sum(core_seconds(run.result) for run in runs if run.result is not None)
    return page_of(
        [
            *blocks,
            _told_scores(problem, runs),
            *_told("How far the runs may be trusted:", [(run, _trust(run)) for run in runs]),
            *_told("Could not be run:", [(run, run.fault) for run in runs]),
            f"{len(runs)} runs, {seconds / 60:.1f} core minutes. Without +- no bar is claimed.",
        ]
    )


def _told_scores(problem: Problem, runs: Sequence[ProofRun]) -> list[str]:
    """The shapes by this model's numbers, with what is higher than at the start."""
    rows = []
    for shape, score, above in proven_scores(problem, runs):
        worse = [
            f"{': '.join(problem.columns[k])} {'from 0' if np.isinf(above[k]) else f'{100 * above[k]:+.0f} %'}"
            for k in np.flatnonzero(~np.isnan(above))
        ]
        rows.append([shape.words, f"{score:.4f}", ", ".join(worse) or "nothing"])
    return markdown_table(["shape", f"score by {MODEL}", "higher than at the start"], rows) if rows else []


def _pairs(runs: Sequence[ProofRun]) -> list[tuple[float, ProvenShape]]:
    """Sizes and shapes beside the start, in the order of the runs."""
    found: list[tuple[float, ProvenShape]] = []
    for run in runs:
        if run.shape.values is not None and np.isfinite(run.size) and (run.size, run.shape) not in found:
            found.append((run.size, run.shape))
    return found


def _start_of(runs: Sequence[ProofRun], run: ProofRun) -> ProofRun:
    return next(r for r in runs if r.shape.values is None and r.one == run.one and r.size == run.size)


def _rows(problem: Problem, start: ProofRun, best: ProofRun) -> list[list[str]]:
    rows = []
    for name, measure in PROVEN.items():
        a, b = start.value(name), best.value(name)
        if not np.isfinite([a[0], b[0]]).any():
            continue
        cell = lambda pair: "-" if np.isnan(pair[0]) else f"{told(*pair)} {measure.unit}"
        change = f"{100 * (b[0] / a[0] - 1):+.0f} %" if np.isfinite([a[0], b[0]]).all() and a[0] else "-"
        light = _light(problem, name, start, best)
        rows.append([best.one.name, name, cell(a), cell(b), change, verdict(a, b), light])
    return rows or [[best.one.name, *["-"] * 6]]


def told(value: float, bar: float) -> str:
    """A value with its bar, where there is one."""
    return f"{value:.3g} +- {bar:.2g}" if bar else f"{value:.3g}"


def _light(problem: Problem, name: str, start: ProofRun, best: ProofRun) -> str:
    """The change that the search's own model found."""
    column = best.one.name, SEARCHED.get(name, "")
    if column not in problem.columns:
        return "-"
    k = problem.columns.index(column)
    a, b = start.shape.trial.numbers[k], best.shape.trial.numbers[k]
    return f"{100 * (b / a - 1):+.0f} %" if a else "-"


def _summary(pairs: list[tuple[ProofRun, ProofRun]]) -> list[str]:
    """For each quantity, in how many passes it is lower, higher, or neither."""
    lines = []
    for name in PROVEN:
        found = [verdict(start.value(name), best.value(name)) for start, best in pairs]
        known = [word for word in found if word != UNKNOWN]
        if known:
            counts = [f"{word} in {known.count(word)}" for word in (LOWER, WITHIN, SAME, HIGHER) if word in known]
            lines.append(f"- {name}: {', '.join(counts)} of {len(known)}")
    return lines


def _trust(run: ProofRun) -> str:
    return "" if run.result is None else verdict_words(run.result.trust)


def _told(head: str, found: Sequence[tuple[ProofRun, str]]) -> list[str | list[str]]:
    rows = [f"- {run.shape.words}, {run.one.name}, {1e3 * run.size:g} mm: {words}" for run, words in found if words]
    return [head, rows] if rows else []


def proof_figure(problem: Problem, runs: Sequence[ProofRun]) -> Figure:
    """A panel for each quantity: all shapes in each pass, with error bars; what the light model said as crosses. Each
    pass at its own element size."""
    own, panels = without_finer(runs), []
    sizes = sorted({f"{1e3 * run.size:g} mm" for run in own if np.isfinite(run.size)})
    for name in PROVEN:
        lines: dict[str, tuple] = {}
        for shape in {run.shape.name: run.shape for run in own}.values():
            mine = [run for run in own if run.shape == shape and np.isfinite(run.value(name)[0])]
            if mine:
                passes = [run.one.name for run in mine]
                lines[shape.words] = passes, np.array([run.value(name) for run in mine]).T, "bars"
                columns = [(one, SEARCHED.get(name, "")) for one in passes]
                if all(column in problem.columns for column in columns):
                    light = [shape.trial.numbers[problem.columns.index(column)] for column in columns]
                    lines[f"{shape.words}, by {problem.design.model}"] = passes, light, "x"
        if lines:
            panels.append(Panel("", f"{textwrap.fill(name, 24)} [{PROVEN[name].unit}]", lines))
    title = f"Start and best of {problem.case.name} by {MODEL}, elements of {' and '.join(sizes)}"
    return panels_figure(panels, title)
