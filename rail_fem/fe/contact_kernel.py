"""Contact of nodes against bilinear facets: projection, normal pressure and Coulomb friction. Compiled,
allocation-free, no mesh.

A pair is one slave node and the facet that it lies over. The gap is taken where the nodes would be at the end of the
step without contact; the pressures that close the gaps are found together (rail_fem.fe.contact_pressure): the forward
increment Lagrange multiplier method of Carpenter, Taylor and Katona (IJNME 32 (1991) 103) with the compliance of a
penalty beside it, stable for any penalty. An explicit penalty k, at most 1 / (dt^2 D), would leave a penetration p / k
of that size at any load.

Both surfaces are slave once, each with half the pressure (balanced). Friction acts in the pass of the rail's nodes,
which move with their material; the wheel's material flows through its mesh, and its velocity has the term omega x r.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kernel_cache import njit
from rail_fem.fe.contact_pressure import add_tributary_areas, find_pressures, pair_mobility

_compiled = njit(cache=True, error_model="numpy")
# self-contained kernels: the same bits from the compiler and from the cache
_part = njit(forceinline=True, error_model="numpy")
OUTSIDE = 1.02  # local coordinate beyond which a projection belongs to the neighbour
NEWTON_STEPS = 12
TINY = 1e-300
PROJECTION = 7  # numbers of a pair's projection
COLUMNS = 24  # cells in plan along and across, in which surfaces are looked for that come near to each other
# entries of the sums that `contact_forces` adds up: energies of the step [J], moment on the wheel about its axle (y) [N
# m], force on it along x [N], active pairs
NORMAL_ENERGY, FRICTION_WORK, AXLE_MOMENT, TOWED, N_ACTIVE = range(5)
N_SUMS = 5


class _PairArrays(NamedTuple):
    """What `Pairs` hold: a NamedTuple takes nothing but fields."""

    slaves: np.ndarray
    facets: np.ndarray
    where: np.ndarray
    quads: np.ndarray
    neighbours: np.ndarray
    usable: np.ndarray
    gap: np.ndarray
    normal: np.ndarray
    weight: np.ndarray
    pressure: np.ndarray
    active: np.ndarray
    ahead: np.ndarray
    trial: np.ndarray
    yielding: np.ndarray


class Pairs(_PairArrays):
    """Nodes of one surface over facets of the other, and what a step finds for them.

    slaves : (k,) nodes;  facets : (k,) facet under each, -1 none;  where : (k, 2) its position xi, eta there
    quads, neighbours : (q, 4) nodes of the facets, facets across the edges 01, 12, 23, 30;
    usable : (q,) facets whose nodes are up to date
    gap [m], normal, weight of the facet's nodes, pressure [Pa], active : (k,), (k, 3), (k, 4), (k,), (k,)
    ahead : (k, 3) normal at the end of the step, which the next one's forces go along, so that their work on surfaces
        that slide over each other is that on the gap;  trial, yielding : (k,) scratch of rail_fem.fe.contact_pressure
    """

    __slots__ = ()
    STATE = (
        *("slaves", "facets", "where", "usable", "gap", "normal", "weight", "pressure", "active", "ahead"),
        *("trial", "yielding"),
    )

    @staticmethod
    def over(quads, neighbours, usable, slaves, facets, where) -> Pairs:
        """With room for the results of a step."""
        k = len(slaves)
        return Pairs(
            slaves,
            facets,
            where,
            quads,
            neighbours,
            usable,
            np.zeros(k),
            np.zeros((k, 3)),
            np.zeros((k, 4)),
            np.zeros(k),
            np.zeros(k, np.bool_),
            np.zeros((k, 3)),
            np.zeros(k),
            np.zeros(k),
        )


class Nodes(NamedTuple):
    """Surface nodes, the rail's first, and where they are.

    area [m2], inverse_mass [1/kg] : (n,);  from_axle : (n, 3) reference position of the wheel's nodes [m]
    position, before : (n, 3) at the end of the step without contact, and at its start [m]
    """

    area: np.ndarray
    inverse_mass: np.ndarray
    from_axle: np.ndarray
    position: np.ndarray
    before: np.ndarray


class Law(NamedTuple):
    """compliance : 1 / penalty per area [m/Pa];  friction [1];  deepest : penetration beyond which a projection is not
    believed [m]"""

    compliance: float
    friction: float
    deepest: float


class NodalForces(NamedTuple):
    """What a step finds at the surface nodes: area that the active pairs put on each [m2], scalar normal force on each
    [N], (n,); force on each (n, 3) [N]; pressure as a slave [Pa] (n,); elastic slip of the rail's nodes (n, 3) [m]."""

    tributary_area: np.ndarray
    normal_force: np.ndarray
    force: np.ndarray
    pressure_at: np.ndarray
    slip: np.ndarray


class Sliding(NamedTuple):
    """Of the rail's k pairs: sticking (k,); path of the node over the wheel's material without contact (k, 3) [m];
    friction force on the wheel (k, 3) [N]."""

    sticking: np.ndarray
    moved: np.ndarray
    drag: np.ndarray


@_compiled
def pack(x, v, dt, local, slot, buffer):
    """Positions now and, without contact, after the step, of the nodes `local` of this rank -> rows `slot` of buffer
    (m, 6); 0 elsewhere."""
    buffer[:] = 0.0
    for i in range(local.size):
        for c in range(3):
            now = x[3 * local[i] + c]
            buffer[slot[i], c] = now
            buffer[slot[i], 3 + c] = now + dt * v[3 * local[i] + c]


@_compiled
def unpack(buffer, watched, n_rail, offset, travel, before, position):
    """Rows of all ranks onto the surface nodes `watched`, the wheel's (from n_rail on) moved by offset and `travel` of
    the step."""
    for i in range(watched.size):
        n = watched[i]
        for c in range(3):
            before[n, c], position[n, c] = buffer[i, c], buffer[i, 3 + c]
        if n >= n_rail:
            before[n, 0] += offset
            position[n, 0] += offset + travel


@_compiled
def facet_boxes(position, quads, reach):
    """Corners low and high (q, 3) of the boxes around facets, wider by `reach` (3,) [m] on all sides."""
    low, high = np.empty((quads.shape[0], 3)), np.empty((quads.shape[0], 3))
    for f in range(quads.shape[0]):
        for c in range(3):
            low[f, c] = high[f, c] = position[quads[f, 0], c]
            for k in range(1, 4):
                p = position[quads[f, k], c]
                low[f, c], high[f, c] = min(low[f, c], p), max(high[f, c], p)
            low[f, c] -= reach[c]
            high[f, c] += reach[c]
    return low, high


@_compiled
def share_space(rail, wheel):
    """Which boxes of one set may overlap one of the other's: (q1,), (q2,) bool. Too many, never too few: in plan boxes
    are sorted into COLUMNS x COLUMNS cells of the rectangle that both sets share, and kept where in one of their cells
    their height meets the range of the other set's. Twice, with what is left.

    rail, wheel : low, high corners of boxes, each (q, 3) [m]
    """
    sets = (rail, wheel)
    kept = (np.ones(rail[0].shape[0], np.bool_), np.ones(wheel[0].shape[0], np.bool_))
    heights = np.empty((2, COLUMNS, COLUMNS, 2))
    box = np.empty((2, 3, 2))
    for _ in range(2):
        box[:, :, 0], box[:, :, 1] = np.inf, -np.inf
        for k in range(2):
            low, high = sets[k]
            for f in range(low.shape[0]):
                if kept[k][f]:
                    for c in range(3):
                        box[k, c, 0], box[k, c, 1] = min(box[k, c, 0], low[f, c]), max(box[k, c, 1], high[f, c])
        x0, x1 = max(box[0, 0, 0], box[1, 0, 0]), min(box[0, 0, 1], box[1, 0, 1])
        y0, y1 = max(box[0, 1, 0], box[1, 1, 0]), min(box[0, 1, 1], box[1, 1, 1])
        if not (x1 >= x0 and y1 >= y0):
            kept[0][:], kept[1][:] = False, False
            return kept
        dx, dy = COLUMNS / max(x1 - x0, TINY), COLUMNS / max(y1 - y0, TINY)
        heights[..., 0], heights[..., 1] = np.inf, -np.inf
        for fill in (True, False):
            for k in range(2):
                low, high = sets[k]
                for f in range(low.shape[0]):
                    if not kept[k][f]:
                        continue
                    meets = False
                    if low[f, 0] <= x1 and high[f, 0] >= x0 and low[f, 1] <= y1 and high[f, 1] >= y0:
                        i0, i1 = column(low[f, 0] - x0, dx), column(high[f, 0] - x0, dx)
                        j0, j1 = column(low[f, 1] - y0, dy), column(high[f, 1] - y0, dy)
                        for i in range(i0, i1 + 1):
                            for j in range(j0, j1 + 1):
                                if fill:
                                    heights[k, i, j, 0] = min(heights[k, i, j, 0], low[f, 2])
                                    heights[k, i, j, 1] = max(heights[k, i, j, 1], high[f, 2])
                                    meets = True
                                elif low[f, 2] <= heights[1 - k, i, j, 1] and high[f, 2] >= heights[1 - k, i, j, 0]:
                                    meets = True
                    kept[k][f] = meets
    return kept


@_part
def column(distance, per_metre):
    """Number 0..COLUMNS-1 of the cell at a distance [m] from the first, those beyond in the outer ones."""
    return int(min(max(distance * per_metre, 0.0), COLUMNS - 1.0))


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
    """Closest point of `node` on the surface, walking from facet to facet; returns facet (-1: off the surface), xi,
    eta."""
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
def project_share(position, pairs, first, every, rows):
    """Projection at positions (n, 3) of every so many pairs from number `first` on, from where `facets` and `where` say
    -> rows (k, PROJECTION): facet (-1: none), xi, eta, gap [m], normal; 0 in the rows of other pairs, so that the rows
    of all ranks add up to all projections, exactly."""
    point, t1, t2 = np.empty(3), np.empty(3), np.empty(3)
    slaves, facets, local = pairs.slaves, pairs.facets, pairs.where
    rows[:] = 0.0
    for i in range(first, slaves.size, every):
        node, f, xi, eta = slaves[i], facets[i], 0.0, 0.0
        if f >= 0:
            start = local[i, 0], local[i, 1]
            f, xi, eta = project(
                position, node, f, start[0], start[1], pairs.quads, pairs.neighbours, pairs.usable, point, t1, t2
            )
        rows[i, 0], rows[i, 1], rows[i, 2] = f, xi, eta
        if f >= 0:
            nx, ny, nz = t1[1] * t2[2] - t1[2] * t2[1], t1[2] * t2[0] - t1[0] * t2[2], t1[0] * t2[1] - t1[1] * t2[0]
            s = 1.0 / math.sqrt(nx * nx + ny * ny + nz * nz)
            normal = nx * s, ny * s, nz * s
            for c in range(3):
                rows[i, 3] += (position[node, c] - point[c]) * normal[c]
                rows[i, 4 + c] = normal[c]


@_compiled
def take_projections(rows, pairs):
    """All projections -> `facets`, `where`, `gap`, `weight`, `ahead`, and `normal` as `ahead` was."""
    for i in range(pairs.slaves.size):
        f = int(rows[i, 0])
        pairs.facets[i] = f
        if f < 0:
            continue
        xi, eta = rows[i, 1], rows[i, 2]
        pairs.where[i, 0], pairs.where[i, 1], pairs.gap[i] = xi, eta, rows[i, 3]
        ahead = pairs.ahead[i]
        known = ahead[0] != 0.0 or ahead[1] != 0.0 or ahead[2] != 0.0
        for c in range(3):
            pairs.normal[i, c] = ahead[c] if known else rows[i, 4 + c]
            ahead[c] = rows[i, 4 + c]
        weight = pairs.weight[i]
        weight[0], weight[1] = 0.25 * (1 - xi) * (1 - eta), 0.25 * (1 + xi) * (1 - eta)
        weight[2], weight[3] = 0.25 * (1 + xi) * (1 + eta), 0.25 * (1 - xi) * (1 + eta)


def project_pairs(position, pairs):
    """Projection of all pairs at positions (n, 3), from where `facets` and `where` say: these, `gap`, `normal`, `ahead`
    and `weight` are changed."""
    rows = np.empty((len(pairs.slaves), PROJECTION))
    project_share(position, pairs, 0, 1, rows)
    take_projections(rows, pairs)


@_part
def add_normal_forces(pairs, nodes, factor, law, of_wheel, found, sums):
    """The pressures of one pass as forces on the nodes, and as the scalar normal force on each node.

    of_wheel : 1 in the pass of the wheel's nodes, 0 in that of the rail's: there the wheel's material flows along the
        facets
    """
    normal, weight, force, normal_force = pairs.normal, pairs.weight, found.force, found.normal_force
    from_axle = nodes.from_axle
    for i in range(pairs.slaves.size):
        s, p = pairs.slaves[i], pairs.pressure[i]
        if pairs.active[i]:
            q = pairs.quads[pairs.facets[i]]
            f = factor * nodes.area[s] * p
            normal_force[s] += f
            for k in range(4):
                normal_force[q[k]] += weight[i, k] * f
            for c in range(3):
                force[s, c] += f * normal[i, c]
                for k in range(4):
                    force[q[k], c] -= weight[i, k] * f * normal[i, c]
            sums[NORMAL_ENERGY] += 0.5 * f * p * law.compliance
            sums[AXLE_MOMENT] += of_wheel * f * (normal[i, 0] * from_axle[s, 2] - normal[i, 2] * from_axle[s, 0])
            sums[N_ACTIVE] += 1
        found.pressure_at[s] = p


@_part
def material_flow(reference, position, quad, weight, flow, t1, t2, r1, r2, point):
    """Velocity of the wheel's material through its mesh at a point of a facet, for 1 rad/s: e_y x r taken along the
    deformed facet."""
    xi = weight[1] + weight[2] - weight[0] - weight[3]
    eta = weight[2] + weight[3] - weight[0] - weight[1]
    facet_point(reference, quad, xi, eta, point, r1, r2)
    wx, wz = point[2], -point[0]
    a11 = r1[0] * r1[0] + r1[1] * r1[1] + r1[2] * r1[2]
    a22 = r2[0] * r2[0] + r2[1] * r2[1] + r2[2] * r2[2]
    a12 = r1[0] * r2[0] + r1[1] * r2[1] + r1[2] * r2[2]
    b1, b2 = r1[0] * wx + r1[2] * wz, r2[0] * wx + r2[2] * wz
    det = a11 * a22 - a12 * a12
    c1, c2 = (a22 * b1 - a12 * b2) / det, (a11 * b2 - a12 * b1) / det
    facet_point(position, quad, xi, eta, point, t1, t2)
    for c in range(3):
        flow[c] = c1 * t1[c] + c2 * t2[c]


@_part
def add_friction_forces(pairs, nodes, law, spin, dt, found, sliding, sums):
    """Coulomb friction of the rail's nodes: elastic slip per node with the same implicit stiffness, returned to the
    cone friction * normal force; fills `sliding`."""
    flow, t1, t2 = np.empty(3), np.empty(3), np.empty(3)
    r1, r2, point, trial = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    normal, weight, position, before = pairs.normal, pairs.weight, nodes.position, nodes.before
    slip, force, moved, drag = found.slip, found.force, sliding.moved, sliding.drag
    for i in range(pairs.slaves.size):
        s = pairs.slaves[i]
        if not pairs.active[i]:
            slip[s, 0] = slip[s, 1] = slip[s, 2] = 0.0
            continue
        q = pairs.quads[pairs.facets[i]]
        material_flow(nodes.from_axle, position, q, weight[i], flow, t1, t2, r1, r2, point)
        along = 0.0
        for c in range(3):
            move = position[s, c] - before[s, c] - dt * spin * flow[c]
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
            force[s, c] -= scale * trial[c]
            drag[i, c] = scale * trial[c]
            sums[AXLE_MOMENT] += drag[i, c] * flow[c]
            for k in range(4):
                force[q[k], c] += weight[i, k] * drag[i, c]


@_part
def finish_slip(pairs, inverse_mass, dt, found, sliding, sums):
    """After all forces: elastic slip of sticking nodes with what the contact forces move within the step, and the work
    of friction."""
    slip, force = found.slip, found.force
    for i in range(pairs.slaves.size):
        if not pairs.active[i]:
            continue
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


@_compiled
def contact_forces(on_rail, on_wheel, watched, n_rail, nodes, law, spin, dt, found, sliding, sums):
    """All contact forces of a step, from the projections that the pairs hold.

    on_rail, on_wheel : Pairs of the rail's nodes over the wheel's facets and the reverse;
    watched : (w,) surface nodes in question, the wheel's from number n_rail on;  nodes : Nodes;  law : Law;  spin of
        the wheel [rad/s]
    found : NodalForces, all but the slip overwritten on `watched`;  sliding : Sliding of the rail's pairs, overwritten;
    sums : (N_SUMS,) overwritten
    With friction the rail's pairs are left active where their node carries normal force, its own or of the wheel's
    nodes.
    """
    sums[:] = 0.0
    for n in watched:
        found.tributary_area[n], found.normal_force[n], found.pressure_at[n] = 0.0, 0.0, 0.0
        found.force[n, 0] = found.force[n, 1] = found.force[n, 2] = 0.0
    for side in range(2):
        pairs = on_wheel if side else on_rail
        for i in range(pairs.slaves.size):
            pairs.active[i] = pairs.facets[i] >= 0 and -law.deepest < pairs.gap[i] < 0.0
        add_tributary_areas(pairs, nodes.area, 0.5, found.tributary_area)
    find_pressures(on_rail, on_wheel, watched, nodes, law, dt, found.tributary_area, found.force)
    for side in range(2):
        add_normal_forces(on_wheel if side else on_rail, nodes, 0.5, law, side, found, sums)
    if law.friction > 0.0:
        for n in watched:
            found.tributary_area[n] = 0.0
        # a node that only the wheel's nodes press rubs as well: at the rim of the patch there are some
        for i in range(on_rail.slaves.size):
            on_rail.active[i] = on_rail.facets[i] >= 0 and found.normal_force[on_rail.slaves[i]] > 0.0
        add_tributary_areas(on_rail, nodes.area, 1.0, found.tributary_area)
        add_friction_forces(on_rail, nodes, law, spin, dt, found, sliding, sums)
        finish_slip(on_rail, nodes.inverse_mass, dt, found, sliding, sums)
    for n in watched:
        if n >= n_rail:
            sums[TOWED] += found.force[n, 0]
