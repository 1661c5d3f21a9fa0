"""A plane body of static finite elements: 6-node triangles that follow the body's smooth outline.

The reference solution for the boundary elements: another discretisation, another library, another solver. It shares
with them only the outline's curve. A held edge moves with the holder; the rest is free or under contact pressure.
Error: second order in stress, third in displacement where the solution is smooth (tests/versus/test_plane_strain.py).
"""

from dataclasses import dataclass

import numpy as np
from mpi4py import MPI

from bem.exact.subsurface import von_mises
from bem.plane.body import Body
from bem.plane.curve import divide
from bem.plane.mesh import Sizing, Zone
from bem.steel.hardening import Hardening
from geometry.meshing.triangles import fill_with_triangles
from rail_fem.fe.compat import plane_mesh
from rail_fem.static_fe.small_strain import ELASTIC, SmallStrain, SmallStrainError, factor

CURVED = 6  # degree of the rule by which triangles at the outline have their elastic stiffness


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
        raise SmallStrainError(
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


class PlaneBody(SmallStrain):
    """A meshed and factorised body; nodes (m, 2) [m], displacements (2m, k) [m] x and y in turn.

    triangles (t, 6) and nodes as of `quadratic_triangles`;  edges : (e, 3) nodes of the face's edges in order (first,
    middle, last), the body on their left;  free : degrees of freedom that are not held
    """

    def __init__(self, body: Body, fineness: Fineness, hardening: Hardening = ELASTIC):
        corners, middles, names = boundary_nodes(body, fineness)
        self.body, n = body, len(corners)
        nodes, self.triangles = quadratic_triangles(corners, middles, fineness)
        ring = np.column_stack([np.arange(n), n + np.arange(n), (np.arange(n) + 1) % n])
        self.edges = ring[names == body.face]
        cells = self.triangles.astype(np.int64)
        mesh = plane_mesh(MPI.COMM_SELF, cells, np.ascontiguousarray(nodes), "triangle", 2)
        super().__init__(mesh, nodes, body.material, hardening, degree=2, elastic_rule=CURVED)
        held = np.unique(ring[names == body.held])
        self.free = np.setdiff1d(np.arange(self.count), (2 * held[:, None] + [0, 1]).ravel())
        self._factor = factor(self.stiffness(), self.free)

    def displacement(self, force: np.ndarray) -> np.ndarray:
        """Displacement (2m, k) [m] under nodal forces (2m, k) [N/m], x and y in turn, the held edge at rest."""
        out = np.zeros(force.shape)
        out[self.free] = self._factor.solve(np.ascontiguousarray(force[self.free]))
        return out

    def von_mises(self, displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points (p, 2) [m] and von Mises stress (p,) [Pa] there, of the elastic body's displacements (2m,) [m]."""
        return self.points.reshape(-1, 2), von_mises(self.stress(displacement).reshape(-1, 6))
