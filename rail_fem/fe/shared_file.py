"""A sealed file of arrays (rail_fem.files.sealed) that all ranks write and read, each its block of the rows.

What a file holds does not depend on the number of ranks: arrays stand in global numbering, and their digests go by
chunks of rows. It appears whole or not at all, and the one before it is kept until then.
"""

from __future__ import annotations

import hashlib
import json
import os
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from mpi4py import MPI

from rail_fem.fe.domain import raise_together
from rail_fem.fe.global_rows import block_starts
from rail_fem.files.atomic import partial_name
from rail_fem.files.npz_layout import Member, directory, head, joined, lay_out, members_of
from rail_fem.files.sealed import CHUNK, LABEL, damaged, label_of, leaves, seal_from, unfit

MOST = 1 << 30  # bytes that are written by one call


class Shared(NamedTuple):
    """An array of `total` rows of which each rank holds its block (b, ...) (rail_fem.fe.global_rows)."""

    block: np.ndarray
    total: int

    @property
    def shape(self) -> tuple[int, ...]:
        return (self.total, *self.block.shape[1:])


class _Part(NamedTuple):
    """What root must know of a block: its size [bytes], CRC-32 and the digests of its chunks."""

    size: int
    checksum: int
    digests: list[bytes]


def write_shared(
    comm: MPI.Comm, path: Path, shared: Mapping[str, Shared], own: Mapping[str, np.ndarray], identity: Mapping[str, str]
) -> None:
    """Write the arrays, whole or not at all.

    own, identity : further arrays, the same on all ranks, and what the file belongs to; root's count
    Collective. Errors: ValueError on all ranks where it cannot be written.
    """
    own = comm.bcast({name: np.asarray(a, order="C") for name, a in own.items()} if comm.rank == 0 else None, root=0)
    identity = comm.bcast(dict(identity) if comm.rank == 0 else None, root=0)
    label = label_of(hashlib.sha256(b"").hexdigest(), identity)  # as long as the one that will stand there
    kinds = {LABEL: (label.dtype, label.shape)} | {name: (a.dtype, a.shape) for name, a in own.items()}
    kinds |= {name: (part.block.dtype, part.shape) for name, part in shared.items()}
    members, end = lay_out(kinds)
    blocks = {name: np.ascontiguousarray(part.block) for name, part in shared.items()}
    told = {name: _Part(b.nbytes, zlib.crc32(b.data if b.size else b""), leaves(b)) for name, b in blocks.items()}
    every = comm.gather(told, root=0)
    mine = [(m, int(block_starts(m.shape[0], comm.size)[comm.rank])) for m in members if m.name in blocks]
    pieces = [(m.data + first * m.row, blocks[m.name]) for m, first in mine]
    if comm.rank == 0:
        pieces += _roots_pieces(members, end, own, every, identity)
    write_pieces(comm, path, pieces)


def _roots_pieces(
    members: list[Member],
    end: int,
    own: Mapping[str, np.ndarray],
    every: list[dict[str, _Part]],
    identity: Mapping[str, str],
) -> list[tuple[int, np.ndarray]]:
    """All that is not a block: position and bytes of heads, whole arrays, the seal and the directory."""
    digests = {name: (a.dtype.str, a.shape, leaves(a)) for name, a in own.items()}
    checksums = {name: zlib.crc32(a.data if a.size else b"") for name, a in own.items()}
    for m in members:
        if m.name in every[0]:
            parts = [told[m.name] for told in every]
            digests[m.name] = (m.dtype.str, m.shape, [digest for part in parts for digest in part.digests])
            checksums[m.name] = 0
            for part in parts:
                checksums[m.name] = joined(checksums[m.name], part.checksum, part.size)
    whole = {**own, LABEL: label_of(seal_from(digests, identity), identity)}
    checksums[LABEL] = zlib.crc32(whole[LABEL].data)
    pieces = [(m.at, as_bytes(head(m, checksums[m.name]))) for m in members]
    pieces += [(m.data, whole[m.name]) for m in members if m.name in whole]
    return [*pieces, (end, as_bytes(directory(members, [checksums[m.name] for m in members], end)))]


def as_bytes(text: bytes) -> np.ndarray:
    """A piece (k,) uint8 of `write_pieces`."""
    return np.frombuffer(text, np.uint8)


def write_pieces(comm: MPI.Comm, path: Path, pieces: list[tuple[int, np.ndarray]]) -> None:
    """One file of every rank's pieces, position [bytes] and array, whole or not at all. Collective. Errors: ValueError
    on all ranks where it cannot be written."""
    temporary = comm.bcast(partial_name(Path(path)), root=0)
    message = _written(comm, temporary, pieces)
    if comm.rank == 0 and message is None:
        message = _attempt(lambda: os.replace(temporary, path))
    if comm.rank == 0:
        temporary.unlink(missing_ok=True)
    raise_together(comm, None if message is None else f"cannot write {path}: {message}")


def _written(comm: MPI.Comm, path: Path, pieces: list[tuple[int, np.ndarray]]) -> str | None:
    """Every rank's pieces, position and array, in one file; what went wrong on any rank, or None. Collective."""
    message = _attempt(lambda: path.unlink(missing_ok=True)) if comm.rank == 0 else None
    comm.barrier()
    try:
        file = MPI.File.Open(comm, str(path), MPI.MODE_WRONLY | MPI.MODE_CREATE)
    except MPI.Exception as error:
        return str(error)

    def write() -> None:
        status = MPI.Status()
        for at, array in pieces:
            flat = array.reshape(-1).view(np.uint8)
            for first in range(0, len(flat), MOST):
                part = flat[first : first + MOST]
                file.Write_at(at + first, part, status)
                if status.Get_count(MPI.BYTE) != len(part):
                    raise OSError(f"{status.Get_count(MPI.BYTE)} of {len(part)} bytes could be written")

    message = message or _attempt(write)
    closed = _attempt(file.Close)
    found = [m for m in comm.allgather(message or closed) if m]
    return found[0] if found else None


def _attempt(action) -> str | None:
    """What went wrong, in words."""
    try:
        action()
    except (OSError, MPI.Exception) as error:
        return str(error)
    return None


class SharedReader:
    """A sealed file opened by all ranks: `whole` arrays and blocks of the others. Collective in all it does.

    names : of the arrays that are read by blocks. Errors: ValueError on all ranks for a file that is damaged, changed
    or another's, before a number of it is used; with the remedy.
    """

    def __init__(self, comm: MPI.Comm, path: Path, identity: Mapping[str, str], names: tuple[str, ...], remedy: str):
        self.comm, self.path = comm, Path(path)
        told, fault = None, None
        if comm.rank == 0:
            try:
                members = members_of(self.path)
                label: dict[str, Any] = json.loads(bytes(self._rows(members.pop(LABEL))).decode())
                told, fault = members, unfit(label["chunk"] == CHUNK, label["identity"], identity)
            except Exception as error:  # a damaged file fails anywhere in zip, json, numpy or the headers
                fault = damaged(error)
        self._refuse(fault, remedy)
        self.members: dict[str, Member] = comm.bcast(told, root=0)
        try:
            self.blocks = {name: self._block(self._member(name)) for name in names}
        except Exception as error:
            fault = damaged(error)
        self._refuse(fault, remedy)
        every = comm.gather({name: leaves(block) for name, block in self.blocks.items()}, root=0)
        whole: dict[str, np.ndarray] = {}
        if comm.rank == 0:
            try:
                whole = {name: self._rows(m) for name, m in self.members.items() if name not in names}
                fault = unfit(label["seal"] == self._seal(whole, every, label["identity"]), {}, {})
            except Exception as error:
                fault = damaged(error)
        self._refuse(fault, remedy)
        self.whole: dict[str, np.ndarray] = comm.bcast(whole, root=0)

    def _refuse(self, fault: str | None, remedy: str) -> None:
        raise_together(self.comm, None if fault is None else f"{self.path}: {fault}: {remedy}")

    def _member(self, name: str) -> Member:
        if name not in self.members:
            raise ValueError(f"no {name} in it")
        return self.members[name]

    def _block(self, member: Member) -> np.ndarray:
        starts = block_starts(member.shape[0], self.comm.size)
        return self._rows(member, int(starts[self.comm.rank]), int(starts[self.comm.rank + 1]))

    def _rows(self, member: Member, first: int = 0, end: int | None = None) -> np.ndarray:
        """Rows first..end-1 of an array, or all of it. Rank-local. Errors: OSError, ValueError."""
        shape = member.shape if end is None else (end - first, *member.shape[1:])
        count = int(np.prod(shape, dtype=np.int64))
        found = np.fromfile(self.path, member.dtype, count, offset=member.data + first * member.row)
        if len(found) != count:
            raise ValueError(f"it ends within {member.name}")
        return found.reshape(shape)

    def _seal(
        self, whole: dict[str, np.ndarray], every: list[dict[str, list[bytes]]], identity: Mapping[str, str]
    ) -> str:
        """Of what was read. every : digests of the blocks of all ranks. Root only."""
        digests = {name: (a.dtype.str, a.shape, leaves(a)) for name, a in whole.items()}
        for name in self.blocks:
            m = self.members[name]
            digests[name] = (m.dtype.str, m.shape, [digest for told in every for digest in told[name]])
        return seal_from(digests, identity)
