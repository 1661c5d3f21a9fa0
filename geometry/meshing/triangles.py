"""Triangles inside a polygon by Gmsh, on exactly the polygon's own boundary points, fine near given positions."""

import numpy as np

from geometry.meshing.gmsh_fill import DELAUNAY, _check_simple, _read, gmsh_session, outlined, set_options
from geometry.meshing.gmsh_process import in_gmsh_process
from geometry.meshing.hexmesh import MeshError


def fill_with_triangles(
    polygon: np.ndarray, positions: np.ndarray, size: float, reach: float, coarse: float, growth: float
) -> tuple[np.ndarray, np.ndarray]:
    """Triangles that fill a simple polygon whose edges become element edges.

    polygon : (n, 2) corners anticlockwise; they become the first n nodes and no other node lies on the boundary
    positions : (k, 2) of them the elements are of `size` up to the distance `reach`, beyond it larger by `growth` per
        distance up to
    `coarse` [all in one unit]
    Returns nodes (m, 2) and triangles (t, 3), anticlockwise. Raises MeshError where Gmsh fails.
    """
    _check_simple(polygon)
    return in_gmsh_process(_fill, polygon, positions, size, reach, coarse, growth)


def _fill(polygon, positions, size, reach, coarse, growth):
    """The same in Gmsh's process."""
    scale = 1.0 / np.ptp(polygon, axis=0).max()
    with gmsh_session() as gmsh:
        gmsh.model.add("plane")
        try:
            corners = _define(
                gmsh, polygon * scale, positions * scale, (size * scale, reach * scale, coarse * scale, growth)
            )
            gmsh.model.mesh.generate(2)
            points, triangles, _ = _read(gmsh, corners)
        except Exception as error:  # Gmsh raises plain Exception
            raise MeshError(
                f"Gmsh found no triangles in a polygon of {len(polygon)} edges: {error}; change the element sizes"
            ) from error
        finally:
            gmsh.model.remove()
    if not len(triangles):
        raise MeshError(f"Gmsh found no triangles in a polygon of {len(polygon)} edges; change the element sizes")
    used = np.union1d(np.arange(len(polygon)), triangles)  # the positions are nodes of their own, of no triangle
    return points[used] / scale, np.searchsorted(used, triangles)


def _define(gmsh, polygon, positions, sizes):
    size, reach, coarse, growth = sizes
    geo, field = gmsh.model.geo, gmsh.model.mesh.field
    corners, _ = outlined(gmsh, polygon)
    near = [geo.addPoint(x, y, 0.0) for x, y in positions]
    geo.synchronize()
    distance, threshold = field.add("Distance"), field.add("Threshold")
    field.setNumbers(distance, "PointsList", near)
    limits = {
        "InField": distance,
        "SizeMin": size,
        "SizeMax": coarse,
        "DistMin": reach,
        "DistMax": reach + (coarse - size) / growth,
    }
    for name, value in limits.items():
        field.setNumber(threshold, name, value)
    field.setAsBackgroundMesh(threshold)
    set_options(
        gmsh,
        Algorithm=DELAUNAY,
        MeshSizeMin=0,
        MeshSizeMax=1e22,
        MeshSizeExtendFromBoundary=0,
        MeshSizeFromPoints=0,
        RandomSeed=1,
        Smoothing=5,
    )
    return corners
