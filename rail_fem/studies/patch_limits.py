"""Where the half-space is wrong and the 2.5D slices are right: beside a free edge, and where the wheel's radius is near
the rail's.

    rail-fem study patch-methods limits --out limits

Edge: a wheel of 460 mm on a crown of 300 mm that ends in a square edge at some distance from the initial contact, or
at both sides, as on a crossing's nose. Conformal: a hollow tread of almost the crown's radius. Reference: the limit of
static finite elements (rail_fem/static_fe/finite_series.py).
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bem.halfspace.normal import normal_contact
from bem.material import STEEL
from bem.patch import Patch
from bem.patch_edge import edge_positions
from bem.slices.coupled import SlicePatch, slice_contact
from rail_fem.contact.patch_methods import MethodRow, table
from rail_fem.show.panels import Panel
from rail_fem.show.table_and_figure import publish
from rail_fem.static_fe.finite_series import finite_series, limit_row, to_stderr
from rail_fem.static_fe.solid_blocks import BlockPair

ROLLING = 0.46
NOSE, NOSE_LOAD = 0.30, 5e4  # crown radius [m] and load [N] beside an edge
HOLLOW_LOAD = 1.5e5  # on a crown under a hollow tread [N]
HALF_SPACE, SLICES, FINITE = "half-space", "2.5D (b), coupled slices", "finite elements"


@dataclass(frozen=True)
class LimitCase:
    """A pair of blocks under a load [N]; reach : (length, width) [m] about the initial contact within which the
    patch is searched."""

    name: str
    pair: BlockPair
    load: float
    reach: tuple[float, float]


def arc(radius: float) -> Callable[[np.ndarray], np.ndarray]:
    """Depth [m] of a circle below its highest point at s [m]."""
    return lambda s: np.asarray(s) ** 2 / (radius + np.sqrt(radius**2 - np.asarray(s) ** 2))


def edge_case(right: float, left: float = 0.030) -> LimitCase:
    """The lower face ends at these distances [m] from the initial contact, on the field and on the other side."""
    crown = arc(NOSE)
    pair = BlockPair(
        lambda x, s: -crown(s) + 0 * x, lambda x, s: x**2 / (2 * ROLLING) + 0 * s, (-left, right), (-0.030, 0.030)
    )
    nose = f"nose {(left + right) * 1e3:g} mm wide, edges {left * 1e3:g} and {right * 1e3:g} mm"
    name = nose if left < 0.02 else f"edge {right * 1e3:g} mm"
    return LimitCase(f"{name} from the initial contact", pair, NOSE_LOAD, (0.014, 0.014))


def hollow_case(radius: float, ratio: float) -> LimitCase:
    """A crown of a radius [m]; the tread's radius over the crown's, above 1."""
    crown, tread, half = arc(radius), arc(ratio * radius), min(0.026, 0.8 * radius)
    pair = BlockPair(
        lambda x, s: -crown(s) + 0 * x,
        lambda x, s: x**2 / (2 * ROLLING) - tread(s),
        (-half, half),
        (-half, half),
        depth=0.045,
    )
    return LimitCase(
        f"tread of {ratio * radius * 1e3:g} on crown of {radius * 1e3:g} mm", pair, HOLLOW_LOAD, (0.014, half)
    )


CASES = (
    edge_case(8e-3),
    edge_case(5e-3),
    edge_case(3e-3),
    edge_case(6e-3, 4e-3),
    hollow_case(0.04, 1.05),
    hollow_case(0.04, 1.02),
    hollow_case(0.02, 1.02),
)


def light_patches(case: LimitCase, cells: tuple[int, int] = (50, 80)) -> tuple[Patch, SlicePatch]:
    """Half-space and slices of a case."""
    long, wide = case.reach
    window = ((-long, long), (-wide, wide))
    half_space = normal_contact(case.pair.gap, STEEL, STEEL, load=case.load, window=window, cells=88, estimate=False)
    slices = slice_contact(case.pair.slices(), load=case.load, cells=cells, length=(-long, long), estimate=False)
    return half_space, slices


def seen_along_approach(method: str, patch: SlicePatch) -> MethodRow:
    """Slices lie along the face; width and areas as finite elements and half-space have them, in the tangent plane."""
    x_min, x_max, s_min, s_max = edge_positions(patch.grid, patch.pressure)
    width = np.interp([s_min, s_max], patch.grid.y, patch.points[:, 0])
    share = -(patch.normals @ patch.direction)
    area = patch.contact_area * (patch.contact @ share).sum() / patch.contact.sum()
    effective = 9 / 8 * (patch.pressure @ share).sum() ** 2 / ((patch.pressure**2) @ share).sum() * patch.grid.cell_area
    return MethodRow(
        method, patch.max_pressure, x_max - x_min, float(np.ptp(width)), area, patch.cost.seconds, patch, effective
    )


def rows_of(
    case: LimitCase, sizes: list[float], report=to_stderr
) -> tuple[list[MethodRow], MethodRow, dict[str, float]]:
    """Half-space, slices, finite elements of these sizes [m] and their limit; the limit; its uncertainty."""
    half_space, slices = light_patches(case)
    report(case.name)
    series = finite_series(case.pair, case.load, slices, sizes, report)
    reference, miss = limit_row(series)
    rows = [MethodRow.of(HALF_SPACE, half_space), seen_along_approach(SLICES, slices)]
    return [*rows, *(MethodRow.of(patch.method, patch) for patch in series), reference], reference, miss


def positions_across(patch: Patch) -> np.ndarray:
    """s of a patch's columns from the initial contact [m], in the tangent plane."""
    return patch.points[:, 0] if isinstance(patch, SlicePatch) else patch.grid.y


def centre_across(row: MethodRow) -> float:
    """Where the pressure's resultant acts, across from the initial contact [m]."""
    along = row.known_patch.pressure.sum(axis=0)
    return float(along @ positions_across(row.known_patch) / along.sum())


def panel(name: str, rows: list[MethodRow]) -> Panel:
    """Pressure across the patch at x = 0 by every method."""
    lines = {}
    for words, row, look in ((HALF_SPACE, rows[0], "-"), (SLICES, rows[1], "--"), (FINITE, rows[-1], "o")):
        patch = row.known_patch
        middle = patch.pressure[int(np.abs(patch.grid.x).argmin())]
        lines[words] = positions_across(patch) * 1e3, middle / 1e6, look
    return Panel("across, from the initial contact [mm]", "pressure [MPa]", lines, name)


def study_limits(sizes: list[float], out: Path | None) -> None:
    """Half-space and slices beside an edge and under a hollow tread, against finite elements of these sizes [m]."""
    found, text = {}, []
    for case in CASES:
        rows, reference, miss = rows_of(case, sizes)
        found[case.name] = rows
        words = ", ".join(f"{name.replace('_', ' ')} {value:.1%}" for name, value in miss.items())
        centres = ", ".join(f"{row.method} {centre_across(row) * 1e3:+.3f}" for row in (rows[0], rows[1], rows[-2]))
        text.append(
            f"{case.name}, {case.load / 1e3:g} kN; in brackets the difference to the finite elements'"
            f" limit\n\n{table(rows, reference)}\nUncertainty of the limit: {words}.\n"
            f"Centre of pressure across, from the initial contact [mm]: {centres}."
        )
    drawn = [panel(name, rows) for name, rows in found.items()]
    publish("patch_limits", out, [], drawn, "Pressure across the patch at x = 0", "\n\n".join(text))
