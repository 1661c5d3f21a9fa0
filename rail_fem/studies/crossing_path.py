"""Five wheels, or any others, over the cast crossing: contact bands on its plan, height of the axle, entry ramp,
lowest point, transfer, dip angle.

    rail-fem study crossing-path --out bands [--ratio 9.25] [--wheel P8 --wheel my.whl] [--sections uk_crossing.slcs]

The paths are rigid and quasi-static: run backwards (trailing) a wheel touches the same positions, and every climb
becomes a fall.
"""

from itertools import cycle
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from matplotlib.figure import Figure

from geometry.axes import tread_datum_y
from geometry.path.contact_band import PathNumbers, band_edges, clearance, path_numbers
from geometry.path.wheel_path import WheelPath, wheel_path
from geometry.profiles.formats.slices import read_slices
from geometry.profiles.wheel import WHEEL_NAMES
from geometry.surfaces.crossing import CastCrossing
from geometry.surfaces.sections import SectionCrossing, section_path
from rail_fem.scene.wheel_profile import wheel_shape
from rail_fem.show.crossing_figure import GAUGE_DEPTH
from rail_fem.show.panels import titled
from rail_fem.show.style import GREEN, HALO, NOSE, PURPLE, TOTAL, WING, new_figure
from rail_fem.studies.harness import OUT, QUICK, Table, publish

MM = 1e-3
LINE_CONTACT = 20 * MM  # a band wider than this is a line contact, whose deepest point is undetermined
APPROACH = 0.1 * MM  # elastic approach of a wheel under 80 to 100 kN, whose patch's width the bands show
RADIUS = 0.46
# geometry_and_materials.md 3.7, on the benchmark's sections at 1:9.25, radius 460 mm, found by others with cuts of the
# sections: lift [mm], steepest climb [mrad], lowest x [mm], fall, rise, dip [mrad]
REFERENCE = {
    "P8": (0.49, 21.6, 272, 7.3, 11.0, 18.3),
    "P8-worn": (1.10, 34.6, 304, 7.1, 7.9, 15.0),
    "P8-hollow": (2.70, 62, np.nan, np.nan, np.nan, 0.0),
    "P1": (-0.28, 0.0, 298, 5.4, 13.4, 18.8),
    "S1002": (0.61, 16.8, 276, 7.2, 10.3, 17.6),
}
REASONS = """Differences to the reference (1:9.25): lift, lowest point, fall, rise and dip agree to 0.01 mm, 1 mm, 0.1,
0.2 and 0.2 mrad. The steepest climb is here the slope of the path over the fitted surface, exact; there it was taken
over the sections, 11 mm apart on the ramp, between which straight lines make it up to a fifth steeper (hollow wheel: 60
here, 62 there, 68 over the sections by our own route). The hollow wheel has no dip in both; that it is carried on the
wing to x = 518 mm is not found here: over the surface and over the sections alike the nose takes it at 447 mm, and at
500 mm the wing is 3.9 mm clear of it."""
COLUMNS = (
    ("ramp_lift", "lift mm", 2),
    ("ramp_slope", "climb mrad", 1),
    ("ramp_x", "at x mm", 0),
    ("lowest_x", "lowest x mm", 0),
    ("transfer_x", "transfer x mm", 0),
    ("fall", "fall mrad", 1),
    ("rise", "rise mrad", 1),
    ("dip", "dip mrad", 1),
    ("trailing_slope", "trailing climb mrad", 1),
    ("trailing_x", "at x mm", 0),
)


def run_over(crossing: CastCrossing, name: str, spacing: float = 1 * MM, radius: float = RADIUS) -> WheelPath:
    """Path of one wheel (name or file) from plain rail to beyond the nose's topping."""
    end = min(0.9 * crossing.stretch, crossing.x_range[1] - 0.1)
    return wheel_path(
        crossing, wheel_shape(name), np.arange(crossing.shape.leg_start - 0.2, end, spacing), radius=radius
    )


def table(numbers: dict[str, PathNumbers], ratio: float) -> Table:
    """All numbers, with the reference's below each wheel where there is one."""
    rows = []
    for name, n in numbers.items():
        rows.append([shown_name(name), *(f"{1e3 * getattr(n, key):.{digits}f}" for key, _, digits in COLUMNS)])
        if ratio == 9.25 and name in REFERENCE:
            known = dict(zip((0, 1, 3, 5, 6, 7), REFERENCE[name]))
            told = lambda k, digits, known=known: f"{known[k]:.{digits}f}" if np.isfinite(known.get(k, np.nan)) else ""
            rows.append(["reference", *(told(k, digits) for k, (*_, digits) in enumerate(COLUMNS))])
    whole = REASONS if ratio == 9.25 and set(REFERENCE) <= set(numbers) else ""
    title = f"Crossing 1:{ratio:g}; trailing: the same path run backwards. {whole}"
    return Table(["wheel", *(head for _, head, _ in COLUMNS)], rows, title)


def shown_name(name: str) -> str:
    return name if name in WHEEL_NAMES else Path(name).name


def against_sections(file: Path, paths: dict[str, WheelPath], radius: float) -> str:
    """Largest difference of the axle's height between a crossing's own sections and the parametric one, and both
    transfers."""
    sections, rows = SectionCrossing.from_slices(read_slices(file)), [f"against the sections of {file.name}:"]
    for name, path in paths.items():
        inside = (path.x > sections.x[0] + 0.1) & (path.x < min(sections.x[-1] - 0.1, 0.75))
        x = path.x[inside][::4]
        own = section_path(sections, wheel_shape(name), x, tread_datum_y(), radius)
        nose = x[np.argmax(own.on_nose)] if own.on_nose.any() else np.nan
        rows.append(
            f"  {shown_name(name):<10} largest difference in height"
            f" {np.abs(own.height - path.height[inside][::4]).max() / MM:.3f} mm, nose carries from {nose / MM:.0f} mm"
            f" ({path.transfers[0] / MM:.0f} mm)"
        )
    return "\n".join(rows)


def outline(crossing: CastCrossing, x: np.ndarray, y: np.ndarray, body: str) -> np.ndarray:
    """(n, 2)  both sides of a body at x (n,), where it passes the gauge depth [m]; NaN where it is not."""
    grid_x, grid_y = np.meshgrid(x, y, indexing="ij")
    height = crossing.top_height(grid_x, grid_y, body)
    return band_edges(np.where(height > -GAUGE_DEPTH, -1.0, 1.0), y, 0.0)


def draw(crossing: CastCrossing, paths: dict[str, WheelPath], numbers: dict[str, PathNumbers]) -> Figure:
    """One plan a wheel with its band, and the heights of all axles below."""
    figure = new_figure(3.0 * len(paths) + 4.2)
    heights = [1.0] * len(paths) + [1.25]
    axes = figure.subplots(len(heights), 1, sharex=True, gridspec_kw={"height_ratios": heights})
    first = next(iter(paths.values()))
    x = np.arange(crossing.shape.leg_start - 0.15, first.x[-1] - 0.05, 2 * MM)
    y = np.arange(-60, 130.1, 0.25) * MM
    for axis, (name, run) in zip(axes, paths.items()):
        draw_plan(axis, crossing, run, numbers[name], name, x, y)
    name_positions(axes[0], crossing)
    draw_heights(axes[-1], paths, numbers)
    axes[-1].set_xlim(x[0] / MM, x[-1] / MM)
    return titled(
        figure,
        f"Contact bands on the cast crossing 1:{crossing.ratio:g}, wheel of radius {1e3 * first.radius:.0f} mm,"
        " centred, not yawed\nfacing runs to the right \u2192, trailing to the left \u2190 over the same bands; lateral"
        " scale enlarged",
        15,
    )


def draw_plan(
    axis, crossing: CastCrossing, run: WheelPath, n: PathNumbers, name: str, x: np.ndarray, y: np.ndarray
) -> None:
    """Metal above the gauge depth in grey, the band of contact on wing and nose in colour."""
    fine = np.arange(y[0], y[-1], 0.25 * MM)
    bands = []
    for body, grey, colour in (("wing", "#E3E3E3", WING), ("nose", "#CFCFCF", NOSE)):
        sides = outline(crossing, x, fine, body) / MM
        axis.fill_between(x / MM, *sides.T, color=grey, lw=0)
        axis.plot(x / MM, sides, color="#555555", lw=0.9)
        near = clearance(crossing, wheel_shape(name), run, x, y, body)
        bands.append(band_edges(near, y, APPROACH))
        axis.contourf(x / MM, y / MM, (near < APPROACH / 2).T.astype(float), levels=[0.5, 1.5], colors=[colour])
    carried = (
        np.where(run.on_nose, np.nan, run.contact_point[:, 1]),
        np.where(run.on_nose, run.contact_point[:, 1], np.nan),
    )
    for positions, edges in zip(carried, bands):
        width = np.interp(run.contact_point[:, 0], x, np.nan_to_num(edges[:, 1] - edges[:, 0]))
        known = (width < LINE_CONTACT) & (np.abs(np.gradient(positions)) < 0.5 * MM)
        axis.plot(run.contact_point[:, 0] / MM, np.where(known, positions, np.nan) / MM, color="white", lw=0.8)
    axis.axvline(n.transfer_x / MM, color="black", lw=1.0, ls="--")
    axis.text(n.transfer_x / MM + 6, 112, f"transfer {n.transfer_x / MM:.0f}", va="center", path_effects=HALO)
    climbs = f"ramp {n.ramp_lift / MM:+.2f} mm" + (
        f", {n.ramp_slope / MM:.1f} mrad at {n.ramp_x / MM:.0f}" if n.ramp_slope > 1e-3 else ""
    )
    dips = f"falls {n.fall / MM:.1f}, rises {n.rise / MM:.1f}: dip {n.dip / MM:.1f} mrad" if n.dip > 0 else "no dip"
    cone = " (cone 1:20 on plane 1:20: a line contact)" if name == "P1" else ""
    axis.set_title(f"{shown_name(name)}{cone}:  {climbs};  lowest at {n.lowest_x / MM:.0f}, {dips}", loc="left")
    axis.set(ylim=(y[0] / MM, y[-1] / MM), ylabel="y [mm], + field side")


def name_positions(axis, crossing: CastCrossing) -> None:
    """Names of the crossing's parts and of the colours, on the first plan."""
    c = crossing.shape
    named = (
        (c.leg_start - 0.12, 14, "plain rail"),
        (c.leg_start - 0.02, -46, "machined leg end"),
        (c.knuckle_x * c.stretch, -46, "knuckle"),
        (0.38 * c.stretch, 92, "wing rail"),
        (-0.06, -46, "flangeway"),
        (0.55 * c.stretch, 2, "nose"),
    )
    for at, height, words in named:
        axis.text(at / MM, height, words, ha="left", va="center", color="#333333", style="italic", path_effects=HALO)
    axis.plot([], [], color=WING, lw=7, label="band on the wing")
    axis.plot([], [], color=NOSE, lw=7, label="band on the nose")
    axis.plot([], [], color="#BBBBBB", lw=7, label=f"metal above {GAUGE_DEPTH / MM:g} mm depth")
    axis.plot([], [], color="black", lw=0.8, label="white line: deepest point")
    axis.legend(loc="upper left", ncols=2, framealpha=0.9)


def draw_heights(axis, paths: dict[str, WheelPath], numbers: dict[str, PathNumbers]) -> None:
    """Height of each axle over plain line, its transfer marked."""
    for (name, run), colour in zip(paths.items(), cycle((TOTAL, WING, GREEN, PURPLE, NOSE))):
        axis.plot(run.x / MM, run.height / MM, color=colour, label=shown_name(name))
        at = numbers[name].transfer_x
        axis.plot(at / MM, np.interp(at, run.x, run.height) / MM, "o", color=colour)
    axis.set(xlabel="x [mm], 0 at the theoretical intersection of the gauge lines", ylabel="height of the axle [mm]")
    axis.set_title("height over plain line; dots: transfer between wing and nose", loc="left")
    axis.legend(ncols=1, loc="upper right")


def main(
    ratio: Annotated[float, typer.Option(help="N of the crossing 1:N")] = 9.25,
    radius: Annotated[float, typer.Option(help="of the wheels [mm]")] = 1e3 * RADIUS,
    sections: Annotated[Path | None, typer.Option(help="a .slcs of the 1:9.25 crossing's own sections")] = None,
    wheel: Annotated[list[str] | None, typer.Option(help="name or profile file; may be given several times")] = None,
    quick: QUICK = False,
    out: OUT = None,
) -> None:
    """Wheels over the cast crossing: contact bands, entry ramp, lowest point, transfer, dip angle."""
    crossing, spacing = CastCrossing(ratio), (5 if quick else 1) * MM
    names = wheel or (["P8"] if quick else list(WHEEL_NAMES))
    paths = {name: run_over(crossing, name, spacing, radius * MM) for name in names}
    numbers = {name: path_numbers(path, crossing) for name, path in paths.items()}
    beside = "" if sections is None else against_sections(sections, paths, radius * MM)
    publish("crossing_path", out, [table(numbers, ratio)], lambda: draw(crossing, paths, numbers), beside)


if __name__ == "__main__":
    typer.run(main)
