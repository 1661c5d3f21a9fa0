"""The messages of a step whose contact some ranks compute: to them where the watched nodes are, back the forces on
them.

Between the two the other ranks compute elements that no contact force moves in the step, and the owners, which have
fewer of them, the contact: each projects its part of the pairs, all find the same pressures. What else a step sums over
the ranks goes along.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from mpi4py import MPI

from rail_fem.fe.contact.forces import give_forces
from rail_fem.fe.contact.pairs import N_SUMS

OWNER = 0  # root, whose restart file holds all that it knows; further owners follow it
RANKS_OF_OWNER, MOST_OWNERS = 4, 4
THERE, BACK = 1, 2  # first tags
ROW = 6  # numbers of a node, see forces.pack
# numbers of a message, 3.5 kB: longer ones wait until both sides come to them, where a system does not let a process
# read another's memory (Open MPI's limit is 4 kB), and so for the elements between
PIECE = 448


def owner_count(ranks: int) -> int:
    """How many of so many ranks compute contact."""
    return min(max(ranks // RANKS_OF_OWNER, 1), MOST_OWNERS)


def pieces(init: Callable[..., MPI.Prequest], numbers: np.ndarray, rank: int, tag: int) -> list[MPI.Prequest]:
    """What sends numbers (k,) to a rank, or has them from it, in messages of PIECE. init : Send_init or Recv_init of a
    communicator"""
    starts = range(0, len(numbers), PIECE)
    return [init(numbers[first : first + PIECE], rank, tag + 2 * n) for n, first in enumerate(starts)]


class ContactMessages:
    """Between the ranks that have surface nodes and the owners of their contact, the first ranks.

    here, ghosts_here : (k,) which of the surface nodes this rank has, its own and others';  owners : how many, None: as
    `owner_count`

    Attributes: mine : what this rank sends, its share of the sums, then the rows of its watched nodes;  on an owner
    group : the owners' communicator, given : what all send, rank by rank, order (w,) all watched nodes, at (w,) where
    the row of each begins in `given`
    """

    def __init__(self, comm: MPI.Comm, here: np.ndarray, ghosts_here: np.ndarray, owners: int | None = None):
        self.comm, self.here, self.ghosts_here = comm, here, ghosts_here
        self.owners = owner_count(comm.size) if owners is None else owners
        self.is_owner = comm.rank < self.owners
        self.group = comm.Split(not self.is_owner, comm.rank) if self.owners > 1 else MPI.COMM_SELF
        nodes = comm.allgather((here, ghosts_here))
        self.nodes_of = nodes if self.is_owner else []
        self.there: list[MPI.Prequest] = []
        self.back: list[MPI.Prequest] = []

    def choose(self, watched: np.ndarray, count: int) -> None:
        """From now on these surface nodes (n,) bool are watched, and so many numbers are summed. Rank-local."""
        chosen = lambda nodes: nodes[watched[nodes]]
        for request in (*self.there, *self.back):
            request.Free()
        comm, self.count = self.comm, count
        if not self.is_owner:
            own = chosen(self.here)
            self.nodes = np.concatenate([own, chosen(self.ghosts_here)])
            self.mine = np.empty(count + ROW * len(own))
            self.answers = np.empty(count + N_SUMS + 1 + 3 * len(self.nodes))
            every = range(self.owners)
            self.there = [one for owner in every for one in pieces(comm.Send_init, self.mine, owner, THERE)]
            self.back = pieces(comm.Recv_init, self.answers, comm.rank % self.owners, BACK)
            return
        owned = [chosen(own) for own, _ in self.nodes_of]
        self.order, sizes = np.concatenate(owned), np.array(list(map(len, owned)))
        self.given = np.empty(count * len(owned) + ROW * len(self.order))
        self.at = count * (1 + np.repeat(np.arange(len(owned)), sizes)) + ROW * np.arange(len(self.order))
        self.of_ranks = np.split(self.given, np.cumsum(count + ROW * sizes)[:-1])
        self.mine = self.of_ranks[comm.rank]
        self.there = []
        for rank, of_rank in enumerate(self.of_ranks):
            if rank != comm.rank:
                self.there += pieces(comm.Recv_init, of_rank, rank, THERE)
                self.there += pieces(comm.Send_init, self.mine, rank, THERE) if rank < self.owners else []
        others = [rank for rank in range(self.owners, comm.size) if rank % self.owners == comm.rank]
        told = [np.concatenate([owned[rank], chosen(self.nodes_of[rank][1])]) for rank in others]
        self.told = np.concatenate([np.empty(0, np.int64), *told])
        self.first = np.cumsum([0, *map(len, told)])  # of each rank's nodes among the told
        starts = 3 * self.first + (count + N_SUMS + 1) * np.arange(len(self.first))
        self.answers = np.empty(starts[-1])
        self.back = []
        for rank, first, last in zip(others, starts, starts[1:]):
            self.back += pieces(comm.Send_init, self.answers[first:last], rank, BACK)

    @property
    def rows(self) -> np.ndarray:
        """(k, ROW) of this rank's watched nodes, in `mine`."""
        return self.mine[self.count :].reshape(-1, ROW)

    def send(self, summed: np.ndarray) -> None:
        """This rank's share of the sums, and `rows`, to the owners, which wait for those of all and sum up in place, in
        the order of the ranks. Collective."""
        if self.comm.size == 1:
            return
        self.mine[: self.count] = summed
        MPI.Prequest.Startall(self.there)
        if self.is_owner:
            MPI.Prequest.Waitall(self.there)
            summed[:] = 0.0
            for of_rank in self.of_ranks:
                summed += of_rank[: self.count]
        else:
            MPI.Prequest.Startall(self.back)

    def answer(self, summed: np.ndarray, sums: np.ndarray, lost: int, force: np.ndarray) -> None:
        """To each rank of this owner: what is summed up, the contact's sums (N_SUMS,), lost pairs, forces (n, 3) on its
        nodes. Owners only."""
        if self.comm.size > 1:
            give_forces(summed, sums, lost, force, self.told, self.first, self.answers)
            MPI.Prequest.Startall(self.back)

    def take(self, summed: np.ndarray, sums: np.ndarray, force: np.ndarray) -> int:
        """The answer -> sums, forces on the nodes of this rank; returns lost pairs. Not on owners."""
        MPI.Prequest.Waitall(self.there + self.back)
        ends = self.count, self.count + N_SUMS
        summed[:], sums[:], lost = self.answers[: ends[0]], self.answers[slice(*ends)], self.answers[ends[1]]
        force[self.nodes] = self.answers[ends[1] + 1 :].reshape(-1, 3)
        return int(lost)

    def sent(self) -> None:
        """Wait until every answer has left. Owners only."""
        MPI.Prequest.Waitall(self.back)
