"""Normal pressures of the pairs in contact, found together: what one pair's pressure moves, its neighbours feel.

Gaps that nodes would have at the end of the step are given; pressures p >= 0 are sought that leave
    gap + dt^2 A p = -p / k   where p > 0,   and no less where p = 0,
A what all pressures of the step together move each gap by, over dt^2, and k the penalty stiffness per area. With the
row sum D of A in place of A every pair is alone, p = -gap / (1/k + dt^2 D): stable at any k, but where pressure changes
from node to node a pair that carries more than its neighbours is left to overlap by dt^2 (D - A) p, a tenth of the
approach at elements of 2 mm. So the equation is solved by a few sweeps of Jacobi with D, with momentum. No eigenvalue
of A over D lies above 1: every sweep is stable, and the step with it.

Compiled, allocation-free but for the active pairs side by side, no mesh.
Source: Carpenter, Taylor and Katona, IJNME 32 (1991) 103 (forward increment Lagrange multipliers); momentum as in
Nesterov's gradient method (from memory, not verified).
"""

from __future__ import annotations

import numpy as np

from kernel_cache import UNCOUNTED, njit
from rail_fem.fe.contact.compiled import inlined, uncounted

_fast = njit(forceinline=True, error_model="numpy", fastmath={"contract"}, **UNCOUNTED)
SWEEPS, MOMENTUM = 6, 0.5


@uncounted
def add_tributary_areas(pairs, area, factor, tributary_area):
    """Area that all active pairs put on each node -> tributary_area (n,)."""
    for i in range(pairs.slaves.size):
        if pairs.active[i]:
            s = pairs.slaves[i]
            a = factor * area[s]
            tributary_area[s] += a
            for k in range(4):
                tributary_area[pairs.quads[pairs.facets[i], k]] += pairs.weight[i, k] * a


@uncounted
def pair_mobility(pairs, i, tributary_area, inverse_mass):
    """D of pair i: what its pressure moves its gap by, over dt^2 [m3/kg]."""
    s, q = pairs.slaves[i], pairs.quads[pairs.facets[i]]
    d = tributary_area[s] * inverse_mass[s]
    for k in range(4):
        d += pairs.weight[i, k] * tributary_area[q[k]] * inverse_mass[q[k]]
    return d


@uncounted
def number_nodes(on_rail, on_wheel, slot):
    """Nodes of the active pairs of both surfaces, numbered as they are met -> slot (n,), -1 elsewhere; how many."""
    count = 0
    for side in range(2):
        pairs = on_wheel if side else on_rail
        for i in range(pairs.slaves.size):
            if not pairs.active[i]:
                continue
            q = pairs.quads[pairs.facets[i]]
            for k in range(5):
                n = pairs.slaves[i] if k == 4 else q[k]
                if slot[n] < 0:
                    slot[n] = count
                    count += 1
    return count


@uncounted
def take_active(pairs, nodes, law, dt, tributary_area, factor, slot, at, node, weight, moves, normal, state):
    """Active pairs of one surface from row `at` on, side by side in memory; returns the row after the last.

    slot : (n,) number of each node among those of the active pairs
    node (k, 5) : that of the slave and of the facet's four;  weight : of the pair's gap on their displacements along
        the normal;  moves : what a pressure of 1 gives to their velocities, over dt [m/s2/Pa];  normal (k, 3)
    state (k, 4) : gap [m], what it moves by under a pressure of 1 [m/Pa], pressure, trial pressure [Pa], both 0
    """
    for i in range(pairs.slaves.size):
        pairs.pressure[i] = 0.0
        if not pairs.active[i]:
            continue
        s, q = pairs.slaves[i], pairs.quads[pairs.facets[i]]
        push = factor * nodes.area[s]
        node[at, 0], weight[at, 0], moves[at, 0] = slot[s], 1.0, push * nodes.inverse_mass[s]
        for k in range(4):
            w = -pairs.weight[i, k]
            node[at, 1 + k], weight[at, 1 + k], moves[at, 1 + k] = slot[q[k]], w, w * push * nodes.inverse_mass[q[k]]
        for c in range(3):
            normal[at, c] = pairs.normal[i, c]
        mobility = pair_mobility(pairs, i, tributary_area, nodes.inverse_mass)
        state[at, 0], state[at, 1] = pairs.gap[i], law.compliance + dt * dt * mobility
        state[at, 2] = state[at, 3] = 0.0
        at += 1
    return at


@_fast
def next_pressure(state, i, opening, law, dt, momentum):
    """The part of pair i in a sweep, which opens it at `opening` [m/s2]. state : (k, 4) see `take_active`"""
    trial, before = state[i, 3], state[i, 2]
    apart = state[i, 0] + dt * dt * opening + law.compliance * trial
    pressure = max(trial - apart / state[i, 1], 0.0)
    state[i, 2], state[i, 3] = pressure, pressure + momentum * (pressure - before)


@_fast
def sweep_once(law, dt, node, weight, moves, normal, state, push, momentum):
    """One sweep: every pressure by what its pair is apart from gap = -pressure / k after what all trial pressures give
    to the nodes, `push` (m, 3) [m/s2], overwritten; none below 0. The next trial goes on by `momentum` of the
    change."""
    push[:] = 0.0
    for i in range(state.shape[0]):
        trial = state[i, 3]
        if trial != 0.0:
            x, y, z = trial * normal[i, 0], trial * normal[i, 1], trial * normal[i, 2]
            for k in range(5):
                n, size = node[i, k], moves[i, k]
                push[n, 0] += size * x
                push[n, 1] += size * y
                push[n, 2] += size * z
    for i in range(state.shape[0]):
        x = y = z = 0.0
        for k in range(5):
            n, size = node[i, k], weight[i, k]
            x += size * push[n, 0]
            y += size * push[n, 1]
            z += size * push[n, 2]
        opening = x * normal[i, 0] + y * normal[i, 1] + z * normal[i, 2]
        next_pressure(state, i, opening, law, dt, momentum)


@inlined
def find_pressures(on_rail, on_wheel, nodes, law, dt, tributary_area, slot):
    """Pressures of all active pairs of both passes, each with half of the area -> pairs.pressure [Pa].

    tributary_area : (n,) of the active pairs [m2];  slot : (n,) scratch, -1 before and after
    """
    count = 0
    for side in range(2):
        for active in (on_wheel if side else on_rail).active:
            count += active
    # what is not signed needs no test at every access
    node, weight, moves = np.empty((count, 5), np.uint64), np.empty((count, 5)), np.empty((count, 5))
    normal, state = np.empty((count, 3)), np.empty((count, 4))
    push = np.empty((number_nodes(on_rail, on_wheel, slot), 3))
    at = 0
    for side in range(2):
        pairs = on_wheel if side else on_rail
        at = take_active(pairs, nodes, law, dt, tributary_area, 0.5, slot, at, node, weight, moves, normal, state)
    for sweep in range(SWEEPS):
        sweep_once(law, dt, node, weight, moves, normal, state, push, MOMENTUM if sweep else 0.0)
    at = 0
    for side in range(2):
        pairs = on_wheel if side else on_rail
        for i in range(pairs.slaves.size):
            if not pairs.active[i]:
                continue
            pairs.pressure[i] = state[at, 2]
            at += 1
            q = pairs.quads[pairs.facets[i]]
            slot[pairs.slaves[i]] = -1
            for k in range(4):
                slot[q[k]] = -1
