"""The patch's edge between the cells: extent and area finer than the grid.

Pressure falls to the edge as the root of the distance, so its square falls as a line: that line through the two
outermost cells of a row is followed to zero, by at most one cell.
Error: extent about a fifth of a cell; area a tenth to a twentieth of counting cells, 0.1 to 0.3 % at 22 to 44 cells
(tests/bem/test_halfspace_normal.py).
"""

from __future__ import annotations

import numpy as np

from kernel_cache import njit


def edge_positions(grid, pressure: np.ndarray) -> tuple[float, float, float, float]:
    """(x_min, x_max, y_min, y_max) of the patch's edge [m]; NaN without contact. grid: bem.patch.Grid."""
    if not (pressure > 0).any():
        return np.nan, np.nan, np.nan, np.nan
    along_x, along_y = (pressure**2).max(axis=1), (pressure**2).max(axis=0)
    return *_zero_positions(along_x, grid.x, grid.dx), *_zero_positions(along_y, grid.y, grid.dy)


def _zero_positions(squares: np.ndarray, positions: np.ndarray, step: float) -> tuple[float, float]:
    filled = np.flatnonzero(squares > 0)
    padded = np.pad(squares, 1)
    first, last = filled[0], filled[-1]
    return (
        float(positions[first] - step * cells_to_edge(squares[first], padded[first + 2])),
        float(positions[last] + step * cells_to_edge(squares[last], padded[last])),
    )


def covered_area(grid, pressure: np.ndarray) -> float:
    """Area of the patch [m^2]: the mean of what the rows along x and the rows along y give. grid: bem.patch.Grid."""
    return float(grid.dx * grid.dy * _covered_cells(np.ascontiguousarray(pressure, dtype=float)))


@njit(cache=True)
def _covered_cells(pressure):
    """Covered cells: whole ones and the corrections at both ends of each run, mean of the runs along both axes."""
    nx, ny = pressure.shape
    whole, ends = 0, 0.0
    for i in range(nx):
        for j in range(ny):
            if pressure[i, j] <= 0.0:
                continue
            whole += 1
            outer = pressure[i, j] ** 2
            for di, dj in ((1, 0), (-1, 0), (0, 1), (0, -1)):
                if not _carries(pressure, i - di, j - dj):
                    inner = pressure[i + di, j + dj] ** 2 if _carries(pressure, i + di, j + dj) else 0.0
                    ends += 0.5 * (cells_to_edge(outer, inner) - 0.5)
    return whole + ends


@njit(cache=True)
def _carries(pressure, i, j):
    return 0 <= i < pressure.shape[0] and 0 <= j < pressure.shape[1] and pressure[i, j] > 0.0


@njit(cache=True)
def cells_to_edge(outer, inner):
    """From the outermost cell's centre to the edge; half a cell where pressure does not fall outwards."""
    return min(outer / (inner - outer), 1.0) if inner > outer else 0.5
