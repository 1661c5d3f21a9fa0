"""Quadrilaterals inside a polygon by Gmsh, on exactly the polygon's own boundary points.

The only file that imports gmsh, in the child of gmsh_process alone; mesh_triangles borrows its session.
"""

from contextlib import contextmanager

import numpy as np

from geometry.meshing.gmsh_process import in_gmsh_process
from geometry.meshing.hexmesh import MeshError, cross_2d

DELAUNAY = 5
FRONTAL_DELAUNAY = 6
FRONTAL_QUADS = 8
BLOSSOM = 1
ATTEMPTS = [
    (algorithm, factor) for factor in (1.0, 0.8, 1.25) for algorithm in (FRONTAL_QUADS, FRONTAL_DELAUNAY, DELAUNAY)
]


def fill_with_quads(polygon: np.ndarray, largest: float, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Quadrilaterals that fill a simple polygon, sized by its edges and graded between them.

    polygon : (n, 2) corners anticlockwise, n even; they become the first n nodes and no other node lies on the boundary
    largest : largest size inside [same unit as polygon];  angles : (s, n) inner angles [rad] at the corners, where the
        polygon takes s shapes that the mesh must follow
    Returns nodes (m, 2) and quads (k, 4) anticlockwise. Gmsh may leave triangles; so every second corner is tried too,
    with each triangle and quad then cut in three or four quads. The best of all attempts by `badness` is taken.
    Raises MeshError where the polygon crosses itself or nothing succeeds.
    """
    _check_simple(polygon)
    found = [mesh for mesh in in_gmsh_process(_attempts, polygon, largest) if len(mesh[1])]
    if not found:
        raise MeshError(
            f"Gmsh found no quadrilaterals in a polygon of {len(polygon)} edges near {polygon.mean(axis=0) * 1e3} mm;"
            " change the element sizes or the band a little"
        )
    return min(found, key=lambda mesh: badness(mesh[0], mesh[1], angles))


def _attempts(polygon, largest):
    """Nodes and quads of every attempt that left no triangle; in Gmsh's process."""
    found = []
    with gmsh_session() as gmsh:
        for algorithm, factor in ATTEMPTS:
            points, triangles, quads = _fill(gmsh, polygon, largest * factor, algorithm)
            if len(quads) and not len(triangles):
                found.append((points, quads))
        for first in (0, 1):
            halved = np.roll(polygon, -first, axis=0)[::2]
            if len(halved) >= 4 and not _crossings(halved).size:
                found += [
                    _subdivided(polygon, first, *_fill(gmsh, halved, 2 * largest, algorithm))
                    for algorithm in (FRONTAL_QUADS, FRONTAL_DELAUNAY, DELAUNAY)
                ]
    return found


def _subdivided(polygon, first, points, triangles, quads):
    """Quads from a mesh of the polygon through every second corner (from number `first`): each cell cut through its
    edges' midpoints."""
    half, count = len(polygon) // 2, len(polygon)
    cells = [list(cell) for cell in triangles] + [list(cell) for cell in quads]
    number = np.concatenate([(first + 2 * np.arange(half)) % count, count + np.arange(len(points) - half)]).astype(int)
    new, midpoint, result = [*polygon, *points[half:]], {}, []
    for i in range(half):
        midpoint[tuple(sorted((i, (i + 1) % half)))] = (first + 2 * i + 1) % count
    for cell in cells:
        centre = len(new)
        new.append(points[cell].mean(axis=0))
        for before, corner, after in zip(cell[-1:] + cell[:-1], cell, cell[1:] + cell[:1]):
            ahead, behind = tuple(sorted((corner, after))), tuple(sorted((before, corner)))
            for edge in (ahead, behind):
                if edge not in midpoint:
                    midpoint[edge] = len(new)
                    new.append((points[edge[0]] + points[edge[1]]) / 2)
            result.append([number[corner], midpoint[ahead], centre, midpoint[behind]])
    return np.array(new), np.array(result, dtype=int).reshape(-1, 4)


def badness(points: np.ndarray, quads: np.ndarray, angles: np.ndarray) -> float:
    """How far a quad mesh is from a regular one by its connections alone, which no smoothing can repair.

    Each node's angle (2 pi inside, angles (s, n) [rad] in s shapes of the boundary on its n first nodes) shared among
    its quads should be a right angle; the sixth powers of the worst deviations are summed: a flat corner (15) outweighs
    many others.
    """
    count = np.maximum(np.bincount(quads.ravel(), minlength=len(points)), 1)
    boundary = angles.shape[1]
    deviation = np.abs(2 * np.pi / count - np.pi / 2)
    deviation[:boundary] = np.abs(angles / count[:boundary] - np.pi / 2).max(axis=0)
    return float((deviation**6).sum())


def inner_angles(polygon: np.ndarray) -> np.ndarray:
    """Inner angle (n,) [rad] at each corner of an anticlockwise polygon (n, 2)."""
    after, before = np.roll(polygon, -1, axis=0) - polygon, np.roll(polygon, 1, axis=0) - polygon
    return np.mod(np.arctan2(cross_2d(after, before), np.einsum("ij,ij->i", after, before)), 2 * np.pi)


def _check_simple(polygon):
    """Refuse a polygon that crosses itself: Gmsh would search for ever."""
    crossing = _crossings(polygon)
    if len(crossing):
        where = ", ".join(f"({y * 1e3:.2f}, {z * 1e3:.2f})" for y, z in polygon[crossing[0]])
        raise MeshError(
            f"the region left for coarse quadrilaterals crosses itself near {where} mm; narrow or move the band, or"
            " take smaller elements"
        )


def _crossings(polygon):
    """Pairs (k, 2) of edges of a polygon that cross."""
    start, end = polygon, np.roll(polygon, -1, axis=0)

    def side(points):
        return np.sign(cross_2d((end - start)[:, None], points[None] - start[:, None]))

    separate = side(start) * side(end) < 0
    return np.argwhere(separate & separate.T)


@contextmanager
def gmsh_session():
    """A silent Gmsh; in its own process only."""
    import gmsh

    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("General.NumThreads", 1)
    try:
        yield gmsh
    finally:
        gmsh.finalize()


def _fill(gmsh, polygon, largest, algorithm):
    """Nodes (m, 2), triangles (t, 3) and quads (k, 4), anticlockwise, in a polygon (n, 2) whose corners are the first
    nodes; empty where Gmsh fails."""
    scale = 1.0 / np.ptp(polygon, axis=0).max()
    gmsh.model.add("section")
    try:
        corners = _define(gmsh, polygon * scale, largest * scale, algorithm)
        gmsh.model.mesh.generate(2)
        points, triangles, quads = _read(gmsh, corners)
    except Exception:  # Gmsh raises plain Exception; another attempt follows
        return polygon, np.zeros((0, 3), int), np.zeros((0, 4), int)
    finally:
        gmsh.model.remove()
    return points / scale, triangles, quads


def _define(gmsh, polygon, largest, algorithm):
    corners, surface = outlined(gmsh, polygon)
    gmsh.model.geo.mesh.setRecombine(2, surface)
    gmsh.model.geo.synchronize()
    set_options(
        gmsh,
        Algorithm=algorithm,
        RecombinationAlgorithm=BLOSSOM,
        MeshSizeMax=largest,
        MeshSizeExtendFromBoundary=1,
        MeshSizeFromPoints=0,
        RandomSeed=1,
        RecombineMinimumQuality=1e-4,
        Smoothing=5,
    )
    return corners


def outlined(gmsh, polygon):
    """Corners of a polygon (n, 2) whose edges become edges of elements, and its surface."""
    geo, count = gmsh.model.geo, len(polygon)
    corners = [geo.addPoint(y, z, 0.0) for y, z in polygon]
    lines = [geo.addLine(corners[i], corners[(i + 1) % count]) for i in range(count)]
    for line in lines:
        geo.mesh.setTransfiniteCurve(line, 2)
    return corners, geo.addPlaneSurface([geo.addCurveLoop(lines)])


def set_options(gmsh, **options: float) -> None:
    """Options of Gmsh's meshing by name."""
    for name, value in options.items():
        gmsh.option.setNumber(f"Mesh.{name}", value)


def _read(gmsh, corners):
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    position = dict(zip(tags.tolist(), coordinates.reshape(-1, 3)[:, :2]))
    order = [int(gmsh.model.mesh.getNodes(0, corner)[0][0]) for corner in corners]
    known = set(order)
    order += [tag for tag in position if tag not in known]
    number = {tag: i for i, tag in enumerate(order)}
    points = np.array([position[tag] for tag in order])
    return points, *(_cells(gmsh, kind, nodes, number, points) for kind, nodes in ((2, 3), (3, 4)))


def _cells(gmsh, kind, nodes, number, points):
    """Cells of one Gmsh element type with `nodes` nodes, turned anticlockwise."""
    cells = np.array([number[tag] for tag in gmsh.model.mesh.getElementsByType(kind)[1].tolist()], dtype=int).reshape(
        -1, nodes
    )
    p = points[cells]
    clockwise = cross_2d(p[:, 1] - p[:, 0], p[:, -1] - p[:, 0]) < 0
    cells[clockwise] = cells[clockwise][:, ::-1]
    return cells
