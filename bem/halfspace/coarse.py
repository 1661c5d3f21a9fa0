"""From a grid to the one at doubled cell sides, and back: for first guesses and for error estimates.

A solution's error is estimated from its changes between three grids, cells doubled twice. One change alone is no bound:
the patch's edge falls now here, now there between the cells, so that it can vanish where the error does not.
"""

from __future__ import annotations

import numpy as np

from bem.patch import Grid

FORCE_STAIRS = 0.02  # for edge_share, of a tangential force


def coarse_grid(grid: Grid) -> Grid:
    """The grid at doubled cell sides (the last row or column reaches half out where the count is odd)."""
    x, y = grid.x_first + grid.dx / 2, grid.y_first + grid.dy / 2
    return Grid(x, y, 2 * grid.dx, 2 * grid.dy, (grid.nx + 1) // 2, (grid.ny + 1) // 2)


def refined(grid: Grid, times: int) -> Grid:
    """The grid with cells `times` finer both ways."""
    x_min, x_max, y_min, y_max = grid.edges
    return Grid.over((x_min, x_max), (y_min, y_max), times * grid.nx, times * grid.ny)


def coarse_field(field: np.ndarray, fill: str = "edge") -> np.ndarray:
    """Means over 2 x 2 cells of a field (nx, ny); an odd last row is repeated ("edge") or met by zeros ("constant")."""
    padded = np.pad(field, [(0, size % 2) for size in field.shape], mode=fill)
    return padded.reshape(padded.shape[0] // 2, 2, padded.shape[1] // 2, 2).mean(axis=(1, 3))


def fine_pressure(pressure: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """(nx, ny) pressure interpolated from doubled cell sides: bilinear in its square, which is smooth up to the
    edge."""

    def halved(square: np.ndarray) -> np.ndarray:  # its rows
        inner, both = np.pad(square, ((1, 1), (0, 0))), np.empty((2 * len(square), square.shape[1]))
        both[0::2], both[1::2] = 0.75 * square + 0.25 * inner[:-2], 0.75 * square + 0.25 * inner[2:]
        return both

    return np.sqrt(halved(halved(pressure**2).T).T[: shape[0], : shape[1]])


def relative_change(coarse: np.ndarray | float, fine: np.ndarray | float) -> float:
    """|coarse - fine| / |fine|, in the Euclidean norm; NaN where fine vanishes."""
    size = float(np.linalg.norm(fine))
    return float(np.linalg.norm(np.subtract(coarse, fine))) / size if size > 0 else np.nan


def error_bound(
    fine: np.ndarray | float,
    coarse: np.ndarray | float,
    coarser: np.ndarray | float | None,
    order: int = 2,
    least: float = 0.0,
) -> float:
    """Relative error of a quantity solved with cells, with doubled and with fourfold cell sides (None: not solved).

    hypot(coarse - fine, (coarser - coarse) / 2^order) / |fine|: the last change, or what the change before leaves of an
    error of that order in the cell; and `least`. NaN where fine vanishes.
    Error: above the true error in at least 95 %, less than five times it in half of the cases of
    bem/verification/estimates_study.py.
    """
    last = relative_change(coarse, fine)
    before = last if coarser is None else relative_change(coarser, coarse) / 2**order
    return float(np.hypot(np.hypot(last, before), least))


def edge_share(pressure: np.ndarray, cells: float) -> float:
    """What the stairs of cells at the patch's edge may leave of an error on any grid: `cells` of a cell over the
    patch's width."""
    contact = pressure > 0
    return cells / min(np.count_nonzero(contact.any(axis=axis)) for axis in (0, 1))
