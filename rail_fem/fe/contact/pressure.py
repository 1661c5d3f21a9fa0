"""Normal pressures of the pairs in contact, found together: what one pair's pressure moves, its neighbours feel.

Gaps that nodes would have at the end of the step are given; pressures p >= 0 are sought that leave
    gap + dt^2 A p = -p / k   where p > 0,   and no less where p = 0,
A what all pressures of the step together move each gap by, over dt^2, and k the penalty stiffness per area. With the
row sum D of A in place of A every pair is alone, p = -gap / (1/k + dt^2 D): stable at any k, but where pressure changes
from node to node a pair that carries more than its neighbours is left to overlap by dt^2 (D - A) p, a tenth of the
approach at elements of 2 mm. So the equation is solved by a few sweeps of Jacobi with D, with momentum. No eigenvalue
of A over D lies above 1: every sweep is stable, and the step with it.

Compiled, allocation-free, no mesh.
Source: Carpenter, Taylor and Katona, IJNME 32 (1991) 103 (forward increment Lagrange multipliers); momentum as in
Nesterov's gradient method (from memory, not verified).
"""

from __future__ import annotations

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
def begin_pressures(pairs, nodes, law, dt, tributary_area):
    """No pressure yet; what each active pair's gap moves by under a pressure of 1 -> `yielding` [m/Pa]."""
    for i in range(pairs.slaves.size):
        pairs.pressure[i] = pairs.trial[i] = pairs.yielding[i] = 0.0
        if pairs.active[i]:
            mobility = pair_mobility(pairs, i, tributary_area, nodes.inverse_mass)
            pairs.yielding[i] = law.compliance + dt * dt * mobility


@_part
def add_pushes(pairs, nodes, factor, push):
    """What the trial pressures of one pass give to the nodes' velocities, over dt -> push (n, 3) [m/s2]."""
    for i in range(pairs.slaves.size):
        if pairs.active[i] and pairs.trial[i] != 0.0:
            s, q = pairs.slaves[i], pairs.quads[pairs.facets[i]]
            f = factor * nodes.area[s] * pairs.trial[i]
            for c in range(3):
                push[s, c] += f * nodes.inverse_mass[s] * pairs.normal[i, c]
            for k in range(4):
                other = pairs.weight[i, k] * f * nodes.inverse_mass[q[k]]
                for c in range(3):
                    push[q[k], c] -= other * pairs.normal[i, c]


@_part
def correct_pressures(pairs, law, dt, push, momentum):
    """One sweep: every pressure by what its pair is apart from gap = -pressure / k after `push`; none below 0. The next
    trial goes on by `momentum` of the change."""
    for i in range(pairs.slaves.size):
        if pairs.active[i]:
            s, q = pairs.slaves[i], pairs.quads[pairs.facets[i]]
            opening = 0.0
            for c in range(3):
                move = push[s, c]
                for k in range(4):
                    move -= pairs.weight[i, k] * push[q[k], c]
                opening += move * pairs.normal[i, c]
            apart = pairs.gap[i] + dt * dt * opening + law.compliance * pairs.trial[i]
            before = pairs.pressure[i]
            p = max(pairs.trial[i] - apart / pairs.yielding[i], 0.0)
            pairs.pressure[i] = p
            pairs.trial[i] = p + momentum * (p - before)


@_part
def find_pressures(on_rail, on_wheel, watched, nodes, law, dt, tributary_area, push):
    """Pressures of all active pairs of both passes, each with half of the area -> pairs.pressure [Pa].

    tributary_area : (n,) of the active pairs [m2];  push : (n, 3) scratch, overwritten on `watched`
    """
    for side in range(2):
        begin_pressures(on_wheel if side else on_rail, nodes, law, dt, tributary_area)
    for sweep in range(SWEEPS):
        for n in watched:
            push[n, 0] = push[n, 1] = push[n, 2] = 0.0
        for side in range(2):
            add_pushes(on_wheel if side else on_rail, nodes, 0.5, push)
        for side in range(2):
            correct_pressures(on_wheel if side else on_rail, law, dt, push, MOMENTUM if sweep else 0.0)
    for n in watched:
        push[n, 0] = push[n, 1] = push[n, 2] = 0.0
