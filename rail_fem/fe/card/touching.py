"""What the threads of the one block that computes contact do in a step, for one pair or one node.

Pairs are computed as on the processor, by the same functions, those of both surfaces in one list. What pairs give to
nodes is gathered: a node takes what its own pair has, then what the pairs over the facets around it have, in the order
of their numbers, so that no thread adds to what another adds to and a step gives the same bits every time. Between the
functions all threads meet (rail_fem.fe.card.kernels), which deals the numbers out: i of a pair, j of a watched node, f
of a facet.
"""

from __future__ import annotations

from kernel_cache import njit
from rail_fem.fe.card import arrays
from rail_fem.fe.contact.friction import rub, settle_slip
from rail_fem.fe.contact.pairs import AXLE_MOMENT, CARRIED, FRICTION_WORK, N_ACTIVE, N_SUMS, NORMAL_ENERGY, TOWED
from rail_fem.fe.contact.pressure import next_pressure, pair_mobility
from rail_fem.fe.contact.projection import project_pair, take_pair
from rail_fem.fe.contact.search import SOON

_part = njit(forceinline=True, cache=True, error_model="numpy")


@_part
def gather_at(n, t):
    """What surface node n gets -> push: what its own pair gives, and of the pairs over the facets around it their
    shares of the amount, and against them of the vector."""
    j, out = t.pair_of[n], t.push[n]
    for c in range(4):
        out[c] = t.given[j, c] if j >= 0 else 0.0
    for m in range(t.first[n], t.first[n + 1]):
        i, k = t.head[t.facet[m]], t.corner[m]
        while i >= 0:
            weight = t.pairs.weight[i, k]
            out[0] += weight * t.given[i, 0]
            for c in range(1, 4):
                out[c] -= weight * t.given[i, c]
            i = t.after[i]


@_part
def collect_motion(n, a):
    """Position and velocity of a surface node -> surface."""
    t = a.contact
    for c in range(3):
        t.surface[n, c], t.surface[n, 3 + c] = a.nodes.x[3 * t.local[n] + c], a.nodes.v[3 * t.local[n] + c]


@_part
def clear_sums(thread, _, a):
    for c in range(arrays.N_COLUMNS):
        a.contact.sums[thread, c] = 0.0


@_part
def clear_list(f, _, a):
    a.contact.head[f] = -1


@_part
def unpack_node(j, _, a):
    """Where a watched node is now and, without contact, after the step; what a step finds at it begins at 0."""
    t, n = a.contact, a.contact.watched[j]
    for c in range(3):
        now = a.nodes.x[3 * t.local[n] + c]
        t.nodes.before[n, c], t.nodes.position[n, c] = now, now + a.dt * a.nodes.v[3 * t.local[n] + c]
        t.found.force[n, c] = 0.0
    if n >= t.region.size:
        t.nodes.before[n, 0] += t.motion[arrays.OFFSET]
        t.nodes.position[n, 0] += t.motion[arrays.OFFSET] + a.dt * t.motion[arrays.SPEED]
    t.found.tributary_area[n], t.found.normal_force[n], t.found.pressure_at[n] = 0.0, 0.0, 0.0


@_part
def find_pair(i, thread, a):
    """Projection of a pair, whether it is active, and the area that it gives."""
    t = a.contact
    pairs, room = t.pairs, t.room[thread]
    t.rows[i] = 0.0
    project_pair(t.nodes.position, pairs, i, t.rows, room[0], room[1], room[2])
    t.sums[thread, arrays.LOST] += take_pair(t.rows, pairs, i)
    pairs.active[i] = pairs.facets[i] >= 0 and -t.law.deepest < pairs.gap[i] < 0.0
    t.given[i, 0] = 0.5 * t.nodes.area[pairs.slaves[i]] if pairs.active[i] else 0.0


@_part
def order_list(f, _, a):
    """The list of pairs over a facet in the order of their numbers. By insertion: few lie over one."""
    after, first, head = a.contact.after, a.contact.head[f], -1
    while first >= 0:
        i, first = first, after[first]
        if head < 0 or i < head:
            after[i], head = head, i
            continue
        at = head
        while after[at] >= 0 and after[at] < i:
            at = after[at]
        after[i], after[at] = after[at], i
    a.contact.head[f] = head


@_part
def spread_area(j, _, a):
    """Area that all active pairs put on a node."""
    t, n = a.contact, a.contact.watched[j]
    gather_at(n, t)
    t.found.tributary_area[n] = t.push[n, 0]


@_part
def begin_pressure(i, _, a):
    t = a.contact
    t.state[i] = 0.0
    if t.pairs.active[i]:
        mobility = pair_mobility(t.pairs, i, t.found.tributary_area, t.nodes.inverse_mass)
        t.state[i, 0], t.state[i, 1] = t.pairs.gap[i], t.law.compliance + a.dt * a.dt * mobility


@_part
def give_trial(i, _, a):
    """A trial pressure as a force of half of the area along the normal."""
    t = a.contact
    f = 0.5 * t.nodes.area[t.pairs.slaves[i]] * t.state[i, 3] if t.pairs.active[i] else 0.0
    t.given[i, 0] = f
    for c in range(3):
        t.given[i, 1 + c] = f * t.pairs.normal[i, c] if f != 0.0 else 0.0


@_part
def push_node(j, _, a):
    """What all trial pressures give to a node [m/s2]."""
    t, n = a.contact, a.contact.watched[j]
    gather_at(n, t)
    for c in range(1, 4):
        t.push[n, c] *= t.nodes.inverse_mass[n]


@_part
def sweep_pair(i, momentum, a):
    """The pair's part of a sweep (rail_fem.fe.contact.pressure.sweep_once)."""
    t, pairs = a.contact, a.contact.pairs
    if pairs.active[i]:
        s, q, opening = pairs.slaves[i], pairs.quads[pairs.facets[i]], 0.0
        for c in range(3):
            moved = t.push[s, 1 + c]
            for k in range(4):
                moved -= pairs.weight[i, k] * t.push[q[k], 1 + c]
            opening += moved * pairs.normal[i, c]
        next_pressure(t.state, i, opening, t.law, a.dt, momentum)


@_part
def take_pressure(i, thread, a):
    t, pairs = a.contact, a.contact.pairs
    p = t.state[i, 2] if pairs.active[i] else 0.0
    pairs.pressure[i] = t.found.pressure_at[pairs.slaves[i]] = t.state[i, 3] = p
    if pairs.active[i]:
        t.sums[thread, NORMAL_ENERGY] += 0.25 * t.nodes.area[pairs.slaves[i]] * p * p * t.law.compliance
        t.sums[thread, N_ACTIVE] += 1.0


@_part
def load_node(j, _, a):
    """What pairs give onto the force at a node, amounts onto its normal force."""
    t, n = a.contact, a.contact.watched[j]
    gather_at(n, t)
    t.found.normal_force[n] += t.push[n, 0]
    for c in range(3):
        t.found.force[n, c] += t.push[n, 1 + c]


@_part
def choose_rubbing(i, _, a):
    """The rail's pairs whose node carries normal force rub, with all of its area; the wheel's do not."""
    t, s = a.contact, a.contact.pairs.slaves[i]
    for c in range(4):
        t.given[i, c] = 0.0
    if i < t.split:
        t.pairs.active[i] = t.pairs.facets[i] >= 0 and t.found.normal_force[s] > 0.0
        t.given[i, 0] = t.nodes.area[s] if t.pairs.active[i] else 0.0


@_part
def rub_pair(i, thread, a):
    t = a.contact
    pairs, found, room, sums = t.pairs, t.found, t.room[thread], t.sums[thread]
    if pairs.active[i]:
        flow, trial, t1, t2, r1, r2, point = room[0], room[1], room[2], room[3], room[4], room[5], room[6]
        spin, yaw, sliding = t.motion[arrays.SPIN], t.motion[arrays.YAW], t.sliding
        rub(pairs, i, t.nodes, t.law, spin, yaw, a.dt, found, sliding, sums, flow, trial, t1, t2, r1, r2, point)
    t.given[i, 0] = 0.0
    for c in range(3):
        t.given[i, 1 + c] = -t.sliding.drag[i, c] if pairs.active[i] else 0.0
        if not pairs.active[i]:
            found.slip[pairs.slaves[i], c] = 0.0


@_part
def settle_pair(i, thread, a):
    t = a.contact
    if t.pairs.active[i]:
        settle_slip(t.pairs, i, t.nodes.inverse_mass, a.dt, t.found, t.sliding, t.sums[thread])


@_part
def add_node(j, thread, a):
    """To the sums over the nodes: what tows the wheel, and what is recorded of a step
    (rail_fem.fe.node_kernels.add_step)."""
    t, n = a.contact, a.contact.watched[j]
    sums, force, f = t.sums[thread], t.found.force[n], t.found.normal_force[n]
    if n >= t.region.size:
        sums[TOWED] += force[0]
        sums[CARRIED] += force[2]
    elif f != 0.0:
        sums[arrays.FORCES] -= force[2]
        sums[arrays.FORCES + 1 + t.region[n]] -= force[2]
        sums[arrays.FORCES + 3] -= force[0]
        sums[arrays.FORCES + 4] -= force[1]
        sums[arrays.MOMENT] += f
        sums[arrays.MOMENT + 1] += f * t.nodes.position[n, 0]
        sums[arrays.MOMENT + 2] += f * t.nodes.position[n, 1]
        sums[arrays.MOMENT + 3] += f * f / t.nodes.area[n]


@_part
def close_step(a):
    """The wheel's motion after the step, from the sums of all threads in the first row; how many steps are left."""
    t = a.contact
    sums, motion, since = t.sums[0], t.motion, t.since
    for c in range(N_SUMS):
        t.step[c] = sums[c]
    for c in range(arrays.FORCES, arrays.LOST):
        since[c - arrays.FORCES] += sums[c]
    before = motion[arrays.SPIN]
    motion[arrays.SPIN] = before + a.dt * sums[AXLE_MOMENT] / motion[arrays.INERTIA]
    since[arrays.FRICTION] += sums[FRICTION_WORK]
    since[arrays.TOWING] += a.dt * motion[arrays.SPEED] * sums[TOWED]
    since[arrays.ROTATION] += a.dt * sums[AXLE_MOMENT] * 0.5 * (before + motion[arrays.SPIN])
    motion[arrays.OFFSET] += a.dt * motion[arrays.SPEED]
    a.counters[arrays.TO_SEARCH] -= 1
    if sums[arrays.LOST] > 0.0:
        a.counters[arrays.TO_SEARCH] = min(a.counters[arrays.TO_SEARCH], SOON)
    a.counters[arrays.LEFT] -= 1
