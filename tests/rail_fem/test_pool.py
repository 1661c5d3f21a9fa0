"""Tasks on a pool: each has its result, whatever dies."""

import os
import signal
import sys
import time
from pathlib import Path

import pytest

from rail_fem.processes.pool import Lost, Pool, PoolError, Workers, each, executor
from rail_fem.processes.stopping import ENDING


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
    assert sorted(each(square, [3.0, 1.0, 2.0], Workers(2, pool))) == [(0, 9.0), (1, 1.0), (2, 4.0)]


def test_a_process_that_is_killed_costs_no_task_its_result(tmp_path):
    tasks = [(tmp_path, number) for number in range(5)]
    assert sorted(each(fatal_once, tasks, Workers(2))) == [(number, number) for number in range(5)]


def dask(max_workers: int):
    """As docs/start.md has it."""
    from distributed import Client, LocalCluster

    return Client(LocalCluster(n_workers=max_workers, threads_per_worker=1, dashboard_address=None)).get_executor()


@pytest.fixture
def no_cluster_left():
    yield
    if distributed := sys.modules.get("distributed"):
        client = distributed.default_client()
        client.cluster.close()
        client.close()


@pytest.mark.parametrize("pool", ["executorlib:SingleNodeExecutor", f"{__name__}:dask"], ids=["executorlib", "dask"])
def test_a_task_is_given_again_where_a_worker_of_another_engine_dies(pool, tmp_path, monkeypatch, no_cluster_left):
    pytest.importorskip("executorlib" if "executorlib" in pool else "distributed")
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[2]))  # of their processes
    tasks = [(tmp_path, number) for number in range(4)]
    assert sorted(each(fatal_once, tasks, Workers(2, pool))) == [(number, number) for number in range(4)]


def test_what_a_task_raises_ends_the_work_whatever_the_engine():
    for pool in ("processes", "concurrent.futures:ThreadPoolExecutor"):
        with pytest.raises(TypeError):
            list(each(square, [1.0, "one"], Workers(2, pool)))


def test_a_task_that_kills_its_process_each_time_is_told_and_costs_no_other():
    found = dict(each(fatal, range(4), Workers(2)))
    assert isinstance(found.pop(1), Lost) and found == {0: 0, 2: 2, 3: 3}


def test_a_worker_takes_in_no_stranger_and_one_thread():
    assert set(dict(each(where, range(2), Workers(2))).values()) == {(False, "1", False)}


def slow_once(number: int) -> int:
    """Task 1 never ends."""
    while number == 1:
        time.sleep(0.01)
    return number


@pytest.mark.parametrize("count", [1, 2])
def test_a_task_that_takes_too_long_is_told_and_costs_no_other(count):
    found = dict(each(slow_once, range(3), Workers(count, limit=0.5)))
    assert isinstance(found[1], Lost) and "took longer than 0.5 s" in str(found[1]) and (found[0], found[2]) == (0, 2)


def number_and_process(number: int) -> tuple[int, int]:
    return number, os.getpid()


def test_workers_stay_from_call_to_call_and_are_made_anew_where_one_dies(tmp_path):
    with Pool(Workers(2), __name__) as pool:
        first, second = (pool.map(number_and_process, range(8)) for _ in range(2))
        assert [number for number, _ in first] == list(range(8))
        assert {process for _, process in second} & {process for _, process in first}
        assert pool.map(fatal_once, [(tmp_path, number) for number in range(4)]) == [0, 1, 2, 3]
        with pytest.raises(Lost, match="ended from outside 3 times"):
            pool.map(fatal, range(4))
        assert pool.map(square, [3.0]) == [9.0]


@pytest.mark.parametrize("pool", ["slurm", "rail_fem.nothing:Pool", "math:sqrt", "builtins:dict"])
def test_a_pool_that_there_is_not_is_refused_by_its_name(pool):
    with pytest.raises(PoolError, match=f"--pool {pool}"):
        executor(2, pool)
