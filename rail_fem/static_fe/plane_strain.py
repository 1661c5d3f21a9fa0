"""Static plane-strain elasticity of one body by dolfinx: 6-node triangles that follow the body's smooth outline.

The reference solution for the boundary elements: another discretisation, another library, another solver. It shares
with them only the outline's curve. A held edge moves with the holder; the rest is free or under contact pressure.
Error: second order in stress, third in displacement where the solution is smooth (tests/versus/test_plane_strain.py).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import ufl
from mpi4py import MPI
from scipy import sparse
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from bem.plane.body import Body
from bem.plane.curve import divide
from bem.plane.mesh import Sizing, Zone
from geometry.meshing.triangles import fill_with_triangles
from rail_fem.fe.compat import evaluate, fem, lagrange_vectors, quadratic_triangle_mesh
from rail_fem.static_fe.solid_stiffness import assembled, elastic_stress

# Gauss points of a triangle, where stresses of quadratic displacements are best
INNER = np.array([[1, 1], [4, 1], [1, 4]]) / 6


class PlaneStrainError(ValueError):
    """A plane problem that cannot be set up: what, where, what to do."""


@dataclass(frozen=True)
class Fineness:
    """size [m] of the elements up to `reach` [m] from the positions (k, 2) [m]; beyond it they grow by `growth` per
    distance up to `coarse` [m]."""

    positions: np.ndarray
    size: float
    reach: float
    coarse: float
    growth: float = 0.15

    def along_boundary(self) -> Sizing:
        """The same as sizes of elements along the boundary."""
        return Sizing(self.coarse, [Zone(self.positions, self.size, self.reach)], self.growth)


def boundary_nodes(body: Body, fineness: Fineness) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners (n, 2) and middles (n, 2) [m] of the boundary's edges in order, and the name (n,) of each edge."""
    if len(body.outline.curves) != 1 or body.outline.infinite or body.held is None:
        raise PlaneStrainError(
            "the plane-strain solver takes one closed loop with a held edge: no holes, hubs or infinite bodies"
        )
    sizing, corners, middles, names = fineness.along_boundary(), [], [], []
    for curve, name in body.outline.curves[0]:
        s = divide(curve, sizing)
        corners.append(curve.at(s[:-1]))
        middles.append(curve.at((s[:-1] + s[1:]) / 2))
        names += [name] * (len(s) - 1)
    return np.vstack(corners), np.vstack(middles), np.array(names)


def quadratic_triangles(corners: np.ndarray, middles: np.ndarray, fineness: Fineness) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (m, 2) and 6-node triangles (t, 6) in dolfinx order. The first 2n nodes are the boundary's corners and
    middles."""
    points, triangles = fill_with_triangles(
        corners, fineness.positions, fineness.size, fineness.reach, fineness.coarse, fineness.growth
    )
    n = len(corners)
    edges = np.sort(triangles[:, [[1, 2], [0, 2], [0, 1]]], axis=2)  # dolfinx: edge i lies opposite vertex i
    unique, number = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
    number = number.reshape(-1, 3)
    centre = points[unique].mean(axis=1)
    ring = np.sort(np.column_stack([np.arange(n), (np.arange(n) + 1) % n]), axis=1)
    key = {tuple(edge): i for i, edge in enumerate(unique.tolist())}
    on_boundary = np.array([key[tuple(edge)] for edge in ring.tolist()])
    centre[on_boundary] = middles
    # nodes in the order: corners, boundary middles, inner vertices, inner middles
    inner = np.setdiff1d(np.arange(len(unique)), on_boundary)
    position = np.empty(len(unique), np.int64)
    position[on_boundary] = n + np.arange(n)
    position[inner] = n + len(points) + np.arange(len(inner))
    vertex = np.r_[np.arange(n), n + np.arange(n, len(points))]
    nodes = np.vstack([points[:n], middles, points[n:], centre[inner]])
    return nodes, np.column_stack([vertex[triangles], position[number]])


class PlaneBody:
    """A meshed and factorised body; nodes (m, 2) [m], displacements (m, 2) [m] are in the order of
    `quadratic_triangles`.

    edges : (e, 3) nodes of the face's edges in order (first, middle, last), the body on their left
    """

    def __init__(self, body: Body, fineness: Fineness):
        corners, middles, names = boundary_nodes(body, fineness)
        self.body, n = body, len(corners)
        self.nodes, self.triangles = quadratic_triangles(corners, middles, fineness)
        ring = np.column_stack([np.arange(n), n + np.arange(n), (np.arange(n) + 1) % n])
        self.edges = ring[names == body.face]
        self.held = np.unique(ring[names == body.held])
        self.mesh = quadratic_triangle_mesh(
            MPI.COMM_SELF, self.triangles.astype(np.int64), np.ascontiguousarray(self.nodes)
        )
        self.space = lagrange_vectors(self.mesh, 2)
        away, self.dof_of = cKDTree(self.space.tabulate_dof_coordinates()[:, :2]).query(self.nodes)
        if away.max() > 1e-9 * fineness.size:
            raise PlaneStrainError(
                f"node {int(away.argmax())} has no position in the function space ({away.max():.3g} m off)"
            )
        self._factorise()

    def _stress(self, u):
        return elastic_stress(u, self.body.material, self.mesh)

    def stiffness(self) -> sparse.csc_matrix:
        """Stiffness (2m, 2m) [Pa], the held edge not yet held."""
        u, v = ufl.TrialFunction(self.space), ufl.TestFunction(self.space)
        return assembled(ufl.inner(self._stress(u), ufl.grad(v)) * ufl.dx, self.dof_of).tocsc()

    def mass(self, density: float) -> sparse.csc_matrix:
        """Consistent mass (2m, 2m) [kg/m] of a density [kg/m^3]."""
        u, v = ufl.TrialFunction(self.space), ufl.TestFunction(self.space)
        return assembled(density * ufl.inner(u, v) * ufl.dx, self.dof_of).tocsc()

    def _factorise(self) -> None:
        stiffness = self.stiffness()
        self.free = np.setdiff1d(np.arange(stiffness.shape[0]), (2 * self.held[:, None] + [0, 1]).ravel())
        self._factor = splu(
            stiffness[self.free][:, self.free], permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}
        )

    def displacement(self, force: np.ndarray) -> np.ndarray:
        """Displacement (2m, k) [m] under nodal forces (2m, k) [N/m], x and y in turn, the held edge at rest."""
        out = np.zeros(force.shape)
        out[self.free] = self._factor.solve(np.ascontiguousarray(force[self.free]))
        return out

    @cached_property
    def stress(self) -> TensorAtPoints:
        """Points (p, 2) [m] and stress (p, 3) xx, yy, xy [Pa] there, of displacements (2m,) [m]."""
        return TensorAtPoints(self, self._stress)


class TensorAtPoints:
    """A tensor of a displacement at three points in each triangle, cell by cell; tensor : displacement -> form"""

    def __init__(self, body: PlaneBody, tensor: Callable) -> None:
        self.mesh, self.order = body.mesh, (2 * body.dof_of[:, None] + [0, 1]).ravel()
        self.cells, self.field = np.arange(len(body.triangles), dtype=np.int32), fem.Function(body.space)
        found, x = tensor(self.field), ufl.SpatialCoordinate(body.mesh)
        self.expression = fem.Expression(ufl.as_vector((x[0], x[1], found[0, 0], found[1, 1], found[0, 1])), INNER)

    def __call__(self, displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points (p, 2) [m] and components (p, 3) xx, yy, xy there, of displacements (2m,) [m]."""
        self.field.x.array[self.order] = displacement
        table = evaluate(self.expression, self.mesh, self.cells).reshape(-1, 5)
        return table[:, :2], table[:, 2:]
