"""Figure of the meshes of wheel and crossing: in section where the wheel stands, along the track, and from above."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from geometry.surfaces.bodies import CROSSING, REGIONS
from rail_fem.result.fields import Fields, field_file, read_fields
from rail_fem.result.result import PassResult
from rail_fem.show.fields import cut_at, faces_from_above
from rail_fem.show.panels import cells
from rail_fem.show.stress import loaded_frame
from rail_fem.show.style import BODY, GREY, HALO, give_title, new_figure

PALE = {"wing": "#BBD9EE", "nose": "#F6CDB0", "wheel": "#DDDDDD"}
LINE = {**BODY, "wheel": GREY}
CLOSE = 25.0  # half width of the close view [mm]
SWAP = [1, 0, 2]  # x and y exchanged: a cut along the track


def mesh_figure(result: PassResult, folder: Path, name: str) -> Figure:
    """Section of all bodies in the wheel's middle, whole and about the contact; a cut along the track through the
    contact; the crossing from above. At the kept moment in which the nose carries most. Errors: FieldsError."""
    fields, x, y = loaded_moment(result, folder)
    figure = new_figure(14.0)
    rows = [["whole", "close"], ["along", "along_close"], ["top", "top"]]
    panels = figure.subplot_mosaic(rows, height_ratios=(1.2, 0.9, 0.7))
    whole, close, along, along_close, top = panels.values()
    points = fields.points + fields.displacement
    for axes, beside in ((whole, close), (along, along_close)):
        turned = axes is along
        for body in REGIONS:
            mine = fields.cells[fields.of(body)]
            if len(mine):
                corners = points[:, SWAP] if turned else points
                polygons = [1e3 * p for p in cut_at(corners, mine, y if turned else x)[0]]
                for part in (axes, beside):
                    cells(part, polygons, PALE[body], LINE[body], 0.35)
    ends = contact_height(points, fields, x, y)
    for axes, middle in ((close, 1e3 * y), (along_close, 1e3 * x)):
        axes.set(xlim=(middle - CLOSE, middle + CLOSE), ylim=(ends - 0.8 * CLOSE, ends + 0.8 * CLOSE))
    for axes in (whole, along):
        axes.autoscale_view()
    for axes, label in ((whole, "y"), (close, "y"), (along, "x"), (along_close, "x")):
        axes.set(aspect="equal", xlabel=f"{label} [mm]", ylabel="z [mm]")
        axes.grid(False)
    whole.set_title(f"section at the wheel's middle, x = {1e3 * x:.0f} mm")
    along.set_title(f"along the track, y = {1e3 * y:.1f} mm")
    close.set_title("the same about the contact")
    along_close.set_title("the same about the contact")
    from_above(top, fields)
    whole.legend(handles=handles(fields), loc="upper right", fontsize=10)
    give_title(figure, f"Meshed parts of wheel and crossing ({fields.source})", name, result)
    return figure


def loaded_moment(result: PassResult, folder: Path) -> tuple[Fields, float, float]:
    """Fields of the kept moment in which the nose carries most, or else the wing, or else the last; x of the wheel's
    middle and y of the contact there [m]."""
    history = result.history
    found = (frame for body in ("nose", "wing") if (frame := loaded_frame(result, folder, body)) is not None)
    fields = next(found, None) or read_fields(field_file(folder))
    if not len(history["x"]):  # of a failed run
        body = fields.points[fields.cells[fields.region == fields.region.max()]]
        return fields, float(body[..., 0].mean()), float(body[..., 1].mean())
    time = fields.time if np.isfinite(fields.time) else history["time"][-1]
    known = np.isfinite(history["contact_y"]) & (history["force"] > 0)
    y = np.interp(time, history["time"][known], history["contact_y"][known]) if known.any() else 0.0
    return fields, float(np.interp(time, history["time"], history["x"])), float(y)


def contact_height(points: np.ndarray, fields: Fields, x: float, y: float) -> float:
    """z of the crossing's highest node near the contact [mm]."""
    nodes = points[np.unique(fields.cells[np.isin(fields.region, CROSSING)])]
    away = np.hypot(nodes[:, 0] - x, nodes[:, 1] - y)
    return 1e3 * float(nodes[away <= max(away.min() * 1.01, 6e-3), 2].max())


def from_above(axes, fields: Fields) -> None:
    """Wing and nose with their elements, in true shape."""
    crossing = np.isin(fields.region, CROSSING)
    mine, region = fields.cells[crossing], fields.region[crossing]
    faces, owner = faces_from_above(fields.points, mine)
    corners = 1e3 * fields.points[faces][:, :, :2]
    paint = [PALE[REGIONS[k]] for k in region[owner]]
    edges = [LINE[REGIONS[k]] for k in region[owner]]
    cells(axes, corners, paint, edges, 0.15)
    axes.autoscale_view()
    axes.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]")
    axes.set_title("crossing from above: fine where the rigid wheel comes near; what is not drawn is not meshed")
    for body in BODY:
        nodes = 1e3 * fields.nodes_of(body)
        if len(nodes):
            x, y = nodes[:, :2].mean(axis=0)
            axes.text(x, y, body, color=BODY[body], weight="bold", ha="center", va="center", path_effects=HALO)


def handles(fields: Fields) -> list:
    """Bodies with the number of their elements and their shortest edge."""
    from matplotlib.patches import Patch

    found = []
    for body in REGIONS:
        mine = fields.cells[fields.of(body)]
        if len(mine):
            edge = np.linalg.norm(fields.points[mine[:, 1:4]] - fields.points[mine[:, 0:3]], axis=2).min()
            words = f"{body}: {len(mine)} elements, shortest edge {1e3 * edge:.2g} mm"
            found.append(Patch(facecolor=PALE[body], edgecolor=LINE[body], label=words))
    return found
