"""Quadrilaterals inside a polygon by Gmsh, on exactly the polygon's own boundary points. The only file that imports gmsh."""

from contextlib import contextmanager

import numpy as np

from geometry.mesh import MeshError

DELAUNAY = 5
FRONTAL_DELAUNAY = 6
FRONTAL_QUADS = 8
BLOSSOM = 1
ATTEMPTS = [(algorithm, factor) for factor in (1.0, 0.8, 1.25, 0.6) for algorithm in (FRONTAL_QUADS, FRONTAL_DELAUNAY, DELAUNAY)]


def fill_with_quads(polygon: np.ndarray, largest: float) -> tuple[np.ndarray, np.ndarray]:
    """Quadrilaterals that fill a simple polygon, sized by its edges and graded between them.

    polygon : (n, 2) corners anticlockwise, n even; they become the first n nodes and no other node lies on the boundary
    largest : largest size inside [same unit as polygon]
    Returns nodes (m, 2) and quads (k, 4) anticlockwise. The best of several attempts, since triangles may remain in one.
    Raises MeshError where the polygon crosses itself or triangles remain in all.
    """
    if len(polygon) % 2:
        raise MeshError(f"a polygon of {len(polygon)} edges cannot be filled with quadrilaterals only; give it an even number")
    _check_simple(polygon)
    found = []
    with gmsh_session() as gmsh:
        for algorithm, factor in ATTEMPTS:
            gmsh.model.add("section")
            try:
                found.append(_fill(gmsh, polygon, largest * factor, algorithm))
            except Exception:  # Gmsh raises plain Exception; another attempt follows
                pass
            finally:
                gmsh.model.remove()
    if not any(found):
        raise MeshError(f"Gmsh left triangles in a polygon of {len(polygon)} edges at each of {len(ATTEMPTS)} attempts; change the element sizes or the band a little")
    return min(filter(None, found), key=_badness)


def _badness(mesh):
    """Mean squared deviation of the quads' corner angles from a right angle, and a little for their number."""
    points, quads = mesh
    after, before = points[np.roll(quads, -1, axis=1)] - points[quads], points[np.roll(quads, 1, axis=1)] - points[quads]
    angle = np.arctan2(np.cross(after, before), np.einsum("kij,kij->ki", after, before))
    return ((angle - np.pi / 2) ** 4).sum()


def _check_simple(polygon):
    """Refuse a polygon that crosses itself: Gmsh would search for ever."""
    start, end = polygon, np.roll(polygon, -1, axis=0)

    def side(a, b, points):
        return np.sign(np.cross((b - a)[:, None], points[None] - a[:, None]))

    separate = side(start, end, start) * side(start, end, end) < 0
    crossing = np.argwhere(separate & separate.T)
    if len(crossing):
        where = ", ".join(f"({y * 1e3:.2f}, {z * 1e3:.2f})" for y, z in start[crossing[0]])
        raise MeshError(f"the region left for coarse quadrilaterals crosses itself near {where} mm; narrow or move the band, or take smaller elements")


@contextmanager
def gmsh_session():
    """A silent Gmsh; may be entered again and again, in any thread, and inside a caller's own session."""
    import gmsh

    own = not gmsh.isInitialized()
    if own:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("General.NumThreads", 1)
    previous = None if own else gmsh.model.getCurrent()
    try:
        yield gmsh
    finally:
        if own:
            gmsh.finalize()
        elif previous:
            gmsh.model.setCurrent(previous)


def _fill(gmsh, polygon, largest, algorithm):
    scale = 1.0 / np.ptp(polygon, axis=0).max()
    geo, count = gmsh.model.geo, len(polygon)
    corners = [geo.addPoint(y * scale, z * scale, 0.0) for y, z in polygon]
    lines = [geo.addLine(corners[i], corners[(i + 1) % count]) for i in range(count)]
    for line in lines:
        geo.mesh.setTransfiniteCurve(line, 2)
    surface = geo.addPlaneSurface([geo.addCurveLoop(lines)])
    geo.mesh.setRecombine(2, surface)
    geo.synchronize()
    for option, value in [("Algorithm", algorithm), ("RecombinationAlgorithm", BLOSSOM), ("MeshSizeMax", largest * scale), ("MeshSizeExtendFromBoundary", 1),
                          ("MeshSizeFromPoints", 0), ("RandomSeed", 1), ("RecombineMinimumQuality", 1e-4), ("Smoothing", 5)]:
        gmsh.option.setNumber("Mesh." + option, value)
    gmsh.model.mesh.generate(2)
    return _read_quads(gmsh, corners, scale)


def _read_quads(gmsh, corners, scale):
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    position = dict(zip(tags.tolist(), coordinates.reshape(-1, 3)[:, :2] / scale))
    order = [int(gmsh.model.mesh.getNodes(0, corner)[0][0]) for corner in corners]
    order += [tag for tag in position if tag not in set(order)]
    if len(order) != len(position) or len(gmsh.model.mesh.getElementsByType(2)[0]):
        return None
    number = {tag: i for i, tag in enumerate(order)}
    quads = np.array([number[tag] for tag in gmsh.model.mesh.getElementsByType(3)[1].tolist()]).reshape(-1, 4)
    points = np.array([position[tag] for tag in order])
    p = points[quads]
    clockwise = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]) < 0
    quads[clockwise] = quads[clockwise][:, ::-1]
    return points, quads
