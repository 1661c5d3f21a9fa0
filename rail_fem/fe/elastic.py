"""The cheaper element kernel: small displacement, linear elastic, for bodies that stay so (the wheel).

Total form: stresses follow from the displacement on the reference geometry, so nothing drifts and nothing is integrated.
The geometry of each block is worked out once (`fixed_geometry`) in the format that `hexahedron.internal_force` reads.
Damping is proportional to stiffness (Kelvin-Voigt): forces are taken at u + beta v.
"""

from __future__ import annotations

import numba
import numpy as np

from rail_fem.fe.hexahedron import (
    FAST,
    N_KEPT,
    add_elastic,
    combine,
    field_gradient,
    gather,
    internal_force,
    load,
    mean_gradient,
    scatter,
    store,
    sum_of_squares,
    times,
    vector_modes,
)
from rail_fem.fe.state import HOURGLASS, LANES, N_STATE

_W = LANES
_compiled = numba.njit(cache=True, **FAST)


@_compiled
def fixed_geometry(x, nodes, filled, material_of, materials):
    """Mean gradients of every block on the geometry x -> (n_blocks*N_KEPT*LANES,), rows as in `hexahedron.elastic_trial`.

    Row 32 holds the hourglass stiffness [N/m] instead of a work. Also returns the smallest volume [m3].
    """
    out = np.zeros(filled.size * N_KEPT * _W)
    nodal = np.empty(48 * _W)
    smallest = np.inf
    for block in range(filled.size):
        gather(x, x, nodes, block * 8 * _W, nodal)
        kept = out[block * N_KEPT * _W : (block + 1) * N_KEPT * _W]
        for e in range(_W):
            m = vector_modes(nodal, e)
            b, volume = mean_gradient(m)
            for k in range(6):
                store(kept, 0, 3 * k, e, b[k])
            for k in range(4):
                store(kept, 0, 18 + 3 * k, e, m[3 + k])
            kept[30 * _W + e] = volume
            kept[32 * _W + e] = materials[material_of[block], 6] * 8.0 * sum_of_squares(b) / volume
            if not volume >= smallest:
                smallest = volume
    return out, smallest


@numba.njit(forceinline=True, **FAST)
def elastic_stress(nodal, damping, lame, shear, kept, state):
    """Stress and hourglass forces of a block at u + damping * v -> state (N_STATE*W,); nodal (48*W,) holds u and v."""
    for e in range(_W):
        u, v = vector_modes(nodal, e), vector_modes(nodal, 24 * _W + e)
        m = (
            combine(1.0, u[0], damping, v[0]),
            combine(1.0, u[1], damping, v[1]),
            combine(1.0, u[2], damping, v[2]),
            combine(1.0, u[3], damping, v[3]),
            combine(1.0, u[4], damping, v[4]),
            combine(1.0, u[5], damping, v[5]),
            combine(1.0, u[6], damping, v[6]),
        )
        b = (
            load(kept, 0, 0, e),
            load(kept, 0, 3, e),
            load(kept, 0, 6, e),
            load(kept, 0, 9, e),
            load(kept, 0, 12, e),
            load(kept, 0, 15, e),
        )
        l = field_gradient(m, b, kept[30 * _W + e])
        stress = add_elastic((0.0, 0.0, 0.0, 0.0, 0.0, 0.0), l, 1.0, lame, shear)
        store(state, 0, 0, e, stress[:3])
        store(state, 0, 3, e, stress[3:])
        k = kept[32 * _W + e]
        store(state, 0, HOURGLASS, e, hourglass_force(m[3], l, load(kept, 0, 18, e), k))
        store(state, 0, HOURGLASS + 3, e, hourglass_force(m[4], l, load(kept, 0, 21, e), k))
        store(state, 0, HOURGLASS + 6, e, hourglass_force(m[5], l, load(kept, 0, 24, e), k))
        store(state, 0, HOURGLASS + 9, e, hourglass_force(m[6], l, load(kept, 0, 27, e), k))


@numba.njit(inline="always", **FAST)
def hourglass_force(gu, l, g, k):
    lg = times(l, g)
    return k * (gu[0] - lg[0]), k * (gu[1] - lg[1]), k * (gu[2] - lg[2])


@_compiled
def update_elastic_elements(u, v, damping, nodes, filled, material_of, materials, geometry, state, force):
    """Minus the internal force of every block added to `force`.

    u, v : (3*n,) displacement from the reference geometry [m] and velocity [m/s];  damping : beta [s]
    geometry : from `fixed_geometry`;  state : (n_blocks*N_STATE*LANES,) stress and hourglass forces, written
    force : (3*n,) [N], changed in place. Rank-local.
    """
    nodal = np.empty(48 * _W)
    for block in range(filled.size):
        start, s, row = block * 8 * _W, block * N_STATE * _W, material_of[block]
        gather(u, v, nodes, start, nodal)
        own, kept = state[s : s + N_STATE * _W], geometry[block * N_KEPT * _W : (block + 1) * N_KEPT * _W]
        elastic_stress(nodal, damping, materials[row, 0], materials[row, 1], kept, own)
        internal_force(own, kept, nodal)
        scatter(nodal, nodes, start, filled[block], force)
