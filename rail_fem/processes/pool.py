"""Where tasks run that do not need one another: processes of this machine, ranks of an allocation, or any executor that
a user names.

    processes          of this machine
    mpi                mpirun -n 8 python -P -m mpi4py.futures -m rail_fem sweep ... --workers 7 --pool mpi
    package:callable   what makes a concurrent.futures.Executor of max_workers, such as executorlib:SingleNodeExecutor
"""

import contextlib
import functools
import math
import multiprocessing
import os
import pkgutil
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import forkserver
from typing import Any, Final, TypeVar

from rail_fem.processes.launcher import ONE_THREAD, work_alone

Task = TypeVar("Task")
Result = TypeVar("Result")
PROCESSES: Final = "processes"
MPI: Final = "mpi"
# of a worker: nothing is imported from the current folder, and as many threads as workers
WORKER = {"PYTHONSAFEPATH": "1"} | ONE_THREAD


class PoolError(ValueError):
    """A pool that there is not; the message says why."""


class Lost(Exception):
    """In place of a task's result: its process was ended from outside in each of its tries, or it took too long."""


@dataclass(frozen=True)
class Workers:
    """count : of tasks at a time, by 1 of PROCESSES in this process;  pool : where;  tries : of a task alone whose
    process is ended from outside, and of all together without one more result;  limit : of a task, where it runs in
    the main thread of its process [s]"""

    count: int = 1
    pool: str = PROCESSES
    tries: int = 3
    limit: float = math.inf


def executor(workers: int, pool: str = PROCESSES, home: str = "") -> Executor:
    """`workers` processes, started afresh: a fork of a program with threads may hang. A script that calls this keeps
    what it does beneath `if __name__ == "__main__"`. home : module of the tasks, imported once for all processes.
    Errors: PoolError."""
    if pool == PROCESSES:
        return ProcessPoolExecutor(workers, multiprocessing.get_context(_method(home)), initializer=_begin)
    try:
        made = pkgutil.resolve_name("mpi4py.futures:MPIPoolExecutor" if pool == MPI else pool)(max_workers=workers)
    except (ImportError, AttributeError, TypeError, ValueError, OSError) as error:
        raise PoolError(
            f"--pool {pool}: {error}: give {PROCESSES}, {MPI}, or package:callable to be given max_workers"
        ) from error
    if not isinstance(made, Executor):
        raise PoolError(f"--pool {pool}: gives {type(made).__name__}, which is no concurrent.futures.Executor")
    return made


class Pool:
    """Workers that stay from call to call and are made anew where one dies, which costs no task but its own one try:
    the others are given again, after Workers.tries in vain each alone, which tells the guilty one.
    home : module of the tasks, imported once for all processes. Errors: PoolError, and what a task raises."""

    def __init__(self, workers: Workers, home: str = ""):
        self.workers, self.home = workers, home
        self._running: tuple[int, Executor] | None = None

    def __enter__(self) -> "Pool":
        return self

    def __exit__(self, *_: object) -> None:
        if self._running is not None:
            self._running[1].shutdown()
        self._running = None

    def map(self, work: Callable, *of: Iterable) -> list:
        """Results for the first of each of `of`, the second of each, ... in this order. Errors: Lost."""
        tasks, found = list(zip(*of, strict=True)), {}
        for number, result in self.each(functools.partial(_spread, work), tasks):
            if isinstance(result, Lost):
                raise result
            found[number] = result
        return [found[number] for number in range(len(tasks))]

    def each(self, work: Callable[[Task], Result], tasks: Sequence[Task]) -> Iterator[tuple[int, Result | Lost]]:
        """Number and result of each task, as it ends."""
        asked = self.workers
        if asked.count == 1 and asked.pool == PROCESSES:
            yield from ((number, _in_time(work, asked.limit, task)) for number, task in enumerate(tasks))
            return
        left, in_vain = list(range(len(tasks))), 0
        while left:
            alone = in_vain >= asked.tries
            before, now = len(left), left[:1] if alone else left
            for number, result in self._once(work, tasks, now, 1 if alone else asked.count):
                left = [other for other in left if other != number]
                yield number, result
            in_vain = in_vain + 1 if len(left) == before else asked.tries if alone else 0
            if in_vain == 2 * asked.tries:
                yield left.pop(0), Lost(f"its process was ended from outside {asked.tries} times (out of memory?)")
                in_vain = 0

    def _once(
        self, work: Callable[[Task], Result], tasks: Sequence[Task], numbers: Sequence[int], count: int
    ) -> Iterator[tuple[int, Result | Lost]]:
        """Of these tasks, what `count` workers give until one dies."""
        if self._running is None or self._running[0] != count:
            self.__exit__()
            self._running = count, executor(count, self.workers.pool, self.home)
        futures: dict[Future, int] = {}
        try:
            try:
                for number in numbers:
                    futures[self._running[1].submit(_alone, work, self.workers.limit, tasks[number])] = number
            except BrokenExecutor:
                self.__exit__()
            for future in as_completed(futures):
                try:
                    yield futures[future], future.result()
                except Exception as error:  # whatever a stranger's executor raises where a worker of it dies
                    of_task = getattr(error, "of_task", False) or self.workers.pool in (PROCESSES, MPI)
                    if of_task and not isinstance(error, BrokenExecutor):
                        raise
                    self.__exit__()
        finally:
            for future in futures:  # here, for neither dask's nor parsl's executor cancels at its end
                with contextlib.suppress(NotImplementedError):  # parsl
                    future.cancel()


def each(
    work: Callable[[Task], Result], tasks: Sequence[Task], workers: Workers
) -> Iterator[tuple[int, Result | Lost]]:
    """As Pool.each, by workers that end with the tasks."""
    with Pool(workers, getattr(work, "func", work).__module__) as pool:
        yield from pool.each(work, tasks)


def _spread(work: Callable, task: tuple) -> Any:
    return work(*task)


def _alone(work: Callable[[Task], Result], limit: float, task: Task) -> Result | Lost:
    work_alone()
    try:
        return _in_time(work, limit, task)
    except Exception as error:
        error.of_task = True  # type: ignore[attr-defined]
        raise


def _in_time(work: Callable[[Task], Result], limit: float, task: Task) -> Result | Lost:
    """A result, or Lost where it takes longer than `limit` [s]; in a thread there is no clock to stop it."""
    if limit == math.inf or threading.current_thread() is not threading.main_thread():
        return work(task)

    def end(*_: object) -> None:
        raise TimeoutError(words)

    words = f"took longer than {limit:g} s"
    before = signal.signal(signal.SIGALRM, end)
    signal.setitimer(signal.ITIMER_REAL, limit)
    try:
        return work(task)
    except TimeoutError as error:
        if str(error) != words:
            raise
        return Lost(words)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


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
