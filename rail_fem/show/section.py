"""Figure of the plastic strain in upright sections of wing and nose, where it is largest, with the elements drawn."""

from __future__ import annotations

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from geometry.surfaces.bodies import REGIONS
from rail_fem.output.result import PassResult
from rail_fem.show.fields import CrossingFields, cut_at, depth_below
from rail_fem.show.plan import mpl_colour
from rail_fem.show.style import BODY, NEVER_YIELDED, STRAIN_COLOURS, give_title, new_figure, words_instead

NOTABLE = 0.02  # part of the largest strain that the close view must hold
SMALLEST, LARGEST = 6.0, 30.0  # half width of the close view [mm]


def section_figure(result: PassResult, fields: CrossingFields, name: str) -> Figure:
    """One column for each body that has yielded: the whole section above, the neighbourhood of its worst element
    beneath."""
    worst = {body: cell for body in ("wing", "nose") if (cell := fields.worst(body)) is not None}
    if not worst:
        return words_instead(
            f"{name}: no element of the crossing has yielded, so there is no section to draw ({fields.source})"
        )
    figure = new_figure(10.5)
    panels = figure.subplots(2, len(worst), squeeze=False, gridspec_kw={"height_ratios": [1, 2.4]})
    most = 100 * max(fields.plastic_strain[cell] for cell in worst.values())
    colours = ScalarMappable(Normalize(0.0, most), STRAIN_COLOURS)
    for column, (body, cell) in zip(panels.T, worst.items()):
        draw_section(column, fields, body, cell, colours)
    bar = figure.colorbar(colours, ax=panels, orientation="horizontal", aspect=60, shrink=0.9, fraction=0.05)
    bar.set_label("equivalent plastic strain (PEEQ) [%]; grey: never yielded, white: not meshed")
    give_title(figure, f"Plastic strain in section ({fields.source})", name, result)
    return figure


def draw_section(column, fields: CrossingFields, body: str, worst: int, colours: ScalarMappable) -> None:
    """Whole section and close view (the two axes of `column`) of a body at the x of its worst cell."""
    mine = np.flatnonzero(fields.region == REGIONS.index(body))
    position = fields.centre(worst)
    polygons, cut = cut_at(fields.points, fields.cells[mine], position[0])
    strain = fields.plastic_strain[mine[cut]]
    depth = depth_below(polygons, position[1:])
    shown = [1e3 * polygon for polygon in polygons]
    painted = np.where((strain > 0)[:, None], colours.to_rgba(100 * strain), mpl_colour(NEVER_YIELDED))
    y, z, half = close_view(shown, strain)
    whole, close = column
    whole.add_collection(PolyCollection(shown, facecolors=painted, edgecolors="none"))
    whole.add_patch(Rectangle((y - half, z - half), 2 * half, 2 * half, fill=False, ec="black", lw=1.5))
    corners = np.concatenate(shown)
    (low_y, low_z), (high_y, high_z) = corners.min(axis=0), corners.max(axis=0)
    whole.set(
        xlim=(min(low_y, y - half) - 2, max(high_y, y + half) + 2),
        ylim=(min(low_z, z - half) - 2, max(high_z, z + half) + 2),
        aspect="equal",
        xlabel="y [mm]",
        ylabel="z [mm]",
    )
    whole.set_title(f"{body}: section at x = {1e3 * position[0]:.1f} mm", color=BODY[body], weight="bold")
    close.add_collection(PolyCollection(shown, facecolors=painted, edgecolors="#555555", linewidths=0.5))
    most = 100 * fields.plastic_strain[worst]
    words = f"at most {most:.2f} %, in the element whose\nmiddle is {1e3 * depth:.2f} mm below the surface"
    close.plot(1e3 * position[1], 1e3 * position[2], "o", ms=12, mfc="none", mec=BODY[body], mew=2.5, label=words)
    close.legend(loc="lower left")
    close.set(
        xlim=(y - half, y + half),
        ylim=(z - half, z + half),
        aspect="equal",
        xlabel="y [mm], positive towards the field side",
        ylabel="z [mm]",
    )
    for axes in column:
        axes.grid(False)


def close_view(polygons: list[np.ndarray], strain: np.ndarray) -> tuple[float, float, float]:
    """Middle y, z and half width [mm] of a square view on what has notably yielded and the surface above it.

    polygons : of the section [mm];  strain : (k,) of their cells
    """
    corners = np.concatenate([polygon for polygon, value in zip(polygons, strain) if value > NOTABLE * strain.max()])
    low, high = corners.min(axis=0), corners.max(axis=0)
    half = float(np.clip(0.65 * (high - low).max(), SMALLEST, LARGEST))
    y, z = (low + high) / 2
    return float(y), float(min(z, high[1] - 0.6 * half)), half
