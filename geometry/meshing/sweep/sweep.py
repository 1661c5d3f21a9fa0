"""Sweep a section's quads along stations into conforming hexahedra, three fine slabs meeting one coarse slab.

Over each group of three slabs: fine quads give three hexahedra, coarse quads one, and each strip cell four, by the
3:1 template seen from the side (x to the right, fine side on top; numbers are stations):

    a0 --- a1 --- a2 --- a3
     |     |      |      |
     |    m1 --- m2      |
     |  /            \\   |
    c0 ---------------- c3
"""

import numpy as np

from geometry.meshing.hexmesh import HexMesh, boundary_faces, orient
from geometry.meshing.section.quads import QuadSection


def sweep(
    section: QuadSection,
    positions: np.ndarray,
    name: str,
    surface_nodes: np.ndarray | None = None,
    cut_ends_clamped: bool = False,
) -> HexMesh:
    """Hexahedra through a section carried along stations.

    section   : quads and node sets of the section
    positions : (3 g + 1, n, 3) position [m] of every section node at every station (unused combinations are ignored)
    name      : the body's name;  surface_nodes : section nodes on the running surface, the whole outline if None
    cut_ends_clamped : clamp the nodes of the first and last station besides the base
    surface is the sweep of the surface nodes; clamp the swept base. Raises MeshError where the stations are not 3 g +
    1.
    """
    stations = len(positions)
    cells = orient(positions.reshape(-1, 3), _cells(section, stations))
    used = np.unique(cells)
    number = np.full(positions.shape[0] * positions.shape[1], -1)
    number[used] = np.arange(len(used))
    cells = number[cells]
    station, node = np.divmod(used, positions.shape[1])
    on_outline, on_base = (
        np.isin(node, nodes) for nodes in (section.on_curve if surface_nodes is None else surface_nodes, section.base)
    )
    surface, _ = boundary_faces(cells)
    along = station[surface].max(axis=1) > station[surface].min(axis=1)
    surface = surface[along & on_outline[surface].all(axis=1)]
    clamped = on_base | (cut_ends_clamped & ((station == 0) | (station == stations - 1)))
    return HexMesh.of_body(name, positions.reshape(-1, 3)[used], cells, surface, np.flatnonzero(clamped))


def _cells(section, stations):
    """Cells (m, 8) by node number station * n + section node."""
    count = len(section.points)
    slabs, groups = np.arange(stations - 1), np.arange(0, stations - 1, 3)
    fine = _between(section.fine, slabs, slabs + 1, count)
    coarse = _between(section.coarse, groups, groups + 3, count)
    a, b, middle_a, middle_b, c, d = section.strip.T[:, None, :] + 0 * groups[None, :, None]
    start = groups[:, None] * count

    def at(nodes, k):
        return nodes + start + k * count

    sides = [
        ((a, 0), (a, 1), (middle_a, 1), (c, 0)),
        ((a, 1), (a, 2), (middle_a, 2), (middle_a, 1)),
        ((a, 2), (a, 3), (c, 3), (middle_a, 2)),
        ((middle_a, 1), (middle_a, 2), (c, 3), (c, 0)),
    ]
    opposite = {id(a): b, id(middle_a): middle_b, id(c): d}
    strip = [
        np.stack([at(n, k) for n, k in side] + [at(opposite[id(n)], k) for n, k in side], axis=-1).reshape(-1, 8)
        for side in sides
    ]
    return np.concatenate([fine, *strip, coarse])


def _between(quads, first, last, count):
    """One hexahedron for each quad between stations first[i] and last[i]."""
    near, far = first[:, None, None] * count + quads, last[:, None, None] * count + quads
    return np.concatenate([near, far], axis=-1).reshape(-1, 8)
