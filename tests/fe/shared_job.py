"""Files that all ranks write and read, for tests/fe/test_shared_file.py:

    mpirun -n N python -m mpi4py tests/fe/shared_job.py FOLDER [full|lost]

Writes FOLDER/state.npz, reads it and FOLDER/one.npz (if there) again: prints what was found. full: a rank cannot write;
lost: a rank ends in the middle of it.
"""

import json
import os
import sys
from pathlib import Path

import numpy as np
from mpi4py import MPI

from rail_fem.fe import shared_file
from rail_fem.fe.global_rows import from_blocks, to_blocks
from rail_fem.fe.shared_file import Shared, SharedReader, write_shared

NODES, CELLS = 10_000, 5_000  # three chunks and two: more than one for some rank, none for others
OWN, IDENTITY = {"words": np.frombuffer(b"[1, 2]", np.uint8), "sums": np.arange(3.0)}, {"case": "a1"}


def fields() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(4)
    return rng.normal(size=(NODES, 3)), rng.integers(0, 9, (CELLS, 2))


def dealt(comm, total: int) -> np.ndarray:
    """The numbers that this rank owns: any."""
    return np.flatnonzero(np.random.default_rng(5).integers(0, comm.size, total) == comm.rank)[::-1].copy()


def break_last_rank(comm, how: str) -> None:
    """full: the last rank cannot write its pieces of a file; lost: it ends before it has."""
    write = shared_file._attempt

    def fail(action):
        if action.__name__ != "write" or comm.rank != comm.size - 1:
            return write(action)
        if how == "lost":
            os._exit(9)
        return "no space left on device"

    shared_file._attempt = fail


def main(folder: Path, how: str) -> None:
    comm = MPI.COMM_WORLD
    points, cells = fields()
    nodes, mine = dealt(comm, NODES), dealt(comm, CELLS)
    mine = mine[mine >= 100]  # nobody has the first hundred: 0 in the file
    shared = {
        "points": Shared(to_blocks(comm, nodes, points[nodes], NODES), NODES),
        "cells": Shared(to_blocks(comm, mine, cells[mine], CELLS), CELLS),
    }
    if how:
        break_last_rank(comm, how)
    try:
        write_shared(comm, folder / "state.npz", shared, OWN, IDENTITY)
    except ValueError as error:
        said = comm.gather(str(error))
        print(json.dumps(said) if comm.rank == 0 else "", flush=True)
        return
    for name in ("state.npz", "one.npz"):
        if not (folder / name).is_file():
            continue
        read = SharedReader(comm, folder / name, IDENTITY, ("points", "cells"), "begin again")
        wanted = np.unique(np.random.default_rng(comm.rank).integers(0, NODES, 700))  # some by several ranks
        got = from_blocks(comm, read.blocks["points"], wanted, NODES)
        assert np.array_equal(got, points[wanted]) and got.dtype == points.dtype
        got, every = from_blocks(comm, read.blocks["cells"], np.arange(CELLS), CELLS), cells.copy()
        every[:100] = 0
        assert np.array_equal(got, every) and got.dtype == cells.dtype
        assert read.whole.keys() == OWN.keys() and np.array_equal(read.whole["sums"], OWN["sums"])
    try:
        SharedReader(comm, folder / "state.npz", {"case": "b7"}, ("points", "cells"), "begin again")
    except ValueError as error:
        refused = comm.gather(str(error))
        if comm.rank == 0:
            print(json.dumps(refused))


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else "")
