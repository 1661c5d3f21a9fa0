"""A list of changes of a case as a TOML file: `rail-fem sweep cases/rows/leg.toml --out leg` runs every row and tells
the chosen quantities of each.

    title = "Why the leg throws the wheel"
    cases = ["../whole_crossing.toml"]              # each row is run on each; beside this file
    models = ["rigid_hertz"]                        # unless --model names others
    columns = ["largest leg force", "history"]      # of rail_fem.sweeps.trends.MEASURES; history: against the first row
    drawn = ["reference", "nominal P8"]             # rows whose histories are drawn over one another
    change = { "scene.speed" = "75 mph" }           # in all rows
    [rows]
    "reference" = {}
    "nominal P8" = { "scene.wheel.profile" = "P8" }

In place of [rows] a table [fleet] draws them (rail_fem.sweeps.fleet).
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field, model_validator

from rail_fem.case.casefile import Case, CaseError, load_case
from rail_fem.case.casetext import CaseTextError, read_as, read_table
from rail_fem.files.atomic import write_text_atomically
from rail_fem.files.markdown import markdown_table
from rail_fem.hierarchy import MODELS
from rail_fem.result.result import PassResult
from rail_fem.scene.scene import Frozen
from rail_fem.settings.draws import Change
from rail_fem.show.table_and_figure import write_figure
from rail_fem.sweeps.compare import core_seconds, history_error
from rail_fem.sweeps.fleet import Fleet, fleet_figure, fleet_lines, to_be_proven, values_of
from rail_fem.sweeps.group_figure import group_figure
from rail_fem.sweeps.sweep import Outcome
from rail_fem.sweeps.trends import MEASURES, TrendError

HISTORY = "history"


class Rows(Frozen):
    """A file of rows: what the head of this module shows."""

    title: str
    cases: tuple[str, ...] = Field(min_length=1)
    models: tuple[str, ...] = ("rigid_hertz",)
    columns: tuple[str, ...] = Field(min_length=1)
    drawn: tuple[str, ...] = ()
    change: dict[str, Change] = {}
    rows: dict[str, dict[str, Change]] = {}
    fleet: Fleet | None = None

    @model_validator(mode="after")
    def _of_known_names(self) -> Rows:
        if bool(self.rows) == bool(self.fleet):
            raise ValueError("give [rows], or [fleet] that draws them")
        if self.fleet and (HISTORY in self.columns or len(self.cases) > 1):
            raise ValueError(f"a fleet runs over one case, and {HISTORY} is no number of a pass")
        for names, known in (
            (self.columns, [*MEASURES, HISTORY]),
            (self.models, list(MODELS)),
            (self.drawn, list(self.rows)),
        ):
            if unknown := [name for name in names if name not in known]:
                raise ValueError(f"'{unknown[0]}' is not one of {', '.join(known)}")
        return self


def is_rows(path: Path) -> bool:
    """Whether a file is a list of changes and no case."""
    try:
        return bool({"rows", "fleet"} & set(read_table(Path(path))))
    except CaseTextError:
        return False  # said where it is read as a case


def read_rows(path: Path) -> Rows:
    """Errors: TrendError with the key and what to do, DrawError and VariationError of what a fleet draws."""
    rows = read_as(Path(path), Rows, TrendError)
    return rows if rows.fleet is None else rows.model_copy(update={"rows": rows.fleet.rows()})


def cases_of(path: Path, rows: Rows, settings: Mapping[str, Any]) -> tuple[list[Case], list[str]]:
    """A case for each row and file, named by both, and the errors of those that cannot be read. settings : go before
    the file's changes."""
    found, errors = [], []
    for words, own in rows.rows.items():
        for file in (Path(path).parent / name for name in rows.cases):
            try:
                changes = deepcopy({**rows.change, **own, **settings})  # tables are changed further
                found.append(load_case(file, changes, name_of(file, words, rows)))
            except CaseError as error:
                errors.append(f"row '{words}': {error}")
    return found, errors


def name_of(file: Path, words: str, rows: Rows) -> str:
    """Of a row's folder."""
    plain = re.sub(r"[^\w.+-]+", "_", words).strip("_")
    return plain if len(rows.cases) == 1 else f"{file.stem}-{plain}"


def write_rows(rows: Rows, outcomes: list[Outcome], out: Path) -> str:
    """Write rows.md, and rows_MODEL.png of the rows that are drawn, where the model has a history, of a fleet
    fleet.png; returns the table."""
    results = {(o.job.case.name, o.job.model): o.result for o in outcomes if o.has_result}
    labels = {name_of(Path(file), words, rows): (words, file) for words in rows.rows for file in rows.cases}
    if rows.fleet:
        return _write_fleet(rows, rows.fleet, labels, results, out)
    text = f"# {rows.title}\n\n" + "\n".join(rows_table(rows, labels, results)) + "\n"
    write_text_atomically(out / "rows.md", text)
    for model in {model for (_, model), result in results.items() if len(result.history["x"])}:
        shown = {words: results[name, model] for name, (words, _) in labels.items()
                 if words in rows.drawn and (name, model) in results}  # fmt: skip
        if shown:
            write_figure(out / f"rows_{model}.png", lambda: group_figure(rows.title, shown))
    return text


def to_prove(rows: Rows, cases: Sequence[Case], outcomes: Sequence[Outcome]) -> tuple[str, list[Case]]:
    """A fleet's better model, and those cases that it runs as well, by what the first model of the file has found of
    the first column."""
    if rows.fleet is None or not rows.fleet.proven_by:
        return "", []
    done = {o.job.case.name: o.result for o in outcomes if o.has_result and o.job.model == rows.models[0]}
    names = to_be_proven(values_of(rows.columns[0], done), rows.fleet.proven)
    return rows.fleet.proven_by, [case for case in cases if case.name in names]


def _write_fleet(
    rows: Rows, fleet: Fleet, labels: Mapping, results: Mapping[tuple[str, str], PassResult], out: Path
) -> str:
    of_model = {
        model: {words: results[name, model] for name, (words, _) in labels.items() if (name, model) in results}
        for model in MODELS
        if any(model == other for _, other in results)
    }
    text = "\n".join([f"# {rows.title}", "", *fleet_lines(fleet, rows.columns, rows.rows, of_model)]) + "\n"
    write_text_atomically(out / "rows.md", text)
    whole = {model: found for model, found in of_model.items() if model != fleet.proven_by}
    if whole:
        write_figure(out / "fleet.png", lambda: fleet_figure(rows.title, rows.columns, whole))
    return text


def rows_table(
    rows: Rows, labels: Mapping[str, tuple[str, str]], results: Mapping[tuple[str, str], PassResult]
) -> list[str]:
    """Markdown: a line for each row, case and model, the file's order. labels : name -> words of the row, case file"""
    lines = []
    for model in MODELS:
        own = {name: results[name, model] for name in labels if (name, model) in results}
        first = {labels[name][1]: result for name, result in reversed(own.items())}
        for name, result in own.items():
            words, file = labels[name]
            which = [words] if len(rows.cases) == 1 else [Path(file).stem, words]
            cells = [cell(column, result, first[file]) for column in rows.columns]
            lines.append([*which, model, *cells, f"{core_seconds(result):.2g}"])
    head = ["row"] if len(rows.cases) == 1 else ["case", "row"]
    unit = lambda column: "L2 against the first row" if column == HISTORY else f"[{MEASURES[column].unit}]"
    return markdown_table([*head, "model", *(f"{c} {unit(c)}" for c in rows.columns), "core seconds"], lines)


def cell(column: str, result: PassResult, first: PassResult) -> str:
    """A quantity in its unit, a peak with its place [mm]; "-" where it is not resolved."""
    if column == HISTORY:
        return "-" if result is first else f"{history_error(result, first):.1%}"
    measure = MEASURES[column]
    value, place = measure.factor * measure.of(result), result.peaks.get(measure.reported)
    bar, at = measure.factor * measure.bar(result), "" if place is None else f" at {1e3 * place.x:.0f}"
    return "-" if not np.isfinite(value) else f"{value:.4g}" + (f" +- {bar:.2g}" if bar else "") + at
