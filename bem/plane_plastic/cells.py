"""Internal cells that carry plastic strain: polygons with four corners, one side of which may follow the boundary.

Cells that lie at the boundary must have its vertices: where a cell's edge lies on the boundary, it is one of its
elements. The columns of `cells_below` begin at the mesh's own vertices.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from bem.checks import plane_points, refuse_unless_positive
from bem.plane.mesh import BoundaryMesh

MOST_CELLS = 2_000_000
_GAUSS = np.array([-1, 1]) / np.sqrt(3)
_ON_BOUNDARY = 1e-6  # of an edge's length


class CellError(ValueError):
    """Cells that do not fit the body, or overlap, or are none."""


@dataclass(frozen=True, eq=False)
class Cells:
    """m cells as closed polygons.

    vertices : (v, 2) [m] of all polygons, anticlockwise, cell k from offsets[k] to offsets[k + 1]
    offsets  : (m + 1,) ; corners : (m, 4) indices of the four corners in vertices
    """

    vertices: np.ndarray
    offsets: np.ndarray
    corners: np.ndarray

    def __post_init__(self) -> None:
        if self.count < 1:
            raise CellError("no cells: give at least one")
        if not (self.areas > 0).all():
            worst = int(np.argmin(self.areas))
            raise CellError(
                f"cell {worst} at {self.centers[worst]} m has the area {self.areas[worst]:.3g} m^2: its corners must go"
                " round anticlockwise; columns that cross one another want a smaller depth"
            )

    @property
    def count(self) -> int:
        """Number of cells."""
        return len(self.offsets) - 1

    @cached_property
    def following(self) -> np.ndarray:
        """(v,) index of the next vertex of the same polygon."""
        after = np.arange(1, len(self.vertices) + 1)
        after[self.offsets[1:] - 1] = self.offsets[:-1]
        return after

    @cached_property
    def owner(self) -> np.ndarray:
        """(v,) cell of each vertex, and of the edge that begins there."""
        return np.repeat(np.arange(self.count), np.diff(self.offsets))

    @cached_property
    def areas(self) -> np.ndarray:
        """(m,) [m^2]"""
        x, y = (self.vertices - self.vertices[self.offsets[self.owner]]).T
        cross = x * y[self.following] - x[self.following] * y
        return 0.5 * np.bincount(self.owner, cross, self.count)

    @cached_property
    def centers(self) -> np.ndarray:
        """(m, 2) [m] middle of the four corners."""
        return self.vertices[self.corners].mean(axis=1)

    @cached_property
    def sizes(self) -> np.ndarray:
        """(m,) [m] longest distance of a corner from the middle."""
        return np.hypot(*(self.vertices[self.corners] - self.centers[:, None]).transpose(2, 0, 1)).max(axis=1)

    @cached_property
    def complex_vertices(self) -> np.ndarray:
        """(v,) vertices as x + i y [m]."""
        return self.vertices[:, 0] + 1j * self.vertices[:, 1]

    def points(self, chosen: np.ndarray | None = None) -> np.ndarray:
        """(4 m, 2) [m] Gauss points of cells, cell by cell, of equal weight."""
        corners = self.vertices[self.corners if chosen is None else self.corners[chosen]]
        x, y = np.meshgrid(_GAUSS, _GAUSS)
        x, y = x.ravel(), y.ravel()
        shape = np.array([(1 - x) * (1 - y), (1 + x) * (1 - y), (1 + x) * (1 + y), (1 - x) * (1 + y)]) / 4
        return np.einsum("kp,mkd->mpd", shape, corners).reshape(-1, 2)

    @cached_property
    def neighbours(self) -> tuple[np.ndarray, np.ndarray]:
        """Offsets (m + 1,) and cells that share a corner with each cell, as a sparse list."""
        shared = cKDTree(self.vertices[self.corners].reshape(-1, 2))
        pairs = shared.query_pairs(1e-6 * float(self.sizes.min()), output_type="ndarray")
        one, two = pairs[:, 0] // 4, pairs[:, 1] // 4
        start, end = np.r_[one, two], np.r_[two, one]
        order = np.argsort(start, kind="stable")
        return np.r_[0, np.cumsum(np.bincount(start, minlength=self.count))], end[order]

    def around(self, chosen: np.ndarray) -> np.ndarray:
        """(m,) bool: cells of `chosen` (m,) bool and their neighbours."""
        offsets, cells = self.neighbours
        near = chosen.copy()
        near[cells[np.repeat(chosen, np.diff(offsets))]] = True
        return near

    @cached_property
    def edge_keys(self) -> np.ndarray:
        """(v,) number of each edge, the same for two cells that share it."""
        size = 1e-6 * float(self.sizes.min())
        middle = (self.vertices + self.vertices[self.following]) / 2
        pairs = cKDTree(middle).query_pairs(size, output_type="ndarray")
        key = np.arange(len(middle))
        key[pairs.max(axis=1)] = pairs.min(axis=1)
        return key


def from_corner_grid(grid: np.ndarray, top: list[np.ndarray] | None = None) -> Cells:
    """Cells between corner points (rows + 1, columns + 1, 2) [m], rows from the first side inward.

    top : of each column the points (k, 2) [m] strictly between its corners along the first row, in the columns' order
    """
    rows, columns = grid.shape[0] - 1, grid.shape[1] - 1
    if rows < 1 or columns < 1:
        raise CellError(f"{rows} rows and {columns} columns of cells: give at least one of each")
    if rows * columns > MOST_CELLS:
        raise CellError(f"{rows} x {columns} cells, more than {MOST_CELLS}: choose larger cells or a smaller region")
    quad = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], axis=2).reshape(-1, 4, 2)
    spread = quad - quad.mean(axis=1, keepdims=True)
    turn = np.sum(spread[:, 0, 0] * spread[:, 1, 1] - spread[:, 0, 1] * spread[:, 1, 0])
    polygons, order = list(quad), [np.arange(4)] * len(quad)
    for column, between in enumerate(top or []):
        if len(between):
            polygons[column] = np.vstack([quad[column][:1], between, quad[column][1:]])
            order[column] = np.r_[0, len(between) + 1 + np.arange(3)]
    if turn < 0:
        polygons = [polygon[::-1] for polygon in polygons]
        order = [len(polygon) - 1 - k[::-1] for polygon, k in zip(polygons, order)]
    offsets = np.r_[0, np.cumsum([len(polygon) for polygon in polygons])]
    return Cells(np.vstack(polygons), offsets, np.array(order) + offsets[:-1, None])


def _face_run(mesh: BoundaryMesh, face: str, middle: np.ndarray, half_width: float) -> np.ndarray:
    """Vertices (k, 2) of a face's elements, in order, about its point nearest to `middle`."""
    elements = np.flatnonzero(mesh.names == face)
    if not len(elements):
        mesh.of_edge(face)
    broken = mesh.following[elements[:-1]] != elements[1:]
    pieces = np.split(elements, np.flatnonzero(broken) + 1)
    best, run = np.inf, np.zeros((0, 2))
    for piece in pieces:
        points = np.vstack([mesh.vertices[piece], mesh.vertices[mesh.following[piece[-1:]]]])
        away = np.hypot(*(points - middle).T)
        if away.min() < best:
            best, along = away.min(), np.r_[0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T))]
            run = points[np.abs(along - along[np.argmin(away)]) <= half_width * (1 + 1e-9)]
    return run


def cells_below(
    mesh: BoundaryMesh, face: str, middle: np.ndarray, half_width: float, depth: float, size: float
) -> Cells:
    """Cells in columns below a face, their first row at the mesh's own vertices.

    middle : (2,) [m] a point near the face; half_width : of the region along the face [m]; depth, size : of the cells
    and their largest width and height [m]; a column is as wide as whole elements allow, at least one
    Errors: CellError.
    """
    refuse_unless_positive(CellError, half_width=half_width, depth=depth, size=size)
    middle = plane_points([middle], CellError)[0]
    points = _face_run(mesh, face, middle, half_width)
    if len(points) < 2:
        raise CellError(f"fewer than two vertices of the face {face!r} within {half_width:g} m of {middle}: widen it")
    if (points[0] == points[-1]).all():
        raise CellError(f"half_width = {half_width:g} m reaches all around the face {face!r}: give a part of it")
    along = np.r_[0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T))]
    ends = [0]
    while ends[-1] < len(points) - 1:
        reach = int(np.searchsorted(along, along[ends[-1]] + size * (1 + 1e-6), side="right")) - 1
        ends.append(min(max(reach, ends[-1] + 1), len(points) - 1))
    direction = (points[-1] - points[0]) / np.hypot(*(points[-1] - points[0]))
    inward = np.array([-direction[1], direction[0]])
    rows = max(int(np.ceil(depth / size - 1e-9)), 1)
    if rows * (len(ends) - 1) > MOST_CELLS:
        raise CellError(f"{rows} x {len(ends) - 1} cells, more than {MOST_CELLS}: choose larger cells")
    steps = np.linspace(0, depth, rows + 1)
    grid = points[ends][None] + steps[:, None, None] * inward
    top = [points[a + 1 : b] for a, b in zip(ends[:-1], ends[1:])]
    cells = from_corner_grid(grid, top)
    check_inside(cells, mesh)
    return cells


def boundary_edges(cells: Cells, mesh: BoundaryMesh) -> np.ndarray:
    """(v,) element of the mesh that each edge of the cells is, or -1."""
    away, vertex = cKDTree(mesh.vertices).query(cells.vertices)
    length = np.hypot(*(cells.vertices[cells.following] - cells.vertices).T)
    on = (away < _ON_BOUNDARY * length) & (away[cells.following] < _ON_BOUNDARY * length)
    on &= mesh.following[vertex] == vertex[cells.following]
    return np.where(on, vertex, -1)


def check_inside(cells: Cells, mesh: BoundaryMesh) -> None:
    """Refuse cells that leave the body, or whose edge lies on its boundary without being one of its elements."""
    middle = (cells.vertices + cells.vertices[cells.following]) / 2
    length = np.hypot(*(cells.vertices[cells.following] - cells.vertices).T)
    on = boundary_edges(cells, mesh) >= 0
    _, _, distance = mesh.locate(middle)
    wrong = np.flatnonzero(~on & (distance < _ON_BOUNDARY * length))
    if len(wrong):
        k = wrong[int(np.argmin(distance[wrong]))]
        raise CellError(
            f"an edge of cell {cells.owner[k]} at ({middle[k, 0]:.6g}, {middle[k, 1]:.6g}) m lies on the boundary or"
            f" {-distance[k]:.3g} m outside: there a cell's edges must be the mesh's own elements; narrow the cells'"
            " region, or move it"
        )
