"""Flash temperature of a sliding patch: heat into two half-spaces that pass under it, each taking half.

The patch moves so fast that heat does not spread along it (Peclet number v a / (2 kappa) far above 1): every strip is a
one-dimensional conduction into a half-space under the flux that passes over it,

    T(t) = 1 / sqrt(pi lambda rho c) int_0^t q(t') / sqrt(t - t') dt',

with q half the friction power per area. Flux is constant in each cell, which makes every integral closed.
Source: Carslaw and Jaeger, Conduction of Heat in Solids (1959), 2.9; Ertz and Knothe, Wear 253 (2002) 498
(recalled).
"""

import numpy as np

from rail_fem.damage.wear import Patches, friction_density, refuse_unsolved, to_cells

# sqrt(lambda rho c) of both bodies: 50 W/(m K), 7850 kg/m3, 450 J/(kg K) [J/(m2 K s^0.5)]
EFFUSIVITY = float(np.sqrt(50.0 * 7850.0 * 450.0))


def flash_temperature(patch: Patches, speed: float) -> np.ndarray:
    """(..., nx, ny) rise of the rail's surface temperature at the rear of each cell [K] by this pass alone.

    speed : of rolling [m/s], + towards +x. Error: first order in the cell where the flux changes; exact under even
    flux (tests/damage/test_fatigue.py).
    """
    refuse_unsolved(patch, speed)
    flux = friction_density(patch) * (abs(speed) / 2)
    if speed > 0:  # the leading edge of a patch that moves to +x lies there: it passes a point first
        flux = flux[..., ::-1, :]
    n, duration = patch.grid.nx, patch.grid.dx / abs(speed)
    weight = np.diff(2 * np.sqrt(np.arange(n + 1.0)))  # of a flux that ended k cells ago
    out = np.tril(weight[np.subtract.outer(np.arange(n), np.arange(n))]) @ flux
    out *= to_cells(np.sqrt(duration / np.pi) / EFFUSIVITY)
    return out[..., ::-1, :] if speed > 0 else out
