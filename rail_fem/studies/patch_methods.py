"""The contact patch of P8 on BS113A by every method of `bem`, with static finite elements in three dimensions as
reference solution.

    rail-fem study patch-methods --out patch                    profiles as a figure
    rail-fem study patch-methods --size 1 --size 0.7            other element sizes along the patch [mm], three fifths
                                                                of that across
    rail-fem study patch-methods limits                         where the half-space is wrong (patch_limits.py)

Blocks with the true faces of a contact pair (rail_fem/contact/contact_pairs.py) under the thesis' wheel load; the
reference is the limit of three sizes (rail_fem/static_fe/finite_series.py, rail_fem/static_fe/solid_contact.py).
Length, width and area are read from nodal or cell pressures of all methods in one way (bem/patch_edge.py). The table
ends with the same finite elements at the thesis' element sizes, and with the thesis' own rows.
"""

from dataclasses import replace
from typing import Annotated

import numpy as np
import typer

from bem.patch import Patch
from bem.slices.coupled import slice_contact
from rail_fem.contact.contact_pairs import ContactPair
from rail_fem.contact.patch_methods import (
    BLOCKS,
    THESIS_ROWS,
    WHEEL_LOAD,
    MethodRow,
    contact_point_of,
    method_rows,
    table,
    thesis_pair,
)
from rail_fem.show.panels import Panel
from rail_fem.show.table_and_figure import publish
from rail_fem.static_fe.finite_series import finite_series, limit_row, map_difference, to_stderr, zone_about
from rail_fem.static_fe.solid_blocks import BlockPair
from rail_fem.static_fe.solid_contact import finite_patch
from rail_fem.studies.harness import OUT, QUICK
from rail_fem.studies.patch_limits import study_limits

COMPARED = ("half-space", BLOCKS)
SHOWN = (*COMPARED, "2.5D (a) parabolic, 2a = 11.32 mm", "2.5D (a) elliptic, 2a = 11.32 mm")
THESIS_ELEMENT = (0.2e-3, 18.88e-3 / 50)
THESIS_HEAD = "60E1"  # rail_fem/contact/patch_methods.py says why
RAILS = ("56E1", "60E1")


def pair_blocks(pair: ContactPair) -> BlockPair:
    """Blocks cut from wheel and rail of a contact pair about its first point of contact."""
    across = -0.022, 0.026
    return BlockPair(
        pair.rail_height, pair.wheel_height, across, across, lower_steel=pair.rail_steel, upper_steel=pair.wheel_steel
    )


def reference_rows(rail: str, sizes: list[float], report=to_stderr) -> tuple[list[MethodRow], MethodRow, str]:
    """Every method of `bem` and finite elements of these sizes [m] along x'; the reference; and what it is uncertain
    by, in words."""
    pair = thesis_pair(rail)
    load, blocks = pair.normal_force(WHEEL_LOAD), pair_blocks(pair)
    report(f"P8 on {rail}: the methods of bem")
    rows = method_rows(pair, rail)
    rows.insert(
        -1, MethodRow.of(BLOCKS, slice_contact(blocks.slices(), load=load, length=(-0.014, 0.014), estimate=False))
    )
    series = finite_series(blocks, load, rows[-1].known_patch, sizes, report)
    reference, miss = limit_row(series)
    words = ", ".join(f"{name.replace('_', ' ')} {value:.1%}" for name, value in miss.items())
    return (
        [*rows, *(MethodRow.of(patch.method, patch) for patch in series), reference],
        reference,
        f"Uncertainty of the limit: {words}.",
    )


def thesis_mesh_row(rail: str, expected: Patch) -> MethodRow:
    """Finite elements of the thesis' sizes, with length and width to the next node without pressure on each side, as a
    contour plot shows them.

    Its elements are 0.2 mm long; across, its patch of 18.88 mm is 50 of them.
    """
    pair = thesis_pair(rail)
    zone = replace(zone_about(expected, *THESIS_ELEMENT), down=8 * THESIS_ELEMENT[0], growth=1.25)
    patch = finite_patch(pair_blocks(pair), pair.normal_force(WHEEL_LOAD), zone, expected)
    rows, columns = (np.count_nonzero(patch.contact.any(axis=axis)) + 1 for axis in (1, 0))
    row = MethodRow.of("finite elements at the thesis' 0.2 x 0.38 mm, read to the next node", patch)
    return replace(row, length=rows * patch.grid.dx, width=columns * patch.grid.dy)


def map_words(rows: list[MethodRow]) -> str:
    """L2 differences of the finest finite elements' pressure map to those of the methods compared."""
    finest, compared = rows[-1].known_patch, [row for row in rows if row.method in COMPARED]
    return ", ".join(f"{row.method} {map_difference(finest, row.known_patch):.1%}" for row in compared)


def across_from_contact(row: MethodRow) -> np.ndarray:
    """s of a patch's columns [m], from the initial contact; slices of whole profiles count from the middle of the
    track."""
    whole = row.method.startswith("2.5D") and row.method != BLOCKS
    patch = row.known_patch
    return patch.grid.y - (contact_point_of(patch) if whole else 0.0)


def panels(rail: str, rows: list[MethodRow]) -> list[Panel]:
    """Pressure across the patch at x = 0 and its largest along the patch, of the methods of SHOWN and of the finest
    finite elements."""
    across, along = {}, {}
    for row in [*(row for row in rows if row.method in SHOWN), rows[-1]]:
        patch, look = row.known_patch, "o" if row is rows[-1] else "-"
        middle = int(np.abs(patch.grid.x).argmin())
        across[row.method] = across_from_contact(row) * 1e3, patch.pressure[middle] / 1e6, look
        along[row.method] = patch.grid.x * 1e3, patch.pressure.max(axis=1) / 1e6, look
    first = Panel("across, from the initial contact [mm]", "pressure [MPa]", across, f"P8 on {rail}, at x = 0")
    return [first, Panel("x [mm]", "largest pressure of the section [MPa]", along)]


def main(
    part: Annotated[str, typer.Argument(help="methods or limits")] = "methods",
    size: Annotated[list[float] | None, typer.Option(help="element sizes along the patch [mm]")] = None,
    thesis: Annotated[bool, typer.Option(help="finite elements at the thesis' sizes, too (a minute)")] = True,
    quick: QUICK = False,
    out: OUT = None,
) -> None:
    """P8 on BS113A, 49,505 N: all patch solvers against finite elements, beside the thesis; where they are wrong."""
    sizes = [value * 1e-3 for value in size or ([1.6, 1.2] if quick else [1.0, 0.7, 0.5])]
    if part == "limits":
        study_limits(sizes, out)
        return
    if part != "methods":
        raise typer.BadParameter(f"{part}: no such part; there are methods and limits")
    cases, text = {}, []
    for rail in RAILS:
        rows, reference, words = reference_rows(rail, sizes if size or quick else [*sizes, 0.35e-3])
        cases[rail] = rows
        meets = thesis and not quick and rail == THESIS_HEAD
        thesis_rows = [thesis_mesh_row(rail, reference.known_patch)] if meets else []
        text.append(
            f"P8 on {rail}, {WHEEL_LOAD:.0f} N; in brackets the difference to the finite elements'"
            f" limit\n\n{table([*rows, *thesis_rows, *THESIS_ROWS], reference)}\n{words}\n"
            f"Pressure map of the finest finite elements, L2 difference to: {map_words(rows)}"
        )
    drawn = [panel for rail, rows in cases.items() for panel in panels(rail, rows)]
    publish("patch_methods", out, [], drawn, f"P8, {WHEEL_LOAD / 1e3:.4g} kN", "\n\n".join(text))
