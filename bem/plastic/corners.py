"""Corner functions: X^a Y^b q^c exp(-q Z) of bem.plastic.symbols in real space, in closed form.

(0, 0, -1) is 1/R with R^2 = x^2 + y^2 + Z^2; X and Y differentiate, negative powers integrate over x and y, q is minus
the derivative to Z. Antiderivatives are taken up to what the differences over a rectangle's corners take out.
Source: derived here from 1/R, -ln(R + Z) and Z ln(R + Z) - R; each is held to differences of another one
(tests/bem/plastic/test_cuboid.py).
"""

from __future__ import annotations

import numpy as np

from kernel_cache import njit

MONOMIALS = (
    (-1, -1, -1), (-1, 0, -2), (0, -1, -2), (0, 0, -3), (0, 1, -4), (1, -1, -3), (1, 0, -4),
    (-1, -1, 0), (-1, 0, -1), (0, -1, -1), (0, 0, -2), (0, 1, -3), (1, -1, -2), (1, 0, -3), (1, 1, -4), (2, 0, -4),
    (-1, -1, 1), (-1, 0, 0), (0, -1, 0), (0, 0, -1), (0, 1, -2), (1, -1, -1), (1, 0, -2), (1, 1, -3), (2, 0, -3),
    (-1, -1, 2), (-1, 0, 1), (0, -1, 1), (0, 0, 0), (0, 1, -1), (1, -1, 0), (1, 0, -1), (1, 1, -2), (2, 0, -2),
    (1, 1, -5), (2, 0, -5),
)  # fmt: skip
NUMBER = {monomial: k for k, monomial in enumerate(MONOMIALS)}
COUNT = len(MONOMIALS)


@njit(cache=True)
def fill_corner(x: float, y: float, z: float, out: np.ndarray) -> None:
    """out (36,) : every corner function at distances x, y (neither 0) and z >= 0 [m], order MONOMIALS."""
    r = np.sqrt(x * x + y * y + z * z)
    w, flat = r + z, x * x + y * y
    a, b = x * x + z * z, y * y + z * z
    over_x, over_y = np.arcsinh(x / np.sqrt(b)), np.arcsinh(y / np.sqrt(a))
    below = flat / w  # r - z
    angle = np.arctan2(x * y, z * r)
    turn_x = np.arctan2(x * y * below, x * x * r + y * y * z)
    turn_y = np.arctan2(x * y * below, y * y * r + x * x * z)
    log_w = np.log(w)
    half = 0.5 * log_w - flat / (4 * w * w)
    inverse, inverse_w = 1 / r, 1 / (r * w)
    square = inverse * inverse
    pole = x * y * inverse / (a * b)

    out[0] = x * over_y + y * over_x - z * angle
    out[1] = -(x * log_w + z * over_x + y * turn_y)
    out[2] = -(y * log_w + z * over_y + x * turn_x)
    out[3] = z * log_w - r
    out[4] = y * half
    out[5] = -x * over_y + z * turn_x
    out[6] = x * half

    out[7] = angle
    out[8] = over_x
    out[9] = over_y
    out[10] = -log_w
    out[11] = -y / w
    out[12] = -turn_x
    out[13] = -x / w
    out[14] = x * y / (2 * w * w)
    out[15] = 0.5 * log_w + (x * x - y * y) / (4 * w * w)

    out[16] = pole * (r * r + z * z)
    out[17] = z * x * inverse / b
    out[18] = z * y * inverse / a
    out[19] = inverse
    out[20] = -y * inverse_w
    out[21] = -x * y * inverse / a
    out[22] = -x * inverse_w
    out[23] = x * y * inverse_w / w
    out[24] = -1 / w + x * x * inverse_w / w

    out[25] = pole * z * ((r * r + z * z) * (square + 2 / a + 2 / b) - 4)
    out[26] = x * inverse / b * (z * z * square + 2 * z * z / b - 1)
    out[27] = y * inverse / a * (z * z * square + 2 * z * z / a - 1)
    out[28] = z * square * inverse
    out[29] = -y * square * inverse
    out[30] = -x * y * z * inverse / a * (square + 2 / a)
    out[31] = -x * square * inverse
    out[32] = x * y * inverse_w * (square + inverse_w)
    out[33] = -inverse_w + x * x * inverse_w * (square + inverse_w)

    tail = 1 / (2 * w) + flat / (6 * w * w * w)
    out[34] = x * y / 2 * tail
    out[35] = -0.5 * (z * log_w - r) + (x * x - y * y) / 4 * tail


@njit(cache=True)
def corner_planes(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """(nz, 36, nx, ny) corner functions at the points of a box; x, y without 0 [m], z >= 0 [m]."""
    out = np.empty((len(z), COUNT, len(x), len(y)))
    values = np.empty(COUNT)
    for k in range(len(z)):
        for i in range(len(x)):
            for j in range(len(y)):
                fill_corner(x[i], y[j], z[k], values)
                for f in range(COUNT):
                    out[k, f, i, j] = values[f]
    return out
