"""Jobs on several MPI ranks, for the tests that compare what they leave."""

import contextlib
import io
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from rail_fem.processes.launcher import mpi_command, rank_environment

ROOT = Path(__file__).resolve().parents[1]
HANGS = 300  # a process that takes so long [s] hangs; nothing is judged by it


def run_on_ranks(ranks: int, *words: object, **variables: str) -> subprocess.CompletedProcess:
    """What `python -m mpi4py WORDS` answers on `ranks` ranks in the repository's root, with these variables beside the
    environment. A job that hangs ends the test."""
    return subprocess.run(
        [*mpi_command(ranks), sys.executable, "-m", "mpi4py", *map(str, words)],
        cwd=ROOT,
        env=rank_environment() | {"PYTHONPATH": str(ROOT)} | variables,
        capture_output=True,
        text=True,
        timeout=HANGS,
        check=False,
        stdin=subprocess.DEVNULL,
    )


def printed_here(main: Callable, *arguments: object) -> str:
    """What the same job's `main` prints on one rank, in this process: no start-up is paid for."""
    with contextlib.redirect_stdout(io.StringIO()) as said:
        main(*arguments)
    return said.getvalue()


def printed_by_ranks(ranks: int, *words: object, **options) -> str:
    """Standard output of a job that must end well."""
    done = run_on_ranks(ranks, *words, **options)
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


def arrays_of_ranks(ranks: int, out: Path, *words: object, **options) -> dict[str, np.ndarray]:
    """Arrays that a job which must end well has written to `out`, an .npz file."""
    printed_by_ranks(ranks, *words, **options)
    with np.load(out) as saved:
        return dict(saved)
