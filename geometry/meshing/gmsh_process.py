"""Gmsh in a process of its own, where MPI is not: the library of the Python registry brings an MPI and a PETSc of its
own with it.

Loaded beside Open MPI, its PETSc says at every start that the program was linked against two MPI libraries and will not
run correctly. The child knows neither Open MPI nor the variables by which a launcher speaks to its ranks; it is asked
for one mesh after the other and ends with `gmsh_process`, or with its parent. A Gmsh that crashes or hangs is then an
error of one mesh, not the end of the run.
"""

import os
import pickle
import resource
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TypeVar, cast

from geometry.meshing.hexmesh import MeshError

Answer = TypeVar("Answer")
OF_MPI = ("OMPI_", "PMIX_", "PMI_", "PRTE_")  # variables of a launcher
LONGEST = 600.0  # for one answer [s]; a section takes under a second
LONGEST_READING = 60  # processor time to read a file [s]; a mesh of a million hexahedra takes 10
MOST_MEMORY = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2  # of the child that reads one [bytes]
_mine = threading.local()  # the child of this thread, while a `gmsh_process` is open


def without_mpi(environment: Mapping[str, str]) -> dict[str, str]:
    """An environment without the variables by which an MPI launcher makes a process one of its ranks."""
    return {name: value for name, value in environment.items() if not name.startswith(OF_MPI)}


@contextmanager
def gmsh_process() -> Iterator[subprocess.Popen]:
    """A child that runs Gmsh, shared by all that is asked inside; may be entered again. It ends when the outermost one
    is left."""
    child = getattr(_mine, "child", None)
    if child is not None and child.poll() is None:
        yield child
        return
    root = Path(__file__).resolve().parents[__name__.count(".")]  # of the packages, by whatever name this is imported
    path = os.pathsep.join([str(root), *filter(None, [os.environ.get("PYTHONPATH")])])
    command = [sys.executable, "-P", "-c", f"from {__name__} import serve; serve()"]
    _mine.child = child = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=without_mpi(os.environ) | {"PYTHONPATH": path}
    )
    try:
        yield child
    finally:
        _mine.child = None
        child.kill()
        child.communicate()


def in_gmsh_process(function: Callable[..., Answer], *arguments) -> Answer:
    """function(*arguments), computed in the child. What it raises is raised here; MeshError where the child died or
    gave no answer.

    function : of a module's top level;  arguments and answer : what pickle can send
    """
    with gmsh_process() as child:
        watch = threading.Timer(LONGEST, child.kill)
        watch.start()
        try:
            asked, answered = cast(IO[bytes], child.stdin), cast(IO[bytes], child.stdout)
            pickle.dump((function, arguments), asked)
            asked.flush()
            well, answer = pickle.load(answered)
        except (OSError, EOFError, pickle.UnpicklingError):
            child.kill()
            raise MeshError(
                f"Gmsh's process ended {_manner(child.wait(), watch)}; mend the file that it read, change the element"
                " sizes a little, or see `doctor`"
            ) from None
        finally:
            watch.cancel()
    if not well:
        raise answer
    return answer


def _manner(code: int, watch: threading.Timer) -> str:
    if watch.finished.is_set():
        return f"without an answer in {LONGEST:g} s"
    if code == -signal.SIGPROF:
        return f"without having read the file in {LONGEST_READING} s of processor time"
    return f"by {signal.Signals(-code).name}" if code < 0 else f"with exit code {code}"


@contextmanager
def reading() -> Iterator[None]:
    """In the child: what reads a user's file inside is silent, ended, with the child, after LONGEST_READING, and has
    MOST_MEMORY. Errors: MeshError where that is too little."""
    words, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    before = resource.getrlimit(resource.RLIMIT_DATA)
    resource.setrlimit(resource.RLIMIT_DATA, (min([MOST_MEMORY, *(one for one in before if one >= 0)]), before[1]))
    signal.setitimer(signal.ITIMER_PROF, LONGEST_READING)
    try:
        for stream in (1, 2):
            os.dup2(nowhere, stream)
        yield
    except MemoryError:
        raise MeshError(f"the file takes more than {MOST_MEMORY / 1e9:.3g} GB, half of the memory, to read") from None
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, before)
        signal.setitimer(signal.ITIMER_PROF, 0)
        for stream in (1, 2):
            os.dup2(words, stream)
        os.close(words)
        os.close(nowhere)


def serve() -> None:
    """The child: answers what comes in until its parent has gone. What Gmsh prints goes to stderr."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # of the terminal: the parent decides
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    while True:
        try:
            function, arguments = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        try:
            said = pickle.dumps((True, function(*arguments)))
        except Exception as error:
            said = pickle.dumps((False, error))
        answers.write(said)
        answers.flush()
