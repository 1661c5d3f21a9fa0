"""Study: how far the wear of a crossing depends on the length of its blocks, position by position: two finished damage
studies of the same passes, the second in shorter blocks.

    rail-fem damage cases/damage/crossing_life.toml --out runs/life
    rail-fem damage cases/damage/crossing_life.toml --set damage.block_share=0.05 --set "damage.block_depth=50 um"
        --out runs/life_half
    rail-fem study block-error runs/life runs/life_half --out blocks

Differences are of the first study to the second: of single positions in the plan, of means over stretches of the
running direction, of the deepest in each section, and of the volume.
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
from rail_fem.studies.flow_and_wear import PASSES, read

UM, MM = 1e6, 1e3
STRETCH = 50e-3  # of the running direction, of which one row is [m]
SHARES = (0.01, 0.05)  # differences whose share of the worn plan is told
WORN = 0.1  # of the deepest on a body, from which on a position counts as worn


def read_pair(coarse: Path, fine: Path) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Arrays of both. Errors: ValueError for studies of other passes, or of another plan."""
    one, two = read(coarse), read(fine)
    passes = [float(own["log"][-1, PASSES]) for own in (one, two)]
    if abs(passes[0] - passes[1]) > 1e-6 * passes[1]:
        raise ValueError(f"{coarse} and {fine}: {passes[0]:g} and {passes[1]:g} passes; give two of the same")
    if any(one[name].shape != two[name].shape or not np.allclose(one[name], two[name]) for name in ("x", "y")):
        raise ValueError(f"{coarse} and {fine}: plans differ; give two studies of one crossing and one spacing")
    if len(two["log"]) <= len(one["log"]):
        raise ValueError(
            f"{fine}: {len(two['log'])} blocks, no more than the {len(one['log'])} of {coarse}: give the study in"
            " shorter blocks second"
        )
    return one, two


def body_row(name: str, one: np.ndarray, two: np.ndarray, cell: float, along: float) -> list[str]:
    """Of one body: depths (m, n) [m] of both studies, plan area of a cell [m2], its length along x [m]."""
    deepest = two.max()
    worn = two > WORN * deepest
    off = np.abs(one - two) / deepest
    sections = np.abs(one.max(axis=1) - two.max(axis=1)) / deepest
    width = max(round(10e-3 / along), 1)
    mean = lambda depth: np.apply_along_axis(np.convolve, 0, depth, np.full(width, 1 / width), mode="valid")
    stretched = np.abs(mean(one) - mean(two)).max() / mean(two).max()
    return [
        name,
        f"{one.max() * UM:.4g}, {deepest * UM:.4g} ({one.max() / deepest - 1:+.1%})",
        f"{one.sum() * cell * 1e9:.4g}, {two.sum() * cell * 1e9:.4g} ({one.sum() / two.sum() - 1:+.2%})",
        f"{off.max():.1%}",
        f"{np.sqrt((off[worn] ** 2).mean()):.1%}",
        ", ".join(f"{(off[worn] < share).mean():.0%}" for share in SHARES),
        f"{sections.max():.1%}",
        f"{stretched:.1%}",
    ]


HEAD = [
    "body",
    "deepest [\u00b5m]",
    "volume [mm\u00b3]",
    "largest difference over the deepest",
    "root mean square where worn",
    f"of the worn plan within {SHARES[0]:.0%}, {SHARES[1]:.0%}",
    "deepest of a section, largest difference",
    "means over 10 mm along, largest difference",
]


def table(one: dict[str, np.ndarray], two: dict[str, np.ndarray]) -> str:
    """Markdown: a row for each body, then one for each stretch."""
    x, y = two["x"], two["y"]
    along, cell = x[1] - x[0], (x[1] - x[0]) * (y[1] - y[0])
    pairs = [(name, one["depth"][b], two["depth"][b]) for b, name in enumerate(BODIES) if two["depth"][b].max() > 0]
    blocks = f"{len(one['log'])} and {len(two['log'])} blocks, {two['log'][-1, PASSES]:,.0f} passes\n"
    text = "\n".join(markdown_table(HEAD, [body_row(name, a, b, cell, along) for name, a, b in pairs]))
    rows = []
    for name, a, b in pairs:
        for start in np.arange(np.floor(x[0] / STRETCH) * STRETCH, x[-1], STRETCH):
            own = (x >= start - 1e-9) & (x < start + STRETCH - 1e-9)
            if not own.any() or b[own].max() < WORN * b.max():
                continue
            off = np.abs(a[own] - b[own]).max()
            rows.append(
                [
                    f"{name}, {start * MM:.0f} to {(start + STRETCH) * MM:.0f} mm",
                    f"{a[own].max() * UM:.4g}, {b[own].max() * UM:.4g}",
                    f"{a[own].max() / b[own].max() - 1:+.1%}",
                    f"{a[own].sum() / b[own].sum() - 1:+.1%}",
                    f"{off * UM:.3g} ({off / b.max():.1%})",
                ]
            )
    head = ["where", "deepest [\u00b5m]", "differ", "volume differs", "largest at one position [\u00b5m] (of deepest)"]
    return f"{blocks}\n{text}\n\n" + "\n".join(markdown_table(head, rows)) + "\n"


def draw(one: dict[str, np.ndarray], two: dict[str, np.ndarray]) -> Figure:
    """Deepest of each section in both studies, and the largest difference there beside the bound that each gives."""
    figure = new_figure(7.0)
    axes = figure.subplots(2, len(BODIES), sharex=True)
    for b, name in enumerate(BODIES):
        x, (depth, off) = two["x"] * MM, axes[:, b]
        for study, colour, style in ((one, CURVES[0], "-"), (two, CURVES[1], "--")):
            label = f"{len(study['log'])} blocks"
            depth.plot(x, study["depth"][b].max(axis=1) * UM, color=colour, ls=style, label=label)
        difference = np.abs(one["depth"][b] - two["depth"][b]).max(axis=1)
        off.plot(x, difference * UM, color=CURVES[2], label="largest difference")
        off.plot(
            x, one["error"][b].max(axis=1) * UM, color=CURVES[0], ls=":", label="bound that the longer blocks give"
        )
        depth.set(title=name, ylabel="deepest in the section [\u00b5m]")
        off.set(xlabel="x [mm]", ylabel="[\u00b5m]")
        worn = np.flatnonzero(np.maximum(one["depth"], two["depth"]).max(axis=(0, 2)) > 0)
        off.set_xlim(x[worn[0]] - 10, x[worn[-1]] + 10)
    axes[0, 0].legend()
    axes[1, 0].legend()
    figure.suptitle(f"Wear by two lengths of blocks, {two['log'][-1, PASSES]:,.0f} passes")
    return figure


def main(
    coarse: Path = typer.Argument(..., help="folder of a finished damage study of a crossing"),
    fine: Path = typer.Argument(..., help="folder of the same study in shorter blocks"),
    out: Path = typer.Option(None, help="folder for block_error.md and block_error.png"),
) -> None:
    """How far wear depends on the length of the blocks, by position."""
    one, two = read_pair(coarse, fine)
    text = table(one, two)
    print(text, end="")
    if out is not None:
        write_table_and_figure(out / "block_error.md", text, out / "block_error.png", lambda: draw(one, two))


if __name__ == "__main__":
    typer.run(main)
