"""Who may import whom: geometry and bem are light, rail_fem is the application, only rail_fem/fe, static_fe and what
stands on them need dolfinx and MPI."""

import ast
import graphlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
HEAVY = {"dolfinx", "mpi4py", "petsc4py", "ufl", "basix"}
FORBIDDEN = {"geometry": {"bem", "rail_fem"} | HEAVY, "bem": {"geometry", "rail_fem", "gmsh"} | HEAVY}


def modules(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


def imports(path: Path, only_top: bool = False) -> set[str]:
    """First names of everything that a file imports; only_top leaves out imports inside functions."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    inside = {
        node
        for function in ast.walk(tree)
        if isinstance(function, (ast.FunctionDef, ast.Lambda))
        for node in ast.walk(function)
    }
    names = set()
    for node in ast.walk(tree):
        if only_top and node in inside:
            continue
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            names.add(node.module.partition(".")[0])
    return names


def is_heavy(path: Path) -> bool:
    """The part that may need dolfinx: explicit and static finite elements, all but the plan of a run, the models built
    on them, and the studies of both."""
    room, *rest = (
        path.relative_to(ROOT / "rail_fem").parts if path.is_relative_to(ROOT / "rail_fem") else (path.parent.name,)
    )
    if room in ("studies", "export"):
        return bool(
            re.search(
                r"rail_fem\.(fe(?!\.plan)|static_fe)\b|^(from|import) (dolfinx|mpi4py|petsc4py|ufl)",
                path.read_text(encoding="utf-8"),
                re.MULTILINE,
            )
        )
    return (room in ("fe", "static_fe") and rest[0] != "plan") or (room == "models" and rest[-1].startswith("fe_"))


LIGHT = [path for package in ("geometry", "bem", "rail_fem") for path in modules(package) if not is_heavy(path)]


@pytest.mark.parametrize("package", FORBIDDEN)
def test_arrows_point_one_way(package):
    for path in modules(package):
        assert not imports(path) & FORBIDDEN[package], f"{path.relative_to(ROOT)} imports what {package} must not know"


# Rooms of rail_fem from the ground up, with why each stands where it does: it may import what stands before it.
STOREYS = (
    (("files",), "bytes on a disk, of whatever"),
    (("processes",), "a status is a file"),
    (("scene",), "a wheel or a crossing may be a file"),
    (("settings",), "ranges of numerics go by what is there"),
    (
        ("result", "contact"),
        "a result names its scene and its units; contact is what a scene's surfaces do, before any model",
    ),
    (("hierarchy",), "a model makes a result from a scene and its settings"),
    (("passes",), "masses move on what contact tells, and leave results"),
    (("fe",), "an explicit run begins where a light pass is"),
    (("static_fe",), "takes forms and what a condensed body is to an explicit run"),
    (("models",), "stand on passes and elements; fe_full's wheel on what static elements condense"),
    (("case",), "whether a case can be run is asked of its models' own rules"),
    (("show",), "draws results and what a case says of itself"),
    (("export", "damage"), "what is made of results; a damage study reads a case and draws"),
    (("run",), "a case, its model, its result and its figures, together"),
    (("sweeps", "measurement"), "many runs; a run beside a record"),
    (("design",), "a search makes sweeps"),
    (("studies", "app"), "what a person asks of the parts, or of all together"),
    (("commands",), "the terminal starts everything"),
    (("cli",), "and lists the commands"),
)


def imported_modules(path: Path, known: set[str]) -> set[str]:
    """Modules of the project that a file imports, wherever the statement stands."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    return found & known


def room_arrows(package: str) -> dict[str, dict[str, set[str]]]:
    """For each folder of a package, its rooms (modules and subfolders) and the rooms of the same folder that each
    imports."""
    files = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts): path
        for path in modules(package)
        if path.name not in ("__init__.py", "__main__.py")
    }
    arrows: dict[str, dict[str, set[str]]] = {}
    for name, path in files.items():
        for other in imported_modules(path, set(files)):
            one, two = name.split("."), other.split(".")
            depth = next((k for k, (a, b) in enumerate(zip(one, two, strict=False)) if a != b), None)
            if depth is not None:
                arrows.setdefault(".".join(one[:depth]), {}).setdefault(one[depth], set()).add(two[depth])
    return arrows


@pytest.mark.parametrize("package", ["geometry", "bem", "rail_fem"])
def test_rooms_form_no_circle(package):
    """Modules and subfolders of every folder can be ordered so that each imports earlier ones only: a reader can begin
    somewhere."""
    for folder, graph in room_arrows(package).items():
        try:
            tuple(graphlib.TopologicalSorter(graph).static_order())
        except graphlib.CycleError as error:
            pytest.fail(f"in {folder}: {' -> '.join(error.args[1])}")


def test_rooms_of_the_application_stand_on_one_another():
    storey = {room: level for level, (rooms, _) in enumerate(STOREYS) for room in rooms}
    arrows = room_arrows("rail_fem")["rail_fem"]
    assert set(arrows) | set().union(*arrows.values()) == set(storey), "a room is missing in STOREYS"
    upwards = [
        f"{room} -> {other}" for room, others in arrows.items() for other in others if storey[other] >= storey[room]
    ]
    assert not upwards, f"import what stands above them: {', '.join(sorted(upwards))}"


# What is named by the user, or first used, is imported by name: a model, a study, a public name.
BY_NAME = "hierarchy.py", "commands/study.py", "__init__.py", "processes/pool.py"


def test_no_arrow_hides_in_an_import_by_name():
    others = [
        path.relative_to(ROOT).as_posix()
        for package in ("geometry", "bem", "rail_fem")
        for path in modules(package)
        if re.search(r"\bimport_module\b|\bresolve_name\b|\b__import__\b|\bexec\(", path.read_text(encoding="utf-8"))
        and path not in [ROOT / package / name for name in BY_NAME]
    ]
    assert not others


def test_gmsh_is_imported_only_in_geometry_and_only_when_meshing():
    for path in LIGHT:
        assert "gmsh" not in imports(path, only_top=True), f"{path.relative_to(ROOT)} imports gmsh at its top"
        if path.relative_to(ROOT).parts[0] == "rail_fem":
            assert "gmsh" not in imports(path), f"{path.relative_to(ROOT)} imports gmsh"


def test_light_part_imports_without_dolfinx_mpi_and_gmsh():
    """Every light module is imported in one process where the heavy packages cannot be."""
    names = [
        ".".join(path.relative_to(ROOT).with_suffix("").parts)
        for path in LIGHT
        if path.name not in ("__init__.py", "__main__.py")
    ]
    assert len(names) > 10
    code = f"""
import importlib, sys
for name in {sorted(HEAVY | {"gmsh"})!r}:
    sys.modules[name] = None
for name in {names!r}:
    importlib.import_module(name)
"""
    answer = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert answer.returncode == 0, answer.stderr


MOST_FILES = 89  # 90 asked for; a run measures its bar of form on bearers and wheel bodies that its case need not have


def test_a_light_run_meets_only_the_files_that_its_case_needs():
    """What a reader must know of to follow `rail-fem run` by rigid_hertz: files of which a function or class runs."""
    code = "import house; print(len(house.way()))"
    answer = subprocess.run([sys.executable, "-c", code], cwd=ROOT / "tests", capture_output=True, text=True)
    assert answer.returncode == 0, answer.stderr
    assert int(answer.stdout.split()[-1]) <= MOST_FILES, "python tests/house.py --way"
