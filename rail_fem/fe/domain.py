"""The distributed hexahedra: dolfinx carries the mesh and the ownership of nodes; arrays carry the state.

Nodes of a rank: first those it owns, then the ghosts, as in the geometry's index map. Cells: only owned ones exist (no
ghost cells), so each element is counted once; forces on a node that several ranks have are summed up on all of them.
"""

from __future__ import annotations

import gc
from typing import Any

import numpy as np
from mpi4py import MPI

from geometry.meshing.quality import cell_centres
from rail_fem.fe.compat import create_hexahedral_mesh, geometry_dofmap, original_cells
from rail_fem.fe.halo import Halo, common_nodes
from rail_fem.fe.heap import give_back_free_memory
from rail_fem.fe.partition import balanced_parts

VTK_TO_DOLFINX = np.array([0, 1, 3, 2, 4, 5, 7, 6])  # its own inverse


class Domain:
    """Hexahedra over the ranks of `comm`, built from a mesh that only root holds.

    Parameters (root only, others pass None)
    ----------
    points : (n, 3) [m];  cells : (m, 8) VTK order;  region : (m,) int
    part : (m,) rank of each cell; None: even pieces along the longest side
    keep_mesh : keep the dolfinx mesh, for dolfinx's own forms; steps want of it only who owns which node

    Attributes (rank-local unless said)
    ----------
    mesh : dolfinx mesh, None unless it is kept;  cells : (m_local, 8) local nodes in VTK order;  region : (m_local,);
    cell_input : (m_local,) index in the input
    n_owned, n_nodes : owned nodes, and with ghosts
    node_input : (n_nodes,) index in the input;
    reference : (3 n_nodes,) [m]
    n_global, m_global : replicated totals
    """

    def __init__(self, comm: MPI.Comm, points=None, cells=None, region=None, part=None, keep_mesh=False):
        self.comm = comm
        message = None
        if comm.rank == 0 and len(cells) < comm.size:
            message = f"{comm.size} ranks for {len(cells)} elements: start no more ranks than there are elements"
        raise_together(comm, message)
        if comm.rank == 0:
            cells = np.asarray(cells, dtype=np.int64)
            if part is None:
                part = balanced_parts(cell_centres(points, cells), np.ones(len(cells)), comm.size)
            ordered, destination, points = cells[:, VTK_TO_DOLFINX], part, np.ascontiguousarray(points, dtype=float)
        else:
            ordered, points, destination = np.empty((0, 8), np.int64), np.empty((0, 3)), np.empty(0, np.int32)
        mesh = create_hexahedral_mesh(comm, ordered, points, destination)
        geometry = mesh.geometry
        index_map = geometry.index_map()
        self.n_owned, self.n_nodes = index_map.size_local, index_map.size_local + index_map.num_ghosts
        self.n_global = index_map.size_global
        self.node_input = np.array(geometry.input_global_indices, dtype=np.int32)
        self.reference = np.array(geometry.x[: self.n_nodes]).ravel()
        owned_cells = mesh.topology.index_map(3).size_local
        self.m_global = mesh.topology.index_map(3).size_global
        self.cells = np.ascontiguousarray(geometry_dofmap(mesh)[:owned_cells][:, VTK_TO_DOLFINX])
        self.cell_input = original_cells(mesh)[:owned_cells].astype(np.int32)
        wanted = comm.gather(self.cell_input, root=0)
        given = None if wanted is None else [np.asarray(region)[cells] for cells in wanted]
        self.region = comm.scatter(given, root=0)
        starts = np.array(comm.allgather(index_map.local_range[0]))
        owner = np.array(index_map.owners, np.int64)
        place = np.array(index_map.ghosts, np.int64) - starts[owner]
        self._common = common_nodes(comm, self.n_owned, owner, place)
        self._all = self.halo()
        self.mesh: Any = mesh if keep_mesh else None
        del cells, points, region, wanted, given, ordered, destination, geometry, index_map, mesh
        gc.collect()  # mesh and coordinate element of dolfinx 0.5 hold each other
        give_back_free_memory()

    def cell_centres(self) -> np.ndarray:
        """Mean reference positions of the nodes of each cell (m_local, 3) [m]. Rank-local."""
        return self.reference.reshape(-1, 3)[self.cells].mean(axis=1)

    def nodal_vector(self) -> np.ndarray:
        return np.zeros(3 * self.n_nodes)

    def halo(self) -> Halo:
        """An exchange of its own, of all nodes until it is told which. Rank-local."""
        return Halo(self.comm, self._common, self.n_nodes)

    def sum_up(self, field: np.ndarray) -> None:
        """What all ranks have at a node, summed up, in place (3 n_nodes,), the same on all of them. Collective."""
        self._all.sum_up(field)

    def local_nodes(self, input_nodes: np.ndarray, owned_only: bool = True) -> tuple[np.ndarray, np.ndarray]:
        """Local nodes among `input_nodes` (indices of the input mesh), and their positions in that list. Rank-local."""
        lookup = np.full(
            max(int(self.node_input.max(initial=-1)), int(np.max(input_nodes, initial=-1))) + 1, -1, dtype=np.int64
        )
        limit = self.n_owned if owned_only else self.n_nodes
        lookup[self.node_input[:limit]] = np.arange(limit)
        local = lookup[np.asarray(input_nodes, dtype=np.int64)]
        where = np.flatnonzero(local >= 0)
        return local[where], where


def raise_together(comm: MPI.Comm, message: str | None) -> None:
    """Raise the first rank's message on every rank, so that no rank waits for one that has gone. Collective."""
    messages = [f for f in comm.allgather(message) if f]
    if messages:
        raise ValueError(messages[0])
