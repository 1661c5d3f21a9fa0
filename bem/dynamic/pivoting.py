"""Unilateral contact in one step: which nodes touch, and with what pressure; with friction, which of them slide.

    G = G_free + W p,    p >= 0,  G >= 0,  p G = 0          W symmetric and positive: one solution exists

Block principal pivoting of bem.plane.coulomb; with friction the slip of the step decides.
"""

import numpy as np

from bem.plane.coulomb import ContactSystem, Control, ConvergenceError, refuse_bad_friction, solve_step


class StepContact:
    """Pressures, with friction shears after them, for one W and many steps; friction : Coulomb's coefficient.

    [G; S] = [G_free; S_free] + W [p; q],   p >= 0, G >= 0, p G = 0,   |q| <= mu p,   q against the slip of the step

    matrix : W (2n, 2n); without friction (n, n), of gaps and pressures alone
    """

    def __init__(self, matrix: np.ndarray, friction: float | None = None) -> None:
        if friction is None:
            zero = np.zeros_like(matrix)
            matrix, friction = np.block([[matrix, zero], [zero, zero]]), 0.0
        refuse_bad_friction(friction)
        self._matrix, self._friction, n = (matrix + matrix.T) / 2, friction, len(matrix) // 2
        self._none = np.zeros((2 * n, 3)), np.zeros((3, 2 * n))
        self._last: np.ndarray | None = None

    def solve(self, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Tractions of weighted gaps G_free (n,) and, with friction, slips S_free (n,) of the step without tractions,
        as many; states (n,), 0 without friction. Begins with the states found last. Raises ConvergenceError when no
        consistent states are found: W is then not positive."""
        n = len(self._matrix) // 2
        gap = np.where(np.isfinite(free[:n]), free[:n], np.finfo(float).max ** 0.25)
        if (gap >= 0).all():
            self._last = np.zeros(n, int)
            return np.zeros(len(free)), self._last
        system, control = ContactSystem(gap, self._matrix, *self._none), Control.of()
        before = -free[n:] if len(free) > n else None
        try:
            found = solve_step(system, control, self._friction, before, self._last)
        except ConvergenceError:
            found = solve_step(system, control, self._friction, before)
        self._last = found.state
        return np.r_[found.pressure, found.shear][: len(free)], found.state if len(free) > n else np.zeros(n, int)
