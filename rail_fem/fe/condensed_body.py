"""What an elastic body is to the nodes on its boundary: few displacement functions, and modes behind them. Made by
rail_fem.static_fe; here it is by itself, so that what is kept of it outlives edits of the time loop.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

RIGID = 6  # functions that are motions of a rigid body, the first ones


def terms_at(powers: np.ndarray, length: float, positions: np.ndarray) -> np.ndarray:
    """Terms (n, k) of powers (k, 3) of positions (n, 3) over a length [m]."""
    return np.prod((positions[:, None] / length) ** powers, axis=2)


@dataclass(frozen=True)
class Condensed:
    """An elastic body behind an interface, relative to what holds it.

    powers (k, 3), length [m], functions (k, 3, f) : displacement functions of the interface, component c of function j
        at position r from the body's origin the sum over k of functions[k, c, j] prod((r / length) ** powers[k])
    stiffness, mass (m, m) : of m coordinates, the first f those of the functions [N/m, kg]
    momentum (3, m) : per rate of each [kg];  weight : mass of the body [kg]
    """

    powers: np.ndarray
    length: float
    functions: np.ndarray
    stiffness: np.ndarray
    mass: np.ndarray
    momentum: np.ndarray
    weight: float

    def at(self, positions: np.ndarray) -> np.ndarray:
        """Functions (3 n, f) at positions (n, 3) from the origin [m]."""
        terms = terms_at(self.powers, self.length, positions)
        return np.einsum("nk,kcf->ncf", terms, self.functions).reshape(3 * len(positions), -1)

    def for_relaxation(self, frequency: float) -> Condensed:
        """The same body, whose coordinates all have a frequency [rad/s] and no share in the rigid motion's momentum."""
        return replace(self, mass=self.stiffness / frequency**2, momentum=0.0 * self.momentum, weight=0.0)
