"""Figures of a group of cases: forces and wheel paths over one another, plastic strain beneath one another with one
legend."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from rail_fem.hierarchy import MODELS
from rail_fem.result.fields import Fields, FieldsError
from rail_fem.result.result import PassResult
from rail_fem.scene.scene import Scene
from rail_fem.scene.units import show
from rail_fem.show.fields import faces_from_above, read_crossing
from rail_fem.show.panels import cells, legend_above, new_panels, strain_bar, strain_paint, strain_scale, titled
from rail_fem.show.plan import contact_path, view_box
from rail_fem.show.style import (
    GREEN,
    GREY,
    HALO,
    LINE_OF_MODEL,
    NOSE,
    ORANGE,
    PURPLE,
    SKY,
    TOTAL,
    WING,
    align_labels,
    new_figure,
)
from rail_fem.sweeps.trends import Measure

COLOURS = (TOTAL, WING, NOSE, GREEN, PURPLE, ORANGE, SKY)


def case_words(name: str, scene: Scene) -> str:
    """What sets a case apart, short enough for a legend."""
    speed, direction, load, wheel, foundation, steels = scene_facts(scene)
    return f"{name}: {speed} {direction}, {load}, {wheel}, {foundation}, {steels}"


PANELS = (
    ("force", "vertical contact\nforce [kN]", 1e-3, 2.2),
    ("wheel_height", "wheel height [mm]", 1e3, 1.4),
    ("crossing_height", "crossing\nheight [mm]", 1e3, 1.0),
    ("contact_y", "lateral position\nof contact [mm]", 1e3, 1.2),
)  # column, words, factor, height of the panel


def group_figure(title: str, results: Mapping[str, PassResult]) -> Figure:
    """Contact force, height of the wheel and of the crossing, lateral position of contact of each case over the
    position of the wheel."""
    figure, panels = new_panels(
        14.0, len(PANELS), 1, sharex=True, gridspec_kw={"height_ratios": [panel[3] for panel in PANELS]}
    )
    for (name, result), colour in zip(results.items(), COLOURS * len(results)):
        x = 1e3 * result.history["x"]
        dashes = "-" if result.scene.direction == "facing" else "--"
        lost = ~(result.history["force"] > 0)
        for axes, (column, _, scale, _) in zip(panels, PANELS):
            values = np.where(lost, np.nan, result.history[column]) if column == "contact_y" else result.history[column]
            axes.plot(x, scale * values, color=colour, ls=dashes, lw=1.8, label=case_words(name, result.scene))
    for axes, (_, words, _, _) in zip(panels, PANELS):
        axes.set_ylabel(words)
    panels[-1].set_xlabel(
        "position x of the wheel's centre [mm]   (dashed: trailing, the wheel runs to the left; y is positive towards"
        " the field side)"
    )
    legend_above(panels[0], 1, mode=None, borderaxespad=None)
    align_labels(figure)
    return titled(figure, f"{title}: model {next(iter(results.values())).model}")


def strain_figure(title: str, folders: Mapping[str, Path], results: Mapping[str, PassResult]) -> Figure | None:
    """Plastic strain from above, a strip for each case, all with one legend and one window; None where no case has
    fields."""
    fields: dict[str, Fields] = {}
    for name, folder in folders.items():
        try:
            fields[name] = read_crossing(folder)
        except FieldsError:
            continue
    if not fields:
        return None
    seen = {name: faces_from_above(f.points, f.cells) for name, f in fields.items()}
    corners = {name: 1e3 * f.points[seen[name][0]][:, :, :2] for name, f in fields.items()}
    strain = {name: 100 * f.plastic_strain[seen[name][1]] for name, f in fields.items()}
    boxes = np.array([view_box(corners[name], strain[name] > 0, contact_path(results[name])) for name in fields])
    low, high, bottom, top = boxes[:, 0].min(), boxes[:, 1].max(), boxes[:, 2].min(), boxes[:, 3].max()
    figure = new_figure(1.8 + len(fields) * (0.5 + 11 * (top - bottom) / (high - low)), layout="compressed")
    panels = np.atleast_1d(figure.subplots(len(fields), 1, sharex=True))
    colours = strain_scale(max(max(s.max(initial=0.0) for s in strain.values()), 1e-9))
    for axes, name in zip(panels, fields):
        painted = strain_paint(colours, strain[name])
        cells(axes, corners[name], painted, painted, 0.3)
        axes.plot(*contact_path(results[name]), color=GREY, lw=1.0)
        axes.set(xlim=(low, high), ylim=(bottom, top), aspect="equal", ylabel="y [mm]")
        words = f"{case_words(name, results[name].scene)}; at most {strain[name].max():.1f} %"
        axes.set_title(words, fontsize=11, loc="left")
    panels[-1].set_xlabel("x [mm]   (y is positive towards the field side; line: path of contact)")
    strain_bar(figure, colours, list(panels), " of the surface elements", 0.04)
    return titled(figure, f"{title}: plastic strain after one pass")


ROUGH = ("p2_formula", "lumped")  # bounds and formulas: their bars may leave the panel, with their value written
LEGEND_COLUMNS = 4  # of the summary: more reach beyond its panels
Marks = Mapping[str, tuple[str, Mapping[str, float]]]  # words of a panel -> legend, case -> value in the panel's unit


def summary_figure(
    results: Mapping[str, Mapping[str, PassResult]],
    measures: Mapping[str, Measure],
    title: str,
    published: Marks | None = None,
) -> Figure:
    """Bars over all cases, a panel for each measure by its words, a colour for each model; a dash for what a source
    has published."""
    resolved = lambda model: any(
        np.isfinite(m.of(of_case[model])) for of_case in results.values() if model in of_case for m in measures.values()
    )
    models = [model for model in MODELS if resolved(model)]
    figure = new_figure(2.5 + 3.2 * len(measures))
    panels = np.atleast_1d(figure.subplots(len(measures), 1, sharex=True))
    position, width = np.arange(len(results)), 0.8 / max(len(models), 1)
    for axes, (words, measure) in zip(panels, measures.items()):
        told = lambda model, of, absent: [
            measure.factor * of(of_case[model]) if model in of_case else absent for of_case in results.values()
        ]
        bars = {model: told(model, measure.of, np.nan) for model in models}
        errors = {model: told(model, measure.bar, 0.0) for model in models}
        reach = highest([np.add(bars[model], errors[model]).tolist() for model in models if model not in ROUGH])
        legend, marks = (published or {}).get(words, ("", {}))
        top = 1.3 * highest([*(bars[m] for m in models if m not in ROUGH), [*marks.values()]])
        top = max(top, 1.05 * reach)
        for k, (model, values) in enumerate(bars.items()):
            if np.isfinite(values).any():
                draw_bars(
                    axes, position + (k - (len(models) - 1) / 2) * width, values, errors[model], width, model, top
                )
        known = [(at, marks[case]) for at, case in zip(position, results) if case in marks]
        if known:
            axes.hlines([v for _, v in known], [at - 0.45 for at, _ in known], [at + 0.45 for at, _ in known],
                        color=WING, lw=2.5, ls=(0, (2, 1)), label=legend)  # fmt: skip
        axes.set_ylabel(f"{words} [{measure.unit}]")
        axes.set_ylim(0.0, top if top > 0 else None)
        if axes.patches or known:
            axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=LEGEND_COLUMNS, frameon=False, borderaxespad=0.1)
    panels[-1].set_xticks(position, what_differs(results), rotation=45, ha="right")
    return titled(figure, title)


def highest(rows: list[list[float]]) -> float:
    """The largest finite number of all, 0 where there is none."""
    flat = np.array([value for row in rows for value in row], dtype=float)
    return float(flat[np.isfinite(flat)].max(initial=0.0))


def draw_bars(
    axes, position: np.ndarray, values: list[float], errors: list[float], width: float, model: str, top: float
) -> None:
    """Bars of a model with their error bars, 0 for none; those that leave the panel have their value written."""
    axes.bar(position, values, width, color=LINE_OF_MODEL[model][0], label=model)
    known = np.array(errors) > 0
    if known.any():
        axes.errorbar(
            position[known], np.array(values)[known], np.array(errors)[known], fmt="none", ecolor=NOSE, elinewidth=1.6,
            capsize=2.5, label=f"its error bar ({model})",
        )  # fmt: skip
    for at, value in zip(position, values):
        if value > top > 0:
            axes.text(at, 0.98 * top, f"{value:.0f}", rotation=90, ha="center", va="top", fontsize=9, path_effects=HALO)


def what_differs(results: Mapping[str, Mapping[str, PassResult]]) -> list[str]:
    """A name for each case: its own, and in what its scene differs from the most usual one."""
    scenes = [next(iter(of_case.values())).scene if of_case else None for of_case in results.values()]
    facts = [scene_facts(scene) if scene is not None else [] for scene in scenes]
    usual = [max(dict.fromkeys(column), key=column.count) for column in zip(*filter(None, facts))]
    return [
        f"{name}: {', '.join(f for f, common in zip(own, usual) if f != common) or 'the usual'}" if own else name
        for name, own in zip(results, facts)
    ]


def scene_facts(scene: Scene) -> list[str]:
    """What the cases of a sweep may differ in: speed, direction, load, wheel, foundation, steels in words."""
    wing, nose = (
        m.grade if m.strength == 1 else f"{m.grade} x{m.strength:.0%}"
        for m in (scene.materials.wing, scene.materials.nose)
    )
    return [
        show(scene.speed, "mph", 3),
        scene.direction,
        show(scene.static_wheel_load, "kN", 3),
        scene.wheel.name,
        "on bearers" if scene.bearers else show(scene.foundation.stiffness, "kN/mm", 3),
        wing if wing == nose else f"wing {wing}, nose {nose}",
    ]
