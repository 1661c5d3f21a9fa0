"""Versions of everything that an answer depends on, as far as it is installed."""

import contextlib
import functools
import platform
import subprocess
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

PACKAGES = ["rail-fem", "numpy", "scipy", "numba", "dolfinx", "mpi4py", "petsc4py", "gmsh", "pyvista", "vtk"]
PACKAGES += ["pydantic", "pint"]
BROUGHT_BY = {"dolfinx": ("fenics-dolfinx", "dolfinx-solver-real")}  # the distributions that may bring it

# package -> what needs it, and what holds the same
NEEDED = {
    "pandas": ("tables in Python need", "history.csv and sweep.csv hold"),
    "xarray": ("data sets need", "to_dataframe and the .csv files hold"),
    "pyvista": ("meshes in Python need", "result.fields and the files in fields/ hold"),
}
HOW_TO_GET = (  # what the explicit models need beyond the light ones
    "on Debian 12 or 13 ./setup.sh of the sources; elsewhere, with Python 3.12 or newer, pip install"
    " dolfinx-solver-real gmsh meshio"
)


@functools.cache
def _versions() -> tuple[tuple[str, str], ...]:
    found = {"python": platform.python_version(), "system": platform.platform()}
    for name in PACKAGES:
        found[name] = next(filter(None, map(_version, BROUGHT_BY.get(name, (name,)))), "not installed")
    found["git"] = git_revision()
    return tuple(found.items())


def _version(distribution: str) -> str:
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return ""


def own_version() -> str:
    """Of this program; "0" where it runs without having been installed."""
    return _version("rail-fem") or "0"


def versions() -> dict[str, str]:
    """Name -> version; "not installed" where absent. Nothing is imported for it."""
    return dict(_versions())


@contextlib.contextmanager
def needed(package: str) -> Iterator[None]:
    """Around the import of a package that those alone need who ask for what it makes (NEEDED). Errors:
    ModuleNotFoundError, with what to do."""
    try:
        yield
    except ModuleNotFoundError as error:
        what, without = NEEDED[package]
        words = f"{what} {package}: pip install {package}; {without} the same without it"
        raise ModuleNotFoundError(words, name=package) from error


def git_revision() -> str:
    """Commit of the project's checkout, "-dirty" when tracked files differ that are no documents; empty outside a
    checkout."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return ""
    try:
        ask = lambda *words: subprocess.run(
            ["git", "-C", str(root), *words], capture_output=True, text=True, timeout=10, check=True
        ).stdout.strip()
        differ = ask("status", "--porcelain", "--untracked-files=no", "--", ".", ":!docs", ":!*.md")
        return ask("describe", "--always", "--abbrev=12") + ("-dirty" if differ else "")
    except (OSError, subprocess.SubprocessError):
        return ""
