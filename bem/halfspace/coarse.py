"""From a grid to the one at doubled cell sides, and back: for first guesses and for error estimates."""
from __future__ import annotations

import numpy as np

from bem.patch import Grid


def coarse_grid(grid: Grid) -> Grid:
    """The grid at doubled cell sides (the last row or column reaches half out where the count is odd)."""
    return Grid(grid.x_first + grid.dx / 2, grid.y_first + grid.dy / 2, 2 * grid.dx, 2 * grid.dy,
                (grid.nx + 1) // 2, (grid.ny + 1) // 2)


def coarse_field(field: np.ndarray, fill: str = "edge") -> np.ndarray:
    """Means over 2 x 2 cells of a field (nx, ny); an odd last row is repeated ("edge") or met by zeros ("constant")."""
    padded = np.pad(field, [(0, size % 2) for size in field.shape], mode=fill)
    return padded.reshape(padded.shape[0] // 2, 2, padded.shape[1] // 2, 2).mean(axis=(1, 3))


def fine_pressure(pressure: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """(nx, ny) pressure interpolated from doubled cell sides: bilinear in its square, which is smooth up to the edge."""
    square = np.pad(pressure**2, 1)
    along = np.empty((2 * pressure.shape[0], square.shape[1]))
    along[0::2], along[1::2] = 0.75 * square[1:-1] + 0.25 * square[:-2], 0.75 * square[1:-1] + 0.25 * square[2:]
    both = np.empty((along.shape[0], 2 * pressure.shape[1]))
    both[:, 0::2], both[:, 1::2] = 0.75 * along[:, 1:-1] + 0.25 * along[:, :-2], 0.75 * along[:, 1:-1] + 0.25 * along[:, 2:]
    return np.sqrt(both[:shape[0], :shape[1]])


def relative_change(coarse: np.ndarray | float, fine: np.ndarray | float) -> float:
    """|coarse - fine| / |fine|, in the Euclidean norm; NaN where fine vanishes."""
    size = float(np.linalg.norm(fine))
    return float(np.linalg.norm(np.subtract(coarse, fine))) / size if size > 0 else np.nan
