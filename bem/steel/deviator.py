"""Deviators as five numbers whose norm is the tensor's: (xx - yy)/sqrt2, (2 zz - xx - yy)/sqrt6, sqrt2 (yz, xz, xy).

J2 plasticity needs nothing else of stress and plastic strain; the mean stress is found when a result is wanted.
"""

from __future__ import annotations

import numpy as np

_S2, _S6 = np.sqrt(2.0), np.sqrt(6.0)
# (5, 6) from a stress, order VOIGT, and (6, 5) back to the tensor components of a deviator
TO_DEVIATOR = np.array(
    [
        [1 / _S2, -1 / _S2, 0, 0, 0, 0],
        [-1 / _S6, -1 / _S6, 2 / _S6, 0, 0, 0],
        [0, 0, 0, _S2, 0, 0],
        [0, 0, 0, 0, _S2, 0],
        [0, 0, 0, 0, 0, _S2],
    ]
)
FROM_DEVIATOR = TO_DEVIATOR.T.copy()
FROM_DEVIATOR[[3, 4, 5], [2, 3, 4]] = 1 / _S2  # one of the tensor's two shears
MEAN = np.array([1, 1, 1, 0, 0, 0]) / 3  # mean stress of a stress, order VOIGT
ODD_X = np.array([0, 0, 0, 1, 1])  # whether a component changes sign when x is mirrored
ODD_Y = np.array([0, 0, 1, 0, 1])


def stress_of(deviator: np.ndarray, mean: np.ndarray) -> np.ndarray:
    """(..., 6) stress, order VOIGT, of deviators (nz, 5, ...) and mean stress (nz, ...)."""
    stress = np.einsum("vc,kc...->k...v", FROM_DEVIATOR, deviator)
    stress[..., :3] += mean[..., None]
    return stress


def equivalent_stress(deviator: np.ndarray) -> np.ndarray:
    """(nz, ...) von Mises stress of deviators (nz, 5, ...)."""
    return np.sqrt(1.5 * np.einsum("kc...,kc...->k...", deviator, deviator))
