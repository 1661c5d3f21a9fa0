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


class Riding(NamedTuple):
    """Nodes that ride on plane sections at stations, of which each moves along x, y, z and turns about x.

    first (k,) : motion along x of the station behind each;  share (k,) : how far it is towards the next, 0 to 1
    arm (k, 2) : y, z from the axis of the turn [m]
    """

    first: np.ndarray
    share: np.ndarray
    arm: np.ndarray


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"}, error_model="numpy")
def work_on_sections(vectors, weights, members, owned, riding, out):
    """Of vectors (3 n,) times weights (n,) at nodes `members` (k,) below `owned`, what they do along each motion of the
    sections, added in out (m,): forces with weights 1 [N; N m], velocities with masses [kg m/s; kg m2/s]."""
    for n in members:
        if n >= owned:
            continue
        weight, share = weights[n], riding.share[n]
        x, y, z = weight * vectors[3 * n], weight * vectors[3 * n + 1], weight * vectors[3 * n + 2]
        turn = riding.arm[n, 0] * z - riding.arm[n, 1] * y
        at = riding.first[n]
        for station, part in ((at, 1.0 - share), (at + 4, share)):
            out[station] += part * x
            out[station + 1] += part * y
            out[station + 2] += part * z
            out[station + 3] += part * turn


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"}, error_model="numpy")
def add_sections(members, riding, amounts, out):
    """Motions of the sections by their amounts (m,) onto nodes `members` (k,), added in out (3 n,)."""
    for n in members:
        at, share = riding.first[n], riding.share[n]
        turn = (1.0 - share) * amounts[at + 3] + share * amounts[at + 7]
        out[3 * n] += (1.0 - share) * amounts[at] + share * amounts[at + 4]
        out[3 * n + 1] += (1.0 - share) * amounts[at + 1] + share * amounts[at + 5] - turn * riding.arm[n, 1]
        out[3 * n + 2] += (1.0 - share) * amounts[at + 2] + share * amounts[at + 6] + turn * riding.arm[n, 0]


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"}, error_model="numpy")
def mass_on_sections(masses, members, riding, out):
    """Lumped mass of nodes `members` (k,), masses (n,) [kg], added in out (m,) [kg; kg m2]."""
    for n in members:
        share, arm = riding.share[n], riding.arm[n, 0] ** 2 + riding.arm[n, 1] ** 2
        at = riding.first[n]
        for station, part in ((at, 1.0 - share), (at + 4, share)):
            for c in range(3):
                out[station + c] += part * masses[n]
            out[station + 3] += part * masses[n] * arm


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"}, error_model="numpy")
def kick_sections(work, stiffness, inertia, damping, along_z, amplitude, rate, foot, onto_foot, dt, push):
    """Rates (m,) after dt, in place, of sections on a block over a foot of mass `foot` [kg], infinite where it stands,
    and what the foot rises faster by [m/s] -> that, Kicked.

    work (m,) : forces of what rides on them [N; N m];  inertia (m,) [kg; kg m2];  damping [1/s]
    along_z (m,) : motions of a foot that rises;  onto_foot : other forces on it [N];  push (m,) : overwritten
    """
    for i in range(work.size):
        elastic = 0.0
        for j in range(work.size):
            elastic += stiffness[i, j] * amplitude[j]
        block = elastic + damping * inertia[i] * rate[i]
        onto_foot += along_z[i] * block
        push[i] = work[i] - block
    rise = dt * onto_foot / foot
    dissipated = changed = 0.0
    for i in range(work.size):
        whole = dt * push[i] / inertia[i]
        change = whole - rise * along_z[i]
        dissipated += dt * damping * inertia[i] * rate[i] * (rate[i] + 0.5 * change)
        changed += work[i] * whole
        rate[i] += change
    return rise, Kicked(dissipated, changed)
