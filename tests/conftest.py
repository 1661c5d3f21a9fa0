"""In which order the files run, and what was not run, and why: tests that need packages of the explicit models, where
only the light ones are installed, and tests that need files of others."""

import gc
import os
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.outside import ABSENT, report

OPTIONAL = (
    *("dolfinx", "mpi4py", "petsc4py", "basix", "ufl", "gmsh", "meshio", "pyvista", "vtk", "pandas", "jsonschema"),
    *("plotly", "xarray"),
)
MISSING = frozenset(name for name in OPTIONAL if find_spec(name) is None)
TESTS = Path(__file__).parent
# Files of ten seconds and more come first, so that none of them is left over when the other worker has nothing to do;
# those with several ranks, which wait busily, not before the gallery is made.
# The first compile kernels of different rooms, and others than the gallery does meanwhile (.ci/run): who begin with the
# same ones compile them all.
FIRST = (
    "rail_fem/test_load_continuity.py",
    "fe/test_cyclic_element.py",
    "test_docs.py",
    "fe/test_card.py",
    "rail_fem/test_figures.py",
    "damage/test_section.py",
    "rail_fem/test_bem_plastic.py",
    "damage/test_crossing_evolution.py",
    "geometry/test_section_path.py",
    "fe/test_diverging.py",
    "versus/test_plane_strain.py",
    "geometry/test_mesh_loft.py",
    "test_fuzz.py",
    "fe/test_passage.py",
    "rail_fem/test_readme.py",
    "fe/test_restart.py",
    "fe/test_static_start.py",
    "fe/test_crossing_by_sections.py",
    "fe/test_error_twin.py",
    "fe/test_repeated_passes.py",
    "rail_fem/test_job.py",
    "rail_fem/test_design_proof.py",
    "rail_fem/test_estimate.py",
    "fe/test_initial_position.py",
    "fe/test_travelling_window.py",
    "test_layering.py",
    "test_kernel_cache.py",
    "geometry/test_step.py",
    "rail_fem/test_crossing_section.py",
)
ROOMS = ("fe", "rail_fem", "damage", "versus", "export", "bem", "geometry")


def pytest_configure(config):
    """Ranks that wait give way to the other worker's tests; files run in the order below, not by their number of
    tests."""
    os.environ.setdefault("OMPI_MCA_mpi_yield_when_idle", "1")
    if hasattr(config.option, "loadscopereorder"):
        config.option.loadscopereorder = False


def turn(path: Path) -> tuple[int, int]:
    """What a file is sorted by: first the dear ones in their order, then room by room."""
    inside = path.relative_to(TESTS)
    room = inside.parts[0]
    return (
        FIRST.index(inside.as_posix()) if inside.as_posix() in FIRST else len(FIRST),
        ROOMS.index(room) if room in ROOMS else len(ROOMS),
    )


def pytest_collection_modifyitems(items):
    items.sort(key=lambda item: turn(item.path))


def stay() -> None:
    """What is there now, imported, collected and compiled, stays to the end: the collector looks no more through it,
    which takes half a second, at each mesh of dolfinx (rail_fem/fe/domain.py) and whenever else it comes by."""
    gc.collect()
    gc.freeze()


@pytest.hookimpl(hookwrapper=True)
def pytest_collection():
    gc.disable()  # it makes no garbage
    yield
    stay()
    gc.enable()


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_teardown(item, nextitem):
    yield
    if nextitem is None or nextitem.path != item.path:
        stay()


def wanted_package(error: BaseException | None) -> str:
    """The absent package, or mpirun with it, that is behind an error; empty where none is."""
    while error is not None:
        if isinstance(error, FileNotFoundError) and "mpirun" in str(error) and "mpi4py" in MISSING:
            return "mpirun"
        name = (getattr(error, "name", None) or "").partition(".")[0]
        if isinstance(error, ImportError) and name in MISSING:
            return name
        error = error.__cause__ or error.__context__
    return ""


def skip_instead(outcome, call, where: str) -> None:
    """Turn the failed report of a test or a file into a skipped one, if a package that is not installed is why."""
    made = outcome.get_result()
    if call.excinfo is not None and made.failed and (name := wanted_package(call.excinfo.value)):
        made.outcome, made.longrepr = "skipped", (where, 0, f"Skipped: needs {name}, which is not installed here")


@pytest.hookimpl(hookwrapper=True)
def pytest_make_collect_report(collector):
    outcome = yield
    if (call := getattr(outcome.get_result(), "call", None)) is not None:
        skip_instead(outcome, call, str(collector.path))


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item, call):
    outcome = yield
    skip_instead(outcome, call, str(item.path))


@pytest.fixture(scope="session")
def scene():
    """Of the main job."""
    from rail_fem.case.casefile import load_case

    return load_case("nose_transfer").scene


@pytest.fixture
def undrawn(monkeypatch):
    """Runs leave no figures and no bar of form, nine tenths of what one by a light model costs: for tests of what else
    a run leaves."""
    from rail_fem.run import job

    monkeypatch.setattr(job, "draw_run", lambda folder, missing_only=False: [])
    monkeypatch.setattr(job, "form", lambda result, by_passes: {})


def pytest_terminal_summary(terminalreporter):
    skipped: dict[str, list[str]] = {}
    for entry in terminalreporter.stats.get("skipped", []):
        reason = entry.longrepr[2] if isinstance(entry.longrepr, tuple) else str(entry.longrepr)
        if ABSENT in reason:
            skipped.setdefault(reason.partition(ABSENT)[2].strip(), []).append(entry.nodeid)
    if MISSING:
        terminalreporter.line(f"not installed, so skipped where needed: {', '.join(sorted(MISSING))}")
    if skipped:
        terminalreporter.section("not run: outside files", sep="=", yellow=True, bold=True)
        for line in report(skipped):
            terminalreporter.line(line, yellow=True)
