"""Unilateral contact in one step: which nodes touch, and with what pressure; with friction, which of them slide.

    G = G_free + W p,    p >= 0,  G >= 0,  p G = 0          W symmetric and positive: one solution exists

Block principal pivoting: all nodes that contradict their state change together; when that makes no progress, the last
one alone (Murty's rule, which ends for every such W). The factors are kept while the same nodes touch. With Coulomb
friction the slip of the step decides (bem.plane.coulomb).
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from bem.plane.coulomb import ContactState, ContactSystem, Control, ConvergenceError, refuse_bad_friction, solve_step

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


class FrictionalContact:
    """Pressures and shears for one W (2n, 2n) and many steps; friction : Coulomb's coefficient.

    [G; S] = [G_free; S_free] + W [p; q],   p >= 0, G >= 0, p G = 0,   |q| <= mu p,   q against the slip of the step
    """

    def __init__(self, matrix: np.ndarray, friction: float) -> None:
        refuse_bad_friction(friction)
        self._matrix, self._friction, n = (matrix + matrix.T) / 2, friction, len(matrix) // 2
        self._none = np.zeros((2 * n, 3)), np.zeros((3, 2 * n)), Control.of()
        self._last: np.ndarray | None = None

    def solve(self, gap: np.ndarray, slip: np.ndarray) -> ContactState:
        """Of weighted gaps G_free (n,) and slips S_free (n,) of the step without tractions; begins with the states
        found last. Raises ConvergenceError when no consistent states are found."""
        gap = np.where(np.isfinite(gap), gap, np.finfo(float).max ** 0.25)
        motion, forces, control = self._none
        if (gap >= 0).all():
            still = np.zeros(len(gap))
            self._last = np.zeros(len(gap), int)
            return ContactState(still, still, gap, slip, self._last, np.zeros(3), 0)
        system = ContactSystem(gap, self._matrix, motion, forces)
        try:
            found = solve_step(system, control, self._friction, -slip, self._last)
        except ConvergenceError:
            found = solve_step(system, control, self._friction, -slip)
        self._last = found.state
        return found
