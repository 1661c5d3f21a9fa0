"""Whether a body's hexahedra fit together: no node on a neighbour's edge or face, no two nodes at one position."""

import numpy as np
from scipy.spatial import cKDTree

from geometry.meshing.hexmesh import MeshError

NEAR = 1e-3  # of an edge's length, within which a node lies on it, or on another node


def check_conforming(what: str, points: np.ndarray, outer: np.ndarray) -> None:
    """Raise MeshError where cells meet without sharing nodes: how many, where, and the remedy. Faces that do not fit
    belong to one cell each, so outer faces and their nodes are all that is looked at.

    points : (n, 3) [m];  outer : (k, 4) faces of one body that belong to one cell only
    """
    nodes = np.unique(outer)
    edges = np.unique(np.sort(np.stack([outer, np.roll(outer, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1), axis=0)
    shortest = np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1).min()
    tree = cKDTree(points[nodes])
    pairs = tree.query_pairs(NEAR * shortest, output_type="ndarray")
    if len(pairs):
        raise MeshError(
            f"{what} has {len(pairs)} pair(s) of nodes at one position, one at {position(points[nodes[pairs[0, 0]]])}:"
            " cells that meet there are not joined; merge the nodes"
        )
    hung = np.unique(np.concatenate([_on_edges(points, edges, nodes, tree), _in_faces(points, outer, nodes, tree)]))
    if len(hung):
        raise MeshError(
            f"{what} has {len(hung)} hanging node(s), one at {position(points[hung[0]])}: it lies on a neighbour's"
            " edge or face without being its corner; make the mesh conforming"
        )


def _on_edges(points: np.ndarray, edges: np.ndarray, nodes: np.ndarray, tree: cKDTree) -> np.ndarray:
    a, b = points[edges[:, 0]], points[edges[:, 1]]
    length = np.linalg.norm(b - a, axis=1)
    of, node = _candidates(tree, (a + b) / 2, length / 2, nodes)
    along = np.einsum("ij,ij->i", points[node] - a[of], (b - a)[of]) / length[of] ** 2
    away = np.linalg.norm(points[node] - a[of] - along[:, None] * (b - a)[of], axis=1)
    return node[(away < NEAR * length[of]) & (NEAR < along) & (along < 1 - NEAR)]


def _in_faces(points: np.ndarray, faces: np.ndarray, nodes: np.ndarray, tree: cKDTree) -> np.ndarray:
    """Nodes in the middle nine tenths of other faces; nearer to their rims they are on edges or on other nodes."""
    corner = points[faces]
    centre = corner.mean(axis=1)
    first = (corner[:, [1, 2]] - corner[:, [0, 3]]).mean(axis=1)
    second = (corner[:, [2, 3]] - corner[:, [1, 0]]).mean(axis=1)
    normal = np.cross(first, second)
    radius = np.linalg.norm(corner - centre[:, None], axis=2).max(axis=1)
    of, node = _candidates(tree, centre, radius, nodes)
    inverse = np.linalg.inv(np.stack([first, second, normal / np.linalg.norm(normal, axis=1)[:, None]], axis=-1))
    local = np.einsum("mij,mj->mi", inverse[of], points[node] - centre[of])
    inside = (np.abs(local[:, :2]) < 0.45).all(axis=1) & (np.abs(local[:, 2]) < NEAR * radius[of])
    own = (faces[of] == node[:, None]).any(axis=1)
    return node[inside & ~own]


def _candidates(
    tree: cKDTree, centre: np.ndarray, radius: np.ndarray, nodes: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Number of each ball and node in it, for all nodes in all balls."""
    found = tree.query_ball_point(centre, radius)
    return np.repeat(np.arange(len(centre)), [len(of) for of in found]), nodes[np.concatenate(found).astype(np.int64)]


def position(point: np.ndarray) -> str:
    """A point [m] in words."""
    return "(" + ", ".join(f"{value * 1e3:.1f}" for value in point) + ") mm"
