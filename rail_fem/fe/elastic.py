"""The cheaper element kernel: small displacement, linear elastic, for bodies that stay so (the wheel).

Total form: forces follow from the displacement on the reference geometry, so nothing drifts, nothing is integrated and
no state is kept; stresses are worked out when somebody asks for them. The geometry of each block is worked out once
(`fixed_geometry`) in the rows that `hexahedron.internal_force` reads. Damping is proportional to stiffness
(Kelvin-Voigt): forces are taken at u + beta v.
"""

from __future__ import annotations

import numpy as np

from rail_fem.fe.finite_strain import add_elastic
from rail_fem.fe.hexahedron import internal_force
from rail_fem.fe.lanes import compiled, gather_one, inlined, load, store
from rail_fem.fe.prefetch import INDICES, NUMBERS, fetch
from rail_fem.fe.state import HOURGLASS, LANES
from rail_fem.fe.trilinear import field_gradient, mean_gradient, sum_of_squares, times, vector_modes

_W = LANES
# rows of a block's geometry: b (18), hourglass coordinates (12), volume, 0 for the viscous pressure, hourglass
# stiffness
N_FIXED = 33
_THIRD = N_FIXED * _W // 3  # of a block's geometry: the next block's is fetched in three parts
N_FORCES = HOURGLASS + 12  # rows of stress and hourglass forces as `hexahedron.internal_force` reads them


@compiled
def fixed_geometry(x, nodes, filled, material_of, materials):
    """Geometry of every block on the coordinates x -> (n_blocks*N_FIXED*LANES,), and the smallest volume [m3]."""
    out = np.zeros(filled.size * N_FIXED * _W)
    nodal = np.empty(24 * _W)
    smallest = np.inf
    for block in range(filled.size):
        gather_one(x, nodes, block * 8 * _W, nodal)
        fixed = out[block * N_FIXED * _W : (block + 1) * N_FIXED * _W]
        for e in range(_W):
            m = vector_modes(nodal, e)
            b, volume = mean_gradient(m)
            for k in range(6):
                store(fixed, 0, 3 * k, e, b[k])
            for k in range(4):
                store(fixed, 0, 18 + 3 * k, e, m[3 + k])
            fixed[30 * _W + e] = volume
            fixed[32 * _W + e] = materials[material_of[block], 6] * 8.0 * sum_of_squares(b) / volume
            if not volume >= smallest:
                smallest = volume
    return out, smallest


@inlined
def shape_gradients(fixed, e):
    """The six modal gradient vectors of lane e."""
    b1, b2, b3 = load(fixed, 0, 0, e), load(fixed, 0, 3, e), load(fixed, 0, 6, e)
    return b1, b2, b3, load(fixed, 0, 9, e), load(fixed, 0, 12, e), load(fixed, 0, 15, e)


@inlined
def gradient_and_stress(m, fixed, e, lame, shear):
    """Mean displacement gradient and elastic stress of lane e, m the modes of its displacement."""
    l = field_gradient(m, shape_gradients(fixed, e), fixed[30 * _W + e])
    return l, add_elastic((0.0, 0.0, 0.0, 0.0, 0.0, 0.0), l, 1.0, lame, shear)


@inlined
def elastic_hourglass(m, l, g1, g2, g3, g4, k):
    """The four hourglass forces of an element, m the modes of its displacement, l its gradient, g its hourglass
    coordinates, k its stiffness."""
    q1, q2 = hourglass_force(m[3], l, g1, k), hourglass_force(m[4], l, g2, k)
    return q1, q2, hourglass_force(m[5], l, g3, k), hourglass_force(m[6], l, g4, k)


@inlined
def elastic_forces(nodal, lame, shear, fixed, own):
    """Stress and hourglass forces of a block -> own (N_FORCES*W,); nodal (24*W,) holds the displacement."""
    for e in range(_W):
        m = vector_modes(nodal, e)
        l, stress = gradient_and_stress(m, fixed, e, lame, shear)
        store(own, 0, 0, e, stress[:3])
        store(own, 0, 3, e, stress[3:])
        k = fixed[32 * _W + e]
        g1, g2 = load(fixed, 0, 18, e), load(fixed, 0, 21, e)
        g3, g4 = load(fixed, 0, 24, e), load(fixed, 0, 27, e)
        q1, q2, q3, q4 = elastic_hourglass(m, l, g1, g2, g3, g4, k)
        store(own, 0, HOURGLASS, e, q1)
        store(own, 0, HOURGLASS + 3, e, q2)
        store(own, 0, HOURGLASS + 6, e, q3)
        store(own, 0, HOURGLASS + 9, e, q4)


@inlined
def hourglass_force(gu, l, g, k):
    lg = times(l, g)
    return k * (gu[0] - lg[0]), k * (gu[1] - lg[1]), k * (gu[2] - lg[2])


@inlined
def take(u, places, start, nodal):
    """Lines u of a block's nodes -> nodal (24*W,), ordered node, component, lane."""
    for a in range(8):
        for e in range(_W):
            at, k = places[start + a * _W + e], 3 * a * _W + e
            nodal[k], nodal[k + _W], nodal[k + 2 * _W] = 8.0 * u[at], 8.0 * u[at + _W], 8.0 * u[at + 2 * _W]


@inlined
def give(nodal, places, start, count, f):
    """Add the forces of the first `count` lanes to the lines f."""
    for a in range(8):
        for e in range(count):
            at, k = places[start + a * _W + e], 3 * a * _W + e
            f[at] += nodal[k]
            f[at + _W] += nodal[k + _W]
            f[at + 2 * _W] += nodal[k + 2 * _W]


@inlined
def add_elastic_force(u, places, filled, material_of, materials, geometry, f):
    """Internal force of every block added to f.

    u, f : an eighth of the displacement, with damping u + beta v [m], and the force [N] of nodes in lines;  places :
        where those of the blocks stand in them (rail_fem.fe.rings.Rings);  geometry : from `fixed_geometry`
    Rank-local. Allocates only its block buffers.
    """
    nodal, own = np.empty(24 * _W), np.empty(N_FORCES * _W)
    for block in range(filled.size):
        start, row = block * 8 * _W, material_of[block]
        ahead = (block + 1) * N_FIXED * _W
        fetch(places, start + 8 * _W, 8 * _W, INDICES)
        fetch(geometry, ahead, _THIRD, NUMBERS)
        take(u, places, start, nodal)
        fixed = geometry[block * N_FIXED * _W : ahead]
        elastic_forces(nodal, materials[row, 0], materials[row, 1], fixed, own)
        fetch(geometry, ahead + _THIRD, _THIRD, NUMBERS)
        internal_force(own, fixed, nodal)
        fetch(geometry, ahead + 2 * _THIRD, _THIRD, NUMBERS)
        give(nodal, places, start, filled[block], f)


@compiled
def elastic_stress(u, nodes, filled, material_of, materials, geometry):
    """Stress (n_blocks, 6, LANES), order VOIGT [Pa], of the displacement u (3*n,)."""
    nodal, own = np.empty(24 * _W), np.empty(N_FORCES * _W)
    out = np.empty((filled.size, 6, _W))
    for block in range(filled.size):
        row = material_of[block]
        gather_one(u, nodes, block * 8 * _W, nodal)
        elastic_forces(
            nodal,
            materials[row, 0],
            materials[row, 1],
            geometry[block * N_FIXED * _W : (block + 1) * N_FIXED * _W],
            own,
        )
        for k in range(6):
            for e in range(_W):
                out[block, k, e] = own[k * _W + e]
    return out
