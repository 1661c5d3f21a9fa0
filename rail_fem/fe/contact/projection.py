"""Closest points of nodes on bilinear facets, found by walking from facet to facet. Compiled, no mesh."""

from __future__ import annotations

import math

import numpy as np

from kernel_cache import njit

_compiled = njit(cache=True, error_model="numpy")
# self-contained kernels: the same bits from the compiler and from the cache
_part = njit(forceinline=True, error_model="numpy")
OUTSIDE = 1.02  # local coordinate beyond which a projection belongs to the neighbour
NEWTON_STEPS = 12
PROJECTION = 7  # numbers of a pair's projection


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


@_part
def project_some(position, pairs, first, every, rows):
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


@_part
def take(rows, pairs):
    """All projections -> `facets`, `where`, `gap`, `weight`, `ahead`, and `normal` as `ahead` was; how many pairs that
    carried have lost their facet."""
    lost = 0
    for i in range(pairs.slaves.size):
        f = int(rows[i, 0])
        pairs.facets[i] = f
        if f < 0:
            lost += pairs.pressure[i] > 0.0
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
    return lost


@_compiled
def project_share(position, pairs, first, every, rows):
    """`project_some` of one surface's pairs."""
    project_some(position, pairs, first, every, rows)


@_compiled
def take_projections(rows, pairs):
    """`take` of one surface's pairs."""
    return take(rows, pairs)


def project_pairs(position, pairs):
    """Projection of all pairs at positions (n, 3), from where `facets` and `where` say: these, `gap`, `normal`, `ahead`
    and `weight` are changed."""
    rows = np.empty((len(pairs.slaves), PROJECTION))
    project_share(position, pairs, 0, 1, rows)
    take_projections(rows, pairs)
