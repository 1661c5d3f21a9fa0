"""One timing job for `rail_fem.studies.kernel_speed`, on any number of ranks: a block crushed by its own speed, through
`Dynamics`.

    mpirun -n 2 python -m mpi4py -m rail_fem.studies.kernel_job '{"counts": [96, 40, 40], "steps": 30, "repeats": 5,
    "alone": false}'

alone: every rank runs a whole block of its own, without a word to the others but for a common start: what the machine
can do when all its cores work. Root prints one line of JSON.
"""

from __future__ import annotations

import json
import sys
import time
from typing import Any

import numpy as np
from mpi4py import MPI

from rail_fem.fe.domain import Domain
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.structure import Structure
from rail_fem.scene.steel import GRADES

EDGE, SPEED = 1e-3, 100.0  # edge of an element [m]; of the block's far end at the start [m/s]


class TimedStructure(Structure):
    """Adds up the time spent in the element kernel [s]."""

    kernel_time = 0.0

    def add_internal_force(self, dt: float) -> None:
        start = time.perf_counter()
        super().add_internal_force(dt)
        self.kernel_time += time.perf_counter() - start


def block(counts: tuple[int, int, int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points, cells and region of a block of cubes, and nothing else: a mesh generator's own memory is not measured
    here."""
    shape = tuple(n + 1 for n in counts)
    points = EDGE * np.indices(shape).reshape(3, -1).T
    first = np.arange(np.prod(shape)).reshape(shape)[:-1, :-1, :-1].ravel()
    ahead, aside, up = shape[1] * shape[2], shape[2], 1
    corners = np.array([0, ahead, ahead + aside, aside, up, ahead + up, ahead + aside + up, aside + up])
    return points, first[:, None] + corners, np.zeros(len(first), np.int8)


def crushed_block(comm: MPI.Comm, counts: tuple[int, int, int]) -> Dynamics:
    """Fixed at x = 0, every node moving there at a speed that grows along x. Collective on comm."""
    domain = Domain(comm, *(block(counts) if comm.rank == 0 else (None,) * 3))
    structure = TimedStructure(domain, [GRADES["Mn13"]])
    x = structure.x.reshape(-1, 3)[:, 0]
    structure.v.reshape(-1, 3)[:, 0] = -SPEED * x / (counts[0] * EDGE)
    fixed = np.repeat((x < 1e-9)[:, None], 3, axis=1)
    return Dynamics(structure, fixed=fixed)


def least_step_time(dynamics: Dynamics, steps: int, repeats: int) -> tuple[float, float]:
    """Seconds of a step, the least of the repeats, each the slowest rank's; and the kernel's seconds in that one.
    Collective on the world."""
    world, dt = MPI.COMM_WORLD, dynamics.stable_step()
    structure: Any = dynamics.structure  # a TimedStructure
    for _ in range(2):
        dynamics.step(dt)
    best = (np.inf, np.nan)
    for _ in range(repeats):
        structure.kernel_time = 0.0
        world.barrier()
        start = time.perf_counter()
        for _ in range(steps):
            dynamics.step(dt)
        mine = (time.perf_counter() - start) / steps
        best = min(
            best, (world.allreduce(mine, op=MPI.MAX), world.allreduce(structure.kernel_time / steps, op=MPI.MAX))
        )
    dynamics.check()
    return best


def exchange_time(domain: Domain, repeats: int, calls: int = 200) -> float:
    """Seconds of what a step exchanges: forces to owners, velocities to ghosts. Collective."""
    field, best = domain.nodal_vector(), np.inf
    for _ in range(repeats):
        domain.comm.barrier()
        start = time.perf_counter()
        for _ in range(calls):
            domain.sum_to_owner(field)
            domain.copy_to_ghosts(field)
        best = min(best, domain.comm.allreduce((time.perf_counter() - start) / calls, op=MPI.MAX))
    return best


def memory(row: str) -> float:
    """A row of /proc/self/status in bytes: VmRSS now, VmHWM at its peak; NaN where there is no such file."""
    try:
        with open("/proc/self/status", encoding="ascii") as status:
            return next(1024.0 * float(line.split()[1]) for line in status if line.startswith(row))
    except (OSError, StopIteration):
        return float("nan")


def array_bytes(*holders) -> float:
    """Bytes of the arrays that objects hold as attributes, each counted once however many views look at it.
    Rank-local."""
    owners = {}
    for value in (value for holder in holders for value in vars(holder).values()):
        while isinstance(value, np.ndarray) and isinstance(value.base, np.ndarray):
            value = value.base
        if isinstance(value, np.ndarray):
            owners[id(value)] = value.nbytes
    return float(sum(owners.values()))


def main(text: str) -> None:
    job = json.loads(text)
    world = MPI.COMM_WORLD
    dynamics = crushed_block(MPI.COMM_SELF if job["alone"] else world, tuple(job["counts"]))
    domain = dynamics.domain
    step, kernel = least_step_time(dynamics, job["steps"], job["repeats"])
    found = {
        "ranks": world.size,
        "elements": domain.m_global,
        "step": step,
        "kernel": kernel,
        "exchange": exchange_time(domain, job["repeats"]),
        "ghosts": world.allreduce(domain.n_nodes - domain.n_owned, op=MPI.MAX),
        "flowed": world.allreduce(float((dynamics.structure.finite.plastic_strain() > 0).sum()))
        / world.allreduce(float(len(domain.cells))),
        "arrays": world.allreduce(array_bytes(dynamics, domain, dynamics.structure, dynamics.structure.finite)),
        "memory": world.allreduce(memory("VmRSS")),
        "peak_memory": world.allreduce(memory("VmHWM")),
    }
    if world.rank == 0:
        print(json.dumps(found), flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
