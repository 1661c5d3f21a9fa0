"""Figures of a patch by several methods: pressure profiles, pressure maps side by side."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from scipy.interpolate import RegularGridInterpolator

from rail_fem.light.patch_methods import BLOCKS, THESIS_ROWS, WHEEL_LOAD, MethodRow, contact_point_of
from rail_fem.show.style import GREEN, NOSE, ORANGE, TOTAL, WING, new_figure

STYLES = {
    "half-space": (TOTAL, "-"),
    BLOCKS: (GREEN, "--"),
    "2.5D (a) parabolic, 2a = 11.32 mm": (ORANGE, "-"),
    "2.5D (a) elliptic, 2a = 11.32 mm": (WING, "-"),
}
FINITE = (NOSE, "o")


def drawn_rows(rows: list[MethodRow]) -> list[tuple[MethodRow, str, str]]:
    """Row, colour and line of those that a figure shows: the methods of STYLES and the finest finite elements."""
    found = [(row, *STYLES[row.method]) for row in rows if row.method in STYLES]
    finest = next(row for row in rows if row.patch is rows[-1].patch)
    return [*found, (finest, *FINITE)]


def across_from_contact(row: MethodRow) -> np.ndarray:
    """s of a patch's columns [m], from the initial contact; slices of whole profiles count from the middle of the
    track."""
    whole = row.method.startswith("2.5D") and row.method != BLOCKS
    patch = row.known_patch
    return patch.grid.y - (contact_point_of(patch) if whole else 0.0)


def draw_profiles(cases: dict[str, list[MethodRow]]) -> Figure:
    """Pressure across the patch where it is highest, and along it, every method; one row for each rail."""
    figure = new_figure(4.8 * len(cases))
    for (across, along), (rail, rows) in zip(figure.subplots(len(cases), 2, squeeze=False), cases.items()):
        for row, colour, style in drawn_rows(rows):
            kind = {"color": colour, "lw": 1.5, "ms": 4, "mfc": "none", "label": row.method}
            patch = row.known_patch
            middle = int(np.abs(patch.grid.x).argmin())
            across.plot(across_from_contact(row) * 1e3, patch.pressure[middle] / 1e6, style, **kind)
            along.plot(patch.grid.x * 1e3, patch.pressure.max(axis=1) / 1e6, style, **kind)
        largest = THESIS_ROWS[0].max_pressure / 1e6
        across.axhline(largest, color="#777777", lw=1.2, ls=":", label="thesis: FEA, largest")
        words = "along the face, from the initial contact [mm]"
        across.set(title=f"P8 on {rail}, {WHEEL_LOAD / 1e3:.4g} kN: across, at x = 0", xlabel=words)
        along.set(title=f"P8 on {rail}: largest over each section, along the patch", xlabel="x [mm]")
        for axis in (across, along):
            axis.set(ylabel="pressure [MPa]", ylim=(0, None))
        across.legend(fontsize=9, loc="upper right")
    return figure


def draw_maps(cases: dict[str, list[MethodRow]]) -> Figure:
    """Pressure maps of finite elements, half-space and slices, and where the two differ from the first; one row for
    each case."""
    figure = new_figure(2.9 * len(cases))
    for line, (name, rows) in zip(figure.subplots(len(cases), 5, squeeze=False), cases.items()):
        others = [next(row for row in rows if row.method == method) for method in ("half-space", BLOCKS)]
        _map_line(figure, line, name, drawn_rows(rows)[-1][0], others)
    return figure


def _map_line(figure, line, name: str, finest: MethodRow, others: list[MethodRow]) -> None:
    reference = finest.known_patch
    x, s = reference.grid.x, reference.grid.y
    top = max(row.max_pressure for row in (finest, *others)) / 1e6
    for axis, row in zip(line, (finest, *others)):
        patch = row.known_patch
        pressure = np.where(patch.pressure > 0, patch.pressure / 1e6, np.nan)
        look = {"cmap": "viridis", "vmin": 0, "vmax": top, "shading": "nearest"}
        drawn = axis.pcolormesh(across_from_contact(row) * 1e3, patch.grid.x * 1e3, pressure, **look)
        label = "finite elements" if row is finest else row.method.split(",")[0]
        axis.set_title(f"{label}\n{row.max_pressure / 1e6:.0f} MPa, {row.area * 1e6:.0f} mm²", fontsize=11)
    figure.colorbar(drawn, ax=line[:3], label="pressure [MPa]", shrink=0.9)
    for axis, row in zip(line[3:], others):
        patch = row.known_patch
        inside = RegularGridInterpolator(
            (patch.grid.x, across_from_contact(row)), patch.pressure, bounds_error=False, fill_value=0.0
        )
        miss = (inside(tuple(np.meshgrid(x, s, indexing="ij"))) - reference.pressure) / finest.max_pressure * 100
        look = {"cmap": "RdBu_r", "vmin": -10, "vmax": 10, "shading": "nearest"}
        drawn = axis.pcolormesh(s * 1e3, x * 1e3, np.where((miss != 0), miss, np.nan), **look)
        axis.set_title(f"{row.method.split(',')[0]}\nminus finite elements", fontsize=11)
    figure.colorbar(drawn, ax=line[3:], label="of the largest pressure [%]", shrink=0.9)
    for axis in line:
        axis.set(xlim=(s[0] * 1e3, s[-1] * 1e3), ylim=(x[0] * 1e3, x[-1] * 1e3), xlabel="across [mm]")
        axis.set_aspect("equal")
    line[0].set_ylabel(f"{name}\nx, forward [mm]")
