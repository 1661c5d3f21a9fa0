"""Influence of evenly loaded rectangles on an elastic half-space's surface, and its products by FFT.

Two bodies in contact act as one half-space with combined constants (shear G, Poisson nu, coupling K):
1/G = (1/G1 + 1/G2)/2, nu/G = (nu1/G1 + nu2/G2)/2, K/G = ((1 - 2 nu1)/G1 - (1 - 2 nu2)/G2)/4.
With u the displacement of body 1 minus that of body 2 (u_n: approach taken out, positive opens the gap),
traction (qx, qy) on body 1, pressure p, r the distance to the load:
    pi G u_n = sum (1 - nu)/r p + K (x qx + y qy)/r^2
    pi G u_x = sum ((1 - nu)/r + nu x^2/r^3) qx + nu x y/r^3 qy - K x/r^2 p            (u_y likewise)
Source: Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990), section 1.6 and 4.2; Johnson, Contact
Mechanics (1985), sections 3.2, 3.6. The integrals over a rectangle are exact: Love (1929) for 1/r, the others likewise
(tests/bem/test_halfspace_influence.py holds each to quadrature).
"""

from __future__ import annotations

import numpy as np
from scipy import fft

from bem.patch import Grid


# Antiderivatives at the corners of cells: x and y are odd multiples of half a cell, never 0.
def _one_over_r(x, y):
    r = np.hypot(x, y)
    return x * np.log(y + r) + y * np.log(x + r)


def _xx_over_r3(x, y):
    return y * np.log(x + np.hypot(x, y))


def _xy_over_r3(x, y):
    return -np.hypot(x, y)


def _x_over_r2(x, y):
    return y * np.log(x**2 + y**2) / 2 + x * np.arctan(y / x)


def _y_over_r2(x, y):
    return x * np.log(x**2 + y**2) / 2 + y * np.arctan(x / y)


# integral over a rectangle of each function of (x, y): (double antiderivative, parity in x, parity in y)
_KERNELS = {
    "1/r": (_one_over_r, 1, 1),
    "xx/r3": (_xx_over_r3, 1, 1),
    "xy/r3": (_xy_over_r3, -1, -1),
    "x/r2": (_x_over_r2, -1, 1),
    "y/r2": (_y_over_r2, 1, -1),
}


def rectangle_integrals(name: str, dx: float, dy: float, nx: int, ny: int) -> np.ndarray:
    """(nx, ny) integral of the kernel over a dx x dy cell whose centre lies (-i dx, -j dy) from the observer.

    name : "1/r", "xx/r3", "xy/r3" [m], "x/r2" or "y/r2" [m]; dx, dy : [m]
    Error: round-off, growing as n^2 eps (second difference of the antiderivative).
    """
    antiderivative = _KERNELS[name][0]
    edge_x, edge_y = np.meshgrid((np.arange(nx + 1) - 0.5) * dx, (np.arange(ny + 1) - 0.5) * dy, indexing="ij")
    return np.diff(np.diff(antiderivative(edge_x, edge_y), axis=0), axis=1)


def padded_shape(nx: int, ny: int) -> tuple[int, int]:
    """FFT sizes that hold all offsets of nx x ny cells, and one more along x (for the slip between two cells)."""
    return fft.next_fast_len(2 * nx + 1, real=False), fft.next_fast_len(2 * ny + 1, real=True)


def kernel_spectrum(name: str, grid: Grid, size: tuple[int, int] | None = None) -> np.ndarray:
    """Real FFT of a kernel over all offsets up to half the period `size` (default padded_shape).

    The whole period is filled with the kernel, the part that no pair of cells needs as well: zeros there would make
    some of the spectrum negative, and the products indefinite (tests/bem/test_halfspace_influence.py).
    Returns (size x, size y // 2 + 1), real for kernels even or odd in both x and y, else complex.
    """
    size = size or padded_shape(*grid.shape)
    reach = size[0] // 2, size[1] // 2
    _, parity_x, parity_y = _KERNELS[name]
    quarter = rectangle_integrals(name, grid.dx, grid.dy, reach[0] + 1, reach[1] + 1)
    if parity_x < 0 and size[0] % 2 == 0:
        quarter[-1] = 0.0
    if parity_y < 0 and size[1] % 2 == 0:
        quarter[:, -1] = 0.0
    left, low = size[0] - reach[0], size[1] - reach[1]
    kernel = np.empty(size)
    kernel[: reach[0] + 1, : reach[1] + 1] = quarter
    kernel[left:, : reach[1] + 1] = parity_x * quarter[:0:-1]
    kernel[:, low:] = parity_y * kernel[:, reach[1] : 0 : -1]
    spectrum = fft.rfft2(kernel, overwrite_x=True)
    return np.ascontiguousarray(spectrum.real) if parity_x == parity_y else spectrum


def forward(field: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Spectrum (..., size x, size y // 2 + 1) of a field (..., nx, ny) padded with zeros; the padding's rows are not
    transformed."""
    rows = fft.rfft(field, n=size[1])
    return fft.fft(rows, n=size[0], axis=-2, overwrite_x=True)


def backward(
    spectrum: np.ndarray, shape: tuple[int, int], size: tuple[int, int], first: tuple[int, int] = (0, 0)
) -> np.ndarray:
    """Field (..., nx, ny) of a spectrum from the cell `first` on, the rest cut off before the second transform;
    `spectrum` is overwritten."""
    columns = fft.ifft(spectrum, axis=-2, overwrite_x=True)[..., first[0] : first[0] + shape[0], :]
    return fft.irfft(columns, n=size[1])[..., first[1] : first[1] + shape[1]]
