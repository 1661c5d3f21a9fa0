"""Plane elastodynamics in Laplace's domain: the field of a line force that varies as exp(s t).

    U_ij = A [psi delta_ij - chi r_i r_j],    A = 1 / (2 pi G),    k1, k2 = s / c1, s / c2,    b = c2 / c1
    psi = K0(k2 r) + [K1(k2 r) - b K1(k1 r)] / (k2 r)
    chi = K2(k2 r) - b^2 K2(k1 r)

Only what exceeds the static kernels is computed here. It is bounded where they are singular, since the reduced
functions K1(z) - 1/z and K2(z) - 2/z^2 + 1/2 enter, in which the poles cancel by algebra and not by subtraction.

Source: Cruse and Rizzo, J. Math. Anal. Appl. 22 (1968) 244 (from memory; tests: its static limit, the wave equation by
differences, SciPy's Bessel functions).
"""

from __future__ import annotations

import numpy as np

from kernel_cache import njit

_EULER = 0.5772156649015329
_SERIES = 2.0  # |z| below which the power series is used, and the continued fraction above


@njit(cache=True)
def bessel(z):
    """K0(z) and K1(z) - 1/z of a complex z with a positive real part. Error: 1e-14 (tests/bem/dynamic/test_laplace.py).

    Series: Abramowitz and Stegun 9.6.10 to 9.6.13; beyond, Steed's evaluation of Temme's continued fraction.
    """
    if abs(z) < _SERIES:
        log = np.log(0.5 * z) + _EULER
        square = 0.25 * z * z
        term, harmonic = complex(1.0, 0.0), 0.0
        zero, one = -log, 0.5 * z * (log - 0.5)
        for k in range(1, 25):
            term = term * square / (k * k)
            harmonic += 1.0 / k
            zero += term * (harmonic - log)
            one += 0.5 * z * term / (k + 1) * (log - harmonic - 0.5 / (k + 1))
            if abs(term) < 1e-17:
                break
        return zero, one
    b = 2.0 * (1.0 + z)
    d = 1.0 / b
    h, step = d, d
    q1, q2 = complex(0.0, 0.0), complex(1.0, 0.0)
    q = c = complex(0.25, 0.0)
    a = -0.25
    total = 1.0 + q * step
    for i in range(2, 200):
        a -= 2.0 * (i - 1)
        c = -a * c / i
        following = (q1 - b * q2) / a
        q1, q2 = q2, following
        q += c * following
        b += 2.0
        d = 1.0 / (b + a * d)
        step = (b * d - 1.0) * step
        h += step
        change = q * step
        total += change
        if abs(change) < 1e-16 * abs(total):
            break
    zero = np.sqrt(np.pi / (2.0 * z)) * np.exp(-z) / total
    return zero, zero * (z + 0.5 - 0.25 * h) / z - 1.0 / z


@njit(cache=True, inline="always")
def _excess(r, k1, k2, ratio):
    """psi and chi beyond their static parts -(1 + b^2)/2 ln r and -(1 - b^2)/2, and the derivatives along r of both."""
    z1, z2 = k1 * r, k2 * r
    zero1, one1 = bessel(z1)
    zero2, one2 = bessel(z2)
    square = ratio * ratio
    two1, two2 = zero1 + 2.0 * one1 / z1 + 0.5, zero2 + 2.0 * one2 / z2 + 0.5
    inner = (one2 - ratio * one1) / z2
    psi = zero2 + 0.5 * (1.0 + square) * np.log(r) + inner
    chi = two2 - square * two1
    inner_slope = -inner / r + (k2 * (-zero2 - one2 / z2) - ratio * k1 * (-zero1 - one1 / z1)) / z2
    psi_slope = -k2 * one2 + inner_slope + 0.5 * (square - 1.0) / r
    chi_slope = k2 * (-one2 - 2.0 * two2 / z2) - square * k1 * (-one1 - 2.0 * two1 / z1)
    return psi, chi, psi_slope, chi_slope


@njit(cache=True, inline="always")
def _add_hats(matrix, i, first, last, weight, t, xx, yx, xy, yy):
    """Add a point force's field at point i, components ij along i by a force along j, to the columns of the two hats
    that share an element at t in (0, 1). matrix (2m, 2n): all x then all y; added to."""
    m, n = matrix.shape[0] // 2, matrix.shape[1] // 2
    for hat in range(2):
        column = first if hat == 0 else last
        w = weight * ((1.0 - t) if hat == 0 else t)
        matrix[i, column] += w * xx
        matrix[m + i, column] += w * yx
        matrix[i, n + column] += w * xy
        matrix[m + i, n + column] += w * yy


@njit(cache=True)
def add_excess(points, normals, start, end, first, last, nodes, weights, k1, k2, ratio, displacement, traction):
    """Add what the fields of hat-weighted forces exceed the static ones by, over 1 / (2 pi G) and over 1 / (2 pi).

    points (m,) complex; normals (m,) complex, or empty where no traction is wanted; elements as in bem.plane.kelvin
    nodes, weights : Gauss points on (0, 1); elements near a point are split at its foot and halved towards it
    displacement (2m, 2n), traction (2m, 2n) : complex, all x then all y; added to
    """
    m = points.size
    square = ratio * ratio
    lame = 1.0 / square - 2.0  # lambda / G
    level = 0.25 * (1.0 - square)
    pull = normals.size > 0
    cuts = np.empty(32)
    for i in range(m):
        for e in range(start.size):
            step = end[e] - start[e]
            length = abs(step)
            share = ((points[i] - start[e]) * step.conjugate()).real / length**2
            foot = min(max(share, 0.0), 1.0)
            count = _panels(abs(points[i] - start[e] - foot * step) / length, foot, abs(k2) * length, cuts)
            for panel in range(count - 1):
                a, b = cuts[panel], cuts[panel + 1]
                for g in range(nodes.size):
                    t = a + (b - a) * nodes[g]
                    away = points[i] - start[e] - t * step
                    r = abs(away)
                    if r < 1e-14 * length:
                        continue
                    rx, ry = away.real / r, away.imag / r
                    psi, chi, psi_slope, chi_slope = _excess(r, k1, k2, ratio)
                    weight = weights[g] * (b - a) * length
                    uxx = psi + level - chi * rx * rx
                    uyy = psi + level - chi * ry * ry
                    uxy = -chi * rx * ry
                    _add_hats(displacement, i, first[e], last[e], weight, t, uxx, uxy, uxy, uyy)
                    if not pull:
                        continue
                    nx, ny = normals[i].real, normals[i].imag
                    rn = rx * nx + ry * ny
                    bulk = lame * (psi_slope - chi_slope - chi / r)
                    turn, swing = psi_slope - chi / r, 2.0 * (2.0 * chi / r - chi_slope)
                    # t_i = lambda n_i div + G [...], the force along j
                    txx = bulk * nx * rx + turn * (rn + rx * nx) - 2.0 * chi / r * nx * rx + swing * rn * rx * rx
                    tyy = bulk * ny * ry + turn * (rn + ry * ny) - 2.0 * chi / r * ny * ry + swing * rn * ry * ry
                    txy = bulk * nx * ry + turn * rx * ny - 2.0 * chi / r * nx * ry + swing * rn * rx * ry
                    tyx = bulk * ny * rx + turn * ry * nx - 2.0 * chi / r * ny * rx + swing * rn * rx * ry
                    _add_hats(traction, i, first[e], last[e], weight, t, txx, tyx, txy, tyy)


@njit(cache=True)
def _panels(distance, foot, decay, cuts):
    """Ends of panels on (0, 1) into cuts, and their number: halved towards the foot until they are as short as its
    distance or resolve the decay |k2| length."""
    if distance > 1.5:
        parts = min(1 + int(decay / 3.0), 3)
        for k in range(parts + 1):
            cuts[k] = k / parts
        return parts + 1
    halvings = 2
    while halvings < 6 and 0.5**halvings > max(0.5 * distance, 0.02) and 0.5**halvings * decay > 0.1:
        halvings += 1
    count = 0
    if foot > 1e-9:
        cuts[count] = 0.0
        count += 1
        for k in range(1, halvings + 1):
            cuts[count] = foot * (1.0 - 0.5**k)
            count += 1
    cuts[count] = foot
    count += 1
    if foot < 1.0 - 1e-9:
        for k in range(halvings, 0, -1):
            cuts[count] = foot + (1.0 - foot) * 0.5**k
            count += 1
        cuts[count] = 1.0
        count += 1
    return count
