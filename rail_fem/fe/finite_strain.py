"""Rotation and elastic stress of a step at finite strain, for one point of one element.

Velocity gradient on the mid-step configuration, rotation by Hughes and Winget (Int. J. Numer. Meth. Eng. 15 (1980)
1862), so that a rigid rotation of any size strains nothing.
"""

from __future__ import annotations

import math

from rail_fem.fe.lanes import inlined
from rail_fem.fe.trilinear import cross, dot, times


@inlined
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


@inlined
def mid_row(g, k0, k1, k2, s):
    return (
        s * (g[0] * k0[0] + g[1] * k0[1] + g[2] * k0[2]),
        s * (g[0] * k1[0] + g[1] * k1[1] + g[2] * k1[2]),
        s * (g[0] * k2[0] + g[1] * k2[1] + g[2] * k2[2]),
    )


@inlined
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


@inlined
def rotate_stress(r, s):
    """R S R^T in the order VOIGT."""
    s0, s1, s2 = (s[0], s[5], s[4]), (s[5], s[1], s[3]), (s[4], s[3], s[2])
    t0, t1, t2 = times((s0, s1, s2), r[0]), times((s0, s1, s2), r[1]), times((s0, s1, s2), r[2])
    return dot(r[0], t0), dot(r[1], t1), dot(r[2], t2), dot(r[1], t2), dot(r[0], t2), dot(r[0], t1)


@inlined
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


@inlined
def von_mises(s):
    squares = (s[0] - s[1]) ** 2 + (s[1] - s[2]) ** 2 + (s[2] - s[0]) ** 2
    return math.sqrt(0.5 * squares + 3.0 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]))
