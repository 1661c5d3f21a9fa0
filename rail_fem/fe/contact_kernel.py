"""Contact of nodes against bilinear facets: projection, normal pressure and Coulomb friction. Compiled, allocation-free, no mesh.

A pair is one slave node and the facet that it lies over. The gap is taken where the nodes would be at the end of the
step without contact. The pressure that closes it is
    p = -gap / (1/k + dt^2 D),     D = sum over the nodes of the pair |coefficient| S / mass,
where k [Pa/m] is the penalty stiffness per area and S the area that all active pairs put on a node. The second term is
the row sum of the contact operator, so the step is stable for any k and needs no reduction; for k to infinity it is the
forward increment Lagrange multiplier method of Carpenter, Taylor and Katona (IJNME 32 (1991) 103) with a lumped operator.
Without it (explicit penalty, k up to 1 / (dt^2 D)) the same pressure leaves a penetration p / k_stable at any load.

Both surfaces are slave once, each with half the pressure (balanced). Friction acts in the pass of the rail's nodes, which
move with their material; the wheel's material flows through its mesh, and its velocity has the term omega x r.
"""

from __future__ import annotations

import math

import numba
import numpy as np

_compiled = numba.njit(cache=True, error_model="numpy")
_part = numba.njit(forceinline=True, error_model="numpy")
OUTSIDE = 1.02  # local coordinate beyond which a projection belongs to the neighbour
NEWTON_STEPS = 12
# entries of the sums that `contact_forces` returns
NORMAL_ENERGY, FRICTION_WORK, DRIVE_WORK, DEEPEST, N_ACTIVE = range(5)
N_SUMS = 5


@_compiled
def pack(x, v, dt, local, slot, buffer):
    """Positions now and, without contact, after the step, of the nodes `local` of this rank -> rows `slot` of buffer (m, 6); 0 elsewhere."""
    buffer[:] = 0.0
    for i in range(local.size):
        for c in range(3):
            now = x[3 * local[i] + c]
            buffer[slot[i], c] = now
            buffer[slot[i], 3 + c] = now + dt * v[3 * local[i] + c]


@_compiled
def unpack(buffer, watched, n_rail, offset, way, before, position, force, carried, pressure_at):
    """Rows of all ranks onto the surface nodes `watched`, the wheel's (from n_rail on) moved by offset and `way` of the step; forces start at 0."""
    for i in range(watched.size):
        n = watched[i]
        for c in range(3):
            before[n, c], position[n, c], force[n, c] = buffer[i, c], buffer[i, 3 + c], 0.0
        if n >= n_rail:
            before[n, 0] += offset
            position[n, 0] += offset + way
        carried[n], pressure_at[n] = 0.0, 0.0


@_part
def facet_point(position, quad, xi, eta, point, t1, t2):
    """Point and tangents of a bilinear facet at (xi, eta)."""
    for c in range(3):
        p0, p1, p2, p3 = position[quad[0], c], position[quad[1], c], position[quad[2], c], position[quad[3], c]
        a, b, d = p0 + p1 + p2 + p3, p1 + p2 - p0 - p3, p2 + p3 - p0 - p1
        e = p0 + p2 - p1 - p3
        point[c] = 0.25 * (a + b * xi + d * eta + e * xi * eta)
        t1[c] = 0.25 * (b + e * eta)
        t2[c] = 0.25 * (d + e * xi)


@_part
def project(position, node, facet, xi, eta, quads, neighbours, usable, point, t1, t2):
    """Closest point of `node` on the surface, walking from facet to facet; returns facet (-1: off the surface), xi, eta."""
    walked = 0
    for _ in range(4 * NEWTON_STEPS):
        facet_point(position, quads[facet], xi, eta, point, t1, t2)
        a11 = a12 = a22 = r1 = r2 = 0.0
        for c in range(3):
            d = position[node, c] - point[c]
            a11 += t1[c] * t1[c]
            a12 += t1[c] * t2[c]
            a22 += t2[c] * t2[c]
            r1 += t1[c] * d
            r2 += t2[c] * d
        det = a11 * a22 - a12 * a12
        dxi, deta = (a22 * r1 - a12 * r2) / det, (a11 * r2 - a12 * r1) / det
        xi, eta = xi + dxi, eta + deta
        side = -1
        if max(abs(xi), abs(eta)) > OUTSIDE:
            if abs(xi) >= abs(eta):
                side = 1 if xi > 0 else 3
            else:
                side = 2 if eta > 0 else 0
        if side >= 0:
            other = neighbours[facet, side]
            if other < 0 or not usable[other]:
                return -1, 0.0, 0.0
            walked += 1
            if walked > NEWTON_STEPS:
                return -1, 0.0, 0.0
            facet, xi, eta = other, 0.0, 0.0
        elif abs(dxi) + abs(deta) < 1e-10:
            break
    facet_point(position, quads[facet], xi, eta, point, t1, t2)
    return facet, xi, eta


@_compiled
def project_pairs(position, slaves, facets, local, quads, neighbours, usable, gap, normal, weight):
    """Projection of all pairs.

    position : (n, 3);  slaves : (k,) nodes;  facets : (k,) start facet, changed (-1: none);  local : (k, 2) xi, eta, changed
    quads, neighbours : (q, 4) nodes and facets across the edges 01, 12, 23, 30;  usable : (q,) facets whose nodes are up to date
    gap : (k,), normal : (k, 3), weight : (k, 4) out
    """
    point, t1, t2 = np.empty(3), np.empty(3), np.empty(3)
    for i in range(slaves.size):
        if facets[i] < 0:
            continue
        f, xi, eta = project(position, slaves[i], facets[i], local[i, 0], local[i, 1], quads, neighbours, usable, point, t1, t2)
        facets[i] = f
        if f < 0:
            continue
        local[i, 0], local[i, 1] = xi, eta
        nx, ny, nz = t1[1] * t2[2] - t1[2] * t2[1], t1[2] * t2[0] - t1[0] * t2[2], t1[0] * t2[1] - t1[1] * t2[0]
        s = 1.0 / math.sqrt(nx * nx + ny * ny + nz * nz)
        normal[i, 0], normal[i, 1], normal[i, 2] = nx * s, ny * s, nz * s
        g = 0.0
        for c in range(3):
            g += (position[slaves[i], c] - point[c]) * normal[i, c]
        gap[i] = g
        weight[i, 0], weight[i, 1] = 0.25 * (1 - xi) * (1 - eta), 0.25 * (1 + xi) * (1 - eta)
        weight[i, 2], weight[i, 3] = 0.25 * (1 + xi) * (1 + eta), 0.25 * (1 - xi) * (1 + eta)


@_compiled
def add_shares(slaves, facets, active, weight, area, factor, quads, share):
    """Area that each node carries for all active pairs -> share (n,)."""
    for i in range(slaves.size):
        if active[i]:
            a = factor * area[slaves[i]]
            share[slaves[i]] += a
            for k in range(4):
                share[quads[facets[i], k]] += weight[i, k] * a


@_compiled
def normal_forces(slaves, facets, active, gap, normal, weight, area, factor, compliance, dt, quads, share, inverse_mass, reference, spin, pressure, carried, force, sums):
    """Pressures of one pass, their forces on the nodes, and the scalar normal force that each node carries.

    spin : angular velocity of the slaves' material about the axle, 0 in the pass of the rail's nodes (there the flow is tangential)
    """
    for i in range(slaves.size):
        pressure[i] = 0.0
        if not active[i]:
            continue
        s, q = slaves[i], quads[facets[i]]
        d = share[s] * inverse_mass[s]
        for k in range(4):
            d += weight[i, k] * share[q[k]] * inverse_mass[q[k]]
        pressure[i] = -gap[i] / (compliance + dt * dt * d)
        f = factor * area[s] * pressure[i]
        carried[s] += f
        for k in range(4):
            carried[q[k]] += weight[i, k] * f
        for c in range(3):
            force[s, c] += f * normal[i, c]
            for k in range(4):
                force[q[k], c] -= weight[i, k] * f * normal[i, c]
        sums[NORMAL_ENERGY] += 0.5 * f * pressure[i] * compliance
        sums[DRIVE_WORK] += dt * f * spin * (normal[i, 0] * reference[s, 2] - normal[i, 2] * reference[s, 0])
        sums[N_ACTIVE] += 1


@_part
def material_flow(reference, position, quad, weight, spin, flow, t1, t2, r1, r2, point):
    """Velocity of the wheel's material through its mesh at a point of a facet: omega x r carried along the deformed facet."""
    xi = weight[1] + weight[2] - weight[0] - weight[3]
    eta = weight[2] + weight[3] - weight[0] - weight[1]
    facet_point(reference, quad, xi, eta, point, r1, r2)
    wx, wz = spin * point[2], -spin * point[0]
    a11 = r1[0] * r1[0] + r1[1] * r1[1] + r1[2] * r1[2]
    a22 = r2[0] * r2[0] + r2[1] * r2[1] + r2[2] * r2[2]
    a12 = r1[0] * r2[0] + r1[1] * r2[1] + r1[2] * r2[2]
    b1, b2 = r1[0] * wx + r1[2] * wz, r2[0] * wx + r2[2] * wz
    det = a11 * a22 - a12 * a12
    c1, c2 = (a22 * b1 - a12 * b2) / det, (a11 * b2 - a12 * b1) / det
    facet_point(position, quad, xi, eta, point, t1, t2)
    for c in range(3):
        flow[c] = c1 * t1[c] + c2 * t2[c]


@_compiled
def friction_forces(
    slaves, facets, active, normal, weight, area, quads, share, inverse_mass, position, before, reference, spin, friction, compliance, dt, carried, slip, sticking, moved, drag, force, sums
):
    """Coulomb friction of the rail's nodes: elastic slip (n, 3) per node with the same implicit stiffness, returned to the cone mu * carried.

    moved, drag : (k, 3) out, way of the node over the wheel's material without contact [m] and friction force on the wheel [N]
    """
    flow, t1, t2 = np.empty(3), np.empty(3), np.empty(3)
    r1, r2, point, trial = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for i in range(slaves.size):
        s = slaves[i]
        if not active[i]:
            slip[s, 0] = slip[s, 1] = slip[s, 2] = 0.0
            continue
        q = quads[facets[i]]
        material_flow(reference, position, q, weight[i], spin, flow, t1, t2, r1, r2, point)
        d = share[s] * inverse_mass[s]
        for k in range(4):
            d += weight[i, k] * share[q[k]] * inverse_mass[q[k]]
        along = 0.0
        for c in range(3):
            move = position[s, c] - before[s, c] - dt * flow[c]
            for k in range(4):
                move -= weight[i, k] * (position[q[k], c] - before[q[k], c])
            moved[i, c] = move
            trial[c] = slip[s, c] + move
            along += trial[c] * normal[i, c]
        size = 0.0
        for c in range(3):
            trial[c] -= along * normal[i, c]
            size += trial[c] * trial[c]
        size = math.sqrt(size)
        stiffness = area[s] / (compliance + dt * dt * d)
        f = stiffness * size
        bound = friction * carried[s]
        sliding = f > bound
        if sliding:
            f = bound
        scale = f / size if size > 0.0 else 0.0
        sticking[i] = not sliding
        for c in range(3):
            slip[s, c] = trial[c] * (compliance * scale / area[s] if sliding else 1.0)
            force[s, c] -= scale * trial[c]
            drag[i, c] = scale * trial[c]
            sums[DRIVE_WORK] += dt * drag[i, c] * flow[c]
            for k in range(4):
                force[q[k], c] += weight[i, k] * drag[i, c]


@_compiled
def finish_slip(slaves, facets, active, sticking, normal, weight, quads, inverse_mass, force, dt, moved, drag, slip, sums):
    """After all forces: elastic slip of sticking nodes with what the contact forces move within the step, and the work of friction."""
    for i in range(slaves.size):
        if not active[i]:
            continue
        s, q = slaves[i], quads[facets[i]]
        along = 0.0
        for c in range(3):
            change = force[s, c] * inverse_mass[s]
            for k in range(4):
                change -= weight[i, k] * force[q[k], c] * inverse_mass[q[k]]
            change *= dt * dt
            sums[FRICTION_WORK] += drag[i, c] * (moved[i, c] + change)
            if sticking[i]:
                slip[s, c] += change
                along += slip[s, c] * normal[i, c]
        if sticking[i]:
            for c in range(3):
                slip[s, c] -= along * normal[i, c]
