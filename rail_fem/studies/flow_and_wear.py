"""Plastic flow and wear on one crossing against wear alone: two finished damage studies of the same passes.

    rail-fem damage cases/damage/crossing_flow.toml --out runs/flow
    rail-fem damage wear.toml --out runs/wear             the same without plastic_flow
    rail-fem study flow-and-wear runs/flow runs/wear --out flow

What the surface lost over the passes, along the body and across it where flow and wear together are deepest, and the
largest force on the changed shape.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import typer
from matplotlib.figure import Figure

from geometry.surfaces.bodies import BODIES
from rail_fem.output.markdown import markdown_table
from rail_fem.show.style import CURVES, new_figure
from rail_fem.show.table_and_figure import write_table_and_figure

UM, MM, KN = 1e6, 1e3, 1e-3
PASSES, WORN, FORCE, FLOW = 0, 1, 5, 6  # columns of a study's log
SHARES = (0.0, 0.01, 0.1, 1.0)  # of all passes, for which the table has a row
ALONE, TOGETHER, BY_FLOW = CURVES[0], CURVES[1], CURVES[2]


def read(folder: Path) -> dict[str, np.ndarray]:
    """Arrays of a finished study of a crossing. Errors: ValueError for another folder."""
    path = Path(folder) / "damage.npz"
    if not path.is_file():
        raise ValueError(f"{folder}: no damage.npz; give the folder of a finished damage study of a crossing")
    with np.load(path) as stored:
        found = {name: stored[name] for name in stored.files}
    if "worn_depth" not in found or not len(found["log"]):
        raise ValueError(f"{folder}: a study of a switch, or of no passes; give one of a crossing that has been passed")
    return found


def lowered(study: dict[str, np.ndarray]) -> np.ndarray:
    """(2, m, n) depths that wing and nose have lost by wear and flow [m]."""
    return study["worn_depth"] + study.get("worn_flow", 0.0)


def table(flow: dict[str, np.ndarray], wear: dict[str, np.ndarray]) -> str:
    """Markdown: deepest flow and wear and the largest force at the ends of the blocks, in both studies."""
    log, alone = flow["log"], wear["log"]
    wanted = np.unique([int(np.argmin(np.abs(log[:, PASSES] - share * log[-1, PASSES]))) for share in SHARES])
    rows = []
    for row in log[wanted]:
        other = [float(np.interp(row[PASSES], alone[:, PASSES], alone[:, k])) for k in (WORN, FORCE)]
        cells = row[FLOW] * UM, row[WORN] * UM, row[FORCE] * KN, other[0] * UM, other[1] * KN
        rows.append([f"{row[PASSES]:.4g}", *(f"{value:.3g}" for value in cells)])
    head = ["passes", "deepest flow [\u00b5m]", "deepest wear with it [\u00b5m]", "largest force with it [kN]"]
    return "\n".join(markdown_table([*head, "wear alone [\u00b5m]", "its largest force [kN]"], rows)) + "\n"


def draw(flow: dict[str, np.ndarray], wear: dict[str, np.ndarray]) -> Figure:
    """Along, across, and over the passes."""
    figure = new_figure(8.0)
    (along, across), (depths, forces) = figure.subplots(2, 2)
    both, only = lowered(flow), lowered(wear)
    body, i, _ = np.unravel_index(int(np.argmax(both)), both.shape)
    x, y = flow["x"] * MM, flow["y"] * MM
    curves = (
        (wear["x"] * MM, wear["y"] * MM, only, ALONE, "-", "wear alone"),
        (x, y, both, TOGETHER, "-", "flow and wear"),
        (x, y, flow["worn_flow"], BY_FLOW, "--", "of it flow"),
    )
    for own_x, own_y, depth, colour, style, name in curves:
        along.plot(own_x, -depth[body].max(axis=1) * UM, color=colour, ls=style, label=name)
        across.plot(own_y, -depth[body, i] * UM, color=colour, ls=style)
    near = np.flatnonzero(np.abs(both[body, i]) > 0.01 * both[body, i].max())
    along.set(xlabel="x [mm]", ylabel="deepest in the section [\u00b5m]", title=f"along the {BODIES[body]}")
    across.set(xlabel="y [mm]", ylabel="surface against the unworn [\u00b5m]", title=f"across it at x = {x[i]:.0f} mm")
    across.set(xlim=(y[near[0]] - 2, y[near[-1]] + 2))
    along.legend()
    log, alone = flow["log"], wear["log"]
    depths.loglog(alone[:, PASSES], alone[:, WORN] * UM, color=ALONE)
    depths.loglog(log[:, PASSES], log[:, WORN] * UM, color=TOGETHER, label="wear beside flow")
    depths.loglog(log[:, PASSES], log[:, FLOW] * UM, color=BY_FLOW, ls="--", label="flow")
    depths.set(xlabel="passes", ylabel="deepest [\u00b5m]", title="what grows when")
    depths.legend()
    forces.semilogx(alone[:, PASSES], alone[:, FORCE] * KN, color=ALONE)
    forces.semilogx(log[:, PASSES], log[:, FORCE] * KN, color=TOGETHER)
    forces.set(xlabel="passes", ylabel="largest force [kN]", title="on the shape of that pass", ylim=(0, None))
    figure.suptitle(f"Flow and wear against wear alone, {log[-1, PASSES]:,.0f} passes")
    return figure


def main(
    flow: Path = typer.Argument(..., help="folder of a finished study with plastic_flow"),
    wear: Path = typer.Argument(..., help="folder of the same study without"),
    out: Path = typer.Option(None, help="folder for flow_and_wear.md and flow_and_wear.png"),
) -> None:
    """Flow and wear on one crossing against wear alone."""
    together, alone = read(flow), read(wear)
    if "worn_flow" not in together:
        raise ValueError(f"{flow}: its steel does not flow; give the study with plastic_flow = true first")
    text = table(together, alone)
    print(text, end="")
    if out is not None:
        write_table_and_figure(out / "flow_and_wear.md", text, out / "flow_and_wear.png", lambda: draw(together, alone))


if __name__ == "__main__":
    typer.run(main)
