"""What many passes of a line contact do to a steel: shakedown or ratchetting, by law, pressure and traction.

    rail-fem study ratchetting --out ratchetting
    rail-fem study ratchetting --passes 10000 --out ratchetting

Left: uniaxial cycles, where the law of one back stress has a closed form. Middle: residual shear strain that a pass
adds to the worst depth. Right: the verdict over pressure and traction; without traction the elastic limit is 3.10 k and
the shakedown limit of perfect plasticity 4.00 k. The steel's constants are made up for a yield stress of 300 MPa, not
those of a rail. With --passes thousands, most of them jumped over, by Abdel-Karim and Ohno's law with a mixing of 0.1:
strain with its error, verdict, cost, by pressure; beside the jumps the first thousand are computed one by one at the
depth that fares worst.
"""

import contextlib
from functools import partial
from typing import Annotated, NamedTuple

import numpy as np
import typer

from bem.cycle_jumps import LEAST_FLOW, VERDICTS, JumpRule
from bem.plastic.rolling_line import NoEquilibriumError, RollingHistory, rolling_line_contact
from bem.steel.cyclic_law import CyclicLaw, cyclic_law
from bem.steel.paths import ratchet_strain, uniaxial_cycles
from rail_fem.show.panels import Panel
from rail_fem.show.table_and_figure import Table, publish
from rail_fem.studies.harness import OUT, QUICK, spent

YOUNG, POISSON, YIELD, HALF_WIDTH = 210e9, 0.3, 300e6, 5e-3
SHEAR_YIELD = YIELD / np.sqrt(3)
CHABOCHE = np.array([100e9, 20e9, 3e9]), np.array([2000.0, 300.0, 20.0])  # modulus [Pa], recovery of each back stress
STRESS_CYCLE = (-300e6, 420e6)
DEPTHS = HALF_WIDTH * np.array([0.02, 0.15, 0.3, 0.4, 0.5, 0.6, 0.8])
TRACTION = 0.1  # over the pressure, of many passes
RATIOS = (3.2, 3.8, 4.2, 4.6, 5.0, 5.6)  # their largest pressure over the shear yield stress
ALL_COMPUTED = 1000  # passes that are computed one by one, to compare
CONSTANT = 0.05  # exponent of the growth per pass below which it is called constant


def laws() -> dict[str, CyclicLaw]:
    """One steel by four laws."""
    return {
        "Armstrong-Frederick, one back stress": cyclic_law(YOUNG, POISSON, YIELD, [30e9], [150.0]),
        "Chaboche, three": cyclic_law(YOUNG, POISSON, YIELD, *CHABOCHE),
        "Abdel-Karim-Ohno, mixing 0.1": cyclic_law(YOUNG, POISSON, YIELD, *CHABOCHE, mixing=0.1),
        "Ohno-Wang I": cyclic_law(YOUNG, POISSON, YIELD, *CHABOCHE, mixing=0.0),
    }


def growth_by_pass(law: CyclicLaw, ratio: float, traction: float, passes: int, steps: int) -> np.ndarray:
    """Residual shear strain (passes,) that each pass adds to the depth where the last one adds most."""
    history = rolling_line_contact(law, HALF_WIDTH, ratio * SHEAR_YIELD, traction, DEPTHS, passes, steps)
    added = np.abs(np.diff(history.shear, axis=0, prepend=0.0))
    return added[:, np.argmax(added[-1])]


def verdicts(law: CyclicLaw, ratios: np.ndarray, tractions: np.ndarray, passes: int, steps: int) -> np.ndarray:
    """(tractions, ratios) numbers of VERDICTS, and one more where the steel cannot carry the load at all."""
    found = np.full((tractions.size, ratios.size), len(VERDICTS))
    for i, traction in enumerate(tractions):
        for j, ratio in enumerate(ratios):
            with contextlib.suppress(NoEquilibriumError):
                history = rolling_line_contact(law, HALF_WIDTH, ratio * SHEAR_YIELD, traction, DEPTHS, passes, steps)
                found[i, j] = VERDICTS.index(history.verdict())
    return found


class LongRun(NamedTuple):
    """jumped : all depths;  seconds : of the processor for it;  computed : the worst depth again, every pass computed,
    as far as ALL_COMPUTED;  computed_seconds"""

    ratio: float
    jumped: RollingHistory
    seconds: float
    computed: RollingHistory
    computed_seconds: float


class RefusedLoad(NamedTuple):
    """A load without equilibrium, and the sentence that says so."""

    ratio: float
    reason: str


def roll(
    law: CyclicLaw, ratio: float, depths: np.ndarray, passes: int, steps: int, tolerance: float
) -> LongRun | RefusedLoad:
    """One pressure: passes with jumps at all depths, and all of the first ones at the worst depth."""
    load = (HALF_WIDTH, ratio * SHEAR_YIELD, TRACTION)
    rolled = partial(rolling_line_contact, law, *load)
    try:
        seconds, jumped = spent(lambda: rolled(depths, passes, steps, JumpRule(tolerance)))
    except NoEquilibriumError as reason:
        return RefusedLoad(ratio, str(reason))
    worst = depths[jumped.worst : jumped.worst + 1]
    all_seconds, computed = spent(lambda: rolled(worst, min(passes, ALL_COMPUTED), steps))
    return LongRun(ratio, jumped, seconds, computed, all_seconds)


def in_words(history: RollingHistory) -> str:
    """Verdict, and how its growth goes on."""
    exponent = history.exponent()
    if np.isnan(exponent):
        return history.verdict_words()
    if abs(exponent) < CONSTANT:
        return f"{history.verdict_words()}, constant growth per pass"
    return f"{history.verdict_words()}, growth per pass goes with the passes to the power of {exponent:.2f}"


def pass_table(found: list[LongRun | RefusedLoad]) -> Table:
    """A row for each pressure."""
    rows = []
    for run in found:
        if isinstance(run, RefusedLoad):
            rows.append([f"{run.ratio:g}", run.reason] + ["-"] * 7)
            continue
        h, w = run.jumped, run.jumped.worst
        passes = len(h.plastic_strain)
        apart = np.abs(h.plastic_strain[: len(run.computed.plastic_strain), w] - run.computed.plastic_strain[:, 0])
        bound = h.plastic_strain_error[: len(apart), w]
        top = max(float(run.computed.plastic_strain[-1, 0]), 1e-300)
        rows.append(
            [
                f"{run.ratio:g}",
                in_words(h),
                f"{h.depth[w] * 1e3:.2f}",
                f"{h.plastic_strain[-1, w]:.4g} +- {h.plastic_strain_error[-1, w]:.1g}",
                f"{h.shear[-1, w]:.4g} +- {h.shear_error[-1, w]:.1g}",
                f"{h.computed.sum()} of {passes * len(h.depth)}",
                f"{h.jumps.sum()}",
                f"{100 * apart.max() / top:.1g} %, {100 * bound.max() / top:.1g} %",
                f"{run.seconds:.1f}, {run.computed_seconds * passes / len(apart) * len(h.depth):.0f}",
            ]
        )
    head = ["p0 / k", "verdict", "worst depth [mm]", "plastic strain, cumulated", "forward shear strain"]
    first = max((len(run.computed.plastic_strain) for run in found if isinstance(run, LongRun)), default=0)
    head += ["passes computed at all depths", "jumps", f"error in the first {first}: true, estimated"]
    return Table(head + ["CPU s: with jumps, without (scaled)"], rows)


def pass_panels(found: list[LongRun | RefusedLoad]) -> list[Panel]:
    """Cumulated plastic strain, forward shear, and the estimated error of the first, over the passes, at the depth that
    fares worst."""
    lines: list[dict[str, tuple]] = [{}, {}, {}]
    for run in found:
        if isinstance(run, LongRun) and run.jumped.plastic_strain[-1].max() > LEAST_FLOW:
            h, w = run.jumped, run.jumped.worst
            number, flow = np.arange(1, len(h.plastic_strain) + 1), h.plastic_strain[:, w]
            for own, value in zip(lines, (flow, np.abs(h.shear[:, w]), h.plastic_strain_error[:, w] / flow)):
                own[f"{run.ratio:g} k, {h.verdict()}"] = (number, value)
    words = "plastic strain, cumulated [1]", "forward shear strain [1]", "error of the jumps over the strain [1]"
    return [Panel("pass", label, own, log="xy") for label, own in zip(words, lines)]


def main(
    quick: QUICK = False,
    passes: Annotated[int, typer.Option(min=0, help="so many at six pressures, jumped over, in place of all")] = 0,
    tolerance: Annotated[float, typer.Option(min=1e-4, max=0.5, help="of all jumps together, over the strain")] = 0.01,
    out: OUT = None,
) -> None:
    """Shakedown or ratchetting of a rolling line contact by four laws of cyclic plasticity."""
    mixed = laws()["Abdel-Karim-Ohno, mixing 0.1"]
    if passes:
        runs: list[LongRun | RefusedLoad] = []
        for number, ratio in enumerate(RATIOS, 1):
            run = roll(mixed, ratio, DEPTHS, passes, 120 if quick else 300, tolerance)
            runs.append(run)
            told = run.reason if isinstance(run, RefusedLoad) else in_words(run.jumped)
            typer.echo(f"[{number}/{len(RATIOS)}] p0 = {ratio:g} k: {told}")
        title = f"Passes of a line contact, traction {TRACTION:g} of the pressure, at the depth that fares worst"
        publish("rolled_passes", out, [pass_table(runs)], pass_panels(runs), title, columns=3)
        return
    cycles, passes, steps = (20, 30, 120) if quick else (100, 300, 300)
    rows, uniaxial, rolling = [], {}, {}
    for name, law in laws().items():
        ends = uniaxial_cycles(law, STRESS_CYCLE, cycles, 100, True)[99::200, 0]
        uniaxial[name], rolling[name] = ends, growth_by_pass(law, 4.6, 0.1, passes, steps)
        added = ends[0], ends[-1], ends[-1] - ends[-2], rolling[name][0], rolling[name][-1]
        rows.append([name, *(f"{value:.4e}" for value in added)])
    pressures, tractions = np.linspace(2.0, 6.0, 6 if quick else 12), np.linspace(0.0, 0.4, 4 if quick else 9)
    found = verdicts(mixed, pressures, tractions, 20 if quick else 60, steps)
    exact = ratchet_strain(30e9, 150.0, YIELD, *STRESS_CYCLE)
    head = ["law", "strain after the first cycle", f"after {cycles}", "added by the last cycle"]
    head += ["shear strain added by the first pass", f"by pass {passes}"]
    title = f"Closed form of one back stress: {exact:.4e} a cycle"
    low, high = (round(s * 1e-6) for s in STRESS_CYCLE)
    over = lambda found: {name: (np.arange(1, len(y) + 1), y) for name, y in found.items()}
    p, t = (grid.ravel() for grid in np.meshgrid(pressures, tractions))
    names = [*VERDICTS, "no equilibrium"]
    there = [(k, name, found.ravel() == k) for k, name in enumerate(names) if (found == k).any()]
    room = {"_": ([0.0], [1.3 * pressures[-1]], "")}  # for the legend
    said = {name: (t[here], p[here], "osD^ v"[k]) for k, name, here in there} | room
    drawn = [
        Panel("cycle", f"axial strain at {high} MPa [1]", over(uniaxial), f"uniaxial, {low} to {high} MPa"),
        Panel("pass", "shear strain added by a pass", over(rolling), "rolling, p0 = 4.6 k, traction 0.1 of it", "xy"),
        Panel("traction over pressure", "p0 / k", said, "Abdel-Karim-Ohno, mixing 0.1"),
    ]
    words = "Many passes of a line contact, yield stress 300 MPa (made-up steel)"
    publish("ratchetting", out, [Table(head, rows, title)], drawn, words, columns=3)
