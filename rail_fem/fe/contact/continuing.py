"""From one search of contact to the next: how long no node that is not watched can come into contact, and what pairs
keep.

Forces must not depend on when searches happen. A pair that goes on keeps the facet, the position on it and the normal
that its last step found; those of a search are of another moment, and forces along them would do another work.
Compiled, no mesh.
"""

from __future__ import annotations

import numpy as np

from rail_fem.fe.contact.compiled import compiled, inlined


@compiled
def time_to_contact(pairs, velocity, margin, change):
    """The least time [s] in which a pair with a gap of `margin` [m] or more can close: at the rate at which it closes
    now, and `change` [m/s] more. velocity : (n, 3) of the nodes [m/s]"""
    least = np.inf
    for i in range(pairs.slaves.size):
        gap = pairs.gap[i]
        if pairs.facets[i] < 0 or not gap >= margin:
            continue
        s, q = pairs.slaves[i], pairs.quads[pairs.facets[i]]
        rate = 0.0
        for c in range(3):
            v = -velocity[s, c]
            for k in range(4):
                v += pairs.weight[i, k] * velocity[q[k], c]
            rate += v * pairs.normal[i, c]
        least = min(least, gap / (max(rate, 0.0) + change))
    return least


@inlined
def are_close(neighbours, one, other):
    """Whether two facets are the same, or at most two edges apart."""
    if one == other:
        return True
    for k in range(4):
        beside = neighbours[one, k]
        if beside < 0:
            continue
        if beside == other:
            return True
        for m in range(4):
            if neighbours[beside, m] == other:
                return True
    return False


@compiled
def close_pairs(found, before, margin, deepest, slot):
    """The pairs to watch, of those that a search found (k,): number (m,) of each in `found`, facet (m,), position on it
    (m, 2), normal of the last step (m, 3), 0 for new pairs.

    before : pairs up to now, which may stay on the facets that `found` may use;  slot : (n,) scratch
    A pair up to now stays on its facet unless the search found it well away from there, on another part of the surface;
    it stays also where the search found no facet.
    """
    slot[:] = -1
    for j in range(before.slaves.size):
        slot[before.slaves[j]] = j
    count = found.slaves.size
    number, facets = np.empty(count, np.int64), np.empty(count, np.int64)
    where, ahead = np.empty((count, 2)), np.zeros((count, 3))
    m = 0
    for i in range(count):
        j, f = slot[found.slaves[i]], found.facets[i]
        old = before.facets[j] if j >= 0 else -1
        goes_on = old >= 0 and found.usable[old] and (f < 0 or are_close(found.neighbours, old, f))
        if f < 0 and not goes_on:
            continue
        gap = before.gap[j] if f < 0 else found.gap[i]
        if not (-deepest < gap < margin):
            continue
        number[m], facets[m] = i, old if goes_on else f
        for c in range(2):
            where[m, c] = before.where[j, c] if goes_on else found.where[i, c]
        for c in range(3):
            ahead[m, c] = before.ahead[j, c] if goes_on else found.ahead[i, c]
        m += 1
    return number[:m].copy(), facets[:m].copy(), where[:m].copy(), ahead[:m].copy()
