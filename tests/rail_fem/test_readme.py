"""Every command of the README and every case runs; those that need the FE model as soon as it is there."""

import os
import re
import shlex
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from rail_fem.processes import launcher
from rail_fem.processes.progress import read_status
from rail_fem.result.result import load
from tests.commands import call

ROOT = Path(__file__).resolve().parents[2]
COMMANDS = [
    line
    for block in re.findall(r"```sh\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    for line in block.splitlines()
]
HAS_MODEL = (ROOT / "rail_fem" / "models" / "fe_full.py").exists()
needs_model = pytest.mark.skipif(not HAS_MODEL, reason="rail_fem/models/fe_full.py is not there yet")
SMOKE_SECONDS = 300


def run_shell(words: list[str]) -> str:
    """Run as a user types it, in the project's root, with few steps and no terminal."""
    answer = subprocess.run(
        words,
        cwd=ROOT,
        env=os.environ | {"RAIL_FEM_SMOKE": "1"},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=SMOKE_SECONDS,
    )
    assert answer.returncode == 0, f"{shlex.join(words)}\n{answer.stdout[-4000:]}\n{answer.stderr[-4000:]}"
    return answer.stdout


def run_readme(command: str, folder: Path) -> str:
    """A README command, its outputs sent to `folder`, with the mpirun options that this machine needs."""
    words = [
        word.replace("runs/", f"{folder}/").replace("my_case.toml", f"{folder}/my_case.toml")
        for word in shlex.split(command)
    ]
    if words == [".venv/bin/rail-fem", "doctor"]:  # it tries mpirun, which a process that uses MPI itself cannot start
        return run_shell([sys.executable, "-m", "rail_fem", "doctor"])
    if words[0] == ".venv/bin/rail-fem":
        return call(*words[1:], RAIL_FEM_SMOKE="1").stdout
    words = [sys.executable if word == ".venv/bin/python" else word for word in words]
    assert words[:2] == ["mpirun", "-n"]
    return run_shell(launcher.mpi_command(int(words[2])) + words[3:])


def check_folder(folder: Path) -> None:
    assert read_status(folder)["state"] == "finished"
    result = load(folder)
    assert result.history["time"].size > 0 and result.cost.steps > 0 and not result.fault


def test_readme_names_the_commands_that_are_tried_here():
    """A command added to the README must be tried below."""
    tried = [
        "./run.sh",
        "./test.sh",
        *(f".venv/bin/rail-fem {name}" for name in ("init", "check", "run", "show", "list", "doctor")),
        "mpirun -n 2 .venv/bin/python -P -m mpi4py -m rail_fem run",
    ]
    untried = [command for command in COMMANDS if not any(command.startswith(start) for start in tried)]
    assert not untried and all(any(command.startswith(start) for command in COMMANDS) for start in tried)


def test_test_command_passes_arguments_on():
    answer = run_shell(["./test.sh", "--collect-only", "tests/rail_fem/test_readme.py"])
    assert "test_test_command_passes_arguments_on" in answer


def test_continuous_integration_calls_the_test_command():
    assert "./test.sh" in (ROOT / ".ci" / "run").read_text() and os.access(ROOT / ".ci" / "run", os.X_OK)


def test_commands_of_ones_own_case_in_their_order(tmp_path):
    """From nothing to the report of a run, as the README says it."""
    said = {command: run_readme(command, tmp_path) for command in COMMANDS if command.startswith(".venv/bin/rail-fem")}
    assert all(text.strip() for text in said.values())
    check_folder(tmp_path / "my_case")
    assert "finished" in next(text for command, text in said.items() if "rail-fem show" in command)


def test_the_python_of_the_readme_runs(tmp_path):
    block = re.search(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)[1]
    code = block.replace('rail_fem.load_result("runs/my_case")', "print(repr(result))")
    assert "PassResult rigid_hertz" in run_shell([sys.executable, "-c", code])


@needs_model
def test_main_job_command(tmp_path):
    said = run_shell(["./run.sh", "--out", str(tmp_path / "main")])
    assert find_spec("plotly") is None or (tmp_path / "main" / "page.html").is_file() and "page for a browser" in said
    check_folder(tmp_path / "main")


RANKS = next(command for command in COMMANDS if command.startswith("mpirun"))


def test_the_command_on_several_ranks_is_that_of_the_main_job():
    """Which runs above: the same interpreter, options and modules on as many ranks."""
    program = re.compile(r"\S*python (.*rail_fem run) ")
    script = (ROOT / "run.sh").read_text(encoding="utf-8")
    assert program.search(RANKS)[1] in script.splitlines()[-1]
    assert f"rail_fem.processes.launcher {RANKS.split()[2]})" in script


@needs_model
@pytest.mark.validate
def test_the_command_on_several_ranks(tmp_path):
    assert "finished" in run_readme(RANKS, tmp_path)
    check_folder(tmp_path / "two_cores")


@needs_model
@pytest.mark.parametrize(
    "path",
    [path for path in sorted((ROOT / "cases").glob("*.toml")) if path.stem != "nose_transfer"],
    ids=lambda path: path.stem,
)
def test_every_other_case_runs(path, tmp_path):
    """The nose transfer runs in the tests above."""
    call("run", path, "--out", tmp_path / "out", RAIL_FEM_SMOKE="1")
    check_folder(tmp_path / "out")


@pytest.mark.parametrize("script", ["setup.sh", "run.sh", "test.sh", ".ci/run", "cases/slurm.sh"])
def test_scripts_are_valid_shell_and_executable(script):
    assert os.access(ROOT / script, os.X_OK)
    subprocess.run(["bash", "-n", str(ROOT / script)], check=True)
