"""One rule for the caches of compiled kernels, for every package, command and test: a cached kernel belongs to the
sources it was made from.

numba keeps a compiled function beside the digest of its own file. A callee is compiled into its caller, though, so that
an edit of the callee's file would leave stale machine code in the caller's cache. Here the digest is that of the file
and of all project files that it imports, directly or through others. Every kernel is declared with the `njit` of this
module (tests/test_kernel_cache.py looks for others).

The caches lie in NUMBA_CACHE_DIR if that is set, else in rail_fem/kernels of the user's cache folder, else in a
temporary folder. They are found by content alone: two checkouts of the same sources share them. numba reads them by
pickle, which executes what it reads, so a folder or a file that is not the user's own is not read, and each file begins
with the digest of the rest: a damaged one is removed and its kernel compiled anew.
"""

import contextlib
import functools
import hashlib
import os
import pickle
import re
import shutil
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any

import numba
from numba.core import event
from numba.core.caching import (
    FunctionCache,
    IndexDataCacheFile,
    _CacheLocator,  # the interface that numba's setting CACHE_LOCATOR_CLASSES asks for
)
from numba.core.codegen import get_host_cpu_features

BENEATH = bool(__package__)  # of a wheel: all packages lie beneath one (setup.py)
ROOT = Path(__file__).resolve().parents[BENEATH]
PACKAGES = (__package__,) if BENEATH else ("geometry", "bem", "rail_fem")
NUMBAS_OWN = "InTreeCacheLocator", "UserWideCacheLocator", "IPythonCacheLocator", "ZipCacheLocator"
IMPORT = re.compile(
    r"^[ \t]*(?:from[ \t]+([.\w]+)[ \t]+import[ \t]+(\([^)]*\)|[^\n#]*)|import[ \t]+([^\n#]*))", re.MULTILINE
)

DAYS = 30  # kernels that were not asked for so long are removed
VERSIONS = 8  # sources of one file whose kernels are kept
OTHERS_WRITE = 0o022

# for a kernel that allocates nothing and returns numbers, never an array, as does all that it calls: references to its
# arrays are not counted. To count one is an atomic operation, and numba leaves some in the loops
UNCOUNTED = {"_nrt": False}

_COMPILING = event.TimingListener()
event.register("numba:compile", _COMPILING)


def compile_time() -> float:
    """How long this process has compiled kernels so far [s]; what was read from the cache took none of it."""
    return _COMPILING.duration if _COMPILING.done else 0.0


def working_time() -> float:
    """Wall time less what was spent compiling, from some moment on [s]: by it models tell what they cost, for kernels
    are compiled once."""
    return time.perf_counter() - compile_time()


def njit(*given: Any, **options: Any) -> Any:
    """numba's decorator `njit`; what it caches lies in `SealedFiles`."""
    made = numba.njit(*given, **options)
    return _seal(made) if given and callable(given[0]) else lambda function: _seal(made(function))


def _seal(kernel: Any) -> Any:
    cache = getattr(kernel, "_cache", None)
    if isinstance(cache, FunctionCache) and isinstance(cache._impl.locator, SourcesLocator):
        stamp = cache._impl.locator.get_source_stamp()
        cache._cache_file = SealedFiles(cache.cache_path, cache._impl.filename_base, stamp)
    return kernel


class SealedFiles(IndexDataCacheFile):
    """numba's files of one kernel, one for each signature and named by it, each after the SHA-256 of its content. There
    is no index: of two processes that add to one at once the later drops the earlier one's entry and may keep its code
    under the other signature. What is damaged, or not the user's own, counts as not there and is removed."""

    def save(self, key, data):
        content = self._dump((key, data))
        with self._open_for_write(self._path(key)) as file:
            if os.name != "nt":
                os.fchmod(file.fileno(), 0o600)
            file.write(hashlib.sha256(content).digest() + content)

    def load(self, key):
        """What was saved for a key: signature, processor, code of the function; None: not compiled yet."""
        try:
            found, data = self._read(Path(self._path(key)))
        except FileNotFoundError:
            return None
        return data if found == key else None

    def _path(self, key) -> str:
        """numba's own pattern, with a digest in place of the number."""
        name = hashlib.sha256(repr((self._source_stamp, key)).encode()).hexdigest()
        return self._data_path(self._data_name_pattern.replace("{number:d}", name))

    @staticmethod
    def _read(path: Path) -> Any:
        """The object in a file; FileNotFoundError if it is not whole."""
        with open(path, "rb") as file:
            own, total = _own(os.fstat(file.fileno())), file.read()
        seal, content = total[:32], total[32:]
        if own and hashlib.sha256(content).digest() == seal:
            return pickle.loads(content)
        path.unlink(missing_ok=True)
        raise FileNotFoundError(path)


def _own(status: os.stat_result) -> bool:
    """Whether a file or folder is this user's, and nobody else may write it."""
    return os.name == "nt" or (status.st_uid == os.getuid() and not status.st_mode & OTHERS_WRITE)


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
    """SHA-256 over numba's version and the names within the project and contents of `sources(file)`."""
    total = hashlib.sha256(f"{numba.__version__}\n".encode())
    for path in sources(file):
        text = path.read_bytes()
        total.update(f"{path.relative_to(ROOT).as_posix()} {len(text)}\n".encode() + text)
    return total.hexdigest()


@functools.cache
def folder() -> Path:
    """Where compiled kernels are kept. A temporary folder where the user's cache cannot be written; with a warning,
    where it is not the user's alone."""
    return lasting_folder() or Path(tempfile.mkdtemp(prefix="rail_fem_"))


@functools.cache
def lasting_folder() -> Path | None:
    """The same where the next process finds it again; None where that would be a temporary folder."""
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    path = Path(os.environ.get("NUMBA_CACHE_DIR") or home / "rail_fem" / "kernels")
    try:
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not _own(path.stat()):
            warnings.warn(
                f"{path} belongs to another user or may be written by others: what it holds would be executed, so its"
                " kernels are not read, and are compiled anew in a temporary folder. Remove it (it is made again), or"
                " name a folder of your own by NUMBA_CACHE_DIR.",
                RuntimeWarning,
                stacklevel=2,
            )
        elif os.access(path, os.W_OK):
            return path
    except OSError:
        pass
    return None


def _prune(stem: str) -> None:
    """Remove kernels that nobody asked for in DAYS, and of files named `stem` all but those of the latest VERSIONS."""
    age, ours = time.time() - DAYS * 86400, re.compile(r"(\w+)_[0-9a-f]{16}")
    found = []
    for entry in folder().iterdir():
        with contextlib.suppress(FileNotFoundError):  # another process removed it
            found += [(entry.stat().st_mtime, entry)] if ours.fullmatch(entry.name) else []
    same = sorted((entry for entry in found if entry[1].name[:-17] == stem), reverse=True)
    for path in {entry for used, entry in found if used < age} | {entry for _, entry in same[VERSIONS - 1 :]}:
        shutil.rmtree(path, ignore_errors=True)  # a process that runs on them compiles what it still needs


class SourcesLocator(_CacheLocator):
    """Where numba keeps the kernels of one project file, and the digest that they are valid for."""

    def __init__(self, file: Path, line: int):
        self.file, self.line = file, line
        self._py_file = str(file)  # for numba's warning of a kernel that it cannot keep (NUMBA_OPT=0)

    @classmethod
    def from_function(cls, function, file):
        """A locator for a function of this project's packages; None for anybody else's."""
        path = Path(file).resolve()
        inside = path.is_relative_to(ROOT) and path.relative_to(ROOT).parts[0] in PACKAGES
        return cls(path, function.__code__.co_firstlineno) if inside else None

    def get_cache_path(self):
        """Folder of the file's kernels, named by its sources: numba reads an index before it looks at its stamp, and
        cannot where the index names a class that is gone, so an index of other sources must not be found."""
        path = folder() / f"{self.file.stem}_{self.get_source_stamp()[:16]}"
        try:
            os.utime(path)
        except OSError:  # not there yet
            _prune(self.file.stem)
        return str(path)

    def get_source_stamp(self):
        """Digest of the file and of all that it imports from this project."""
        return digest(self.file)

    def get_disambiguator(self):
        """Line of the function: tells functions of one name apart."""
        return str(self.line)


def whole_vectors(features: str) -> str:
    """A processor's features as LLVM names them, with vectors of 512 bits where it has such. LLVM takes half of them on
    Intel's, for programs that use them seldom and would be clocked lower for it; a step is little else."""
    return f"{features},-prefer-256-bit" if "+avx512f" in features.split(",") else features


if numba.config.CPU_FEATURES is None:  # not the user's own, NUMBA_CPU_FEATURES
    numba.config.CPU_FEATURES = whole_vectors(get_host_cpu_features())

if __name__ not in numba.config.CACHE_LOCATOR_CLASSES:
    others = numba.config.CACHE_LOCATOR_CLASSES or ",".join(NUMBAS_OWN)
    numba.config.CACHE_LOCATOR_CLASSES = f"{__name__}.{SourcesLocator.__name__},{others}"
