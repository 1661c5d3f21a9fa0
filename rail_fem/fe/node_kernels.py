"""Compiled loops over the nodes of a rank: a step's kick, drift and rigid groups, what contact changes, and the sums
that energies and histories are made of.

They stand here, with nothing of the solver imported, so that an edit elsewhere does not have them compiled again
(kernel_cache).
"""

from __future__ import annotations

import numpy as np

from kernel_cache import njit
from rail_fem.fe.state import LANES

SMALL, CHANGED = 1, 2  # marks of an unknown in `kick`
_inlined = njit(inline="always", error_model="numpy")


@_inlined
def kicked(old, force, inverse_mass, dt):
    """A velocity after the kick."""
    return old + dt * force * inverse_mass


@_inlined
def pushed(v, f, inner, inverse_mass, dt):
    """What a contact force f changes of a velocity v after the kick by the internal force `inner`: the velocity, the
    work of f with the mean of the velocities before and after the whole kick, and that of `inner` [J]."""
    change = dt * f * inverse_mass
    new = v + change
    return new, dt * f * (new - 0.5 * (change + dt * inner * inverse_mass)), 0.5 * dt * inner * change


CHUNK = 2048  # unknowns whose velocities, forces and positions stay in the first caches


@njit(forceinline=True, fastmath={"contract", "reassoc", "nsz"}, error_model="numpy")
def kick_range(v, force, inverse_mass, mass_damping, dt, marks, first, last, works):
    """`kick` of the unknowns first..last-1."""
    all_power, small_power, damping_work = 0.0, 0.0, 0.0
    for i in range(first, last):
        old = v[i]
        new = kicked(old, force[i], inverse_mass[i], dt)
        v[i] = new
        power = 0.5 * force[i] * (old + new)
        all_power += power
        small_power += (marks[i] & SMALL) * power
    if mass_damping > 0.0:
        for i in range(first, last):
            if inverse_mass[i] > 0.0:
                push = 0.5 * dt * force[i] * inverse_mass[i]
                mean = v[i] - push  # the velocity before the kick and half of it
                old = mean - push
                lost = dt * mass_damping * old
                v[i] -= lost
                damping_work += lost / inverse_mass[i] * (mean - 0.5 * lost)
                all_power -= 0.5 * force[i] * lost
                small_power -= 0.5 * (marks[i] & SMALL) * force[i] * lost
    works[0] -= dt * (all_power - small_power)
    works[1] -= dt * small_power
    works[2] += damping_work


@njit(forceinline=True, error_model="numpy")
def drift_range(x, v, dt, force, marks, first, last):
    """`drift` of the unknowns first..last-1 that are not marked as CHANGED."""
    for i in range(first, last):
        later = x[i] + dt * v[i]
        x[i] = x[i] if marks[i] & CHANGED else later
        force[i] = force[i] if marks[i] & CHANGED else 0.0


@njit(cache=True, error_model="numpy")
def kick(v, force, inverse_mass, mass_damping, dt, marks, runs, works, x, drifts):
    """Velocities of owned nodes from internal forces; sums up the internal work. Where it `drifts`, positions too of
    unknowns that nothing else changes in the step; forces there start at 0.

    v, force, inverse_mass, marks, x : (3 n,), inverse_mass 0 where a direction is held or a part moves it, marks
        SMALL on the small-displacement bodies, CHANGED where a part changes velocities after the kick;
    mass_damping [1/s];  runs : (k, 2) the unknowns that a step computes, in ranges first..last-1
    works : (3,) internal work of finite-strain nodes, of small-displacement nodes, damping work, added to [J]
    """
    for r in range(runs.shape[0]):
        end = runs[r, 1]
        for first in range(runs[r, 0], end, np.uint64(CHUNK)):
            last = min(first + np.uint64(CHUNK), end)
            kick_range(v, force, inverse_mass, mass_damping, dt, marks, first, last, works)
            if drifts:
                drift_range(x, v, dt, force, marks, first, last)


@njit(cache=True, error_model="numpy")
def group_reactions(force, members, first, out):
    """Element forces on groups: members[first[g]:first[g+1]] are the owned nodes of group g; out
    (3 n_groups or more,) [N], as many overwritten."""
    for g in range(first.size - 1):
        for c in range(3):
            out[3 * g + c] = 0.0
        for k in range(first[g], first[g + 1]):
            for c in range(3):
                out[3 * g + c] += force[3 * members[k] + c]


@njit(cache=True, error_model="numpy")
def impose_velocities(v, members, first, velocity):
    """Velocities (n_groups, 3) of rigid groups onto their nodes members[first[g]:first[g+1]], in v (3 n,)."""
    for g in range(velocity.shape[0]):
        for k in range(first[g], first[g + 1]):
            for c in range(3):
                v[3 * members[k] + c] = velocity[g, c]


@njit(cache=True, error_model="numpy")
def drift_groups(displacement, velocity, dt):
    """Displacements after the step of rigid groups, both (n_groups, 3)."""
    for g in range(displacement.shape[0]):
        for c in range(3):
            displacement[g, c] += dt * velocity[g, c]


@njit(cache=True, error_model="numpy")
def drift_nodes(x, v, dt, force, nodes):
    """Positions after the step of these nodes; forces there start at 0."""
    for n in nodes:
        for i in range(3 * n, 3 * n + 3):
            x[i] += dt * v[i]
            force[i] = 0.0


@njit(cache=True, error_model="numpy")
def drift(x, v, dt, force, runs):
    """Positions after the step of the unknowns in ranges `runs` (k, 2); forces start at 0."""
    for r in range(runs.shape[0]):
        for i in range(runs[r, 0], runs[r, 1]):
            x[i] += dt * v[i]
            force[i] = 0.0


@njit(cache=True, error_model="numpy")
def apply_contact(v, internal, force, inverse_mass, local, at, small, dt, works):
    """Contact forces onto the velocities of owned nodes; returns their work on the bodies [J].

    v, internal : (3 n,) velocities after the kick without contact, internal forces;
    force : (m, 3), inverse_mass : (m,) of surface nodes
    local, at : (k,) node and surface number of the nodes in question;  small : (n,) as of `add_motion_energy`
    `works` (see `kick`) gets what contact changes of the internal work.
    """
    work = 0.0
    for i in range(local.size):
        n, a = local[i], at[i]
        for c in range(3):
            v[3 * n + c], done, changed = pushed(v[3 * n + c], force[a, c], internal[3 * n + c], inverse_mass[a], dt)
            work += done
            works[small[n]] -= changed
    return work


@njit(cache=True, error_model="numpy")
def free_inverse_mass(mass, moving, inside, out):
    """Inverse masses [1/kg] of the unknowns that move on their own, 0 of all others -> out (3 n,).

    mass : (n,) [kg];  moving : (3 n,) bool, where the node is active;  inside : (n,) bool, whether it is
    """
    for n in range(mass.size):
        inverse = 1.0 / mass[n] if inside[n] else 0.0
        for c in range(3):
            out[3 * n + c] = inverse if moving[3 * n + c] else 0.0


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"}, error_model="numpy")
def add_motion_energy(v, force, mass, small, runs, out):
    """Kinetic energy [J], power of the forces, and its part on small-displacement nodes [W], of the nodes in `runs`.

    v, force : (3 n,);  mass, small : (n,), small 1 on the small-displacement bodies;  out : (3,) added to
    """
    kinetic, all_power, small_power = 0.0, 0.0, 0.0
    for r in range(runs.shape[0]):
        for n in range(runs[r, 0] // np.uint64(3), runs[r, 1] // np.uint64(3)):
            i = np.uint64(3) * n
            a, b, c = v[i], v[i + np.uint64(1)], v[i + np.uint64(2)]
            power = force[i] * a + force[i + np.uint64(1)] * b + force[i + np.uint64(2)] * c
            kinetic += 0.5 * mass[n] * (a * a + b * b + c * c)
            all_power += power
            small_power += small[n] * power
    out[0] += kinetic
    out[1] += all_power
    out[2] += small_power


@njit(cache=True, error_model="numpy")
def all_finite(v, runs):
    """Whether every unknown in `runs` of v (3 n,) is a number."""
    for r in range(runs.shape[0]):
        for i in range(runs[r, 0], runs[r, 1]):
            if not abs(v[i]) < np.inf:
                return False
    return True


@njit(cache=True, error_model="numpy")
def add_motion(v, mass, on_wheel, runs, out):
    """What says how much of the bodies' motion is not that of a rigid one: mass, momentum and kinetic energy of each.

    v : (3 n_nodes,);  mass, on_wheel : (n_nodes,), on_wheel 1 on the wheel, else 0
    runs : (k, 2) the unknowns that count, in ranges first..last-1
    out : (2, 5) of crossing and wheel: mass [kg], momentum along x, y, z [kg m/s], kinetic energy [J], added to
    """
    for r in range(runs.shape[0]):
        for i in range(runs[r, 0] // np.uint64(3), runs[r, 1] // np.uint64(3)):
            row, m = out[on_wheel[i]], mass[i]
            row[0] += m
            for c in range(3):
                speed = v[3 * i + c]
                row[1 + c] += m * speed
                row[4] += 0.5 * m * speed * speed


@njit(cache=True, error_model="numpy")
def add_step(force, normal_force, position, area, watched, n_rail, region, total, moment):
    """Contact forces of a step added up over the rail's nodes `watched` (those below n_rail; ascending).

    force : (n, 3) [N];  normal_force : (n,) normal force [N];  position : (n, 3) [m];  area : (n,) of the nodes [m2];
    region : (n_rail,) number of the body, wing or nose
    total : (5,) in the order of rail_fem.fe.recorder.FORCES [N]
    moment : (4,) normal force, its moments of x and y, and force times pressure [N, N m, N m, N Pa]
    """
    for n in watched:
        if n >= n_rail:
            break
        if normal_force[n] == 0.0:  # and with it the force
            continue
        total[0] -= force[n, 2]
        total[1 + region[n]] -= force[n, 2]
        total[3] -= force[n, 0]
        total[4] -= force[n, 1]
        moment[0] += normal_force[n]
        moment[1] += normal_force[n] * position[n, 0]
        moment[2] += normal_force[n] * position[n, 1]
        moment[3] += normal_force[n] * normal_force[n] / area[n]


@njit(cache=True, error_model="numpy")
def within(active, region, first, last, in_slabs):
    """Nodes (n,) bool with an element in the active slabs, and with none outside of them.

    active : (n_regions, 2) range of active slabs of each body
    region, first, last, in_slabs : (n,) of the nodes, their body, first and last slab, and whether that body is cut
        into slabs: if not, they are both
    """
    touched, inside = np.ones(region.size, np.bool_), np.ones(region.size, np.bool_)
    for n in range(region.size):
        if in_slabs[n]:
            low, end = active[region[n], 0], active[region[n], 1]
            touched[n] = last[n] >= low and first[n] < end
            inside[n] = first[n] >= low and last[n] < end
    return touched, inside


@njit(cache=True, error_model="numpy")
def unmarked(blocks, nodes, marks, mark):
    """Which of the blocks (k,) bool have no node with this mark. nodes : of all blocks, one block after the other;
    marks : (3 n,) of the unknowns, those of a node alike"""
    out, width = np.ones(blocks.size, np.bool_), 8 * LANES
    for k in range(blocks.size):
        for i in range(blocks[k] * width, (blocks[k] + 1) * width):
            if marks[3 * nodes[i]] & mark:
                out[k] = False
                break
    return out


@njit(cache=True, error_model="numpy")
def take_rows(field, nodes, rows):
    """Values at nodes (k,) of a field (3 n,) -> rows (k, 3)."""
    for k in range(nodes.size):
        for c in range(3):
            rows[k, c] = field[3 * nodes[k] + c]


@njit(cache=True, error_model="numpy")
def sum_rows(field, nodes, parts, rows):
    """Values of a field (3 n,) at nodes (m,): the sum of the rows (k, 3) of each, those of node parts[i] in row i."""
    for n in nodes:
        field[3 * n] = field[3 * n + 1] = field[3 * n + 2] = 0.0
    for k in range(parts.size):
        for c in range(3):
            field[3 * parts[k] + c] += rows[k, c]
