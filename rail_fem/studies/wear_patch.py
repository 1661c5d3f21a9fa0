"""Study: wear of one patch by the method of its pressure, thesis section 6.2.5: Hertz against slices and half-space.

    python -m rail_fem.studies.wear_patch --out DIR     a table (wear_patch.md) and a figure of the strips' depths

P8 on BS113A under 49,505 N with the creepages of Table 6-2, FASTSIM on every patch, Archard with k = 10e-4 and H = 2.8
GPa. All patches carry the same force, so that the worn area differs by slip alone (weighted with pressure); the largest
cell differs by pressure and slip there. The thesis prints largest cells of a 50 x 50 grid, 3.66e-4 um for Hertz and
6.79e-5 um for 2.5D; a cell wears in proportion to its own length along x.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import typer

from bem.halfspace.fastsim import elliptic_patch, fastsim
from bem.patch import Creepage, Patch
from rail_fem.atomic import write_text_atomically
from rail_fem.damage.wear import Archard, slip_size, tgamma, worn_area
from rail_fem.light.patch_methods import THESIS_STEEL, WHEEL_LOAD, method_rows, thesis_pair
from rail_fem.output.markdown import markdown_table
from rail_fem.show.style import GREEN, NOSE, PURPLE, TOTAL, WING, lettering, new_figure, save

CREEPAGE = Creepage(3.7917e-5, 0.005, 0.2023)  # Table 6-2
HEAD = "60E1"  # rail_fem/light/patch_methods.py says why
LAW = Archard(2.8e9, coefficient=10e-4)
SPEED, CELL = 15.0, 11.32e-3 / 50  # of the thesis' grid along x [m]
COLOURS = (TOTAL, WING, GREEN, NOSE, PURPLE)


def rolled(patch: Patch) -> Patch:
    """With tractions and slip under Table 6-2's creepages, which are those at the largest pressure: there y is 0."""
    grid, along = patch.grid, patch.pressure.max(axis=0)
    patch = replace(patch, grid=replace(grid, y_first=grid.y_first - grid.y[int(np.argmax(along))]))
    return fastsim(patch, THESIS_STEEL, THESIS_STEEL, 0.3, CREEPAGE, estimate=False)


def patches() -> dict[str, Patch]:
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


def numbers(patch: Patch) -> WearNumbers:
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


def table(found: dict[str, Patch]) -> str:
    """Markdown: each method, and the ratio to the first."""
    head = [
        "pressure by",
        "p0 [MPa]",
        "largest cell [1e-4 um]",
        "its p",
        "its slip",
        "deepest strip [1e-2 um]",
        "area [1e-5 mm2]",
        "mean slip",
        "T gamma [N]",
    ]
    first = numbers(next(iter(found.values())))
    rows = []
    for name, patch in found.items():
        own = numbers(patch)
        ratio = [f" ({a / b - 1:+.0%})" if own is not first and a != b else "" for a, b in zip(own, first, strict=True)]
        shown = WearNumbers(
            own.cell * 1e10, own.pressure / 1e6, own.slip * 1e3, own.strip * 1e8, own.area * 1e11, own.mean_slip * 1e3
        )
        cell, pressure, slip, strip, area, mean_slip = (f"{v:.3g}{r}" for v, r in zip(shown, ratio, strict=True))
        rows.append(
            [
                name,
                f"{patch.max_pressure / 1e6:.0f}",
                cell,
                f"{pressure} MPa",
                f"{slip}e-3",
                strip,
                area,
                f"{mean_slip}e-3",
                f"{tgamma(patch):.1f}",
            ]
        )
    return "\n".join(markdown_table(head, rows)) + "\n"


def draw(path: Path, found: dict[str, Patch]) -> Path:
    """Depth of one pass over the strips."""
    with lettering():
        figure = new_figure(6.0)
        axis = figure.add_subplot()
        for (name, patch), colour in zip(found.items(), COLOURS, strict=False):
            axis.plot(patch.grid.y * 1e3, LAW.depth(patch, SPEED) * 1e9, color=colour, label=name)
        axis.set(
            xlabel="across the rail from the largest pressure, + to the field side [mm]",
            ylabel="depth of one pass [nm]",
        )
        axis.legend()
        figure.suptitle(
            "Wear of one pass by strips: P8 on BS113A, 49.5 kN, creepages of the thesis' Table 6-2,\n"
            "Archard with k = 10e-4, H = 2.8 GPa, FASTSIM on every patch",
            fontsize=13,
        )
        return save(figure, path)


def main(out: Annotated[Path, typer.Option(help="folder for table and figure")]) -> None:
    """Wear of one patch by the method of its pressure."""
    found = patches()
    text = table(found)
    out.mkdir(parents=True, exist_ok=True)
    write_text_atomically(out / "wear_patch.md", text)
    typer.echo(text)
    typer.echo(str(draw(out / "wear_patch.png", found)))


if __name__ == "__main__":
    typer.run(main)
