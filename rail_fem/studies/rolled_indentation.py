"""How deep an ellipsoid presses a rail in as it rolls: elastoplastic half-space against the law of the light models.

    rail-fem study rolled-indentation --out rolled       three ellipsoids; some two minutes
    rail-fem study rolled-indentation --quick            one, coarse
    ... --pass RUN --pass RUN --hard RUN                 beside explicit passes; --hard: one whose wing hardly yields

Forces rise and fall by half over some eighteen semi-axes of the patch, on virgin Mn13. Indentation is the approach
beyond that of an elastic body. For each ellipsoid the best rate, onset and lag are found, and how far the law with the
constants of rail_fem.passes.plastic_indentation is off.

Of explicit passes over the same crossing the wing's indentation is how much nearer the wheel comes at equal x than in
the pass on the hard wing, less what the force alone changes, by the Hertz constants of the light models.
"""

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import typer

from bem.material import Elastic, contact_modulus
from bem.patch import Grid
from bem.plastic.contact import PlasticHalfSpace
from bem.plastic.rolling import PlasticTrack, agree_on
from bem.steel.hardening import Hardening
from rail_fem.contact.contact_table import contact_table, patch_sizes
from rail_fem.passes.plastic_indentation import LAG, ONSET, RATE, pressure_over_yield
from rail_fem.passes.plastic_rolling import point_zone
from rail_fem.result.result import PassResult
from rail_fem.result.result import load as load_result
from rail_fem.scene.steel import MN13
from rail_fem.show.panels import Panel
from rail_fem.show.table_and_figure import Table, publish
from rail_fem.studies.harness import OUT, QUICK, spent

BODY, STEEL = Elastic(210e9, 0.3), MN13
MODULUS = contact_modulus(BODY, BODY)
WAVES, SWING = 18.0, 0.5  # wavelength of the force over the semi-axis along the rail, amplitude over the mean
WING_ALONE = 1e3  # force on the nose below which the wing carries alone [N]


@dataclass(frozen=True)
class Ellipsoid:
    """Relative radii along and across the rail [m] and the mean force [N]."""

    radii: tuple[float, float]
    force: float


WORN_WING = (Ellipsoid((0.36, 0.1), 60e3), Ellipsoid((0.36, 0.07), 40e3), Ellipsoid((0.3, 0.3), 80e3))


@dataclass(frozen=True)
class RolledOver:
    """Positions (m,) [m], pressure over the yield stress, elastic approach and indentation [m] there; semi-axis along
    the rail under the mean force [m]."""

    x: np.ndarray
    pressure: np.ndarray
    elastic: np.ndarray
    dent: np.ndarray
    along: float


@dataclass(frozen=True)
class Fit:
    """Rate, onset and lag over the semi-axis; root mean square of what it is off, over the largest indentation."""

    rate: float
    onset: float
    lag: float
    off: float


def roll(one: Ellipsoid, forces: np.ndarray, step: float, cells: int) -> RolledOver:
    """Rolled over virgin steel under forces (m,) [N], `step` [m] apart; cells over the patch's smaller semi-axis."""
    radii, mean = np.tile(one.radii, (len(forces), 1)), float(np.mean(forces))
    sizes = patch_sizes(np.array([mean, forces.max()]), radii[:2], MODULUS)
    side, (long, wide) = sizes[0].min() / cells, sizes[1]
    zone = point_zone(float(forces.max()), STEEL.yield_stress(0.0))
    nx, ny = 2 * int(np.ceil(2.4 * long / step)), 2 * int(np.ceil(max(2.4 * wide, 0.95 * zone) / side))
    layers = int(np.ceil(max(2.8 * min(long, wide), 1.1 * zone) / side))
    grid = Grid(-(nx - 1) / 2 * step, -(ny - 1) / 2 * side, step, side, nx, ny)
    gap = grid.x[:, None] ** 2 / (2 * one.radii[0]) + grid.y**2 / (2 * one.radii[1])
    body = lambda curve: PlasticHalfSpace(grid, side, layers, BODY, BODY, curve)
    soft = body(Hardening(STEEL.hardening_strain, STEEL.hardening_stress))
    reference = body(Hardening.linear(1e13)).agree(gap, mean, 1e-5).solution.approach
    track = PlasticTrack(soft.body, nx + len(forces) + 1, max(4, int(np.ceil(2 * layers * side / step))))
    trial, approach = None, []
    for column, force in enumerate(forces):
        track.stand(column)
        agreed = agree_on(track, soft, gap, float(force), 4e-3, trial)
        trial = agreed.trial
        track.accept(trial)
        approach.append(agreed.solution.approach)
    elastic = reference * (forces / mean) ** (2 / 3)
    q = pressure_over_yield(forces, radii, patch_sizes(forces, radii, MODULUS), STEEL)
    return RolledOver(step * np.arange(len(forces)), q, elastic, np.array(approach) - elastic, float(sizes[0, 0]))


def roll_wave(one: Ellipsoid, cells: int) -> RolledOver:
    """Under a force that rises and falls, one and a half waves."""
    along = patch_sizes(np.array([one.force]), np.array([one.radii]), MODULUS)[0, 0]
    step, wave = along / cells, WAVES * along
    x = step * np.arange(int(1.6 * wave / step))
    return roll(one, one.force * (1 - SWING * np.cos(2 * np.pi * x / wave)), step, cells)


def by_law(of: RolledOver, rate: float = RATE, onset: float = ONSET, lag: float = LAG) -> np.ndarray:
    """Indentation (m,) [m] by the law; lag over the semi-axis."""
    goal = rate * np.maximum(of.pressure - onset, 0.0) * of.elastic
    if lag <= 0:
        return goal
    late, share = goal.copy(), (of.x[1] - of.x[0]) / (2 * lag * of.along)
    for k in range(1, len(goal)):
        late[k] = ((1 - share) * late[k - 1] + share * (goal[k] + goal[k - 1])) / (1 + share)
    return late


def off_by(of: RolledOver, found: np.ndarray) -> float:
    """Root mean square of an indentation's error over the largest, without the first quarter, which begins at rest."""
    later = slice(len(of.x) // 4, None)
    return float(np.sqrt(np.mean((found - of.dent)[later] ** 2)) / of.dent.max())


def fitted(of: RolledOver) -> Fit:
    """The rate, onset and lag that are off by the least."""
    later, best = slice(len(of.x) // 4, None), None
    for lag in np.arange(0.0, 1.01, 0.05):
        for onset in np.arange(1.2, 2.01, 0.05):
            one = by_law(of, 1.0, float(onset), float(lag))
            rate = float(one[later] @ of.dent[later] / (one[later] @ one[later]))
            fit = Fit(rate, float(onset), float(lag), off_by(of, rate * one))
            best = fit if best is None or fit.off < best.off else best
    assert best is not None
    return best


def of_pass(run: PassResult, hard: PassResult, spacing: float = 2.5e-3) -> RolledOver:
    """The wing's indentation where it carries alone, of an explicit pass against one on a wing that hardly yields."""
    x = np.arange(*sorted((run.history["x"][0], run.transfer_x)), spacing)
    table = contact_table(run.scene, x[0], x[-1], spacing)
    on = lambda result, name: np.interp(x, result.history["x"], result.history[name])
    stiffness, angle = (np.interp(x, table.x, values[0]) for values in (table.stiffness, table.angle))
    radii = np.stack([np.interp(x, table.x, table.radii[0][:, k]) for k in (0, 1)], axis=1)
    elastic = lambda result: (np.maximum(on(result, "force_wing"), 0.0) / stiffness) ** (2 / 3)
    height = lambda result: on(result, "wheel_height") - on(result, "crossing_height")
    forces = on(run, "force_wing")
    dent = height(hard) + elastic(hard) - height(run) - elastic(run)
    alone = (forces > 20e3) & (on(run, "force_nose") < WING_ALONE) & (on(hard, "force_nose") < WING_ALONE)
    normal = (forces / np.cos(angle))[alone]
    sizes = patch_sizes(normal, radii[alone], table.modulus[0])
    q = pressure_over_yield(normal, radii[alone], sizes, run.scene.materials.wing.steel())
    return RolledOver(x[alone], q, elastic(run)[alone], dent[alone], float(sizes[:, 0].mean()))


def table_of(ellipsoids: tuple[Ellipsoid, ...], rolled: list[RolledOver], seconds: list[float]) -> Table:
    """Best constants of each ellipsoid, and what the law is off."""
    head = ["radii [mm]", "mean force [kN]", "q", "rate", "onset", "lag over a", "off", "the law is off", "CPU s"]
    rows = []
    for one, found, cpu in zip(ellipsoids, rolled, seconds):
        fit = fitted(found)
        rows.append(
            [
                f"{one.radii[0] * 1e3:.0f}, {one.radii[1] * 1e3:.0f}", f"{one.force / 1e3:.0f}",
                f"{found.pressure.min():.1f} to {found.pressure.max():.1f}", f"{fit.rate:.3f}", f"{fit.onset:.2f}",
                f"{fit.lag:.2f}", f"{fit.off:.1%}", f"{off_by(found, by_law(found)):.1%}", f"{cpu:.0f}",
            ]
        )  # fmt: skip
    return Table(head, rows)


def panel(ellipsoids: tuple[Ellipsoid, ...], rolled: list[RolledOver], passes: dict[str, RolledOver]) -> Panel:
    """Indentation over elastic approach against pressure over yield stress: law, what was rolled, explicit passes."""
    q = np.linspace(1.0, max(5.0, *(found.pressure.max() for found in [*rolled, *passes.values()])), 100)
    lines: dict[str, tuple] = {"law of the light models, without its lag": (q, RATE * np.maximum(q - ONSET, 0), "--")}
    for one, found in zip(ellipsoids, rolled):
        later = slice(len(found.x) // 4, None)
        words = f"half-space: radii {one.radii[0] * 1e3:.0f} and {one.radii[1] * 1e3:.0f} mm"
        lines[words] = (found.pressure[later], (found.dent / found.elastic)[later])
    lines |= {name: (found.pressure, found.dent / found.elastic, ".") for name, found in passes.items()}
    return Panel("mean Hertz pressure over yield stress", "plastic indentation over elastic approach", lines)


def main(
    passes: list[Path] = typer.Option([], "--pass", help="folder of an explicit pass; several times"),
    hard: Path = typer.Option(None, help="folder of an explicit pass on a wing that hardly yields"),
    cells: int = typer.Option(3, min=2, help="cells over the patch's semi-axes"),
    quick: QUICK = False,
    out: OUT = None,
) -> None:
    """How deep an ellipsoid presses a rail in as it rolls: half-space, law of the light models, explicit passes."""
    if passes and hard is None:
        raise typer.BadParameter("--pass: needs --hard, a pass over the same wing in a steel that hardly yields")
    ellipsoids, cells = (WORN_WING[:1], 2) if quick else (WORN_WING, cells)
    timed = []
    for one in ellipsoids:
        timed.append(spent(partial(roll_wave, one, cells)))
        typer.echo(f"radii {one.radii}: {timed[-1][0]:.0f} CPU s", err=True)
    rolled = [found for _, found in timed]
    judged = load_result(hard) if hard is not None else None
    found = {} if judged is None else {path.parent.name: of_pass(load_result(path), judged) for path in passes}
    words = []
    for name, wing in found.items():
        off, most = off_by(wing, by_law(wing)), wing.dent.max()
        words.append(f"{name}: law off by {off * most * 1e6:.1f} um, largest indentation {most * 1e6:.1f} um")
    tables = [table_of(ellipsoids, rolled, [seconds for seconds, _ in timed])]
    title = "How deep a rolling wheel presses in Mn13: loops are forces that rise and fall"
    publish("rolled_indentation", out, tables, [panel(ellipsoids, rolled, found)], title, "\n".join(words))
