"""Blocks of LANES elements: how their kernels are compiled, and what goes in and out of a block.

Inside a block the fastest index is the element, its lane. Functions on tuples are the mathematics of one element;
others run them over the lanes of a block, and the compiler turns their loop into vector code: both are `inlined`. What
is `compiled` goes over all blocks.
"""

from __future__ import annotations

from kernel_cache import UNCOUNTED, njit
from rail_fem.fe.state import LANES

_W = LANES
# sums in any order, products and sums as one operation: without them there is no vector code
FAST = {"fastmath": {"contract", "reassoc", "nsz", "arcp"}, "error_model": "numpy"}
# one copy, inside its caller: by the compiler, after types are found, for numba's own `inline` finds them anew in each
inlined = njit(forceinline=True, **FAST)
compiled = njit(cache=True, **FAST)
uncounted = njit(forceinline=True, **UNCOUNTED, **FAST)  # a part that takes tables of arrays
thread = njit(forceinline=True, cache=True, **FAST)  # what one thread of a card does


@inlined
def load(a, s, k, e):
    """Entries k, k+1, k+2 of lane e of the block of `a` that starts at s."""
    return a[s + k * _W + e], a[s + (k + 1) * _W + e], a[s + (k + 2) * _W + e]


@inlined
def store(a, s, k, e, u):
    a[s + k * _W + e], a[s + (k + 1) * _W + e], a[s + (k + 2) * _W + e] = u[0], u[1], u[2]


@inlined
def gather_one(x, nodes, start, nodal):
    """One nodal vector of one block -> nodal (24*W,), ordered node, component, lane."""
    for a in range(8):
        for e in range(_W):
            n, k = 3 * nodes[start + a * _W + e], 3 * a * _W + e
            nodal[k], nodal[k + _W], nodal[k + 2 * _W] = x[n], x[n + 1], x[n + 2]


@inlined
def gather(x, v, nodes, start, nodal):
    """Two nodal vectors of one block -> nodal (48*W,), ordered vector, node, component, lane."""
    for a in range(8):
        for e in range(_W):
            n, k = 3 * nodes[start + a * _W + e], 3 * a * _W + e
            nodal[k], nodal[k + _W], nodal[k + 2 * _W] = x[n], x[n + 1], x[n + 2]
            nodal[k + 24 * _W], nodal[k + 25 * _W], nodal[k + 26 * _W] = v[n], v[n + 1], v[n + 2]


@inlined
def scatter(f_nodal, nodes, start, count, force):
    """Subtract the internal forces of the first `count` lanes from the nodal force."""
    for a in range(8):
        for e in range(count):
            n, k = 3 * nodes[start + a * _W + e], 3 * a * _W + e
            force[n] -= f_nodal[k]
            force[n + 1] -= f_nodal[k + _W]
            force[n + 2] -= f_nodal[k + 2 * _W]
