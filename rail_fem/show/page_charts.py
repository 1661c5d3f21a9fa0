"""Curves and surfaces of a page that turn, zoom and say their values: plotly's data and layout as plain values.

What is drawn is what the figures draw (rail_fem.show.force, plan, positions): the same curves, marks and colours.
"""

import base64
import html
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.colors import to_hex

from geometry.meshing.hexmesh import boundary_faces
from rail_fem.result.events import LARGEST, lost_contact, settling_end, stated_peaks
from rail_fem.result.fields import Fields
from rail_fem.result.history import COLUMNS
from rail_fem.result.quantities import FORCES as QUANTITIES
from rail_fem.result.result import PassResult
from rail_fem.scene.units import si_factor
from rail_fem.show.fields import faces_from_above
from rail_fem.show.force import FORCES, MARKED, resolved_forces, shifted_path
from rail_fem.show.plan import contact_path, view_box
from rail_fem.show.positions import distance_words
from rail_fem.show.style import BODY, CURVES, GREEN, GREY, NEVER_YIELDED, ORANGE, PURPLE, STRAIN_COLOURS

Trace = dict[str, Any]
SYMBOLS = {"*": "star", "D": "diamond-open", "s": "square-open", "o": "circle-open"}
DASHES = ("solid", "dash", "dot")  # of the whole wheel, wing, nose where several runs share the axes
HEIGHTS = ("force", "force_wing", "force_nose", "wheel_height", "crossing_height")  # drawn by `heights`
LONGEST = 1.9  # side of a surface as it is first seen, over the picture's height
MOST_FACES = 40_000  # of a surface that turns; more are joined
FONT = {"family": "system-ui, sans-serif", "size": 13, "color": "#222222"}
AXIS = {"gridcolor": "#DDDDDD", "zeroline": False, "linecolor": "#888888", "ticks": "outside", "automargin": True}


class NamedResult(NamedTuple):
    """A result and what the page calls it."""

    name: str
    result: PassResult


class Chart(NamedTuple):
    """words : above it;  pictures : plotly's data and layout, by the choices of all menus, joined by line ends
    menus : what is chosen -> its choices;  height : [pixel];  turns : in 3D, drawn by the graphics card"""

    words: str
    pictures: Mapping[str, Mapping[str, Any]]
    menus: Mapping[str, Sequence[str]] = {}
    height: int = 520
    turns: bool = False


def packed(values: np.ndarray, kind: str = "<f4") -> dict[str, str]:
    """Numbers as plotly reads them from text; not a number is a gap."""
    data = np.ascontiguousarray(values, dtype=kind)
    return {"dtype": kind[1:], "bdata": base64.b64encode(data.tobytes()).decode()}


def curve(x: np.ndarray, y: np.ndarray, words: str, colour: str, **look: Any) -> Trace:
    """A line, named in the legend. look : plotly's own words, of the line those that begin with line_"""
    line = {name.removeprefix("line_"): look.pop(name) for name in [*look] if name.startswith("line_")}
    about = {"type": "scatter", "mode": "lines", "name": html.escape(words), "line": {"color": colour} | line}
    return about | {"x": packed(x), "y": packed(y), "hovertemplate": "%{y:.4g}"} | look


def layout(x: str, y: str, **more: Any) -> dict[str, Any]:
    """Of curves over x; the words of both axes."""
    axes = {"xaxis": AXIS | {"title": {"text": x}}, "yaxis": AXIS | {"title": {"text": y}}}
    look = {"font": FONT, "hovermode": "x unified", "margin": {"l": 70, "r": 40, "t": 30, "b": 60}}
    look["modebar"] = {"orientation": "v"}
    return look | axes | {"legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom"}, "showlegend": True} | more


def heights(runs: Sequence[NamedResult]) -> Chart:
    """Contact forces over x, heights of wheel and crossing beneath; events of each run are marked."""
    data, alone = [], len(runs) == 1
    for number, run in enumerate(runs):
        data += _forces(run, CURVES[number % len(CURVES)], alone) + _below(run, CURVES[number % len(CURVES)], alone)
    data += _loads(runs)
    first = runs[0].result
    look = layout(distance_words(first), "vertical force [kN]", height=820)
    look["yaxis"] |= {"domain": [0.5, 1.0], "rangemode": "tozero"}
    look["yaxis2"] = AXIS | {"domain": [0.22, 0.46], "title": {"text": "wheel height [mm]"}}
    look["yaxis3"] = AXIS | {"domain": [0.0, 0.18], "title": {"text": "crossing<br>height [mm]"}}
    look["xaxis"] |= {"anchor": "y3", "hoverformat": ".1f"}
    shapes, notes = _events(first) if alone else ([], [])
    words = (
        "Bars: thin, of elements; pale, of form. Shaded: orange, in the air; purple, the start settles. Drag a box to"
        " zoom, click twice to return, click a name to hide its curve."
    )
    return Chart(words, {"": {"data": data, "layout": look | {"shapes": shapes, "annotations": notes}}}, {}, 820)


def _forces(run: NamedResult, colour: str, alone: bool) -> list[Trace]:
    """The forces of a run with its marks: bars of elements in full, of form pale."""
    result, before = run.result, "" if alone else f"{run.name}: "
    x, data, peaks = 1e3 * result.history["x"], [], stated_peaks(result)
    for (column, words, own, width, _), dash in zip(resolved_forces(result), DASHES):
        look = {"line_width": width, "line_dash": "solid" if alone else dash}
        shown, values = True if alone or column == "force" else "legendonly", result.history[column] / 1e3
        data.append(curve(x, values, before + words, own if alone else colour, visible=shown, **look))
    largest = [(LARGEST[column], "o", own) for column, _, own, *_ in FORCES if column != "force" and alone]
    for name, mark, own in (*MARKED, *largest):
        if name in peaks:
            data += _mark(run, name, SYMBOLS[mark], own if alone else colour, before)
    return data


def _loads(runs: Sequence[NamedResult]) -> list[Trace]:
    """A line at each static wheel load, over all that was run."""
    ends = np.array([[np.nanmin(x), np.nanmax(x)] for run in runs if len(x := 1e3 * run.result.history["x"])])
    over = np.array([ends[:, 0].min(), ends[:, 1].max()])
    look = {"line_dash": "dash", "line_width": 1.4, "hoverinfo": "skip", "hovertemplate": None}
    loads = sorted({round(run.result.scene.static_wheel_load / 1e3, 1) for run in runs})
    return [curve(over, np.full(2, load), f"static wheel load {load} kN", GREY, **look) for load in loads]


def _mark(run: NamedResult, name: str, symbol: str, colour: str, before: str) -> list[Trace]:
    peak = stated_peaks(run.result)[name]
    value, elements, form = peak.value / 1e3, run.result.error_bars.get(name, 0.0), run.result.form_bar(name)
    whose = "elements, calibrated" if run.result.calibrated else "elements"
    bars = f" \u00b1 {elements / 1e3:.2g} ({whose})" if elements > 0 else ""
    bars += f" \u00b1 {form / 1e3:.2g} (form)" if form > 0 else ""
    told = f"{value:.1f}{bars} kN, x = {1e3 * peak.x:.1f} mm, t = {1e3 * peak.time:.2f} ms"
    words = html.escape(before + run.result.scene.crossing.told(QUANTITIES[name]))
    point: Trace = {"type": "scatter", "mode": "markers", "x": [1e3 * peak.x], "y": [value]}
    point["legendgroup"] = before + name
    look = {"symbol": symbol, "size": 12, "color": colour, "line": {"width": 2, "color": colour}}
    marks = [point | {"name": words, "marker": look, "hovertemplate": told + "<extra>%{fullData.name}</extra>"}]
    if elements > 0:
        marks[0]["error_y"] = {"type": "data", "array": [elements / 1e3], "color": colour, "thickness": 2, "width": 6}
    if form > 0:
        pale = {"type": "data", "array": [form / 1e3], "color": colour, "thickness": 7, "width": 0}
        quiet = {"showlegend": False, "hoverinfo": "skip", "opacity": 0.25, "marker": {"opacity": 0}}
        marks.insert(0, point | quiet | {"error_y": pale})
    return marks


def _below(run: NamedResult, colour: str, alone: bool) -> list[Trace]:
    """Heights of wheel and crossing, and the rigid wheel's path shifted to meet the wheel."""
    result, before = run.result, "" if alone else f"{run.name}: "
    x, wheel, crossing = (result.history[name] for name in ("x", "wheel_height", "crossing_height"))
    data = []
    for values, words, axis in ((wheel, "height of the wheel", "y2"), (crossing, "height of the crossing", "y3")):
        if np.isfinite(values).any():
            data.append(curve(1e3 * x, 1e3 * values, before + words, colour, yaxis=axis, showlegend=False))
    if alone and len(x) and (rigid := shifted_path(result)) is not None:
        words = f"rigid wheel on a rigid crossing, shifted by {1e3 * rigid.shift:+.2f} mm"
        data.append(curve(1e3 * rigid.x, 1e3 * rigid.height, words, GREY, line_dash="dash", yaxis="y2"))
    return data


def _events(result: PassResult) -> tuple[list[dict], list[dict]]:
    """Shades where contact is lost and while it settles, a line at the transfer with its words."""
    history, shapes, notes = result.history, [], []
    losses = lost_contact(history["time"], history["x"], history["force"], result.scene.static_wheel_load)
    spans = [(loss.x_start, loss.x_end, ORANGE) for loss in losses]
    if np.isfinite(settled := settling_end(result)[1]):
        spans.append((history["x"][0], settled, PURPLE))
    over = {"xref": "x", "yref": "paper", "y0": 0, "y1": 1, "layer": "below"}
    for start, end, colour in spans:
        look = {"type": "rect", "fillcolor": colour, "opacity": 0.25, "line": {"width": 0}}
        shapes.append(over | look | {"x0": 1e3 * start, "x1": 1e3 * end})
    if np.isfinite(at := 1e3 * result.transfer_x):
        shapes.append(over | {"type": "line", "x0": at, "x1": at, "line": {"color": GREEN, "width": 2, "dash": "dash"}})
        words = f"load changes between {result.scene.crossing.told('wing and nose')}<br>x = {at:.1f} mm"
        place = {"x": at, "y": 1, "yref": "paper", "xanchor": "left", "yanchor": "top", "align": "left"}
        notes.append(place | {"text": words, "showarrow": False, "font": {"color": GREEN}, "bgcolor": "#FFFFFFCC"})
    return shapes, notes


def any_history(runs: Sequence[NamedResult]) -> Chart | None:
    """Each other column that a run resolves, by choice; None where there is none."""
    pictures = {}
    for name, column in COLUMNS.items():
        told = [run for run in runs if np.isfinite(run.result.history[name]).any()]
        if name in ("time", "x", *HEIGHTS) or not told:
            continue
        words = f"{name.replace('_', ' ')} [{column.unit}]"
        data = []
        for run in told:
            history, colour = run.result.history, CURVES[runs.index(run) % len(CURVES)]
            data.append(curve(1e3 * history["x"], history[name] / si_factor(column.unit), run.name, colour))
        meaning = {"title": {"text": column.meaning, "font": {"size": 13}}, "height": 420}
        pictures[words] = {"data": data, "layout": layout(distance_words(told[0].result), words, **meaning)}
    return Chart("", pictures, {"quantity": list(pictures)}, 420) if pictures else None


def strain_surface(run: NamedResult, fields: Fields, most: float) -> Chart:
    """The crossing's surface around what has yielded, coloured by the plastic strain of its elements; most : end of the
    scale [1]"""
    faces, owner = _seen(run.result, fields)
    points, faces, strain, joined = thinned(1e3 * fields.points, faces, 100 * fields.plastic_strain[owner], MOST_FACES)
    corners = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    axes = dict(zip("xyz", (packed(column) for column in points.T)))
    kind = "<u2" if len(points) < 2**16 else "<i4"
    scale = mpl.colormaps[STRAIN_COLOURS](np.linspace(0, 1, 12))
    end = 100 * most if most > 0 else 1.0
    ramp = [[0.002 + 0.998 * k / 11, to_hex(colour)] for k, colour in enumerate(scale)]
    bar = {"title": {"text": "plastic strain<br>(PEEQ) [%]"}, "thickness": 16, "len": 0.8}
    surface: Trace = {"type": "mesh3d", "intensitymode": "cell", "flatshading": True, "colorbar": bar}
    surface |= axes | dict(zip("ijk", (packed(column, kind) for column in corners.T)))
    surface |= {"intensity": packed(np.tile(strain, 2)), "cmin": 0, "cmax": end, "name": ""}
    surface |= {"colorscale": [[0, NEVER_YIELDED], [0.002, NEVER_YIELDED], *ramp]}
    surface |= {"lighting": {"ambient": 0.95, "diffuse": 0.25, "specular": 0.02}}
    surface |= {"hovertemplate": "x %{x:.1f}, y %{y:.1f}, z %{z:.1f} mm<extra></extra>"}
    look = {"font": FONT, "margin": {"l": 0, "r": 0, "t": 0, "b": 0}, "height": 430, "showlegend": False}
    title = lambda words: {"title": {"text": words}, "backgroundcolor": "#FFFFFF", "gridcolor": "#DDDDDD"}
    scene = {"xaxis": title("x [mm]"), "yaxis": title("y [mm]") | {"nticks": 4}}
    scene["zaxis"] = title("") | {"showticklabels": False}  # hover says it; its ticks would lie on those of y
    length = np.ptp(points, axis=0)
    scene |= {"aspectmode": "manual", "aspectratio": dict(zip("xyz", map(float, LONGEST * length / length.max())))}
    scene["camera"] = {"eye": {"x": -0.12, "y": -0.95, "z": 0.7}}
    words = (
        f"{run.name}: equivalent plastic strain of the surface elements; grey: never yielded. Drag to turn, wheel to"
        " come nearer."
    )
    words += f" Elements are joined to {joined:.2g} mm, each with its largest strain." if joined else ""
    marked = [surface, *_worst(fields)]
    return Chart(words, {"": {"data": marked, "layout": look | {"scene": scene}}}, {}, 430, turns=True)


def _seen(result: PassResult, fields: Fields) -> tuple[np.ndarray, np.ndarray]:
    """Outer faces (k, 4) of cells around what has yielded and the path of contact, and the cell of each (k,)."""
    above, of = faces_from_above(fields.points, fields.cells)
    corners, yielded = 1e3 * fields.points[above][:, :, :2], fields.plastic_strain[of] > 0
    low_x, high_x, low_y, high_y = view_box(corners, yielded, contact_path(result))
    faces, owner = boundary_faces(fields.cells)
    centre = 1e3 * fields.points[faces].mean(axis=1)
    inside = (centre[:, 0] > low_x) & (centre[:, 0] < high_x) & (centre[:, 1] > low_y) & (centre[:, 1] < high_y)
    if inside.any():  # of what is seen the upper half is enough
        inside &= centre[:, 2] > centre[inside, 2].max() - 0.5 * np.ptp(centre[inside, 2])
    return faces[inside], owner[inside]


def thinned(
    points: np.ndarray, faces: np.ndarray, strain: np.ndarray, most: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """A surface of at most so many faces: corners within a cell of a grid become their mean, faces that then lie on the
    same corners one, with the largest strain of all they stand for.

    points : (n, 3);  faces : (k, 4);  strain : (k,)
    Returns points, faces, strain and the width of the grid's cells, 0 where nothing was joined.
    """
    used, corner = np.unique(faces, return_inverse=True)
    points, faces, width = points[used], corner.reshape(-1, 4), 0.0
    first = points, faces, strain
    while len(faces) > most:
        width = 1.3 * width or 0.7 * float(np.median(np.ptp(first[0][first[1]], axis=1).max(axis=1)))
        _, group = np.unique(np.floor(first[0] / width).astype(np.int64), axis=0, return_inverse=True)
        group = group.ravel()
        count = np.bincount(group)
        points = np.column_stack([np.bincount(group, column) / count for column in first[0].T])
        joined = group[first[1]]
        whole = (np.diff(np.sort(joined, axis=1), axis=1) > 0).sum(axis=1) >= 2
        _, one, same = np.unique(np.sort(joined[whole], axis=1), axis=0, return_index=True, return_inverse=True)
        faces, strain = joined[whole][one], np.zeros(len(one))
        np.maximum.at(strain, same.ravel(), first[2][whole])
        lost = np.zeros(len(points))  # of faces that lie within a cell: told by those around it
        np.maximum.at(lost, joined[~whole], first[2][~whole, None])
        strain = np.maximum(strain, lost[faces].max(axis=1))
    return points, faces, strain, width


def _worst(fields: Fields) -> list[Trace]:
    """The most strained element of each body, with its value."""
    marks = []
    for body in BODY:
        if (cell := fields.worst(body)) is not None:
            x, y, z = 1e3 * fields.centre(cell)
            words = f"{body}: at most {100 * fields.plastic_strain[cell]:.2f} %"
            top = 1e3 * fields.nodes_of(body)[:, 2].max()
            mark = {"type": "scatter3d", "mode": "markers+text", "text": [words], "textposition": "top center"}
            place = {"x": [x], "y": [y], "z": [max(z, top)], "hoverinfo": "text"}
            look = {"marker": {"size": 4, "color": BODY[body]}, "textfont": {"size": 14, "color": BODY[body]}}
            marks.append(mark | place | look)
    return marks
