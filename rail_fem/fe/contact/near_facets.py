"""Which facets of two surfaces may come near to each other: boxes around them, sorted in plan. Compiled, no mesh."""

from __future__ import annotations

import numpy as np

from rail_fem.fe.contact.compiled import compiled, inlined

TINY = 1e-300
COLUMNS = 24  # cells in plan along and across, in which surfaces are looked for that come near to each other


@compiled
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


@compiled
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


@inlined
def column(distance, per_metre):
    """Number 0..COLUMNS-1 of the cell at a distance [m] from the first, those beyond in the outer ones."""
    return int(min(max(distance * per_metre, 0.0), COLUMNS - 1.0))


@compiled
def nodes_of(quads, facets, n):
    """Nodes (m,) of the facets (k,) among n, ascending, each once."""
    wanted, count = np.zeros(n, np.bool_), 0
    for f in facets:
        for k in range(4):
            count += not wanted[quads[f, k]]
            wanted[quads[f, k]] = True
    out, count = np.empty(count, np.int64), 0
    for i in range(n):
        if wanted[i]:
            out[count] = i
            count += 1
    return out


@compiled
def facet_centres(position, quads, facets):
    """Mean positions (k, 3) of the corners of the facets (k,)."""
    out = np.empty((facets.size, 3))
    for i in range(facets.size):
        q = quads[facets[i]]
        for c in range(3):
            out[i, c] = (position[q[0], c] + position[q[1], c] + position[q[2], c] + position[q[3], c]) / 4.0
    return out


@compiled
def with_neighbours(facets, neighbours, rings):
    """(q,) bool: the facets (k,) and those up to so many facets away across edges."""
    out = np.zeros(neighbours.shape[0], np.bool_)
    ring = np.empty(neighbours.shape[0], np.int64)
    count = 0
    for f in facets:
        if not out[f]:
            out[f], ring[count] = True, f
            count += 1
    first = 0
    for _ in range(rings):
        last = count
        for i in range(first, last):
            for k in range(4):
                other = neighbours[ring[i], k]
                if other >= 0 and not out[other]:
                    out[other], ring[count] = True, other
                    count += 1
        first = last
    return out


@compiled
def nearest_facets(position, nodes, first, every, centres):
    """For every so many of the nodes (m,), from number `first` on, the number of the nearest of the centres (k, 3),
    k > 0; 0 for the others. Centres are sorted into square cells in plan, and cells looked at in rings until none
    beyond can hold a nearer one."""
    count = centres.shape[0]
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for f in range(count):
        for c in range(2):
            low[c], high[c] = min(low[c], centres[f, c]), max(high[c], centres[f, c])
    wide = max(high[0] - low[0], high[1] - low[1], TINY)
    side = max(np.sqrt((high[0] - low[0]) * (high[1] - low[1]) / count), wide / count, TINY)
    nx, ny = int((high[0] - low[0]) / side) + 1, int((high[1] - low[1]) / side) + 1
    start = np.zeros(nx * ny + 1, np.int64)
    cell = np.empty(count, np.int64)
    for f in range(count):
        i, j = int((centres[f, 0] - low[0]) / side), int((centres[f, 1] - low[1]) / side)
        cell[f] = min(i, nx - 1) * ny + min(j, ny - 1)
        start[cell[f] + 1] += 1
    for i in range(nx * ny):
        start[i + 1] += start[i]
    place, order = start[:-1].copy(), np.empty(count, np.int64)
    for f in range(count):
        order[place[cell[f]]] = f
        place[cell[f]] += 1
    out = np.zeros(nodes.size, np.int64)
    for m in range(first, nodes.size, every):
        p = position[nodes[m]]
        i0 = int(min(max((p[0] - low[0]) / side, 0.0), nx - 1.0))
        j0 = int(min(max((p[1] - low[1]) / side, 0.0), ny - 1.0))
        least = np.inf
        for ring in range(max(nx, ny)):
            for i in range(max(i0 - ring, 0), min(i0 + ring, nx - 1) + 1):
                inner = abs(i - i0) < ring
                for j in range(max(j0 - ring, 0), min(j0 + ring, ny - 1) + 1):
                    if inner and abs(j - j0) < ring:
                        continue
                    for k in range(start[i * ny + j], start[i * ny + j + 1]):
                        f = order[k]
                        dx, dy, dz = centres[f, 0] - p[0], centres[f, 1] - p[1], centres[f, 2] - p[2]
                        square = dx * dx + dy * dy + dz * dz
                        if square < least:
                            least, out[m] = square, f
            if least <= (ring * side) ** 2:
                break
    return out
