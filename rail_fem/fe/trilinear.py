"""The trilinear map of an 8-node hexahedron in its modes, its mean gradient and volume.

    x(xi, eta, zeta) = a0 + a1 xi + a2 eta + a3 zeta + g1 eta zeta + g2 zeta xi + g3 xi eta + g4 xi eta zeta

In these modes the volume-averaged gradient of the shape functions, b_I = integral of grad N_I, is short and exact:
    b_I = xi_I A1 + eta_I A2 + zeta_I A3 + (eta zeta)_I C1 + (zeta xi)_I C2 + (xi eta)_I C3,
    A1 = a2 x a3 + g3 x g2 / 3,   C1 = (a3 x g2 + g3 x a2) / 3,   and cyclic.
It equals the uniform gradient of Flanagan and Belytschko (Int. J. Numer. Meth. Eng. 17 (1981) 679) at a third of the
operations; tests/fe/test_hexahedron.py compares it with Gauss quadrature.
"""

from __future__ import annotations

from rail_fem.fe.lanes import inlined
from rail_fem.fe.state import LANES

_W = LANES


@inlined
def cross(u, v):
    return u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]


@inlined
def dot(u, v):
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


@inlined
def combine(s, u, t, v):
    return s * u[0] + t * v[0], s * u[1] + t * v[1], s * u[2] + t * v[2]


@inlined
def times(m, u):
    """3x3 matrix (three row tuples) times vector."""
    return dot(m[0], u), dot(m[1], u), dot(m[2], u)


@inlined
def scalar_modes(n0, n1, n2, n3, n4, n5, n6, n7):
    """Values at the eight nodes -> their 7 modes (xi, eta, zeta, eta zeta, zeta xi, xi eta, xi eta zeta)."""
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


@inlined
def component_modes(n, k, e):
    """`scalar_modes` of component k of the nodal values n (24*W,) of lane e."""
    n0, n1, n2, n3 = n[k * _W + e], n[(3 + k) * _W + e], n[(6 + k) * _W + e], n[(9 + k) * _W + e]
    n4, n5, n6, n7 = n[(12 + k) * _W + e], n[(15 + k) * _W + e], n[(18 + k) * _W + e], n[(21 + k) * _W + e]
    return scalar_modes(n0, n1, n2, n3, n4, n5, n6, n7)


@inlined
def by_mode(x, y, z):
    """The modes of three components -> the 7 modal vectors a1 a2 a3 g1 g2 g3 g4."""
    return (
        (x[0], y[0], z[0]),
        (x[1], y[1], z[1]),
        (x[2], y[2], z[2]),
        (x[3], y[3], z[3]),
        (x[4], y[4], z[4]),
        (x[5], y[5], z[5]),
        (x[6], y[6], z[6]),
    )


@inlined
def vector_modes(n, e):
    """The 7 modal vectors of lane e."""
    return by_mode(component_modes(n, 0, e), component_modes(n, 1, e), component_modes(n, 2, e))


@inlined
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


@inlined
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


@inlined
def field_gradient(m, b, volume):
    """Volume mean of du_i/dx_j of the field with modes m: three rows."""
    s = 8.0 / volume
    return gradient_row(m, b, 0, s), gradient_row(m, b, 1, s), gradient_row(m, b, 2, s)


@inlined
def sum_of_squares(b):
    return dot(b[0], b[0]) + dot(b[1], b[1]) + dot(b[2], b[2]) + dot(b[3], b[3]) + dot(b[4], b[4]) + dot(b[5], b[5])


@inlined
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
