import os
import subprocess
import sys

import pytest

from rail_fem.processes import launcher
from tests.ranks import HANGS

BROADCAST = """
from rail_fem.processes import launcher
calls = []
value = launcher.on_root(lambda: calls.append(1) or launcher.rank_count())
def refuse():
    raise ValueError("folder in use")
try:
    launcher.on_root(refuse)
    text = "nothing"
except ValueError as error:
    text = str(error)
class Odd(Exception):
    def __init__(self, what, where):
        super().__init__(f"{what} at {where}")
def stumble():
    raise Odd("stumbled", 3)
try:
    launcher.on_root(stumble)
except Exception as error:
    text += ", " + str(error).rpartition("Odd: ")[2]
dealt = launcher.dealt_out([lambda number=number: (number, launcher.rank()) for number in range(4)])
try:
    launcher.dealt_out([int, stumble, int])
except Exception as error:
    text += " again" * ("stumbled at 3" in str(error))
from mpi4py import MPI
seen = MPI.COMM_WORLD.gather((value, len(calls), text, dealt))
if launcher.rank() == 0:
    print(seen)
"""


def run(command, **options):
    """MPI, once another test has started it in this process, leaves its variables in the C environment; os.environ is
    as the user's was."""
    return subprocess.run(command, env=dict(os.environ), capture_output=True, text=True, timeout=HANGS, **options)


def test_without_a_launcher_there_is_one_rank_and_no_mpi():
    code = (
        "import sys; from rail_fem.processes import launcher; print(launcher.rank(), launcher.rank_count(),"
        " launcher.on_root(lambda: 5), 'mpi4py' in sys.modules)"
    )
    assert run([sys.executable, "-c", code], check=True).stdout.split() == ["0", "1", "5", "False"]


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [1, 2, 3])
def test_roots_answer_and_roots_fault_reach_every_rank(ranks):
    """Also a fault that cannot be pickled: a rank that waited for it would hang the job. What is dealt out is done once
    each, in turn, and comes to the root in order; one rank's fault reaches all."""
    pytest.importorskip("mpi4py")
    command = [*launcher.mpi_command(ranks), sys.executable, "-m", "mpi4py", "-c", BROADCAST]
    answer = run(command)
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout.strip() == str(
        [
            (
                ranks,
                int(rank == 0),
                "folder in use, stumbled at 3 again",
                [(number, number % ranks) for number in range(4)] if rank == 0 else [],
            )
            for rank in range(ranks)
        ]
    )


@pytest.mark.mpi
@pytest.mark.parametrize("guilty", [0, 1])
def test_fault_of_one_rank_ends_the_job_at_once(guilty):
    """Without -m mpi4py the other rank would wait for ever in its barrier."""
    pytest.importorskip("mpi4py")
    code = (
        f"from mpi4py import MPI\nif MPI.COMM_WORLD.rank == {guilty}: raise"
        " RuntimeError('broken')\nMPI.COMM_WORLD.barrier()"
    )
    answer = run([*launcher.mpi_command(2), sys.executable, "-m", "mpi4py", "-c", code])
    assert answer.returncode != 0 and "broken" in answer.stderr


def test_the_mpirun_beside_the_interpreter_goes_before_that_of_the_path(monkeypatch, tmp_path):
    """MPICH of the package index stands beside Python; ranks started by the distribution's Open MPI would each be
    alone."""
    beside, other = tmp_path / "environment", tmp_path / "system"
    for folder, name in ((beside, "MPICH"), (other, "mpirun (Open MPI) 4.1")):
        folder.mkdir()
        (folder / "mpirun").write_text(f"#!/bin/sh\necho '{name}'\n")
        (folder / "mpirun").chmod(0o755)
    monkeypatch.setenv("PATH", str(other))
    monkeypatch.setattr(sys, "executable", str(beside / "python"))
    assert launcher.mpi_command(2) == [str(beside / "mpirun"), "-n", "2"]
    (beside / "mpirun").unlink()
    assert launcher.mpi_command(2)[:4] == ["mpirun", "-n", "2", "--oversubscribe"]


def test_missing_mpirun_is_named(monkeypatch):
    monkeypatch.setattr(sys, "executable", "/nonexistent/python")
    monkeypatch.setenv("PATH", "/nonexistent")
    with pytest.raises(FileNotFoundError, match="openmpi-bin"):
        launcher.mpi_command(2)
