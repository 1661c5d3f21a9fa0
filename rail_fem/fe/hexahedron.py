"""The element kernel: 8-node hexahedron, one point, finite strain, J2 plasticity and hourglass control in one pass.

Kinematics in the modes of the trilinear map (rail_fem.fe.trilinear); stress by rail_fem.fe.finite_strain: half of the
increment turns with the old stress, without which the update is only first order where a body strains and turns at
once; then radial return (rail_fem.fe.plasticity). Forces are taken on the end-of-step configuration, so linear and
angular momentum are kept to round-off.

`elastic_trial` and `internal_force` run the mathematics of one element over the lanes of a block (rail_fem.fe.lanes).
What may branch (plastic flow) stands between them.
"""

from __future__ import annotations

import math

import numpy as np

from rail_fem.fe.finite_strain import add_elastic, rotate_stress, step_rotation, to_mid_step, von_mises
from rail_fem.fe.lanes import compiled, gather, gather_one, inlined, load, part, scatter, store
from rail_fem.fe.plasticity import EXCESS, return_isotropic, return_kinematic
from rail_fem.fe.prefetch import INDICES, NUMBERS, fetch
from rail_fem.fe.state import HOURGLASS, KINEMATIC, LANES, N_STATE, YIELD
from rail_fem.fe.trilinear import (
    combine,
    dot,
    field_gradient,
    mean_gradient,
    store_nodal,
    sum_of_squares,
    times,
    vector_modes,
)

_W = LANES
_QUARTER = N_STATE * _W // 4  # of a block's state: the next block's is fetched in four parts, as this one's is computed
N_SCRATCH = 35  # rows of scratch data that `elastic_trial` leaves of a block, see there


@part
def elastic_trial(nodal, dt, material, state, scratch):
    """Everything of a block up to the elastic trial stress, and what the force needs of it.

    nodal : (48*W,) coordinates and velocities;  state : (N_STATE*W,), trial stress and hourglass forces are written
    scratch : (N_SCRATCH*W,) b (18), hourglass coordinates g1..g4 (12), volume, viscous pressure, hourglass work,
        viscous work,
            von Mises stress minus yield stress
    """
    lame, shear, density, speed = material[0], material[1], material[2], material[3]
    linear, quadratic, hourglass, least = material[4], material[5], material[6], material[8]
    for e in range(_W):
        x, v = vector_modes(nodal, e), vector_modes(nodal, 24 * _W + e)
        b, volume = mean_gradient(x)
        end = field_gradient(v, b, volume)
        l = to_mid_step(end, dt)
        r = step_rotation(l, dt)
        old = load(state, 0, 0, e) + load(state, 0, 3, e)
        # half the increment turns with the old stress: second order in dt
        half = add_elastic(old, l, 0.5 * dt, lame, shear)
        stress = add_elastic(rotate_stress(r, half), l, 0.5 * dt, lame, shear)
        store(state, 0, 0, e, stress[:3])
        store(state, 0, 3, e, stress[3:])
        scratch[EXCESS * _W + e] = von_mises(stress) - state[YIELD * _W + e]
        square = 8.0 * sum_of_squares(b)
        length = max(math.sqrt(1.5 / square) * volume, least)
        rate = l[0][0] + l[1][1] + l[2][2]
        compression_rate = min(rate, 0.0)
        viscous = (
            density
            * length
            * (linear * speed * rate - quadratic * quadratic * length * compression_rate * compression_rate)
        )
        k = hourglass * square / volume * dt
        q1, w1 = hourglass_step(load(state, 0, HOURGLASS, e), r, end, x[3], v[3], k)
        q2, w2 = hourglass_step(load(state, 0, HOURGLASS + 3, e), r, end, x[4], v[4], k)
        q3, w3 = hourglass_step(load(state, 0, HOURGLASS + 6, e), r, end, x[5], v[5], k)
        q4, w4 = hourglass_step(load(state, 0, HOURGLASS + 9, e), r, end, x[6], v[6], k)
        store(state, 0, HOURGLASS, e, q1)
        store(state, 0, HOURGLASS + 3, e, q2)
        store(state, 0, HOURGLASS + 6, e, q3)
        store(state, 0, HOURGLASS + 9, e, q4)
        store(scratch, 0, 0, e, b[0])
        store(scratch, 0, 3, e, b[1])
        store(scratch, 0, 6, e, b[2])
        store(scratch, 0, 9, e, b[3])
        store(scratch, 0, 12, e, b[4])
        store(scratch, 0, 15, e, b[5])
        store(scratch, 0, 18, e, x[3])
        store(scratch, 0, 21, e, x[4])
        store(scratch, 0, 24, e, x[5])
        store(scratch, 0, 27, e, x[6])
        scratch[30 * _W + e] = volume
        scratch[31 * _W + e] = viscous
        scratch[32 * _W + e] = 8.0 * dt * (w1 + w2 + w3 + w4)
        scratch[33 * _W + e] = viscous * rate * volume * dt


@inlined
def hourglass_step(old, r, end, g, gv, k):
    """One mode: q = g(v) - G g(x), x and G on the end configuration, so an affine motion of any size makes none; Q
    turns with the element and grows by k q. Returns Q and its mean power (without the factor 8)."""
    lg, turned = times(end, g), times(r, old)
    q = (gv[0] - lg[0], gv[1] - lg[1], gv[2] - lg[2])
    new = combine(1.0, turned, k, q)
    return new, 0.5 * (dot(turned, q) + dot(new, q))


@part
def internal_force(state, scratch, f):
    """Nodal internal forces of a block -> f (24*W,): P b_I + hourglass, P = stress + viscous pressure - 8/V sum of Q
    (x) g."""
    for e in range(_W):
        t, u = load(state, 0, 0, e), load(state, 0, 3, e)
        q1, q2 = load(state, 0, HOURGLASS, e), load(state, 0, HOURGLASS + 3, e)
        q3, q4 = load(state, 0, HOURGLASS + 6, e), load(state, 0, HOURGLASS + 9, e)
        b1, b2, b3 = load(scratch, 0, 0, e), load(scratch, 0, 3, e), load(scratch, 0, 6, e)
        c1, c2, c3 = load(scratch, 0, 9, e), load(scratch, 0, 12, e), load(scratch, 0, 15, e)
        g1, g2, g3, g4 = (
            load(scratch, 0, 18, e),
            load(scratch, 0, 21, e),
            load(scratch, 0, 24, e),
            load(scratch, 0, 27, e),
        )
        k, p = 8.0 / scratch[30 * _W + e], scratch[31 * _W + e]
        rows = ((t[0] + p, u[2], u[1]), (u[2], t[1] + p, u[0]), (u[1], u[0], t[2] + p))
        for i in range(3):
            q = (q1[i], q2[i], q3[i], q4[i])
            row = (
                rows[i][0] - k * (q[0] * g1[0] + q[1] * g2[0] + q[2] * g3[0] + q[3] * g4[0]),
                rows[i][1] - k * (q[0] * g1[1] + q[1] * g2[1] + q[2] * g3[1] + q[3] * g4[1]),
                rows[i][2] - k * (q[0] * g1[2] + q[1] * g2[2] + q[2] * g3[2] + q[3] * g4[2]),
            )
            fx, fy, fz = dot(row, b1), dot(row, b2), dot(row, b3)
            h1, h2, h3 = dot(row, c1) + q[0], dot(row, c2) + q[1], dot(row, c3) + q[2]
            store_nodal(f, i, e, (fx, fy, fz), (h1, h2, h3, q[3]))


@part
def turn_back_stress(nodal, dt, back):
    """Turn the back stress (6*W,) of a block with the step's rotation, that of `elastic_trial`."""
    for e in range(_W):
        b, volume = mean_gradient(vector_modes(nodal, e))
        r = step_rotation(to_mid_step(field_gradient(vector_modes(nodal, 24 * _W + e), b, volume), dt), dt)
        turned = rotate_stress(r, load(back, 0, 0, e) + load(back, 0, 3, e))
        store(back, 0, 0, e, turned[:3])
        store(back, 0, 3, e, turned[3:])


@compiled
def update_elements(
    x, v, dt, nodes, filled, material_of, materials, curve_start, curve_strain, curve_stress, state, back, force, work
):
    """One step of every block: stresses from v on the geometry x, minus the internal force added to `force`.

    Parameters
    ----------
    x, v      : (3*n,)  coordinates at the end of the step [m], velocities over it [m/s]
    nodes     : (n_blocks*8*LANES,) block, node, lane; uint32, because a signed index costs a test at every access
    filled    : (n_blocks,) real lanes of each block
    material_of : (n_blocks,) row of `materials` (n_materials, N_MATERIAL);
    curve_start (n_materials+1,) slices the yield curves
    state     : (n_blocks*N_STATE*LANES,) changed in place
    back      : (n_blocks*k*6*LANES,) back stresses, the first of each block changed in place; empty when no material
        has any
    force     : (3*n,)  [N], changed in place
    work      : (3*n_blocks,) [J], plastic, hourglass and viscous work of the step are added to each block's

    Returns the smallest element volume [m3]: not positive, or not a number, where an element has turned inside out.
    Rank-local. Allocates only its block buffers. Error: second order in dt (tests/fe/test_hexahedron.py).
    """
    nodal, scratch, return_factor = np.empty(48 * _W), np.empty(N_SCRATCH * _W), np.empty(_W)
    smallest = np.inf
    for block in range(filled.size):
        start, s, count, row = block * 8 * _W, block * N_STATE * _W, filled[block], material_of[block]
        ahead = s + N_STATE * _W
        fetch(nodes, start + 8 * _W, 8 * _W, INDICES)
        gather(x, v, nodes, start, nodal)
        fetch(state, ahead, _QUARTER, NUMBERS)
        own = state[s : s + N_STATE * _W]
        c0, c1 = curve_start[row], curve_start[row + 1]
        if materials[row, KINEMATIC] > 0.0:
            first = block * (back.size // filled.size)  # a block of another material may hold more of them
            centre = back[first : first + 6 * _W]
            for k in range(6 * _W):
                own[k] -= centre[k]
            turn_back_stress(nodal, dt, centre)
            elastic_trial(nodal, dt, materials[row], own, scratch)
            fetch(state, ahead + _QUARTER, _QUARTER, NUMBERS)
            return_kinematic(
                own,
                centre,
                scratch,
                count,
                materials[row, 1],
                curve_strain[c0:c1],
                curve_stress[c0:c1],
                return_factor,
                N_STATE,
            )
            for k in range(6 * _W):
                own[k] += centre[k]
        else:
            elastic_trial(nodal, dt, materials[row], own, scratch)
            fetch(state, ahead + _QUARTER, _QUARTER, NUMBERS)
            return_isotropic(
                own, scratch, count, materials[row, 1], curve_strain[c0:c1], curve_stress[c0:c1], return_factor, N_STATE
            )
        fetch(state, ahead + 2 * _QUARTER, _QUARTER, NUMBERS)
        for e in range(count):
            work[3 * block] += scratch[EXCESS * _W + e] * scratch[30 * _W + e]
            work[3 * block + 1] += scratch[32 * _W + e]
            work[3 * block + 2] += scratch[33 * _W + e]
            if not scratch[30 * _W + e] >= smallest:
                smallest = scratch[30 * _W + e]
        internal_force(own, scratch, nodal)
        fetch(state, ahead + 3 * _QUARTER, _QUARTER, NUMBERS)
        scatter(nodal, nodes, start, count, force)
    return smallest


@compiled
def volumes(x, cells):
    """Exact volumes (m,) [m3] of trilinear hexahedra: coordinates x (3*n,), cells (m, 8) in VTK order."""
    nodal, out = np.empty(24 * _W), np.empty(len(cells))
    for first in range(0, len(cells), _W):
        for a in range(8):
            for e in range(_W):
                n, k = 3 * cells[min(first + e, len(cells) - 1), a], 3 * a * _W + e
                nodal[k], nodal[k + _W], nodal[k + 2 * _W] = x[n], x[n + 1], x[n + 2]
        for e in range(min(_W, len(cells) - first)):
            b, volume = mean_gradient(vector_modes(nodal, e))
            out[first + e] = volume
    return out


@compiled
def stored_energy(x, nodes, filled, material_of, materials, state):
    """Elastic energy [J] of the stresses in `state` on the geometry x."""
    nodal, energy, total = np.empty(24 * _W), np.empty(_W), 0.0
    for block in range(filled.size):
        start, row = block * 8 * _W, material_of[block]
        lame, shear = materials[row, 0], materials[row, 1]
        own = state[block * N_STATE * _W : (block + 1) * N_STATE * _W]
        gather_one(x, nodes, start, nodal)
        for e in range(_W):
            b, volume = mean_gradient(vector_modes(nodal, e))
            energy[e] = volume * energy_density(load(own, 0, 0, e), load(own, 0, 3, e), lame, shear)
        for e in range(filled[block]):
            total += energy[e]
    return total


@inlined
def energy_density(t, u, lame, shear):
    """Elastic energy of a stress, normal components t and shears u, per volume [J/m3]."""
    trace = t[0] + t[1] + t[2]
    squares = dot(t, t) + 2.0 * dot(u, u)
    return (squares - lame / (3.0 * lame + 2.0 * shear) * trace * trace) / (4.0 * shear)
