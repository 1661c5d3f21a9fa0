"""Kelvin's plane-strain solution integrated over straight elements with linear weights.

A point force W = X + iY at xi acts on the infinite plane. With c = 1 / (2 pi (1 + kappa)), kappa = 3 - 4 nu, at z = x +
iy:

    2 G u       = -2 c kappa W ln r + c conj(W) e^(2 i theta)                       z - xi = r e^(i theta)
    F           =  c W [(kappa - 1) ln r - i (kappa + 1) theta] - c conj(W) e^(2 i theta)
    sxx + syy   =  4 Re Phi,             Phi = -c W / (z - xi)
    syy - sxx + 2 i sxy = 2 Psi,         Psi =  c W (conj(z) - conj(xi)) / (z - xi)^2 + c kappa conj(W) / (z - xi)

F is the force function: -i (F(b) - F(a)) is the force that the material on the right of any path from a to b exerts on
the material on its left (Muskhelishvili). So the resultant of the traction over a piece of boundary has kernels no more
singular than those of the displacement, whatever the curve between its ends.

A hat weight is a rising and a falling linear weight over two neighbouring straight elements. Three integrals, free of
the material, carry everything: of ln r, of theta, of e^(2 i theta). They are closed forms in Lambda =
ln((eta+1)/(eta-1)), where eta is z in the frame of the element scaled to (-1, 1); far away they are summed as series in
1/eta^2, where the closed forms lose digits.

Source: Kelvin's complex potentials as in the thesis, eq. 5-11 to 5-15; Appendix A1 gives the displacement for one hat
of equal arms. Its stresses were not used. Error: 1e-12 of the largest value (tests/bem/test_kelvin.py: quadrature).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kernel_cache import njit

_FAR = 25.0  # |eta|^2 beyond which the series is used: 11 terms give 25^-11 = 4e-16
_ON_CORNER = 1e-9  # a point nearer than this (in half lengths) to an element lies on its left side
_K = np.arange(14)
_ODD = 1 / (2 * _K + 1)  # series of Lambda
_PAIR = 1 / ((2 * _K + 1) * (2 * _K + 3))  # series of the rising weight
_MEAN = 1 / (np.maximum(2 * _K, 1) * (2 * _K + 1))  # series of the mean of ln(eta - t), from k = 1


@njit(cache=True, inline="always")
def _terms(size):
    """Number of terms that bring |eta|^-2 to round-off; `size` is |eta|^2."""
    if size < 60.0:
        return 11
    if size < 400.0:
        return 9
    if size < 3e3:
        return 6
    return 4 if size < 1e5 else 3


@njit(cache=True, inline="always")
def _reciprocal(eta, size):
    """1 / eta, with size = |eta|^2."""
    scale = 1.0 / size
    return complex(eta.real * scale, -eta.imag * scale)


@njit(cache=True, inline="always")
def _log(x, y, size):
    """ln(x + iy) on the principal branch, with size = x^2 + y^2."""
    return complex(0.5 * np.log(size), np.arctan2(y, x))


@njit(cache=True, inline="always")
def _near_logs(eta, size):
    """ln(eta + 1) and ln(eta - 1); zero at the end itself, where they are multiplied by zero."""
    above, below = size + 2.0 * eta.real + 1.0, size - 2.0 * eta.real + 1.0
    if size < 4.0:  # near the ends the sums above lose digits
        above = (eta.real + 1.0) ** 2 + eta.imag**2
        below = (eta.real - 1.0) ** 2 + eta.imag**2
    y = eta.imag  # eta + 1 and eta - 1 as complex sums would give -0.0 two signs, and so two branches
    plus = _log(eta.real + 1.0, y, above) if above > 1e-28 else complex(0.0, 0.0)
    minus = _log(eta.real - 1.0, y, below) if below > 1e-28 else complex(0.0, 0.0)
    return plus, minus


@njit(cache=True, inline="always")
def _lambda_terms(eta, size):
    """Lambda and eta Lambda - 2, without cancellation."""
    if size < _FAR:
        plus, minus = _near_logs(eta, size)
        log = plus - minus
        return log, eta * log - 2.0
    inverse = _reciprocal(eta, size)
    square = inverse * inverse
    zero, one = complex(0.0, 0.0), complex(0.0, 0.0)
    for k in range(_terms(size) - 1, -1, -1):
        zero = zero * square + _ODD[k]
        one = one * square + _ODD[k + 1]
    return 2.0 * inverse * zero, 2.0 * square * one


@njit(cache=True, inline="always")
def _far_series(eta, size):
    """Series in 1 / eta^2: Lambda, eta Lambda - 2, ln(eta) minus the mean of ln(eta - t), and the integral of t ln(eta
    - t)."""
    inverse = _reciprocal(eta, size)
    square = inverse * inverse
    zero, one, two, tail = complex(0.0, 0.0), complex(0.0, 0.0), complex(0.0, 0.0), complex(0.0, 0.0)
    for k in range(_terms(size) - 1, -1, -1):
        zero = zero * square + _ODD[k]
        one = one * square + _ODD[k + 1]
        two = two * square + _PAIR[k]
        tail = (tail + _MEAN[k + 1]) * square
    return 2.0 * inverse * zero, 2.0 * square * one, tail, -2.0 * inverse * two


@njit(cache=True, inline="always")
def _log_integrals(eta, size):
    """Lambda, eta Lambda - 2, and the integrals of ln(eta - t) and t ln(eta - t) over (-1, 1)."""
    if size < _FAR:
        plus, minus = _near_logs(eta, size)
        log = plus - minus
        mean = (eta + 1.0) * plus - (eta - 1.0) * minus - 2.0
        return log, eta * log - 2.0, mean, 0.5 * (eta * eta - 1.0) * log - eta
    log, first, tail, second = _far_series(eta, size)
    return log, first, 2.0 * (_log(eta.real, eta.imag, size) - tail), second


@njit(cache=True, inline="always")
def _local(point, middle, to_local):
    """Point in the frame of the element, scaled to (-1, 1); points on the element are put on its left side."""
    eta = (point - middle) * to_local
    if abs(eta.imag) < _ON_CORNER and abs(eta.real) < 1.0 + _ON_CORNER:
        x = eta.real
        if abs(abs(x) - 1.0) < _ON_CORNER:
            x = 1.0 if x > 0 else -1.0
        return complex(x, 0.0)
    return eta


@njit(cache=True, inline="always")
def _weight_integrals(point, middle, to_local, half, twist):
    """Integrals over an element with the falling (0) and rising (1) weight: ln(z - xi), up to a constant angle, and
    e^(2 i theta)."""
    eta = _local(point, middle, to_local)
    log, first, mean, second = _log_integrals(eta, eta.real * eta.real + eta.imag * eta.imag)
    scaled, shift = 0.5 * half, half * np.log(half)
    y = 2.0 * eta.imag
    plain = complex(2.0 + y * log.imag, y * log.real)  # 2 + 2 i y conj(Lambda)
    slope = complex(y * first.imag, y * first.real)
    return (
        scaled * (mean - second) + shift,
        scaled * (mean + second) + shift,
        scaled * twist * (plain - slope),
        scaled * twist * (plain + slope),
    )


@njit(cache=True)
def _frames(start, end):
    """Middle, map to the local frame, half length and direction of each element."""
    half = 0.5 * (end - start)
    length = np.abs(half)
    return 0.5 * (start + end), 1.0 / half, length, half / length


@njit(cache=True)
def displacement_integrals(points, start, end, first, last, count):
    """Integrals of ln r and e^(2 i theta) at points, hat by hat.

    points : (m,) complex; start, end : (k,) complex ends of the elements
    first, last : (k,) index of the hat that falls from the start, and of the hat that rises to the end
    count : number n of hats
    Returns log_r (m, n) real and twist (m, n) complex, both [m].
    """
    log_r = np.zeros((points.size, count))
    twist = np.zeros((points.size, count), np.complex128)
    middle, to_local, half, along = _frames(start, end)
    for i in range(points.size):
        for e in range(start.size):
            fall, rise, fall_twist, rise_twist = _weight_integrals(
                points[i], middle[e], to_local[e], half[e], along[e] * along[e]
            )
            log_r[i, first[e]] += fall.real
            log_r[i, last[e]] += rise.real
            twist[i, first[e]] += fall_twist
            twist[i, last[e]] += rise_twist
    return log_r, twist


class ResultantIntegrals(NamedTuple):
    """Change of the integrals of ln r, theta (cells, n) and e^(2 i theta) (cells, n) complex over the paths of each
    cell, of n hats [m]."""

    log_r: np.ndarray
    angle: np.ndarray
    twist: np.ndarray


@njit(cache=True)
def resultant_integrals(points, path_from, path_to, cell, cells, start, end, first, last, count):
    """Change of the integrals of ln r, theta and e^(2 i theta) along straight paths, summed into cells.

    points : (m,) complex; path_from, path_to : (h,) indices of points at the ends of each path
    cell   : (h,) index of the cell that a path belongs to; cells : their number
    start, end, first, last, count : as in displacement_integrals
    Returns ResultantIntegrals.
    A source sees a straight path that it does not lie on under less than pi: that fixes the branch of theta.
    """
    log_r = np.zeros((count, cells))
    angle = np.zeros((count, cells))
    twist = np.zeros((count, cells), np.complex128)
    m = points.size
    fall, rise = np.empty(m, np.complex128), np.empty(m, np.complex128)
    fall_twist, rise_twist = np.empty(m, np.complex128), np.empty(m, np.complex128)
    middle, to_local, half, along = _frames(start, end)
    for e in range(start.size):
        for i in range(m):
            fall[i], rise[i], fall_twist[i], rise_twist[i] = _weight_integrals(
                points[i], middle[e], to_local[e], half[e], along[e] * along[e]
            )
        turn = 2.0 * np.pi * half[e]
        one_over = 1.0 / turn
        for h in range(path_from.size):
            a, b, c = path_from[h], path_to[h], cell[h]
            change = fall[b] - fall[a]
            log_r[first[e], c] += change.real
            angle[first[e], c] += change.imag - turn * np.rint(change.imag * one_over)
            twist[first[e], c] += fall_twist[b] - fall_twist[a]
            change = rise[b] - rise[a]
            log_r[last[e], c] += change.real
            angle[last[e], c] += change.imag - turn * np.rint(change.imag * one_over)
            twist[last[e], c] += rise_twist[b] - rise_twist[a]
    return ResultantIntegrals(log_r.T, angle.T, twist.T)


@njit(cache=True, inline="always")
def _real_log_integrals(eta, size):
    """As _log_integrals, with the last two real: no angle is computed far away."""
    if size < _FAR:
        log, first, mean, second = _log_integrals(eta, size)
        return log, first, mean.real, second.real
    log, first, tail, second = _far_series(eta, size)
    return log, first, np.log(size) - 2.0 * tail.real, second.real


@njit(cache=True)
def displacement_sums(points, start, end, at_start, at_end, kappa):
    """2 G u (m,) complex [N/m] of hat-weighted forces; arguments as in stress_sums."""
    out = np.empty(points.size, np.complex128)
    c = 1.0 / (2.0 * np.pi * (1.0 + kappa))
    middle, to_local, half, along = _frames(start, end)
    mean_force, slope_force = 0.5 * half * (at_start + at_end), 0.5 * half * (at_end - at_start)
    turned_mean, turned_slope = along * along * np.conj(mean_force), along * along * np.conj(slope_force)
    level = 2.0 * np.log(half)
    for i in range(points.size):
        total = complex(0.0, 0.0)
        for e in range(start.size):
            eta = _local(points[i], middle[e], to_local[e])
            log, first, mean, second = _real_log_integrals(eta, eta.real * eta.real + eta.imag * eta.imag)
            total -= 2.0 * kappa * ((mean + level[e]) * mean_force[e] + second * slope_force[e])
            y = 2.0 * eta.imag
            total += turned_mean[e] * complex(2.0 + y * log.imag, y * log.real) + turned_slope[e] * complex(
                y * first.imag, y * first.real
            )
        out[i] = c * total
    return out


@njit(cache=True)
def stress_sums(points, start, end, at_start, at_end, kappa):
    """Stress of hat-weighted forces.

    points : (m,) complex; start, end : (k,) complex; at_start, at_end : (k,) complex force density at the elements'
        ends [Pa]
    Returns (m, 3): sxx, syy, sxy [Pa]. Points on an element take the limit from its left.
    """
    out = np.empty((points.size, 3))
    c = 1.0 / (2.0 * np.pi * (1.0 + kappa))
    middle, to_local, _, along = _frames(start, end)
    back = np.conj(along)
    cubed = back * back * back
    mean, slope = 0.5 * (at_start + at_end), 0.5 * (at_end - at_start)
    for i in range(points.size):
        phi, psi = complex(0.0, 0.0), complex(0.0, 0.0)
        for e in range(start.size):
            eta = _local(points[i], middle[e], to_local[e])
            size = eta.real * eta.real + eta.imag * eta.imag
            log, first = _lambda_terms(eta, size)
            weighted = mean[e] * log + slope[e] * first
            phi -= back[e] * weighted
            mirrored = complex(mean[e].real, -mean[e].imag) * log + complex(slope[e].real, -slope[e].imag) * first
            psi += kappa * back[e] * mirrored + cubed[e] * weighted
            if eta.imag != 0.0:
                square = eta * eta - 1.0
                second = 2.0 * _reciprocal(square, square.real * square.real + square.imag * square.imag)
                steep = mean[e] * second + slope[e] * (eta * second - log)
                psi += 2.0 * eta.imag * cubed[e] * complex(steep.imag, -steep.real)
        total, deviator = 4.0 * c * phi.real, 2.0 * c * psi
        out[i, 0] = 0.5 * (total - deviator.real)
        out[i, 1] = 0.5 * (total + deviator.real)
        out[i, 2] = 0.5 * deviator.imag
    return out


def components(total: np.ndarray, deviator: np.ndarray) -> np.ndarray:
    """Stress (3, ...) xx, yy, xy of sxx + syy and the complex syy - sxx + 2 i sxy."""
    return np.array([(total - deviator.real) / 2, (total + deviator.real) / 2, deviator.imag / 2])


def point_force_displacement(points: np.ndarray, at: complex, force: complex, kappa: float) -> np.ndarray:
    """2 G u (m,) complex [N/m] at complex points of a point force [N/m] in the infinite plane, up to a constant."""
    away = points - at
    c = 1 / (2 * np.pi * (1 + kappa))
    return -2 * c * kappa * force * np.log(np.abs(away)) + c * np.conj(force) * away / np.conj(away)


def point_force_resultant(begin: np.ndarray, end: np.ndarray, at: complex, force: complex, kappa: float) -> np.ndarray:
    """Resultant [N/m] (h,) of the traction over straight paths, outward normal on the right, of a point force [N/m]."""
    a, b = begin - at, end - at
    c = 1 / (2 * np.pi * (1 + kappa))
    ratio = b / a
    change = c * force * ((kappa - 1) * np.log(np.abs(ratio)) - 1j * (kappa + 1) * np.angle(ratio))
    return -1j * (change - c * np.conj(force) * (b / np.conj(b) - a / np.conj(a)))


def point_force_stress(points: np.ndarray, at: complex, force: complex, kappa: float) -> np.ndarray:
    """Stress (m, 3) xx, yy, xy [Pa] of a point force [N/m] in the infinite plane."""
    inverse = 1 / (points - at)
    c = 1 / (2 * np.pi * (1 + kappa))
    total = -4 * c * (force * inverse).real
    deviator = 2 * c * (force * inverse**2 * np.conj(points - at) + kappa * np.conj(force) * inverse)
    return components(total, deviator).T
