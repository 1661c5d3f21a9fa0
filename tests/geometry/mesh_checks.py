"""What any mesh of this project must be: valid, watertight, conforming, its named sets what they say."""

import numpy as np
from scipy.spatial import cKDTree

from geometry.meshing.cell_measures import cell_volume, scaled_jacobian
from geometry.meshing.hexmesh import boundary_faces

GAUSS = np.array([-1, 1]) / np.sqrt(3)
REFERENCE = np.array(
    [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]
)


def jacobians(corner: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Determinant (m,) of dx / d xi of trilinear cells (m, 8, 3) at one reference position (3,)."""
    factor = 1 + REFERENCE * at
    gradient = (
        REFERENCE
        * np.stack([factor[:, 1] * factor[:, 2], factor[:, 0] * factor[:, 2], factor[:, 0] * factor[:, 1]], axis=1)
        / 8
    )
    return np.linalg.det(np.einsum("mia,ib->mab", corner, gradient))


def gauss_volume(corner: np.ndarray) -> np.ndarray:
    """Volumes (m,) by 2 x 2 x 2 Gauss points: exact for trilinear cells, whose determinant is of second degree along
    each axis."""
    return sum(jacobians(corner, np.array([a, b, c])) for a in GAUSS for b in GAUSS for c in GAUSS)


def enclosed_volume(points: np.ndarray, faces: np.ndarray) -> float:
    """Volume inside bilinear faces (k, 4), outward by the right-hand rule, by the divergence theorem."""
    a, b, c, d = (points[faces[:, i]] - points.mean(axis=0) for i in range(4))
    return float(np.einsum("ij,ij->", np.cross(c - a, d - b), a + b + c + d) / 24)


def edge_balance(faces: np.ndarray) -> np.ndarray:
    """For each edge of faces (k, 4): how often it is walked one way less the other way, and how often at all, (e,
    2)."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    pairs, number = np.unique(np.sort(np.stack([start, end], axis=1), axis=1), axis=0, return_inverse=True)
    sense = np.where(start < end, 1, -1)
    return np.stack(
        [np.bincount(number.ravel(), sense, len(pairs)), np.bincount(number.ravel(), minlength=len(pairs))], axis=1
    )


def hanging_facets(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Which boundary faces (k,) lie against another one that looks the other way: faces inside the body that no two
    cells share.

    Against: centres less than 0.7 of the larger face's width apart, and less than a twentieth of it across the face.
    """
    p = points[faces]
    centre, area = p.mean(axis=1), 0.5 * np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
    size = np.linalg.norm(area, axis=1)
    normal, width = area / size[:, None], np.sqrt(size)
    _, near = cKDTree(centre).query(centre, min(24, len(faces)))
    apart = centre[near] - centre[:, None]
    reach = np.maximum(width[near], width[:, None])
    across = np.abs(np.einsum("kni,ki->kn", apart, normal))
    facing = np.einsum("kni,ki->kn", normal[near], normal) < -0.5
    return (facing & (across < 0.05 * reach) & (np.linalg.norm(apart, axis=2) < 0.7 * reach)).any(axis=1)


def _from_least(faces: np.ndarray) -> list:
    """Faces (k, 4) turned to begin with their least node, the sense kept."""
    first = faces.argmin(axis=1)[:, None]
    return np.take_along_axis(faces, (first + np.arange(4)) % 4, axis=1).tolist()


def check_mesh(mesh) -> None:
    """A mesh fit for dynamics: positive Jacobians at all corners, closed and oriented boundary, no hanging nodes,
    consistent sets."""
    corner = mesh.points[mesh.cells]
    assert scaled_jacobian(corner).min() > 0
    assert (gauss_volume(corner) > 0).all()
    faces, owner = boundary_faces(mesh.cells)
    balance = edge_balance(faces)
    # Each edge of the boundary joins an even number of faces, walked as often one way as the other.
    assert (balance[:, 0] == 0).all() and (balance[:, 1] % 2 == 0).all()
    assert not hanging_facets(mesh.points, faces).any() and not cKDTree(mesh.points).query_pairs(1e-7)
    volume = cell_volume(corner).sum()
    assert abs(enclosed_volume(mesh.points, faces) - volume) < 1e-12 * volume + 1e-18
    known = {tuple(face): cell for face, cell in zip(_from_least(faces), owner)}
    surface = [tuple(face) for face in _from_least(mesh.surface)]
    # outward as the boundary is, corner by corner
    assert all(face in known for face in surface) and len(set(surface)) == len(surface)
    assert (mesh.region[[known[face] for face in surface]] == mesh.surface_region).all()
    assert np.isin(np.unique(mesh.cells), np.arange(len(mesh.points))).all() and len(np.unique(mesh.cells)) == len(
        mesh.points
    )
    assert len(np.unique(mesh.clamp)) == len(mesh.clamp) and np.isin(mesh.clamp, faces).all()
    assert set(mesh.region) == set(range(len(mesh.region_names)))
