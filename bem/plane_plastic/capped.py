"""The capped return: stress cut down to the yield surface point by point, no equilibrium restored.

The elastic field of each load is taken as it is; where it leaves the yield surface the deviator is returned to it and
the difference counted as plastic strain. So did the thesis (section 6.3.2). The stress does not balance the load; it is
here to be compared with.
"""

from collections.abc import Sequence

import numpy as np

from bem.plane_plastic.section import flat, unflat
from bem.steel.hardening import YieldLaw
from bem.steel.return_map import PlasticState, advanced, radial_return


def capped_return(
    strains: Sequence[np.ndarray], hardening: YieldLaw, shear: float
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """strains : per load 2 G elastic strain (3, m) of points, as deviators [Pa]; shear : modulus G [Pa].

    Returns per load the deviator of stress (3, m) [Pa] and the equivalent plastic strain (m,).
    """
    state, stresses, peeqs = PlasticState.virgin((strains[0].shape[1], 3, 1, 1), hardening.back_stresses), [], []
    for strain in strains:
        trial = strain.ravel() - 2 * shear * flat(state.strain)
        state = advanced(state, radial_return(unflat(trial), state, hardening, shear), hardening)
        stresses.append((strain.ravel() - 2 * shear * flat(state.strain)).reshape(3, -1))
        peeqs.append(state.peeq[:, 0, 0].copy())
    return stresses, peeqs
