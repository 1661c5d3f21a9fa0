"""J2 plasticity with a tabulated isotropic hardening curve: the scalar return that the element kernel calls where an element yields."""

import numba

from rail_fem.fe.state import HOURGLASS, LANES, PLASTIC_STRAIN, YIELD

_W = LANES


@numba.njit(forceinline=True, error_model="numpy")
def hardening_step(von_mises, p, shear, strain, stress):
    """Solve yield(p + dp) + 3 G dp = von_mises for dp.

    von_mises : trial von Mises stress [Pa];  p : plastic strain so far;  shear : G [Pa]
    strain, stress : (k,) the hardening curve, piecewise linear, constant beyond its end

    Returns dp and yield(p + dp). Exact on the piecewise linear curve: segment by segment, no iteration.
    """
    last = strain.size - 1
    i = 0
    while i < last and strain[i + 1] <= p:
        i += 1
    while i < last:
        slope = (stress[i + 1] - stress[i]) / (strain[i + 1] - strain[i])
        dp = (von_mises - stress[i] - slope * (p - strain[i])) / (3.0 * shear + slope)
        if p + dp <= strain[i + 1]:
            return dp, stress[i] + slope * (p + dp - strain[i])
        i += 1
    return (von_mises - stress[last]) / (3.0 * shear), stress[last]


@numba.njit(forceinline=True, error_model="numpy")
def radial_return(state, start, excess, shear, curve_strain, curve_stress):
    """Bring the stress of the element whose state begins at `start` back to the yield surface, in place.

    The hourglass forces return by the same factor: they stand for stresses in the element's corners, and left elastic they
    would grow with the plastic strain and stiffen the flow (Taylor's bar spread 4 % less; tests/fe/test_taylor_bar.py).

    excess : von Mises minus yield stress of the trial state, > 0 [Pa]. Returns yield * dp, the plastic work density [J/m3].
    Source: Simo & Hughes, Computational Inelasticity (1998), section 3.3, backward Euler.
    """
    p = state[start + PLASTIC_STRAIN * _W]
    von_mises = excess + state[start + YIELD * _W]
    dp, yield_stress = hardening_step(von_mises, p, shear, curve_strain, curve_stress)
    scale = yield_stress / von_mises
    mean = (state[start] + state[start + _W] + state[start + 2 * _W]) / 3.0
    for k in range(3):
        state[start + k * _W] = mean + scale * (state[start + k * _W] - mean)
        state[start + (3 + k) * _W] *= scale
    for k in range(HOURGLASS, HOURGLASS + 12):
        state[start + k * _W] *= scale
    state[start + PLASTIC_STRAIN * _W] = p + dp
    state[start + YIELD * _W] = yield_stress
    return yield_stress * dp
