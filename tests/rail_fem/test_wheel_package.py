"""What `pip wheel .` makes, installed by itself: commands and example cases come along."""

import os
import subprocess
import sys
import venv
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.validate
def test_an_installed_wheel_brings_its_examples_and_its_command(tmp_path):
    """The libraries come from this environment; the program itself from the wheel, run from another folder."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}  # the sources would pass for installed
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
    made = [*pip, "wheel", "--no-deps", "-q", "-w", str(tmp_path), str(ROOT)]
    subprocess.run(made, check=True, capture_output=True)
    wheel = next(tmp_path.glob("rail_fem-*.whl"))
    venv.create(tmp_path / "environment", with_pip=False)
    subprocess.run(
        [*pip, "--python", str(tmp_path / "environment"), "install", "-q", "--no-deps", "--no-index", str(wheel)],
        check=True,
        capture_output=True,
        env=environment,
    )
    libraries = [p for p in sys.path if p.endswith(("site-packages", "dist-packages"))]
    python = tmp_path / "environment" / "bin" / "python"
    code = (
        f"import sys; sys.path.extend({libraries!r}); import rail_fem, pathlib; from rail_fem.cli import app;"
        " print(rail_fem.__file__, rail_fem.example('nose_transfer'));"
        " print(*sorted(str(p.relative_to(rail_fem.example('nose_transfer').parent)) for p in"
        " rail_fem.example('nose_transfer').parent.rglob('*.*')));"
        " app(['init', 'mine.toml', '--model', 'rigid_hertz'], standalone_mode=False);"
        " app(['list'], standalone_mode=False)"
    )
    answer = subprocess.run([python, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert answer.returncode == 0, answer.stderr
    home, example = answer.stdout.splitlines()[0].split()
    assert str(tmp_path) in home and str(tmp_path) in example
    there = subprocess.run(["git", "ls-files", "cases"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    brought = set(answer.stdout.splitlines()[1].split())
    assert {path.removeprefix("cases/") for path in there.split()} <= brought
    assert "nose_transfer" in answer.stdout and (tmp_path / "mine.toml").is_file()
