"""Full state of a run in one file, in global numbering: a restart on the same number of ranks is bitwise the same, on another it is possible.

Root gathers and writes; the file appears whole or not at all, and the one before it is kept until then.
"""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np

from rail_fem.atomic import write_atomically
from rail_fem.fe.blocks import ElementBlocks
from rail_fem.fe.domain import Domain, raise_together
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.state import LANES, N_STATE

VERSION = 3
NODAL = ("x", "v", "force")


def gather_rows(comm, index: np.ndarray, rows: np.ndarray, total: int) -> np.ndarray | None:
    """Rows (k, m) of all ranks put at their global index (total, m). Root only, others get None. Collective."""
    parts = comm.gather((index, rows), root=0)
    if comm.rank != 0:
        return None
    out = np.zeros((total, rows.shape[1]))
    for where, values in parts:
        out[where] = values
    return out


def gather_nodes(domain: Domain, field: np.ndarray) -> np.ndarray | None:
    """Nodal vector (3 n_nodes,) -> (n_global, 3) by input node. Root only. Collective."""
    owned = domain.n_owned
    return gather_rows(domain.comm, domain.node_input[:owned], field.reshape(-1, 3)[:owned], domain.n_global)


def _element_state(blocks: ElementBlocks) -> np.ndarray:
    """State of each element (m, N_STATE), with its back stress (m, N_STATE + 6) where there is one."""
    state = blocks.read(0, N_STATE)
    return np.column_stack([state, blocks.in_cells(blocks.back.reshape(-1, 6, LANES))]) if blocks.back.size else state


def _restore_elements(blocks: ElementBlocks, rows: np.ndarray) -> None:
    padding, state = blocks.entries.copy(), blocks.in_blocks(rows)
    real = (blocks.cell_of >= 0).reshape(-1, 1, LANES)
    blocks.entries[:] = np.where(real, state[:, :N_STATE], padding)
    if blocks.back.size:
        blocks.back[:] = state[:, N_STATE:].ravel()


def save_checkpoint(path: Path, dynamics: Dynamics, extra: dict) -> None:
    """Write everything that the next step needs. extra : plain values of the caller (JSON). Collective. Errors: OSError on all ranks."""
    domain, s, comm = dynamics.domain, dynamics.structure, dynamics.comm
    arrays = {name: gather_nodes(domain, getattr(s, name)) for name in NODAL}
    arrays["finite"] = gather_rows(comm, domain.cell_input[s.finite_cells], _element_state(s.finite), domain.m_global)
    arrays["works"] = gather_rows(comm, np.array([comm.rank]), np.array([*s.work, *dynamics.works, dynamics.contact_work])[None], comm.size)
    block_work = comm.gather(s.block_work, root=0)
    arrays["block_work"] = np.concatenate(block_work) if comm.rank == 0 else None
    plain = {
        "version": VERSION, "time": dynamics.time, "step_count": dynamics.step_count, "dt": dynamics.dt, "damping": s.damping,
        "friction_work": dynamics.friction_work, "drive_work": dynamics.drive_work, "mass_damping": dynamics.mass_damping,
        "supports": dynamics.supports.state(), "extra": extra,
    }  # fmt: skip
    if dynamics.contact is not None:
        contact_arrays, plain["contact"] = dynamics.contact.state()
        arrays |= {f"contact_{k}": v for k, v in contact_arrays.items()}
    fault = None
    if comm.rank == 0:
        try:
            write_atomically(Path(path), lambda tmp: _write(tmp, arrays, plain))
        except OSError as error:
            fault = f"cannot write the restart file {path}: {error}"
    raise_together(comm, fault)


def _write(path: Path, arrays: dict, plain: dict) -> None:
    with path.open("wb") as stream:
        np.savez(stream, plain=np.frombuffer(json.dumps(plain).encode(), np.uint8), **arrays)


def _restore_works(works: np.ndarray, block_work: np.ndarray, dynamics: Dynamics) -> None:
    """Works so far: each rank its own; on another number of ranks root takes all, and those of blocks lose their place."""
    s, comm, k = dynamics.structure, dynamics.comm, dynamics.structure.block_work.shape[1]
    sizes = comm.allgather(len(s.block_work))
    if len(works) == comm.size and sum(sizes) == len(block_work):
        mine, first = works[comm.rank], sum(sizes[: comm.rank])
        s.block_work[:] = block_work[first : first + sizes[comm.rank]]
    else:
        mine = works.sum(axis=0) if comm.rank == 0 else np.zeros(works.shape[1])
        s.block_work[:] = 0.0
        s.block_work[:1] = mine[:k]
    dynamics.works[:], dynamics.contact_work = mine[k : k + 3], float(mine[-1])


def load_checkpoint(path: Path, dynamics: Dynamics) -> dict:
    """Restore a state saved by `save_checkpoint` into the same bodies; returns `extra`. Collective. Errors: ValueError on all ranks."""
    domain, s, comm = dynamics.domain, dynamics.structure, dynamics.comm
    payload = comm.bcast(Path(path).read_bytes() if comm.rank == 0 else None)
    with np.load(io.BytesIO(payload)) as stored:
        arrays = dict(stored)
    plain = json.loads(bytes(arrays.pop("plain")).decode())
    fault = None
    if plain["version"] != VERSION:
        fault = f"{path}: restart file of version {plain['version']}, this program reads {VERSION}: start afresh with --overwrite"
    elif arrays["x"].shape[0] != domain.n_global or arrays["finite"].shape[0] != domain.m_global:
        fault = f"{path}: holds {arrays['x'].shape[0]} nodes and {arrays['finite'].shape[0]} elements, the mesh has {domain.n_global} and {domain.m_global}"
    raise_together(comm, fault)
    for name in NODAL:
        getattr(s, name)[:] = arrays[name][domain.node_input].ravel()
    s.force[3 * domain.n_owned :] = 0.0
    _restore_elements(s.finite, arrays["finite"][domain.cell_input[s.finite_cells]])
    _restore_works(arrays["works"], arrays["block_work"], dynamics)
    for name in ("time", "step_count", "dt", "friction_work", "drive_work", "mass_damping"):
        setattr(dynamics, name, plain[name])
    s.damping = plain["damping"]
    dynamics.supports.restore(plain["supports"])
    if dynamics.contact is not None:
        dynamics.contact.restore({k[8:]: v for k, v in arrays.items() if k.startswith("contact_")}, plain["contact"])
    return plain["extra"]
