"""What is released: source distribution and wheel, installed by themselves, bring examples and a command that runs
them; the recipes of conda and Apptainer ask for what pyproject.toml and the Dockerfile do."""

import ast
import os
import re
import shutil
import subprocess
import sys
import tomllib
import venv
from importlib.util import find_spec
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from rail_fem import load_result

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
OF_CONDA = {"matplotlib": "matplotlib-base", "gmsh": "python-gmsh"}  # that conda-forge names otherwise


def test_sdist_and_wheel_bring_the_examples_and_the_command_that_runs_them(tmp_path):
    """Libraries come from this environment; the program from the wheel that its source distribution makes."""
    if find_spec("wheel") is None and find_spec("setuptools.command.bdist_wheel") is None:
        pytest.skip("setuptools before 70.1 makes wheels with the package wheel alone: pip install wheel")
    tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split(
        "\n"
    )
    for name in filter(None, tracked):
        if (ROOT / name).is_file():
            (tmp_path / "sources" / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, tmp_path / "sources" / name)
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}  # the checkout's

    def do(*words, folder=tmp_path):
        answer = subprocess.run(list(map(str, words)), cwd=folder, env=environment, capture_output=True, text=True)
        assert answer.returncode == 0, answer.stdout + answer.stderr
        return answer.stdout

    made = f"from setuptools import build_meta; build_meta.build_sdist({str(tmp_path)!r})"
    do(sys.executable, "-W", "ignore", "-c", made, folder=tmp_path / "sources")
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
    do(
        *pip,
        "wheel",
        "-q",
        "--no-deps",
        "--no-build-isolation",
        "-w",
        tmp_path,
        next(tmp_path.glob("rail*fem-*.tar.gz")),
    )
    home = tmp_path / "environment"
    venv.create(home, with_pip=False)
    wheel = next(tmp_path.glob(f"rail_fem-{PROJECT['version']}-*.whl"))
    do(*pip, "--python", home, "install", "-q", "--no-deps", "--no-index", wheel)
    libraries = [path for path in sys.path if path.endswith(("site-packages", "dist-packages"))]
    own = next(home.glob("lib/python*/site-packages"))
    (own / "libraries.pth").write_text("\n".join(libraries) + "\n")
    cases = home / "share" / "rail-fem" / "cases"
    assert {name for name in tracked if name.startswith("cases/")} <= {
        f"cases/{path.relative_to(cases)}" for path in cases.rglob("*.*")
    }
    empty = tmp_path / "empty"
    empty.mkdir()
    do(
        home / "bin" / "rail-fem",
        "run",
        cases / "nose_transfer.toml",
        "--model",
        "p2_formula",
        "--out",
        "run",
        folder=empty,
    )
    result = load_result(empty / "run")
    assert result.peaks["p2"].value > result.scene.static_wheel_load
    assert {path.name for path in own.iterdir() if not path.name.endswith((".dist-info", ".pth", "__pycache__"))} == {
        "rail_fem"
    }
    for name in ("geometry", "bem", "kernel_cache"):  # a stranger's, which neither disturbs nor is disturbed
        (own / f"{name}.py").write_text("mine = True\n")
    asked = (
        "import geometry; from rail_fem import bem, geometry as ours; from rail_fem.geometry.axes import VOIGT; "
        "assert geometry.mine and bem.STEEL.young > 1e11; ours.wheel_profile('P8')"
    )
    do(home / "bin" / "python", "-c", asked)
    assert not [name for path in own.rglob("*.py") for name in imported(path) if not is_known(name, own)]


def imported(path: Path) -> set[str]:
    """Modules that a file imports, as its statements name them."""
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    plain = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    return plain | {node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module}


def is_known(name: str, home: Path) -> bool:
    """Whether a module of ours is where it is imported from; those of others are not asked."""
    first, *rest = name.split(".")
    module = home.joinpath(first, *rest)
    return first not in ("rail_fem", "geometry", "bem", "kernel_cache") or (
        first == "rail_fem" and (module.is_dir() or module.with_suffix(".py").is_file())
    )


def test_the_conda_recipe_asks_for_what_the_project_asks_for():
    yaml = pytest.importorskip("yaml")
    recipe = yaml.safe_load((ROOT / "conda-recipe" / "recipe.yaml").read_text(encoding="utf-8"))
    extras = PROJECT["optional-dependencies"]
    wanted = {
        OF_CONDA.get(one.name, one.name): one.specifier
        for one in map(Requirement, [*PROJECT["dependencies"], *extras["fe"], *extras["page"]])
    }
    wanted["python"] = Requirement(f"python{PROJECT['requires-python']}").specifier
    given = {canonicalize_name(one.name): one.specifier for one in map(Requirement, recipe["requirements"]["run"])}
    assert {name: given[name] for name in wanted} == wanted
    assert given.keys() - wanted.keys() == {"fenics-dolfinx", "petsc4py", "mpi4py"}
    assert recipe["context"]["version"] == PROJECT["version"]
    assert recipe["build"]["python"]["entry_points"] == [
        f"{name} = {where}" for name, where in PROJECT["scripts"].items()
    ]


def test_the_container_of_clusters_is_that_of_the_dockerfile():
    docker = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    apptainer = (ROOT / "rail-fem.def").read_text(encoding="utf-8")
    for pattern in (r"^(?:FROM|From:) (.*)", r"(?:ENV|export) (OMP.*)", r"(\./setup\.sh .*)"):
        assert re.findall(pattern, docker, re.MULTILINE) == re.findall(pattern, apptainer, re.MULTILINE) != []
    assert '.venv/bin/rail-fem "$@"' in apptainer and '[".venv/bin/rail-fem"]' in docker
    assert f"version: {PROJECT['version']}" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
