"""What one thread of the one block that computes contact does of a step: its share of the pairs, then of the nodes.

Pairs are computed as on the processor, by the same functions. What pairs give to nodes is gathered: a node takes what
its own pair has, then what the pairs over the facets around it have, in the order of their numbers, so that no thread
adds to what another adds to and a step gives the same bits every time. Between the functions all threads meet
(rail_fem.fe.card.kernels).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kernel_cache import njit
from rail_fem.fe.contact.friction import rub, settle_slip
from rail_fem.fe.contact.pairs import (
    AXLE_MOMENT,
    CARRIED,
    FRICTION_WORK,
    N_ACTIVE,
    N_SUMS,
    NORMAL_ENERGY,
    TOWED,
    Law,
    NodalForces,
    Nodes,
    Pairs,
    Sliding,
)
from rail_fem.fe.contact.pressure import next_pressure, pair_mobility
from rail_fem.fe.contact.projection import project_pair, take_pair
from rail_fem.fe.contact.search import SOON

_part = njit(forceinline=True, cache=True, error_model="numpy")
# columns of the threads' sums after those of a step: forces and moments of node_kernels.add_step, pairs that were lost
FORCES, MOMENT, LOST = N_SUMS, N_SUMS + 5, N_SUMS + 9
N_COLUMNS = N_SUMS + 10
# of the wheel's motion: how far it is, spin; works of friction, of towing and driving, of rotation; since last read
OFFSET, SPIN, FRICTION, MOTION, ROTATION = range(5)
N_MOTION = 5
TO_SEARCH, LEFT, GOES = range(3)  # counters: steps to the next search, steps asked for, whether this one is made


class FacetLists(NamedTuple):
    """Which pairs lie over the facets around a node. first, facet, corner : (n+1,), (m,), (m,) facets around each
    surface node and its corner there;  pair_of : (n,) the pair whose slave it is, -1 none

    head (facets,), after (pairs,) : the pairs over each facet, -1 the end, over the wheel's and over the rail's
    """

    first: np.ndarray
    facet: np.ndarray
    corner: np.ndarray
    pair_of: np.ndarray
    head_wheel: np.ndarray
    after_rail: np.ndarray
    head_rail: np.ndarray
    after_wheel: np.ndarray


class GivenToNodes(NamedTuple):
    """What pairs give to nodes, of the rail's and of the wheel's: amount (k,), vector (k, 3); state : (k, 4) of
    rail_fem.fe.contact.pressure.take_active"""

    rail_amount: np.ndarray
    wheel_amount: np.ndarray
    rail_vector: np.ndarray
    wheel_vector: np.ndarray
    rail_state: np.ndarray
    wheel_state: np.ndarray


class CardContact(NamedTuple):
    """All of a contact. watched : (w,) surface nodes;  local : (n,) their nodes;  region : (n_rail,) their bodies;
    speed [m/s], inertia [kg m2] (inf: the spin is held), yaw
    rows : (pairs, PROJECTION), the rail's first;  push : (n, 3);  room : (threads, 7, 3);  sums : (threads, N_COLUMNS)
    step : (N_SUMS,) sums of the last step;  recorded : (9,) since last read;  motion : (N_MOTION,)
    surface : (n, 6) positions and velocities for a search
    """

    on_rail: Pairs
    on_wheel: Pairs
    nodes: Nodes
    law: Law
    found: NodalForces
    sliding: Sliding
    lists: FacetLists
    given: GivenToNodes
    watched: np.ndarray
    local: np.ndarray
    region: np.ndarray
    speed: float
    inertia: float
    yaw: float
    rows: np.ndarray
    push: np.ndarray
    room: np.ndarray
    sums: np.ndarray
    step: np.ndarray
    recorded: np.ndarray
    motion: np.ndarray
    surface: np.ndarray


@_part
def scalar_at(n, lists, own, over, weight, head, after):
    """What node n gets: its own pair's amount, `own`, and shares of the amounts `over` the facets around it."""
    total = 0.0
    if lists.pair_of[n] >= 0:
        total += own[lists.pair_of[n]]
    for m in range(lists.first[n], lists.first[n + 1]):
        i, k = head[lists.facet[m]], lists.corner[m]
        while i >= 0:
            total += weight[i, k] * over[i]
            i = after[i]
    return total


@_part
def vector_at(n, lists, own, over, weight, head, after, out):
    """The same of vectors, those over the facets taken off -> out (3,)."""
    j = lists.pair_of[n]
    for c in range(3):
        out[c] = own[j, c] if j >= 0 else 0.0
    for m in range(lists.first[n], lists.first[n + 1]):
        i, k = head[lists.facet[m]], lists.corner[m]
        while i >= 0:
            for c in range(3):
                out[c] -= weight[i, k] * over[i, c]
            i = after[i]


@_part
def amount_at(n, t):
    """`scalar_at` of either surface: pairs of the other one lie over the facets of this."""
    g, s = t.given, t.lists
    if n < t.region.size:
        return scalar_at(n, s, g.rail_amount, g.wheel_amount, t.on_wheel.weight, s.head_rail, s.after_wheel)
    return scalar_at(n, s, g.wheel_amount, g.rail_amount, t.on_rail.weight, s.head_wheel, s.after_rail)


@_part
def all_at(n, t, out):
    """`vector_at` of either surface."""
    g, s = t.given, t.lists
    if n < t.region.size:
        vector_at(n, s, g.rail_vector, g.wheel_vector, t.on_wheel.weight, s.head_rail, s.after_wheel, out)
    else:
        vector_at(n, s, g.wheel_vector, g.rail_vector, t.on_rail.weight, s.head_wheel, s.after_rail, out)


@_part
def collect_motion(n, x, v, t):
    """Position and velocity of surface node n -> surface."""
    for c in range(3):
        t.surface[n, c], t.surface[n, 3 + c] = x[3 * t.local[n] + c], v[3 * t.local[n] + c]


@_part
def unpack_nodes(thread, threads, x, v, dt, t):
    """Where watched nodes are now and, without contact, after the step; what a step finds at nodes begins at 0."""
    travel = dt * t.speed
    for c in range(N_COLUMNS):
        t.sums[thread, c] = 0.0
    for j in range(thread, t.watched.size, threads):
        n = t.watched[j]
        for c in range(3):
            now = x[3 * t.local[n] + c]
            t.nodes.before[n, c], t.nodes.position[n, c] = now, now + dt * v[3 * t.local[n] + c]
            t.found.force[n, c] = 0.0
        if n >= t.region.size:
            t.nodes.before[n, 0] += t.motion[OFFSET]
            t.nodes.position[n, 0] += t.motion[OFFSET] + travel
        t.found.tributary_area[n], t.found.normal_force[n], t.found.pressure_at[n] = 0.0, 0.0, 0.0


@_part
def project_pairs_of(thread, threads, t, pairs, rows, head, own, sums):
    """Projections of this thread's pairs, which of them are active, and the area that each gives; the lists over their
    facets begin empty."""
    room = t.room[thread]
    for i in range(thread, pairs.slaves.size, threads):
        rows[i] = 0.0
        if pairs.facets[i] >= 0:
            head[pairs.facets[i]] = -1
        project_pair(t.nodes.position, pairs, i, rows, room[0], room[1], room[2])
        sums[LOST] += take_pair(rows, pairs, i)
        pairs.active[i] = pairs.facets[i] >= 0 and -t.law.deepest < pairs.gap[i] < 0.0
        own[i] = 0.5 * t.nodes.area[pairs.slaves[i]] if pairs.active[i] else 0.0
        if pairs.facets[i] >= 0:
            head[pairs.facets[i]] = -1


@_part
def project_all(thread, threads, t):
    split, own, g = t.on_rail.slaves.size, t.sums[thread], t.given
    project_pairs_of(thread, threads, t, t.on_rail, t.rows[:split], t.lists.head_wheel, g.rail_amount, own)
    project_pairs_of(thread, threads, t, t.on_wheel, t.rows[split:], t.lists.head_rail, g.wheel_amount, own)


@_part
def order_list(first, after):
    """A list of pairs in the order of their numbers; returns its head. By insertion: few lie over a facet."""
    head = -1
    while first >= 0:
        i, first = first, after[first]
        if head < 0 or i < head:
            after[i], head = head, i
            continue
        at = head
        while after[at] >= 0 and after[at] < i:
            at = after[at]
        after[i], after[at] = after[at], i
    return head


@_part
def order_lists(thread, threads, head, after):
    for f in range(thread, head.size, threads):
        head[f] = order_list(head[f], after)


@_part
def spread_area(thread, threads, t):
    """Area that all active pairs put on each node."""
    for j in range(thread, t.watched.size, threads):
        t.found.tributary_area[t.watched[j]] = amount_at(t.watched[j], t)


@_part
def begin_pressures(thread, threads, t, dt, pairs, state):
    for i in range(thread, pairs.slaves.size, threads):
        state[i] = 0.0
        if pairs.active[i]:
            mobility = pair_mobility(pairs, i, t.found.tributary_area, t.nodes.inverse_mass)
            state[i, 0], state[i, 1] = pairs.gap[i], t.law.compliance + dt * dt * mobility


@_part
def give_trials(thread, threads, t, pairs, state, amount, vector, column):
    """Pressures of a column of `state` as forces of half of the area along the normals."""
    for i in range(thread, pairs.slaves.size, threads):
        f = 0.5 * t.nodes.area[pairs.slaves[i]] * state[i, column] if pairs.active[i] else 0.0
        amount[i] = f
        for c in range(3):
            vector[i, c] = f * pairs.normal[i, c] if f != 0.0 else 0.0


@_part
def push_nodes(thread, threads, t):
    """What all trial pressures give to the nodes [m/s2]."""
    for j in range(thread, t.watched.size, threads):
        n = t.watched[j]
        all_at(n, t, t.push[n])
        for c in range(3):
            t.push[n, c] *= t.nodes.inverse_mass[n]


@_part
def sweep_pairs(thread, threads, t, dt, pairs, state, momentum):
    """The pairs' part of a sweep (rail_fem.fe.contact.pressure.sweep_once)."""
    for i in range(thread, pairs.slaves.size, threads):
        if pairs.active[i]:
            s, q, opening = pairs.slaves[i], pairs.quads[pairs.facets[i]], 0.0
            for c in range(3):
                moved = t.push[s, c]
                for k in range(4):
                    moved -= pairs.weight[i, k] * t.push[q[k], c]
                opening += moved * pairs.normal[i, c]
            next_pressure(state, i, opening, t.law, dt, momentum)


@_part
def take_pressures(thread, threads, t, pairs, state):
    sums = t.sums[thread]
    for i in range(thread, pairs.slaves.size, threads):
        p = state[i, 2] if pairs.active[i] else 0.0
        pairs.pressure[i] = t.found.pressure_at[pairs.slaves[i]] = p
        if pairs.active[i]:
            sums[NORMAL_ENERGY] += 0.25 * t.nodes.area[pairs.slaves[i]] * p * p * t.law.compliance
            sums[N_ACTIVE] += 1.0


@_part
def press_nodes(thread, threads, t):
    """Normal forces at the nodes."""
    for j in range(thread, t.watched.size, threads):
        n = t.watched[j]
        t.found.normal_force[n] = amount_at(n, t)
        all_at(n, t, t.found.force[n])


@_part
def choose_rubbing(thread, threads, t):
    """The rail's pairs whose node carries normal force rub, with all of its area; the wheel's do not."""
    pairs, g = t.on_rail, t.given
    for i in range(thread, pairs.slaves.size, threads):
        pairs.active[i] = pairs.facets[i] >= 0 and t.found.normal_force[pairs.slaves[i]] > 0.0
        g.rail_amount[i] = t.nodes.area[pairs.slaves[i]] if pairs.active[i] else 0.0
    for i in range(thread, t.on_wheel.slaves.size, threads):
        g.wheel_amount[i] = 0.0
        for c in range(3):
            g.wheel_vector[i, c] = 0.0


@_part
def rub_pairs(thread, threads, t, dt):
    pairs, found, vector, room, sums = t.on_rail, t.found, t.given.rail_vector, t.room[thread], t.sums[thread]
    for i in range(thread, pairs.slaves.size, threads):
        if pairs.active[i]:
            flow, trial, t1, t2, r1, r2, point = room[0], room[1], room[2], room[3], room[4], room[5], room[6]
            spin, sliding = t.motion[SPIN], t.sliding
            rub(pairs, i, t.nodes, t.law, spin, t.yaw, dt, found, sliding, sums, flow, trial, t1, t2, r1, r2, point)
        for c in range(3):
            vector[i, c] = -t.sliding.drag[i, c] if pairs.active[i] else 0.0
            if not pairs.active[i]:
                found.slip[pairs.slaves[i], c] = 0.0


@_part
def drag_nodes(thread, threads, t):
    """Friction onto the forces at the nodes."""
    for j in range(thread, t.watched.size, threads):
        n = t.watched[j]
        all_at(n, t, t.push[n])
        for c in range(3):
            t.found.force[n, c] += t.push[n, c]


@_part
def settle_slips(thread, threads, t, dt):
    for i in range(thread, t.on_rail.slaves.size, threads):
        if t.on_rail.active[i]:
            settle_slip(t.on_rail, i, t.nodes.inverse_mass, dt, t.found, t.sliding, t.sums[thread])


@_part
def add_up(thread, threads, t):
    """Sums over the nodes: what tows the wheel, and what is recorded of a step (rail_fem.fe.node_kernels.add_step)."""
    sums, force = t.sums[thread], t.found.force
    for j in range(thread, t.watched.size, threads):
        n = t.watched[j]
        if n >= t.region.size:
            sums[TOWED] += force[n, 0]
            sums[CARRIED] += force[n, 2]
            continue
        f = t.found.normal_force[n]
        if f != 0.0:
            sums[FORCES] -= force[n, 2]
            sums[FORCES + 1 + t.region[n]] -= force[n, 2]
            sums[FORCES + 3] -= force[n, 0]
            sums[FORCES + 4] -= force[n, 1]
            sums[MOMENT] += f
            sums[MOMENT + 1] += f * t.nodes.position[n, 0]
            sums[MOMENT + 2] += f * t.nodes.position[n, 1]
            sums[MOMENT + 3] += f * f / t.nodes.area[n]


@_part
def close_step(t, dt, counters):
    """The wheel's motion after the step, from the sums of all threads in the first row; how many steps are left."""
    sums, motion = t.sums[0], t.motion
    for c in range(N_SUMS):
        t.step[c] = sums[c]
    for c in range(9):
        t.recorded[c] += sums[FORCES + c]
    before = motion[SPIN]
    motion[SPIN] = before + dt * sums[AXLE_MOMENT] / t.inertia
    turning = dt * sums[AXLE_MOMENT] * 0.5 * (before + motion[SPIN])
    motion[FRICTION] += sums[FRICTION_WORK]
    motion[MOTION] += dt * t.speed * sums[TOWED]
    motion[ROTATION] += turning
    motion[OFFSET] += dt * t.speed
    counters[TO_SEARCH] -= 1
    if sums[LOST] > 0.0:
        counters[TO_SEARCH] = min(counters[TO_SEARCH], SOON)
    counters[LEFT] -= 1
