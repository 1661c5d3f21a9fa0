"""Polach's creep force: a closed formula of one patch without spin, to hold FASTSIM's creep curves against.

    F = 2 mu N / pi (kA e / (1 + (kA e)^2) + arctan(kS e)),   e = G pi a b C s / (4 mu N)

s the creepage, mu the friction at the creepage as if all of the patch slid by it, C Kalker's coefficient in the
direction of s; kA and kS lessen the slope in the area of adhesion and of slip, their mean the first slope.
Source: Polach, Wear 258 (2005) 992 (recalled, not opened). For kA = kS = 1 and small s it is Kalker's linear theory,
for large s friction times load, by which the formula is checked.
"""

import numpy as np

from bem.exact.kalker_table import coefficients
from bem.halfspace.slip_dependent_friction import SlipDependentFriction
from bem.material import Elastic
from bem.patch import ContactInputError


def polach_force(
    creepage: np.ndarray,
    load: float,
    semi_axes: tuple[float, float],
    steel: Elastic,
    friction: float | SlipDependentFriction,
    adhesion: float = 1.0,
    slip: float = 1.0,
) -> np.ndarray:
    """Force (..., 2) [N] on the wheel, along and across, at creepages (..., 2) [1] under a load [N].

    semi_axes : along and across [m];  adhesion, slip : kA and kS. Errors: ContactInputError.
    """
    if not (0 < slip <= adhesion <= 1):
        raise ContactInputError(f"kA {adhesion!r}, kS {slip!r}: give 0 < kS <= kA <= 1")
    if not (np.isfinite(load) and load > 0 and min(semi_axes) > 0):
        raise ContactInputError(f"load {load!r} N on semi-axes {semi_axes} m: give numbers above 0")
    law = friction if isinstance(friction, SlipDependentFriction) else SlipDependentFriction(friction, friction, np.inf)
    along, across = np.moveaxis(np.asarray(creepage, float), -1, 0)
    size = np.hypot(along, across)
    bound = law.at(size) * load
    kalker = coefficients(semi_axes[0] / semi_axes[1], steel.poisson)
    direction = np.divide([along, across], size, out=np.zeros((2, *size.shape)), where=size > 0)
    slope = steel.shear * semi_axes[0] * semi_axes[1] * np.hypot(kalker.c11 * direction[0], kalker.c22 * direction[1])
    index = np.divide(np.pi * slope * size, 4 * bound, out=np.zeros_like(size), where=bound > 0)
    part = adhesion * index / (1 + (adhesion * index) ** 2) + np.arctan(slip * index)
    return -np.moveaxis(2 / np.pi * bound * part * direction, 0, -1)
