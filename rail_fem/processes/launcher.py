"""Start on several ranks, and know whether this process was started so, without importing MPI when it was not.

`python -m rail_fem.processes.launcher 2` prints the mpirun call with the options that this machine needs.
"""

import functools
import os
import pickle
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

Answer = TypeVar("Answer")
ROOT_SPEAKS_FIRST = 2.0  # seconds
TOGETHER, LOOK = 10.0, 0.01  # how long ranks wait for each other at the end, and how often they look [s]
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")  # of a worker or rank
LAUNCHER_VARIABLES = ("OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_SIZE", "PMI_RANK")


@functools.cache
def _world():
    """MPI's world communicator when a launcher started this process, else None."""
    if not any(name in os.environ for name in LAUNCHER_VARIABLES):
        return None
    from mpi4py import MPI

    return MPI.COMM_WORLD


def rank() -> int:
    """Number of this process, 0 without a launcher. Rank-local."""
    world = _world()
    return world.rank if world else 0


def rank_count() -> int:
    """How many processes were started together. Replicated."""
    world = _world()
    return world.size if world else 1


def work_alone() -> None:
    """From now on this process takes part in nothing that ranks do together: it works on a task of a pool, or gives
    such tasks to the other ranks."""
    for name in LAUNCHER_VARIABLES:
        os.environ.pop(name, None)
    _world.cache_clear()


def on_root(action: Callable[[], Answer], comm: Any = None) -> Answer:
    """Run `action` on rank 0 of an MPI communicator only, None for the world's; its answer, or its exception of
    whatever kind, reaches every rank: none waits for one that has gone. Collective."""
    world = _world() if comm is None else comm
    if world is None:
        return action()
    answer, failure = None, None
    if world.rank == 0:
        try:
            answer = action()
        except Exception as error:
            failure = error
    answer, sent = world.bcast((answer, _as_message(failure)))
    if failure or sent:
        raise failure or sent
    return answer


def dealt_out(actions: Sequence[Callable[[], Answer]]) -> list[Answer]:
    """Run each of `actions`, the same on every rank, on one of the ranks, in turn; all answers in order on rank 0, none
    on the others. An exception of any reaches every rank. Collective."""
    world = _world()
    if world is None:
        return [action() for action in actions]
    answers: list[Answer] = []
    failure = None
    try:
        answers = [action() for action in actions[world.rank :: world.size]]
    except Exception as error:
        failure = error
    for found in world.allgather(_as_message(failure)):
        if found:
            raise found
    if (shares := world.gather(answers)) is None:
        return []
    return [shares[number % world.size][number // world.size] for number in range(len(actions))]


def _as_message(failure: Exception | None) -> Exception | None:
    """The exception itself where it survives pickling, else a RuntimeError with its words."""
    try:
        return pickle.loads(pickle.dumps(failure))
    except Exception:
        return RuntimeError(f"{type(failure).__name__}: {failure}")


def let_root_end_first() -> None:
    """On other ranks, wait long enough for the root to say what happened and to end the job, which ends this rank
    too."""
    if rank() != 0:
        time.sleep(ROOT_SPEAKS_FIRST)


def end_together() -> None:
    """End MPI once all ranks have come here, so that a rank may end non-zero without MPI's alarm. Ranks that wait in
    vain leave it as it is. Collective."""
    world = _world()
    if world is None:
        return
    from mpi4py import MPI

    all_here, until = world.Ibarrier(), time.monotonic() + TOGETHER
    while not all_here.Test():
        if time.monotonic() > until:
            return
        time.sleep(LOOK)
    MPI.Finalize()


def mpi_command(ranks: int) -> list[str]:
    """The mpirun call for `ranks` processes on this machine, to be followed by the program.

    An mpirun beside the interpreter (MPICH of the package index) is of the MPI that this Python imports, whatever PATH
    holds. Open MPI counts cores, not hardware threads, refuses root, binds ranks to cores that other jobs may use, and
    looks for networks that ranks of one machine do not need (a second at each start and end of one with libfabric); the
    options undo that.
    Errors: FileNotFoundError without mpirun.
    """
    beside = shutil.which("mpirun", path=os.path.dirname(sys.executable))
    if beside is None and shutil.which("mpirun") is None:
        raise FileNotFoundError("mpirun not found: sudo apt-get install openmpi-bin")
    mpirun = beside or "mpirun"
    command = [mpirun, "-n", str(ranks)]
    about = subprocess.run([mpirun, "--version"], capture_output=True, text=True, timeout=60).stdout
    if "Open MPI" in about or "open-mpi" in about:
        command += ["--oversubscribe", "--bind-to", "none", "--mca", "pml", "ob1", "--mca", "btl", "^tcp,ofi"]
        command += ["--allow-run-as-root"] if os.geteuid() == 0 else []
    return command


def rank_environment() -> dict[str, str]:
    """Environment for mpirun: this one, one thread for each rank, without the variables of a surrounding MPI program.

    A program that has initialised MPI hands such variables on to its children, also those that os.environ does not
    know; mpirun would take itself for a rank of that program and end without a word.
    """
    from geometry.meshing.gmsh_process import without_mpi  # here: `doctor` needs this file also where NumPy is broken

    return without_mpi(os.environ) | ONE_THREAD


if __name__ == "__main__":
    print(" ".join(mpi_command(int(sys.argv[1]))))
