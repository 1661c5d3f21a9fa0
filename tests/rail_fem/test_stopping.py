"""A stop at any moment leaves a sentence, a status and a folder that a restart goes on with."""

import os
import signal
import subprocess
import sys
import time

import pytest

from rail_fem.files import lock
from rail_fem.processes import launcher
from rail_fem.processes.progress import GO_ON, read_status
from rail_fem.result.result import load
from tests.rail_fem.test_job import ON_RANKS, ROOT, call, case, drawn_case  # noqa: F401
from tests.ranks import HANGS

ALONE = "from rail_fem.processes import stopping\nstopping.listen()\n" + ON_RANKS
BUSY = {  # what the main thread does while the signal comes
    "python": "while True: pass",
    "sleep": "time.sleep(60)",
    "library without the interpreter's lock": "import ctypes\n    while True: ctypes.CDLL(None).sleep(60)",
    "writing the status": "while True: progress.note('x')",
}
RUN = """
import sys, time
from pathlib import Path
from rail_fem.processes import stopping
stopping.listen()
from rail_fem.processes.progress import Progress
from rail_fem.result.runfolder import held
folder = Path(sys.argv[1])
with held(folder), Progress(folder, stream=open("/dev/null", "w")) as progress:
    print("begun", flush=True)
    {}
"""
POOL = """
import time
from rail_fem.processes import stopping
from rail_fem.processes.pool import executor
stopping.listen()
pool = executor(1)
print(pool.submit(pow, 2, 3).result(), flush=True)
time.sleep(60)
"""


def listening() -> None:
    """In the child: both signals as a terminal leaves them, though the tests themselves may run where SIGINT is ignored
    (in the background)."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_DFL)


@pytest.fixture
def started():
    """Starts a process that does not outlive the test."""
    begun = []

    def start(command, *arguments, **variables):
        begun.append(
            subprocess.Popen(
                [*command, *map(str, arguments)],
                cwd=ROOT,
                env=os.environ | variables,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
                preexec_fn=listening,
            )
        )
        return begun[-1]

    yield start
    for process in begun:
        process.kill()


@pytest.mark.parametrize(
    "what, number",
    [
        ("python", signal.SIGINT),
        *((what, signal.SIGTERM) for what in BUSY),
        *(pytest.param(what, signal.SIGINT, marks=pytest.mark.validate) for what in BUSY if what != "python"),
    ],
)
def test_whatever_the_run_does_it_stops_at_once_with_status_and_sentence(started, tmp_path, what, number):
    run = started([sys.executable, "-c", RUN.format(BUSY[what])], tmp_path)
    assert run.stdout.readline() == "begun\n"
    time.sleep(0.05)
    run.send_signal(number)
    _, said = run.communicate(timeout=HANGS)
    assert run.returncode == 128 + number and said == f"\n{number.name}: {GO_ON}\n"
    assert read_status(tmp_path)["state"] == "stopped" and read_status(tmp_path)["message"] == GO_ON
    assert not (tmp_path / lock.LOCK).exists()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_processes_of_a_pool_end_with_the_program(started, number):
    """They hold its output open as long as they live."""
    run = started([sys.executable, "-c", POOL])
    assert run.stdout.readline() == "8\n"
    run.send_signal(number)
    run.communicate(timeout=HANGS)


def test_stop_before_anything_is_there_says_so(started, tmp_path):
    run = started(
        [
            sys.executable,
            "-c",
            "from rail_fem.processes import stopping\nstopping.listen()\nprint('begun', flush=True)\n"
            "import time\ntime.sleep(60)",
        ]
    )
    assert run.stdout.readline() == "begun\n"
    run.send_signal(signal.SIGTERM)
    _, said = run.communicate(timeout=HANGS)
    assert run.returncode == 143 and said == "\nSIGTERM: stopped\n"


def test_what_the_program_was_started_to_ignore_it_ignores():
    code = (
        "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)\nfrom rail_fem.processes import"
        " stopping\nstopping.listen()\nimport os, time; os.kill(os.getpid(), 2); time.sleep(0.2); print('here')"
    )
    assert (
        subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=HANGS).stdout
        == "here\n"
    )


def test_a_run_goes_on_when_nobody_reads_what_it_says(tmp_path):
    """As of `rail-fem run ... | head -1`; where PETSc is, it would end the process by SIGPIPE."""
    code = (
        "import contextlib, sys\nfrom rail_fem.processes import progress, stopping\nstopping.listen()\n"
        "with contextlib.suppress(ImportError):\n    from petsc4py import PETSc\n"
        "with progress.Progress(sys.argv[1], line_interval=0.0) as told:\n"
        "    told.note('mesh')\n    told.update(step=1, time=1e-4, end_time=1e-3)"
    )
    read, write = os.pipe()
    os.close(read)
    run = [sys.executable, "-c", code, str(tmp_path)]
    said = subprocess.run(run, cwd=ROOT, stdout=write, stderr=subprocess.PIPE, text=True, timeout=HANGS)
    os.close(write)
    assert (said.returncode, said.stderr) == (0, "") and read_status(tmp_path)["state"] == "finished"


def test_run_ended_by_its_queue_says_so_and_can_be_gone_on_with(started, case, tmp_path):  # noqa: F811
    whole, out = tmp_path / "whole", tmp_path / "out"
    assert call("run", case, "--out", whole).exit_code == 0
    run = started([sys.executable, "-c", ALONE], "run", case, "--out", out, TOY_SIGNAL="20")
    _, said = run.communicate(timeout=HANGS)
    assert run.returncode == 143 and f"SIGTERM: {GO_ON}" in said and read_status(out)["state"] == "stopped"
    assert call("run", case, "--out", out, "--restart").exit_code == 0
    assert (
        load(out).history["force"].tobytes() == load(whole).history["force"].tobytes()
        and read_status(out)["state"] == "finished"
    )


def test_a_stopped_sweep_names_no_option_of_a_run(started, tmp_path):
    run = started(
        [sys.executable, "-m", "rail_fem", "sweep", "cases/nose_transfer.toml", "--model", "lumped"],
        *("--vary", "scene.speed=30mph:90mph:400", "--out", tmp_path),
    )
    assert run.stdout.readline().startswith("cases/nose_transfer.toml")
    assert run.stdout.readline().startswith("[1/400]")
    run.send_signal(signal.SIGINT)
    _, said = run.communicate(timeout=HANGS)
    assert run.returncode == 130 and said == "\nSIGINT: stopped; the same command goes on\n"


@pytest.mark.mpi
@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.validate)])
def test_stop_of_mpirun_reaches_the_status(started, case, tmp_path, number):  # noqa: F811
    """mpirun sends SIGTERM to its ranks and kills them soon after; from Open MPI 5 on it also drops what they say then,
    and the status alone tells."""
    out = tmp_path / "out"
    run = started(
        [*launcher.mpi_command(2), sys.executable, "-m", "mpi4py", "-c", ALONE],
        "run",
        case,
        "--out",
        out,
        TOY_PAUSE="60",
    )
    while not (out / "status.json").is_file() and run.poll() is None:
        time.sleep(0.05)
    run.send_signal(number)
    _, said = run.communicate(timeout=HANGS)
    version = subprocess.run(["mpirun", "--version"], capture_output=True, text=True).stdout
    assert run.returncode != 0 and said.count(GO_ON) in ((0, 1) if "(Open MPI) 5" in version else (1,))
    assert read_status(out)["state"] == "stopped" and not (out / lock.LOCK).exists()
