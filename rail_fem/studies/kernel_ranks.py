"""Ranks against one, and memory: starts `rail_fem.studies.kernel_job` under mpirun and compares what it reports.
Imports no MPI itself."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import dataclass
from functools import partial

from rail_fem.launcher import mpi_command, rank_environment

LONGEST = 600  # of a job [s]
TINY = (2, 2, 2)


def run_job(
    ranks: int, counts: tuple[int, int, int], steps: int, repeats: int, alone: bool = False
) -> dict[str, float]:
    """What a job of `ranks` ranks prints. Errors: RuntimeError with the job's last words, FileNotFoundError without
    mpirun."""
    job = json.dumps({"counts": counts, "steps": steps, "repeats": repeats, "alone": alone})
    command = [*mpi_command(ranks), sys.executable, "-P", "-m", "mpi4py", "-m", "rail_fem.studies.kernel_job", job]
    answer = subprocess.run(
        command, capture_output=True, text=True, timeout=LONGEST, env=rank_environment(), stdin=subprocess.DEVNULL
    )
    if answer.returncode != 0:
        raise RuntimeError(f"{' '.join(command)} ended with {answer.returncode}: {answer.stderr.strip()[-500:]}")
    return json.loads(answer.stdout.splitlines()[-1])


@dataclass(frozen=True)
class RankStudy:
    """Fastest jobs of several rounds: the problem on one rank, on all ranks together, and a share of it on each rank
    alone."""

    one: dict[str, float]
    shared: dict[str, float]
    alone: dict[str, float]

    @property
    def efficiency(self) -> float:
        """Time on one rank over ranks times the time on all."""
        return self.one["step"] / (self.shared["ranks"] * self.shared["step"])

    @property
    def machine(self) -> float:
        """The same for ranks that do not communicate: what the machine itself loses when all cores work."""
        return self.one["step"] / (self.alone["ranks"] * self.alone["step"])


def study_ranks(ranks: int, counts: tuple[int, int, int], steps: int, repeats: int, rounds: int) -> RankStudy:
    """Rounds of the three jobs in turn, so that a slow spell of the machine hits all alike; counts[0] is divided by the
    ranks.

    Errors: ValueError where it cannot be, and those of `run_job`.
    """
    if counts[0] % ranks:
        raise ValueError(f"{counts[0]} elements along x cannot be shared evenly by {ranks} ranks: choose a multiple")
    share = (counts[0] // ranks, counts[1], counts[2])
    trials = {
        "one": partial(run_job, 1, counts, steps, repeats),
        "shared": partial(run_job, ranks, counts, steps, repeats),
        "alone": partial(run_job, ranks, share, steps, repeats, True),
    }
    found: dict[str, list[dict[str, float]]] = {name: [] for name in trials}
    for _ in range(rounds):
        for name, trial in trials.items():
            found[name].append(trial())
    return RankStudy(**{name: min(runs, key=lambda run: run["step"]) for name, runs in found.items()})


def memory_per_element(counts: tuple[int, int, int]) -> dict[str, float]:
    """Bytes per element of a run on one rank: `arrays` of the solver; `memory` while it steps and `peak_memory`, beyond
    a run of 8 elements.

    A first job fills the cache of compiled kernels, for a compiler in the process would weigh more than the elements.
    """
    run_job(1, TINY, 1, 1)
    empty, big = run_job(1, TINY, 1, 1), run_job(1, counts, 1, 1)
    beyond = {
        name: (big[name] - empty[name]) / (big["elements"] - empty["elements"]) for name in ("memory", "peak_memory")
    }
    return {"elements": big["elements"], "arrays": big["arrays"] / big["elements"], **beyond}
