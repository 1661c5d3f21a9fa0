"""How much more a ridge flows than a half-space under the same force: plane strain, the free sides alone changed.

    rail-fem study plastic-ridge --out ridge      four radii, two loads, two sizes of element; some minutes
    rail-fem study plastic-ridge --quick          two radii, one load

A rigid cylinder presses a flat and ridges with a rounded crown and flanks of 45 degrees, by finite elements
(rail_fem/static_fe/pressed_ridge.py). The gap has the same curvature on all, so that elastic patches differ by the
free sides alone. Radii are counted in depths of the plastic zone that the same force makes in the flat: the measure by
which bem_plastic flags a corner. Results are over those of the flat.
"""

import time
from dataclasses import dataclass

import numpy as np
import typer

from bem.material import STEEL, Elastic, contact_modulus
from bem.steel.hardening import Hardening
from rail_fem.show.panels import Panel
from rail_fem.show.table_and_figure import Table, publish
from rail_fem.static_fe.pressed_ridge import PressedRidge, Ridge, press_ridge
from rail_fem.static_fe.small_strain import SmallStrainError
from rail_fem.studies.harness import OUT, QUICK

RIGID = Elastic(1e17, 0.3)
YIELD, SLOPE = 480e6, 2e9  # [Pa]: about a rail of today
CURVATURE = 10.0  # of the gap [1/m]; drops out of what is shown but for a / R, some per cent
FLANK = np.pi / 4
FALL = 2.5  # from the crown to the level beside, over the depth of the flat's zone
SOFTEST = 1.25  # mean pressure over yield stress that is expected at least: room for the contact to grow
SHOWN = {
    "integral": "plastic strain over the section",
    "max_strain": "largest plastic strain",
    "zone_depth": "depth of the zone",
    "half_width": "half-width of contact",
}


@dataclass(frozen=True)
class RidgeRow:
    """One ridge under one load: Hertz' largest pressure over the yield stress, radius over the flat's zone depth,
    quantities of SHOWN over the flat's by the finest elements, what the last halving of the elements changed them by,
    CPU seconds."""

    ratio: float
    radius: float
    value: dict[str, float]
    change: dict[str, float]
    seconds: float


def hertz_load(ratio: float) -> tuple[float, float]:
    """Load per length [N/m] and half-width [m] of the elastic flat whose largest pressure is `ratio` yield stresses."""
    modulus = contact_modulus(RIGID, STEEL)
    half = 2 * ratio * YIELD / (modulus * CURVATURE)
    return float(np.pi / 2 * ratio * YIELD * half), float(half)


def pressed(ridge: Ridge, load: float, across: int) -> PressedRidge:
    """A ridge pressed somewhat beyond a load [N/m]; `across` : elements over the half-width by a pressure of 2.5 Y."""
    expected = load / (2 * 2.5 * YIELD)
    room, hardening = 2.5 / SOFTEST, Hardening.linear(YIELD, SLOPE)
    elements = int(np.ceil(room * across))
    return press_ridge(ridge, CURVATURE, room * expected, elements, STEEL, hardening, 1.02 * load)


def rows_of(ratio: float, radii: list[float], sizes: list[int]) -> tuple[dict[str, float], list[RidgeRow]]:
    """The flat's own numbers, depths and widths over Hertz' half-width, and a row for each radius over its zone's
    depth; sizes : elements over the half-width, coarse to fine."""
    load, half = hertz_load(ratio)
    flats = [pressed(Ridge(), load, size) for size in sizes]
    depth = flats[-1].at(load, "zone_depth")
    own = {name: flats[-1].at(load, name) for name in SHOWN}
    own = own | {
        "zone_depth": depth / half,
        "half_width": own["half_width"] / half,
        "integral": own["integral"] / half**2,
    }
    rows = []
    for radius in radii:
        tick, found = time.process_time(), []
        for size, flat in zip(sizes, flats):
            try:
                one = pressed(Ridge(radius * depth, FLANK, FALL * depth), load, size)
            except SmallStrainError as fault:
                typer.echo(f"radius {radius:g} depths at {ratio:g} Y: {fault}", err=True)
                found.append(dict.fromkeys(SHOWN, np.nan))
                continue
            found.append({name: one.at(load, name) / flat.at(load, name) for name in SHOWN})
        change = {name: found[-1][name] - found[-2][name] if len(found) > 1 else np.nan for name in SHOWN}
        rows.append(RidgeRow(ratio, radius, found[-1], change, time.process_time() - tick))
        typer.echo(
            f"{ratio:g} Y, radius {radius:g} depths: strain {found[-1]['integral']:.2f} times the flat's", err=True
        )
    return own, rows


def table(flats: dict[float, dict[str, float]], rows: list[RidgeRow]) -> Table:
    """A row for each load and radius."""
    head = ["Hertz' pressure over Y", "radius of the ridge over the zone's depth", *SHOWN.values(), "CPU s"]
    lines = []
    for ratio, own in flats.items():
        text = {
            "integral": f"{own['integral']:.3g} half-widths squared", "max_strain": f"{own['max_strain']:.2%}",
            "zone_depth": f"{own['zone_depth']:.2f} half-widths", "half_width": f"{own['half_width']:.2f} half-widths",
        }  # fmt: skip
        lines.append([f"{ratio:g}", "flat", *(text[name] for name in SHOWN), "-"])
        for row in rows:
            if row.ratio == ratio:
                change = {
                    name: f" ({row.change[name]:+.2f})" if np.isfinite(row.change[name]) else "" for name in SHOWN
                }
                shown = [f"{row.value[name]:.2f}{change[name]}" for name in SHOWN]
                lines.append([f"{ratio:g}", f"{row.radius:g}", *shown, f"{row.seconds:.0f}"])
    return Table(head, lines)


def panels(rows: list[RidgeRow]) -> list[Panel]:
    """Plastic strain and half-width over the flat's, against the radius of the ridge."""
    found = []
    for name, log in (("integral", "xy"), ("half_width", "x")):
        lines = {}
        for ratio in sorted({row.ratio for row in rows}):
            mine = sorted((row for row in rows if row.ratio == ratio), key=lambda row: row.radius)
            own = [row.radius for row in mine], [row.value[name] for row in mine], "o-"
            lines[f"Hertz' pressure {ratio:g} times the yield stress"] = own
        found.append(Panel("radius over the flat's zone depth", f"{SHOWN[name]}, over the flat's", lines, "", log))
    return found


def main(
    ratio: list[float] = typer.Option([3.0, 6.0], help="Hertz' largest pressure on the flat, over the yield stress"),
    radius: list[float] = typer.Option([5.0, 2.0, 1.0, 0.5], help="of the ridge, over the depth of the flat's zone"),
    across: list[int] = typer.Option([6, 12], help="finite elements over the half-width of contact, coarse to fine"),
    quick: QUICK = False,
    out: OUT = None,
) -> None:
    """A ridge against a half-space under the same force: how much more it flows."""
    if min(ratio) <= 0 or min(radius) <= 0 or min(across) < 3:
        raise typer.BadParameter("loads and radii must be positive, and at least 3 elements lie over the half-width")
    if quick:
        ratio, radius, across = [3.0], [2.0, 0.5], [4, 8]
    flats, rows = {}, []
    for one in ratio:
        flats[one], found = rows_of(one, radius, sorted(across))
        rows += found
    title = "A cylinder pressed along a ridge with flanks of 45 degrees, over a flat, plane strain"
    publish("plastic_ridge", out, [table(flats, rows)], panels(rows), title)
