"""Closest points of nodes on bilinear facets, found by walking from facet to facet. Compiled, no mesh.

Newton's method on a facet, on to the neighbour where it leads beyond an edge. Between facets that meet at an angle, or
whose shape is far from a parallelogram, it may lead to and fro: then the closest point within the edges of the facets
around is taken. Without that a node in the groove between two facets, which both say is the other's, would fall out of
contact until the next search, sink in by as much as the surfaces close until then, and be thrown out within one step.
"""

from __future__ import annotations

import math

import numpy as np

from rail_fem.fe.contact.compiled import compiled, inlined, uncounted

OUTSIDE = 1.02  # local coordinate beyond which a projection belongs to the neighbour
NEWTON_STEPS = 12
SWEEPS, SETTLED = 50, 1e-10  # of the closest point within a facet's edges, and the change at which it is found
LEAST_COSINE = 0.5  # between facet's normal and the way to the node: a node farther aside does not lie over the facet
PROJECTION = 7  # numbers of a pair's projection


@uncounted
def facet_point(position, quad, xi, eta, point, t1, t2):
    """Point and tangents of a bilinear facet at (xi, eta)."""
    for c in range(3):
        p0, p1, p2, p3 = position[quad[0], c], position[quad[1], c], position[quad[2], c], position[quad[3], c]
        a, b, d = p0 + p1 + p2 + p3, p1 + p2 - p0 - p3, p2 + p3 - p0 - p1
        e = p0 + p2 - p1 - p3
        point[c] = 0.25 * (a + b * xi + d * eta + e * xi * eta)
        t1[c] = 0.25 * (b + e * eta)
        t2[c] = 0.25 * (d + e * xi)


@uncounted
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
                facet, xi, eta = project_within(position, node, facet, quads, neighbours, usable, point, t1, t2)
                break
            facet, xi, eta = other, 0.0, 0.0
        elif abs(dxi) + abs(deta) < 1e-10:
            break
    if facet >= 0:
        facet_point(position, quads[facet], xi, eta, point, t1, t2)
    return facet, xi, eta


@uncounted
def moved_within(local, position, node, point, tangent):
    """A local coordinate moved along its tangent from `point` to below `node`, no farther than the facet's edges."""
    along = length = 0.0
    for c in range(3):
        along += tangent[c] * (position[node, c] - point[c])
        length += tangent[c] * tangent[c]
    return min(max(local + along / length, -1.0), 1.0) if length > 0.0 else 0.0


@uncounted
def within_edges(position, node, quad, point, t1, t2):
    """Closest point of `node` on a bilinear facet within its edges, by turns along xi and eta: xi, eta, distance
    squared [m2]."""
    xi = eta = 0.0
    for _ in range(SWEEPS):
        before = xi, eta
        facet_point(position, quad, xi, eta, point, t1, t2)
        xi = moved_within(xi, position, node, point, t1)
        facet_point(position, quad, xi, eta, point, t1, t2)
        eta = moved_within(eta, position, node, point, t2)
        if abs(xi - before[0]) + abs(eta - before[1]) < SETTLED:
            break
    facet_point(position, quad, xi, eta, point, t1, t2)
    square = 0.0
    for c in range(3):
        square += (position[node, c] - point[c]) ** 2
    return xi, eta, square


@uncounted
def project_within(position, node, facet, quads, neighbours, usable, point, t1, t2):
    """Closest point of `node` on the surface around a facet, within the facets' edges: facet (-1: the node is beyond
    the surface's end, or beside it), xi, eta. From facet to facet while one around is closer, so it comes to an end."""
    xi, eta, least = within_edges(position, node, quads[facet], point, t1, t2)
    for _ in range(NEWTON_STEPS):
        centre = facet
        for side in range(4):
            first = neighbours[centre, side]
            if first < 0 or not usable[first]:
                continue
            for turn in range(-1, 4):  # the neighbour itself and its own, among them those across a corner
                other = first if turn < 0 else neighbours[first, turn]
                if other < 0 or other == centre or not usable[other]:
                    continue
                a, b, square = within_edges(position, node, quads[other], point, t1, t2)
                if square < least:
                    facet, xi, eta, least = other, a, b, square
        if facet == centre:
            break
    facet_point(position, quads[facet], xi, eta, point, t1, t2)
    nx, ny, nz = t1[1] * t2[2] - t1[2] * t2[1], t1[2] * t2[0] - t1[0] * t2[2], t1[0] * t2[1] - t1[1] * t2[0]
    dx, dy, dz = position[node, 0] - point[0], position[node, 1] - point[1], position[node, 2] - point[2]
    over = nx * dx + ny * dy + nz * dz
    if over * over < LEAST_COSINE * LEAST_COSINE * least * (nx * nx + ny * ny + nz * nz):
        return -1, 0.0, 0.0
    beyond1 = dx * t1[0] + dy * t1[1] + dz * t1[2]
    beyond2 = dx * t2[0] + dy * t2[1] + dz * t2[2]
    for side in range(4):
        other = neighbours[facet, side]
        if other >= 0 and usable[other]:
            continue
        t = t1 if side % 2 else t2
        sign = 1.0 if side == 1 or side == 2 else -1.0
        outward = sign * (beyond1 if side % 2 else beyond2)
        if sign * (xi if side % 2 else eta) >= 1.0 and outward > (OUTSIDE - 1.0) * (
            t[0] * t[0] + t[1] * t[1] + t[2] * t[2]
        ):
            return -1, 0.0, 0.0
    return facet, xi, eta


@uncounted
def project_pair(position, pairs, i, rows, point, t1, t2):
    """Projection of pair i at positions (n, 3), from where `facets` and `where` say -> row i of rows (k, PROJECTION), 0
    before: facet (-1: none), xi, eta, gap [m], normal. point, t1, t2 : (3,) buffers"""
    node, f, xi, eta = pairs.slaves[i], pairs.facets[i], 0.0, 0.0
    if f >= 0:
        start = pairs.where[i, 0], pairs.where[i, 1]
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


@inlined
def project_some(position, pairs, first, every, rows):
    """Projections of every so many pairs from number `first` on -> rows (k, PROJECTION); 0 in the rows of other pairs,
    so that the rows of all ranks add up to all projections, exactly."""
    point, t1, t2 = np.empty(3), np.empty(3), np.empty(3)
    rows[:] = 0.0
    for i in range(first, pairs.slaves.size, every):
        project_pair(position, pairs, i, rows, point, t1, t2)


@uncounted
def take_pair(rows, pairs, i):
    """The projection of pair i -> `facets`, `where`, `gap`, `weight`, `ahead`, and `normal` as `ahead` was; whether it
    carried and has lost its facet."""
    f = int(rows[i, 0])
    pairs.facets[i] = f
    if f < 0:
        return pairs.pressure[i] > 0.0
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
    return False


@uncounted
def take(rows, pairs):
    """`take_pair` of all pairs; how many that carried have lost their facet."""
    lost = 0
    for i in range(pairs.slaves.size):
        lost += take_pair(rows, pairs, i)
    return lost


@compiled
def project_share(position, pairs, first, every, rows):
    """`project_some` of one surface's pairs."""
    project_some(position, pairs, first, every, rows)


@compiled
def take_projections(rows, pairs):
    """`take` of one surface's pairs."""
    return take(rows, pairs)


@compiled
def add_overlap(position, pairs, area, found):
    """How deep nodes lie below the facets of the pairs that carry, at positions (n, 3) -> found (3,): the largest depth
    or that there [m]; force times depth [N m] and force [N] are added. area : (n,) of the nodes [m2]"""
    rows = np.zeros((pairs.slaves.size, PROJECTION))
    point, t1, t2 = np.empty(3), np.empty(3), np.empty(3)
    for i in range(pairs.slaves.size):
        if pairs.active[i] and pairs.pressure[i] > 0.0:
            project_pair(position, pairs, i, rows, point, t1, t2)
            if rows[i, 0] >= 0:
                depth, force = max(-rows[i, 3], 0.0), pairs.pressure[i] * area[pairs.slaves[i]]
                found[0], found[1], found[2] = max(found[0], depth), found[1] + force * depth, found[2] + force


def project_pairs(position, pairs):
    """Projection of all pairs at positions (n, 3), from where `facets` and `where` say: these, `gap`, `normal`, `ahead`
    and `weight` are changed."""
    rows = np.empty((len(pairs.slaves), PROJECTION))
    project_share(position, pairs, 0, 1, rows)
    take_projections(rows, pairs)
