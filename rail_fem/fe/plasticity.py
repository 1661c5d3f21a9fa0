"""The return laws of an element: J2 plasticity with a tabulated hardening curve, isotropic or kinematic, or with a law
over cycles (bem.steel).

A law is the function of one point (`isotropic`, `kinematic`, the cyclic law's own `plastic_return`) and its loop over
the lanes of a block, chosen by `flow_back`; what the material's row says is taken out once a block (`return_law`): in
the loop over points it cost the full element a tenth of its speed. Laws with back stresses share what is done with
these: taken off the stress before the step and turned with it, put back after it.

What differs from lane to lane (has it yielded, which segment of the curve) is a scalar loop that leaves one number a
lane; what that number does to the eighteen stresses of the lane is vector code.

Source: Simo & Hughes, Computational Inelasticity (1998), section 3.3, backward Euler.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bem.steel.cyclic_law import CyclicLaw, plastic_return, yield_stress_at
from rail_fem.fe.finite_strain import rotate_stress
from rail_fem.fe.lanes import inlined, load, store, thread, uncounted
from rail_fem.fe.state import (
    CYCLIC,
    HARDENING,
    HARDENING_RATE,
    HOURGLASS,
    KINEMATIC,
    LANES,
    LAW,
    PLASTIC_STRAIN,
    SHEAR,
    YIELD,
    YIELD_STRESS,
)

_W = LANES
# row of `scratch`: von Mises minus yield stress of the trial state [Pa]; after the return the plastic work density
# [J/m3]
EXCESS = 34


class MaterialTable(NamedTuple):
    """Steels as the kernels read them: rows (n, N_MATERIAL); all yield curves end to end with their start (n+1,); of
    all back stresses of laws over cycles, end to end with their start (n+1,), the constants (bem.steel.cyclic_law)."""

    rows: np.ndarray
    curve_start: np.ndarray
    curve_strain: np.ndarray
    curve_stress: np.ndarray
    back_start: np.ndarray
    modulus: np.ndarray
    recovery: np.ndarray
    mixing: np.ndarray

    @property
    def back_stresses(self) -> int:
        """The most that a material has."""
        return int(np.diff(self.back_start).max(initial=0))


class PlasticFlow(NamedTuple):
    """Of a point that has flowed: share of the trial deviator that goes, plastic strain, yield stress [Pa], plastic
    work density of the step [J/m3]."""

    share: float
    strain: float
    yield_stress: float
    work: float


class PointBuffers(NamedTuple):
    """One lane as a law over cycles takes it: trial deviator (6,), back stresses (k, 6), flow direction (6,), factors
    (k,); return_factor : (LANES,) of a block."""

    trial: np.ndarray
    back: np.ndarray
    direction: np.ndarray
    factor: np.ndarray
    return_factor: np.ndarray


@uncounted
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


@uncounted
def curve_at(p, strain, stress):
    """Stress of the hardening curve at plastic strain p [Pa]."""
    last = strain.size - 1
    i = 0
    while i < last and strain[i + 1] <= p:
        i += 1
    if i == last:
        return stress[last]
    return stress[i] + (stress[i + 1] - stress[i]) / (strain[i + 1] - strain[i]) * (p - strain[i])


@inlined
def isotropic(excess, p, size, shear, strain, stress):
    """Return of a point whose von Mises stress is `excess` beyond its yield stress `size` [Pa] -> PlasticFlow."""
    von_mises = excess + size
    dp, yield_stress = hardening_step(von_mises, p, shear, strain, stress)
    return PlasticFlow(1.0 - yield_stress / von_mises, p + dp, yield_stress, yield_stress * dp)


@inlined
def kinematic(excess, p, size, relative, back, shear, strain, stress):
    """The same for kinematic hardening (Prager): the yield surface keeps its size and moves by what the curve rises.

    relative : trial stress minus back stress;  back : back stress, both (6,) in the order VOIGT
    Returns PlasticFlow and the back stress after the step.
    """
    von_mises = excess + size
    before = curve_at(p, strain, stress)
    dp, after = hardening_step(excess + before, p, shear, strain, stress)
    mean, grown = (relative[0] + relative[1] + relative[2]) / 3.0, (after - before) / von_mises
    d0, d1, d2 = relative[0] - mean, relative[1] - mean, relative[2] - mean
    d3, d4, d5 = relative[3], relative[4], relative[5]
    b0, b1, b2 = back[0] + grown * d0, back[1] + grown * d1, back[2] + grown * d2
    b3, b4, b5 = back[3] + grown * d3, back[4] + grown * d4, back[5] + grown * d5
    power = b0 * d0 + b1 * d1 + b2 * d2 + 2.0 * b3 * d3 + 2.0 * b4 * d4 + 2.0 * b5 * d5
    share = excess / von_mises if von_mises > 0.0 else 0.0
    return PlasticFlow(share, p + dp, size, dp * (size + 1.5 * power / von_mises)), (b0, b1, b2, b3, b4, b5)


@inlined
def ease(state, e, d, rows):
    """Take the fraction d off the deviator and the hourglass forces of lane e."""
    mean = (state[e] + state[_W + e] + state[2 * _W + e]) / 3.0
    state[e] -= d * (state[e] - mean)
    state[_W + e] -= d * (state[_W + e] - mean)
    state[2 * _W + e] -= d * (state[2 * _W + e] - mean)
    for k in range(3, 6):
        state[k * _W + e] -= d * state[k * _W + e]
    for k in range(HOURGLASS, rows):
        state[k * _W + e] -= d * state[k * _W + e]


@uncounted
def scale_deviator(state, return_factor, rows):
    """Take the fraction return_factor[e] off the deviator and the hourglass forces of each lane; nothing, to the last
    bit, where it is 0.

    rows : of the state; those from HOURGLASS on, which only the one-point element has, are its hourglass forces

    The hourglass forces stand for stresses in the element's corners: left elastic they would grow with the plastic
    strain and stiffen the flow (Taylor's bar spread 4 % less; tests/fe/test_taylor_bar.py).
    """
    for e in range(_W):
        ease(state, e, return_factor[e], rows)


@inlined
def flow_by_curve(state, back, e, excess, curve, moves):
    """The return of lane e, `excess` [Pa] beyond its yield stress -> PlasticFlow: all but what `ease` does with its
    share. Arguments as those of `return_by_curve`."""
    shear, strain, stress = curve
    p, size = state[PLASTIC_STRAIN * _W + e], state[YIELD * _W + e]
    if moves:
        relative, centre = (load(state, 0, 0, e) + load(state, 0, 3, e), load(back, 0, 0, e) + load(back, 0, 3, e))
        flow, after = kinematic(excess, p, size, relative, centre, shear, strain, stress)
        store(back, 0, 0, e, after[:3])
        store(back, 0, 3, e, after[3:])
    else:
        flow = isotropic(excess, p, size, shear, strain, stress)
    state[PLASTIC_STRAIN * _W + e], state[YIELD * _W + e] = flow.strain, flow.yield_stress
    return flow


@uncounted
def return_by_curve(state, back, scratch, count, curve, moves, return_factor, rows):
    """Bring the first `count` lanes of a block back to the yield surface; scratch[EXCESS] becomes the plastic work
    density of the step. True where any lane flows.

    state : trial stress, changed in place; less the back stress (6*LANES,) where the surface `moves` (kinematic)
    curve : shear modulus, strains and stresses of the hardening curve
    return_factor : (LANES,) buffer;  rows : of the state, see `scale_deviator`
    """
    flows = False
    for e in range(_W):
        excess = scratch[EXCESS * _W + e]
        return_factor[e], scratch[EXCESS * _W + e] = 0.0, 0.0
        if excess > 0.0 and e < count:
            flow = flow_by_curve(state, back, e, excess, curve, moves)
            return_factor[e], scratch[EXCESS * _W + e] = flow.share, flow.work
            flows = True
    if flows:
        scale_deviator(state, return_factor, rows)
    return flows


@inlined
def flow_by_cycles(state, back, e, excess, law, point, rows):
    """The return of lane e, `excess` [Pa] beyond its yield stress, by the function that the law's own point calls:
    plastic strain and plastic work density [J/m3] of the step.

    state : trial stress less all back stresses;  back : (k*6*W,), both changed in place
    """
    size, p = excess + state[YIELD * _W + e], state[PLASTIC_STRAIN * _W + e]
    mean = (state[e] + state[_W + e] + state[2 * _W + e]) / 3.0
    for j in range(6):
        point.trial[j] = state[j * _W + e] - (mean if j < 3 else 0.0)
        for i in range(law.modulus.size):
            point.back[i, j] = back[(6 * i + j) * _W + e]
            point.trial[j] += point.back[i, j]
    dp = plastic_return(law, point.trial, point.back, p, point.direction, point.factor)
    if not dp > 0.0:
        return 0.0, 0.0
    power = 0.0
    for j in range(6):
        power += (1.0 if j < 3 else 2.0) * point.trial[j] * point.direction[j]
        relative = point.trial[j] + (mean if j < 3 else 0.0)
        for i in range(law.modulus.size):
            relative -= point.back[i, j]
            back[(6 * i + j) * _W + e] = point.back[i, j]
        state[j * _W + e] = relative
    flowed = 3.0 * law.shear * dp / size  # of the deviator: as much of the hourglass forces
    for j in range(HOURGLASS, rows):
        state[j * _W + e] -= flowed * state[j * _W + e]
    state[PLASTIC_STRAIN * _W + e] = p + dp
    state[YIELD * _W + e] = yield_stress_at(law, p + dp)
    return dp, 1.5 * dp * power


@uncounted
def return_cyclic(state, back, scratch, count, law, point, rows):
    """`return_by_curve` of a law over cycles, lane by lane where a lane flows. Other arguments: `flow_by_cycles`."""
    flows = False
    for e in range(_W):
        excess, work = scratch[EXCESS * _W + e], 0.0
        if excess > 0.0 and e < count:
            dp, work = flow_by_cycles(state, back, e, excess, law, point, rows)
            flows = flows or dp > 0.0
        scratch[EXCESS * _W + e] = work
    return flows


class ReturnLaw(NamedTuple):
    """What a block's material says of its return: LAW of its row; shear modulus [Pa], strains and stresses of its
    hardening curve; its law over cycles."""

    kind: float
    curve: tuple
    cyclic: CyclicLaw


@inlined
def return_law(steels, row):
    """-> ReturnLaw of the materials' row."""
    material = steels.rows[row]
    b0, b1 = steels.back_start[row], steels.back_start[row + 1]
    c0, c1 = steels.curve_start[row], steels.curve_start[row + 1]
    cyclic = CyclicLaw(
        material[SHEAR],
        0.0,
        material[YIELD_STRESS],
        material[HARDENING],
        material[HARDENING_RATE],
        steels.modulus[b0:b1],
        steels.recovery[b0:b1],
        steels.mixing[b0:b1],
    )
    return ReturnLaw(material[LAW], (material[SHEAR], steels.curve_strain[c0:c1], steels.curve_stress[c0:c1]), cyclic)


@uncounted
def flow_back(law, state, back, scratch, count, point, rows):
    """The return of a block by the law of its material; whether any lane flows.

    state : trial stress less the back stresses (k*6*W,);  scratch : see `return_by_curve`;  point : PointBuffers
    """
    if law.kind == CYCLIC:
        return return_cyclic(state, back, scratch, count, law.cyclic, point, rows)
    return return_by_curve(state, back, scratch, count, law.curve, law.kind == KINEMATIC, point.return_factor, rows)


@thread
def flow_alone(law, state, back, e, excess, point, rows):
    """The same of lane e by itself, as a thread of a card has it; its plastic work density [J/m3]. point : None where
    no steel has a law over cycles"""
    if point is not None:
        if law.kind == CYCLIC:
            return flow_by_cycles(state, back, e, excess, law.cyclic, point, rows)[1]
    flow = flow_by_curve(state, back, e, excess, law.curve, law.kind == KINEMATIC)
    ease(state, e, flow.share, rows)
    return flow.work


@inlined
def point_buffers(steels):
    """Room for the return of any of these steels."""
    k = 0
    for row in range(steels.back_start.size - 1):
        k = max(k, steels.back_start[row + 1] - steels.back_start[row])
    return PointBuffers(np.empty(6), np.empty((k, 6)), np.empty(6), np.empty(k), np.empty(_W))


@uncounted
def has_flowed(state, count):
    for e in range(count):
        if state[PLASTIC_STRAIN * _W + e] > 0.0:
            return True
    return False


@uncounted
def add_centre(state, back, sign):
    """`sign` times the sum of the back stresses (k*6*W,) added to the stress of a block."""
    for first in range(0, back.size, 6 * _W):
        for j in range(6 * _W):
            state[j] += sign * back[first + j]


@inlined
def turn_alone(back, first, e, r):
    """Turn the back stress of lane e that starts at `first` by the rotation r."""
    turned = rotate_stress(r, load(back, first, 0, e) + load(back, first, 3, e))
    store(back, first, 0, e, turned[:3])
    store(back, first, 3, e, turned[3:])


@uncounted
def turn(back, rotation, row):
    """Turn the back stresses (k*6*W,) of a block by the rotation in the rows from `row`."""
    for first in range(0, back.size, 6 * _W):
        for e in range(_W):
            r = load(rotation, 0, row, e), load(rotation, 0, row + 3, e), load(rotation, 0, row + 6, e)
            turn_alone(back, first, e, r)
