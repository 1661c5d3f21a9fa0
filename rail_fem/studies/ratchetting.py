"""What many passes of a line contact do to a steel: shakedown or ratchetting, by law, pressure and traction.

    rail-fem study ratchetting --out ratchetting        ratchetting.csv and ratchetting.png in the folder
    rail-fem study ratchetting --passes 10000           rolled_passes.md, rolled_passes.png: most are jumped over

Left: uniaxial cycles, where the law of one back stress has a closed form. Middle: residual shear strain that a pass
adds to the worst depth. Right: the verdict over pressure and traction, beside the elastic limit and the shakedown limit
of perfect plasticity. The steel's constants are made up for a yield stress of 300 MPa, not those of a rail.
"""

from __future__ import annotations

import contextlib
import csv
from pathlib import Path

import numpy as np
import typer

from bem.cycle_jumps import VERDICTS
from rail_fem.cyclic.closed_forms import ratchet_strain
from rail_fem.cyclic.law import CyclicLaw, cyclic_law
from rail_fem.cyclic.paths import uniaxial_cycles
from rail_fem.cyclic.rolling import NoEquilibriumError, rolling_line_contact
from rail_fem.show.table_and_figure import write_table_and_figure
from rail_fem.studies.rolled_passes import draw, roll_all, table

YOUNG, POISSON, YIELD, HALF_WIDTH = 210e9, 0.3, 300e6, 5e-3
SHEAR_YIELD = YIELD / np.sqrt(3)
CHABOCHE = np.array([100e9, 20e9, 3e9]), np.array([2000.0, 300.0, 20.0])  # modulus [Pa], recovery of each back stress
STRESS_CYCLE = (-300e6, 420e6)
DEPTHS = HALF_WIDTH * np.array([0.02, 0.15, 0.3, 0.4, 0.5, 0.6, 0.8])
COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7")


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
    out: Path = typer.Option(Path("ratchetting"), help="folder for the files"),
    quick: bool = typer.Option(False, help="few passes and a coarse map, for a look"),
    passes: int = typer.Option(0, min=0, help="so many passes at six pressures, with jumps, in place of table and map"),
    tolerance: float = typer.Option(0.01, min=1e-4, max=0.5, help="of all jumps together, over the strain"),
):
    """Shakedown or ratchetting of a rolling line contact by four laws of cyclic plasticity: table and figure."""
    if passes:
        _roll_long(out, passes, 120 if quick else 300, tolerance)
        return
    cycles, passes, steps = (20, 30, 120) if quick else (100, 300, 300)
    grid = (6, 4) if quick else (12, 9)
    out.mkdir(parents=True, exist_ok=True)
    rows, uniaxial, rolling = [], {}, {}
    for name, law in laws().items():
        ends = uniaxial_cycles(law, STRESS_CYCLE, cycles, 100, True)[99::200, 0]
        uniaxial[name], rolling[name] = ends, growth_by_pass(law, 4.6, 0.1, passes, steps)
        rows.append([name, ends[0], ends[-1], ends[-1] - ends[-2], rolling[name][0], rolling[name][-1]])
    ratios, tractions = np.linspace(2.0, 6.0, grid[0]), np.linspace(0.0, 0.4, grid[1])
    map_law = laws()["Abdel-Karim-Ohno, mixing 0.1"]
    found = verdicts(map_law, ratios, tractions, 20 if quick else 60, steps)
    with (out / "ratchetting.csv").open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file)
        head = ["law", "strain after the first cycle", f"after {cycles}", "added by the last cycle"]
        table.writerow([*head, "shear strain added by the first pass", f"by pass {passes}"])
        table.writerows(rows)
    exact = ratchet_strain(30e9, 150.0, YIELD, *STRESS_CYCLE)
    _draw(uniaxial, exact, rolling, ratios, tractions, found, out / "ratchetting.png")
    for name, first, last, added, first_pass, last_pass in rows:
        typer.echo(
            f"{name:38s} uniaxial {100 * first:.3f} to {100 * last:.3f} %, last cycle {added:.2e};"
            f" rolling: first pass {first_pass:.2e}, last {last_pass:.2e}"
        )
    typer.echo(f"closed form of one back stress: {exact:.2e} a cycle; written: {out}/ratchetting.csv, ratchetting.png")


def _roll_long(out: Path, passes: int, steps: int, tolerance: float) -> None:
    law = laws()["Abdel-Karim-Ohno, mixing 0.1"]
    found = roll_all(law, SHEAR_YIELD, HALF_WIDTH, DEPTHS, passes, steps, tolerance, typer.echo)
    text = table(found)
    write_table_and_figure(out / "rolled_passes.md", text, out / "rolled_passes.png", lambda: draw(found))
    typer.echo(f"{text}written: {out}/rolled_passes.md, rolled_passes.png")


def _draw(uniaxial, exact, rolling, ratios, tractions, found, path) -> None:
    from matplotlib.colors import ListedColormap
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    figure = Figure(figsize=(14, 4.6), layout="constrained")
    left, middle, right = figure.subplots(1, 3)
    for (name, ends), colour in zip(uniaxial.items(), COLOURS, strict=True):
        cycles = np.arange(len(ends))
        left.plot(cycles, 100 * ends, color=colour, label=name)
        growth = rolling[name]
        middle.loglog(np.arange(1, len(growth) + 1), np.maximum(growth, 1e-9), color=colour, label=name)
    first = next(iter(uniaxial.values()))
    cycles = np.arange(len(first))
    left.plot(cycles[::10], 100 * (first[0] + exact * cycles[::10]), "k+", label="closed form of the first")
    low, high = (round(s * 1e-6) for s in STRESS_CYCLE)
    left.set(xlabel="cycle", ylabel="axial strain at the upper stress [%]", title=f"uniaxial, {low} to {high} MPa")
    left.legend(fontsize=8)
    middle.set(
        xlabel="pass",
        ylabel="shear strain added by a pass, worst depth",
        title="rolling, p0 = 4.6 k, traction 0.1 of it",
    )
    colours = ("#f0f0f0", "#c6dbef", "#fdd0a2", "#d95f0e", "#555555")
    right.pcolormesh(tractions, ratios, found.T, cmap=ListedColormap(colours), vmin=-0.5, vmax=4.5, shading="nearest")
    right.axhline(3.10, color="k", ls="--", lw=1)
    right.text(0.40, 3.14, "first yield without traction 3.10", ha="right", fontsize=8)
    right.plot([0], [4.0], "k^", clip_on=False)
    right.text(0.012, 4.04, "shakedown limit of perfect plasticity 4.00", fontsize=8)
    right.legend(
        handles=[Patch(color=c, label=v) for c, v in zip(colours, (*VERDICTS, "no equilibrium"), strict=True)],
        fontsize=7,
        loc="lower left",
    )
    right.set(
        xlabel="traction over pressure",
        ylabel="largest pressure over shear yield stress, p0 / k",
        title="Abdel-Karim-Ohno, mixing 0.1",
    )
    figure.suptitle("Many passes of a line contact, yield stress 300 MPa (made-up steel)")
    figure.savefig(path, dpi=130)


if __name__ == "__main__":
    typer.run(main)
