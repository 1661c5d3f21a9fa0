"""Rows by global number, dealt out among the ranks: from where they are computed to equal blocks, and back.

A block is a run of numbers, whole chunks of CHUNK rows (rail_fem.files.sealed). No rank holds more than its block and
what it owns; what a file holds so does not depend on the number of ranks.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from rail_fem.fe.domain import Domain
from rail_fem.files.sealed import CHUNK


def block_starts(total: int, size: int) -> np.ndarray:
    """First row of each rank's block, and the end of the last (size + 1,)."""
    chunks = -(-total // CHUNK)
    return np.minimum(CHUNK * (np.arange(size + 1) * chunks // size), total)


def to_blocks(comm: MPI.Comm, index: np.ndarray, rows: np.ndarray, total: int) -> np.ndarray:
    """The rank's block (b, m) of rows (k, m) that all ranks have at their global index (k,), 0 where nobody has any.
    Collective."""
    starts = block_starts(total, comm.size)
    order, counts = _by_rank(index, starts)
    numbers, there = _exchange(comm, index[order], counts)
    numbers -= starts[comm.rank]
    out = np.zeros((starts[comm.rank + 1] - starts[comm.rank], rows.shape[1]), rows.dtype)
    for some in _some_columns(rows):
        out[numbers, some], _ = _exchange(comm, rows[order, some], counts, there)
    return out


def from_blocks(comm: MPI.Comm, block: np.ndarray, index: np.ndarray, total: int) -> np.ndarray:
    """Rows (k, m) at the global index (k,) that this rank wants, from the blocks (b, m) of all ranks. Collective."""
    starts = block_starts(total, comm.size)
    order, counts = _by_rank(index, starts)
    wanted, there = _exchange(comm, index[order], counts)
    wanted -= starts[comm.rank]
    out = np.empty((len(index), block.shape[1]), block.dtype)
    for some in _some_columns(block):
        out[order, some], _ = _exchange(comm, block[wanted, some], there, counts)
    return out


def nodes_to_blocks(domain: Domain, field: np.ndarray) -> np.ndarray:
    """The rank's block (b, 3) of a nodal vector (3 n_nodes,), by input node. Collective."""
    owned = domain.n_owned
    return to_blocks(domain.comm, domain.node_input[:owned], field.reshape(-1, 3)[:owned], domain.n_global)


def _some_columns(rows: np.ndarray) -> list[slice]:
    """Columns that travel together: of all at once there would be four copies."""
    return [slice(first, first + 4) for first in range(0, rows.shape[1], 4)]


def _by_rank(index: np.ndarray, starts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Order of rows by the rank whose block they are in, and how many are in each (size,)."""
    rank = np.searchsorted(starts, index, side="right") - 1
    # empty blocks share their start with the next: the last of these is meant
    return np.argsort(rank, kind="stable"), np.bincount(rank, minlength=len(starts) - 1)


def _exchange(
    comm: MPI.Comm, rows: np.ndarray, counts: np.ndarray, back: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Rows, so many for each rank in turn, to these; what came from all of them, and how many from each. back : how
    many come, where it is known. Collective."""
    if back is None:
        back = np.empty_like(counts)
        comm.Alltoall(counts, back)
    rows = np.ascontiguousarray(rows)
    out = np.empty((int(back.sum()), *rows.shape[1:]), rows.dtype)
    width = rows.itemsize * int(np.prod(rows.shape[1:], dtype=np.int64))
    unit = MPI.BYTE.Create_contiguous(width).Commit()  # a count is at most 2^31 - 1: of rows, not of bytes
    comm.Alltoallv([rows, (counts, _offsets(counts)), unit], [out, (back, _offsets(back)), unit])
    unit.Free()
    return out, back


def _offsets(counts: np.ndarray) -> np.ndarray:
    return np.cumsum(counts) - counts
