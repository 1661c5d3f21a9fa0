"""One rule for the caches of compiled kernels, for every package, command and test: a cached kernel belongs to the
sources it was made from.

numba keeps a compiled function beside the digest of its own file. A callee is compiled into its caller, though, so that
an edit of the callee's file would leave stale machine code in the caller's cache. Here the digest is that of the file
and of all project files that it imports, directly or through others. Every kernel is declared with the `njit` of this
module (tests/test_kernel_cache.py looks for others).

The caches lie in NUMBA_CACHE_DIR if that is set, else in rail_fem/kernels of the user's cache folder, else in a
temporary folder.
"""

import functools
import hashlib
import os
import re
import shutil
import tempfile
from pathlib import Path

import numba
from numba.core import event
from numba.core.caching import _CacheLocator  # the interface that numba's setting CACHE_LOCATOR_CLASSES asks for

ROOT = Path(__file__).resolve().parent
PACKAGES = "geometry", "bem", "rail_fem"
NUMBAS_OWN = "InTreeCacheLocator", "UserWideCacheLocator", "IPythonCacheLocator", "ZipCacheLocator"
IMPORT = re.compile(
    r"^[ \t]*(?:from[ \t]+([.\w]+)[ \t]+import[ \t]+(\([^)]*\)|[^\n#]*)|import[ \t]+([^\n#]*))", re.MULTILINE
)

njit = numba.njit
_COMPILING = event.TimingListener()
event.register("numba:compile", _COMPILING)


def compile_time() -> float:
    """How long this process has compiled kernels so far [s]; what was read from the cache took none of it."""
    return _COMPILING.duration if _COMPILING.done else 0.0


def _files_of(folder: Path, dotted: str, names: list[str]) -> set[Path]:
    """Files that `from dotted import names` may read, `dotted` counted from a folder."""
    module = folder.joinpath(*filter(None, dotted.split(".")))
    candidates = [module.with_suffix(".py"), module / "__init__.py", *(module / f"{name}.py" for name in names)]
    return {path for path in candidates if path.is_file()}


@functools.cache
def _imports(file: Path) -> frozenset[Path]:
    """Project files that one file names in its import statements, wherever these stand."""
    found: set[Path] = set()
    for source, names, plain in IMPORT.findall(file.read_text(encoding="utf-8")):
        for dotted in (part.split()[0] for part in plain.split(",") if part.strip()):
            if dotted.partition(".")[0] in PACKAGES:
                found |= _files_of(ROOT, dotted, [])
        if source:
            words = [part.split()[0] for part in names.strip("() \n").split(",") if part.strip()]
            level = len(source) - len(source.lstrip("."))
            if level:
                found |= _files_of(file.parents[level - 1], source[level:], words)
            elif source.partition(".")[0] in PACKAGES:
                found |= _files_of(ROOT, source, words)
    return frozenset(found)


def sources(file: Path) -> list[Path]:
    """A file and every project file that its import statements reach, sorted."""
    reached, ahead = set(), [file]
    while ahead:
        if (path := ahead.pop()) not in reached:
            reached.add(path)
            ahead.extend(_imports(path))
    return sorted(reached)


@functools.cache
def digest(file: Path) -> str:
    """SHA-256 over the names and contents of `sources(file)`."""
    total = hashlib.sha256()
    for path in sources(file):
        text = path.read_bytes()
        total.update(f"{path.name} {len(text)}\n".encode() + text)
    return total.hexdigest()


@functools.cache
def folder() -> Path:
    """Where compiled kernels are kept. A temporary folder where the user's cache cannot be written."""
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    path = Path(os.environ.get("NUMBA_CACHE_DIR") or home / "rail_fem" / "kernels")
    try:
        path.mkdir(parents=True, exist_ok=True)
        if os.access(path, os.W_OK):
            return path
    except OSError:
        pass
    return Path(tempfile.mkdtemp(prefix="rail_fem_"))


class SourcesLocator(_CacheLocator):
    """Where numba keeps the kernels of one project file, and the digest that they are valid for."""

    def __init__(self, file: Path, line: int):
        self.file, self.line = file, line

    @classmethod
    def from_function(cls, function, file):
        """A locator for a function of this project's packages; None for anybody else's."""
        path = Path(file).resolve()
        inside = path.is_relative_to(ROOT) and path.relative_to(ROOT).parts[0] in PACKAGES
        return cls(path, function.__code__.co_firstlineno) if inside else None

    def get_cache_path(self):
        """Folder of the file's kernels: one for each path of the file, so that two checkouts do not share one, and in
        it one for its sources. numba reads an index before it looks at its stamp, and cannot where the index names a
        class that is gone: an index of other sources must not be found. Kernels of former sources are removed."""
        home = folder() / f"{self.file.stem}_{hashlib.sha256(str(self.file).encode()).hexdigest()[:16]}"
        path = home / self.get_source_stamp()[:16]
        if home.is_dir() and not path.is_dir():
            shutil.rmtree(home, ignore_errors=True)  # a process that runs on former sources makes its folder again
        return str(path)

    def get_source_stamp(self):
        """Digest of the file and of all that it imports from this project."""
        return digest(self.file)

    def get_disambiguator(self):
        """Line of the function: tells functions of one name apart."""
        return str(self.line)


if __name__ not in numba.config.CACHE_LOCATOR_CLASSES:
    others = numba.config.CACHE_LOCATOR_CLASSES or ",".join(NUMBAS_OWN)
    numba.config.CACHE_LOCATOR_CLASSES = f"{__name__}.{SourcesLocator.__name__},{others}"
