"""What the threads of a card do in a step of the bodies: kick, elements, sums at nodes, drift, rigid groups.

The mathematics is that of the compiled kernels, function by function, each on one item: rail_fem.fe.card.kernels deals
them out, j the number of a node that moves or is watched. No thread adds to what another one adds to: elements store
their nodal forces, nodes gather those of their elements in a fixed order, so that a step gives the same bits every
time. Compiled for the card by the kernels, and for the processor where a card is simulated.
"""

from __future__ import annotations

import numpy as np

from rail_fem.fe.card import arrays
from rail_fem.fe.elastic import N_FIXED, elastic_hourglass, gradient_and_stress, shape_gradients
from rail_fem.fe.finite_strain import step_rotation, to_mid_step, von_mises
from rail_fem.fe.hexahedron import constants_of, modal_force, stress_rows, trial_of
from rail_fem.fe.hexahedron_full import (
    DIVERGENCE,
    MEAN,
    VECTORS,
    VISCOUS,
    VOLUME,
    add_force_of_point,
    begin_element,
    force_at_nodes,
    trial_of_point,
    vectors_at,
)
from rail_fem.fe.lanes import inlined, load, store, thread
from rail_fem.fe.node_kernels import SMALL, kick_range, pushed
from rail_fem.fe.plasticity import flow_alone, return_law, turn_alone
from rail_fem.fe.state import HOURGLASS, LANES, N_STATE, N_WORK, POINT_STATE, POINTS, YIELD
from rail_fem.fe.trilinear import by_mode, field_gradient, mean_gradient, scalar_modes, store_nodal

_W = LANES
FULL_ROOM = VECTORS + MEAN  # rows that a block of full elements needs beside


@inlined
def at_four(a, nodes, n, k):
    """Component k of a nodal vector at four nodes of a lane, of which the first stands at n."""
    return a[3 * nodes[n] + k], a[3 * nodes[n + _W] + k], a[3 * nodes[n + 2 * _W] + k], a[3 * nodes[n + 3 * _W] + k]


@inlined
def component(a, nodes, block, k, e):
    """Modes of component k of a nodal vector on lane e."""
    n0, n1, n2, n3 = at_four(a, nodes, block * 8 * _W + e, k)
    n4, n5, n6, n7 = at_four(a, nodes, (block * 8 + 4) * _W + e, k)
    return scalar_modes(n0, n1, n2, n3, n4, n5, n6, n7)


@inlined
def modes_at(a, nodes, block, e):
    """The 7 modal vectors of a nodal vector on lane e."""
    return by_mode(component(a, nodes, block, 0, e), component(a, nodes, block, 1, e), component(a, nodes, block, 2, e))


@inlined
def give_forces(f, e, rows, q1, q2, q3, q4, b, g1, g2, g3, g4, k):
    """Nodal forces of lane e -> f (24*W,), see rail_fem.fe.hexahedron.modal_force."""
    for i in range(3):
        linear, higher = modal_force(i, rows, q1, q2, q3, q4, b[0], b[1], b[2], b[3], b[4], b[5], g1, g2, g3, g4, k)
        store_nodal(f, i, e, linear, higher)


@thread
def shift(state, back, e, sign):
    """`sign` times the back stresses (k*6*W,) of lane e added to its stress."""
    for first in range(0, back.size, 6 * _W):
        for k in range(6):
            state[k * _W + e] += sign * back[first + k * _W + e]


@thread
def turn_all(back, e, rotation):
    """Turn the back stresses (k*6*W,) of lane e."""
    for first in range(0, back.size, 6 * _W):
        turn_alone(back, first, e, rotation)


@thread
def take_trial(stress, law, state, back, e, real, point, rows):
    """Trial stress of a point less its back stresses -> state, brought back where a `real` lane flows, and these added;
    plastic work density [J/m3]. point, rows : as in plasticity.flow_back"""
    store(state, 0, 0, e, stress[:3])
    store(state, 0, 3, e, stress[3:])
    excess, work = von_mises(stress) - state[YIELD * _W + e], 0.0
    if excess > 0.0 and real:
        work = flow_alone(law, state, back, e, excess, point, rows)
    shift(state, back, e, 1.0)
    return work


@thread
def state_of(own, law, block, q, points, rows):
    """State (rows*W,) and back stresses (k*6*W,) of point q of a block."""
    at, stride, held = block * points + q, own.back.size // own.filled.size, 6 * _W * law.cyclic.modulus.size
    first = block * stride + q * held
    return own.state[at * rows * _W : (at + 1) * rows * _W], own.back[first : first + held]


@thread
def advance_element(block, e, room, point, a):
    """One step of lane e of a block of one-point elements: stress and nodal forces. room : none;  point : PointBuffers,
    None where no steel has a law over cycles"""
    own, law = a.elements, return_law(a.steels, a.elements.material_of[block])
    x, v = modes_at(a.nodes.x, own.nodes, block, e), modes_at(a.nodes.v, own.nodes, block, e)
    state, back = state_of(own, law, block, 0, 1, N_STATE)
    if back.size > 0:  # before the trial: there are no registers for the rotation beside it
        shift(state, back, e, -1.0)
        b, volume = mean_gradient(x)
        turn_all(back, e, step_rotation(to_mid_step(field_gradient(v, b, volume), a.dt), a.dt))
    q1, q2 = load(state, 0, HOURGLASS, e), load(state, 0, HOURGLASS + 3, e)
    q3, q4 = load(state, 0, HOURGLASS + 6, e), load(state, 0, HOURGLASS + 9, e)
    old = load(state, 0, 0, e) + load(state, 0, 3, e)
    found = trial_of(x, v, a.dt, constants_of(a.steels.rows[own.material_of[block]]), old, q1, q2, q3, q4)
    store(state, 0, HOURGLASS, e, found.q1)
    store(state, 0, HOURGLASS + 3, e, found.q2)
    store(state, 0, HOURGLASS + 6, e, found.q3)
    store(state, 0, HOURGLASS + 9, e, found.q4)
    at, real = block * N_WORK * _W + e, e < own.filled[block]
    work = take_trial(found.stress, law, state, back, e, real, point, N_STATE)
    own.work[at] += found.volume * work
    own.work[at + _W] += found.hourglass_work
    own.work[at + 2 * _W] += found.viscous_work
    own.volume[block * _W + e] = found.volume
    rows = stress_rows(load(state, 0, 0, e), load(state, 0, 3, e), found.pressure)
    q1, q2 = load(state, 0, HOURGLASS, e), load(state, 0, HOURGLASS + 3, e)
    q3, q4 = load(state, 0, HOURGLASS + 6, e), load(state, 0, HOURGLASS + 9, e)
    f = a.forces[block * 24 * _W : (block + 1) * 24 * _W]
    give_forces(f, e, rows, q1, q2, q3, q4, found.gradient, x[3], x[4], x[5], x[6], 8.0 / found.volume)


@thread
def advance_full_element(block, e, room, point, a):
    """The same of elements of eight points. room : (FULL_ROOM*W,) buffer"""
    own, law, dt = a.elements, return_law(a.steels, a.elements.material_of[block]), a.dt
    constants, real = constants_of(a.steels.rows[own.material_of[block]]), e < own.filled[block]
    x, v = modes_at(a.nodes.x, own.nodes, block, e), modes_at(a.nodes.v, own.nodes, block, e)
    forces, mean = room[: VECTORS * _W], room[VECTORS * _W :]
    begin_element(x, v, dt, constants, mean, e)
    for k in range(VECTORS):
        forces[k * _W + e] = 0.0
    at, lane = block * N_WORK * _W + e, block * _W + e
    own.work[at + 2 * _W] += mean[VISCOUS * _W + e]
    own.volume[lane] = mean[VOLUME * _W + e]
    for q in range(POINTS):
        state, back = state_of(own, law, block, q, POINTS, POINT_STATE)
        shift(state, back, e, -1.0)
        old = load(state, 0, 0, e) + load(state, 0, 3, e)
        x1, x2, x3 = vectors_at(x, q)
        v1, v2, v3 = vectors_at(v, q)
        found = trial_of_point(x1, x2, x3, v1, v2, v3, mean[DIVERGENCE * _W + e], dt, constants, old)
        volume = found.jacobian
        turn_all(back, e, found.rotation)
        work = take_trial(found.stress, law, state, back, e, real, point, POINT_STATE)
        own.work[at] += volume * work
        t, u = load(state, 0, 0, e), load(state, 0, 3, e)
        add_force_of_point(t, u, found.c1, found.c2, found.c3, volume, q, mean, forces, e)
        if not volume > 0.0:
            own.volume[lane] = volume
    force_at_nodes(forces, mean, a.forces[block * 24 * _W : (block + 1) * 24 * _W], e)


@thread
def force_small_element(j, a):
    """Nodal forces of element j, padding counted, of the small-displacement blocks."""
    block, e, own = j // _W, j % _W, a.small
    start, material = a.elements.filled.size + block, a.steels.rows[own.material_of[block]]
    fixed = own.geometry[block * N_FIXED * _W : (block + 1) * N_FIXED * _W]
    m = modes_at(a.nodes.displaced, own.nodes, block, e)
    l, stress = gradient_and_stress(m, fixed, e, material[0], material[1])
    b = shape_gradients(fixed, e)
    g1, g2, g3, g4 = load(fixed, 0, 18, e), load(fixed, 0, 21, e), load(fixed, 0, 24, e), load(fixed, 0, 27, e)
    q1, q2, q3, q4 = elastic_hourglass(m, l, g1, g2, g3, g4, fixed[32 * _W + e])
    rows = stress_rows(stress[:3], stress[3:], 0.0)
    f = a.forces[start * 24 * _W : (start + 1) * 24 * _W]
    give_forces(f, e, rows, q1, q2, q3, q4, b, g1, g2, g3, g4, 8.0 / fixed[30 * _W + e])


@thread
def gather_forces(j, a):
    """Minus the forces of the elements around a node, in their fixed order -> force."""
    nodes, n, x, y, z = a.nodes, a.nodes.moved[j], 0.0, 0.0, 0.0
    for m in range(nodes.first[n], nodes.first[n + 1]):
        k = nodes.places[m]
        x -= a.forces[k]
        y -= a.forces[k + _W]
        z -= a.forces[k + 2 * _W]
    nodes.force[3 * n], nodes.force[3 * n + 1], nodes.force[3 * n + 2] = x, y, z


@thread
def kick_node(j, a):
    """Velocity from internal forces, and their work."""
    nodes, n = a.nodes, a.nodes.moved[j]
    v, force, works = nodes.v, nodes.force, nodes.works[n]
    kick_range(v, force, nodes.inverse_mass, 0.0, a.dt, nodes.marks, 3 * n, 3 * n + 3, works)


@thread
def drift_node(j, a):
    """Position after the step, and u + damping v there [m]."""
    nodes, n = a.nodes, a.nodes.moved[j]
    for i in range(3 * n, 3 * n + 3):
        nodes.x[i] += a.dt * nodes.v[i]
        nodes.displaced[i] = nodes.x[i] - nodes.reference[i] + a.damping * nodes.v[i]


@thread
def push_node(j, a):
    """Contact force onto the velocity, and the works."""
    nodes, t, at = a.nodes, a.contact, a.contact.watched[j]
    n = t.local[at]
    for c in range(3):
        i, push = 3 * n + c, t.found.force[at, c]
        nodes.v[i], work, changed = pushed(nodes.v[i], push, nodes.force[i], t.nodes.inverse_mass[at], a.dt)
        nodes.pushed[n] += work
        nodes.works[n, nodes.marks[i] & SMALL] -= changed


@thread
def add_reactions(thread, _, a):
    """The thread's share of the element forces on each group -> its row of `partial`; whether a step is due."""
    groups, own, force = a.groups, a.groups.partial[thread], a.nodes.force
    if thread == 0:
        a.counters[arrays.GOES] = 1 if a.counters[arrays.LEFT] > 0 and a.counters[arrays.TO_SEARCH] > 0 else 0
    for g in range(groups.first.size - 1):
        x = y = z = 0.0
        for m in range(groups.first[g] + thread, groups.first[g + 1], groups.partial.shape[0]):
            n = 3 * groups.members[m]
            x += force[n]
            y += force[n + 1]
            z += force[n + 2]
        own[3 * g], own[3 * g + 1], own[3 * g + 2] = x, y, z


@thread
def fold(row, half, partial):
    """Row `row` + half of partial (threads, k) added to row `row`, of the first `half` rows."""
    if row < half:
        for c in range(partial.shape[1]):
            partial[row, c] += partial[row + half, c]


@thread
def stretch(g, k, along):
    """Of link k: the difference of what (g, 3) its ends have upwards."""
    own = along[g.ends[k, 0], 2]
    return own - along[g.ends[k, 1], 2] if g.ends[k, 1] >= 0 else own


@thread
def advance_groups(dt, g):
    """Velocities of all groups from reactions, the first row of `partial`, loads and links, as
    rail_fem.fe.supports.Supports.advance; their positions after the step."""
    for i in range(g.upwards.size):
        g.upwards[i] = 0.0
    for k in range(g.ends.shape[0]):
        link = g.links[k]
        link[arrays.BEFORE] = stretch(g, k, g.velocity)
        longer = stretch(g, k, g.displacement) - link[arrays.LENGTH]
        force = -link[arrays.STIFFNESS] * longer - link[arrays.DAMPING] * (link[arrays.BEFORE] - link[arrays.RATE])
        g.upwards[g.ends[k, 0]] += force
        if g.ends[k, 1] >= 0:
            g.upwards[g.ends[k, 1]] -= force
    for i in range(g.upwards.size):
        for c in range(3):
            old, load, mass = g.velocity[i, c], g.load[i, c], g.mass[i, c]
            g.reaction[i, c] = g.partial[0, 3 * i + c]
            if mass < np.inf:
                new = old + dt / mass * (g.reaction[i, c] + load + (g.upwards[i] if c == 2 else 0.0))
                g.velocity[i, c] = new
                g.load_work[i] += dt * load * 0.5 * (new + old)
            g.displacement[i, c] += dt * g.velocity[i, c]
    for k in range(g.ends.shape[0]):
        link = g.links[k]
        damper = -link[arrays.DAMPING] * (link[arrays.BEFORE] - link[arrays.RATE])
        link[arrays.DISSIPATED] -= dt * damper * 0.5 * (link[arrays.BEFORE] + stretch(g, k, g.velocity))


@thread
def impose_group(m, a):
    """Velocity of its group onto member m."""
    groups, g = a.groups, 0
    while m >= groups.first[g + 1]:
        g += 1
    for c in range(3):
        a.nodes.v[3 * groups.members[m] + c] = groups.velocity[g, c]
