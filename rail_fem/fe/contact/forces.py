"""Contact forces of a step: positions of the nodes in, forces on them out. Compiled, allocation-free, no mesh.

The gap is taken where the nodes would be at the end of the step without contact (rail_fem.fe.contact.projection); the
pressures that close the gaps are found together (rail_fem.fe.contact.pressure): the forward increment Lagrange
multiplier method of Carpenter, Taylor and Katona (IJNME 32 (1991) 103) with the compliance of a penalty beside it,
stable for any penalty. An explicit penalty k, at most 1 / (dt^2 D), would leave a penetration p / k of that size at any
load.

Both surfaces are slave once, each with half the pressure (balanced). Friction (rail_fem.fe.contact.friction) acts in
the pass of the rail's nodes, which move with their material; the wheel's material flows through its mesh, and its
velocity has the term omega x r.
"""

from __future__ import annotations

from rail_fem.fe.contact.compiled import compiled, uncounted
from rail_fem.fe.contact.friction import add_friction_forces, finish_slip
from rail_fem.fe.contact.pairs import CARRIED, N_ACTIVE, NORMAL_ENERGY, TOWED
from rail_fem.fe.contact.pressure import add_tributary_areas, find_pressures
from rail_fem.fe.contact.projection import project_some, take


@compiled
def pack(x, v, dt, local, rows):
    """Positions now and, without contact, after the step, of the nodes `local` (k,) -> rows (k, 6)."""
    for i in range(local.size):
        for c in range(3):
            now = x[3 * local[i] + c]
            rows[i, c] = now
            rows[i, 3 + c] = now + dt * v[3 * local[i] + c]


@compiled
def give_forces(summed, sums, lost, force, nodes, first, answers):
    """What each rank is told, one after the other -> answers: `summed`, `sums`, `lost`, and the forces (n, 3) on its
    nodes, nodes[first[r]:first[r+1]]."""
    at = 0
    for r in range(first.size - 1):
        for value in summed:
            answers[at] = value
            at += 1
        for value in sums:
            answers[at] = value
            at += 1
        answers[at] = lost
        at += 1
        for i in range(first[r], first[r + 1]):
            for c in range(3):
                answers[at + c] = force[nodes[i], c]
            at += 3


@compiled
def pack_motion(x, v, local, here, slot, motion):
    """Positions and velocities of the nodes of this rank, `local`, at `here` among the surface nodes -> rows slot[here]
    of motion (m, 6), where that is not below 0; 0 elsewhere."""
    motion[:] = 0.0
    for i in range(local.size):
        row = slot[here[i]]
        if row >= 0:
            for c in range(3):
                motion[row, c], motion[row, 3 + c] = x[3 * local[i] + c], v[3 * local[i] + c]


@compiled
def unpack_motion(motion, nodes, n_rail, frames, position, velocity):
    """Rows of all ranks onto the surface nodes (m,), the wheel's (from n_rail on) as the rail's frame has them."""
    for i in range(nodes.size):
        n = nodes[i]
        for c in range(3):
            position[n, c], velocity[n, c] = motion[i, c], motion[i, 3 + c]
        if n >= n_rail:
            position[n, 0] += frames.offset
            velocity[n, 0] += frames.speed
            position[n, 2] -= frames.raised
            velocity[n, 2] -= frames.rise


@uncounted
def unpack(given, at, order, n_rail, frames, dt, before, position):
    """Rows of all ranks, which begin at `at` (w,) in `given`, onto the surface nodes `order` (w,), the wheel's (from
    n_rail on) as the rail's frame has them before and after the step."""
    for i in range(order.size):
        n = order[i]
        for c in range(3):
            before[n, c], position[n, c] = given[at[i] + c], given[at[i] + 3 + c]
        if n >= n_rail:
            before[n, 0] += frames.offset
            position[n, 0] += frames.offset + dt * frames.speed
            before[n, 2] -= frames.raised
            position[n, 2] -= frames.raised + dt * frames.rise


@uncounted
def add_normal_forces(pairs, nodes, factor, law, found, sums):
    """The pressures of one pass as forces on the nodes, and as the scalar normal force on each node.

    They turn no wheel: its material flows along its deformed surface, at right angles to them. About the axle they have
    the moment of the pressure times the slope that the deformed surface has against the circle. It vanishes for an
    elastic body of revolution in equilibrium; nodes that stand two or three to a patch sample it with an error of the
    order of their distance wherever the pressure is steeper in front than behind, as on steel that flows.
    """
    normal, weight, force, normal_force = pairs.normal, pairs.weight, found.force, found.normal_force
    for i in range(pairs.slaves.size):
        s, p = pairs.slaves[i], pairs.pressure[i]
        if pairs.active[i]:
            q = pairs.quads[pairs.facets[i]]
            f = factor * nodes.area[s] * p
            normal_force[s] += f
            for k in range(4):
                normal_force[q[k]] += weight[i, k] * f
            for c in range(3):
                force[s, c] += f * normal[i, c]
                for k in range(4):
                    force[q[k], c] -= weight[i, k] * f * normal[i, c]
            sums[NORMAL_ENERGY] += 0.5 * f * p * law.compliance
            sums[N_ACTIVE] += 1
        found.pressure_at[s] = p


@compiled
def predict(given, at, order, n_rail, frames, dt, nodes, on_rail, on_wheel, first, every, rows):
    """Rows of all ranks onto the surface nodes, as `unpack`; then, of every so many pairs of both surfaces from number
    `first` on, their projections where the nodes would be without contact -> rows (k, PROJECTION), the rail's first."""
    unpack(given, at, order, n_rail, frames, dt, nodes.before, nodes.position)
    split = on_rail.slaves.size
    project_some(nodes.position, on_rail, first, every, rows[:split])
    project_some(nodes.position, on_wheel, first, every, rows[split:])


@compiled
def contact_forces(rows, on_rail, on_wheel, watched, n_rail, nodes, law, spin, yaw, dt, found, sliding, sums):
    """All contact forces of a step, from the projections of all pairs; returns how many pairs that carried have lost
    their facet.

    rows : (k, PROJECTION) of the rail's pairs, then of the wheel's;  on_rail, on_wheel : Pairs of the rail's nodes over
        the wheel's facets and the reverse
    watched : (w,) surface nodes in question, the wheel's from number n_rail on;  nodes : Nodes;  law : Law;  spin of
        the wheel [rad/s];  yaw : angle by which it heads to +y [rad]
    found : NodalForces, all but the slip overwritten on `watched`;  sliding : Sliding of the rail's pairs, overwritten;
    sums : (N_SUMS,) overwritten
    With friction the rail's pairs are left active where their node carries normal force, its own or of the wheel's
    nodes.
    """
    sums[:] = 0.0
    split = on_rail.slaves.size
    lost = take(rows[:split], on_rail) + take(rows[split:], on_wheel)
    for n in watched:
        found.tributary_area[n], found.normal_force[n], found.pressure_at[n] = 0.0, 0.0, 0.0
        found.force[n, 0] = found.force[n, 1] = found.force[n, 2] = 0.0
    for side in range(2):
        pairs = on_wheel if side else on_rail
        for i in range(pairs.slaves.size):
            pairs.active[i] = pairs.facets[i] >= 0 and -law.deepest < pairs.gap[i] < 0.0
        add_tributary_areas(pairs, nodes.area, 0.5, found.tributary_area)
    find_pressures(on_rail, on_wheel, nodes, law, dt, found.tributary_area, found.slot)
    for side in range(2):
        add_normal_forces(on_wheel if side else on_rail, nodes, 0.5, law, found, sums)
    if law.friction > 0.0:
        for n in watched:
            found.tributary_area[n] = 0.0
        # a node that only the wheel's nodes press rubs as well: at the rim of the patch there are some
        for i in range(on_rail.slaves.size):
            on_rail.active[i] = on_rail.facets[i] >= 0 and found.normal_force[on_rail.slaves[i]] > 0.0
        add_tributary_areas(on_rail, nodes.area, 1.0, found.tributary_area)
        add_friction_forces(on_rail, nodes, law, spin, yaw, dt, found, sliding, sums)
        finish_slip(on_rail, nodes.inverse_mass, dt, found, sliding, sums)
    for n in watched:
        if n >= n_rail:
            sums[TOWED] += found.force[n, 0]
            sums[CARRIED] += found.force[n, 2]
    return lost
