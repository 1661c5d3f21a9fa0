"""Nodes that several ranks have: values from their owners to the ghosts, forces from the ghosts to their owners.

dolfinx's own exchange takes all ghosts of a vector; a pass in a travelling window computes a fifth of them in a step.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from rail_fem.fe.node_kernels import add_rows, put_rows, take_rows


class Halo:
    """Exchange of nodal vectors (3 n_nodes,) at chosen nodes; at first all.

    first : local number of the first ghost;  owner : (n_ghosts,) rank that owns each;  place : (n_ghosts,) number that
    it has there
    """

    def __init__(self, comm: MPI.Comm, first: int, owner: np.ndarray, place: np.ndarray):
        self.comm, self.first, self.owner, self.place = comm, first, owner, place
        self.choose(np.ones(first + len(owner), bool))

    def choose(self, wanted: np.ndarray) -> None:
        """From now on exchange these nodes (n_nodes,) bool: a node for all ranks that have it, or for none.
        Collective."""
        chosen = np.flatnonzero(wanted[self.first :])
        of_rank = [chosen[self.owner[chosen] == rank] for rank in range(self.comm.size)]
        asked = self.comm.alltoall([self.place[ghosts] for ghosts in of_rank])
        self.ghosts = self.first + np.concatenate(of_rank)
        self.owned = np.concatenate(asked)
        self.at_ghosts, self.at_owned = np.empty((len(self.ghosts), 3)), np.empty((len(self.owned), 3))
        self.of_ghosts, self.of_owned = (
            [(rank, part) for rank, part in enumerate(np.split(rows, np.cumsum(sizes)[:-1])) if len(part)]
            for rows, sizes in ((self.at_ghosts, list(map(len, of_rank))), (self.at_owned, list(map(len, asked))))
        )

    def sum_to_owner(self, field: np.ndarray) -> None:
        """Add what ghosts hold onto their owners, in place (3 n_nodes,). Collective."""
        if self.comm.size == 1:
            return
        take_rows(field, self.ghosts, self.at_ghosts)
        self._send(self.of_ghosts, self.of_owned)
        add_rows(field, self.owned, self.at_owned)

    def copy_to_ghosts(self, field: np.ndarray) -> None:
        """Give ghosts the values of their owners, in place (3 n_nodes,). Collective."""
        if self.comm.size == 1:
            return
        take_rows(field, self.owned, self.at_owned)
        self._send(self.of_owned, self.of_ghosts)
        put_rows(field, self.ghosts, self.at_ghosts)

    def _send(self, given: list[tuple[int, np.ndarray]], taken: list[tuple[int, np.ndarray]]) -> None:
        requests = [self.comm.Irecv(part, rank) for rank, part in taken]
        MPI.Request.Waitall(requests + [self.comm.Isend(part, rank) for rank, part in given])
