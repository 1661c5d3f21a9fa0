"""Figure of a reported quantity against what varies in a sweep: a line for each model and each value of what else
varies."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import AutoLocator

from rail_fem.hierarchy import MODELS
from rail_fem.show.panels import legend_above, new_panels
from rail_fem.show.style import CURVES, GREY, LINE_OF_MODEL, scene_words
from rail_fem.sweeps.parameters import find_column, title_of

if TYPE_CHECKING:
    from rail_fem.sweeps.results import SweepResults

DASHES = ("-", (0, (6, 2)), (0, (2, 2)), (0, (6, 2, 1, 2)), (0, (1, 1)), (0, (8, 2, 2, 2, 2, 2)))
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")  # where one model's lines are told apart
FEW_VALUES = 12  # up to so many are all named on the axis
IN_SCENE_WORDS = ("scene.crossing", "scene.wheel", "scene.direction", "scene.vehicle")
NO_QUANTITY = ("case", "model")
IMPACT, P2 = "impact_on_wheel [kN]", "p2 [kN]"  # the formula's P2 is the force of that impact


@dataclass(frozen=True)
class Line:
    """A line of the figure: rows of one model and of one value of each other key that varies."""

    model: str
    rows: list[dict[str, Any]]
    words: str
    kind: int  # of the lines of its model


def parameter_figure(
    sweep: SweepResults, quantity: str, against: str, models: tuple[str, ...] = (), ax: Any = None
) -> Any:
    """A quantity of a sweep against what varies, a line a model and group.

    Parameters
    ----------
    sweep : SweepResults
        As `load_sweep` reads it.
    quantity : str
        A column of the sweep's rows, e.g. "impact_on_wheel".
    against : str
        What varies, e.g. "scene.speed" or "speed".
    models : tuple of str
        Only these; (): all.
    ax : matplotlib Axes, optional
        One's own, drawn on without a title.

    Returns
    -------
    matplotlib Figure, or `ax`

    Raises
    ------
    ValueError
        For names that are no columns, or where no run resolves the quantity.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> scene = rail_fem.load_case(rail_fem.example("nose_transfer")).scene
    >>> for speed in ("50 mph", "75 mph"):
    ...     rail_fem.solve("p2_formula", scene.replace(speed=speed)).save(f"pair/{speed[:2]}/p2_formula")
    >>> axes = rail_fem.plot_sweep(rail_fem.load_sweep("pair"), "p2", "speed", ax=Figure().subplots())
    >>> len(axes.lines) > 0
    True
    """
    rows = sweep.rows()
    key = find_column(against, [title_of(key) for key in sweep.varied], "--against")
    column = find_column(quantity, [name for name in rows[0] if name not in NO_QUANTITY], "--quantity")
    rows = [with_p2(row, column) for row in rows if not models or row["model"] in models]
    rows = [row for row in rows if drawable(row, column, key)]
    if not rows:
        raise ValueError(f"--quantity {quantity}: no run of {', '.join(models) or 'this sweep'} resolves it")
    positions = _positions([row[key] for row in rows])
    lines = lines_of(rows, [name for name in map(title_of, sweep.varied) if name != key], column)
    figure, axes = (None, ax) if ax is not None else new_panels(7.5)
    for number, line in enumerate(lines):
        _draw_line(axes, line, (key, column), positions, number, alone=len({one.model for one in lines}) == 1)
    _draw_static_load(axes, rows, (key, column), positions)
    _label(axes, (key, column), positions)
    if figure is None:
        return ax
    _give_title(figure, sweep, rows, column, key)
    return figure


def with_p2(row: dict[str, Any], column: str) -> dict[str, Any]:
    """The row, of a formula with its P2 as the impact."""
    return row | {column: row.get(P2, math.nan)} if column == IMPACT and math.isnan(row[column]) else row


def drawable(row: dict[str, Any], column: str, key: str) -> bool:
    """Whether a row has both numbers."""
    value, position = row[column], row[key]
    return math.isfinite(value) and not (isinstance(position, float) and math.isnan(position))


def lines_of(rows: list[dict[str, Any]], others: list[str], column: str) -> list[Line]:
    """From the least expensive model on, in the order of the other values; those that do not differ are not told."""
    others = [name for name in others if len({str(row[name]) for row in rows if str(row[name]) != "nan"}) > 1]
    lines: dict[tuple[str, ...], Line] = {}
    for row in sorted(rows, key=lambda row: list(MODELS).index(row["model"])):
        told = (row["model"], *(str(row[name]) for name in others))
        if told not in lines:
            kind = sum(line.model == row["model"] for line in lines.values())
            lines[told] = Line(row["model"], [], _words(row, others, column), kind)
        lines[told].rows.append(row)
    return list(lines.values())


def _words(row: dict[str, Any], others: list[str], column: str) -> str:
    told = [f"{row['model']} (its P2)" if column == IMPACT and row["model"] == "p2_formula" else row["model"]]
    for name in others:
        key, _, unit = name.partition(" [")
        value = f"{row[name]:.6g}" if isinstance(row[name], float) else str(row[name])
        told.append(f"{key.rsplit('.', 1)[-1].replace('_', ' ')} {value} {unit.rstrip(']')}".rstrip())
    return ", ".join(told)


def _positions(values: list[Any]) -> dict[Any, float]:
    """Where each value stands on the axis: numbers at themselves, text in turn."""
    known = list(dict.fromkeys(values))
    numbers = all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in known)
    return {value: float(value) if numbers else float(i) for i, value in enumerate(known)}


def _draw_line(axes, line: Line, names: tuple[str, str], positions: dict[Any, float], number: int, alone: bool) -> None:
    """alone : the figure shows one model, whose lines are told apart by colour and marker"""
    key, column = names
    x = np.array([positions[row[key]] for row in line.rows])
    y = np.array([row[column] for row in line.rows])
    colour, marker = LINE_OF_MODEL[line.model]
    if alone:
        colour, marker = CURVES[number % len(CURVES)], MARKERS[number % len(MARKERS)]
    order, dashes = np.argsort(x, kind="stable"), DASHES[(number // len(CURVES) if alone else line.kind) % len(DASHES)]
    look = dict(color=colour, ls=dashes, lw=2, marker=marker, ms=8, mfc="white", mew=2, zorder=3 + 0.01 * number)
    axes.plot(x[order], y[order], label=line.words, **look)
    error = np.array([row["error estimate [%]"] for row in line.rows]) / 100
    if column.endswith("[kN]") and np.isfinite(error).any():
        axes.errorbar(x, y, np.nan_to_num(error * np.abs(y)), fmt="none", ecolor=colour, elinewidth=1.5, capsize=5)


def _draw_static_load(axes, rows, names, positions) -> None:
    """A line for each load; one through all where the load is what varies along the axis."""
    key, column = names
    if not column.endswith("[kN]") or column.startswith("static load"):
        return
    known = sorted({(positions[row[key]], float(f"{row['static load [kN]']:.5g}")) for row in rows})
    loads = sorted({load for _, load in known})
    look = dict(color=GREY, lw=1.4, zorder=1)
    if 1 < len(loads) and len(known) == len({position for position, _ in known}):
        axes.plot(*np.transpose(known), ls="--", label="static wheel load", **look)
        return
    for number, load in enumerate(loads):
        axes.axhline(load, ls=DASHES[1 + number % (len(DASHES) - 1)], label=f"static wheel load, {load:.1f} kN", **look)


def _label(axes, names, positions) -> None:
    key, column = names
    axes.set(xlabel=axis_words(key), ylabel=axis_words(column))
    axes.margins(x=0.06, y=0.12)
    if any(position != value for value, position in positions.items()):
        axes.set_xticks(list(positions.values()), [str(value) for value in positions])
    elif len(positions) <= FEW_VALUES:
        axes.set_xticks(sorted(positions.values()))
    else:
        axes.xaxis.set_major_locator(AutoLocator())
    legend_above(axes, borderaxespad=None, handlelength=4.5)


def axis_words(name: str) -> str:
    """A column's name as an axis says it."""
    bare, _, unit = name.partition(" [")
    words = bare.removeprefix("scene.").replace("_", " ").replace(".", ", ")
    return f"{words} [{unit}" if unit else words


def _give_title(figure: Figure, sweep: SweepResults, rows: list[dict[str, Any]], column: str, key: str) -> None:
    """What is seen; the scene, as far as it is the same for all; what the bars are."""
    lines = [f"{axis_words(column).partition(' [')[0]} against {axis_words(key).partition(' [')[0]}"]
    varied = set(sweep.varied)
    if not any(name.startswith(IN_SCENE_WORDS) for name in varied):
        scene = sweep[rows[0]["case"]][rows[0]["model"]].scene
        lines.append(scene_words(scene, speed="scene.speed" not in varied))
    errors = [row["error estimate [%]"] for row in rows if math.isfinite(row["error estimate [%]"])]
    if column.endswith("[kN]") and errors:
        lines.append(f"bars: numerics, the error that each run itself claims, all added, {max(errors):.2g} % at most")
    if column.endswith("[kN]"):
        lines += [
            f"model: nine tenths of {model}'s forces within {off[0]:.0%} of fe_full's, all {off[1]:.0%} (16 cases)"
            for model in MODELS
            if (off := MODELS[model].off) and any(row["model"] == model for row in rows)
        ]
    figure.suptitle("\n".join(lines), fontsize=13)
