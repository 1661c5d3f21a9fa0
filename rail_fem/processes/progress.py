"""How far a run is: status.json for machines, a bar for a terminal, plain lines for a log."""

import contextlib
import json
import logging
import math
import os
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, TextIO

from rail_fem.files import lock
from rail_fem.files.atomic import write_text_atomically
from rail_fem.processes import launcher
from rail_fem.processes.stopping import last_words

LOG = logging.getLogger(__name__)
STATUS_FILE = "status.json"
GO_ON = "stopped, go on with --restart"
BEFORE_STEPS = 8.0  # between lines of a log while no step is taken; with what a look takes, below ten [s]
WAIT = 0.5  # for a status that is being written when the run is stopped [s]


def print_on(stream: TextIO, text: str, unheard: type[OSError] = OSError) -> None:
    """Print; where nobody reads it any more (`| head`), or its disk is full, nothing more is said and a run goes on."""
    try:
        print(text, file=stream, flush=True)
    except unheard:
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


class Progress:
    """Reports of one run; every rank may hold one, only the root's writes (`active`).

    with Progress(folder, title="nose transfer") as progress:
        progress.update(step=120, time=1e-3, end_time=10e-3, energy_balance=1e-4)

    Until a step is taken, and between the parts of a run, a thread tells what goes on, in meshing and compilation too.
    status.json is replaced at most every `interval` seconds, and always at the end, with
    state (running, finished, cut off, failed, stopped), percent, eta [s], step, time [s], end_time [s], energy_balance
    [1], message, updated (clock time), and of the process: host, pid, began.
    """

    def __init__(
        self,
        folder: Path | None,
        title: str = "",
        active: bool = True,
        interval: float = 2.0,
        line_interval: float = 30.0,
        stream: TextIO | None = None,
    ):
        self.path = None if folder is None else Path(folder) / STATUS_FILE
        self.title, self.active, self.interval, self.line_interval = title, active, interval, line_interval
        self.stream = sys.stdout if stream is None else stream
        self.status: dict[str, Any] = {
            "state": "running",
            "percent": 0.0,
            "eta": None,
            "step": 0,
            "time": 0.0,
            "end_time": None,
            "energy_balance": None,
            "message": "",
            **lock.this_process(),
        }
        self._bar: Any = None
        self._cut_off = ""
        self._writing, self._words = threading.Lock(), contextlib.ExitStack()
        self._started = self._told = time.monotonic()
        self._written: float | None = None
        self._lined: float | None = None
        self._stretch, self._part = (0.0, 1.0), ""  # of the whole run that `update` tells of, and its name
        self._begun: tuple[float, float] | None = None  # share of the whole and clock at the first `update` of a part
        self._over = threading.Event()

    def __enter__(self) -> "Progress":
        self._started = self._told = time.monotonic()
        if self.active:
            self._words.enter_context(last_words(self._stopped))
            self._write()
            # mpirun gives its ranks a terminal of its own
            if self.stream.isatty() and "OMPI_COMM_WORLD_RANK" not in os.environ:
                self._open_bar()
            threading.Thread(target=self._watch, daemon=True).start()
        return self

    def __exit__(self, kind, error, trace) -> None:
        self._over.set()
        if kind is None:
            self._end("cut off" if self._cut_off else "finished", self._cut_off)
        elif issubclass(kind, KeyboardInterrupt):
            self._end("stopped", GO_ON)
        else:
            self._end("failed", f"{kind.__name__}: {error}")
        self._words.close()

    def _stopped(self) -> str:
        """Last words of a run that is stopped, in another thread: what the run itself writes at this moment comes
        before, and nothing after."""
        self._writing.acquire(timeout=WAIT)  # never given back
        if self.status["state"] == "running":
            self.status.update(state="stopped", message=GO_ON, eta=None)
            self._save()
        if self._bar:
            self._bar.console.show_cursor()
        return GO_ON

    def update(
        self, step: int, time: float, end_time: float, energy_balance: float = math.nan, message: str = ""
    ) -> None:
        """Tell how far the run is. Cheap when nothing is due; rank-local.

        time, end_time : simulation time [s];  energy_balance : relative balance error [1]
        """
        if not self.active:
            return
        now = _clock()
        low, high = self._stretch
        fraction = low + (high - low) * (min(max(time / end_time, 0.0), 1.0) if end_time > 0 else 0.0)
        if self._begun is None:
            self._begun = fraction, now  # a restart begins part of the path
        self.status.update(
            percent=round(100 * fraction, 2),
            eta=self._eta(fraction, now),
            step=int(step),
            time=float(time),
            end_time=float(end_time),
            energy_balance=_finite(energy_balance),
            message=message or self._part,
        )
        if self._written is None or now - self._written >= self.interval:
            self._write()
        self._show(now)

    @contextlib.contextmanager
    def part(self, start: float, end: float, name: str = "") -> Iterator[None]:
        """What is told inside is this stretch of the run, 0 to 1, or of the part of it that this is called in."""
        outer = self._stretch, self._part
        low, width = self._stretch[0], self._stretch[1] - self._stretch[0]
        self._stretch, self._part, self._begun = (low + width * start, low + width * end), name or self._part, None
        try:
            yield
        finally:
            self._stretch, self._part = outer

    def before_the_first_step(self, text: str) -> None:
        """Tell what goes on while there is no simulation time yet, as often as is due; rank-local."""
        self.status["message"] = f"{self._part}: {text}" if self._part else text
        self._tell_what_goes_on()

    def _tell_what_goes_on(self) -> None:
        """The message into status.json and the log, where no step has told of itself for long enough."""
        if not self.active or self._begun is not None:
            return
        now = _clock()
        if self._written is None or now - self._written >= self.interval:
            self._write()
        if not self._bar and now - self._told >= BEFORE_STEPS:
            self._told = now
            what = self.status["message"] or "before the first step"
            print_on(self.stream, f"{what} ({duration(now - self._started)})")

    def _watch(self) -> None:
        while not self._over.wait(min(self.interval, 1.0)):
            self._tell_what_goes_on()

    def cut_off(self, why: str) -> None:
        """The run ends before its end, as its settings ask."""
        self._cut_off = why

    def note(self, text: str) -> None:
        """One line of plain news ("mesh: 180 000 cells") of what comes before the next steps; root only. It is logged
        where nothing is shown, too."""
        if launcher.rank() == 0:
            LOG.info(text)
        if not self.active:
            return
        text = f"{self._part}: {text}" if self._part else text
        self.status["message"], self._told, self._begun = text, _clock(), None
        self._write()
        if self._bar:
            self._bar.console.print(text, highlight=False)
        else:
            print_on(self.stream, text)

    def _eta(self, fraction: float, now: float) -> float | None:
        """By the pace since this part's first step: meshes and compilation before it do not come again."""
        first, since = self._begun or (fraction, now)
        return round((1 - fraction) * (now - since) / (fraction - first), 1) if fraction > first else None

    def _write(self) -> None:
        with self._writing:
            self._written = _clock()
            self._save()

    def _save(self) -> None:
        self.status["updated"] = time.strftime("%Y-%m-%dT%H:%M:%S%z")
        if self.path is not None:
            write_status(self.path.parent, self.status)

    def _show(self, now: float) -> None:
        if self._bar:
            self._bar.update(
                self._task,
                completed=self.status["percent"],
                step=self.status["step"],
                balance=_percent(self.status["energy_balance"]),
            )
        elif self._lined is None or now - self._lined >= self.line_interval:
            self._lined = now
            print_on(self.stream, self.line())

    def line(self) -> str:
        """The status as one plain line."""
        status = self.status
        eta = "unknown" if status["eta"] is None else duration(status["eta"])
        return (
            f"{status['percent']:5.1f} %  step {status['step']}  t {status['time'] * 1e3:.3f} ms"
            f"  energy balance {_percent(status['energy_balance'])}  eta {eta}"
        )

    def _open_bar(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
        from rich.progress import Progress as Bar

        self._bar = Bar(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.percentage:5.1f} %"),
            TimeRemainingColumn(),
            TextColumn("step {task.fields[step]}  energy balance {task.fields[balance]}"),
            console=Console(file=self.stream),
        )
        self._task = self._bar.add_task(self.title or "run", total=100.0, step=0, balance="unknown")
        self._bar.start()

    def _end(self, state: str, message: str) -> None:
        if not self.active:
            return
        self.status.update(state=state, message=message, eta=0.0 if state == "finished" else None)
        if state == "finished":
            self.status["percent"] = 100.0
        if self._bar:
            self._bar.stop()
        self._write()


def duration(seconds: float) -> str:
    """Seconds as 45 s, 12 min, or 3.4 h."""
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"


def read_status(folder: Path) -> dict[str, Any]:
    """What status.json says; "died" for a run whose process is gone without a word. Errors: FileNotFoundError,
    ValueError for a damaged file."""
    path = Path(folder) / STATUS_FILE
    try:
        status = json.loads(path.read_text(encoding="utf-8"))
        if status["state"] == "running" and "pid" in status and lock.is_dead(status):
            status |= {
                "state": "died",
                "eta": None,
                "message": f"process {status['pid']} ended without a word; go on with --restart",
            }
        return {"percent": 0.0, "step": 0, "eta": None, "updated": "unknown", "message": ""} | status
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(
            f"{path}: damaged ({type(error).__name__}: {error}); the run itself can be gone on with by --restart"
        ) from error


def write_status(folder: Path, status: Mapping[str, Any]) -> None:
    """Replace status.json; on a full disk write over the one that is there, which needs no room. Errors: OSError."""
    path, text = Path(folder) / STATUS_FILE, json.dumps(status, allow_nan=False) + "\n"
    try:
        write_text_atomically(path, text)
    except OSError:
        if not path.is_file():
            raise
        with path.open("r+", encoding="utf-8") as stream:
            stream.write(text)
            stream.truncate()


def mark_ended(folder: Path, state: str, message: str) -> None:
    """Set the state in a status file, for a root that cannot or no longer runs. Nothing happens when there is none or
    it cannot be written."""
    try:
        write_status(folder, read_status(folder) | {"state": state, "message": message, "eta": None})
    except (OSError, ValueError):
        return


def _clock() -> float:
    return time.monotonic()


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _percent(value: float | None) -> str:
    return "unknown" if value is None else f"{100 * value:.2f} %"
