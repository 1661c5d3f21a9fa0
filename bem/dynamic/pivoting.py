"""Unilateral contact in one step: which nodes touch, and with what pressure; with friction, which of them slide.

    G = G_free + W p,    p >= 0,  G >= 0,  p G = 0          W symmetric and positive: one solution exists

Block principal pivoting of bem.plane.coulomb; with friction the slip of the step decides.
"""

from __future__ import annotations

import numpy as np

from bem.plane.coulomb import ContactState, ContactSystem, Control, ConvergenceError, refuse_bad_friction, solve_step


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


class NormalContact:
    """Pressures for one W (n, n) and many G_free."""

    def __init__(self, matrix: np.ndarray) -> None:
        zero = np.zeros_like(matrix)
        self._both = FrictionalContact(np.block([[matrix, zero], [zero, zero]]), 0.0)

    def solve(self, free: np.ndarray) -> np.ndarray:
        """Pressures (n,) for the weighted gaps G_free (n,) without any; begins with the nodes that touched last.

        Raises ConvergenceError when no consistent set is found: W is then not positive.
        """
        return self._both.solve(free, np.zeros_like(free)).pressure
