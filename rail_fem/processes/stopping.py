"""SIGINT and SIGTERM end the program in one way at any moment: what must be said is said, and the process ends as by a
kill.

A queue, a user or mpirun may send them while modules are imported, kernels compiled, a mesh made, or a message of
another rank awaited:
there a handler of Python's waits for minutes or breaks off inside a library, and mpirun kills after a second. So a
thread answers that the interpreter's C level wakes. So hard an end loses nothing: every file of a run appears whole or
not at all.
"""

import contextlib
import ctypes
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator

ENDING = (signal.SIGINT, signal.SIGTERM)
PARENT_DEATH_SIGNAL = 1  # PR_SET_PDEATHSIG of Linux
_process_control = ctypes.CDLL(None).prctl if sys.platform == "linux" else None
AGAIN = "stopped; the same command goes on"  # of a sweep or a design, which know no --restart
_last_words: list[Callable[[], str]] = []


def listen() -> None:
    """From now on the two signals end this process so; what it was started to ignore it ignores. From the main thread,
    for a program of its own."""
    heard, woken = os.pipe()
    os.set_blocking(woken, False)
    signal.set_wakeup_fd(woken, warn_on_full_buffer=False)
    for number in ENDING:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, lambda *_: None)  # the thread acts; without a handler nothing would wake it
    if sys.platform != "win32":  # PETSc aborts by it where nobody reads what is printed
        signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGPIPE])
    threading.Thread(target=_answer, args=(heard,), daemon=True).start()


def end_with_parent(number: int = signal.SIGKILL) -> None:
    """Called in a process that works for another one: it is sent this signal when that one dies, even by a kill.
    Linux only; elsewhere it outlives a kill."""
    if _process_control is not None:
        _process_control(PARENT_DEATH_SIGNAL, int(number))


@contextlib.contextmanager
def last_words(action: Callable[[], str]) -> Iterator[None]:
    """Should the program be stopped meanwhile, `action` is called, in another thread, and what it returns is said: of
    several, all called, what the first that was entered says."""
    _last_words.append(action)
    try:
        yield
    finally:
        _last_words.remove(action)


def _answer(heard: int) -> None:
    while (number := os.read(heard, 1)[0]) not in ENDING:
        pass
    said = ""
    for action in reversed(_last_words):
        with contextlib.suppress(Exception):
            said = action() or said
    if said or "OMPI_COMM_WORLD_RANK" not in os.environ:  # of many ranks the one that has something to say
        with contextlib.suppress(OSError):
            os.write(2, f"\n{signal.Signals(number).name}: {said or 'stopped'}\n".encode())
    os._exit(128 + number)
