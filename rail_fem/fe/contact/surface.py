"""The running surface of a body as contact sees it: bilinear facets with neighbours, areas and normals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from mpi4py import MPI

from rail_fem.fe.structure import Structure


@dataclass(frozen=True)
class Surface:
    """Bilinear facets of a body. nodes : (n,) input nodes;  quads : (q, 4) positions in `nodes`, outward normal by the
    right-hand rule."""

    nodes: np.ndarray
    quads: np.ndarray

    @staticmethod
    def from_quads(quads: np.ndarray) -> Surface:
        """From facets in input node numbers (q, 4)."""
        nodes, local = np.unique(quads, return_inverse=True)
        return Surface(nodes, local.reshape(quads.shape))


def edge_neighbours(quads: np.ndarray) -> np.ndarray:
    """Facet across each edge 01, 12, 23, 30 of each facet (q, 4), -1 where there is none."""
    out = np.full(quads.shape, -1, np.int64)
    edges = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    ordered = edges[order]
    same = np.flatnonzero((ordered[1:] == ordered[:-1]).all(axis=1))
    first, second = order[same], order[same + 1]
    out.ravel()[first], out.ravel()[second] = second // 4, first // 4
    return out


def tributary_areas(points: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """A quarter of the area of each facet at a node, summed (n,) [m2]."""
    p = points[quads]
    area = 0.5 * np.linalg.norm(np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]), axis=1)
    return np.bincount(quads.ravel(), np.repeat(area / 4, 4), minlength=len(points))


def node_normals(points: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """Outward unit normals (n, 3) of the nodes, facets weighted by their area; 0 where a node has no facet."""
    p = points[quads]
    facet = np.repeat(np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]), 4, axis=0)
    out = np.column_stack([np.bincount(quads.ravel(), facet[:, c], minlength=len(points)) for c in range(3)])
    return out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-300)


class ContactSurfaces:
    """Surface `rail` and surface `wheel` of a structure, and what never changes of their n nodes, the rail's n_rail
    first. Replicated but for `local` and `ghosts`.

    fixed : (n_nodes, 3) bool of local nodes, directions held: such nodes are as heavy as can be

    Attributes: input_nodes (n,);  local : this rank's nodes, here : which of the n they are;  ghosts, ghosts_here : the
    same of nodes that it has of others;  quads, neighbours : of each surface (q, 4), numbers among the n, facets across
    edges;  reference (n, 3) [m];  area (n,) [m2];  inverse_mass (n,) [1/kg]
    """

    def __init__(self, structure: Structure, rail: Surface, wheel: Surface, fixed: np.ndarray | None = None):
        self.structure, self.comm = structure, structure.domain.comm
        self.n_rail = len(rail.nodes)
        self.input_nodes = np.concatenate([rail.nodes, wheel.nodes])
        self.n = len(self.input_nodes)
        self.local, self.here = structure.domain.local_nodes(self.input_nodes)
        every, there = structure.domain.local_nodes(self.input_nodes, owned_only=False)
        ghost = every >= structure.domain.n_owned
        self.ghosts, self.ghosts_here = every[ghost], there[ghost]
        self.reference = self.gather(structure.domain.reference)
        self.inverse_mass = 1.0 / self.gather(np.repeat(structure.mass, 3))[:, 0]
        if fixed is not None:
            self.inverse_mass[self.gather(np.where(fixed, 1.0, 0.0)).max(axis=1) > 0.5] = 0.0
        self.quads = (rail.quads.astype(np.int64), wheel.quads.astype(np.int64) + self.n_rail)
        self.neighbours = tuple(edge_neighbours(q) for q in self.quads)
        self.area = sum(tributary_areas(self.reference, q) for q in self.quads)

    def each(self) -> tuple[Surface, Surface]:
        """The two that they were made of."""
        rail, wheel = np.split(self.input_nodes, [self.n_rail])
        return Surface(rail, self.quads[0]), Surface(wheel, self.quads[1] - self.n_rail)

    def gather(self, field: np.ndarray) -> np.ndarray:
        """Nodal field at all surface nodes (n, 3), replicated. Collective."""
        out = np.zeros((self.n, 3))
        out[self.here] = field.reshape(-1, 3)[self.local]
        if self.comm.size > 1:
            self.comm.Allreduce(MPI.IN_PLACE, out)
        return out
