"""J2 plasticity with a tabulated hardening curve, isotropic or kinematic, for the lanes of a block.

What differs from lane to lane (has it yielded, which segment of the curve) is a scalar loop that leaves one number a
lane; what that number does to the eighteen stresses of the lane is vector code.

Source: Simo & Hughes, Computational Inelasticity (1998), section 3.3, backward Euler.
"""

from rail_fem.fe.lanes import part
from rail_fem.fe.state import HOURGLASS, LANES, PLASTIC_STRAIN, YIELD

_W = LANES
# row of `scratch`: von Mises minus yield stress of the trial state [Pa]; after the return the plastic work density
# [J/m3]
EXCESS = 34


@part
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


@part
def curve_at(p, strain, stress):
    """Stress of the hardening curve at plastic strain p [Pa]."""
    last = strain.size - 1
    i = 0
    while i < last and strain[i + 1] <= p:
        i += 1
    if i == last:
        return stress[last]
    return stress[i] + (stress[i + 1] - stress[i]) / (strain[i + 1] - strain[i]) * (p - strain[i])


@part
def scale_deviator(state, return_factor, rows):
    """Take the fraction return_factor[e] off the deviator and the hourglass forces of each lane; nothing, to the last
    bit, where it is 0.

    rows : of the state; those from HOURGLASS on, which only the one-point element has, are its hourglass forces

    The hourglass forces stand for stresses in the element's corners: left elastic they would grow with the plastic
    strain and stiffen the flow (Taylor's bar spread 4 % less; tests/fe/test_taylor_bar.py).
    """
    for e in range(_W):
        d = return_factor[e]
        mean = (state[e] + state[_W + e] + state[2 * _W + e]) / 3.0
        state[e] -= d * (state[e] - mean)
        state[_W + e] -= d * (state[_W + e] - mean)
        state[2 * _W + e] -= d * (state[2 * _W + e] - mean)
        for k in range(3, 6):
            state[k * _W + e] -= d * state[k * _W + e]
        for k in range(HOURGLASS, rows):
            state[k * _W + e] -= d * state[k * _W + e]


@part
def return_isotropic(state, scratch, count, shear, curve_strain, curve_stress, return_factor, rows):
    """Bring the first `count` lanes of a block back to the yield surface; scratch[EXCESS] becomes the plastic work
    density of the step.

    state : trial stress, changed in place;  return_factor : (LANES,) buffer;  rows : of the
    state, see `scale_deviator`
    """
    flows = False
    for e in range(_W):
        excess = scratch[EXCESS * _W + e]
        return_factor[e], scratch[EXCESS * _W + e] = 0.0, 0.0
        if excess > 0.0 and e < count:
            p, von_mises = state[PLASTIC_STRAIN * _W + e], excess + state[YIELD * _W + e]
            dp, yield_stress = hardening_step(von_mises, p, shear, curve_strain, curve_stress)
            return_factor[e] = 1.0 - yield_stress / von_mises
            state[PLASTIC_STRAIN * _W + e] = p + dp
            state[YIELD * _W + e] = yield_stress
            scratch[EXCESS * _W + e] = yield_stress * dp
            flows = True
    if flows:
        scale_deviator(state, return_factor, rows)


@part
def return_kinematic(state, back, scratch, count, shear, curve_strain, curve_stress, return_factor, rows):
    """The same for kinematic hardening (Prager): the yield surface keeps its size and moves by what the curve rises.

    state : trial stress minus back stress;  back : (6*LANES,) back stress, both changed in place
    """
    flows = False
    for e in range(_W):
        excess = scratch[EXCESS * _W + e]
        return_factor[e], scratch[EXCESS * _W + e] = 0.0, 0.0
        if excess > 0.0 and e < count:
            p, size = state[PLASTIC_STRAIN * _W + e], state[YIELD * _W + e]
            before = curve_at(p, curve_strain, curve_stress)
            dp, after = hardening_step(excess + before, p, shear, curve_strain, curve_stress)
            return_factor[e] = excess / (excess + size) if excess + size > 0.0 else 0.0
            mean = (state[e] + state[_W + e] + state[2 * _W + e]) / 3.0
            grown, power = (after - before) / (excess + size), 0.0
            for k in range(6):
                deviator = state[k * _W + e] - (mean if k < 3 else 0.0)
                back[k * _W + e] += grown * deviator
                power += (1.0 if k < 3 else 2.0) * back[k * _W + e] * deviator
            state[PLASTIC_STRAIN * _W + e] = p + dp
            scratch[EXCESS * _W + e] = dp * (size + 1.5 * power / (excess + size))
            flows = True
    if flows:
        scale_deviator(state, return_factor, rows)
