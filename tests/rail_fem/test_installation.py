"""A broken environment is found by a look at the files, and said in a sentence, not in a traceback."""

import importlib.metadata
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from rail_fem.run import installation
from rail_fem.run.doctor import examine
from rail_fem.run.installation import NEEDED, explain, missing, numpy_mismatch

ROOT = Path(__file__).resolve().parents[2]


def test_packages_are_missing_where_python_finds_none_or_an_emptied_folder(tmp_path, monkeypatch):
    (tmp_path / "emptied_package" / "__pycache__").mkdir(parents=True)
    monkeypatch.syspath_prepend(tmp_path)
    assert missing(["json", "emptied_package", "absent_package"]) == ["emptied_package", "absent_package"]
    assert "numpy" not in missing([*NEEDED])


@pytest.mark.parametrize(
    "written, mismatch", [("numpy==1.24.*", True), ("numpy==1.2.*", True), ("numpy==9.10.*", False), (None, False)]
)
def test_numpy_must_be_of_the_series_that_was_written_down(tmp_path, monkeypatch, written, mismatch):
    """9.10.2 is of the series 9.10 alone."""
    if written:
        (tmp_path / "constraints.txt").write_text(f"{written}\n")
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    monkeypatch.setattr(installation.importlib.metadata, "version", lambda name: "9.10.2")
    assert bool(numpy_mismatch()) == mismatch
    if mismatch:
        assert "NumPy 9.10.2 has taken the place of the distribution's 1.2" in numpy_mismatch()


def test_doctor_looks_at_numpy_first_and_names_its_remedy_alone(tmp_path, monkeypatch):
    """What fails because of it would be named with wrong remedies."""
    (tmp_path / "constraints.txt").write_text("numpy==0.1.*\n")
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    found = list(examine())
    assert [finding.subject for finding in found] == ["python", "numpy"]
    assert not found[1].well and "./setup.sh" in found[1].line()


def run_with(folder: Path, *arguments: str) -> subprocess.CompletedProcess:
    path = os.pathsep.join([str(folder), str(ROOT)])
    return subprocess.run(
        [sys.executable, "-m", "rail_fem", *arguments],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
    )


ABSENT = """import importlib.util, sys
sys.modules[{name!r}] = None
find = importlib.util.find_spec
importlib.util.find_spec = lambda name, package=None: None if name == {name!r} else find(name, package)
"""


@pytest.mark.parametrize("name", ["pydantic", "pint"])
@pytest.mark.parametrize(
    "kind, said",
    [
        ("broken", "the package {name} is broken (No module named '{name}.part')"),
        ("absent", "): {name} (import of {name} halted"),
    ],
)
def test_a_broken_package_is_a_sentence(tmp_path, name, kind, said):
    """One that fails when it is imported, put in front of the real one, and one that is not there."""
    (tmp_path / "sitecustomize.py").write_text(ABSENT.format(name=name) if kind == "absent" else "")
    if kind == "broken":
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text(f"import {name}.part")
    answer = run_with(tmp_path, "check", "cases/nose_transfer.toml")
    assert answer.returncode != 0 and "Traceback" not in answer.stderr
    assert (
        len(answer.stderr.strip().splitlines()) == 1
        and said.format(name=name) in answer.stderr
        and "./setup.sh" in answer.stderr
    )


def test_an_error_that_is_not_the_environments_is_not_hidden():
    assert explain(ModuleNotFoundError("No module named 'bem.absent'", name="bem.absent")) == ""
    assert explain(AttributeError("module 'json' has no attribute 'x'")) == ""


def locked(file: Path) -> dict[str, str]:
    """Releases of a lock file by the normal form of the package's name."""
    lines = (line.split("==") for line in file.read_text().split())
    return {canonicalize_name(name): release for name, release in lines}


@pytest.mark.parametrize("file", sorted((ROOT / "constraints").glob("*.txt")), ids=lambda file: file.stem)
def test_the_lock_names_a_release_that_pyproject_allows_of_every_package(file):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = {name: lines for name, lines in project["optional-dependencies"].items() if name != "cuda"}  # with a card
    asked = [*project["dependencies"], *(line for lines in extras.values() for line in lines)]
    distribution = {"numpy", "scipy", "matplotlib"}  # of Debian, for dolfinx was built with them
    for requirement in map(Requirement, asked):
        if requirement.name not in distribution:
            assert requirement.specifier.contains(locked(file)[canonicalize_name(requirement.name)]), requirement


@pytest.mark.skipif(not installation.made_by_setup(), reason="an environment that setup.sh did not make")
def test_what_is_installed_is_what_the_lock_names():
    file = ROOT / "constraints" / f"python{sys.version_info.major}.{sys.version_info.minor}.txt"
    found = {canonicalize_name(there.name) for there in importlib.metadata.distributions()}  # not those of docs
    tested = {name: release for name, release in locked(file).items() if name in found}
    assert {name: importlib.metadata.version(name) for name in tested} == tested and len(tested) > 30
