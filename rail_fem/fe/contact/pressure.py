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

from kernel_cache import njit

_part = njit(forceinline=True, error_model="numpy")
SWEEPS, MOMENTUM = 6, 0.5


@_part
def add_tributary_areas(pairs, area, factor, tributary_area):
    """Area that all active pairs put on each node -> tributary_area (n,)."""
    for i in range(pairs.slaves.size):
        if pairs.active[i]:
            s = pairs.slaves[i]
            a = factor * area[s]
            tributary_area[s] += a
            for k in range(4):
                tributary_area[pairs.quads[pairs.facets[i], k]] += pairs.weight[i, k] * a


@_part
def pair_mobility(pairs, i, tributary_area, inverse_mass):
    """D of pair i: what its pressure moves its gap by, over dt^2 [m3/kg]."""
    s, q = pairs.slaves[i], pairs.quads[pairs.facets[i]]
    d = tributary_area[s] * inverse_mass[s]
    for k in range(4):
        d += pairs.weight[i, k] * tributary_area[q[k]] * inverse_mass[q[k]]
    return d


@_part
def take_active(pairs, nodes, law, dt, tributary_area, factor, at, node, weight, moves, normal, state):
    """Active pairs of one surface from row `at` on, side by side in memory; returns the row after the last.

    node (k, 5) : the slave and the facet's four;  weight : of the pair's gap on their displacements along the normal;
    moves : what a pressure of 1 gives to their velocities, over dt [m/s2/Pa];  normal (k, 3)
    state (k, 4) : gap [m], what it moves by under a pressure of 1 [m/Pa], pressure, trial pressure [Pa], both 0
    """
    for i in range(pairs.slaves.size):
        pairs.pressure[i] = 0.0
        if not pairs.active[i]:
            continue
        s, q = pairs.slaves[i], pairs.quads[pairs.facets[i]]
        push = factor * nodes.area[s]
        node[at, 0], weight[at, 0], moves[at, 0] = s, 1.0, push * nodes.inverse_mass[s]
        for k in range(4):
            w = -pairs.weight[i, k]
            node[at, 1 + k], weight[at, 1 + k], moves[at, 1 + k] = q[k], w, w * push * nodes.inverse_mass[q[k]]
        for c in range(3):
            normal[at, c] = pairs.normal[i, c]
        mobility = pair_mobility(pairs, i, tributary_area, nodes.inverse_mass)
        state[at, 0], state[at, 1] = pairs.gap[i], law.compliance + dt * dt * mobility
        state[at, 2] = state[at, 3] = 0.0
        at += 1
    return at


@_part
def sweep_once(law, dt, node, weight, moves, normal, state, push, momentum):
    """One sweep: every pressure by what its pair is apart from gap = -pressure / k after what all trial pressures give
    to the nodes, `push` (n, 3) [m/s2]; none below 0. The next trial goes on by `momentum` of the change."""
    for i in range(state.shape[0]):
        trial = state[i, 3]
        if trial != 0.0:
            for k in range(5):
                n, size = node[i, k], moves[i, k] * trial
                for c in range(3):
                    push[n, c] += size * normal[i, c]
    for i in range(state.shape[0]):
        opening = 0.0
        for k in range(5):
            n = node[i, k]
            along = push[n, 0] * normal[i, 0] + push[n, 1] * normal[i, 1] + push[n, 2] * normal[i, 2]
            opening += weight[i, k] * along
        trial, before = state[i, 3], state[i, 2]
        apart = state[i, 0] + dt * dt * opening + law.compliance * trial
        pressure = max(trial - apart / state[i, 1], 0.0)
        state[i, 2], state[i, 3] = pressure, pressure + momentum * (pressure - before)


@_part
def find_pressures(on_rail, on_wheel, watched, nodes, law, dt, tributary_area, push):
    """Pressures of all active pairs of both passes, each with half of the area -> pairs.pressure [Pa].

    tributary_area : (n,) of the active pairs [m2];  push : (n, 3) scratch, overwritten on `watched`
    """
    count = 0
    for side in range(2):
        for active in (on_wheel if side else on_rail).active:
            count += active
    node, weight, moves = np.empty((count, 5), np.int64), np.empty((count, 5)), np.empty((count, 5))
    normal, state = np.empty((count, 3)), np.empty((count, 4))
    at = 0
    for side in range(2):
        pairs = on_wheel if side else on_rail
        at = take_active(pairs, nodes, law, dt, tributary_area, 0.5, at, node, weight, moves, normal, state)
    for sweep in range(SWEEPS):
        for n in watched:
            push[n, 0] = push[n, 1] = push[n, 2] = 0.0
        sweep_once(law, dt, node, weight, moves, normal, state, push, MOMENTUM if sweep else 0.0)
    at = 0
    for side in range(2):
        pairs = on_wheel if side else on_rail
        for i in range(pairs.slaves.size):
            if pairs.active[i]:
                pairs.pressure[i] = state[at, 2]
                at += 1
    for n in watched:
        push[n, 0] = push[n, 1] = push[n, 2] = 0.0
