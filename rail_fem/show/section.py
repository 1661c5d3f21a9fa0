"""Figure of the plastic strain in upright sections of wing and nose, where it is largest, with the elements drawn."""

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from rail_fem.result.fields import Fields
from rail_fem.result.result import PassResult
from rail_fem.show.fields import cut_at, depth_below
from rail_fem.show.panels import cells, new_panels, ring, strain_bar, strain_paint, strain_scale
from rail_fem.show.style import BODY, give_title, words_instead

NOTABLE = 0.02  # part of the largest strain that the close view must hold
SMALLEST, LARGEST = 6.0, 30.0  # half width of the close view [mm]


def section_figure(result: PassResult, fields: Fields, name: str) -> Figure:
    """One column for each body that has yielded: the whole section above, the neighbourhood of its worst element
    beneath."""
    worst = {body: cell for body in ("wing", "nose") if (cell := fields.worst(body)) is not None}
    if not worst:
        return words_instead(
            f"{name}: no element of the crossing has yielded, so there is no section to draw ({fields.source})"
        )
    figure, panels = new_panels(10.5, 2, len(worst), squeeze=False, height_ratios=[1, 2.4])
    most = 100 * max(fields.plastic_strain[cell] for cell in worst.values())
    colours = strain_scale(most)
    for column, (body, cell) in zip(panels.T, worst.items()):
        draw_section(column, fields, body, cell, colours)
    strain_bar(figure, colours, panels)
    give_title(figure, f"Plastic strain in section ({fields.source})", name, result)
    return figure


def draw_section(column, fields: Fields, body: str, worst: int, colours: ScalarMappable) -> None:
    """Whole section and close view (the two axes of `column`) of a body at the x of its worst cell."""
    mine = fields.of(body)
    position = fields.centre(worst)
    polygons, cut = cut_at(fields.points, fields.cells[mine], position[0])
    strain = fields.plastic_strain[mine[cut]]
    depth = depth_below(polygons, position[1:])
    shown = [1e3 * polygon for polygon in polygons]
    painted = strain_paint(colours, 100 * strain)
    y, z, half = close_view(shown, strain)
    whole, close = column
    cells(whole, shown, painted)
    whole.add_patch(Rectangle((y - half, z - half), 2 * half, 2 * half, fill=False, ec="black", lw=1.5))
    corners = np.concatenate(shown)
    (low_y, low_z), (high_y, high_z) = corners.min(axis=0), corners.max(axis=0)
    whole.set(xlim=(min(low_y, y - half) - 2, max(high_y, y + half) + 2), aspect="equal", xlabel="y [mm]")
    whole.set(ylim=(min(low_z, z - half) - 2, max(high_z, z + half) + 2), ylabel="z [mm]")
    whole.set_title(f"{body}: section at x = {1e3 * position[0]:.1f} mm", color=BODY[body], weight="bold")
    cells(close, shown, painted, "#555555", 0.5)
    most = 100 * fields.plastic_strain[worst]
    words = f"at most {most:.2f} %, in the element whose\nmiddle is {1e3 * depth:.2f} mm below the surface"
    ring(close, 1e3 * position[1], 1e3 * position[2], "o", BODY[body], words, 12, 2.5)
    close.legend(loc="lower left")
    close.set(xlim=(y - half, y + half), ylim=(z - half, z + half), aspect="equal", ylabel="z [mm]")
    close.set_xlabel("y [mm], positive towards the field side")


def close_view(polygons: list[np.ndarray], strain: np.ndarray) -> tuple[float, float, float]:
    """Middle y, z and half width [mm] of a square view on what has notably yielded and the surface above it.

    polygons : of the section [mm];  strain : (k,) of their cells
    """
    corners = np.concatenate([polygon for polygon, value in zip(polygons, strain) if value > NOTABLE * strain.max()])
    low, high = corners.min(axis=0), corners.max(axis=0)
    half = float(np.clip(0.65 * (high - low).max(), SMALLEST, LARGEST))
    y, z = (low + high) / 2
    return float(y), float(min(z, high[1] - 0.6 * half)), half
