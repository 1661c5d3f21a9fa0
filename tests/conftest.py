"""What was not run, and why: tests that need packages of the explicit models, where only the light ones are installed,
and tests that need files of others."""

from importlib.util import find_spec

import pytest

from tests.outside import ABSENT, report

OPTIONAL = ("dolfinx", "mpi4py", "petsc4py", "basix", "ufl", "gmsh", "meshio", "pyvista", "vtk", "pandas", "jsonschema")
MISSING = frozenset(name for name in OPTIONAL if find_spec(name) is None)


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
