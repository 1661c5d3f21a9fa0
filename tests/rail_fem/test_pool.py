"""Tasks on a pool: each has its result, whatever dies."""

import os
import signal
from pathlib import Path

import pytest

from rail_fem.pool import Lost, PoolError, each, executor
from rail_fem.stopping import ENDING


def square(number: float) -> float:
    return number**2


def fatal_once(task: tuple[Path, int]) -> int:
    """The process of task 2 is killed the first time."""
    folder, number = task
    mark = folder / "killed"
    if number == 2 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def fatal(number: int) -> int:
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def where(_: int) -> tuple:
    """What a worker is: whether it takes in the current folder, its threads, what it hears."""
    import sys

    return "" in sys.path, os.environ["OMP_NUM_THREADS"], signal.getsignal(ENDING[0]) is signal.SIG_DFL


@pytest.mark.parametrize("pool", ["processes", "concurrent.futures:ThreadPoolExecutor"])
def test_each_task_has_its_result(pool):
    assert sorted(each(square, [3.0, 1.0, 2.0], 2, pool)) == [(0, 9.0), (1, 1.0), (2, 4.0)]


def test_a_process_that_is_killed_costs_no_task_its_result(tmp_path):
    tasks = [(tmp_path, number) for number in range(5)]
    assert sorted(each(fatal_once, tasks, 2)) == [(number, number) for number in range(5)]


def test_a_task_that_kills_its_process_each_time_is_told_and_costs_no_other():
    found = dict(each(fatal, range(4), 2))
    assert isinstance(found.pop(1), Lost) and found == {0: 0, 2: 2, 3: 3}


def test_a_worker_takes_in_no_stranger_and_one_thread():
    assert set(dict(each(where, range(2), 2)).values()) == {(False, "1", False)}


@pytest.mark.parametrize("pool", ["slurm", "rail_fem.nothing:Pool", "math:sqrt", "builtins:dict"])
def test_a_pool_that_there_is_not_is_refused_by_its_name(pool):
    with pytest.raises(PoolError, match=f"--pool {pool}"):
        executor(2, pool)
