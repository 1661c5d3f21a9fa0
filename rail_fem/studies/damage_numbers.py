"""Every number asked of the damage part that takes seconds, measured anew, with what was asked beside it, and wear of
one patch by the method of its pressure.

    rail-fem study damage-numbers --out numbers        some two minutes of one processor
    rail-fem study damage-numbers --quick              patches and points alone, some seconds

Times are processor times of this process on this machine, after everything has been compiled.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import typer

from bem.halfspace.fastsim import elliptic_patch, fastsim
from bem.halfspace.polach import polach_force
from bem.halfspace.slip_dependent_friction import SlipDependentFriction
from bem.material import STEEL
from bem.patch import Creepage, Patch
from rail_fem.case.casefile import load_case
from rail_fem.case.examples import example
from rail_fem.cyclic.closed_forms import ratchet_strain
from rail_fem.cyclic.law import cyclic_law
from rail_fem.cyclic.paths import uniaxial_cycles
from rail_fem.cyclic.rolling_line import NoEquilibriumError, rolling_line_contact
from rail_fem.damage.evolution import evolve
from rail_fem.damage.fatigue import WholeLifeRail, shakedown_limits
from rail_fem.damage.sites import crossing_site, stepping_of, switch_section
from rail_fem.damage.wear import (
    DENSITY,
    Archard,
    BritishRail,
    KrausePoll,
    Usfd,
    slip_size,
    specific_wear,
    tgamma,
    worn_area,
)
from rail_fem.light.patch_methods import THESIS_STEEL, WHEEL_LOAD, method_rows, thesis_pair
from rail_fem.scene.scene import Scene
from rail_fem.settings.damage import DamageSettings
from rail_fem.studies.harness import OUT, QUICK, Table, publish

CREEPAGE = Creepage(3.7917e-5, 0.005, 0.2023)  # Table 6-2
HEAD = "60E1"  # rail_fem/light/patch_methods.py says why
LAW = Archard(2.8e9, coefficient=10e-4)
SPEED, CELL = 15.0, 11.32e-3 / 50  # of the thesis' grid along x [m]
YIELD = 300e6  # of the steel whose points are led [Pa]
AXES, LOAD = (6e-3, 4e-3), 80e3  # of the patch of the creep curves [m], [N]


class Number(NamedTuple):
    """A row: what, what was asked of it, what it is."""

    what: str
    asked: str
    found: str


def table_patch(cells: int = 50) -> Patch:
    """The patch of the thesis' Table 6-2, rolled."""
    patch = elliptic_patch(5.66e-3, 4.02e-3, WHEEL_LOAD, (cells, cells))
    return fastsim(patch, THESIS_STEEL, THESIS_STEEL, 0.3, CREEPAGE, estimate=False)


def patch_numbers() -> Iterator[Number]:
    """Of one patch."""
    patch, power = table_patch(), table_patch().frictional_power
    yield Number(
        "T gamma of Table 6-2's patch; friction power", "74.0 N; 73.7 N", f"{tgamma(patch):.1f}; {power:.1f} N"
    )
    area = [worn_area(LAW, table_patch(n), SPEED) for n in (50, 100, 200)]
    strip = [LAW.depth(table_patch(n), SPEED).max() for n in (50, 100, 200)]
    off = [abs(v[0] / v[2] - 1) for v in (strip, area)]
    yield Number(
        "deepest strip and area of that patch, 50 against 200 cells each way", "1 %", f"{off[0]:.3%}, {off[1]:.3%}"
    )
    cell = LAW.cells(patch, SPEED).max()
    yield Number(
        "largest cell of 50 x 50, deepest strip (k = 10e-4, 2.8 GPa)",
        "3.66e-4 \u00b5m printed",
        f"{cell * 1e6:.2e}, {strip[0] * 1e6:.2e} \u00b5m",
    )
    model = WholeLifeRail()
    regions = ", ".join(f"{model.region(v)} ({float(model.damage(v)):+.1e})" for v in (5.43, 210.17))
    yield Number("regions of 5.43 and 210.17 N (damage an axle)", "none; wear, below 0", regions)
    sliding = fastsim(
        elliptic_patch(*AXES, LOAD, (50, 50)), STEEL, STEEL, 0.3, Creepage(0.05), bound="elliptic", estimate=False
    )
    law = Archard(2.8e9, coefficient=1e-3)
    energy = worn_area(law, sliding, SPEED) / (1e-3 / (0.3 * 2.8e9) * sliding.frictional_power) - 1
    yield Number("wear by energy, k / (mu H), in full sliding", "equal", f"{abs(energy):.0e}")
    mass = lambda own, speed=1e-3: specific_wear(own, sliding, speed) * DENSITY * 1e9
    found = [mass(KrausePoll()), mass(KrausePoll(), 30.0), mass(Archard(2.85e9, coefficient=1e-4))]
    usfd, brr = (specific_wear(own, patch, SPEED) * DENSITY * 1e9 for own in (Usfd(), BritishRail()))
    yield Number(
        "\u00b5g/J: Krause-Poll mild and severe, Archard 1e-4 at 2.85 GPa, USFD and BRR of their first regimes",
        "0.77, 1.7, 0.92, 5.3, 6.2",
        ", ".join(f"{v:.2f}" for v in (*found, usfd, brr)),
    )


def rolled(patch: Patch) -> Patch:
    """With tractions and slip under Table 6-2's creepages, which are those at the largest pressure: there y is 0."""
    grid, along = patch.grid, patch.pressure.max(axis=0)
    patch = replace(patch, grid=replace(grid, y_first=grid.y_first - grid.y[int(np.argmax(along))]))
    return fastsim(patch, THESIS_STEEL, THESIS_STEEL, 0.3, CREEPAGE, estimate=False)


def method_patches() -> dict[str, Patch]:
    """Rolled patches by the method of their pressure."""
    found = {"Hertz, thesis' ellipse": elliptic_patch(5.66e-3, 4.02e-3, WHEEL_LOAD, (50, 51))}
    wanted = {"2.5D (a) parabolic, 2a = 11.32 mm", "2.5D (b), coupled slices", "half-space"}
    found |= {row.method: row.known_patch for row in method_rows(thesis_pair(HEAD), HEAD) if row.method in wanted}
    return {name: rolled(patch) for name, patch in found.items()}


class WearNumbers(NamedTuple):
    """Largest cell on cells of the thesis' length [m], its pressure [Pa] and slip, deepest strip [m], worn area [m2],
    mean slip weighted with pressure."""

    cell: float
    pressure: float
    slip: float
    strip: float
    area: float
    mean_slip: float


def wear_numbers(patch: Patch) -> WearNumbers:
    cells = LAW.cells(patch, SPEED)
    at = np.unravel_index(np.argmax(cells), cells.shape)
    slip = slip_size(patch)
    return WearNumbers(
        cells[at] * CELL / patch.grid.dx,
        float(patch.pressure[at]),
        float(slip[at]),
        float(LAW.depth(patch, SPEED).max()),
        worn_area(LAW, patch, SPEED),
        float((patch.pressure * slip).sum() / patch.pressure.sum()),
    )


def wear_rows() -> list[list[str]]:
    """Wear of that patch by the method of its pressure, thesis section 6.2.5, and the difference to the first: all
    carry the same force, so that the worn area differs by slip alone (weighted with pressure)."""
    rows, first = [], None
    for name, patch in method_patches().items():
        own = wear_numbers(patch)
        first = first or own
        scales = WearNumbers(1e10, 1e-6, 1e3, 1e8, 1e11, 1e3)
        off = ["" if a == v else f" ({v / a - 1:+.0%})" for v, a in zip(own, first)]
        told = [f"{v * scale:.3g}{words}" for v, scale, words in zip(own, scales, off)]
        rows.append([name, f"{patch.max_pressure / 1e6:.0f}", *told, f"{tgamma(patch):.1f}"])
    return rows


WEAR_HEAD = [
    "pressure by", "p0 [MPa]", "largest cell [1e-4 um]", "its p [MPa]", "its slip [1e-3]", "deepest strip [1e-2 um]",
    "area [1e-5 mm2]", "mean slip [1e-3]", "T gamma [N]",
]  # fmt: skip


def creep_numbers() -> Iterator[Number]:
    """Falling friction against Polach's formula."""
    creep, patch = np.geomspace(1e-4, 0.5, 40), elliptic_patch(*AXES, LOAD, (60, 60))
    for name, static, kinetic in (("constant", 0.55, 0.55), ("falling to 0.22", 0.55, 0.22)):
        law = SlipDependentFriction.at_speed(static, kinetic, 1 / 0.6, 20.0)
        roll = lambda v, law=law: fastsim(patch, STEEL, STEEL, law, Creepage(v), estimate=False).tangential_force[0]
        ours = -np.array([roll(v) for v in creep]) / LOAD
        along = np.stack([creep, 0 * creep], axis=1)
        published = -polach_force(along, LOAD, AXES, STEEL, law)[:, 0] / LOAD
        tops = ", ".join(f"{own.max():.3f} at {creep[own.argmax()]:.2%}" for own in (ours, published))
        yield Number(
            f"creep curve by FASTSIM against Polach's formula, friction 0.55 {name}, 20 m/s",
            "published",
            f"{np.abs(ours - published).max() / static:.1%} of 0.55 apart; largest {tops}",
        )


def plastic_numbers() -> Iterator[Number]:
    """Of points and of a rolling line contact."""
    law = cyclic_law(210e9, 0.3, YIELD, [50e9], [200.0])
    exact, grown = ratchet_strain(50e9, 200.0, YIELD, -320e6, 450e6), []
    for n in (100, 200, 400):
        grown.append(np.diff(uniaxial_cycles(law, (-320e6, 450e6), 3, n, True)[n - 1 :: 2 * n, 0])[0] / exact - 1)
    yield Number(
        "ratchetting of one back stress in a uniaxial cycle, closed form",
        "1e-8 by another integration",
        f"{grown[2]:.2%} by 400 steps, {abs(2 * grown[2] - grown[1]):.1e} to first order, "
        f"{abs((8 * grown[2] - 6 * grown[1] + grown[0]) / 3):.0e} to second",
    )
    limits = shakedown_limits(np.zeros(1), line=True)
    yield Number(
        "line contact: first yield (Tresca) and elastic shakedown, from the elastic field",
        "3.3 k, 4.0 k",
        f"{limits['elastic'][0]:.3f}, {limits['shakedown'][0]:.3f} k",
    )
    yield Number(
        "line contact rolled over perfectly plastic steel: flows from, has equilibrium up to (by 0.02 k)",
        "3.10 k, 4.00 k",
        "{:.2f}, {:.2f} k".format(*_rolled_limits()),
    )


def _rolled_limits() -> tuple[float, float]:
    """p0 / k in six passes: the first that flows, the last that has an equilibrium."""
    law, depth = cyclic_law(210e9, 0.3, YIELD), 5e-3 * np.array([0.5, 0.7])
    flows, carried = np.nan, np.nan
    for ratio in np.r_[np.arange(3.06, 3.13, 0.02), np.arange(3.96, 4.03, 0.02)]:
        try:
            history = rolling_line_contact(law, 5e-3, ratio * YIELD / np.sqrt(3), 0.0, depth, 6, 400)
        except NoEquilibriumError:
            break
        carried = ratio
        if np.isnan(flows) and history.plastic_strain[-1].max() > 1e-7:
            flows = ratio
    return flows, carried


def damage_case(name: str, **changes: object) -> tuple[Scene, DamageSettings]:
    """Scene and [damage] of a shipped case of cases/damage, [damage] changed."""
    path = example("nose_transfer").parent / "damage" / f"{name}.toml"
    case = load_case(path, {f"damage.{k}": v for k, v in changes.items()})
    if case.damage is None:
        raise KeyError(f"{path}: has no table [damage]: is the installation whole?")
    return case.scene, case.damage


def differ(one: np.ndarray, two: np.ndarray) -> str:
    """Deepest and sum of depths over those of the second, and the largest difference over its deepest."""
    largest = np.abs(one - two).max() / two.max()
    return f"{one.max() / two.max() - 1:+.2%}, {one.sum() / two.sum() - 1:+.2%}, {largest:.2%}"


def crossing_numbers() -> Iterator[Number]:
    """Of one wheelset pass over the transfer."""
    site = crossing_site(*damage_case("crossing_transfer"))
    first = site.first()
    site.rate(first)
    start = time.process_time()
    rate = site.rate(first)
    spent, patches = time.process_time() - start, len(rate.tgamma[0])
    yield Number(
        f"one pass over the transfer: forces, {patches} patches of 50 x 50 cells, {len(site.laws)} laws",
        "2 s of one core",
        f"{spent:.2f} s",
    )
    fine = crossing_site(*damage_case("crossing_transfer", cells=100))
    other = fine.rate(fine.first())
    for law in ("archard", "krause_poll"):
        one, two = rate.depth[law], other.depth[law]
        yield Number(
            f"that pass, 50 against 100 cells each way, {site.laws[law].label}: deepest, volume, largest difference",
            "1 %",
            differ(one, two),
        )
    worst = 0.0
    for law in site.laws:
        new, _ = first.worn(rate.depth[law] * 10)
        worst = max(worst, abs(new.volume / (10 * (rate.removed[law] - rate.beyond[law])) - 1))
    yield Number("volume from the patches' strips into the surface, all laws", "1e-6", f"{worst:.0e}")


def switch_numbers() -> Iterator[Number]:
    """Of the switch section's 2,000 passes."""
    ends = {}
    for block in (200.0, 100.0, 50.0):
        scene, settings = damage_case("switch_section")
        start = time.process_time()
        section: Any = switch_section(scene, settings)
        *_, ends[block] = evolve(section, 2000.0, replace(stepping_of(settings), block=block))
        if block == settings.block:
            spent = time.process_time() - start
    yield Number(f"switch section, 2,000 passes in blocks of {settings.block:g}", "30 s", f"{spent:.1f} s")
    best = ends[50.0].depth
    for block in (200.0, 100.0):
        own = ends[block].depth
        yield Number(
            f"its wear in blocks of {block:g} at most against 50: deepest, area, largest difference over the deepest",
            "1 %",
            differ(own, best),
        )
    end = ends[200.0]
    yield Number(
        "its area, factor that met it in each step", "1e-6", f"{end.correction:.0e} of curvature, met to 1e-10"
    )


def main(quick: QUICK = False, out: OUT = None) -> None:
    """Every number asked of the damage part that takes seconds."""
    parts = [patch_numbers, creep_numbers, plastic_numbers, *(() if quick else (crossing_numbers, switch_numbers))]
    tables = [Table(["number", "asked", "measured"], [row for part in parts for row in part()])]
    if not quick:
        tables.append(Table(WEAR_HEAD, wear_rows(), "Wear of one patch by the method of its pressure"))
    publish("damage_numbers", out, tables)


if __name__ == "__main__":
    typer.run(main)
