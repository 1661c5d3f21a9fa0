"""What many passes of a line contact do to a steel: shakedown or ratchetting, by law, pressure and traction.

    rail-fem study ratchetting --out ratchetting
    rail-fem study ratchetting --passes 10000           most are jumped over

Left: uniaxial cycles, where the law of one back stress has a closed form. Middle: residual shear strain that a pass
adds to the worst depth. Right: the verdict over pressure and traction; without traction the elastic limit is 3.10 k and
the shakedown limit of perfect plasticity 4.00 k. The steel's constants are made up for a yield stress of 300 MPa, not
those of a rail.
"""

from __future__ import annotations

import contextlib
from typing import Annotated

import numpy as np
import typer

from bem.cycle_jumps import VERDICTS
from bem.plastic.rolling_line import NoEquilibriumError, rolling_line_contact
from bem.steel.closed_forms import ratchet_strain
from bem.steel.cyclic_law import CyclicLaw, cyclic_law
from bem.steel.paths import uniaxial_cycles
from rail_fem.show.panels import Panel
from rail_fem.show.table_and_figure import Table, publish
from rail_fem.studies.harness import OUT, QUICK
from rail_fem.studies.rolled_passes import TRACTION, panels, roll_all, table

YOUNG, POISSON, YIELD, HALF_WIDTH = 210e9, 0.3, 300e6, 5e-3
SHEAR_YIELD = YIELD / np.sqrt(3)
CHABOCHE = np.array([100e9, 20e9, 3e9]), np.array([2000.0, 300.0, 20.0])  # modulus [Pa], recovery of each back stress
STRESS_CYCLE = (-300e6, 420e6)
DEPTHS = HALF_WIDTH * np.array([0.02, 0.15, 0.3, 0.4, 0.5, 0.6, 0.8])


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


def main(
    quick: QUICK = False,
    passes: Annotated[int, typer.Option(min=0, help="so many at six pressures, jumped over, in place of all")] = 0,
    tolerance: Annotated[float, typer.Option(min=1e-4, max=0.5, help="of all jumps together, over the strain")] = 0.01,
    out: OUT = None,
) -> None:
    """Shakedown or ratchetting of a rolling line contact by four laws of cyclic plasticity."""
    mixed = laws()["Abdel-Karim-Ohno, mixing 0.1"]
    if passes:
        runs = roll_all(mixed, SHEAR_YIELD, HALF_WIDTH, DEPTHS, passes, 120 if quick else 300, tolerance, typer.echo)
        title = f"Passes of a line contact, traction {TRACTION:g} of the pressure, at the depth that fares worst"
        publish("rolled_passes", out, [table(runs)], panels(runs), title, columns=3)
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
