"""Drawing of a scene's crossing: plan, long section under the wheel, three cross-sections. For `check --draw`."""

import numpy as np
from matplotlib.figure import Figure

from geometry.path.contact_band import band_edges
from geometry.path.wheel_path import WheelPath
from geometry.surfaces.any_crossing import AnyCrossing
from geometry.surfaces.bodies import BODIES
from geometry.surfaces.crossing import CrossingError
from rail_fem.contact.rigid import datum_height, rigid_path
from rail_fem.scene.scene import Scene
from rail_fem.show.panels import Panel, panels_figure
from rail_fem.show.style import scene_words

BEFORE, BEHIND = 0.45, 0.55  # of the crossing drawn, before the leg's end and behind the nose's begin [m]
GAUGE_DEPTH = 14e-3
COUNT = 500  # positions along the crossing
MM = 1e3


def crossing_figure(scene: Scene) -> Figure:
    """Plan (running surface and contact of the rigid wheel), long section, three cross-sections with the wheel. Errors:
    CrossingError."""
    crossing = scene.crossing.surface
    x = drawn_range(crossing)
    path = rigid_path(scene, x)
    sections = [
        section_panel(scene, crossing, at, f"{words}, x = {MM * at:.0f} mm")
        for words, at in section_positions(crossing, path.transfers, x)
    ]
    panels = [plan_panel(crossing, x, path), long_panel(crossing, x, path), *sections]
    return panels_figure(panels, f"The crossing of the case: {scene_words(scene)}", columns=1)


def drawn_range(crossing: AnyCrossing) -> np.ndarray:
    """(n,) x from before the leg to behind the nose's begin [m], as far as the crossing goes."""
    low, high = crossing.x_range
    nose = crossing.nose_x if np.isfinite(crossing.nose_x) else crossing.leg_range[1] + 1.0
    start = max(low + 0.12, crossing.leg_range[0] - BEFORE)
    end = min(high - 0.12, nose + BEHIND)
    if not start < end:
        raise CrossingError(f"the crossing reaches from x = {low:g} to {high:g} m: too short to be drawn")
    return np.linspace(start, end, COUNT)


def section_positions(crossing: AnyCrossing, transfers: np.ndarray, x: np.ndarray) -> list[tuple[str, float]]:
    """Plain rail before the leg, knuckle, transfer (or a position behind the nose's begin), within x."""
    nose = crossing.nose_x if np.isfinite(crossing.nose_x) else x[-1]
    transfer = float(transfers[0]) if len(transfers) else min(nose + 0.15, x[-1])
    positions = ("plain rail", crossing.leg_range[0]), ("knuckle", crossing.knuckle_x), ("transfer", transfer)
    return [(words, float(np.clip(at, x[0], x[-1]))) for words, at in positions]


def outline(crossing: AnyCrossing, x: np.ndarray, y: np.ndarray, body: str) -> np.ndarray:
    """(n, 2)  both sides of a body at x (n,), where it passes the gauge depth [m]; NaN where it is not."""
    grid_x, grid_y = np.meshgrid(x, y, indexing="ij")
    height = crossing.top_height(grid_x, grid_y, body)
    return band_edges(np.where(height > -GAUGE_DEPTH, -1.0, 1.0), y, 0.0)


def plan_panel(crossing: AnyCrossing, x: np.ndarray, path: WheelPath) -> Panel:
    """Metal above the gauge depth, and where the rigid wheel touches; widths enlarged."""
    y = np.arange(-0.06, 0.13, 0.5e-3)
    lines: dict[str, tuple] = {
        f"{body}, above 14 mm depth": (MM * x, MM * outline(crossing, x, y, body).T, "band") for body in BODIES
    }
    lines["contact of the rigid wheel"] = *MM * path.contact_point[:, :2].T, "."
    return Panel("x [mm]", "y [mm], + field side", lines, "plan (widths enlarged)")


def long_panel(crossing: AnyCrossing, x: np.ndarray, path: WheelPath) -> Panel:
    """Heights of both bodies along the line of contact, and the axle's path with the transfers."""
    heights = {body: crossing.top_height(x, path.contact_point[:, 1], body) for body in BODIES}
    lines: dict[str, tuple] = {
        f"{body}, under the contact": (MM * x, MM * np.where(own > -8e-3, own, np.nan)) for body, own in heights.items()
    }
    lines["axle of the rigid wheel, against plain line"] = MM * x, MM * path.height
    lines["transfers"] = MM * path.transfers, MM * np.interp(path.transfers, x, path.height), "D"
    return Panel("x [mm], 0 where the gauge lines intersect", "height [mm]", lines, "long section (heights enlarged)")


def section_panel(scene: Scene, crossing: AnyCrossing, x: float, words: str) -> Panel:
    """Both bodies at x, and the wheel as it stands on them."""
    sections = {"wing": crossing.wing_section(x), "nose": crossing.nose_section(x)}
    lines = {body: tuple(MM * line.T) for body, line in sections.items() if line is not None}
    wheel, foot = scene.wheel.shape, datum_height(scene, rigid_path(scene, np.array([x])), x)
    y = np.arange(wheel.points[0, 0], wheel.points[-1, 0], 0.5e-3)
    lines["wheel"] = MM * (y + scene.wheel_datum_y), MM * (foot + wheel.height(y))
    return Panel("y [mm]", "z [mm]", lines, words, equal=True)
