"""A rigid sphere pressed into an elastic, perfectly plastic half-space: boundary elements, finite elements, fits.

    rail-fem study pressed-sphere --out sphere          1 to 30 times the approach of first yield; some minutes
    rail-fem study pressed-sphere --approach 55 --approach 110 --cells 6 --cells 8 --step 1.4      near the largest
                                                        pressure, with the limit of two sizes; many minutes
    rail-fem study pressed-sphere --quick               up to 10 times, coarse

Each row is pressed by the load that the fit of Kogut and Etsion gives; all others are taken at the approach that the
half-space finds. In small strain on a flat surface w, the approach over that of first yield, and Poisson's ratio are
all there is: radius, modulus and yield stress drop out. The fits are of large-strain elements of a sphere and a flat.
"""

import time
from dataclasses import dataclass, replace

import numpy as np
import typer

from bem.exact.yielding_sphere import first_yield, jackson_green, kogut_etsion
from bem.material import STEEL, Elastic, contact_modulus
from bem.patch import Grid
from bem.plastic.contact import PlasticHalfSpace
from bem.steel.hardening import Hardening
from rail_fem.result.extrapolation import limit_of
from rail_fem.show.panels import Panel
from rail_fem.show.table_and_figure import Table, publish
from rail_fem.static_fe.pressed_sphere import Pressed, press_sphere
from rail_fem.studies.harness import OUT, QUICK

RIGID = Elastic(1e17, 0.3)
RADIUS, YIELD = 0.1, 310e6  # [m], [Pa]
MODULUS = contact_modulus(RIGID, STEEL)
FIRST = first_yield(RADIUS, MODULUS, YIELD, STEEL.poisson)  # approach, load and area of first yield
BEYOND = 1.08  # approach up to which finite elements press, over the row's
STEP = 1.6  # from one load to the next of the half-space
TOLERANCE = 3e-4
MOST = 110.0  # approach over that of first yield up to which the fit goes


@dataclass(frozen=True)
class Indented:
    """By the half-space: approach, load and area over those of first yield, cells over the radius of contact, largest
    equivalent plastic strain, CPU seconds; area_bar : of a limit for vanishing cells, whose `cells` are infinite."""

    approach: float
    load: float
    area: float
    cells: float
    strain: float
    seconds: float
    area_bar: float = 0.0


@dataclass(frozen=True)
class Judged:
    """By finite elements at one approach: load and area over those of first yield, limits for vanishing elements, with
    their bars; CPU seconds."""

    load: float
    load_bar: float
    area: float
    area_bar: float
    seconds: float


def mean_pressure(load: float, area: float) -> float:
    """Over the yield stress, of load and area over those of first yield."""
    return load / area * FIRST.load / FIRST.area / YIELD


def indent(approach: float, cells: int, step: float = STEP) -> Indented:
    """The half-space under the load that the fit gives for an approach over that of first yield, by about so many cells
    over the radius of contact; `step` from one load to the next."""
    tick = time.process_time()
    load, area = (float(value) for value in kogut_etsion(np.float64(approach)))
    radius = np.sqrt(area * FIRST.area / np.pi)
    size, deep = radius / cells, 1.5 + 0.5 * np.log(1.5 + approach)
    n = 2 * int(np.ceil((1.2 + 0.35 * np.log(1 + approach)) * cells))
    grid = Grid.over((-n * size / 2, n * size / 2), (-n * size / 2, n * size / 2), n, n)
    x, y = grid.points()
    body = PlasticHalfSpace(grid, size, int(np.ceil(deep * cells)), RIGID, STEEL, Hardening.linear(YIELD))
    steps = 1 + int(np.ceil(np.log(max(load, 1.0)) / np.log(step)))
    for part in np.geomspace(min(1.0, load), load, steps):
        found = body.press((x**2 + y**2) / (2 * RADIUS), part * FIRST.load, TOLERANCE)
    patch = found.patch
    return Indented(
        patch.approach / FIRST.approach, load, patch.contact_area / FIRST.area,
        float(np.sqrt(patch.contact_area / np.pi) / size), float(found.state.peeq.max()), time.process_time() - tick,
    )  # fmt: skip


def vanishing(found: list[Indented]) -> Indented:
    """Limit for vanishing cells of one load by several sizes, coarse to fine, of first order in the cell: approach and
    area, with a bar of half of what it adds."""
    sizes = [1 / one.cells for one in found]
    approach, area = (limit_of(sizes, [getattr(one, name) for one in found], 1.0) for name in ("approach", "area"))
    return replace(found[-1], approach=approach.value, area=area.value, area_bar=area.doubt, cells=np.inf)


def press(approach: float, across: int) -> Pressed:
    """Finite elements up to somewhat more than an approach over that of first yield, `across` elements over the radius
    of contact."""
    w = BEYOND * max(approach, 1.0)
    radius = np.sqrt(max(w, 0.94 * w**1.146) * FIRST.area / np.pi) * (1 + 0.4 / across)  # the edge lies inside
    return press_sphere(lambda r: r**2 / (2 * RADIUS), radius, across, STEEL, Hardening.linear(YIELD))


def judge(runs: list[Pressed], approach: float, seconds: float = 0.0) -> Judged:
    """Limits at an approach over that of first yield, of runs coarse to fine. The area is of first order, as the edge
    of the contact lies a part of an element inside the last node (elastic: right to 0.1 % so): that part is taken for a
    half, and the limit for vanishing elements corrects it; the load is of order 1.5 (1.35 seen where it flows, more
    where it does not)."""
    found = [run.at(approach * FIRST.approach, ("load", "carrying")) for run in runs]
    values = np.array(found) / [FIRST.load, FIRST.area]
    sizes = [float(run.radius[0]) for run in runs]
    load, area = (limit_of(sizes, list(column), order) for column, order in zip(values.T, (1.5, 1.0)))
    return Judged(load.value, load.doubt, area.value, area.doubt, seconds)


def table(rows: list[tuple[Indented, Judged]]) -> Table:
    """Area and mean pressure at each approach by the half-space, finite elements and fits."""
    lines = []
    for here, there in rows:
        fits = [kogut_etsion(here.approach), jackson_green(here.approach, RADIUS, MODULUS, YIELD, STEEL.poisson)]
        ours, judges = mean_pressure(here.load, here.area), mean_pressure(there.load, there.area)
        bar = judges * float(np.hypot(there.load_bar / there.load, there.area_bar / there.area))
        lines.append(
            [
                f"{here.approach:.3g}", "limit" if np.isinf(here.cells) else f"{2 * here.cells:.1f}",
                f"{here.area:.2f}" + (f" +- {here.area_bar:.2f}" if here.area_bar else ""),
                f"{there.area:.2f} +- {there.area_bar:.2f}", f"{here.area / there.area - 1:+.1%}",
                *(f"{float(area):.2f}" for _, area in fits), f"{ours:.3f}", f"{judges:.3f} +- {bar:.3f}",
                f"{ours / judges - 1:+.1%}", *(f"{mean_pressure(float(load), float(area)):.3f}" for load, area in fits),
                f"{here.strain:.2%}", f"{here.seconds:.0f}, {there.seconds:.0f}",
            ]
        )  # fmt: skip
    head = ["w", "cells across", "area: half-space", "FE", "difference", "K-E", "J-G"]
    head += ["pressure: half-space", "FE", "difference", "K-E", "J-G", "largest strain", "CPU s: half-space, FE"]
    return Table(head, lines)


def panels(rows: list[tuple[Indented, Judged]]) -> list[Panel]:
    """Area over the elastic one, and mean pressure over the yield stress, over the approach."""
    w, at = np.geomspace(1.0, 110.0, 400), np.array([here.approach for here, _ in rows])
    loads = {
        "Kogut and Etsion (2002), fit": (w, *kogut_etsion(w), "--"),
        "Jackson and Green (2005), fit": (w, *jackson_green(w, RADIUS, MODULUS, YIELD, STEEL.poisson), "-."),
        "half-space (bem/plastic)": (at, *np.array([(here.load, here.area) for here, _ in rows]).T, "+"),
        "finite elements, limit": (at, *np.array([(there.load, there.area) for _, there in rows]).T, "o"),
    }
    areas = {name: (x, area / x, look) for name, (x, _, area, look) in loads.items()}
    pressures = {name: (x, mean_pressure(load, area), look) for name, (x, load, area, look) in loads.items()}
    asked = ("area of contact over Hertz' at this approach", areas), ("mean pressure over yield stress", pressures)
    return [Panel("approach over that of first yield", words, lines, "", "x") for words, lines in asked]


def main(
    approach: list[float] = typer.Option([1.0, 3.0, 10.0, 30.0], help="over that of first yield, up to 110"),
    cells: list[int] = typer.Option([8], help="cells of the half-space over the radius; of several the limit, too"),
    step: float = typer.Option(STEP, help="from one load of the half-space to the next"),
    across: list[int] = typer.Option([12, 24], help="finite elements over the radius, coarse to fine"),
    quick: QUICK = False,
    out: OUT = None,
) -> None:
    """A sphere pressed into a yielding half-space: boundary elements, finite elements, published fits."""
    if quick:
        approach, cells, across = [1.0, 3.0, 10.0], [6], [6, 12]
    if not all(0 < w <= MOST for w in approach):
        raise typer.BadParameter(f"--approach goes up to {MOST:g}: the fit that gives the loads ends there")
    rows = []
    for w in approach:
        found, tick = [indent(w, count, step) for count in sorted(cells)], time.process_time()
        found += [vanishing(found)] if len(found) > 1 else []
        runs = [press(max(here.approach for here in found), count) for count in sorted(across)]
        seconds = time.process_time() - tick
        rows += [(here, judge(runs, here.approach, seconds)) for here in found]
        typer.echo(f"w = {found[-1].approach:.3g}: {found[-1].seconds:.0f} and {seconds:.0f} CPU s", err=True)
    title = "A rigid sphere on an elastic, perfectly plastic half-space (Poisson's ratio 0.3)"
    publish("pressed_sphere", out, [table(rows)], panels(rows), title)
