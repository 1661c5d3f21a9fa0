"""Fields of forces on straight edges, as the initial stress of polygonal cells needs them.

A uniform initial stress s in a cell acts on the elastic plane as the forces s n on the cell's edges (n outward): its
field is that of constant forces on straight elements, in closed form. Total strain e follows from it at any point; the
stress is C : e - s inside the cell and C : e outside (the free term).

Two integrals carry the stress at points, per hat weight (bem.plane.kelvin): with force w
    Phi = -c a w,   Psi = c (kappa a conj(w) + b w).
The mean strain of a cell is the integral of its boundary's displacement, of which two edges give the double integrals
of ln r and e^(2 i theta): closed forms in the four differences of their ends.

Error: 1e-12 of the largest value near by (tests/bem/plane_plastic/test_plane_kernels.py: quadrature).
"""

from __future__ import annotations

import numpy as np

from bem.plane.kelvin import _frames, _lambda_terms, _local
from kernel_cache import njit


@njit(cache=True)
def hat_stress_integrals(points, start, end, first, last, count):
    """a and b (m, count) complex at points (m,) complex; other arguments as bem.plane.kelvin.displacement_integrals."""
    a = np.zeros((points.size, count), np.complex128)
    b = np.zeros((points.size, count), np.complex128)
    middle, to_local, _, along = _frames(start, end)
    for i in range(points.size):
        for e in range(start.size):
            eta = _local(points[i], middle[e], to_local[e])
            size = eta.real * eta.real + eta.imag * eta.imag
            log, first_term = _lambda_terms(eta, size)
            square = eta * eta - 1.0
            second = 2.0 / square if eta.imag != 0.0 else complex(0.0, 0.0)
            steep = eta * second - log if eta.imag != 0.0 else complex(0.0, 0.0)
            back = np.conj(along[e])
            cubed, turn = back * back * back, complex(0.0, -2.0 * eta.imag)
            mean, slope = 0.5 * (log + turn * second), 0.5 * (first_term + turn * steep)
            a[i, first[e]] += 0.5 * back * (log - first_term)
            a[i, last[e]] += 0.5 * back * (log + first_term)
            b[i, first[e]] += cubed * (mean - slope)
            b[i, last[e]] += cubed * (mean + slope)
    return a, b


@njit(cache=True, inline="always")
def _double_terms(w, center, product, twice_cosine):
    """Antiderivatives of ln w and of w / conj(w) along both edges, on a branch that holds w and `center`."""
    if w == 0.0:
        return complex(0.0, 0.0), complex(0.0, 0.0)
    log = np.log(w / center) + np.log(center)
    mirrored, log_mirrored = np.conj(w), np.conj(log)
    whole = np.conj(product) * (0.75 * w * w - 0.5 * w * w * log)
    mixed = product * mirrored * (-w * log_mirrored + product * twice_cosine * mirrored * (0.5 * log_mirrored - 0.25))
    return whole, mixed


@njit(cache=True)
def edge_pair(a, b, c, d):
    """Integrals of ln r and of e^(2 i theta) [m^2] over two straight edges a-b and c-d (complex) that do not cross."""
    one, two = (b - a) / abs(b - a), (d - c) / abs(d - c)
    if (a == c and b == d) or (a == d and b == c):
        length = abs(b - a)
        return length * length * (np.log(length) - 1.5), length * length * one * one
    center = 0.5 * (a + b - c - d)
    if center == 0.0:
        center = a - c
    product, twice_cosine = one * two, 2.0 * (one * np.conj(two)).real
    far, far_mixed = _double_terms(b - d, center, product, twice_cosine)
    near, near_mixed = _double_terms(a - c, center, product, twice_cosine)
    left, left_mixed = _double_terms(b - c, center, product, twice_cosine)
    right, right_mixed = _double_terms(a - d, center, product, twice_cosine)
    return (far + near - left - right).real, far_mixed + near_mixed - left_mixed - right_mixed


@njit(cache=True)
def near_strain(rows, columns, vertices, offsets, areas, kappa):
    """Mean 2 G strain (p, 3, 3) xx yy xy of cells rows (p,) by unit initial stress xx yy xy of cells columns (p,).

    vertices : complex corners of all cells, anticlockwise, cell k from offsets[k] to offsets[k + 1]; areas [m^2]
    """
    out = np.empty((rows.size, 3, 3))
    c = 1.0 / (2.0 * np.pi * (1.0 + kappa))
    for pair in range(rows.size):
        i, j = rows[pair], columns[pair]
        block = np.zeros((3, 3))
        for p in range(offsets[i], offsets[i + 1]):
            q = p + 1 if p + 1 < offsets[i + 1] else offsets[i]
            step = vertices[q] - vertices[p]
            nx, ny = step.imag / abs(step), -step.real / abs(step)
            for r in range(offsets[j], offsets[j + 1]):
                s = r + 1 if r + 1 < offsets[j + 1] else offsets[j]
                other = vertices[s] - vertices[r]
                mx, my = other.imag / abs(other), -other.real / abs(other)
                log_r, twist = edge_pair(vertices[p], vertices[q], vertices[r], vertices[s])
                level = -2.0 * c * kappa * log_r
                xx, yy, xy = level + c * twist.real, level - c * twist.real, c * twist.imag
                # forces by unit stress xx, yy, xy: (mx, 0), (0, my), (my, mx); u = [[xx, xy], [xy, yy]] w
                for k in range(3):
                    fx = mx if k == 0 else (my if k == 2 else 0.0)
                    fy = my if k == 1 else (mx if k == 2 else 0.0)
                    ux, uy = xx * fx + xy * fy, xy * fx + yy * fy
                    block[0, k] += ux * nx
                    block[1, k] += uy * ny
                    block[2, k] += 0.5 * (ux * ny + uy * nx)
        out[pair] = block / areas[i]
    return out
