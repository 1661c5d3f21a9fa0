"""Kalker's creepage coefficients and linear theory: rolling without slip on an ellipse, solved exactly.

For small creepages the whole patch sticks: the displacement difference is u = (xi x - phi x y + f(y), eta x + phi x^2/2
+ h(y)) with two free functions of y, and no traction acts at the leading edge, where fresh material enters. Tractions
are a polynomial times 1/sqrt(1 - (x/a)^2 - (y/b)^2); then u is a polynomial of the same degree (Galin), found by
integrating along the chords through a point (Gauss-Chebyshev, exact) and over their directions (trapezoidal rule).
Polynomial identities and the leading edge's condition at degree + 1 points give one square system for the tractions.

    Fx = -G c^2 C11 xi,  Fy = -G c^2 C22 eta - G c^3 C23 phi,  Mz = G c^3 C23 eta - G c^4 C33 phi,  c^2 = a b
Error at degree 10: 3e-4 in C11 and C22, 6e-4 in C23, 1e-3 in C33 (tests/bem/test_kalker.py); a third of that at 14.
Source: Kalker, On the rolling contact of two elastic bodies (1967); Kalker (1990), Appendix E, Table E3, whose rows
are met to 0.8 %, at a/b = 10 to 1.5 % (they were computed with few terms).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev, legendre

from bem.patch import ContactInputError

_MOST_SLENDER = 60.0


class CreepageCoefficients(NamedTuple):
    """C11, C22, C23 (= -C32) and C33 [1] of one ellipse and Poisson's ratio; or of k ellipses, each (k,)."""

    c11: Any
    c22: Any
    c23: Any
    c33: Any


def creepage_coefficients(axis_ratio: float, poisson: float, degree: int = 10) -> CreepageCoefficients:
    """Coefficients by solving the linear problem.

    axis_ratio : a/b, half-length along x over half-width along y, 1/60 to 60
    poisson    : combined Poisson's ratio, 0 to 0.5; degree : of the polynomials
    Cost: 0.1 s at degree 10; bem.exact.kalker_table interpolates in microseconds.
    """
    check_ellipse(axis_ratio, poisson)
    a, b = np.sqrt(axis_ratio), 1 / np.sqrt(axis_ratio)
    system = _stick_system(a, b, poisson, degree)
    x, y, count, none = system.x, system.y, system.basis, np.zeros(system.edge_rows)
    sides = [np.concatenate([along, across, none]) for along, across in ((x, 0 * x), (0 * x, x), (-x * y, x**2 / 2))]
    solution = np.linalg.lstsq(system.matrix, np.array(sides).T, rcond=None)[0]
    along, across = solution[:count], solution[count : 2 * count]
    total, first_x, first_y = _moments(a, b, degree)
    return CreepageCoefficients(
        -float(total @ along[:, 0]),
        -float(total @ across[:, 1]),
        -float(total @ across[:, 2]),
        -float(first_x @ across[:, 2] - first_y @ along[:, 2]),
    )


def check_ellipse(axis_ratio: float, poisson: float) -> None:
    if not (np.isfinite(axis_ratio) and 1 / _MOST_SLENDER <= axis_ratio <= _MOST_SLENDER):
        raise ContactInputError(
            f"axis ratio a/b = {axis_ratio!r}: must lie within 1/{_MOST_SLENDER:g} and {_MOST_SLENDER:g}; "
            "a longer patch is a line contact"
        )
    if not 0 <= poisson <= 0.5:
        raise ContactInputError(f"combined Poisson's ratio {poisson!r}: must lie within 0 and 0.5")


def _basis(x: np.ndarray, y: np.ndarray, degree: int) -> np.ndarray:
    """(..., (degree + 1)(degree + 2)/2) products of Chebyshev polynomials of x and y up to the total degree."""
    i, j = np.array([(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]).T
    return chebyshev.chebvander(x, degree)[..., i] * chebyshev.chebvander(y, degree)[..., j]


def _collocation(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Points in the unit disc, about twice as many as polynomials."""
    rings, spokes = degree // 2 + 2, 2 * degree + 3
    radius = 0.98 * np.cos((2 * np.arange(rings) + 1) * np.pi / (4 * rings))
    angle = 2 * np.pi * (np.arange(spokes) + 0.3) / spokes
    return np.outer(radius, np.cos(angle)).ravel(), np.outer(radius, np.sin(angle)).ravel()


def _displacements(
    a: float, b: float, x: np.ndarray, y: np.ndarray, degree: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Integrals of the basis times 1/sqrt(...) with the kernels 1/r, x^2/r^3, x y/r^3 at points of the unit disc.

    Chords are followed in the coordinates x/a, y/b, in which the patch is the unit disc.
    """
    count = int(6 * degree * max(a / b, b / a) ** 0.5) + 16
    nodes = np.cos((2 * np.arange(degree + 2) + 1) * np.pi / (2 * degree + 4))
    integrals = [0.0, 0.0, 0.0]
    for angle in (np.arange(count) + 0.5) * np.pi / count:
        c, s = np.cos(angle), np.sin(angle)
        middle, half = -(x * c + y * s), np.sqrt(1 - (x * s - y * c) ** 2)
        along = middle[:, None] + half[:, None] * nodes
        chord = _basis(x[:, None] + along * c, y[:, None] + along * s, degree).mean(axis=1) * np.pi
        length = np.hypot(a * c, b * s)
        weight = a * b * np.pi / count / length
        for n, kernel in enumerate((1.0, (a * c / length) ** 2, a * c * b * s / length**2)):
            integrals[n] = integrals[n] + weight * kernel * chord
    first, second, third = integrals
    return first, second, third


class StickSystem(NamedTuple):
    """matrix of [x coefficients, y coefficients, f, h];  x, y : (n,) collocation points [m];  rows of the edge; size of
    the basis"""

    matrix: np.ndarray
    x: np.ndarray
    y: np.ndarray
    edge_rows: int
    basis: int


def _stick_system(a: float, b: float, poisson: float, degree: int) -> StickSystem:
    x, y = _collocation(degree)
    one, xx, xy = _displacements(a, b, x, y, degree)
    scale = 1 / np.pi
    first, second = scale * ((1 - poisson) * one + poisson * xx), scale * (one - poisson * xx)
    mixed = scale * poisson * xy
    free = chebyshev.chebvander(y, degree)
    angle = np.pi * ((np.arange(degree + 1) + 0.5) / (degree + 1) - 0.5)
    edge = _basis(np.cos(angle), np.sin(angle), degree)
    no_free, no_basis, no_edge = np.zeros_like(free), np.zeros_like(edge), np.zeros((len(edge), free.shape[1]))
    matrix = np.block(
        [
            [first, mixed, free, no_free],
            [mixed, second, no_free, free],
            [edge, no_basis, no_edge, no_edge],
            [no_basis, edge, no_edge, no_edge],
        ]
    )
    return StickSystem(matrix, a * x, b * y, 2 * len(edge), edge.shape[1])


def _moments(a: float, b: float, degree: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Integrals of the basis times 1/sqrt(...) over the ellipse, and of x and y times it."""
    nodes, weights = legendre.leggauss(degree + 2)
    height, weights = (nodes + 1) / 2, weights / 2
    angle = 2 * np.pi * np.arange(2 * degree + 4) / (2 * degree + 4)
    radius = np.sqrt(1 - height**2)
    x, y = np.outer(radius, np.cos(angle)), np.outer(radius, np.sin(angle))
    weight = a * b * 2 * np.pi / angle.size * np.repeat(weights[:, None], angle.size, axis=1)
    basis = _basis(x, y, degree)
    return tuple(np.einsum("ij,ijn->n", weight * factor, basis) for factor in (1.0, a * x, b * y))
