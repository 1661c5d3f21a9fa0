"""Figure of the stresses in upright sections of wing and nose: von Mises under the wheel, and what stays behind."""

from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from bem.exact.subsurface import von_mises
from geometry.axes import VOIGT
from rail_fem.result.fields import Fields, field_file, read_fields
from rail_fem.result.result import PassResult
from rail_fem.show.fields import cut_at, depth_below
from rail_fem.show.panels import cells, new_panels, ring
from rail_fem.show.style import BODY, HALO, STRAIN_COLOURS, give_title, words_instead

HALF = 15.0  # of the view's width [mm]
SIGNED = "PuOr"  # compression brown, tension violet, told apart by the colour-blind too
ALONG, ACROSS = VOIGT.index("xx"), VOIGT.index("yy")


class FieldPanel(NamedTuple):
    """A section through one element: polygons [(corners, 2) in mm], their values [MPa], the element's place, words."""

    polygons: list[np.ndarray]
    values: np.ndarray
    at: np.ndarray
    worst: float
    depth: float
    x: float


def stress_figure(result: PassResult, folder: Path, name: str) -> Figure:
    """A column for each body, three rows: von Mises stress in the kept frame in which the body carries most, at its
    most stressed element; then, at the end of the run, stress along and across the track in the section of the largest
    plastic strain. Errors: FieldsError."""
    end = read_fields(field_file(folder))
    bodies = [body for body in BODY if len(end.of(body))]
    if not bodies:
        return words_instead(f"{name}: the fields hold neither wing nor nose, so there is no section to draw")
    figure, panels = new_panels(13.0, 3, len(bodies), squeeze=False)
    loaded = {body: loaded_frame(result, folder, body) for body in bodies}
    rows = (
        ("von Mises stress [MPa]", {b: under_load(f, b) if f else None for b, f in loaded.items()}),
        ("stress along the track [MPa]", {b: residual(end, b, ALONG) for b in bodies}),
        ("stress across the track [MPa]", {b: residual(end, b, ACROSS) for b in bodies}),
    )
    for k, (words, found) in enumerate(rows):
        draw_row(figure, panels[k], found, words, signed=k > 0, when="at the end" if k else "under load")
    for axes, body in zip(panels[0], bodies):
        if (frame := loaded[body]) is not None:
            axes.set_title(f"{axes.get_title()}; {moment(result, frame, body)}", fontsize=11, color=BODY[body])
    for axes, body in zip(panels[1], bodies):
        still = "" if result.metal.get(body, {}).get("unloaded", False) else ",\nthe wheel may still press on it"
        axes.set_title(f"{axes.get_title()}: residual{still}", fontsize=11, color=BODY[body])
    for axes in panels[-1]:
        axes.set_xlabel("y [mm], positive towards the field side")
    give_title(figure, f"Stresses in section ({end.source})", name, result)
    return figure


def kept_frames(folder: Path) -> list[tuple[float, Path]]:
    """Times [s] and field files of a run as its collection lists them; none where there is no collection."""
    try:
        sets = ElementTree.parse(Path(folder) / "fields" / "pass.pvd").iter("DataSet")
        listed = [(float(one.attrib["timestep"]), Path(folder) / "fields" / one.attrib["file"]) for one in sets]
    except (OSError, ElementTree.ParseError, KeyError, ValueError):
        return []
    return [(time, path) for time, path in listed if path.is_file()]


def loaded_frame(result: PassResult, folder: Path, body: str) -> Fields | None:
    """The kept frame in which a body carries most by the history; None where no frame has it loaded."""
    frames, history = kept_frames(folder), result.history
    if not frames or not np.isfinite(history[f"force_{body}"]).any():
        return None
    force = np.interp([time for time, _ in frames], history["time"], np.nan_to_num(history[f"force_{body}"]))
    return read_fields(frames[int(force.argmax())][1]) if force.max() > 0 else None


def moment(result: PassResult, frame: Fields, body: str) -> str:
    """Where the wheel is in a frame, and what the body carries."""
    at = lambda column: float(np.interp(frame.time, result.history["time"], result.history[column]))
    return f"wheel at {1e3 * at('x'):.0f} mm, {at(f'force_{body}') / 1e3:.0f} kN"


def under_load(fields: Fields, body: str) -> FieldPanel:
    """Von Mises stress in the section of the body's most stressed element."""
    mine = fields.of(body)
    values = von_mises(fields.stress[mine])
    return section(fields, mine, values, int(values.argmax()))


def residual(fields: Fields, body: str, component: int) -> FieldPanel | None:
    """A component of stress in the section of the body's largest plastic strain; None where nothing has yielded."""
    mine = fields.of(body)
    strain = fields.plastic_strain[mine]
    if not strain.max() > 0:
        return None
    return section(fields, mine, fields.stress[mine, component], int(strain.argmax()))


def section(fields: Fields, mine: np.ndarray, values: np.ndarray, worst: int) -> FieldPanel:
    """Cells `mine` cut at the x of their cell number `worst`; values (len(mine),) [Pa]."""
    centre = fields.centre(mine[worst])
    polygons, cut = cut_at(fields.points, fields.cells[mine], centre[0])
    depth = 1e3 * depth_below(polygons, centre[1:])
    return FieldPanel(
        [1e3 * p for p in polygons], values[cut] / 1e6, 1e3 * centre[1:], values[worst] / 1e6, depth, centre[0]
    )


def draw_row(figure: Figure, row, found: dict[str, FieldPanel | None], words: str, signed: bool, when: str) -> None:
    """One quantity in all bodies, with one scale."""
    there = {body: panel for body, panel in found.items() if panel is not None}
    views = {body: near(panel) for body, panel in there.items()}
    seen = np.concatenate([there[body].values[inside] for body, (_, inside) in views.items()] or [np.ones(1)])
    most = max(float(np.nan_to_num(np.abs(seen)).max(initial=0.0)), 1e-9)
    colours = ScalarMappable(Normalize(-most if signed else 0.0, most), SIGNED if signed else STRAIN_COLOURS)
    for axes, (body, panel) in zip(row, found.items()):
        axes.grid(False)
        axes.set_ylabel("z [mm]")
        if panel is None:
            axes.text(0.5, 0.5, "no frame in which it carries" if not signed else "nothing has yielded", ha="center")
            axes.set_title(f"{body}", fontsize=11, color=BODY[body])
            continue
        cells(axes, panel.polygons, colours.to_rgba(panel.values), "#555555", 0.3)
        (y, z), _ = views[body]
        ring(axes, panel.at[0], panel.at[1], "o", BODY[body], "", 11, 2.2, path_effects=HALO)
        axes.set(xlim=(y - HALF, y + HALF), ylim=(z - 1.3 * HALF, z + 0.3 * HALF), aspect="equal")
        axes.set_title(f"{body} {when}, x = {1e3 * panel.x:.0f} mm", fontsize=11, color=BODY[body])
        words_here = f"ring: {panel.worst:{'+' if signed else ''}.0f} MPa, {panel.depth:.1f} mm below the surface"
        axes.text(0.02, 0.03, words_here, transform=axes.transAxes, path_effects=HALO)
    figure.colorbar(colours, ax=list(row), aspect=18, label=words + (", tension +" if signed else ""))


def near(panel: FieldPanel) -> tuple[tuple[float, float], np.ndarray]:
    """Point on the surface over the panel's element (y, z) [mm], and which polygons lie in the view about it."""
    y, z = panel.at[0], panel.at[1] + panel.depth
    middle = np.array([polygon.mean(axis=0) for polygon in panel.polygons])
    inside = (np.abs(middle[:, 0] - y) < HALF) & (middle[:, 1] > z - 1.3 * HALF)
    return (float(y), float(z)), inside
