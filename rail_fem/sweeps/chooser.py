"""The page of a sweep in one file: a quantity against what varies, both by choice, and the table of all runs."""

import html
import math
from pathlib import Path
from typing import Any

import numpy as np

from rail_fem.files.atomic import write_text_atomically
from rail_fem.show.page import Part, document, heading, listed, remark, table
from rail_fem.show.page_charts import Chart, curve, layout
from rail_fem.show.style import CURVES, LINE_OF_MODEL
from rail_fem.sweeps.parameter_figure import FEW_VALUES, Line, axis_words, drawable, lines_of, with_p2
from rail_fem.sweeps.parameters import title_of
from rail_fem.sweeps.results import AT, SweepResults, load_sweep

OF_SCENE = ("speed [m/s]", "axle load [t]", "static load [kN]")  # columns of what was asked, not found
CASE = "case"  # what a sweep may always be drawn against
DASHES = ("solid", "dash", "dot", "dashdot", "longdash")


def sweep_chart(sweep: SweepResults) -> Chart:
    """Every number of the rows against every key that varies, and against the cases: lines as parameter_figure's."""
    rows, keys = sweep.rows(), [title_of(key) for key in sweep.varied]
    number = lambda value: isinstance(value, (int, float)) and not isinstance(value, bool)
    known = (*OF_SCENE, "warnings", *keys)
    told = [name for name in rows[0] if name not in known and f"{AT} [" not in name]
    columns = [name for name in told if any(number(row[name]) and math.isfinite(row[name]) for row in rows)]
    pictures = {
        f"{column}\n{key}": _picture(rows, column, key, [other for other in keys if key != CASE and other != key])
        for column in columns
        for key in (*keys, CASE)
    }
    menus = {"quantity": columns, "against": [*keys, CASE]}
    return Chart("Click a name to hide its line; bars: the error that each run itself claims.", pictures, menus, 560)


def _picture(rows: list[dict[str, Any]], column: str, key: str, others: list[str]) -> dict[str, Any]:
    own = [row for row in (with_p2(row, column) for row in rows) if drawable(row, column, key)]
    lines = lines_of(own, others, column)
    alone = len({line.model for line in lines}) == 1
    text = any(isinstance(row[key], (str, bool)) for row in own)
    look = layout(axis_words(key), axis_words(column), height=560, hovermode="closest")
    look["xaxis"] = look["xaxis"] | ({"type": "category"} if text else {})
    if not text and len({row[key] for row in own}) <= FEW_VALUES:
        look["xaxis"] |= {"tickvals": sorted({row[key] for row in own})}
    data = [_trace(line, column, key, CURVES[k % len(CURVES)] if alone else None) for k, line in enumerate(lines)]
    return {"data": data, "layout": look}


def _trace(line: Line, column: str, key: str, own: str | None) -> dict[str, Any]:
    rows = line.rows if isinstance(line.rows[0][key], (str, bool)) else sorted(line.rows, key=lambda row: row[key])
    errors = [row["error estimate [%]"] for row in rows]
    x = [html.escape(str(row[key])) if isinstance(row[key], (str, bool)) else row[key] for row in rows]
    look: dict[str, Any] = {"mode": "lines+markers", "line_dash": DASHES[0 if own else line.kind % len(DASHES)]}
    if column.endswith("[kN]") and any(error == error for error in errors):
        size = [abs(row[column]) * error / 100 if error == error else 0 for row, error in zip(rows, errors)]
        look["error_y"] = {"type": "data", "array": size, "thickness": 1.5, "width": 4}
    about = {"x": x, "y": [row[column] for row in rows], "text": [html.escape(row[CASE]) for row in rows]}
    hover = {"hovertemplate": "%{y:.5g} at %{x}<br>case %{text}"}
    return curve(np.empty(0), np.empty(0), line.words, own or LINE_OF_MODEL[line.model][0], **look) | about | hover


def write_sweep_page(folder: Path, path: Path) -> Path:
    """Errors: FileNotFoundError where there is no result below DIR/CASE/MODEL; OSError; ModuleNotFoundError without
    plotly."""
    sweep = load_sweep(folder)
    runs = sum(len(sweep[case]) for case in sweep)
    words = f"{len(sweep)} cases, {runs} runs; varies: {', '.join(sweep.varied) or 'nothing'}"
    more = f"The page of a run, or of several beside each other: rail-fem report {folder}/CASE/MODEL ... --html FILE"
    parts: list[Part] = [
        remark(words),
        sweep_chart(sweep),
        heading("All runs"),
        table(*sweep.shown("flights [mm]")),
        remark(more),
    ]
    left_out = [heading("Left out"), listed(sweep.unusable)] if sweep.unusable else []
    write_text_atomically(path, document(f"Sweep {Path(folder).resolve().name}", [*parts, *left_out]))
    return path
