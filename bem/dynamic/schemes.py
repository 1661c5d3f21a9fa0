"""Schemes in time for inertia and elastic force, one form for all.

    u1 = u0 + h v0 + h^2 (before_u a0 + after_u a1),    v1 = v0 + h (before_v a0 + after_v a1)
    M [(1 - alpha_m) a1 + alpha_m a0] = F - [(1 - alpha_f) phi1 + alpha_f phi0]        phi: elastic force, F: applied

Sources: backward Euler as in the thesis, eq. 6-3 and 6-4; Newmark (1959); generalised alpha: Chung and Hulbert, J.
Appl. Mech. 60 (1993) 371 (from memory; its limits are tests: alpha = 1/2 and no dissipation at radius 1).
"""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from bem.checks import refuse_unless_finite

Motion = TypeVar("Motion", float, np.ndarray)


@dataclass(frozen=True)
class Scheme:
    """Weights of the accelerations before and after a step in displacement and velocity, and of the equilibrium."""

    name: str
    before_u: float
    after_u: float
    before_v: float
    after_v: float
    alpha_m: float = 0.0
    alpha_f: float = 0.0

    def flexibility(self, step: float) -> float:
        """Displacement at a step's end per force over mass there [s^2]."""
        return step**2 * self.after_u * (1 - self.alpha_f) / (1 - self.alpha_m)

    def moved(
        self, step: float, mass: Motion, u: Motion, v: Motion, a: Motion, force: Motion, after: Motion
    ) -> tuple[Motion, Motion, Motion]:
        """Displacement, velocity and acceleration of a mass after a step; force, after : all that acts on it at the
        step's beginning and at its end."""
        new = (((1 - self.alpha_f) * after + self.alpha_f * force) / mass - self.alpha_m * a) / (1 - self.alpha_m)
        there = u + step * v + step**2 * (self.before_u * a + self.after_u * new)
        return there, v + step * (self.before_v * a + self.after_v * new), new


BACKWARD_EULER = Scheme("backward Euler", 0.0, 1.0, 0.0, 1.0)
TRAPEZOIDAL = Scheme("trapezoidal", 0.25, 0.25, 0.5, 0.5)


def generalised_alpha(radius: float) -> Scheme:
    """Second order, with the amplification `radius` in [0, 1] of the fastest waves in each step."""
    refuse_unless_finite(ValueError, radius=radius)
    if not 0 <= radius <= 1:
        raise ValueError(f"radius = {radius!r}: the amplification of the fastest waves lies in [0, 1]")
    alpha_m, alpha_f = (2 * radius - 1) / (radius + 1), radius / (radius + 1)
    gamma, beta = 0.5 - alpha_m + alpha_f, 0.25 * (1 - alpha_m + alpha_f) ** 2
    return Scheme(f"generalised alpha, radius {radius:g}", 0.5 - beta, beta, 1 - gamma, gamma, alpha_m, alpha_f)
