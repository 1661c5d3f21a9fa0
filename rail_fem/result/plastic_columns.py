"""Metal counted in columns across a body's plan: compiled sums over the parts of its cells.

A cell is cut along its own axes into `counts` (3,) equal parts, each with its share of the volume and a vertical extent
`height` [m]; a part counts whole in the column of its middle. Columns are `width` [m] wide, from `origin` (2,) [m] on.
"""

import math

from kernel_cache import njit

_inlined = njit(forceinline=True, error_model="numpy")
_compiled = njit(cache=True, error_model="numpy")


@_inlined
def _at(p, r, s, t, c):
    """Component c of the point at r, s, t from 0 to 1 in a cell of corners p (8, 3)."""
    low = (1 - s) * ((1 - r) * p[0, c] + r * p[1, c]) + s * ((1 - r) * p[3, c] + r * p[2, c])
    return (1 - t) * low + t * ((1 - s) * ((1 - r) * p[4, c] + r * p[5, c]) + s * ((1 - r) * p[7, c] + r * p[6, c]))


@_inlined
def _part(p, counts, k, origin, width):
    """Of part k of a cell: its column, two numbers, and the height of its middle [m]."""
    r = (k % counts[0] + 0.5) / counts[0]
    s = (k // counts[0] % counts[1] + 0.5) / counts[1]
    t = (k // (counts[0] * counts[1]) + 0.5) / counts[2]
    i, j = math.floor((_at(p, r, s, t, 0) - origin[0]) / width), math.floor((_at(p, r, s, t, 1) - origin[1]) / width)
    return int(i), int(j), _at(p, r, s, t, 2)


@_inlined
def _overlap(depth, height, upper, lower):
    """Part of a piece with its middle at `depth` and so high that lies between two depths."""
    inside = min(depth + 0.5 * height, lower) - max(depth - 0.5 * height, upper)
    return min(max(inside / height, 0.0), 1.0)


@_compiled
def raise_tops(corners, counts, height, origin, width, top):
    """Height of the metal's top in each column -> top (nx, ny) [m], at least what it was. corners : (m, 8, 3) [m];
    counts : (m, 3);  height : (m,)"""
    for cell in range(len(corners)):
        for k in range(counts[cell, 0] * counts[cell, 1] * counts[cell, 2]):
            i, j, z = _part(corners[cell], counts[cell], k, origin, width)
            top[i, j] = max(top[i, j], z + 0.5 * height[cell])


@_compiled
def add_metal(corners, counts, height, volume, strain, origin, width, top, deep, metal, filled):
    """Volume and volume times strain of what lies less `deep` below the top of its column [m] -> metal, filled
    (nx, ny), added. volume, strain : (m,)"""
    for cell in range(len(corners)):
        parts = counts[cell, 0] * counts[cell, 1] * counts[cell, 2]
        for k in range(parts):
            i, j, z = _part(corners[cell], counts[cell], k, origin, width)
            share = volume[cell] / parts * _overlap(top[i, j] - z, height[cell], 0.0, deep)
            metal[i, j] += share
            filled[i, j] += share * strain[cell]


@_compiled
def add_layers(corners, counts, height, volume, fields, origin, width, top, first, end, layer, metal, filled):
    """The same of layers so thick [m] one below the other, in columns first..end-1 (2,) -> metal (k,), and of each of
    the fields (m, f) -> filled (k, f)."""
    for cell in range(len(corners)):
        parts = counts[cell, 0] * counts[cell, 1] * counts[cell, 2]
        for part in range(parts):
            i, j, z = _part(corners[cell], counts[cell], part, origin, width)
            if first[0] <= i < end[0] and first[1] <= j < end[1]:
                for k in range(len(metal)):
                    share = _overlap(top[i, j] - z, height[cell], k * layer, (k + 1) * layer)
                    share *= volume[cell] / parts
                    metal[k] += share
                    for f in range(fields.shape[1]):
                        filled[k, f] += share * fields[cell, f]
