"""Compiled loops over the nodes that ride on a condensed body (rail_fem.fe.elastic_group).

They stand here, with nothing of the solver imported, so that an edit elsewhere does not have them compiled again
(kernel_cache).
"""

from __future__ import annotations

from kernel_cache import njit


@njit(cache=True, fastmath={"contract"}, error_model="numpy")
def work_on_functions(force, members, owned, functions, out):
    """Generalised forces of displacement functions (3 k, f) under forces (3 n,) [N] on nodes `members` (k,), of which
    those below `owned` count, out (f,) [N], overwritten."""
    out[:] = 0.0
    for k in range(members.size):
        if members[k] >= owned:
            continue
        for c in range(3):
            f = force[3 * members[k] + c]
            for j in range(out.size):
                out[j] += f * functions[3 * k + c, j]


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"}, error_model="numpy")
def add_velocity_of_functions(v, members, functions, rates):
    """Velocities of displacement functions (3 k, f) at rates (f,) [m/s] onto nodes `members` (k,), added in v
    (3 n,)."""
    for k in range(members.size):
        for c in range(3):
            total = 0.0
            for j in range(rates.size):
                total += functions[3 * k + c, j] * rates[j]
            v[3 * members[k] + c] += total
