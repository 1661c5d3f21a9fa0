"""Coulomb friction of the rail's nodes on the wheel's material, which flows through the wheel's mesh. Compiled,
allocation-free but for a few vectors, no mesh."""

from __future__ import annotations

import math

import numpy as np

from rail_fem.fe.contact.compiled import inlined, uncounted
from rail_fem.fe.contact.pairs import AXLE_MOMENT, FRICTION_WORK
from rail_fem.fe.contact.pressure import pair_mobility
from rail_fem.fe.contact.projection import facet_point


@uncounted
def material_flow(reference, position, quad, weight, yaw, flow, t1, t2, r1, r2, point):
    """Velocity of the wheel's material through its mesh at a point of a facet, for 1 rad/s: e x r taken along the
    deformed facet, e = (-yaw, 1, 0) the axle of a wheel that heads to +y by a small angle."""
    xi = weight[1] + weight[2] - weight[0] - weight[3]
    eta = weight[2] + weight[3] - weight[0] - weight[1]
    facet_point(reference, quad, xi, eta, point, r1, r2)
    wx, wy, wz = point[2], yaw * point[2], -point[0] - yaw * point[1]
    a11 = r1[0] * r1[0] + r1[1] * r1[1] + r1[2] * r1[2]
    a22 = r2[0] * r2[0] + r2[1] * r2[1] + r2[2] * r2[2]
    a12 = r1[0] * r2[0] + r1[1] * r2[1] + r1[2] * r2[2]
    b1, b2 = r1[0] * wx + r1[2] * wz + r1[1] * wy, r2[0] * wx + r2[2] * wz + r2[1] * wy
    det = a11 * a22 - a12 * a12
    c1, c2 = (a22 * b1 - a12 * b2) / det, (a11 * b2 - a12 * b1) / det
    facet_point(position, quad, xi, eta, point, t1, t2)
    for c in range(3):
        flow[c] = c1 * t1[c] + c2 * t2[c]


@uncounted
def rub(pairs, i, nodes, law, spin, yaw, dt, found, sliding, sums, flow, trial, t1, t2, r1, r2, point):
    """Friction of pair i of the rail's nodes: elastic slip with the implicit stiffness of the normal force, returned to
    the cone friction * normal force -> `slip`, `sticking`, `moved`, `drag` of the pair, moment added to sums.

    flow ... point : (3,) buffers
    """
    normal, weight, position, before = pairs.normal, pairs.weight, nodes.position, nodes.before
    slip, drag = found.slip, sliding.drag
    s, q = pairs.slaves[i], pairs.quads[pairs.facets[i]]
    material_flow(nodes.from_axle, position, q, weight[i], yaw, flow, t1, t2, r1, r2, point)
    along = 0.0
    for c in range(3):
        move = position[s, c] - before[s, c] - dt * spin * flow[c]
        for k in range(4):
            move -= weight[i, k] * (position[q[k], c] - before[q[k], c])
        sliding.moved[i, c] = move
        trial[c] = slip[s, c] + move
        along += trial[c] * normal[i, c]
    size = 0.0
    for c in range(3):
        trial[c] -= along * normal[i, c]
        size += trial[c] * trial[c]
    size = math.sqrt(size)
    stiffness = nodes.area[s] / (
        law.compliance + dt * dt * pair_mobility(pairs, i, found.tributary_area, nodes.inverse_mass)
    )
    f = stiffness * size
    bound = law.friction * found.normal_force[s]
    sliding_now = f > bound
    if sliding_now:
        f = bound
    scale = f / size if size > 0.0 else 0.0
    sliding.sticking[i] = not sliding_now
    for c in range(3):
        slip[s, c] = trial[c] * (law.compliance * scale / nodes.area[s] if sliding_now else 1.0)
        drag[i, c] = scale * trial[c]
        sums[AXLE_MOMENT] += drag[i, c] * flow[c]


@inlined
def add_friction_forces(pairs, nodes, law, spin, yaw, dt, found, sliding, sums):
    """Coulomb friction of the rail's nodes; fills `sliding`."""
    flow, trial, point = np.empty(3), np.empty(3), np.empty(3)
    t1, t2, r1, r2 = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    weight, force, drag = pairs.weight, found.force, sliding.drag
    for i in range(pairs.slaves.size):
        s = pairs.slaves[i]
        if not pairs.active[i]:
            found.slip[s, 0] = found.slip[s, 1] = found.slip[s, 2] = 0.0
            continue
        rub(pairs, i, nodes, law, spin, yaw, dt, found, sliding, sums, flow, trial, t1, t2, r1, r2, point)
        q = pairs.quads[pairs.facets[i]]
        for c in range(3):
            force[s, c] -= drag[i, c]
            for k in range(4):
                force[q[k], c] += weight[i, k] * drag[i, c]


@uncounted
def settle_slip(pairs, i, inverse_mass, dt, found, sliding, sums):
    """After all forces: elastic slip of a sticking node with what the contact forces move within the step, and the work
    of friction, of pair i."""
    slip, force = found.slip, found.force
    s, q = pairs.slaves[i], pairs.quads[pairs.facets[i]]
    along = 0.0
    for c in range(3):
        change = force[s, c] * inverse_mass[s]
        for k in range(4):
            change -= pairs.weight[i, k] * force[q[k], c] * inverse_mass[q[k]]
        change *= dt * dt
        sums[FRICTION_WORK] += sliding.drag[i, c] * (sliding.moved[i, c] + change)
        if sliding.sticking[i]:
            slip[s, c] += change
            along += slip[s, c] * pairs.normal[i, c]
    if sliding.sticking[i]:
        for c in range(3):
            slip[s, c] -= along * pairs.normal[i, c]


@uncounted
def finish_slip(pairs, inverse_mass, dt, found, sliding, sums):
    """`settle_slip` of all pairs that carry."""
    for i in range(pairs.slaves.size):
        if pairs.active[i]:
            settle_slip(pairs, i, inverse_mass, dt, found, sliding, sums)
