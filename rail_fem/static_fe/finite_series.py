"""A patch by static finite elements of several sizes, and the limit they tend to."""

import sys
import time
from collections.abc import Callable

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from bem.patch import Patch
from rail_fem.contact.patch_methods import MethodRow
from rail_fem.processes.progress import duration
from rail_fem.result.extrapolation import extrapolated
from rail_fem.static_fe.solid_blocks import BlockPair, FineZone
from rail_fem.static_fe.solid_contact import FinitePatch, finite_patch

LAST = 3  # of a series, by which its limit is told
WIDTH = 0.6  # of an element along s to that along x: patches end more bluntly across
_GROWTH = 2.0  # growth of outer elements beyond 1, over the element's share of the half length
_COST = 3.3  # seconds grow with this power of the number of elements along a side
# as on Hertz' ellipse, tests/versus/test_solid_contact.py
ORDERS = {"max_pressure": 2.0, "area": 1.0, "effective_area": 1.5}
_EDGE = 2 / 7  # of an element, by which length and width scatter there, to both sides


def zone_about(expected: Patch, size: float, width: float | None = None) -> FineZone:
    """Fine elements of a size [m] along x and down, of a width [m] along s, over a patch and a tenth more; outside they
    grow the slower the finer they are."""
    pressed = expected.grid.y[expected.pressure.any(axis=0)]
    half, margin = expected.extent[0] / 2, 0.06 * np.ptp(pressed) + size
    along, down = (np.ceil(share * half / size) * size for share in (1.1, 0.6))
    across, growth = (pressed[0] - margin, pressed[-1] + margin), 1 + min(0.4, _GROWTH * size / half)
    return FineZone(along, across, down, size, width or WIDTH * size, growth)


def finite_series(
    pair: BlockPair, load: float, expected: Patch, sizes: list[float], report: Callable[[str], None] | None = None
) -> list[FinitePatch]:
    """Patches of these element sizes [m], the coarsest first, each beginning from the one before.

    expected : a solution of any method about which the elements are made fine, nothing else; report : told how far the
        series is and when it ends
    """
    sizes, began = sorted(sizes, reverse=True), time.perf_counter()
    found: list[FinitePatch] = []
    share = np.cumsum([size**-_COST for size in sizes])
    for size, done in zip(sizes, share):
        found.append(finite_patch(pair, load, zone_about(expected, size), found[-1] if found else None))
        spent = time.perf_counter() - began
        if report is not None:
            report(
                f"finite elements of {size * 1e3:g} mm: {found[-1].nodes} nodes, {found[-1].sets} sets,"
                f" {found[-1].max_pressure / 1e6:.1f} MPa, {duration(spent)} gone,"
                f" {duration(spent * (share[-1] / done - 1))} to go"
            )
    return found


def to_stderr(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def limit_row(series: list[FinitePatch]) -> tuple[MethodRow, dict[str, float]]:
    """The limit of the last patches of a series as a row, with the finest patch; and the relative uncertainty of each
    quantity.

    Length and width scatter by where the edge falls between two nodes and show no order: they are the finest elements'.
    """
    rows, sizes = [MethodRow.of(patch.method, patch) for patch in series[-LAST:]], [p.size for p in series[-LAST:]]
    limits = {name: extrapolated(sizes, [getattr(row, name) for row in rows], order) for name, order in ORDERS.items()}
    limits |= {"length": (rows[-1].length, _EDGE * sizes[-1]), "width": (rows[-1].width, _EDGE * series[-1].width)}
    of = f"{', '.join(format(size * 1e3, '.3g') for size in sizes)} mm"
    seconds = sum(patch.cost.seconds for patch in series)
    values = {name: value for name, (value, _) in limits.items()}
    row = MethodRow(f"finite elements, limit of {of}", seconds=seconds, patch=series[-1], **values)
    return row, {name: miss / value for name, (value, miss) in limits.items()}


def map_difference(finite: Patch, other: Patch) -> float:
    """L2 norm of the difference of two pressure maps over the norm of the other's, which is averaged over the cells of
    the first."""
    inside = RegularGridInterpolator((other.grid.x, other.grid.y), other.pressure, bounds_error=False, fill_value=0.0)
    grid, fifths = finite.grid, (np.arange(5) - 2) / 5
    x, y = (grid.x[:, None] + grid.dx * fifths).ravel(), (grid.y[:, None] + grid.dy * fifths).ravel()
    mean = inside(tuple(np.meshgrid(x, y, indexing="ij"))).reshape(grid.nx, 5, grid.ny, 5).mean(axis=(1, 3))
    return float(np.linalg.norm(finite.pressure - mean) / np.linalg.norm(mean))
