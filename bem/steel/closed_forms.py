"""What the cyclic laws do under uniaxial stress, in closed form: a judge of the law's integration.

One back stress, constant yield stress Y: with r = C / gamma and the flow's sign s, d alpha = (C s - gamma alpha) dp,
so alpha = s r + (alpha0 - s r) exp(-gamma dp), integrated once.
"""

import numpy as np


def ratchet_strain(modulus: float, recovery: float, yield_stress: float, low: float, high: float) -> float:
    """Plastic strain that a cycle of stress between `low` and `high` [Pa] leaves, the same in every cycle.

    The loading half takes alpha from a1 = low + Y to a2 = high - Y, the other half back: their plastic strains differ
    by ln((r^2 - a1^2) / (r^2 - a2^2)) / gamma. 0 where the range stays within 2 Y.
    Errors: ValueError where the stress is beyond what the law carries, Y + r.
    """
    bound = modulus / recovery
    if max(abs(low), abs(high)) >= yield_stress + bound:
        raise ValueError(
            f"stress {max(abs(low), abs(high)):g} Pa: the law carries less than {yield_stress + bound:g} Pa"
        )
    if high - low <= 2 * yield_stress:
        return 0.0
    first, last = low + yield_stress, high - yield_stress
    return float(np.log((bound**2 - first**2) / (bound**2 - last**2)) / recovery)
