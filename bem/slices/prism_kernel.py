"""Kelvin's solution along a straight line whose force varies as a wave, integrated over boundary elements.

Axes: 1, 2 in the cross-section, 3 along the prism. A line force (f1, f2) cos(k x3), f3 sin(k x3) [N/m] at the origin
gives u = (U1, U2) cos, U3 sin. With r the distance in the section, K0, K1 Bessel's functions of k r, c = 1 / (4 (1 -
nu)), G = k K1 / r, H = (k^2 K0 + 2 G) / r^2, and xn the distance along the normal n:

    2 pi mu U = (1 - c) K0 d_ab + c G x_a x_b | U_3b = c k K0 x_b | U_a3 = -c k K0 x_a | U_33 = K0 - c k r K1
    2 pi T    = (1 - 2c) G (n_a x_b - x_a n_b - xn d_ab) - 2 c H xn x_a x_b
    2 pi T_3b = -k ((1 - 2c) K0 n_b + 2 c G xn x_b),   2 pi T_a3 = -k ((1 - 2c) K0 n_a - 2 c G xn x_a)
    2 pi T_33 = xn (2 c k^2 K0 - G)

For k -> 0 this is plane strain and, apart from it, shear along the prism. The functions below integrate what k adds to
those two (regular, or a logarithm times a length), by Gauss' rule; the singular remainder is exact
(bem/plane/kelvin.py).
Source: Fourier transform of Kelvin's solution in the form of Papkovich and Neuber; checked against quadrature of
Kelvin's solution along the line, and T against derivatives of U (tests/bem/test_prism.py).
"""

from __future__ import annotations

import numpy as np

from kernel_cache import njit

_EULER = 0.5772156649015329
_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(3)


@njit(cache=True)
def bessel_remainders(z):
    """K0(z) + ln(z/2) and z K1(z) - 1 without cancellation for small z; (K0, K1 of scipy to 2e-7 above z = 2)."""
    if z <= 2.0:
        t, log = 0.25 * z * z, np.log(0.5 * z)
        term0, term1 = 1.0, 1.0  # t^j / (j!)^2 and t^j / (j! (j+1)!)
        bessel0, bessel1 = 0.0, 0.0  # I0 - 1, 2 I1 / z
        harmonic = -_EULER  # psi(j + 1)
        tail0, tail1 = harmonic, 0.0
        for j in range(14):
            if j > 0:
                term0 *= t / (j * j)
                term1 *= t / (j * (j + 1))
                harmonic += 1.0 / j
                bessel0 += term0
                tail0 += harmonic * term0
            bessel1 += term1
            tail1 += (2 * harmonic + 1.0 / (j + 1)) * term1
        return -log * bessel0 + tail0, 0.5 * z * z * (log * bessel1 - 0.5 * tail1)
    q, root = 2.0 / z, np.exp(-z) / np.sqrt(z)
    zero = root * (
        1.25331414
        + q
        * (-0.07832358 + q * (0.02189568 + q * (-0.01062446 + q * (0.00587872 + q * (-0.00251540 + q * 0.00053208)))))
    )
    one = root * (
        1.25331414
        + q
        * (0.23498619 + q * (-0.03655620 + q * (0.01504268 + q * (-0.00780353 + q * (0.00325614 - q * 0.00068245)))))
    )
    return zero + np.log(0.5 * z), z * one - 1.0


@njit(cache=True, nogil=True)
def bessel_remainders_of(z):
    """K0(z) + ln(z/2) of an array (m, n) of positive numbers."""
    out = np.empty(z.shape)
    for i in range(z.shape[0]):
        for j in range(z.shape[1]):
            out[i, j] = bessel_remainders(z[i, j])[0]
    return out


@njit(cache=True, nogil=True)
def add_wave_displacement(points, start, step, first, last, wavenumber, poisson, out):
    """Adds 2 pi mu times what the wave adds to displacement at points, hat by hat.

    points (m, 2), start, step (k, 2) elements, first, last (k,) hats; out (3, 3, m, n): component, force, point, hat
    The logarithm is taken as -ln r; the constant c/2 that bem/plane/kelvin.py leaves out of plane strain is included.
    """
    c = 1 / (4 * (1 - poisson))
    level = np.log(0.5 * wavenumber)
    for e in range(len(start)):
        length = np.hypot(step[e, 0], step[e, 1])
        for g in range(3):
            rise = 0.5 * (1 + _GAUSS[g])
            px, py = start[e, 0] + rise * step[e, 0], start[e, 1] + rise * step[e, 1]
            for side in range(2):
                hat = last[e] if side else first[e]
                weight = 0.5 * _WEIGHTS[g] * length * (rise if side else 1 - rise)
                for i in range(len(points)):
                    x, y = points[i, 0] - px, points[i, 1] - py
                    square = x * x + y * y
                    z = wavenumber * np.sqrt(square)
                    rest0, rest1 = bessel_remainders(z)
                    bulk, twist = (1 - c) * (rest0 - level) + 0.5 * c, c * rest1 / square
                    out[0, 0, i, hat] += weight * (bulk + twist * x * x)
                    out[1, 1, i, hat] += weight * (bulk + twist * y * y)
                    out[0, 1, i, hat] += weight * twist * x * y
                    out[1, 0, i, hat] += weight * twist * x * y
                    cross = weight * c * wavenumber * (rest0 - np.log(0.5 * z))
                    out[2, 0, i, hat] += cross * x
                    out[2, 1, i, hat] += cross * y
                    out[0, 2, i, hat] -= cross * x
                    out[1, 2, i, hat] -= cross * y
                    out[2, 2, i, hat] += weight * (rest0 - level - c * (rest1 + 1))


@njit(cache=True, nogil=True)
def add_wave_resultants(points, normals, widths, cells, start, step, first, last, wavenumber, poisson, out):
    """Adds 2 pi times what the wave adds to the traction's resultant over cells, each path by its middle.

    points, normals (m, 2), widths (m,) paths, cells (m,) their cell; out (3, 3, n, n): component, force, cell, hat
    The logarithm in T_3b and T_a3 is left out: K0 is replaced by K0 + ln r.
    """
    c = 1 / (4 * (1 - poisson))
    level = np.log(0.5 * wavenumber)
    for e in range(len(start)):
        length = np.hypot(step[e, 0], step[e, 1])
        for g in range(3):
            rise = 0.5 * (1 + _GAUSS[g])
            px, py = start[e, 0] + rise * step[e, 0], start[e, 1] + rise * step[e, 1]
            for i in range(len(points)):
                x, y, nx, ny = points[i, 0] - px, points[i, 1] - py, normals[i, 0], normals[i, 1]
                square = x * x + y * y
                across = x * nx + y * ny
                z = wavenumber * np.sqrt(square)
                rest0, rest1 = bessel_remainders(z)
                zero = rest0 - np.log(0.5 * z)
                g_remainder = rest1 / square
                g_whole = g_remainder + 1 / square
                h_remainder = (wavenumber**2 * zero + 2 * g_remainder) / square
                skew, bend = (1 - 2 * c) * g_remainder, 2 * c * h_remainder * across
                log, pull = (1 - 2 * c) * (rest0 - level), 2 * c * g_whole * across
                t00 = -skew * across - bend * x * x
                t11 = -skew * across - bend * y * y
                t01 = skew * (nx * y - x * ny) - bend * x * y
                t10 = skew * (ny * x - y * nx) - bend * x * y
                t20, t21 = -wavenumber * (log * nx + pull * x), -wavenumber * (log * ny + pull * y)
                t02, t12 = -wavenumber * (log * nx - pull * x), -wavenumber * (log * ny - pull * y)
                t22 = across * (2 * c * wavenumber**2 * zero - g_remainder)
                share = 0.5 * _WEIGHTS[g] * length * widths[i]
                cell = cells[i]
                for side in range(2):
                    hat = last[e] if side else first[e]
                    weight = share * (rise if side else 1 - rise)
                    out[0, 0, cell, hat] += weight * t00
                    out[1, 1, cell, hat] += weight * t11
                    out[0, 1, cell, hat] += weight * t01
                    out[1, 0, cell, hat] += weight * t10
                    out[2, 0, cell, hat] += weight * t20
                    out[2, 1, cell, hat] += weight * t21
                    out[0, 2, cell, hat] += weight * t02
                    out[1, 2, cell, hat] += weight * t12
                    out[2, 2, cell, hat] += weight * t22
