"""The second element: 8-node hexahedron with 2 x 2 x 2 points and mean dilatation, finite strain, J2 plasticity.

It judges the one-point element (rail_fem.fe.hexahedron): nothing but the mesh in common, no hourglass modes to control,
and nothing to choose. Stress update and return mapping are those of the one-point element, at every point.

Kinematics in the modes of the trilinear map (rail_fem.fe.trilinear): the covariant vector along reference axis k
depends on the two other coordinates alone,
    X_k(p, q) = a_k + p g_(k+2) + q g_(k+1) + p q g_4,   p along axis k+1, q along axis k+2, indices cyclic,
so twelve vectors serve the eight points, for the coordinates and for the velocities; forces gather the same way.
Mean dilatation: the divergence of each point is replaced by the element's volume mean, which the mean gradient of the
one-point element gives exactly, and the pressures act through that gradient, so that stress power and nodal power are
equal to round-off and volume does not lock.

Source: Hughes, The Finite Element Method (1987), section 4.5 (B-bar, mean dilatation); Simo, Taylor & Pister, Comput.
Methods Appl. Mech. Eng. 51 (1985) 177, for finite strain.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rail_fem.fe.finite_strain import add_elastic, rotate_stress, step_rotation, to_mid_step, von_mises
from rail_fem.fe.hexahedron import N_SCRATCH, constants_of, energy_density, viscous_pressure
from rail_fem.fe.lanes import compiled, gather, gather_one, inlined, load, scatter, store
from rail_fem.fe.plasticity import EXCESS, add_centre, flow_back, has_flowed, point_buffers, return_law, turn
from rail_fem.fe.prefetch import NUMBERS, fetch
from rail_fem.fe.state import LANES, N_STATE_FULL, POINT_STATE, POINTS, YIELD
from rail_fem.fe.trilinear import (
    cross,
    dot,
    field_gradient,
    mean_gradient,
    store_nodal,
    sum_of_squares,
    times,
    vector_modes,
)

_W = LANES
_G = 1.0 / math.sqrt(3.0)
VECTORS = 36  # rows of the twelve vectors X_k(p, q): axis, sign of p, sign of q, component
MEAN = 22  # rows of what belongs to the whole element: mean gradient (18), volume, divergence, integral of the
# pressure over the volume, viscous work
VOLUME, DIVERGENCE, PRESSURE, VISCOUS = 18, 19, 20, 21
JACOBIAN = 30  # row of a point's scratch: volume it stands for; rows 0 to 8 are its contravariant area vectors
ROTATION = 9  # rows of a point's scratch where its back stresses are turned elsewhere: the step's rotation (9)


@inlined
def covariant(a, second, first, last, p, q):
    """X_k at (p, q): a_k + p g_(k+2) + q g_(k+1) + p q g_4."""
    return (
        a[0] + p * second[0] + q * first[0] + p * q * last[0],
        a[1] + p * second[1] + q * first[1] + p * q * last[1],
        a[2] + p * second[2] + q * first[2] + p * q * last[2],
    )


@inlined
def store_covariant(vectors, e, m):
    """The twelve vectors X_k(+-, +-) of the field with modes m."""
    for s in range(4):
        p, q = _G if s % 2 else -_G, _G if s // 2 else -_G
        store(vectors, 0, 3 * s, e, covariant(m[0], m[5], m[4], m[6], p, q))
        store(vectors, 0, 12 + 3 * s, e, covariant(m[1], m[3], m[5], m[6], p, q))
        store(vectors, 0, 24 + 3 * s, e, covariant(m[2], m[4], m[3], m[6], p, q))


@inlined
def vectors_at(m, point):
    """X_1, X_2, X_3 at a point of the field with modes m, see `rows_at`."""
    xi, eta, zeta = _G if point & 1 else -_G, _G if point & 2 else -_G, _G if point & 4 else -_G
    return (
        covariant(m[0], m[5], m[4], m[6], eta, zeta),
        covariant(m[1], m[3], m[5], m[6], zeta, xi),
        covariant(m[2], m[4], m[3], m[6], xi, eta),
    )


@inlined
def begin_element(x, v, dt, own, mean, e):
    """What belongs to the whole element, of modes of its coordinates x at the end of the step and of its velocities v
    over it, ElementConstants -> lane e of `mean` (MEAN*W,)."""
    b, volume = mean_gradient(x)
    end = field_gradient(v, b, volume)
    for k in range(3):
        for i in range(3):
            mean[(3 * k + i) * _W + e] = b[k][i]
            mean[(9 + 3 * k + i) * _W + e] = b[3 + k][i]
    mean[VOLUME * _W + e] = volume
    mean[DIVERGENCE * _W + e] = end[0][0] + end[1][1] + end[2][2]
    mid = to_mid_step(end, dt)
    rate = mid[0][0] + mid[1][1] + mid[2][2]
    viscous = viscous_pressure(own, 8.0 * sum_of_squares(b), volume, rate)
    mean[PRESSURE * _W + e] = viscous * volume  # the points' pressures are added to it
    mean[VISCOUS * _W + e] = viscous * rate * volume * dt


@inlined
def whole_element(nodal, dt, material, vectors, rates, mean):
    """Of a block: covariant vectors of coordinates and velocities (VECTORS*W,), and `mean` (MEAN*W,)."""
    own = constants_of(material)
    for e in range(_W):
        x, v = vector_modes(nodal, e), vector_modes(nodal, 24 * _W + e)
        begin_element(x, v, dt, own, mean, e)
        store_covariant(vectors, e, x)
        store_covariant(rates, e, v)


@inlined
def rows_at(point):
    """First rows of the three covariant vectors of a point, whose bits are the signs of xi, eta, zeta."""
    xi, eta, zeta = point & 1, (point >> 1) & 1, point >> 2
    return 3 * (eta + 2 * zeta), 12 + 3 * (zeta + 2 * xi), 24 + 3 * (xi + 2 * eta)


@inlined
def gradient_component(v1, v2, v3, c1, c2, c3, i, j, s):
    return s * (v1[i] * c1[j] + v2[i] * c2[j] + v3[i] * c3[j])


class PointTrial(NamedTuple):
    """One point up to its elastic trial stress (6,) [Pa]: rotation of the step, and what its force needs: area vectors
    of the three reference axes, volume it stands for."""

    stress: tuple
    rotation: tuple
    c1: tuple
    c2: tuple
    c3: tuple
    jacobian: float


@inlined
def trial_of_point(x1, x2, x3, v1, v2, v3, divergence, dt, own, old):
    """Of one point: covariant vectors of coordinates and velocities, mean divergence of the element, ElementConstants,
    stress (6,) before the step -> PointTrial."""
    c1, c2, c3 = cross(x2, x3), cross(x3, x1), cross(x1, x2)
    jacobian = dot(x1, c1)
    s = 1.0 / jacobian
    g00 = gradient_component(v1, v2, v3, c1, c2, c3, 0, 0, s)
    g11 = gradient_component(v1, v2, v3, c1, c2, c3, 1, 1, s)
    g22 = gradient_component(v1, v2, v3, c1, c2, c3, 2, 2, s)
    dilatation = (divergence - g00 - g11 - g22) / 3.0
    g = (
        (
            g00 + dilatation,
            gradient_component(v1, v2, v3, c1, c2, c3, 0, 1, s),
            gradient_component(v1, v2, v3, c1, c2, c3, 0, 2, s),
        ),
        (
            gradient_component(v1, v2, v3, c1, c2, c3, 1, 0, s),
            g11 + dilatation,
            gradient_component(v1, v2, v3, c1, c2, c3, 1, 2, s),
        ),
        (
            gradient_component(v1, v2, v3, c1, c2, c3, 2, 0, s),
            gradient_component(v1, v2, v3, c1, c2, c3, 2, 1, s),
            g22 + dilatation,
        ),
    )
    l = to_mid_step(g, dt)
    r = step_rotation(l, dt)
    half = add_elastic(old, l, 0.5 * dt, own.lame, own.shear)
    stress = add_elastic(rotate_stress(r, half), l, 0.5 * dt, own.lame, own.shear)
    return PointTrial(stress, r, c1, c2, c3, jacobian)


@inlined
def point_trial(vectors, rates, mean, point, dt, material, state, keeps_rotation, scratch):
    """Trial stress of one point of a block, and what its force needs -> scratch: area vectors, volume, excess.

    state : (POINT_STATE*W,) of this point;  keeps_rotation : the step's goes to the rows from ROTATION of scratch
    """
    own = constants_of(material)
    r1, r2, r3 = rows_at(point)
    for e in range(_W):
        x1, x2, x3 = load(vectors, 0, r1, e), load(vectors, 0, r2, e), load(vectors, 0, r3, e)
        v1, v2, v3 = load(rates, 0, r1, e), load(rates, 0, r2, e), load(rates, 0, r3, e)
        old = load(state, 0, 0, e) + load(state, 0, 3, e)
        found = trial_of_point(x1, x2, x3, v1, v2, v3, mean[DIVERGENCE * _W + e], dt, own, old)
        stress, r = found.stress, found.rotation
        store(state, 0, 0, e, stress[:3])
        store(state, 0, 3, e, stress[3:])
        store(scratch, 0, 0, e, found.c1)
        store(scratch, 0, 3, e, found.c2)
        store(scratch, 0, 6, e, found.c3)
        scratch[JACOBIAN * _W + e] = found.jacobian
        scratch[EXCESS * _W + e] = von_mises(stress) - state[YIELD * _W + e]
        if keeps_rotation:
            store(scratch, 0, ROTATION, e, r[0])
            store(scratch, 0, ROTATION + 3, e, r[1])
            store(scratch, 0, ROTATION + 6, e, r[2])


@inlined
def add(a, k, e, u):
    a[k * _W + e] += u[0]
    a[(k + 1) * _W + e] += u[1]
    a[(k + 2) * _W + e] += u[2]


@inlined
def add_force_of_point(t, u, c1, c2, c3, jacobian, point, mean, forces, e):
    """The deviator of a point, of the stress of normal components t and shears u, acts on its area vectors: added to
    lane e of the twelve force vectors; its pressure to the mean."""
    r1, r2, r3 = rows_at(point)
    pressure = (t[0] + t[1] + t[2]) / 3.0
    mean[PRESSURE * _W + e] += pressure * jacobian
    d0, d1, d2 = t[0] - pressure, t[1] - pressure, t[2] - pressure
    rows = ((d0, u[2], u[1]), (u[2], d1, u[0]), (u[1], u[0], d2))
    add(forces, r1, e, times(rows, c1))
    add(forces, r2, e, times(rows, c2))
    add(forces, r3, e, times(rows, c3))


@inlined
def add_point_force(state, scratch, point, mean, forces):
    """`add_force_of_point` of a block."""
    for e in range(_W):
        t, u = load(state, 0, 0, e), load(state, 0, 3, e)
        c1, c2, c3 = load(scratch, 0, 0, e), load(scratch, 0, 3, e), load(scratch, 0, 6, e)
        add_force_of_point(t, u, c1, c2, c3, scratch[JACOBIAN * _W + e], point, mean, forces, e)


@inlined
def signed_sums(forces, row, i, e):
    """Of the four vectors of an axis: sum, sum with the sign of p, of q, of p q (the signs' size _G put in)."""
    a, b = forces[(row + i) * _W + e], forces[(row + 3 + i) * _W + e]
    c, d = forces[(row + 6 + i) * _W + e], forces[(row + 9 + i) * _W + e]
    return a + b + c + d, _G * (b + d - a - c), _G * (c + d - a - b), _G * _G * (a + d - b - c)


@inlined
def force_at_nodes(forces, mean, f, e):
    """Twelve force vectors and the mean pressure of lane e -> nodal internal forces f (24*W,)."""
    p = mean[PRESSURE * _W + e] / mean[VOLUME * _W + e]
    for i in range(3):
        s1, p1, q1, w1 = signed_sums(forces, 0, i, e)
        s2, p2, q2, w2 = signed_sums(forces, 12, i, e)
        s3, p3, q3, w3 = signed_sums(forces, 24, i, e)
        fx = 0.125 * s1 + p * mean[i * _W + e]
        fy = 0.125 * s2 + p * mean[(3 + i) * _W + e]
        fz = 0.125 * s3 + p * mean[(6 + i) * _W + e]
        h1 = 0.125 * (p2 + q3) + p * mean[(9 + i) * _W + e]
        h2 = 0.125 * (q1 + p3) + p * mean[(12 + i) * _W + e]
        h3 = 0.125 * (p1 + q2) + p * mean[(15 + i) * _W + e]
        h4 = 0.125 * (w1 + w2 + w3)
        store_nodal(f, i, e, (fx, fy, fz), (h1, h2, h3, h4))


@inlined
def nodal_force(forces, mean, f):
    """`force_at_nodes` of a block."""
    for e in range(_W):
        force_at_nodes(forces, mean, f, e)


@compiled
def update_full_elements(x, v, dt, blocks, nodes, filled, material_of, steels, state, back, force, work):
    """One step of chosen blocks: as `rail_fem.fe.hexahedron.update_elements`, at eight points an element.

    state : (n_blocks*N_STATE_FULL*LANES,), point by point POINT_STATE rows;  back : (n_blocks*8*k*6*LANES,), point by
    point;
    everything else, and what is returned, as there: the second work of a block, of hourglass control, stays 0.
    """
    nodal, vectors, rates = np.empty(48 * _W), np.empty(VECTORS * _W), np.empty(VECTORS * _W)
    forces, mean, scratch = np.empty(VECTORS * _W), np.empty(MEAN * _W), np.empty(N_SCRATCH * _W)
    point, stride = point_buffers(steels), back.size // max(filled.size, 1)
    smallest = np.inf
    for block in blocks:
        start, s, count, row = block * 8 * _W, block * N_STATE_FULL * _W, filled[block], material_of[block]
        held = 6 * _W * (steels.back_start[row + 1] - steels.back_start[row])
        gather(x, v, nodes, start, nodal)
        material, law = steels.rows[row], return_law(steels, row)
        whole_element(nodal, dt, material, vectors, rates, mean)
        forces[:] = 0.0
        for q in range(POINTS):
            ahead = s + (q + 1) * POINT_STATE * _W
            fetch(state, ahead, POINT_STATE * _W, NUMBERS)
            own, first = state[s + q * POINT_STATE * _W : ahead], block * stride + q * held
            backs = back[first : first + held]
            moved = False
            if held > 0:
                moved = backs.size > 0 and has_flowed(own, count)
                if moved:
                    add_centre(own, backs, -1.0)
                point_trial(vectors, rates, mean, q, dt, material, own, True, scratch)
                if moved:
                    turn(backs, scratch, ROTATION)
            else:
                point_trial(vectors, rates, mean, q, dt, material, own, False, scratch)
            if flow_back(law, own, backs, scratch, count, point, POINT_STATE) or moved:
                add_centre(own, backs, 1.0)
            add_point_force(own, scratch, q, mean, forces)
            for e in range(count):
                work[3 * block] += scratch[EXCESS * _W + e] * scratch[JACOBIAN * _W + e]
                if not scratch[JACOBIAN * _W + e] > 0.0:
                    smallest = min(smallest, scratch[JACOBIAN * _W + e])
        for e in range(count):
            work[3 * block + 2] += mean[VISCOUS * _W + e]
            if not mean[VOLUME * _W + e] >= smallest:
                smallest = mean[VOLUME * _W + e]
        nodal_force(forces, mean, nodal)
        scatter(nodal, nodes, start, count, force)
    return smallest


@compiled
def stored_energy_full(x, nodes, filled, material_of, materials, state):
    """Elastic energy [J] of the stresses of all points on the geometry x."""
    nodal, vectors, total = np.empty(24 * _W), np.empty(VECTORS * _W), 0.0
    for block in range(filled.size):
        start, row = block * 8 * _W, material_of[block]
        lame, shear = materials[row, 0], materials[row, 1]
        gather_one(x, nodes, start, nodal)
        for e in range(filled[block]):
            store_covariant(vectors, e, vector_modes(nodal, e))
        for point in range(POINTS):
            s = (block * POINTS + point) * POINT_STATE * _W
            r1, r2, r3 = rows_at(point)
            for e in range(filled[block]):
                x2, x3 = load(vectors, 0, r2, e), load(vectors, 0, r3, e)
                volume = dot(load(vectors, 0, r1, e), cross(x2, x3))
                total += volume * energy_density(load(state, s, 0, e), load(state, s, 3, e), lame, shear)
    return total
