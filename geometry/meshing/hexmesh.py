"""The hexahedral mesh that geometry hands to the explicit FE solver, and its topology."""

from dataclasses import dataclass

import numpy as np

# The six faces of a VTK hexahedron as corner numbers, each with its outward normal by the right-hand rule.
FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])


class MeshError(ValueError):
    """A mesh that cannot be made, or that came out unusable: what, where, how large, what to do."""


class FoldedCellError(MeshError):
    """A mesh whose worst cell is folded or flat."""


def cross_2d(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross product of plane vectors (..., 2): positive where b lies to the left of a."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


@dataclass(frozen=True)
class HexMesh:
    """A conforming mesh of 8-node hexahedra with the named sets that contact and supports need.

    points         : (n, 3) float  node positions [m]
    cells          : (m, 8) int    nodes of each hexahedron, VTK order, positive Jacobian
    region         : (m,)   int8   index of each cell's body in region_names
    region_names   : tuple of str  names of the bodies, e.g. ("wing", "nose"); bodies share no nodes
    surface        : (k, 4) int    quads of the running surface (contact candidates), outward by the right-hand rule
    surface_region : (k,)   int8   index of each surface quad's body in region_names
    clamp          : (c,)   int    nodes that move with the rigid support
    """

    points: np.ndarray
    cells: np.ndarray
    region: np.ndarray
    region_names: tuple[str, ...]
    surface: np.ndarray
    surface_region: np.ndarray
    clamp: np.ndarray

    @classmethod
    def of_body(
        cls, name: str, points: np.ndarray, cells: np.ndarray, surface: np.ndarray, clamp: np.ndarray
    ) -> "HexMesh":
        """Of one body."""
        none = np.zeros(len(cells), np.int8), np.zeros(len(surface), np.int8)
        return cls(points, cells, none[0], (name,), surface, none[1], clamp)


def boundary_faces(cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Faces that belong to one cell only.

    cells : (m, 8) int, VTK order
    Returns the faces (k, 4) with outward normals by the right-hand rule, and the cell of each (k,).
    Raises MeshError where more than two cells share a face (the mesh is not conforming).
    """
    rows = cells.astype(np.int32)[:, FACES].reshape(-1, 4)
    rows.sort(axis=1)
    order, starts, counts = _group_equal_rows(rows)
    if counts.max(initial=1) > 2:
        owner, face = divmod(order[starts[counts.argmax()]], 6)
        raise MeshError(
            f"face {cells[owner, FACES[face]].tolist()} of cell {owner} belongs to {counts.max()} cells; at most 2 may"
            " share one"
        )
    owner, face = divmod(np.sort(order[starts[counts == 1]]), 6)
    return cells[owner[:, None], FACES[face]], owner


def _group_equal_rows(rows):
    """Order that brings equal rows (n, k) together, the start of each group in that order, and each group's size."""
    order = np.lexsort(rows.T)
    ordered = rows[order]
    is_start = np.ones(len(rows), dtype=bool)
    is_start[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    starts = np.flatnonzero(is_start)
    return order, starts, np.diff(np.append(starts, len(rows)))


def find_rows(rows: np.ndarray, others: np.ndarray) -> np.ndarray:
    """For each of `rows` (n, c) the row of `others` (k, c) of the same numbers in whatever order, or -1 (n,)."""
    both = np.sort(np.concatenate([rows, others]), axis=1)
    _, number = np.unique(both, axis=0, return_inverse=True)
    number = number.ravel()  # NumPy 2.0 alone gives it a second axis
    position = np.full(number.max(initial=-1) + 1, -1)
    position[number[len(rows) :]] = np.arange(len(others))
    return position[number[: len(rows)]]


def orient(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Cells (m, 8) with those mirrored whose triple product at the centre is negative, so that all Jacobians are
    positive."""
    edges = centre_edges(points, cells)
    mirrored = np.linalg.det(edges) < 0
    turned = cells.copy()
    turned[mirrored] = cells[mirrored][:, [4, 5, 6, 7, 0, 1, 2, 3]]
    return turned


def centre_edges(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """The three mean edge vectors of each cell: (m, 3, 3), rows along the three reference axes [m]."""
    corner = points[cells]
    along = [([1, 2, 5, 6], [0, 3, 4, 7]), ([2, 3, 6, 7], [0, 1, 4, 5]), ([4, 5, 6, 7], [0, 1, 2, 3])]
    return np.stack([corner[:, end].mean(axis=1) - corner[:, start].mean(axis=1) for end, start in along], axis=1)


def merge_bodies(meshes: list[HexMesh], region_names: tuple[str, ...] | None = None) -> HexMesh:
    """One mesh of several bodies that share no nodes, in the order given; their names must differ.

    region_names : the names in the order wanted, also of bodies that are not there; None: those that are, in the order
        given
    """
    names = tuple(name for mesh in meshes for name in mesh.region_names)
    if len(set(names)) != len(names):
        raise MeshError(f"bodies named {names}: two have the same name; give each its own")
    region_names = names if region_names is None else region_names
    if not set(names) <= set(region_names):
        raise MeshError(f"bodies named {names} are not all among the region names {region_names}: add the missing ones")
    node_shift = np.cumsum([0] + [len(mesh.points) for mesh in meshes])
    number = [np.array([region_names.index(name) for name in mesh.region_names], np.int8) for mesh in meshes]
    shifted = list(zip(meshes, node_shift, number))
    return HexMesh(
        points=np.concatenate([mesh.points for mesh in meshes]),
        cells=np.concatenate([mesh.cells + node for mesh, node, _ in shifted]),
        region=np.concatenate([number[mesh.region] for mesh, _, number in shifted]),
        region_names=region_names,
        surface=np.concatenate([mesh.surface + node for mesh, node, _ in shifted]),
        surface_region=np.concatenate([number[mesh.surface_region] for mesh, _, number in shifted]),
        clamp=np.concatenate([mesh.clamp + node for mesh, node, _ in shifted]),
    )
