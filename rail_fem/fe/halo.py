"""Nodes that several ranks have: what each of them adds to a node, summed up on all of them.

Ranks that have a node in common tell each other their parts, and each adds all of them in the order of the ranks: the
same numbers, to the last bit, on all. So what follows from them, velocities and positions, each rank computes for all
its nodes, and one exchange a step is enough. dolfinx's own goes by owners, in two, and takes all ghosts of a vector; a
pass in a travelling window computes a fifth of them in a step.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from scipy import sparse

from rail_fem.fe.node_kernels import sum_rows, take_rows


class Halo:
    """Sums of nodal vectors (3 n_nodes,) at chosen nodes; at first all.

    common : of each rank, the local nodes that this one has in common with it (`common_nodes`)
    """

    def __init__(self, comm: MPI.Comm, common: list[np.ndarray], n_nodes: int):
        self.comm, self.common = comm, common
        self.requests: list[MPI.Prequest] = []
        self.choose(np.ones(n_nodes, bool))

    def choose(self, wanted: np.ndarray) -> None:
        """From now on sum up these nodes (n_nodes,) bool: a node on all ranks that have it, or on none. Rank-local."""
        chosen = [nodes[wanted[nodes]] for nodes in self.common]
        self.given = np.concatenate(chosen)
        self.shared = chosen[self.comm.rank] = np.unique(self.given)
        self.parts = np.concatenate(chosen)  # of all ranks, in their order
        self.at_given, self.at_parts = np.empty((len(self.given), 3)), np.empty((len(self.parts), 3))
        ends = np.cumsum(list(map(len, chosen)))
        taken = np.split(self.at_parts, ends[:-1])
        self.own = taken[self.comm.rank]
        for request in self.requests:
            request.Free()
        given, others = 0, [rank for rank in range(self.comm.size) if rank != self.comm.rank and len(chosen[rank])]
        self.requests = [self.comm.Recv_init(taken[rank], rank) for rank in others]
        for rank in others:
            rows = self.at_given[given : given + len(chosen[rank])]
            self.requests.append(self.comm.Send_init(rows, rank))
            given += len(rows)

    def sum_up(self, field: np.ndarray) -> None:
        """What all ranks have at a node, summed up, in place (3 n_nodes,). Collective."""
        if self.comm.size == 1:
            return
        take_rows(field, self.given, self.at_given)
        take_rows(field, self.shared, self.own)
        MPI.Prequest.Startall(self.requests)
        MPI.Prequest.Waitall(self.requests)
        sum_rows(field, self.shared, self.parts, self.at_parts)


def common_nodes(comm: MPI.Comm, first: int, owner: np.ndarray, place: np.ndarray) -> list[np.ndarray]:
    """Local nodes that this rank has in common with each rank, in one order on both. Collective.

    first : local number of the first ghost;  owner : (n_ghosts,) rank that owns each;  place : (n_ghosts,) number that
    it has there
    """
    ghosts_of = [np.flatnonzero(owner == rank) for rank in range(comm.size)]
    asked = comm.alltoall([place[ghosts] for ghosts in ghosts_of])
    rank_of = np.repeat(np.arange(comm.size), list(map(len, asked)))
    holders = sparse.csr_array((np.ones(len(rank_of), np.int8), (np.concatenate(asked), rank_of)), (first, comm.size))
    told = comm.alltoall([np.array(holders[nodes].nonzero()) for nodes in asked])
    found = [[(comm.rank, np.empty(0, np.int64), np.empty(0, np.int64))] for _ in range(comm.size)]
    for rank in range(comm.size):
        found[rank].append((comm.rank, asked[rank], asked[rank]))
        found[rank].append((rank, place[ghosts_of[rank]], first + ghosts_of[rank]))
        row, other = told[rank]
        for third in np.unique(other[other != comm.rank]):
            ghosts = ghosts_of[rank][row[other == third]]
            found[third].append((rank, place[ghosts], first + ghosts))
    return [_ordered(parts) for parts in found]


def _ordered(parts: list[tuple[int, np.ndarray, np.ndarray]]) -> np.ndarray:
    """Local nodes of (owner, numbers there, local nodes) by owner and number there."""
    owner = np.repeat([rank for rank, *_ in parts], [len(nodes) for *_, nodes in parts])
    place, nodes = (np.concatenate([part[k] for part in parts]) for k in (1, 2))
    return nodes[np.lexsort((place, owner))]
