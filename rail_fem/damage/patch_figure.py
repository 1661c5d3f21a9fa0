"""Figure of the patches that wear a section: where a wheel touches it, and for each point pressure, tractions, depth
of cells and strips (in kind the thesis' figures 4-5 to 4-7)."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from geometry.profiles.profile import hermite_many
from rail_fem.damage.rolling import RollingPoint
from rail_fem.damage.section import PassRecord, WearRate
from rail_fem.damage.sites import laws_of
from rail_fem.damage.worn_profile import WornProfile
from rail_fem.settings.damage import DamageSettings
from rail_fem.show.panels import titled
from rail_fem.show.style import GREY, HALO, NOSE, WING, new_figure

MM, UM, MPA = 1e3, 1e6, 1e-6
MOST = 3  # points drawn
ARROWS = 12  # of tractions each way


def shown_pass(rate: WearRate) -> PassRecord:
    """That whose load two points of the section share most evenly; without such a one that of the largest force."""

    def second(record: PassRecord) -> tuple[float, float]:
        forces = [p.normal_force for p in points_of(record)] + [0.0, 0.0]
        return forces[1], forces[0]

    return max((record for _, record in rate.kinds), key=second)


def points_of(record: PassRecord) -> list[RollingPoint]:
    """On the section, the largest force first."""
    return record.on_section[:MOST]


def patches_figure(title: str, settings: DamageSettings, line: WornProfile, rate: WearRate) -> Figure:
    """The pass of a rate whose load is shared most evenly, on the line (n,) that it was found on."""
    record, law = shown_pass(rate), laws_of(settings)[settings.law]
    points = points_of(record)
    figure = new_figure(14.0)
    count = max(len(points), 1)
    grid = figure.add_gridspec(5, 2 * count, height_ratios=[1.6, 1, 1, 1, 0.8], width_ratios=[1, 0.04] * count)
    whole = figure.add_subplot(grid[0, :])
    _touching(whole, line, record, points)
    depths = [law.cells(p.patch, p.speed) * settings.factor * UM for p in points]
    for k, (point, depth) in enumerate(zip(points, depths, strict=True)):
        axes = [figure.add_subplot(grid[row, 2 * k]) for row in range(1, 5)]
        bars = [figure.add_subplot(grid[row, 2 * k + 1]) for row in range(1, 4)]
        _maps(figure, axes, bars, point, depth)
        axes[0].set_title(f"{_facts(k, point)}\npressure [MPa]", loc="left", fontsize=12)
    return titled(
        figure, f"{title}\none pass over the first shape, wheelset at {record.lateral * MM:.2f} mm, running towards + x"
    )


def _facts(k: int, point: RollingPoint) -> str:
    patch = point.patch
    return (
        f"{'abc'[k]}: {point.normal_force / 1e3:.1f} kN, at most {patch.max_pressure * MPA:.0f} MPa\n"
        f"T\u03b3 {point.tgamma:.3g} N, at an angle of {np.degrees(point.angle):.1f}\u00b0"
    )


def _touching(axis: Axes, line: WornProfile, record: PassRecord, points: list[RollingPoint]) -> None:
    """The section and the wheel laid on it at its points (as it stands but for the axle's roll)."""
    axis.plot(*(line.points * MM).T, color=GREY, lw=1.6, label="section")
    if points:
        wheel = record.passing.wheel
        at = np.array([p.position for p in points])
        station = np.array([p.station for p in points])
        touch = np.column_stack([station, hermite_many(station, *wheel.hermite_table())[0]])
        axis.plot(*((wheel.points + (at - touch).mean(axis=0)) * MM).T, color=WING, lw=1.4, label="wheel")
        axis.plot(*(at * MM).T, "o", ms=7, mfc="none", mec=NOSE, mew=1.8, label="where it touches")
        for k, own in enumerate(at * MM):
            axis.annotate("abc"[k], own, (6, 8), textcoords="offset points", weight="bold", path_effects=HALO)
    y, z = line.points.T * MM
    axis.set(xlim=(y.min() - 8, y.max() + 8), ylim=(z.min() - 2, z.max() + 10), aspect="equal")
    axis.set(xlabel="y [mm], + towards the field side", ylabel="z [mm]")
    axis.legend(loc="lower center", ncols=3)


def _maps(figure: Figure, axes: list[Axes], bars: list[Axes], point: RollingPoint, depth: np.ndarray) -> None:
    """Pressure, tractions, depth [um] of cells and of strips of one point."""
    patch, field = point.patch, np.sign(point.outwards[-1] - point.outwards[0])
    x, y = patch.grid.x * MM, patch.grid.y * MM * field
    edge, inside = abs(y).max(), patch.pressure > 0
    traction = np.asarray(patch.traction, float) * MPA
    size = np.hypot(traction[..., 0], traction[..., 1])
    rows = (
        (patch.pressure * MPA, "viridis", "pressure [MPa]"),
        (size, "viridis", "traction on the wheel [MPa]"),
        (depth * 1e4, "magma_r", "depth of a cell [1e-4 \u00b5m]"),
    )
    for axis, bar, (values, colours, name) in zip(axes, bars, rows, strict=False):
        drawn = axis.pcolormesh(y, x, np.where(inside, values, np.nan), cmap=colours, vmin=0, shading="nearest")
        figure.colorbar(drawn, cax=bar)
        axis.set_title(name, loc="left", fontsize=12)
        axis.set(ylabel="along x [mm]", xlim=(-edge, edge))
        axis.grid(False)
    every = np.unique(np.linspace(0, len(x) - 1, ARROWS).astype(int))
    across = np.unique(np.linspace(0, len(y) - 1, ARROWS).astype(int))
    pick = np.ix_(every, across)
    some = np.where(inside, 1.0, np.nan)[pick]
    along, lateral = traction[..., 0][pick] * some, traction[..., 1][pick] * some * field
    if traction.any():
        axes[1].quiver(y[across], x[every], lateral, along, color="white", pivot="mid", angles="uv", width=0.006)
    axes[3].fill_between(y, 0, depth.sum(axis=0) * 1e2, color=NOSE, alpha=0.4, lw=0, step="mid")
    axes[3].set_title("depth of a strip: sum along x", loc="left", fontsize=12)
    axes[3].set(
        xlim=axes[0].get_xlim(), ylim=(0, None), xlabel="across [mm], + towards the field side", ylabel="[0.01 \u00b5m]"
    )
