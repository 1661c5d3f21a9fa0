"""Unilateral contact without friction in one step: which nodes touch, and with what pressure.

    G = G_free + W p,    p >= 0,  G >= 0,  p G = 0          W symmetric and positive: one solution exists

Block principal pivoting: all nodes that contradict their state change together; when that makes no progress, the last
one alone (Murty's rule, which ends for every such W). The factors are kept while the same nodes touch.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from bem.plane.coulomb import ConvergenceError

_PATIENCE = 6  # block changes without fewer contradictions before one node changes at a time


class NormalContact:
    """Pressures for one W (n, n) and many G_free; `factorisations` counts the changes of the set that touches."""

    def __init__(self, matrix: np.ndarray) -> None:
        self._matrix = matrix
        self._touching = np.zeros(len(matrix), bool)
        self._factored: np.ndarray | None = None
        self._factors = None
        self.factorisations = 0

    def _pressures(self, touching: np.ndarray, free: np.ndarray) -> np.ndarray:
        pressure = np.zeros(len(free))
        nodes = np.flatnonzero(touching)
        if not len(nodes):
            return pressure
        if self._factored is None or not np.array_equal(touching, self._factored):
            self._factors = cho_factor(self._matrix[np.ix_(nodes, nodes)], check_finite=False)
            self._factored = touching.copy()
            self.factorisations += 1
        pressure[nodes] = cho_solve(self._factors, -free[nodes], check_finite=False)
        return pressure

    def solve(self, free: np.ndarray) -> np.ndarray:
        """Pressures (n,) for the weighted gaps G_free (n,) without any; begins with the nodes that touched last.

        Raises ConvergenceError when no consistent set is found: W is then not positive.
        """
        if not np.isfinite(free).any() or (free[np.isfinite(free)] > 0).all() and not self._touching.any():
            return np.zeros(len(free))
        free = np.where(np.isfinite(free), free, np.finfo(float).max ** 0.25)
        touching = self._touching.copy()
        fewest, patience = len(free) + 1, _PATIENCE
        for _ in range(60 + 10 * len(free)):
            pressure = self._pressures(touching, free)
            left = free + self._matrix @ pressure
            scale = max(np.abs(pressure).max(), 1e-300)
            wrong = (touching & (pressure < 0)) | (~touching & (left < -1e-12 * scale * np.diag(self._matrix)))
            count = int(wrong.sum())
            if not count:
                self._touching = touching
                return pressure
            if count < fewest:
                fewest, patience = count, _PATIENCE
            else:
                patience -= 1
            if patience <= 0:
                last = np.flatnonzero(wrong)[-1]
                wrong = np.zeros(len(free), bool)
                wrong[last] = True
            touching = touching ^ wrong
        raise ConvergenceError(
            f"{count} of {len(free)} nodes still change between open and touching: the contact's compliance is not"
            " positive; refine the cells or the boundary mesh below the contact, or take a longer step"
        )
