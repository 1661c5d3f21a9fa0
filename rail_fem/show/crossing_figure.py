"""Drawing of a scene's crossing: plan, long section under the wheel, three cross-sections. For `check --draw`."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from geometry.surfaces.any_crossing import AnyCrossing
from geometry.surfaces.crossing import CrossingError
from rail_fem.light.rigid import rigid_path
from rail_fem.scene.scene import Scene
from rail_fem.show.panels import band, curve, titled
from rail_fem.show.style import BODY, GREEN, GREY, PURPLE, TOTAL, new_figure, scene_words

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
    figure = new_figure(12.5)
    grid = figure.add_gridspec(3, 3, height_ratios=[1.25, 1, 1.25])
    plan, long = figure.add_subplot(grid[0, :]), figure.add_subplot(grid[1, :])
    positions = section_positions(crossing, path.transfers, x)
    draw_plan(plan, crossing, x, path)
    draw_long_section(long, crossing, x, path)
    for k, (words, at) in enumerate(positions):
        for axes in (plan, long):
            axes.axvline(MM * at, color=GREY, ls="--", lw=1)
        draw_section(figure.add_subplot(grid[2, k]), scene, crossing, at, f"{words}, x = {MM * at:.0f} mm", k == 0)
    return titled(figure, f"The crossing of the case: {scene_words(scene)}", 13)


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


def draw_plan(axes, crossing: AnyCrossing, x: np.ndarray, path) -> None:
    """Metal above the gauge depth, and where the rigid wheel touches."""
    y = np.arange(-0.06, 0.13, 0.5e-3)
    grid_x, grid_y = np.meshgrid(x, y, indexing="ij")
    for body, colour in BODY.items():
        height = crossing.top_height(grid_x, grid_y, body)
        inside = height > -GAUGE_DEPTH
        there = inside.any(axis=1)
        low = np.where(there, y[np.argmax(inside, axis=1)], np.nan)
        high = np.where(there, y[len(y) - 1 - np.argmax(inside[:, ::-1], axis=1)], np.nan)
        band(axes, MM * x, MM * low, MM * high, f"{body}, above 14 mm depth", colour, 0.25)
        axes.plot(MM * x, MM * low, color=colour, lw=1)
        axes.plot(MM * x, MM * high, color=colour, lw=1)
    point = path.contact_point
    axes.plot(MM * point[:, 0], MM * point[:, 1], ".", ms=2.5, color=TOTAL, label="contact of the rigid wheel")
    axes.set(ylabel="y [mm], + field side", title="plan (widths enlarged)")
    axes.legend(loc="upper left", ncols=3)


def draw_long_section(axes, crossing: AnyCrossing, x: np.ndarray, path) -> None:
    """Heights of both bodies along the line on which the wheel's tread datum runs, and the axle's path."""
    carrier = path.contact_point[:, 1]
    for body, colour in BODY.items():
        height = crossing.top_height(x, carrier, body)
        curve(axes, MM * x, MM * np.where(height > -8e-3, height, np.nan), f"{body} under the contact", colour)
    axes.plot(MM * x, MM * path.height, color=TOTAL, lw=2, label="axle of the rigid wheel, against plain line")
    for at in path.transfers:
        axes.axvline(MM * at, color=GREEN, lw=2, ls=(0, (6, 2)))
    axes.set(ylabel="height [mm]", title="long section (heights enlarged)")
    axes.set_xlabel("x [mm], 0 where the gauge lines intersect")
    axes.margins(y=0.25)
    axes.legend(loc="lower left", ncols=3)


def draw_section(axes, scene: Scene, crossing: AnyCrossing, x: float, words: str, name: bool) -> None:
    """Both bodies at x, and the wheel as it stands on them."""
    for body, colour in BODY.items():
        line = crossing.wing_section(x) if body == "wing" else crossing.nose_section(x)
        if line is not None:
            axes.fill(*(MM * line.T), color=colour, alpha=0.3, lw=0)
            axes.plot(*(MM * line.T), color=colour, lw=1.8, label=body)
    path, wheel = rigid_path(scene, np.array([x])), scene.wheel.shape
    at_x, at_y, at_z = path.contact_point[0]
    y = np.arange(wheel.points[0, 0], wheel.points[-1, 0], 0.5e-3)
    # the wheel's own section at its axle: the contact may lie ahead of it
    radius = scene.wheel.radius - wheel.height(np.array([at_y - scene.wheel_datum_y]))[0]
    axle = at_z + np.sqrt(radius**2 - (at_x - x) ** 2)
    height = axle - scene.wheel.radius + wheel.height(y)
    curve(axes, MM * (y + scene.wheel_datum_y), MM * height, "wheel", PURPLE, 1.8)
    axes.set(title=words, xlabel="y [mm]", xlim=(-65, 130), ylim=(-60, 35), aspect="equal")
    if name:
        axes.set_ylabel("z [mm]")
        axes.legend(loc="upper right", fontsize=9)
