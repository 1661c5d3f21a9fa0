"""Simple structured hexahedral meshes with exact shapes, for verification: box, half cylinder, ellipsoid cap."""

from collections.abc import Callable

import numpy as np

from geometry.meshing.axis import graded_line
from geometry.meshing.hexmesh import HexMesh, MeshError, boundary_faces


def mesh_grid(x: np.ndarray, y: np.ndarray, z: np.ndarray, name: str = "box") -> HexMesh:
    """Hexahedra between the planes x, y, z (increasing positions [m]); surface is the top face, clamp the bottom
    nodes."""
    shape = len(x), len(y), len(z)
    points = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(shape)
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    cells = np.stack(
        [number[i : shape[0] - 1 + i, j : shape[1] - 1 + j, k : shape[2] - 1 + k].ravel() for i, j, k in corners],
        axis=1,
    )
    faces, _ = boundary_faces(cells)
    surface = faces[(faces % shape[2] == shape[2] - 1).all(axis=1)]
    return HexMesh.of_body(name, points, cells, surface, number[:, :, 0].ravel())


def mesh_box(lengths: tuple[float, float, float], counts: tuple[int, int, int], name: str = "box") -> HexMesh:
    """A box from the origin to `lengths` [m] in counts[i] equal cells along axis i.

    surface is the top (z = lengths[2]), clamp the nodes of the bottom (z = 0). Volume exact.
    """
    x, y, z = (length * (np.arange(count + 1) / count) for length, count in zip(lengths, counts))
    return mesh_grid(x, y, z, name)


def mesh_cap(
    radius_x: float,
    radius_y: float,
    half_lengths: tuple[float, float],
    height: float,
    size: float,
    fine: tuple[float, float, float],
    facing: str = "down",
    name: str = "cap",
) -> HexMesh:
    """A block whose contact face is curved with radii radius_x (in the xz plane) and radius_y; np.inf makes it flat.
    Its surface is z = c - sqrt of the exact quadric through them: a sphere for equal radii, a circular cylinder where
    one is infinite.

    half_lengths : the block reaches to +- these in x and y [m];  height : its extent in z at the apex [m]
    size         : element size near the apex [m]
    fine         : half widths in x and y and depth of the fine zone [m]; outside it cells grow
    facing       : "down": apex at the origin, body above it, clamp on top; "up": mirrored, body below, clamp at the
        bottom

    Surface nodes lie on the exact surface; the opposite face is plane; columns are vertical. Raises MeshError where the
    block is wider than the surface or the surface higher than the block.
    """
    x = graded_line(-half_lengths[0], half_lengths[0], (-fine[0], fine[0]), size)
    y = graded_line(-half_lengths[1], half_lengths[1], (-fine[1], fine[1]), size)
    z = graded_line(0.0, height, (0.0, fine[2]), size)
    away = 1.0 if facing == "down" else -1.0
    face = lambda x, y: away * cap_height(x, y, radius_x, radius_y)
    return mesh_block(face, x, y, z, facing, name)


def mesh_block(
    face: Callable[[np.ndarray, np.ndarray], np.ndarray],
    x: np.ndarray,
    y: np.ndarray,
    z: np.ndarray,
    facing: str,
    name: str,
) -> HexMesh:
    """Hexahedra between a face of heights face(x, y) [m] and a plane z[-1] behind it; z counts from the face, facing
    "up" or "down".

    Nodes are numbered with z fastest, then y, then x; the face's are every len(z)-th. `clamp` are those of the plane
    behind.
    """
    flat = mesh_grid(x, y, z, name)
    points, cells = flat.points.copy(), flat.cells
    rise = face(points[:, 0], points[:, 1])
    if not np.isfinite(rise).all():
        at = points[np.argmin(np.isfinite(rise))]
        raise MeshError(
            f"the face that looks {facing} has no height at x = {at[0]:g}, y = {at[1]:g} m: let the block end before"
        )
    if np.abs(rise).max() > 0.8 * z[-1]:
        raise MeshError(
            f"the face that looks {facing} rises {np.abs(rise).max():.3g} m in a block, over 0.8 of its height"
            f" {z[-1]:g} m: narrow or raise the block"
        )
    faces, _ = boundary_faces(cells)
    surface = faces[np.isin(faces, flat.clamp).all(axis=1)]
    away = 1.0 if facing == "down" else -1.0
    points[:, 2] = away * points[:, 2] + rise * (1 - points[:, 2] / z[-1])
    if facing == "up":
        cells, surface = cells[:, [4, 5, 6, 7, 0, 1, 2, 3]], surface[:, ::-1].copy()
    return HexMesh.of_body(name, points, cells, surface, flat.clamp + len(z) - 1)


def cap_height(x: np.ndarray, y: np.ndarray, radius_x: float, radius_y: float) -> np.ndarray:
    """Height [m] of the curved face of mesh_cap above its apex at (x, y) [m].

    The ellipsoid has the vertical semi-axis c = max of the finite radii and horizontal semi-axes sqrt(c radius):
    its curvatures at the apex are 1 / radius_x and 1 / radius_y.
    """
    quadric = x**2 / radius_x + y**2 / radius_y
    semi_axis = max((radius for radius in (radius_x, radius_y) if np.isfinite(radius)), default=np.inf)
    if quadric.max() >= semi_axis:
        raise MeshError(
            f"the block's corner lies outside the ellipsoid of radii {radius_x}, {radius_y} m; narrow the block"
        )
    return quadric / (1 + np.sqrt(1 - quadric / semi_axis))
