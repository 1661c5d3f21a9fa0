"""Both elements of a steel with a law over cycles: several back stresses and an isotropic part (bem.steel).

Kinematics, trial stress and forces are those of the elements by a hardening curve (rail_fem.fe.hexahedron,
hexahedron_full); the return is the function that the law's own point calls (bem.steel.cyclic_law.plastic_return), lane
by lane where a lane flows. Back stresses are state: they turn with the step's rotation as the stress does. A block that
has never flowed has none to turn.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bem.steel.cyclic_law import plastic_return, yield_stress_at
from rail_fem.fe.finite_strain import rotate_stress, step_rotation, to_mid_step
from rail_fem.fe.hexahedron import N_SCRATCH, elastic_trial, internal_force
from rail_fem.fe.hexahedron_full import (
    JACOBIAN,
    MEAN,
    ROTATION,
    VECTORS,
    VISCOUS,
    VOLUME,
    add_point_force,
    nodal_force,
    point_trial,
    whole_element,
)
from rail_fem.fe.lanes import compiled, gather, load, part, scatter, store
from rail_fem.fe.plasticity import EXCESS
from rail_fem.fe.state import HOURGLASS, LANES, N_STATE, N_STATE_FULL, PLASTIC_STRAIN, POINT_STATE, POINTS, YIELD
from rail_fem.fe.trilinear import field_gradient, mean_gradient, vector_modes

_W = LANES


class PointBuffers(NamedTuple):
    """One lane as the law takes it: trial deviator (6,), back stresses (k, 6), flow direction (6,), factors (k,)."""

    trial: np.ndarray
    back: np.ndarray
    direction: np.ndarray
    factor: np.ndarray


@part
def has_flowed(state, count):
    for e in range(count):
        if state[PLASTIC_STRAIN * _W + e] > 0.0:
            return True
    return False


@part
def add_centre(state, back, sign):
    """`sign` times the sum of the back stresses (k*6*W,) added to the stress of a block."""
    for first in range(0, back.size, 6 * _W):
        for j in range(6 * _W):
            state[j] += sign * back[first + j]


@part
def step_rotations(nodal, dt, rotation):
    """Rotation of the step of each lane, that of `elastic_trial` -> rotation (9*W,)."""
    for e in range(_W):
        b, volume = mean_gradient(vector_modes(nodal, e))
        r = step_rotation(to_mid_step(field_gradient(vector_modes(nodal, 24 * _W + e), b, volume), dt), dt)
        store(rotation, 0, 0, e, r[0])
        store(rotation, 0, 3, e, r[1])
        store(rotation, 0, 6, e, r[2])


@part
def turn(back, rotation, row):
    """Turn the back stresses (k*6*W,) of a block by the rotation in the rows from `row`."""
    for first in range(0, back.size, 6 * _W):
        for e in range(_W):
            r = load(rotation, 0, row, e), load(rotation, 0, row + 3, e), load(rotation, 0, row + 6, e)
            turned = rotate_stress(r, load(back, first, 0, e) + load(back, first, 3, e))
            store(back, first, 0, e, turned[:3])
            store(back, first, 3, e, turned[3:])


@part
def return_cyclic(state, back, scratch, count, law, point, rows):
    """Bring the first `count` lanes of a block back to the yield surface; scratch[EXCESS] becomes the plastic work
    density of the step. True where any lane flows.

    state : trial stress less all back stresses;  back : (k*6*W,), both changed in place;  point : PointBuffers;  rows :
        of the state, see rail_fem.fe.plasticity.scale_deviator
    """
    flows = False
    for e in range(_W):
        excess = scratch[EXCESS * _W + e]
        scratch[EXCESS * _W + e] = 0.0
        if not (excess > 0.0 and e < count):
            continue
        size, p = excess + state[YIELD * _W + e], state[PLASTIC_STRAIN * _W + e]
        mean = (state[e] + state[_W + e] + state[2 * _W + e]) / 3.0
        for j in range(6):
            point.trial[j] = state[j * _W + e] - (mean if j < 3 else 0.0)
            for i in range(law.modulus.size):
                point.back[i, j] = back[(6 * i + j) * _W + e]
                point.trial[j] += point.back[i, j]
        dp = plastic_return(law, point.trial, point.back, p, point.direction, point.factor)
        if not dp > 0.0:
            continue
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
        scratch[EXCESS * _W + e] = 1.5 * dp * power
        flows = True
    return flows


@compiled
def update_cyclic_elements(x, v, dt, nodes, filled, material, law, state, back, force, work):
    """One step of blocks of one material with a law over cycles: as `rail_fem.fe.hexahedron.update_elements`.

    material : (N_MATERIAL,) its row;  law : its CyclicLaw;  back : (n_blocks*r*LANES,), r of at least 6 k rows
    """
    k = law.modulus.size
    nodal, scratch, rotation = np.empty(48 * _W), np.empty(N_SCRATCH * _W), np.empty(9 * _W)
    point = PointBuffers(np.empty(6), np.empty((k, 6)), np.empty(6), np.empty(k))
    stride = back.size // max(filled.size, 1)
    smallest = np.inf
    for block in range(filled.size):
        start, s, count = block * 8 * _W, block * N_STATE * _W, filled[block]
        gather(x, v, nodes, start, nodal)
        own, backs = state[s : s + N_STATE * _W], back[block * stride : block * stride + 6 * k * _W]
        moved = has_flowed(own, count)
        if moved:
            add_centre(own, backs, -1.0)
            step_rotations(nodal, dt, rotation)
            turn(backs, rotation, 0)
        elastic_trial(nodal, dt, material, own, scratch)
        if return_cyclic(own, backs, scratch, count, law, point, N_STATE) or moved:
            add_centre(own, backs, 1.0)
        for e in range(count):
            work[3 * block] += scratch[EXCESS * _W + e] * scratch[30 * _W + e]
            work[3 * block + 1] += scratch[32 * _W + e]
            work[3 * block + 2] += scratch[33 * _W + e]
            if not scratch[30 * _W + e] >= smallest:
                smallest = scratch[30 * _W + e]
        internal_force(own, scratch, nodal)
        scatter(nodal, nodes, start, count, force)
    return smallest


@compiled
def update_full_cyclic_elements(x, v, dt, nodes, filled, material, law, state, back, force, work):
    """The same at eight points an element: as `rail_fem.fe.hexahedron_full.update_full_elements`; r of at least 48 k
    rows, point by point."""
    k = law.modulus.size
    nodal, vectors, rates = np.empty(48 * _W), np.empty(VECTORS * _W), np.empty(VECTORS * _W)
    forces, mean, scratch = np.empty(VECTORS * _W), np.empty(MEAN * _W), np.empty(N_SCRATCH * _W)
    point = PointBuffers(np.empty(6), np.empty((k, 6)), np.empty(6), np.empty(k))
    none = np.empty(0)
    stride = back.size // max(filled.size, 1)
    smallest = np.inf
    for block in range(filled.size):
        start, s, count = block * 8 * _W, block * N_STATE_FULL * _W, filled[block]
        gather(x, v, nodes, start, nodal)
        whole_element(nodal, dt, material, vectors, rates, mean)
        forces[:] = 0.0
        for q in range(POINTS):
            own = state[s + q * POINT_STATE * _W : s + (q + 1) * POINT_STATE * _W]
            first = block * stride + q * 6 * k * _W
            backs = back[first : first + 6 * k * _W]
            moved = has_flowed(own, count)
            if moved:
                add_centre(own, backs, -1.0)
            point_trial(vectors, rates, mean, q, dt, material, own, none, False, True, scratch)
            if moved:
                turn(backs, scratch, ROTATION)
            if return_cyclic(own, backs, scratch, count, law, point, POINT_STATE) or moved:
                add_centre(own, backs, 1.0)
            add_point_force(own, scratch, q, mean, forces)
            for e in range(count):
                work[3 * block] += scratch[EXCESS * _W + e] * scratch[JACOBIAN * _W + e]
                if not scratch[JACOBIAN * _W + e] > 0.0:
                    smallest = min(smallest, scratch[JACOBIAN * _W + e])
        for e in range(count):
            work[3 * block + 2] += mean[VISCOUS * _W + e]
            if not mean[VOLUME * _W + e] >= smallest:
                smallest = mean[VOLUME * _W + e]
        nodal_force(forces, mean, nodal)
        scatter(nodal, nodes, start, count, force)
    return smallest
