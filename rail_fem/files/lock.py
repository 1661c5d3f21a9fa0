"""Who runs in a folder: a file that names host and process, so that no second run writes there, and a dead one is known
as dead.

The file appears with its text and by a hard link, which of two runs started at once one gets, also where machines share
a file system whose file locks are each machine's own (NFS) or none. It stays after a kill; the next run on this host
sees that the process is gone, and takes its place under the system's file lock. Of another host nobody here can know.
"""

import contextlib
import errno
import fcntl
import json
import os
import socket
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, TextIO

LOCK = "run.lock"
TRIES, PAUSE = 50, 0.1  # to look at a file that another process is looking at; seconds


def this_process() -> dict[str, Any]:
    """Host, process, and when it began: a number of a process is given again after its death."""
    return {"host": socket.gethostname(), "pid": os.getpid(), "began": _began(os.getpid())}


def is_dead(owner: Mapping[str, Any]) -> bool:
    """Whether a process of `this_process` is surely gone; of another host it never is."""
    if owner.get("host") != socket.gethostname():
        return False
    try:
        os.kill(int(owner["pid"]), 0)
    except ProcessLookupError:
        return True
    except (PermissionError, OverflowError):
        return False
    return _began(owner["pid"]) != owner.get("began")


def _began(pid: int) -> str | None:
    """Start of a living process, of Linux's clock ticks since the machine's start; None where that is not told, "dead"
    for one only waited for."""
    try:
        words = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()
    except OSError:
        return None
    return "dead" if words[0] in "ZX" else words[19]


def take(folder: Path) -> dict[str, Any] | None:
    """Make the folder this process's; returns its living owner instead if there is one. Errors: OSError."""
    path = Path(folder) / LOCK
    own = path.with_name(f".{LOCK}.{socket.gethostname()}.{os.getpid()}.partial")
    try:
        for _ in range(TRIES):
            own.write_text(json.dumps(this_process()), encoding="utf-8")
            with contextlib.suppress(FileExistsError, FileNotFoundError):  # whoever has the folder clears it
                _place(own, path)
                return None
            with contextlib.suppress(FileNotFoundError), _opened(path) as stream, _alone(stream):
                holder = _read(stream)
                if holder is not None and not is_dead(holder):
                    return holder
                if os.fstat(stream.fileno()).st_ino == path.stat().st_ino:
                    os.replace(own, path)
                    return None
            time.sleep(PAUSE)  # its owner has removed it since it was opened
        raise OSError(f"{path} is made and removed again and again by another process")
    finally:
        own.unlink(missing_ok=True)


def _place(own: Path, path: Path) -> None:
    """A file under a name that no other has. Errors: FileExistsError."""
    try:
        os.link(own, path)
    except OSError as error:
        if error.errno not in (errno.EPERM, errno.ENOTSUP, errno.EMLINK):  # of a file system without hard links
            raise
        os.close(os.open(path, os.O_CREAT | os.O_EXCL, 0o666))
        os.replace(own, path)


def owner(folder: Path) -> dict[str, Any] | None:
    """Who lives and has the folder; None where nobody does."""
    with contextlib.suppress(OSError), _opened(Path(folder) / LOCK) as stream:
        holder = _read(stream)
        return None if holder is None or is_dead(holder) else holder
    return None


def is_ours(folder: Path) -> bool:
    """Whether the folder is still this process's."""
    with contextlib.suppress(OSError), _opened(Path(folder) / LOCK) as stream:
        return _read(stream) == this_process()
    return False


def release(folder: Path) -> None:
    """Remove the lock if it is this process's."""
    path = Path(folder) / LOCK
    with contextlib.suppress(OSError), _opened(path) as stream, _alone(stream):
        if _read(stream) == this_process():
            path.unlink()


def _opened(path: Path) -> TextIO:
    """The lock; not what a link of its name leads to."""
    number = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK)
    return os.fdopen(number, "r+", encoding="utf-8")


def _read(stream: TextIO) -> dict[str, Any] | None:
    """Who is named; None in a file that a kill left empty or in parts."""
    stream.seek(0)
    try:
        holder = json.loads(stream.read())
        return holder if isinstance(holder["pid"], int) and isinstance(holder["host"], str) else None
    except (ValueError, KeyError, TypeError):
        return None


@contextlib.contextmanager
def _alone(stream: TextIO) -> Iterator[None]:
    """The system's lock on an open file; without one where the file system has none, or its owner does not move."""
    for _ in range(TRIES):
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
            break
        except BlockingIOError:
            time.sleep(PAUSE)
        except OSError:
            break
    yield  # closing the file gives it back
