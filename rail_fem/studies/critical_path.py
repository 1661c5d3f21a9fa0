"""Where ranks lose: the critical path of a step by processor time, which other processes on a machine do not lengthen.

    mpirun -n 2 python -m mpi4py -m rail_fem.studies.critical_path --size 2 --steps 300

A step is work between messages. All ranks must have come before a message ends, so that a stretch of work takes what
the slowest rank takes, and a message what the rank takes in it that came last and need not wait. The steps of the pass
shared by the ranks are taken in turn with those of the whole pass on each rank, without a word to the others. Steps
are sorted by the messages that they have (plain ones, with a search, with a row); of each kind medians count, so that
what disturbs single steps does not.

Prints a Markdown table of plain steps and the efficiency: the work of a step on one rank over ranks times the critical
path. The options are those of rail_fem.studies.step_shares.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import defaultdict
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from mpi4py import MPI

from rail_fem.fe.domain import Domain
from rail_fem.fe.run import Run
from rail_fem.output.markdown import markdown_table
from rail_fem.studies.step_shares import arguments_of, pass_at_rest

END = "end of the step"
TURN = 30  # steps of one pass before those of the other


class Stretch(NamedTuple):
    """Work of a rank up to a message, and what it takes in the message [s of the processor]."""

    message: str
    work: float
    inside: float


class Log:
    """Stretches of a rank, step by step."""

    def __init__(self) -> None:
        self.steps: list[list[Stretch]] = []
        self._since = 0.0

    def begin(self) -> None:
        self.steps.append([])
        self._since = time.thread_time()

    def end(self) -> None:
        self.steps[-1].append(Stretch(END, time.thread_time() - self._since, 0.0))

    def message(self, name: str, send: Callable) -> Callable:
        """The message, logged."""

        def run(*arguments, **options):
            start = time.thread_time()
            try:
                return send(*arguments, **options)
            finally:
                now = time.thread_time()
                self.steps[-1].append(Stretch(name, start - self._since, now - start))
                self._since = time.thread_time()

        return run


class Logged(MPI.Intracomm):
    """A communicator whose collective calls are logged."""

    log: Log

    def Allreduce(self, *arguments, **options):
        return self.log.message("sum over the ranks", super().Allreduce)(*arguments, **options)

    def allreduce(self, *arguments, **options):
        return self.log.message("sum of a few numbers", super().allreduce)(*arguments, **options)

    def allgather(self, *arguments, **options):
        return self.log.message("words of all ranks", super().allgather)(*arguments, **options)


def log_messages(run: Run, log: Log) -> None:
    """Log the messages of this pass from now on."""
    d, comm = run.dynamics, Logged(run.comm)
    Logged.log = log
    d.comm = d.contact.comm = comm
    if d.window is not None:
        d.window.comm = comm
    of_ghosts: tuple[tuple[str, Callable], ...] = (
        ("sum_to_owner", Domain.sum_to_owner),
        ("copy_to_ghosts", Domain.copy_to_ghosts),
    )
    for name, send in of_ghosts:
        setattr(d.domain, name, log.message(name, send.__get__(d.domain)))


class Path(NamedTuple):
    """Of steps with the same messages, medians [s]: how many steps; message at the end of each stretch; work of each
    rank (ranks, k), of the slowest (k,), and in the message (k,)."""

    steps: int
    messages: tuple[str, ...]
    work: np.ndarray
    slowest: np.ndarray
    inside: np.ndarray

    @property
    def length(self) -> float:
        """Of a step [s]: the slowest rank's work and the messages."""
        return float(self.slowest.sum() + self.inside.sum())


def critical_paths(logs: list[list[list[Stretch]]]) -> list[Path]:
    """Paths of each kind of step, the most frequent first. logs : of each rank, of each step, its stretches. Errors:
    ValueError where ranks have not the same messages."""
    kinds: dict[tuple[str, ...], list[np.ndarray]] = defaultdict(list)
    for of_ranks in zip(*logs):
        names = {tuple(s.message for s in stretches) for stretches in of_ranks}
        if len(names) > 1:
            raise ValueError(f"ranks have not the same messages in a step: {' / '.join(map(str, names))}")
        kinds[names.pop()].append(np.array([[[s.work, s.inside] for s in stretches] for stretches in of_ranks]))
    out = []
    for messages, steps in sorted(kinds.items(), key=lambda kind: -len(kind[1])):
        times = np.array(steps)  # (steps, ranks, k, 2)
        slowest, inside = np.median(times[..., 0].max(axis=1), axis=0), np.median(times[..., 1].min(axis=1), axis=0)
        out.append(Path(len(steps), messages, np.median(times[..., 0], axis=0), slowest, inside))
    return out


def measure(arguments: argparse.Namespace) -> tuple[list[Path], list[Path]]:
    """Paths of the pass shared by the ranks, and of the whole pass on each of them. Collective."""
    world = MPI.COMM_WORLD
    shared, alone = pass_at_rest(arguments, world), pass_at_rest(arguments, MPI.COMM_SELF)
    logs = {run: Log() for run in (shared, alone)}
    for run in (shared, alone):
        for _ in range(arguments.before):
            run._step()
    log_messages(shared, logs[shared])
    for _ in range(0, arguments.steps, TURN):
        for run in (shared, alone):
            world.barrier()
            for _ in range(TURN):
                logs[run].begin()
                run._step()
                logs[run].end()
    return critical_paths(world.allgather(logs[shared].steps)), critical_paths([logs[alone].steps])


def mean_length(paths: list[Path]) -> float:
    """Of a step, over all kinds [s]."""
    return sum(path.steps * path.length for path in paths) / sum(path.steps for path in paths)


def report(shared: list[Path], alone: float, ranks: int) -> str:
    """alone : mean work of a step on one rank [s], mean of the ranks"""
    plain, length = shared[0], mean_length(shared)
    rows = [
        [
            name,
            *(f"{1e6 * work:.1f}" for work in plain.work[:, k]),
            f"{1e6 * plain.slowest[k]:.1f}",
            f"{1e6 * inside:.1f}",
        ]
        for k, (name, inside) in enumerate(zip(plain.messages, plain.inside))
    ]
    together = [f"{1e6 * work:.1f}" for work in plain.work.sum(axis=1)]
    rows.append(["together", *together, f"{1e6 * plain.slowest.sum():.1f}", f"{1e6 * plain.inside.sum():.1f}"])
    head = ["work up to [us]", *(f"rank {rank}" for rank in range(ranks)), "slowest", "in the message"]
    told = (
        f"{plain.steps} of {sum(path.steps for path in shared)} steps are plain. A step of all kinds: "
        f"{1e6 * length:.0f}"
        f" us on {ranks} rank(s), {1e6 * alone:.0f} us on one, efficiency {alone / (ranks * length):.1%}; without what"
        f" is waited for the slowest rank {alone / (ranks * length_of_work(shared)):.1%}"
    )
    return "\n".join([*markdown_table(head, rows), "", told])


def length_of_work(paths: list[Path]) -> float:
    """Mean work of a rank in a step, over all kinds [s]."""
    return sum(path.steps * path.work.sum(axis=1).mean() for path in paths) / sum(path.steps for path in paths)


def main() -> None:
    shared, alone = measure(arguments_of(*sys.argv[1:]))
    world = MPI.COMM_WORLD
    mine = world.allreduce(mean_length(alone)) / world.size
    if world.rank == 0:
        print(report(shared, mine, world.size))


if __name__ == "__main__":
    main()
