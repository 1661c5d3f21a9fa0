"""Whether the environment still holds what setup.sh put there: looked up among the files, nothing is imported, so it
takes no time.

`python -m rail_fem.run.installation` prints a line for each error and ends with 1; setup.sh calls it every time. What a
package that is there does when it is used, only `doctor` tries.
"""

import importlib.metadata
import sys
from importlib.util import find_spec
from pathlib import Path

# name to import -> name to install, where that differs; by what needs them
LIGHT = dict.fromkeys(("numpy", "scipy", "numba", "matplotlib", "pydantic", "pint", "typer", "rich"), "")
EXPLICIT = dict.fromkeys(("dolfinx", "mpi4py", "petsc4py", "gmsh", "meshio"), "")
PICTURES = {"pyvista": ""}
TESTS = {"pytest": "", "xdist": "pytest-xdist", "hypothesis": ""}
NEEDED = LIGHT | EXPLICIT | PICTURES | TESTS  # of an environment that setup.sh made
REMEDY = "./setup.sh repairs it"


def missing(names: list[str]) -> list[str]:
    """Those of the packages `names` that Python would not find, or only as an emptied folder."""
    return [name for name in names if (spec := find_spec(name)) is None or spec.origin is None]


def made_by_setup() -> bool:
    """Whether this is an environment of setup.sh, which holds all of NEEDED; elsewhere the light models' are enough."""
    return (Path(sys.prefix) / "constraints.txt").is_file()


def numpy_mismatch() -> str:
    """What is wrong with NumPy's series; empty where it is the one that setup.sh wrote down: that of the distribution,
    which dolfinx was built with."""
    written = Path(sys.prefix) / "constraints.txt"
    if not written.is_file() or not written.read_text().startswith("numpy=="):
        return ""
    series = written.read_text().split()[0].removeprefix("numpy==").removesuffix(".*")
    try:
        version = importlib.metadata.version("numpy")
    except importlib.metadata.PackageNotFoundError:
        return f"NumPy is missing, {series} is needed"
    if version.startswith(f"{series}."):
        return ""
    return (
        f"NumPy {version} has taken the place of the distribution's {series}, which dolfinx, SciPy and others were"
        " built with"
    )


def errors() -> list[str]:
    """A line for each error of the environment."""
    series = numpy_mismatch()
    return [
        *filter(None, [series]),
        *(f"the package {name} is missing" for name in missing([*NEEDED]) if not (series and name == "numpy")),
    ]


def explain(error: Exception) -> str:
    """A sentence for an import that failed, with its remedy; empty where no package of the environment is at fault."""
    name = (getattr(error, "name", None) or "").partition(".")[0]
    if gone := [one for one in missing([*NEEDED]) if made_by_setup() or one in LIGHT or one == name]:
        installs = " ".join(NEEDED[one] or one for one in gone)
        remedy = (
            "run ./setup.sh, or use .venv/bin/python" if made_by_setup() else f"pip install {installs}, or ./setup.sh"
        )
        return f"not installed in this Python ({sys.executable}): {', '.join(gone)} ({error}): {remedy}"
    remedy = (
        "remove .venv and call ./setup.sh"
        if made_by_setup()
        else f"pip install --force-reinstall {name}, or ./setup.sh"
    )
    if isinstance(error, ImportError) and name in NEEDED:
        return f"the package {name} is broken ({error}): {remedy}"
    return ""


def main() -> int:
    """Print the errors, or with --broken the names under which the missing packages are installed."""
    if sys.argv[1:] == ["--broken"]:
        print(*(NEEDED[name] or name for name in missing([*NEEDED])))
        return 0
    found = errors()
    print(*found, sep="\n", end="\n" if found else "")
    return 1 if found else 0


if __name__ == "__main__":
    raise SystemExit(main())
