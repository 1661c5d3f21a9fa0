"""Figure of the plastic strain on the crossing's top surface, seen from above in true shape."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from geometry.surfaces.bodies import REGIONS
from rail_fem.result.events import both_carry
from rail_fem.result.fields import Fields
from rail_fem.result.result import PassResult
from rail_fem.show.fields import faces_from_above
from rail_fem.show.panels import cells, curve, legend_above, ring, strain_bar, strain_paint, strain_scale
from rail_fem.show.style import BODY, HALO, give_title, new_figure

MARGIN = 12e-3  # shown around what has yielded and the contact path [m]
LINE = 0.3  # height of a line of the title [inch]
LONGEST_STRIP = 3.4  # length over width of a strip; longer views go on in the next strip


def plan_figure(result: PassResult, fields: Fields, name: str) -> Figure:
    """PEEQ in percent on wing and nose, with the path of contact; long views in several strips."""
    faces, owner = faces_from_above(fields.points, fields.cells)
    strain, corners = fields.plastic_strain[owner], 1e3 * fields.points[faces][:, :, :2]
    path = contact_path(result)
    strips = cut_in_strips(*view_box(corners, strain > 0, path))
    length, width = strips[0][1] - strips[0][0], strips[0][3] - strips[0][2]
    figure = new_figure(2.2 + len(strips) * (0.35 + 10.8 * width / length), layout="compressed")
    panels = np.atleast_1d(figure.subplots(len(strips), 1))
    most = strain.max(initial=0.0)
    colours = strain_scale(100 * most if most > 0 else 1.0)
    painted = strain_paint(colours, 100 * strain)
    for axes, (low, high, bottom, top) in zip(panels, strips):
        seen = (corners[:, :, 0].max(axis=1) >= low) & (corners[:, :, 0].min(axis=1) <= high)
        cells(axes, corners[seen], painted[seen], painted[seen], 0.3)
        outline = [withStroke(linewidth=2.2, foreground="white")]
        words = "path of contact; not drawn where both bodies carry"
        curve(axes, path[0], path[1], words, width=1.0, path_effects=outline)
        mark_worst(axes, fields, owner, corners)
        name_bodies(axes, fields, (low, high, bottom, top), path)
        axes.set(xlim=(low, high), ylim=(bottom, top), aspect="equal", ylabel="y [mm]")
    direction = "runs to the right \u2192" if result.scene.direction == "facing" else "runs to the left \u2190"
    panels[-1].set_xlabel(f"x [mm]   (the wheel {direction}; y is positive towards the field side)")
    legend_above(panels[0], borderpad=1.0)  # its rings reach out of their lines, into the title
    if most > 0:
        strain_bar(figure, colours, list(panels), " of the surface elements")
    else:
        place = {"transform": panels[0].transAxes, "ha": "center", "weight": "bold", "path_effects": HALO}
        panels[0].text(0.5, 0.9, "nothing has yielded at the surface", **place)
    lines = give_title(figure, f"Plastic strain seen from above ({fields.source})", name, result)
    figure.set_figheight(figure.get_figheight() + LINE * lines)
    return figure


def contact_path(result: PassResult) -> tuple[np.ndarray, np.ndarray]:
    """Positions of contact [mm], NaN where there is none or where wing and nose carry at once: the mean of both would
    lie in the flangeway. The line breaks there."""
    x, y, force = (result.history[name] for name in ("contact_x", "contact_y", "force"))
    lost = ~(force > 0) | both_carry(result.history)
    return np.where(lost, np.nan, 1e3 * x), np.where(lost, np.nan, 1e3 * y)


def view_box(
    corners: np.ndarray, yielded: np.ndarray, path: tuple[np.ndarray, np.ndarray]
) -> tuple[float, float, float, float]:
    """x and y range [mm] of what has yielded and of the path with a margin, within the mesh; all of the mesh where
    there is neither.

    corners : (k, 4, 2) of the faces [mm];  yielded : (k,) bool
    """
    everything = corners.reshape(-1, 2)
    known = np.isfinite(path[0]) & np.isfinite(path[1])
    of_interest = np.concatenate([corners[yielded].reshape(-1, 2), np.column_stack(path)[known]])
    low, high = everything.min(axis=0), everything.max(axis=0)
    if len(of_interest):
        margin = 1e3 * MARGIN
        nearer_low = np.maximum(low, of_interest.min(axis=0) - margin)
        nearer_high = np.minimum(high, of_interest.max(axis=0) + margin)
        if (nearer_low < nearer_high).all():
            low, high = nearer_low, nearer_high
    return low[0], high[0], low[1], high[1]


def cut_in_strips(low: float, high: float, bottom: float, top: float) -> list[tuple[float, float, float, float]]:
    """A view cut along x in strips of equal length that are not slimmer than LONGEST_STRIP."""
    count = max(1, int(np.ceil((high - low) / (top - bottom) / LONGEST_STRIP - 0.25)))
    ends = np.linspace(low, high, count + 1)
    return [(ends[i], ends[i + 1], bottom, top) for i in range(count)]


def mark_worst(axes, fields: Fields, owner: np.ndarray, corners: np.ndarray) -> None:
    """A ring around the surface element of each body with the largest strain, with its value in the legend."""
    for body, marker in (("wing", "o"), ("nose", "D")):
        mine = np.flatnonzero(fields.region[owner] == REGIONS.index(body))
        strain = fields.plastic_strain[owner[mine]]
        if not len(mine) or not strain.max() > 0:
            continue
        x, y = corners[mine[strain.argmax()]].mean(axis=0)
        words = f"{body}, surface: {100 * strain.max():.2f} % at x = {x:.1f}, y = {y:.1f} mm"
        ring(axes, x, y, marker, BODY[body], words, 13, 2.2)


def name_bodies(
    axes, fields: Fields, box: tuple[float, float, float, float], path: tuple[np.ndarray, np.ndarray]
) -> None:
    """The words wing and nose near an end of the body's visible part, off the path of contact."""
    low, high, bottom, top = box
    reach = 0.05 * (high - low)
    for body in BODY:
        nodes = 1e3 * fields.nodes_of(body)
        seen = nodes[(nodes[:, 0] > low) & (nodes[:, 0] < high) & (nodes[:, 1] > bottom) & (nodes[:, 1] < top)]
        if not len(seen) or np.ptp(seen[:, 0]) < reach:
            continue
        x = seen[:, 0].min() + reach if seen[:, 0].min() < low + 0.2 * (high - low) else seen[:, 0].max() - reach
        away = np.abs(seen[:, 0] - x)
        sides = np.quantile(seen[away <= max(reach, away.min()), 1], (0.12, 0.88))
        crossed = np.nanmean(np.append(path[1][np.abs(path[0] - x) < reach], sides.mean()))
        y = sides[np.abs(sides - crossed).argmax()]
        axes.text(x, y, body, color=BODY[body], weight="bold", ha="center", va="center", path_effects=HALO)
