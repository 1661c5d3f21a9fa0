"""Where tasks run that do not need one another: processes of this machine, ranks of an allocation, or any executor that
a user names.

    processes          of this machine
    mpi                mpirun -n 8 python -P -m mpi4py.futures -m rail_fem sweep ... --workers 7 --pool mpi
    package:callable   what makes a concurrent.futures.Executor of max_workers, such as executorlib:SingleNodeExecutor
"""

import contextlib
import multiprocessing
import os
import pkgutil
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, as_completed
from multiprocessing import forkserver
from typing import Final, TypeVar

from rail_fem.launcher import work_alone

Task = TypeVar("Task")
Result = TypeVar("Result")
PROCESSES: Final = "processes"
MPI: Final = "mpi"
TRIES = 3  # of a task alone whose process is ended from outside, and of all together without one more result
# of a worker: nothing is imported from the current folder, and as many threads as workers
WORKER = {"PYTHONSAFEPATH": "1"} | dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")


class PoolError(ValueError):
    """A pool that there is not; the message says why."""


class Lost(Exception):
    """In place of a task's result: its process was ended from outside in each of TRIES tries."""


def executor(workers: int, pool: str = PROCESSES, home: str = "") -> Executor:
    """`workers` processes, started afresh: a fork of a program with threads may hang. A script that calls this keeps
    what it does beneath `if __name__ == "__main__"`. home : module of the tasks, imported once for all processes.
    Errors: PoolError."""
    if pool == PROCESSES:
        return ProcessPoolExecutor(workers, multiprocessing.get_context(_method(home)), initializer=_begin)
    try:
        made = pkgutil.resolve_name("mpi4py.futures:MPIPoolExecutor" if pool == MPI else pool)(max_workers=workers)
    except (ImportError, AttributeError, TypeError, ValueError) as error:
        raise PoolError(
            f"--pool {pool}: {error}: give {PROCESSES}, {MPI}, or package:callable to be given max_workers"
        ) from error
    if not isinstance(made, Executor):
        raise PoolError(f"--pool {pool}: gives {type(made).__name__}, which is no concurrent.futures.Executor")
    return made


def each(
    work: Callable[[Task], Result], tasks: Sequence[Task], workers: int = 1, pool: str = PROCESSES
) -> Iterator[tuple[int, Result | Lost]]:
    """Number and result of each task, as it ends; one worker of PROCESSES is this process.

    A process that dies costs no task but its own one try: the others of its pool are given again, after TRIES in vain
    each alone, which tells the guilty one. Errors: PoolError, and what `work` raises.
    """
    if workers == 1 and pool == PROCESSES:
        yield from enumerate(map(work, tasks))
        return
    left, in_vain = list(range(len(tasks))), 0
    while left:
        alone = in_vain >= TRIES
        before, now = len(left), left[:1] if alone else left
        for number, result in _once(work, tasks, now, 1 if alone else workers, pool):
            left = [other for other in left if other != number]
            yield number, result
        in_vain = in_vain + 1 if len(left) == before else TRIES if alone else 0
        if in_vain == 2 * TRIES:
            yield left.pop(0), Lost(f"its process was ended from outside {TRIES} times (out of memory?)")
            in_vain = 0


def _once(
    work: Callable[[Task], Result], tasks: Sequence[Task], numbers: Sequence[int], workers: int, pool: str
) -> Iterator[tuple[int, Result]]:
    """Of these tasks, what a pool gives until it breaks."""
    with executor(workers, pool, getattr(work, "func", work).__module__) as running:
        futures: dict[Future, int] = {}
        with contextlib.suppress(BrokenExecutor):
            futures |= {running.submit(_alone, work, tasks[number]): number for number in numbers}
        for future in as_completed(futures):
            with contextlib.suppress(BrokenExecutor):
                yield futures[future], future.result()


def _alone(work: Callable[[Task], Result], task: Task) -> Result:
    work_alone()
    return work(task)


def _begin() -> None:
    """In a worker: ends with the program, and leaves the terminal's Ctrl-C to it. Its own parent is the server, which a
    worker would keep alive."""
    signal.signal(signal.SIGINT, lambda *_: None)
    threading.Thread(target=_end_with_program, daemon=True).start()


def _end_with_program() -> None:
    if (program := multiprocessing.parent_process()) is not None:
        program.join()
        os._exit(1)


def _method(home: str) -> str:
    """How a process is started: by a server that has imported the first one's `home`, where there is one."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return "spawn"
    own = {name: os.environ.get(name) for name in WORKER}
    os.environ.update(WORKER)
    try:
        multiprocessing.set_forkserver_preload([home] if home else [])
        forkserver.ensure_running()
    finally:
        for name, value in own.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
    return "forkserver"
