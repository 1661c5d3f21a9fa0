"""Compiled parts of a beam in the time step of the light models: symmetric bands, and the beam's shape between nodes.

A symmetric matrix of half-bandwidth b is stored as (n, b + 1): row j holds entries (j, j), (j + 1, j), ... below the
diagonal. Heights are up, rotations are dw/dx less the shear angle.
"""

from typing import NamedTuple

import numpy as np

from kernel_cache import njit


class BeamBand(NamedTuple):
    """What a step takes of a beam of k nodes and n degrees of freedom.

    mass, damping, stiffness : (n, b + 1);  factor : (n, b + 1) Cholesky factor of 2 / step mass + damping + step / 2
        stiffness
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
    n, width = band.shape
    out = np.zeros(n)
    for j in range(n):
        out[j] += band[j, 0] * u[j]
        for d in range(1, min(width, n - j)):
            out[j + d] += band[j, d] * u[j]
            out[j] += band[j, d] * u[j + d]
    return out


@njit(cache=True)
def band_solve(factor, b):
    """(n,) solution for a right side b, by the Cholesky factor."""
    n, width = factor.shape
    u = b.copy()
    for j in range(n):
        u[j] /= factor[j, 0]
        for d in range(1, min(width, n - j)):
            u[j + d] -= factor[j, d] * u[j]
    for j in range(n - 1, -1, -1):
        for d in range(1, min(width, n - j)):
            u[j] -= factor[j, d] * u[j + d]
        u[j] /= factor[j, 0]
    return u


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
