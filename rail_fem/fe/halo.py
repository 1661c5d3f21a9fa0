"""Nodes that several ranks have: values from their owners to the ghosts, forces from the ghosts to their owners.

dolfinx's own exchange takes all ghosts of a vector; a pass in a travelling window computes a fifth of them in a step.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from rail_fem.fe.node_kernels import add_rows, put_rows, take_rows

Parts = list[tuple[int, np.ndarray]]  # rank, and the rows that go to it or come from it


class Halo:
    """Exchange of nodal vectors (3 n_nodes,) at chosen nodes; at first all.

    first : local number of the first ghost;  owner : (n_ghosts,) rank that owns each;  place : (n_ghosts,) number that
    it has there
    """

    def __init__(self, comm: MPI.Comm, first: int, owner: np.ndarray, place: np.ndarray):
        self.comm, self.first, self.owner, self.place = comm, first, owner, place
        self.to_owners: list[MPI.Prequest] = []
        self.to_ghosts: list[MPI.Prequest] = []
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
        of_ghosts, of_owned = (
            [(rank, part) for rank, part in enumerate(np.split(rows, np.cumsum(sizes)[:-1])) if len(part)]
            for rows, sizes in ((self.at_ghosts, list(map(len, of_rank))), (self.at_owned, list(map(len, asked))))
        )
        for request in self.to_owners + self.to_ghosts:
            request.Free()
        self.to_owners, self.to_ghosts = self._requests(of_ghosts, of_owned), self._requests(of_owned, of_ghosts)

    def sum_to_owner(self, field: np.ndarray) -> None:
        """Add what ghosts hold onto their owners, in place (3 n_nodes,). Collective."""
        if self.comm.size == 1:
            return
        take_rows(field, self.ghosts, self.at_ghosts)
        MPI.Prequest.Startall(self.to_owners)
        MPI.Prequest.Waitall(self.to_owners)
        add_rows(field, self.owned, self.at_owned)

    def copy_to_ghosts(self, field: np.ndarray) -> None:
        """Give ghosts the values of their owners, in place (3 n_nodes,). Collective."""
        if self.comm.size == 1:
            return
        take_rows(field, self.owned, self.at_owned)
        MPI.Prequest.Startall(self.to_ghosts)
        MPI.Prequest.Waitall(self.to_ghosts)
        put_rows(field, self.ghosts, self.at_ghosts)

    def _requests(self, given: Parts, taken: Parts) -> list[MPI.Prequest]:
        """Of one exchange, to be started as often as there is one."""
        receive = [self.comm.Recv_init(part, rank) for rank, part in taken]
        return receive + [self.comm.Send_init(part, rank) for rank, part in given]
