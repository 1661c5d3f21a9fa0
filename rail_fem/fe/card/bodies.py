"""What one thread of the card does of a step of the bodies: an element, a node, a share of a rigid group.

The mathematics is that of the compiled kernels, function by function. No thread adds to what another one adds to:
elements store their nodal forces, nodes gather those of their elements in a fixed order, so that a step gives the same
bits every time. Compiled for the card by rail_fem.fe.card.kernels, and for the processor where a card is simulated.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rail_fem.fe.elastic import N_FIXED, elastic_hourglass, gradient_and_stress
from rail_fem.fe.finite_strain import rotate_stress, step_rotation, to_mid_step, von_mises
from rail_fem.fe.hexahedron import constants_of, modal_force, stress_rows, trial_of
from rail_fem.fe.lanes import inlined, load, store, thread
from rail_fem.fe.node_kernels import kicked, pushed
from rail_fem.fe.plasticity import ease, isotropic, kinematic
from rail_fem.fe.state import HOURGLASS, KINEMATIC, LANES, LAW, N_STATE, N_WORK, PLASTIC_STRAIN, YIELD
from rail_fem.fe.trilinear import by_mode, field_gradient, mean_gradient, scalar_modes, store_nodal

_W = LANES


class CardNodes(NamedTuple):
    """x, v, force, reference, inverse_mass, displaced : (3 n,), the last for small-displacement elements
    moved : (k,) nodes that a step computes
    power, pushed : (n,) internal work of the kick, work of contact on the body, since they were last read [J]
    first, places : (n+1,), (m,) where the nodal forces of each node's elements stand
    """

    x: np.ndarray
    v: np.ndarray
    force: np.ndarray
    reference: np.ndarray
    inverse_mass: np.ndarray
    displaced: np.ndarray
    moved: np.ndarray
    power: np.ndarray
    pushed: np.ndarray
    first: np.ndarray
    places: np.ndarray


class StepShared(NamedTuple):
    """What the kernels of a step share: counters (rail_fem.fe.card.touching), nodal forces of all elements
    (n*24*LANES,), and of these the finite-strain ones' and the small-displacement ones'."""

    counters: np.ndarray
    forces: np.ndarray
    finite_forces: np.ndarray
    small_forces: np.ndarray


class CardElements(NamedTuple):
    """Finite-strain blocks, arrays as rail_fem.fe.hexahedron.update_elements has them; computed : (k,) blocks that a
    step computes;  work : (n_blocks*N_WORK*LANES,) since it was last read [J];  volume : (n_blocks*LANES,) [m3]"""

    nodes: np.ndarray
    filled: np.ndarray
    material_of: np.ndarray
    state: np.ndarray
    back: np.ndarray
    computed: np.ndarray
    work: np.ndarray
    volume: np.ndarray


class CardSmallElements(NamedTuple):
    """Small-displacement blocks: geometry of rail_fem.fe.elastic.fixed_geometry."""

    nodes: np.ndarray
    material_of: np.ndarray
    geometry: np.ndarray


@inlined
def component(a, nodes, block, k, e):
    """Modes of component k of a nodal vector on lane e."""
    n = block * 8 * _W + e
    return scalar_modes(
        a[3 * nodes[n] + k],
        a[3 * nodes[n + _W] + k],
        a[3 * nodes[n + 2 * _W] + k],
        a[3 * nodes[n + 3 * _W] + k],
        a[3 * nodes[n + 4 * _W] + k],
        a[3 * nodes[n + 5 * _W] + k],
        a[3 * nodes[n + 6 * _W] + k],
        a[3 * nodes[n + 7 * _W] + k],
    )


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
def turn_centre(x, v, dt, back, e):
    """Turn the back stress (6*W,) of lane e with the step's rotation."""
    b, volume = mean_gradient(x)
    r = step_rotation(to_mid_step(field_gradient(v, b, volume), dt), dt)
    turned = rotate_stress(r, load(back, 0, 0, e) + load(back, 0, 3, e))
    store(back, 0, 0, e, turned[:3])
    store(back, 0, 3, e, turned[3:])


@thread
def shift(state, back, e, sign):
    """`sign` times the back stress (6*W,) added to the stress of lane e."""
    for k in range(6):
        state[k * _W + e] += sign * back[k * _W + e]


@thread
def advance_element(block, e, dt, nodes, own, steels, forces):
    """One step of lane e of a finite-strain block with a hardening curve: stress, and nodal forces -> forces
    (n*24*LANES,)."""
    row, count = own.material_of[block], own.filled[block]
    material, state = steels.rows[row], own.state[block * N_STATE * _W : (block + 1) * N_STATE * _W]
    x, v = modes_at(nodes.x, own.nodes, block, e), modes_at(nodes.v, own.nodes, block, e)
    stride = own.back.size // own.filled.size
    back = own.back[block * stride : (block + 1) * stride]
    moves = material[LAW] == KINEMATIC
    moved = moves and state[PLASTIC_STRAIN * _W + e] > 0.0
    if moved:
        shift(state, back, e, -1.0)
        turn_centre(x, v, dt, back, e)
    q1, q2 = load(state, 0, HOURGLASS, e), load(state, 0, HOURGLASS + 3, e)
    q3, q4 = load(state, 0, HOURGLASS + 6, e), load(state, 0, HOURGLASS + 9, e)
    old = load(state, 0, 0, e) + load(state, 0, 3, e)
    found = trial_of(x, v, dt, constants_of(material), old, q1, q2, q3, q4)
    stress = found.stress
    store(state, 0, 0, e, stress[:3])
    store(state, 0, 3, e, stress[3:])
    store(state, 0, HOURGLASS, e, found.q1)
    store(state, 0, HOURGLASS + 3, e, found.q2)
    store(state, 0, HOURGLASS + 6, e, found.q3)
    store(state, 0, HOURGLASS + 9, e, found.q4)
    at, size, p = block * N_WORK * _W + e, state[YIELD * _W + e], state[PLASTIC_STRAIN * _W + e]
    excess = von_mises(stress) - size
    if excess > 0.0 and e < count:
        c0, c1 = steels.curve_start[row], steels.curve_start[row + 1]
        strain, curve, shear = steels.curve_strain[c0:c1], steels.curve_stress[c0:c1], material[1]
        if moves:
            centre = load(back, 0, 0, e) + load(back, 0, 3, e)
            flow, after = kinematic(excess, p, size, stress, centre, shear, strain, curve)
            store(back, 0, 0, e, after[:3])
            store(back, 0, 3, e, after[3:])
            moved = True
        else:
            flow = isotropic(excess, p, size, shear, strain, curve)
        state[PLASTIC_STRAIN * _W + e], state[YIELD * _W + e] = flow.strain, flow.yield_stress
        own.work[at] += flow.work * found.volume
        ease(state, e, flow.share, N_STATE)
    if moved:
        shift(state, back, e, 1.0)
    own.work[at + _W] += found.hourglass_work
    own.work[at + 2 * _W] += found.viscous_work
    own.volume[block * _W + e] = found.volume
    rows = stress_rows(load(state, 0, 0, e), load(state, 0, 3, e), found.pressure)
    q1, q2 = load(state, 0, HOURGLASS, e), load(state, 0, HOURGLASS + 3, e)
    q3, q4 = load(state, 0, HOURGLASS + 6, e), load(state, 0, HOURGLASS + 9, e)
    f = forces[block * 24 * _W : (block + 1) * 24 * _W]
    give_forces(f, e, rows, q1, q2, q3, q4, found.gradient, x[3], x[4], x[5], x[6], 8.0 / found.volume)


@thread
def force_small(block, e, nodes, own, steels, forces):
    """Nodal forces of lane e of a small-displacement block -> forces (n*24*LANES,)."""
    material = steels.rows[own.material_of[block]]
    fixed = own.geometry[block * N_FIXED * _W : (block + 1) * N_FIXED * _W]
    m = modes_at(nodes.displaced, own.nodes, block, e)
    l, stress = gradient_and_stress(m, fixed, e, material[0], material[1])
    b = (
        load(fixed, 0, 0, e),
        load(fixed, 0, 3, e),
        load(fixed, 0, 6, e),
        load(fixed, 0, 9, e),
        load(fixed, 0, 12, e),
        load(fixed, 0, 15, e),
    )
    g1, g2, g3, g4 = load(fixed, 0, 18, e), load(fixed, 0, 21, e), load(fixed, 0, 24, e), load(fixed, 0, 27, e)
    q1, q2, q3, q4 = elastic_hourglass(m, l, g1, g2, g3, g4, fixed[32 * _W + e])
    rows = stress_rows(stress[:3], stress[3:], 0.0)
    f = forces[block * 24 * _W : (block + 1) * 24 * _W]
    give_forces(f, e, rows, q1, q2, q3, q4, b, g1, g2, g3, g4, 8.0 / fixed[30 * _W + e])


@thread
def gather_force(n, nodes, forces):
    """Minus the forces of the elements around node n, in their fixed order -> force."""
    a = b = c = 0.0
    for m in range(nodes.first[n], nodes.first[n + 1]):
        k = nodes.places[m]
        a -= forces[k]
        b -= forces[k + _W]
        c -= forces[k + 2 * _W]
    nodes.force[3 * n], nodes.force[3 * n + 1], nodes.force[3 * n + 2] = a, b, c


@thread
def kick_node(n, dt, nodes):
    """Velocity of node n from internal forces, and their work."""
    power = 0.0
    for i in range(3 * n, 3 * n + 3):
        old = nodes.v[i]
        new = kicked(old, nodes.force[i], nodes.inverse_mass[i], dt)
        nodes.v[i] = new
        power += 0.5 * nodes.force[i] * (old + new)
    nodes.power[n] -= dt * power


@thread
def drift_node(n, dt, damping, nodes):
    """Position after the step, and u + damping v there [m]."""
    for i in range(3 * n, 3 * n + 3):
        nodes.x[i] += dt * nodes.v[i]
        nodes.displaced[i] = nodes.x[i] - nodes.reference[i] + damping * nodes.v[i]


@thread
def push_node(n, a, dt, nodes, force, inverse_mass):
    """Contact force of surface node a, (m, 3), onto the velocity of node n, and the works."""
    for c in range(3):
        i = 3 * n + c
        nodes.v[i], work, changed = pushed(nodes.v[i], force[a, c], nodes.force[i], inverse_mass[a], dt)
        nodes.pushed[n] += work
        nodes.power[n] -= changed


class CardGroups(NamedTuple):
    """Rigid groups and links between them, as rail_fem.fe.supports has them: replicated there, on the card here.

    members, first : nodes of each group;  partial : (threads, 3 groups) sums of the threads [N]
    velocity, displacement, load, mass : (g, 3), mass inf where a direction does not move;  load_work : (g,)
    reaction : (g, 3);  upwards : (g,) buffer
    a, b : (l,) groups of each link, b -1 the ground;  stiffness, damping, length, rate, dissipated, before : (l,)
    """

    members: np.ndarray
    first: np.ndarray
    partial: np.ndarray
    velocity: np.ndarray
    displacement: np.ndarray
    load: np.ndarray
    mass: np.ndarray
    load_work: np.ndarray
    reaction: np.ndarray
    upwards: np.ndarray
    a: np.ndarray
    b: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    length: np.ndarray
    rate: np.ndarray
    dissipated: np.ndarray
    before: np.ndarray


@thread
def add_reactions(first, every, groups, force):
    """The thread's share of the element forces on each group -> its row of `partial`."""
    own = groups.partial[first]
    for g in range(groups.first.size - 1):
        x = y = z = 0.0
        for m in range(groups.first[g] + first, groups.first[g + 1], every):
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
def stretch_rate(groups, k):
    rate = groups.velocity[groups.a[k], 2]
    return rate - groups.velocity[groups.b[k], 2] if groups.b[k] >= 0 else rate


@thread
def advance_groups(dt, groups):
    """Velocities of all groups from reactions, the first row of `partial`, loads and links, as
    rail_fem.fe.supports.Supports.advance; their positions after the step."""
    g, links = groups, groups.a.size
    for i in range(g.load_work.size):
        g.upwards[i] = 0.0
        for c in range(3):
            g.reaction[i, c] = g.partial[0, 3 * i + c]
    for k in range(links):
        stretch = g.displacement[g.a[k], 2] - (g.displacement[g.b[k], 2] if g.b[k] >= 0 else 0.0) - g.length[k]
        g.before[k] = stretch_rate(g, k)
        force = -g.stiffness[k] * stretch - g.damping[k] * (g.before[k] - g.rate[k])
        g.upwards[g.a[k]] += force
        if g.b[k] >= 0:
            g.upwards[g.b[k]] -= force
    for i in range(g.load_work.size):
        for c in range(3):
            old, load = g.velocity[i, c], g.load[i, c]
            if g.mass[i, c] < np.inf:
                new = old + dt / g.mass[i, c] * (g.reaction[i, c] + load + (g.upwards[i] if c == 2 else 0.0))
                g.velocity[i, c] = new
                g.load_work[i] += dt * load * 0.5 * (new + old)
            g.displacement[i, c] += dt * g.velocity[i, c]
    for k in range(links):
        damper = -g.damping[k] * (g.before[k] - g.rate[k])
        g.dissipated[k] -= dt * damper * 0.5 * (g.before[k] + stretch_rate(g, k))


@thread
def impose_group(m, groups, v):
    """Velocity of its group onto member m."""
    g = 0
    while m >= groups.first[g + 1]:
        g += 1
    for c in range(3):
        v[3 * groups.members[m] + c] = groups.velocity[g, c]
