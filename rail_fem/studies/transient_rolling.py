"""Study: does it matter for friction work and wear that a patch changes while it rolls over the wing-nose transfer?

    rail-fem study transient-rolling --out transient            reference pass; some half a minute
    rail-fem study transient-rolling --quick                    larger steps

Patches of wing and nose come from a pass of `rigid_hertz`: position, Hertz ellipse, load and creepages, every half a
millimetre. Once each rolls steadily, as a study of wear takes it; once points of the rail keep what the patch has done
to them so far, while its load, size and creepages change (bem/halfspace/transient_fastsim.py). Both on the same grid of
points, so that they differ by time alone. Forces on wing and nose themselves are those of the pass in both.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from bem.halfspace.transient_fastsim import EllipseHistory, Rolled, SlipLaw, transient
from bem.material import Pair
from geometry.surfaces.bodies import BODIES
from rail_fem.case.casefile import load_case
from rail_fem.case.examples import example
from rail_fem.damage.crossing import PassContacts, pass_contacts, patch_options
from rail_fem.damage.wear import JENDEL
from rail_fem.hierarchy import solve
from rail_fem.scene.scene import Scene
from rail_fem.settings.damage import DamageSettings
from rail_fem.show.panels import Panel
from rail_fem.show.table_and_figure import Table, publish
from rail_fem.studies.harness import OUT, QUICK

SPACING = 0.5e-3  # of the patches of the pass, and of steady ones [m]
STEP = 0.2e-3  # rolled at once, and of the grid along [m]
ACROSS = 0.05e-3  # of the grid across [m]
LENGTH = 10e-3  # of the path over which differences are averaged [m]
MM = 1e3


@dataclass(frozen=True, eq=False)
class SteadyAndMoving:
    """One body. x : (n,) of the wheel at every step [m];  load (n,) [N];  creepage (n, 3);  moving, steady : rolled
    through the pass, and each patch by itself;  traction : moving, where points keep their traction as the bed
    softens;  coarse : moving by steps of twice the length"""

    x: np.ndarray
    load: np.ndarray
    creepage: np.ndarray
    moving: Rolled
    steady: Rolled
    traction: Rolled
    coarse: Rolled

    def tgamma(self, rolled: Rolled) -> np.ndarray:
        """(n,) tractive forces times creepages [N]."""
        return -(rolled.force * self.creepage[:, :2]).sum(axis=1)


def history_of(contacts: PassContacts, body: int, step: float, direction: int) -> tuple[EllipseHistory, np.ndarray]:
    """Patches of a body at steps of `step` [m] of the wheel's path, seen so that it runs to + x, and where the wheel is
    [m]. Linear between the patches of the pass. Raises ValueError where it carries at fewer than two positions."""
    own = np.flatnonzero(contacts.body == body)
    if len(own) < 2:
        raise ValueError(f"{BODIES[body]}: carries at {len(own)} position(s) of the pass; nothing rolls there")
    own = own[np.argsort(direction * contacts.x[own])]
    at = direction * contacts.x[own]
    x = np.arange(at[0], at[-1] + 1e-9, step)
    between = lambda values: np.stack([np.interp(x, at, row) for row in np.atleast_2d(values.T)], axis=1)
    grid, patches = contacts.patches.grid, contacts.patches
    semi = np.stack([grid.dx * grid.nx, grid.dy * grid.ny], axis=1) / 2
    centre = contacts.position[own, :2] * [direction, 1]
    creepage = patches.creepage[own] * [direction, 1, direction]
    load = between(patches.normal_force[own])[:, 0]
    before = np.clip(np.searchsorted(at, x, side="right") - 1, 0, len(at) - 2)
    load[(at[before + 1] - at[before] > 1.5 * SPACING) & (x > at[before]) & (x < at[before + 1])] = 0.0  # it flies
    return EllipseHistory(between(centre), between(semi[own]), load, between(creepage)), direction * x


def steady_of(history: EllipseHistory, pair: Pair, friction: float, step: float, cell, law: SlipLaw) -> Rolled:
    """Each patch of a history as if it had always been so."""
    every = max(round(SPACING / step), 1)
    at = np.arange(0, len(history.load), every)
    rows = []
    for k in at:
        count = int(np.ceil(2.2 * history.semi[k, 0] / step)) + 2
        found = transient(history.held(int(k), count, step), pair, friction, step, cell, law)
        rows.append([*found.force[-1], found.power[-1], found.volume[-1]])
    table = np.array(rows).T
    force_x, force_y, power, volume = (np.interp(np.arange(len(history.load)), at, row) for row in table)
    return Rolled(np.stack([force_x, force_y], axis=1), power, volume)


def moving(
    history: EllipseHistory, pair: Pair, friction: float, step: float, law: SlipLaw, every: int, **how
) -> Rolled:
    """The history through every so many-th of its rows, begun in the steady state of its first."""
    rows = EllipseHistory(*(values[::every] for values in history))
    before = rows.held(0, int(np.ceil(2.2 * rows.semi[0, 0] / step)) + 2, step)
    count = len(before.load) - 1
    whole = EllipseHistory(*(np.concatenate([one[:count], two]) for one, two in zip(before, rows, strict=True)))
    found = transient(whole, pair, friction, step, (step, ACROSS), law, **how)
    return Rolled(*(values[count:] for values in found))


def compare(scene: Scene, settings: DamageSettings, window: dict[str, str], step: float) -> dict[str, SteadyAndMoving]:
    """Wing and nose in a pass of `rigid_hertz` with the settings `window`."""
    result = solve("rigid_hertz", scene, window)
    low, high = sorted((float(result.history["x"].min()), float(result.history["x"].max())))
    contacts = pass_contacts(result, SPACING, low, high, options=patch_options(scene, settings))
    friction = float(np.max(contacts.patches.friction))
    share = 0.5 * (np.array(JENDEL.least) + np.array(JENDEL.most))
    law = SlipLaw(np.array(JENDEL.pressure), np.array(JENDEL.velocity), share, settings.hardness, abs(scene.speed))
    found = {}
    for b, body in enumerate(BODIES):
        steels = scene.materials.wheel.steel(), getattr(scene.materials, body).steel()
        pair = Pair.of(*(steel.elastic for steel in steels))
        history, x = history_of(contacts, b, step, int(scene.direction_sign))
        cell = step, ACROSS
        roll = lambda every, **how: moving(history, pair, friction, every * step, law, every, **how)
        both = roll(1), steady_of(history, pair, friction, step, cell, law)
        others = roll(1, carry="traction"), roll(2)
        found[body] = SteadyAndMoving(x, history.load, history.creepage, *both, *others)
    return found


def averaged(values: np.ndarray, step: float) -> np.ndarray:
    """(m,) means over LENGTH of the path, at every step."""
    width = max(round(LENGTH / step), 1)
    return np.convolve(values, np.full(width, 1 / width), mode="valid") if len(values) > width else values[:1] * 0


def body_row(name: str, own: SteadyAndMoving, step: float) -> dict[str, str]:
    """A row of the table."""
    moving, steady = own.moving, own.steady
    off = lambda one, two: f"{one.sum() / two.sum() - 1:+.2%}" if two.sum() > 0 else "none"
    local = averaged(moving.power, step) - averaged(steady.power, step)
    worst = int(np.argmax(np.abs(local)))
    tops = [own.tgamma(r).max() for r in (moving, steady)]
    share = np.abs(local).max() / max(averaged(steady.power, step).max(), 1e-30)
    ends = own.x[worst] * MM, own.x[min(worst + round(LENGTH / step), len(own.x) - 1)] * MM
    of_length = f"friction work of {LENGTH * MM:.0f} mm, largest difference over the largest"
    largest = f"{tops[1]:.1f}, {tops[0] / tops[1] - 1:+.1%}" if tops[1] > 0 else "none"
    in_place = own.traction.power.sum() / moving.power.sum() - 1
    return {
        "body": name,
        "friction work steady [J], moving differs": (
            f"{steady.power.sum() * step:.3g}, {off(moving.power, steady.power)}"
        ),
        "T\u03b3 summed differs": off(own.tgamma(moving), own.tgamma(steady)),
        "largest T\u03b3 steady [N], differs": largest,
        "volume by Archard's map steady [mm\u00b3], differs": (
            f"{steady.volume.sum() * step * 1e9:.3g}, {off(moving.volume, steady.volume)}"
        ),
        of_length: f"{share:.1%}, x = {ends[0]:.0f} to {ends[1]:.0f} mm",
        "points keep traction in place of displacement": f"{in_place:+.2%}",
        "steps twice as long": f"{own.coarse.power.sum() * 2 / moving.power.sum() - 1:+.2%}",
    }


def table(found: dict[str, SteadyAndMoving], step: float) -> Table:
    """A row for each body."""
    return Table.of([body_row(name, own, step) for name, own in found.items()])


def panels(found: dict[str, SteadyAndMoving]) -> list[Panel]:
    """Normal force, and friction work per millimetre as patches change and each steady, of wing and nose."""
    load = {name: (own.x * MM, own.load / 1e3) for name, own in found.items()}
    work: dict[str, tuple] = {
        f"{name}, as the patch changes": (own.x * MM, own.moving.power / MM) for name, own in found.items()
    }
    work |= {f"{name}, each patch steady": (own.x * MM, own.steady.power / MM, "--") for name, own in found.items()}
    asked = {"normal force [kN]": load, "friction work [J per mm]": work}
    return [Panel("x of the wheel along the crossing [mm]", words, lines) for words, lines in asked.items()]


CASE = example("damage/crossing_transfer")


def main(
    case: Annotated[Path, typer.Option(help="case file with a table [damage]")] = CASE,
    start: Annotated[str, typer.Option(help="where the pass begins")] = "240 mm",
    end: Annotated[str, typer.Option(help="where it ends")] = "560 mm",
    quick: QUICK = False,
    out: OUT = None,
) -> None:
    """Friction work and wear over the transfer with and without the memory of rolling."""
    read = load_case(case)
    if read.damage is None:
        raise typer.BadParameter(f"{case}: has no table [damage]")
    step = 2 * STEP if quick else STEP
    found = compare(read.scene, read.damage, {"start": start, "end": end}, step)
    publish("transient_rolling", out, [table(found, step)], panels(found), read.title, columns=1)
