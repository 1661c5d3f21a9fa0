"""Where the grid goes: finds the patch of a gap function in a search window and lays the cells over it."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from bem.halfspace.input import GapFunction, check_inside, gap_values
from bem.halfspace.pressure import NormalOperator, solve_pressure
from bem.material import Pair
from bem.patch import ContactInputError, Grid, NoContactError, PatchCutError, edge_positions

Window = tuple[tuple[float, float], tuple[float, float]]

_SEARCH_CELLS = 40
_RESOLVED = 12  # cells across the patch, both ways, from which its edge is trusted
_MARGIN = 1.5  # cells between patch and grid edge
_MAX_ROUNDS = 40
_SHRINKS = 0.95  # of its sides, at most, that a round leaves of a box that still narrows
_MOST_SEARCH_CELLS = 320
_A_POINT = 1e-12  # side of cells [m] that hold nothing below their least gap
_NO_ROOM = 1e-6  # of a stretch, below which only round-off moves the grid's edges


def position_grid(
    gap: GapFunction, window: Window, pair: Pair, load: float | None, approach: float | None, cells: tuple[int, int]
) -> Grid:
    """Grid of `cells` that holds every patch inside the window with a margin of 1.5 cells.

    gap(x, y) -> gap [m] for arrays of positions; window : ((x_min, x_max), (y_min, y_max)) [m]
    The window is solved coarsely and narrowed to the cells that touch or could touch, until the patch is 12 cells
    across. Where the gap is so steep that cells could touch far from the patch, the box comes to rest before: then the
    cells are halved. Patches that lie between the cells of the first search (a 40th of the window) can be missed.
    """
    _check_window(window)
    box, search_cells = window, [_SEARCH_CELLS, _SEARCH_CELLS]
    for _ in range(_MAX_ROUNDS):
        grid = Grid.over(*box, *search_cells)
        found, resolved, contact = _narrow(gap_values(gap, grid), grid, pair, load, approach)
        across_x, across_y = ((max(low, limit[0]), min(high, limit[1])) for (low, high), limit in zip(found, window))
        found = across_x, across_y
        if resolved:
            return _lay(found, window, cells, search_cells)
        if _settled(found, box):
            if min(search_cells) >= _MOST_SEARCH_CELLS:
                break  # the next round would be this one again
            search_cells = [min(2 * count, _MOST_SEARCH_CELLS) for count in search_cells]
        box = found
    raise ContactInputError(_unresolved(grid, contact))


def _unresolved(grid: Grid, contact: np.ndarray) -> str:
    """What the search is left with: where the bodies touch, and that it is too small against the box that holds it."""
    labels, count = ndimage.label(contact, structure=np.ones((3, 3)))
    positions = [
        f"x = {round(grid.x[i].mean(), 9):.3g}, y = {round(grid.y[j].mean(), 9):.3g} m ({len(np.unique(i))} x"
        f" {len(np.unique(j))} cells)"
        for i, j in (np.nonzero(labels == number) for number in range(1, min(count, 4) + 1))
    ]
    x_min, x_max, y_min, y_max = grid.edges
    return (
        f"the bodies touch at {count} position(s), {'; '.join(positions)}: too small or too far apart to be resolved"
        f" together by a search with {grid.nx} x {grid.ny} cells over x {x_min:.3g} to {x_max:.3g}, y {y_min:.3g} to"
        f" {y_max:.3g} m, where {_RESOLVED} across are wanted; give a window about one of them, or a grid"
    )


def _settled(found: Window, box: Window) -> bool:
    """Whether a round has narrowed no side of the box."""
    return all(new[1] - new[0] > _SHRINKS * (old[1] - old[0]) for new, old in zip(found, box))


def _check_window(window: Window) -> None:
    if np.shape(window) != (2, 2):
        raise ContactInputError(f"window {window!r}: give ((x_min, x_max), (y_min, y_max)) [m]")
    for name, (low, high) in zip("xy", window):
        if not (np.isfinite([low, high]).all() and high > low):
            raise ContactInputError(f"window along {name}: ({low!r}, {high!r}) m: give finite limits, the lower first")


def _narrow(
    values: np.ndarray, grid: Grid, pair: Pair, load: float | None, approach: float | None
) -> tuple[Window, bool, np.ndarray]:
    """The patch's box, whether the patch is resolved, and the cells that touch; if it is not, the box of all cells that
    might touch."""
    operator = NormalOperator(grid, pair)
    if approach is not None and approach <= values.min():
        lowest = np.unravel_index(values.argmin(), values.shape)
        if approach < values[lowest] - _variation(values)[lowest] or max(grid.dx, grid.dy) < _A_POINT:
            raise NoContactError(
                f"approach {approach:g} m does not close the least gap, {values[lowest]:g} m at x = "
                f"{grid.x[lowest[0]]:g}, y = {grid.y[lowest[1]]:g} m: no contact; raise the approach above it"
            )
        cell = np.zeros(grid.shape, bool)
        cell[lowest] = True
        return _box(grid, cell), False, values == values.min()
    solution = solve_pressure(operator, values, load, approach, tolerance=1e-4)
    contact = solution.pressure > 0
    across = [np.count_nonzero(contact.any(axis=axis)) for axis in (1, 0)]
    if min(across) >= _RESOLVED:
        x_min, x_max, y_min, y_max = edge_positions(grid, solution.pressure)
        return ((x_min - grid.dx, x_max + grid.dx), (y_min - grid.dy, y_max + grid.dy)), True, contact
    open_gap = operator.displacement(solution.pressure) + values - solution.approach
    return _box(grid, contact | (open_gap < _variation(values))), False, contact


def _variation(values: np.ndarray) -> np.ndarray:
    """How far the gap may fall below its centre value within a cell: half the steps to the neighbours, both ways."""
    finite = np.where(np.isfinite(values), values, np.nanmax(np.where(np.isfinite(values), values, np.nan)))
    return (
        sum(np.abs(np.gradient(finite, axis=axis)) for axis in (0, 1)) / 2
        if min(values.shape) > 1
        else np.zeros(values.shape)
    )


def _box(grid: Grid, mask: np.ndarray) -> Window:
    """Rectangle of the marked cells and two more on each side [m]."""
    x, y = grid.x[mask.any(axis=1)], grid.y[mask.any(axis=0)]
    return ((x[0] - 2.5 * grid.dx, x[-1] + 2.5 * grid.dx), (y[0] - 2.5 * grid.dy, y[-1] + 2.5 * grid.dy))


def _lay(patch: Window, window: Window, cells: tuple[int, int], search_cells: list[int]) -> Grid:
    """`patch` is the patch and one search cell more on each side, which serves as the margin's error."""

    def extent(low: float, high: float, count: int, limit: tuple[float, float], searched: int) -> tuple[float, float]:
        share = max(count - 2 * _MARGIN, count / 2)
        slack = (high - low) / searched
        margin = max(((high - low) - 2 * slack) * (count / share - 1) / 2 - slack, 0.0)
        return max(low - margin, limit[0]), min(high + margin, limit[1])

    along, across = (extent(*patch[i], cells[i], window[i], search_cells[i]) for i in (0, 1))
    return Grid.over(along, across, *cells)


def widened(grid: Grid, pressure: np.ndarray, window: Window) -> Grid:
    """The grid stretched by a tenth on the sides where the patch touches it, within the window; same counts.

    Raises PatchCutError where the window leaves no room for it.
    """
    x_min, x_max, y_min, y_max = grid.edges
    wide, long = 0.1 * (y_max - y_min), 0.1 * (x_max - x_min)
    box = (
        (max(x_min - long * pressure[0].any(), window[0][0]), min(x_max + long * pressure[-1].any(), window[0][1])),
        (
            max(y_min - wide * pressure[:, 0].any(), window[1][0]),
            min(y_max + wide * pressure[:, -1].any(), window[1][1]),
        ),
    )
    moved = np.abs(np.ravel(box) - grid.edges) / [long, long, wide, wide]
    if moved.max() < _NO_ROOM:
        check_inside(pressure, grid)
        raise PatchCutError("the window cuts the patch")
    return Grid.over(*box, grid.nx, grid.ny)
