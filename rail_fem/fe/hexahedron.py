"""The element kernel: 8-node hexahedron, one point, finite strain, J2 plasticity and hourglass control in one pass.

Everything is written in the modes of the trilinear map
    x(xi, eta, zeta) = a0 + a1 xi + a2 eta + a3 zeta + g1 eta zeta + g2 zeta xi + g3 xi eta + g4 xi eta zeta,
because there the volume-averaged gradient of the shape functions, b_I = integral of grad N_I, is short and exact:
    b_I = xi_I A1 + eta_I A2 + zeta_I A3 + (eta zeta)_I C1 + (zeta xi)_I C2 + (xi eta)_I C3,
    A1 = a2 x a3 + g3 x g2 / 3,   C1 = (a3 x g2 + g3 x a2) / 3,   and cyclic.
It equals the uniform gradient of Flanagan and Belytschko (Int. J. Numer. Meth. Eng. 17 (1981) 679) at a third of the
operations; tests/fe/test_hexahedron.py compares it with Gauss quadrature.

Stress: velocity gradient on the mid-step configuration, rotation by Hughes and Winget (IJNME 15 (1980) 1862), so that a
rigid rotation of any size strains nothing; half of the increment turns with the old stress, without which the update is
only first order where a body strains and turns at once; then radial return (rail_fem.fe.plasticity). Forces are taken
on the end-of-step configuration, so linear and angular momentum are kept to round-off.

Elements are stored in blocks of LANES of one material; inside a block the fastest index is the element. The functions
on tuples below are the mathematics of one element; `elastic_trial` and `internal_force` run them over the lanes of a
block, and the compiler turns those two loops into vector code. What may branch (plastic flow) stands between them.
"""

from __future__ import annotations

import math

import numpy as np

from kernel_cache import njit
from rail_fem.fe.plasticity import EXCESS, return_isotropic, return_kinematic
from rail_fem.fe.prefetch import INDICES, NUMBERS, fetch
from rail_fem.fe.state import HOURGLASS, KINEMATIC, LANES, N_STATE, YIELD

_W = LANES
_QUARTER = N_STATE * _W // 4  # of a block's state: the next block's is fetched in four parts, as this one's is computed
N_SCRATCH = 35  # rows of scratch data that `elastic_trial` leaves of a block, see there
FAST = {"fastmath": {"contract", "reassoc", "nsz", "arcp"}, "error_model": "numpy"}
_inlined = njit(inline="always", **FAST)
_compiled = njit(cache=True, **FAST)
_part = njit(forceinline=True, **FAST)  # one copy, inside its caller


@_inlined
def cross(u, v):
    return u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]


@_inlined
def dot(u, v):
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


@_inlined
def combine(s, u, t, v):
    return s * u[0] + t * v[0], s * u[1] + t * v[1], s * u[2] + t * v[2]


@_inlined
def times(m, u):
    """3x3 matrix (three row tuples) times vector."""
    return dot(m[0], u), dot(m[1], u), dot(m[2], u)


@_inlined
def scalar_modes(n, k, e):
    """Component k of the nodal values n (24*W,) of lane e -> its 7 modes (xi, eta, zeta, eta zeta, zeta xi, xi eta, xi
    eta zeta)."""
    n0, n1, n2, n3 = n[k * _W + e], n[(3 + k) * _W + e], n[(6 + k) * _W + e], n[(9 + k) * _W + e]
    n4, n5, n6, n7 = n[(12 + k) * _W + e], n[(15 + k) * _W + e], n[(18 + k) * _W + e], n[(21 + k) * _W + e]
    s10, d10, s23, d23 = n1 + n0, n1 - n0, n2 + n3, n2 - n3
    s54, d54, s67, d67 = n5 + n4, n5 - n4, n6 + n7, n6 - n7
    low, low_y, low_x, low_xy = s23 + s10, s23 - s10, d23 + d10, d23 - d10
    top, top_y, top_x, top_xy = s67 + s54, s67 - s54, d67 + d54, d67 - d54
    return (
        0.125 * (top_x + low_x),
        0.125 * (top_y + low_y),
        0.125 * (top - low),
        0.125 * (top_y - low_y),
        0.125 * (top_x - low_x),
        0.125 * (top_xy + low_xy),
        0.125 * (top_xy - low_xy),
    )


@_inlined
def vector_modes(n, e):
    """The 7 modal vectors a1 a2 a3 g1 g2 g3 g4 of lane e."""
    x, y, z = scalar_modes(n, 0, e), scalar_modes(n, 1, e), scalar_modes(n, 2, e)
    return (
        (x[0], y[0], z[0]),
        (x[1], y[1], z[1]),
        (x[2], y[2], z[2]),
        (x[3], y[3], z[3]),
        (x[4], y[4], z[4]),
        (x[5], y[5], z[5]),
        (x[6], y[6], z[6]),
    )


@_inlined
def mean_gradient(m):
    """Modal coordinates -> modal gradient vectors (A1 A2 A3 C1 C2 C3) and the volume."""
    a1, a2, a3, g1, g2, g3 = m[0], m[1], m[2], m[3], m[4], m[5]
    t = 1.0 / 3.0
    b1 = combine(1.0, cross(a2, a3), t, cross(g3, g2))
    b2 = combine(1.0, cross(a3, a1), t, cross(g1, g3))
    b3 = combine(1.0, cross(a1, a2), t, cross(g2, g1))
    c1 = combine(t, cross(a3, g2), t, cross(g3, a2))
    c2 = combine(t, cross(a1, g3), t, cross(g1, a3))
    c3 = combine(t, cross(a2, g1), t, cross(g2, a1))
    volume = 8.0 * t * (dot(a1, b1) + dot(a2, b2) + dot(a3, b3) + dot(g1, c1) + dot(g2, c2) + dot(g3, c3))
    return (b1, b2, b3, c1, c2, c3), volume


@_inlined
def gradient_row(m, b, i, scale):
    """Row i of the mean gradient of a field with modes m."""
    k0, k1, k2, k3, k4, k5 = (
        scale * m[0][i],
        scale * m[1][i],
        scale * m[2][i],
        scale * m[3][i],
        scale * m[4][i],
        scale * m[5][i],
    )
    return (
        k0 * b[0][0] + k1 * b[1][0] + k2 * b[2][0] + k3 * b[3][0] + k4 * b[4][0] + k5 * b[5][0],
        k0 * b[0][1] + k1 * b[1][1] + k2 * b[2][1] + k3 * b[3][1] + k4 * b[4][1] + k5 * b[5][1],
        k0 * b[0][2] + k1 * b[1][2] + k2 * b[2][2] + k3 * b[3][2] + k4 * b[4][2] + k5 * b[5][2],
    )


@_inlined
def field_gradient(m, b, volume):
    """Volume mean of du_i/dx_j of the field with modes m: three rows."""
    s = 8.0 / volume
    return gradient_row(m, b, 0, s), gradient_row(m, b, 1, s), gradient_row(m, b, 2, s)


@_inlined
def to_mid_step(g, dt):
    """Velocity gradient on the end configuration -> on the mid-step one: L = G (I - dt/2 G)^-1, exact for affine
    motion."""
    h = -0.5 * dt
    r0 = (1.0 + h * g[0][0], h * g[0][1], h * g[0][2])
    r1 = (h * g[1][0], 1.0 + h * g[1][1], h * g[1][2])
    r2 = (h * g[2][0], h * g[2][1], 1.0 + h * g[2][2])
    k0, k1, k2 = cross(r1, r2), cross(r2, r0), cross(r0, r1)
    s = 1.0 / dot(r0, k0)
    return mid_row(g[0], k0, k1, k2, s), mid_row(g[1], k0, k1, k2, s), mid_row(g[2], k0, k1, k2, s)


@_inlined
def mid_row(g, k0, k1, k2, s):
    return (
        s * (g[0] * k0[0] + g[1] * k0[1] + g[2] * k0[2]),
        s * (g[0] * k1[0] + g[1] * k1[1] + g[2] * k1[2]),
        s * (g[0] * k2[0] + g[1] * k2[1] + g[2] * k2[2]),
    )


@_inlined
def step_rotation(l, dt):
    """Rotation of the step by Hughes and Winget: (I - dt/2 W)^-1 (I + dt/2 W), W the skew part of l."""
    q = 0.25 * dt
    wx, wy, wz = q * (l[2][1] - l[1][2]), q * (l[0][2] - l[2][0]), q * (l[1][0] - l[0][1])
    k = 2.0 / (1.0 + wx * wx + wy * wy + wz * wz)
    return (
        (1.0 - k * (wy * wy + wz * wz), k * (wx * wy - wz), k * (wx * wz + wy)),
        (k * (wx * wy + wz), 1.0 - k * (wx * wx + wz * wz), k * (wy * wz - wx)),
        (k * (wx * wz - wy), k * (wy * wz + wx), 1.0 - k * (wx * wx + wy * wy)),
    )


@_inlined
def rotate_stress(r, s):
    """R S R^T in the order VOIGT."""
    s0, s1, s2 = (s[0], s[5], s[4]), (s[5], s[1], s[3]), (s[4], s[3], s[2])
    t0, t1, t2 = times((s0, s1, s2), r[0]), times((s0, s1, s2), r[1]), times((s0, s1, s2), r[2])
    return dot(r[0], t0), dot(r[1], t1), dot(r[2], t2), dot(r[1], t2), dot(r[0], t2), dot(r[0], t1)


@_inlined
def add_elastic(s, l, dt, lame, shear):
    """Stress plus the isotropic elastic increment of the strain increment dt sym(l)."""
    p = dt * lame * (l[0][0] + l[1][1] + l[2][2])
    d, h = 2.0 * dt * shear, dt * shear
    return (
        s[0] + p + d * l[0][0],
        s[1] + p + d * l[1][1],
        s[2] + p + d * l[2][2],
        s[3] + h * (l[1][2] + l[2][1]),
        s[4] + h * (l[0][2] + l[2][0]),
        s[5] + h * (l[0][1] + l[1][0]),
    )


@_inlined
def von_mises(s):
    squares = (s[0] - s[1]) ** 2 + (s[1] - s[2]) ** 2 + (s[2] - s[0]) ** 2
    return math.sqrt(0.5 * squares + 3.0 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]))


@_inlined
def sum_of_squares(b):
    return dot(b[0], b[0]) + dot(b[1], b[1]) + dot(b[2], b[2]) + dot(b[3], b[3]) + dot(b[4], b[4]) + dot(b[5], b[5])


@_inlined
def load(a, s, k, e):
    """Entries k, k+1, k+2 of lane e of the block of `a` that starts at s."""
    return a[s + k * _W + e], a[s + (k + 1) * _W + e], a[s + (k + 2) * _W + e]


@_inlined
def store(a, s, k, e, u):
    a[s + k * _W + e], a[s + (k + 1) * _W + e], a[s + (k + 2) * _W + e] = u[0], u[1], u[2]


@_part
def elastic_trial(nodal, dt, material, state, scratch):
    """Everything of a block up to the elastic trial stress, and what the force needs of it.

    nodal : (48*W,) coordinates and velocities;  state : (N_STATE*W,), trial stress and hourglass forces are written
    scratch : (N_SCRATCH*W,) b (18), hourglass coordinates g1..g4 (12), volume, viscous pressure, hourglass work,
        viscous work,
            von Mises stress minus yield stress
    """
    lame, shear, density, speed = material[0], material[1], material[2], material[3]
    linear, quadratic, hourglass, least = material[4], material[5], material[6], material[8]
    for e in range(_W):
        x, v = vector_modes(nodal, e), vector_modes(nodal, 24 * _W + e)
        b, volume = mean_gradient(x)
        end = field_gradient(v, b, volume)
        l = to_mid_step(end, dt)
        r = step_rotation(l, dt)
        old = load(state, 0, 0, e) + load(state, 0, 3, e)
        # half the increment turns with the old stress: second order in dt
        half = add_elastic(old, l, 0.5 * dt, lame, shear)
        stress = add_elastic(rotate_stress(r, half), l, 0.5 * dt, lame, shear)
        store(state, 0, 0, e, stress[:3])
        store(state, 0, 3, e, stress[3:])
        scratch[EXCESS * _W + e] = von_mises(stress) - state[YIELD * _W + e]
        square = 8.0 * sum_of_squares(b)
        length = max(math.sqrt(1.5 / square) * volume, least)
        rate = l[0][0] + l[1][1] + l[2][2]
        compression_rate = min(rate, 0.0)
        viscous = (
            density
            * length
            * (linear * speed * rate - quadratic * quadratic * length * compression_rate * compression_rate)
        )
        k = hourglass * square / volume * dt
        q1, w1 = hourglass_step(load(state, 0, HOURGLASS, e), r, end, x[3], v[3], k)
        q2, w2 = hourglass_step(load(state, 0, HOURGLASS + 3, e), r, end, x[4], v[4], k)
        q3, w3 = hourglass_step(load(state, 0, HOURGLASS + 6, e), r, end, x[5], v[5], k)
        q4, w4 = hourglass_step(load(state, 0, HOURGLASS + 9, e), r, end, x[6], v[6], k)
        store(state, 0, HOURGLASS, e, q1)
        store(state, 0, HOURGLASS + 3, e, q2)
        store(state, 0, HOURGLASS + 6, e, q3)
        store(state, 0, HOURGLASS + 9, e, q4)
        store(scratch, 0, 0, e, b[0])
        store(scratch, 0, 3, e, b[1])
        store(scratch, 0, 6, e, b[2])
        store(scratch, 0, 9, e, b[3])
        store(scratch, 0, 12, e, b[4])
        store(scratch, 0, 15, e, b[5])
        store(scratch, 0, 18, e, x[3])
        store(scratch, 0, 21, e, x[4])
        store(scratch, 0, 24, e, x[5])
        store(scratch, 0, 27, e, x[6])
        scratch[30 * _W + e] = volume
        scratch[31 * _W + e] = viscous
        scratch[32 * _W + e] = 8.0 * dt * (w1 + w2 + w3 + w4)
        scratch[33 * _W + e] = viscous * rate * volume * dt


@_inlined
def hourglass_step(old, r, end, g, gv, k):
    """One mode: q = g(v) - G g(x), x and G on the end configuration, so an affine motion of any size makes none; Q
    turns with the element and grows by k q. Returns Q and its mean power (without the factor 8)."""
    lg, turned = times(end, g), times(r, old)
    q = (gv[0] - lg[0], gv[1] - lg[1], gv[2] - lg[2])
    new = combine(1.0, turned, k, q)
    return new, 0.5 * (dot(turned, q) + dot(new, q))


@_inlined
def store_nodal(f, i, e, linear, higher):
    """Component i of lane e of the modal forces, on (xi, eta, zeta) and (eta zeta, zeta xi, xi eta, xi eta zeta), at
    the eight nodes -> f (24*W,)."""
    fx, fy, fz = linear
    h1, h2, h3, h4 = higher
    x_low, x_top, y_low, y_top = fx - h2, fx + h2, fy - h1, fy + h1
    d_low, d_top = h3 - h4, h3 + h4
    f[i * _W + e] = d_low - x_low - y_low - fz
    f[(3 + i) * _W + e] = x_low - y_low - d_low - fz
    f[(6 + i) * _W + e] = x_low + y_low + d_low - fz
    f[(9 + i) * _W + e] = y_low - x_low - d_low - fz
    f[(12 + i) * _W + e] = d_top - x_top - y_top + fz
    f[(15 + i) * _W + e] = x_top - y_top - d_top + fz
    f[(18 + i) * _W + e] = x_top + y_top + d_top + fz
    f[(21 + i) * _W + e] = y_top - x_top - d_top + fz


@_part
def internal_force(state, scratch, f):
    """Nodal internal forces of a block -> f (24*W,): P b_I + hourglass, P = stress + viscous pressure - 8/V sum of Q
    (x) g."""
    for e in range(_W):
        t, u = load(state, 0, 0, e), load(state, 0, 3, e)
        q1, q2 = load(state, 0, HOURGLASS, e), load(state, 0, HOURGLASS + 3, e)
        q3, q4 = load(state, 0, HOURGLASS + 6, e), load(state, 0, HOURGLASS + 9, e)
        b1, b2, b3 = load(scratch, 0, 0, e), load(scratch, 0, 3, e), load(scratch, 0, 6, e)
        c1, c2, c3 = load(scratch, 0, 9, e), load(scratch, 0, 12, e), load(scratch, 0, 15, e)
        g1, g2, g3, g4 = (
            load(scratch, 0, 18, e),
            load(scratch, 0, 21, e),
            load(scratch, 0, 24, e),
            load(scratch, 0, 27, e),
        )
        k, p = 8.0 / scratch[30 * _W + e], scratch[31 * _W + e]
        rows = ((t[0] + p, u[2], u[1]), (u[2], t[1] + p, u[0]), (u[1], u[0], t[2] + p))
        for i in range(3):
            q = (q1[i], q2[i], q3[i], q4[i])
            row = (
                rows[i][0] - k * (q[0] * g1[0] + q[1] * g2[0] + q[2] * g3[0] + q[3] * g4[0]),
                rows[i][1] - k * (q[0] * g1[1] + q[1] * g2[1] + q[2] * g3[1] + q[3] * g4[1]),
                rows[i][2] - k * (q[0] * g1[2] + q[1] * g2[2] + q[2] * g3[2] + q[3] * g4[2]),
            )
            fx, fy, fz = dot(row, b1), dot(row, b2), dot(row, b3)
            h1, h2, h3 = dot(row, c1) + q[0], dot(row, c2) + q[1], dot(row, c3) + q[2]
            store_nodal(f, i, e, (fx, fy, fz), (h1, h2, h3, q[3]))


@_part
def turn_back_stress(nodal, dt, back):
    """Turn the back stress (6*W,) of a block with the step's rotation, that of `elastic_trial`."""
    for e in range(_W):
        b, volume = mean_gradient(vector_modes(nodal, e))
        r = step_rotation(to_mid_step(field_gradient(vector_modes(nodal, 24 * _W + e), b, volume), dt), dt)
        turned = rotate_stress(r, load(back, 0, 0, e) + load(back, 0, 3, e))
        store(back, 0, 0, e, turned[:3])
        store(back, 0, 3, e, turned[3:])


@_compiled
def update_elements(
    x, v, dt, nodes, filled, material_of, materials, curve_start, curve_strain, curve_stress, state, back, force, work
):
    """One step of every block: stresses from v on the geometry x, minus the internal force added to `force`.

    Parameters
    ----------
    x, v      : (3*n,)  coordinates at the end of the step [m], velocities over it [m/s]
    nodes     : (n_blocks*8*LANES,) block, node, lane; uint32, because a signed index costs a test at every access
    filled    : (n_blocks,) real lanes of each block
    material_of : (n_blocks,) row of `materials` (n_materials, N_MATERIAL);
    curve_start (n_materials+1,) slices the yield curves
    state     : (n_blocks*N_STATE*LANES,) changed in place
    back      : (n_blocks*k*6*LANES,) back stresses, the first of each block changed in place; empty when no material
        has any
    force     : (3*n,)  [N], changed in place
    work      : (3*n_blocks,) [J], plastic, hourglass and viscous work of the step are added to each block's

    Returns the smallest element volume [m3]: not positive, or not a number, where an element has turned inside out.
    Rank-local. Allocates only its block buffers. Error: second order in dt (tests/fe/test_hexahedron.py).
    """
    nodal, scratch, return_factor = np.empty(48 * _W), np.empty(N_SCRATCH * _W), np.empty(_W)
    smallest = np.inf
    for block in range(filled.size):
        start, s, count, row = block * 8 * _W, block * N_STATE * _W, filled[block], material_of[block]
        ahead = s + N_STATE * _W
        fetch(nodes, start + 8 * _W, 8 * _W, INDICES)
        gather(x, v, nodes, start, nodal)
        fetch(state, ahead, _QUARTER, NUMBERS)
        own = state[s : s + N_STATE * _W]
        c0, c1 = curve_start[row], curve_start[row + 1]
        if materials[row, KINEMATIC] > 0.0:
            first = block * (back.size // filled.size)  # a block of another material may hold more of them
            centre = back[first : first + 6 * _W]
            for k in range(6 * _W):
                own[k] -= centre[k]
            turn_back_stress(nodal, dt, centre)
            elastic_trial(nodal, dt, materials[row], own, scratch)
            fetch(state, ahead + _QUARTER, _QUARTER, NUMBERS)
            return_kinematic(
                own,
                centre,
                scratch,
                count,
                materials[row, 1],
                curve_strain[c0:c1],
                curve_stress[c0:c1],
                return_factor,
                N_STATE,
            )
            for k in range(6 * _W):
                own[k] += centre[k]
        else:
            elastic_trial(nodal, dt, materials[row], own, scratch)
            fetch(state, ahead + _QUARTER, _QUARTER, NUMBERS)
            return_isotropic(
                own, scratch, count, materials[row, 1], curve_strain[c0:c1], curve_stress[c0:c1], return_factor, N_STATE
            )
        fetch(state, ahead + 2 * _QUARTER, _QUARTER, NUMBERS)
        for e in range(count):
            work[3 * block] += scratch[EXCESS * _W + e] * scratch[30 * _W + e]
            work[3 * block + 1] += scratch[32 * _W + e]
            work[3 * block + 2] += scratch[33 * _W + e]
            if not scratch[30 * _W + e] >= smallest:
                smallest = scratch[30 * _W + e]
        internal_force(own, scratch, nodal)
        fetch(state, ahead + 3 * _QUARTER, _QUARTER, NUMBERS)
        scatter(nodal, nodes, start, count, force)
    return smallest


@_compiled
def volumes(x, cells):
    """Exact volumes (m,) [m3] of trilinear hexahedra: coordinates x (3*n,), cells (m, 8) in VTK order."""
    nodal, out = np.empty(24 * _W), np.empty(len(cells))
    for first in range(0, len(cells), _W):
        for a in range(8):
            for e in range(_W):
                n, k = 3 * cells[min(first + e, len(cells) - 1), a], 3 * a * _W + e
                nodal[k], nodal[k + _W], nodal[k + 2 * _W] = x[n], x[n + 1], x[n + 2]
        for e in range(min(_W, len(cells) - first)):
            b, volume = mean_gradient(vector_modes(nodal, e))
            out[first + e] = volume
    return out


@_compiled
def stored_energy(x, nodes, filled, material_of, materials, state):
    """Elastic energy [J] of the stresses in `state` on the geometry x."""
    nodal, energy, total = np.empty(24 * _W), np.empty(_W), 0.0
    for block in range(filled.size):
        start, row = block * 8 * _W, material_of[block]
        lame, shear = materials[row, 0], materials[row, 1]
        own = state[block * N_STATE * _W : (block + 1) * N_STATE * _W]
        gather_one(x, nodes, start, nodal)
        for e in range(_W):
            b, volume = mean_gradient(vector_modes(nodal, e))
            energy[e] = volume * energy_density(load(own, 0, 0, e), load(own, 0, 3, e), lame, shear)
        for e in range(filled[block]):
            total += energy[e]
    return total


@_inlined
def energy_density(t, u, lame, shear):
    """Elastic energy of a stress, normal components t and shears u, per volume [J/m3]."""
    trace = t[0] + t[1] + t[2]
    squares = dot(t, t) + 2.0 * dot(u, u)
    return (squares - lame / (3.0 * lame + 2.0 * shear) * trace * trace) / (4.0 * shear)


@_part
def gather_one(x, nodes, start, nodal):
    """One nodal vector of one block -> nodal (24*W,), ordered node, component, lane."""
    for a in range(8):
        for e in range(_W):
            n, k = 3 * nodes[start + a * _W + e], 3 * a * _W + e
            nodal[k], nodal[k + _W], nodal[k + 2 * _W] = x[n], x[n + 1], x[n + 2]


@_part
def gather(x, v, nodes, start, nodal):
    """Two nodal vectors of one block -> nodal (48*W,), ordered vector, node, component, lane."""
    for a in range(8):
        for e in range(_W):
            n, k = 3 * nodes[start + a * _W + e], 3 * a * _W + e
            nodal[k], nodal[k + _W], nodal[k + 2 * _W] = x[n], x[n + 1], x[n + 2]
            nodal[k + 24 * _W], nodal[k + 25 * _W], nodal[k + 26 * _W] = v[n], v[n + 1], v[n + 2]


@_part
def scatter(f_nodal, nodes, start, count, force):
    """Subtract the internal forces of the first `count` lanes from the nodal force."""
    for a in range(8):
        for e in range(count):
            n, k = 3 * nodes[start + a * _W + e], 3 * a * _W + e
            force[n] -= f_nodal[k]
            force[n + 1] -= f_nodal[k + _W]
            force[n + 2] -= f_nodal[k + 2 * _W]
