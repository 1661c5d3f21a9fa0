"""Full state of a run in one file, in global numbering: a restart on the same number of ranks is bitwise the same, on
another it is possible.

What is saved is declared by the classes themselves (rail_fem.fe.saved_state). All ranks write and read, each its block
of the rows (rail_fem.fe.shared_file); the file appears whole or not at all, and the one before it is kept until then.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rail_fem.fe.blocks import AT_A_TIME, ElementBlocks
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.global_rows import from_blocks, nodes_to_blocks, to_blocks
from rail_fem.fe.saved_state import gather_state, restore_state
from rail_fem.fe.shared_file import Shared, SharedReader, write_shared
from rail_fem.fe.state import LANES
from rail_fem.fe.structure import Structure

FORMAT = "13"
REMEDY = "remove it and --restart begins at the first step, or begin again with --overwrite"


def element_state(blocks: ElementBlocks) -> np.ndarray:
    """State of each element (m, blocks.rows), then its back stress where there is one."""
    state = blocks.read(0, blocks.rows)
    return (
        np.column_stack([state, blocks.in_cells(blocks.back.reshape(-1, blocks.back_rows, LANES))])
        if blocks.back_rows
        else state
    )


def restore_elements(blocks: ElementBlocks, rows: np.ndarray) -> None:
    """Padding gets the state of its block's first element, whose nodes it repeats."""
    cell_of = blocks.cell_of.reshape(-1, LANES)
    back = blocks.back.reshape(len(cell_of), blocks.back_rows, LANES)
    for first in range(0, len(cell_of), AT_A_TIME):
        part = slice(first, first + AT_A_TIME)
        state = rows[np.where(cell_of[part] < 0, cell_of[part, :1], cell_of[part])].transpose(0, 2, 1)
        blocks.entries[part], back[part] = state[:, : blocks.rows], state[:, blocks.rows :]


def _block_works(structure: Structure) -> np.ndarray:
    """For each finite-strain cell (m, 2 + N_WORK): its block by number over all ranks, how many cells that has, its
    works [J]. Collective."""
    blocks, comm = structure.finite, structure.domain.comm
    number = comm.scan(len(blocks.filled)) - len(blocks.filled) + np.arange(len(blocks.filled))
    each = np.column_stack([number, blocks.filled, structure.block_work])
    return blocks.in_cells(np.broadcast_to(each[:, :, None], (*each.shape, LANES)))


def _restore_block_works(structure: Structure, rows: np.ndarray) -> None:
    """Works of blocks from those of the blocks that their cells were in: unchanged where these are the same cells, else
    each cell's even share."""
    blocks = structure.finite
    real = (blocks.cell_of >= 0).reshape(-1, LANES)
    stored = np.where(real[:, :, None], blocks.in_blocks(rows).transpose(0, 2, 1), np.nan)
    number, count, works = stored[:, :, 0], stored[:, :, 1], stored[:, :, 2:]
    same = ((number == number[:, :1]) & (count == blocks.filled[:, None]) | ~real).all(axis=1)
    shared = np.nansum(works / count[:, :, None], axis=1)
    structure.block_work[:] = np.where(same[:, None], works[:, 0], shared)


def save_checkpoint(path: Path, owner: Any, dynamics: Dynamics, identity: Mapping[str, str]) -> None:
    """Write everything that the next step needs.

    owner : what holds the STATE, `dynamics` within it;  identity : what the file belongs to, such as case and mesh
        (root only)
    Collective. Errors: ValueError on all ranks where it cannot be written.
    """
    domain, s, comm = dynamics.domain, dynamics.structure, dynamics.comm
    dynamics.bring_up()
    shared = {f"nodal/{name}": Shared(nodes_to_blocks(domain, getattr(s, name)), domain.n_global) for name in s.NODAL}
    finite, cells = domain.cell_input[s.finite_cells], domain.m_global
    shared["finite"] = Shared(to_blocks(comm, finite, element_state(s.finite), cells), cells)
    shared["block_work"] = Shared(to_blocks(comm, finite, _block_works(s), cells), cells)
    parts = np.concatenate([np.atleast_1d(getattr(holder, name)) for holder, name in _summed(dynamics)])
    own: dict[str, np.ndarray] = {"summed": np.array(comm.allgather(parts))}
    plain: dict = {}
    for key, leaf in gather_state(owner).items():
        (own if isinstance(leaf, np.ndarray) else plain)[key] = leaf
    own["plain"] = np.frombuffer(json.dumps(plain).encode(), np.uint8)
    write_shared(comm, path, shared, own, {"format": FORMAT, **identity})


def _summed(dynamics: Dynamics) -> list[tuple[Any, str]]:
    """Who holds a rank's part of a sum, and its name; the time last."""
    holders: list[Any] = [dynamics.structure, *dynamics.parts, dynamics]
    return [(holder, name) for holder in holders for name in holder.SUMMED]


def _restore_summed(summed: np.ndarray, dynamics: Dynamics) -> None:
    """Each rank's own part of the sums; on another number of ranks root takes all."""
    comm = dynamics.comm
    mine = summed[comm.rank] if len(summed) == comm.size else summed.sum(axis=0) * (comm.rank == 0)
    for holder, name in _summed(dynamics):
        size = np.size(getattr(holder, name))
        part, mine = mine[:size], mine[size:]
        setattr(holder, name, part.copy() if isinstance(getattr(holder, name), np.ndarray) else float(part[0]))


def load_checkpoint(path: Path, owner: Any, dynamics: Dynamics, identity: Mapping[str, str]) -> None:
    """Restore a state saved by `save_checkpoint` with the same identity (root only). Collective. Errors: ValueError on
    all ranks."""
    domain, s, comm = dynamics.domain, dynamics.structure, dynamics.comm
    names = (*(f"nodal/{name}" for name in s.NODAL), "finite", "block_work")
    stored = SharedReader(comm, path, {"format": FORMAT, **identity}, names, REMEDY)
    for name in s.NODAL:
        rows = from_blocks(comm, stored.blocks.pop(f"nodal/{name}"), domain.node_input, domain.n_global)
        getattr(s, name)[:] = rows.ravel()
    finite, cells = domain.cell_input[s.finite_cells], domain.m_global
    restore_elements(s.finite, from_blocks(comm, stored.blocks.pop("finite"), finite, cells))
    _restore_block_works(s, from_blocks(comm, stored.blocks.pop("block_work"), finite, cells))
    _restore_summed(stored.whole["summed"], dynamics)
    plain = json.loads(bytes(stored.whole.pop("plain")).decode())
    restore_state(owner, stored.whole | plain)
