"""The element kernel: 8-node hexahedron, one point, finite strain, J2 plasticity and hourglass control in one pass.

Kinematics in the modes of the trilinear map (rail_fem.fe.trilinear); stress by rail_fem.fe.finite_strain: half of the
increment turns with the old stress, without which the update is only first order where a body strains and turns at
once; then the return by the law of the material (rail_fem.fe.plasticity). Forces are taken on the end-of-step
configuration, so linear and angular momentum are kept to round-off.

`trial_of` and `modal_force` are the mathematics of one element, for the lanes of a block here and for a thread of a
graphics card (rail_fem.fe.card). What may branch (plastic flow) stands between them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rail_fem.fe.finite_strain import add_elastic, rotate_stress, step_rotation, to_mid_step, von_mises
from rail_fem.fe.lanes import compiled, gather, gather_one, inlined, load, scatter, store
from rail_fem.fe.plasticity import EXCESS, add_centre, flow_back, has_flowed, point_buffers, return_law, turn
from rail_fem.fe.prefetch import INDICES, NUMBERS, fetch
from rail_fem.fe.state import HOURGLASS, LANES, N_STATE, YIELD
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


class ElementConstants(NamedTuple):
    """A material's row as the elements read it: Lame's constants [Pa], density [kg/m3], wave speed [m/s], bulk
    viscosity [1], hourglass stiffness [Pa], least length of the viscosity [m]."""

    lame: float
    shear: float
    density: float
    speed: float
    linear: float
    quadratic: float
    hourglass: float
    least: float


class ElementTrial(NamedTuple):
    """One element up to its elastic trial stress (6,) [Pa], and what its force needs: modal gradient (6 vectors),
    volume, hourglass forces, viscous pressure; hourglass and viscous work of the step [J]."""

    stress: tuple
    gradient: tuple
    volume: float
    q1: tuple
    q2: tuple
    q3: tuple
    q4: tuple
    pressure: float
    hourglass_work: float
    viscous_work: float


@inlined
def constants_of(row):
    return ElementConstants(row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[8])


@inlined
def viscous_pressure(own, square, volume, rate):
    """Of the bulk viscosity [Pa]; square : 8 times the sum of squares of the modal gradient, rate : of dilatation."""
    length = max(math.sqrt(1.5 / square) * volume, own.least)
    closing = min(rate, 0.0)
    return (
        own.density
        * length
        * (own.linear * own.speed * rate - own.quadratic * own.quadratic * length * closing * closing)
    )


@inlined
def trial_of(x, v, dt, own, old, q1, q2, q3, q4):
    """Of one element: modes of its coordinates x at the end of the step and of its velocities v over it,
    ElementConstants, stress (6,) and hourglass forces before the step -> ElementTrial."""
    b, volume = mean_gradient(x)
    end = field_gradient(v, b, volume)
    l = to_mid_step(end, dt)
    r = step_rotation(l, dt)
    # half the increment turns with the old stress: second order in dt
    half = add_elastic(old, l, 0.5 * dt, own.lame, own.shear)
    stress = add_elastic(rotate_stress(r, half), l, 0.5 * dt, own.lame, own.shear)
    square = 8.0 * sum_of_squares(b)
    rate = l[0][0] + l[1][1] + l[2][2]
    viscous = viscous_pressure(own, square, volume, rate)
    k = own.hourglass * square / volume * dt
    q1, w1 = hourglass_step(q1, r, end, x[3], v[3], k)
    q2, w2 = hourglass_step(q2, r, end, x[4], v[4], k)
    q3, w3 = hourglass_step(q3, r, end, x[5], v[5], k)
    q4, w4 = hourglass_step(q4, r, end, x[6], v[6], k)
    work = 8.0 * dt * (w1 + w2 + w3 + w4)
    return ElementTrial(stress, b, volume, q1, q2, q3, q4, viscous, work, viscous * rate * volume * dt)


@inlined
def elastic_trial(nodal, dt, material, state, scratch):
    """Everything of a block up to the elastic trial stress, and what the force needs of it.

    nodal : (48*W,) coordinates and velocities;  state : (N_STATE*W,), trial stress and hourglass forces are written
    scratch : (N_SCRATCH*W,) b (18), hourglass coordinates g1..g4 (12), volume, viscous pressure, hourglass work,
        viscous work,
            von Mises stress minus yield stress
    """
    own = constants_of(material)
    for e in range(_W):
        x, v = vector_modes(nodal, e), vector_modes(nodal, 24 * _W + e)
        old = load(state, 0, 0, e) + load(state, 0, 3, e)
        q1, q2 = load(state, 0, HOURGLASS, e), load(state, 0, HOURGLASS + 3, e)
        q3, q4 = load(state, 0, HOURGLASS + 6, e), load(state, 0, HOURGLASS + 9, e)
        found = trial_of(x, v, dt, own, old, q1, q2, q3, q4)
        b, stress = found.gradient, found.stress
        store(state, 0, 0, e, stress[:3])
        store(state, 0, 3, e, stress[3:])
        scratch[EXCESS * _W + e] = von_mises(stress) - state[YIELD * _W + e]
        store(state, 0, HOURGLASS, e, found.q1)
        store(state, 0, HOURGLASS + 3, e, found.q2)
        store(state, 0, HOURGLASS + 6, e, found.q3)
        store(state, 0, HOURGLASS + 9, e, found.q4)
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
        scratch[30 * _W + e] = found.volume
        scratch[31 * _W + e] = found.pressure
        scratch[32 * _W + e] = found.hourglass_work
        scratch[33 * _W + e] = found.viscous_work


@inlined
def hourglass_step(old, r, end, g, gv, k):
    """One mode: q = g(v) - G g(x), x and G on the end configuration, so an affine motion of any size makes none; Q
    turns with the element and grows by k q. Returns Q and its mean power (without the factor 8)."""
    lg, turned = times(end, g), times(r, old)
    q = (gv[0] - lg[0], gv[1] - lg[1], gv[2] - lg[2])
    new = combine(1.0, turned, k, q)
    return new, 0.5 * (dot(turned, q) + dot(new, q))


@inlined
def modal_force(i, rows, q1, q2, q3, q4, b1, b2, b3, c1, c2, c3, g1, g2, g3, g4, k):
    """Component i of the modal forces of one element, on (xi, eta, zeta) and (eta zeta, zeta xi, xi eta, xi eta zeta):
    P b_I + hourglass, P = stress + viscous pressure - 8/V sum of Q (x) g.

    rows : of stress and viscous pressure;  q1..q4, g1..g4 : hourglass forces and coordinates;  b1..c3 : modal gradient;
    k : 8/V
    """
    q = (q1[i], q2[i], q3[i], q4[i])
    row = (
        rows[i][0] - k * (q[0] * g1[0] + q[1] * g2[0] + q[2] * g3[0] + q[3] * g4[0]),
        rows[i][1] - k * (q[0] * g1[1] + q[1] * g2[1] + q[2] * g3[1] + q[3] * g4[1]),
        rows[i][2] - k * (q[0] * g1[2] + q[1] * g2[2] + q[2] * g3[2] + q[3] * g4[2]),
    )
    fx, fy, fz = dot(row, b1), dot(row, b2), dot(row, b3)
    h1, h2, h3 = dot(row, c1) + q[0], dot(row, c2) + q[1], dot(row, c3) + q[2]
    return (fx, fy, fz), (h1, h2, h3, q[3])


@inlined
def stress_rows(t, u, p):
    """Rows of the stress of normal components t, shears u and a pressure p more."""
    return (t[0] + p, u[2], u[1]), (u[2], t[1] + p, u[0]), (u[1], u[0], t[2] + p)


@inlined
def internal_force(state, scratch, f):
    """Nodal internal forces of a block -> f (24*W,), see `modal_force`."""
    for e in range(_W):
        t, u = load(state, 0, 0, e), load(state, 0, 3, e)
        q1, q2 = load(state, 0, HOURGLASS, e), load(state, 0, HOURGLASS + 3, e)
        q3, q4 = load(state, 0, HOURGLASS + 6, e), load(state, 0, HOURGLASS + 9, e)
        b1, b2, b3 = load(scratch, 0, 0, e), load(scratch, 0, 3, e), load(scratch, 0, 6, e)
        c1, c2, c3 = load(scratch, 0, 9, e), load(scratch, 0, 12, e), load(scratch, 0, 15, e)
        g1, g2 = load(scratch, 0, 18, e), load(scratch, 0, 21, e)
        g3, g4 = load(scratch, 0, 24, e), load(scratch, 0, 27, e)
        k, rows = 8.0 / scratch[30 * _W + e], stress_rows(t, u, scratch[31 * _W + e])
        for i in range(3):
            linear, higher = modal_force(i, rows, q1, q2, q3, q4, b1, b2, b3, c1, c2, c3, g1, g2, g3, g4, k)
            store_nodal(f, i, e, linear, higher)


@inlined
def step_rotations(nodal, dt, rotation):
    """Rotation of the step of each lane, that of `elastic_trial` -> rotation (9*W,)."""
    for e in range(_W):
        b, volume = mean_gradient(vector_modes(nodal, e))
        r = step_rotation(to_mid_step(field_gradient(vector_modes(nodal, 24 * _W + e), b, volume), dt), dt)
        store(rotation, 0, 0, e, r[0])
        store(rotation, 0, 3, e, r[1])
        store(rotation, 0, 6, e, r[2])


@compiled
def update_elements(x, v, dt, blocks, nodes, filled, material_of, steels, state, back, force, work):
    """One step of the blocks (k,) of these numbers: stresses from v on the geometry x, minus the internal force added
    to `force`.

    Parameters
    ----------
    x, v      : (3*n,)  coordinates at the end of the step [m], velocities over it [m/s]
    nodes     : (n_blocks*8*LANES,) block, node, lane; uint32, because a signed index costs a test at every access
    filled    : (n_blocks,) real lanes of each block
    material_of : (n_blocks,) row of the materials;  steels : MaterialTable
    state     : (n_blocks*N_STATE*LANES,) changed in place
    back      : (n_blocks*k*6*LANES,) back stresses, the first of each block changed in place: as many as its material
        has. They turn with the step's rotation as the stress does; a block that has never flowed has none to turn
    force     : (3*n,)  [N], changed in place
    work      : (3*n_blocks,) [J], plastic, hourglass and viscous work of the step are added to each block's

    Returns the smallest element volume [m3]: not positive, or not a number, where an element has turned inside out.
    Rank-local. Allocates only its block buffers. Error: second order in dt (tests/fe/test_hexahedron.py).
    """
    nodal, scratch, rotation = np.empty(48 * _W), np.empty(N_SCRATCH * _W), np.empty(9 * _W)
    point, stride = point_buffers(steels), back.size // max(filled.size, 1)
    smallest = np.inf
    for k in range(blocks.size):
        block, later = blocks[k], blocks[min(k + 1, blocks.size - 1)]
        start, s, count, row = block * 8 * _W, block * N_STATE * _W, filled[block], material_of[block]
        ahead = later * N_STATE * _W
        fetch(nodes, later * 8 * _W, 8 * _W, INDICES)
        gather(x, v, nodes, start, nodal)
        fetch(state, ahead, _QUARTER, NUMBERS)
        own, held = state[s : s + N_STATE * _W], 6 * _W * (steels.back_start[row + 1] - steels.back_start[row])
        backs = back[block * stride : block * stride + held]
        moved = backs.size > 0 and has_flowed(own, count)
        if moved:
            add_centre(own, backs, -1.0)
            step_rotations(nodal, dt, rotation)
            turn(backs, rotation, 0)
        law = return_law(steels, row)
        elastic_trial(nodal, dt, steels.rows[row], own, scratch)
        fetch(state, ahead + _QUARTER, _QUARTER, NUMBERS)
        if flow_back(law, own, backs, scratch, count, point, N_STATE) or moved:
            add_centre(own, backs, 1.0)
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
