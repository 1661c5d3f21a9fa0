"""Compiled loops over the nodes that ride on a condensed body (rail_fem.fe.elastic_group).

They stand here, with nothing of the solver imported, so that an edit elsewhere does not have them compiled again
(kernel_cache).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kernel_cache import njit


class Modes(NamedTuple):
    """Decoupled modes of a body on a rigid motion U, z'' + b^T U'' = forces - w^2 z - 2 d w z'.

    of_functions (f, m) : part of each displacement function in them [1/kg^0.5];  square, damping (m,) : w^2, 2 d w
    [1/s^2, 1/s];  momentum b (3, m) [kg^0.5], and b b^T (3, 3) [kg]
    """

    of_functions: np.ndarray
    square: np.ndarray
    damping: np.ndarray
    momentum: np.ndarray
    shared: np.ndarray


class Kicked(NamedTuple):
    """Work of a kick [J]: lost by the modes' damping, done by the nodes' forces on what the velocities changed by."""

    dissipated: float
    changed: float


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"}, error_model="numpy")
def work_on_functions(force, members, owned, functions, out):
    """Generalised forces of displacement functions (3 k, f) under forces (3 n,) [N] on nodes `members` (k,), of which
    those below `owned` count, out (f,) [N], overwritten."""
    out[:] = 0.0
    for k in range(members.size):
        if members[k] >= owned:
            continue
        at = 3 * members[k]
        x, y, z = force[at], force[at + 1], force[at + 2]
        for j in range(out.size):
            out[j] += x * functions[3 * k, j] + y * functions[3 * k + 1, j] + z * functions[3 * k + 2, j]


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"}, error_model="numpy")
def rates_of_functions(modes, rate, out):
    """Of the displacement functions where the modes have a rate (m,), out (f,) [m/s], overwritten."""
    for j in range(out.size):
        out[j] = 0.0
        for i in range(rate.size):
            out[j] += modes.of_functions[j, i] * rate[i]


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"}, error_model="numpy")
def add_functions(members, functions, amounts, out):
    """Displacement functions (3 k, f) times their amounts (f,) onto nodes `members` (k,), added in out (3 n,)."""
    for k in range(members.size):
        x = y = z = 0.0
        for j in range(amounts.size):
            x += functions[3 * k, j] * amounts[j]
            y += functions[3 * k + 1, j] * amounts[j]
            z += functions[3 * k + 2, j] * amounts[j]
        at = 3 * members[k]
        out[at] += x
        out[at + 1] += y
        out[at + 2] += z


@njit(cache=True, fastmath={"contract"}, error_model="numpy")
def kick_modes(modes, work, amplitude, rate, velocity, force, reaction, mass, dt, pressed, push):
    """Rates of the modes (m,) and velocity (3,) of the rigid motion under it after dt, in place -> Kicked.

    work (f,) : forces on the functions [N];  force, reaction (3,) : on the rigid motion, and of it the nodes' [N];
    mass (3,) : of that motion in each direction, 0 where it is held [kg];  pressed, push (m,) : overwritten
    """
    for i in range(rate.size):
        pressed[i] = 0.0
    for j in range(work.size):
        for i in range(rate.size):
            pressed[i] += work[j] * modes.of_functions[j, i]
    for i in range(rate.size):
        push[i] = pressed[i] - modes.square[i] * amplitude[i] - modes.damping[i] * rate[i]
    acceleration = _rigid_acceleration(modes, push, force, mass)
    dissipated = changed = 0.0
    for c in range(3):
        velocity[c] += dt * acceleration[c]
        changed += reaction[c] * dt * acceleration[c]
    for i in range(rate.size):
        along = 0.0
        for c in range(3):
            along += modes.momentum[c, i] * acceleration[c]
        change = dt * (push[i] - along)
        dissipated += dt * modes.damping[i] * rate[i] * (rate[i] + 0.5 * change)
        changed += pressed[i] * change
        rate[i] += change
    return Kicked(dissipated, changed)


@njit(forceinline=True, fastmath={"contract"}, error_model="numpy")
def _rigid_acceleration(modes, push, force, mass):
    """Of the directions that have a mass, the modes eliminated; 0 of the others."""
    x = _row(0, modes, push, force, mass)
    y = _row(1, modes, push, force, mass)
    z = _row(2, modes, push, force, mass)
    whole = _determinant(x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2])
    return (
        _determinant(x[3], x[1], x[2], y[3], y[1], y[2], z[3], z[1], z[2]) / whole,
        _determinant(x[0], x[3], x[2], y[0], y[3], y[2], z[0], z[3], z[2]) / whole,
        _determinant(x[0], x[1], x[3], y[0], y[1], y[3], z[0], z[1], z[3]) / whole,
    )


@njit(forceinline=True, fastmath={"contract"}, error_model="numpy")
def _row(c, modes, push, force, mass):
    """Of (mass - b b^T) U'' = force - b push, the equation of direction c: three coefficients and the right side."""
    moves, right = 1.0, force[c]
    if not mass[c] > 0:
        moves, right = 0.0, 0.0
    for i in range(push.size):
        right -= moves * modes.momentum[c, i] * push[i]
    own, b = 1.0 - moves + mass[c], modes.shared[c]
    return own * (c == 0) - moves * b[0], own * (c == 1) - moves * b[1], own * (c == 2) - moves * b[2], right


@njit(forceinline=True, fastmath={"contract"}, error_model="numpy")
def _determinant(a, b, c, d, e, f, g, h, i):
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
