"""Compiled parts of a beam in the time step of the light models: symmetric bands, and the beam's shape between nodes.

A symmetric matrix of half-bandwidth 4 is stored as (n, 5): row j holds entries (j, j), (j + 1, j), ... below the
diagonal. Heights are up, rotations are dw/dx less the shear angle.
"""

from typing import NamedTuple

import numpy as np

from kernel_cache import njit

_part = njit(forceinline=True)


class BeamBand(NamedTuple):
    """What a step takes of a beam of k nodes and n degrees of freedom.

    mass, damping, stiffness : (n, 5);  factor : (n, 5) Cholesky factor of 2 / step mass + damping + step / 2
        stiffness, its diagonal inverted
    x : (k,) nodes [m];  first : (k,) degree of freedom of a node's height, that of its rotation follows
    shear : (k - 1,) ratio 12 EI / (shear stiffness length^2) of each element, 0 without shear
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    factor: np.ndarray
    x: np.ndarray
    first: np.ndarray
    shear: np.ndarray


@njit(cache=True)
def band_times(band, u):
    """(n,) product of a banded symmetric matrix and a vector."""
    out = np.zeros(len(u))
    add_times(band, u, 1.0, out)
    return out


@_part
def add_times(band, u, factor, out):
    """out (n,) += factor * band . u; the loop of fixed width is four times as fast as one of variable width."""
    n = len(u)
    for j in range(n - 4):
        x = factor * u[j]
        out[j] += band[j, 0] * x + factor * (
            band[j, 1] * u[j + 1] + band[j, 2] * u[j + 2] + band[j, 3] * u[j + 3] + band[j, 4] * u[j + 4]
        )
        out[j + 1] += band[j, 1] * x
        out[j + 2] += band[j, 2] * x
        out[j + 3] += band[j, 3] * x
        out[j + 4] += band[j, 4] * x
    for j in range(n - 4, n):
        out[j] += factor * band[j, 0] * u[j]
        for d in range(1, n - j):
            out[j + d] += factor * band[j, d] * u[j]
            out[j] += factor * band[j, d] * u[j + d]


@njit(cache=True)
def band_solve(factor, b):
    """(n,) solution for a right side b, by the factor of a BeamBand."""
    u = b.copy()
    solve_in_place(factor, u)
    return u


@_part
def solve_in_place(factor, u):
    """The solution for the right side u (n,) in its place."""
    n = len(u)
    for j in range(n - 4):
        x = factor[j, 0] * u[j]
        u[j] = x
        u[j + 1] -= factor[j, 1] * x
        u[j + 2] -= factor[j, 2] * x
        u[j + 3] -= factor[j, 3] * x
        u[j + 4] -= factor[j, 4] * x
    for j in range(n - 4, n):
        u[j] *= factor[j, 0]
        for d in range(1, n - j):
            u[j + d] -= factor[j, d] * u[j]
    for j in range(n - 1, n - 5, -1):
        for d in range(1, n - j):
            u[j] -= factor[j, d] * u[j + d]
        u[j] *= factor[j, 0]
    for j in range(n - 5, -1, -1):
        rest = u[j] - factor[j, 4] * u[j + 4] - factor[j, 3] * u[j + 3] - factor[j, 2] * u[j + 2]
        u[j] = factor[j, 0] * (rest - factor[j, 1] * u[j + 1])


@njit(cache=True)
def element_shape(t, length, shear):
    """Weights (4,) of height and rotation at both ends for the height at the share t of an element.

    Those of a Timoshenko beam that no load acts on between its ends; Hermite's cubics without shear. Source:
    from memory; held against a cantilever and a simply supported beam (tests/rail_fem/test_track_beam.py).
    """
    out = np.empty(4)
    scale = 1.0 / (1.0 + shear)
    out[2] = scale * t * (shear + t * (3.0 - 2.0 * t))
    out[0] = 1.0 - out[2]
    out[1] = scale * length * t * (1.0 + shear / 2 - t * (2.0 + shear / 2 - t))
    out[3] = scale * length * t * (-shear / 2 - t * (1.0 - shear / 2 - t))
    return out


@njit(cache=True)
def shape_at(x, beam):
    """Element under x [m], and the weights (4,) of its ends for the height there."""
    i = min(max(np.searchsorted(beam.x, x, side="right") - 1, 0), len(beam.x) - 2)
    length = beam.x[i + 1] - beam.x[i]
    return i, element_shape((x - beam.x[i]) / length, length, beam.shear[i])


@njit(cache=True)
def height_under(u, x, beam):
    """Height [m] of a beam with degrees of freedom u (n,) at x."""
    i, weights = shape_at(x, beam)
    a, b = beam.first[i], beam.first[i + 1]
    return weights[0] * u[a] + weights[1] * u[a + 1] + weights[2] * u[b] + weights[3] * u[b + 1]


@njit(cache=True)
def heights_under(u, x, beam):
    """(m,) of height_under for u (m, n) and x (m,)."""
    out = np.empty(len(x))
    for i in range(len(x)):
        out[i] = height_under(u[i], x[i], beam)
    return out


@njit(cache=True)
def load_at(x, beam):
    """(n,) forces and moments of the nodes that a force of 1 N up at x is worth."""
    out = np.zeros(len(beam.mass))
    i, weights = shape_at(x, beam)
    a, b = beam.first[i], beam.first[i + 1]
    out[a], out[a + 1] = weights[0], weights[1]
    out[b], out[b + 1] = weights[2], weights[3]
    return out


@njit(cache=True)
def leap(u, w, damped, change, push, x, ahead, step, beam):
    """One step of a beam under a force `push` up at x [N]; work of that force, and what was lost in dampers [J]; height
    after it at `ahead` [m].

    u : (n,) degrees of freedom at the step's start;  w : (n,) their rates half a step before;  damped : (n,) damping
        . w;  all changed in place;  change : (n,) scratch
    Newmark's average acceleration with rates at half steps: the energy of w and of u half a step back changes by just
    work - lost (tests/rail_fem/test_track_beam.py). Stable at any step. Source: Hughes, The Finite Element Method
    (2000), section 9.1 (from memory, not verified).
    """
    n = len(u)
    i, weights = shape_at(x, beam)
    at = beam.first[i], beam.first[i] + 1, beam.first[i + 1], beam.first[i + 1] + 1
    for j in range(n):
        change[j] = -damped[j]
    for k in range(4):
        change[at[k]] += push * weights[k]
    add_times(beam.stiffness, u, -1.0, change)
    solve_in_place(beam.factor, change)  # half of what the rates change by
    lost = 0.0
    for j in range(n):
        lost += damped[j] * (w[j] + change[j])
        w[j] += 2.0 * change[j]
        u[j] += step * w[j]
        damped[j] = 0.0
    add_times(beam.damping, w, 1.0, damped)
    for j in range(n):
        lost += damped[j] * (w[j] - change[j])
    rate = 0.0
    for k in range(4):
        rate += weights[k] * (w[at[k]] - change[at[k]])
    return step * push * rate, 0.5 * step * lost, height_under(u, ahead, beam)
