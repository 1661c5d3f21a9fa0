"""Who runs in a folder: a file that names host and process, so that no second run writes there, and a dead one is known
as dead.

The file is taken under the system's own file lock, where the file system has one, so that of two runs started at once
one is refused. It stays after a kill; the next run on this host sees that the process is gone. Of another host nobody
here can know.
"""

import contextlib
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
    for _ in range(TRIES):
        with _opened(path, os.O_CREAT) as stream, _alone(stream):
            holder = _read(stream)
            if holder is not None and not is_dead(holder):
                return holder
            stream.seek(0)
            stream.truncate()
            stream.write(json.dumps(this_process()))
            stream.flush()
            if path.exists() and os.fstat(stream.fileno()).st_ino == path.stat().st_ino:
                return None
        time.sleep(PAUSE)  # its owner has removed it since it was opened
    raise OSError(f"{path} is made and removed again and again by another process")


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


def _opened(path: Path, more: int = 0) -> TextIO:
    """The lock, to be read and written; not what a link of its name leads to, which writing would empty."""
    number = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK | more, 0o666)
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
