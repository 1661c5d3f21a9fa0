"""The app's server: one page and four answers for one browser on this machine.

It listens on 127.0.0.1 alone. Every request names the token of its address, which nobody else knows, and a Host of
this machine: a page elsewhere, or a name that was bound anew to this machine, reaches nothing. No file is named by a
request. The standard library's server is enough for that; it brings no package to install or to keep.
"""

from __future__ import annotations

import functools
import json
import secrets
import threading
from collections.abc import Mapping
from concurrent.futures import Executor, Future
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from pathlib import Path
from typing import Any

from rail_fem.app.controls import SHOWN, changed, form_of, seen
from rail_fem.case.casefile import CaseError, load_case
from rail_fem.files.strict_json import one_line
from rail_fem.hierarchy import MODELS
from rail_fem.processes.pool import executor
from rail_fem.processes.progress import duration, read_status
from rail_fem.scene.units import typed
from rail_fem.show.page import PAGE, Part, document, heading, remark, text, write_page
from rail_fem.sweeps.sweep import FAILED, Job, Outcome, run_job

HERE = "127.0.0.1"
LARGEST = 65_536  # bytes of a request
PATIENCE = 30.0  # for the rest of a request [s]
HTML, JSON = "text/html; charset=utf-8", "application/json"
HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",  # the address holds the token
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


class App:
    """What the app knows: its case, and the one run that it has started.

    out : folder for runs, OUT/CASE/MODEL as of a sweep;  ranks : of parallel models
    Errors: CaseError, ModuleNotFoundError where plotly is not installed.
    """

    def __init__(self, case: Path, out: Path, ranks: int):
        self.case, self.out, self.ranks = load_case(case), out, ranks
        self._one = threading.Lock()  # a pass, or a start, at a time: the next one finds what this one has searched
        self._workers: Executor | None = None
        self._run: tuple[Job, Future[Outcome]] | None = None
        self.page = self._page()

    def _page(self) -> bytes:
        found = seen(self.case)
        models = "".join(f"<option>{text(model)}</option>" for model in reversed(MODELS) if model != SHOWN)
        parts: list[Part] = [
            '<p id="state" class="words"></p>',
            form_of(self.case),
            '<p><button id="hold">Hold this curve</button> <button id="reset">Back to the case file</button></p>',
            *found.charts,
            f'<div id="told">{found.told}</div>',
            heading("The case that this is"),
            remark("What is seen, in a terminal, and as a case file; keys at their defaults are left out of it."),
            f'<pre id="command">{text(found.command)}</pre>',
            '<p><a id="save" download="case.toml" href="#">Download the case file</a></p>',
            f'<pre id="case">{text(found.case)}</pre>',
            heading("Run it by another model"),
            f'<p><select id="model">{models}</select> <button id="start">Start</button>'
            ' <progress id="bar" max="100" value="0" hidden></progress></p><p id="run" class="words"></p>',
        ]
        script = files(__package__).joinpath("app.js").read_text(encoding="utf-8")
        return document(found.title, parts, script).encode()

    def moved(self, asked: Any) -> dict[str, Any]:
        """The pass of the case with these values. Errors: CaseError, ValueError."""
        with self._one:
            found = seen(changed(self.case, asked))
        return found._asdict() | {"charts": [chart.pictures for chart in found.charts]}

    def start(self, asked: Any) -> dict[str, Any]:
        """Begin a run, or go on with it, in a process of its own. asked : {"model": name, "values": of the controls}

        Errors: CaseError, ValueError where one is running.
        """
        table: Mapping[str, Any] = asked if isinstance(asked, Mapping) else {}
        model = table.get("model")
        if not isinstance(model, str) or model not in MODELS:
            raise ValueError(f"{typed(model)} is no model: choose among {', '.join(MODELS)}")
        with self._one:
            if self._run is not None and not self._run[1].done():
                raise ValueError(f"{self._run[0].folder} is running: one run at a time, wait until it has ended")
            case = changed(self.case, table.get("values")).by(model)
            job = Job(case, model, self.out / case.name / model)
            self.close()  # a process that was ended from outside leaves workers of no use
            self._workers = executor(1, home=run_job.__module__)
            self._run = job, self._workers.submit(run_job, job, self.ranks)
        return self.progress()

    def progress(self) -> dict[str, Any]:
        """Of the run: whether it is running, percent, words, whether there is a page of it."""
        if self._run is None:
            return {"running": False, "percent": 0, "words": "", "page": False}
        job, future = self._run
        try:
            status = read_status(job.folder)
        except (OSError, ValueError):
            status = {"state": "starting", "percent": 0.0, "message": "", "eta": None}
        if not future.done():
            left = "" if status["eta"] is None else f", about {duration(status['eta'])} left"
            words = f"{job.folder}: {status['percent']:.0f} %{left} {status['message']}"
            return {"running": True, "percent": status["percent"], "words": words, "page": False}
        fault = future.exception()
        outcome = Outcome(job, FAILED, f"{type(fault).__name__}: {fault}") if fault else future.result()
        words = ": ".join(filter(None, (str(job.folder), outcome.state, outcome.reason)))
        return {"running": False, "percent": 100, "words": words, "page": outcome.has_result}

    def page_of_run(self) -> bytes | None:
        """The page of the run that has ended; None where there is none. Errors: OSError, ValueError."""
        if self._run is None or not self.progress()["page"]:
            return None
        path = self._run[0].folder / PAGE
        if not path.is_file():
            write_page([path.parent], path)
        return path.read_bytes()

    def close(self) -> None:
        """End the run with its process; `rail-fem sweep` and another start go on with it."""
        if self._workers is not None:
            self._workers.shutdown(wait=False, cancel_futures=True)


class Handler(BaseHTTPRequestHandler):
    """Answers a request where it names the token and this machine."""

    timeout = PATIENCE
    server: Server

    def do_GET(self) -> None:
        self._answer({"": lambda: self.server.app.page, "page": self.server.app.page_of_run}, HTML)

    def do_POST(self) -> None:
        app = self.server.app
        asked = {"pass": app.moved, "start": app.start, "progress": lambda _: app.progress()}
        self._answer({name: functools.partial(self._json, what) for name, what in asked.items()}, JSON)

    def _answer(self, known: Mapping[str, Any], kind: str) -> None:
        _, _, rest = self.path.partition("/")
        token, slash, name = rest.partition("/")
        hosts = [f"{host}:{self.server.server_port}" for host in (HERE, "localhost")]
        allowed = secrets.compare_digest(token.encode(), self.server.token.encode()) and slash
        if not allowed or self.headers.get("Host") not in hosts:
            return self._send(403, "text/plain", b"open the address that rail-fem app has printed\n")
        try:
            body = known[name]() if name in known else None
        except (OSError, ValueError) as error:
            return self._send(500, "text/plain; charset=utf-8", f"{error}\n".encode())
        if body is None:
            return self._send(404, "text/plain", b"nothing here\n")
        self._send(200, kind, body)

    def _json(self, what: Any) -> bytes:
        """The answer to a request in JSON; {"errors": sentences} where it is refused."""
        try:
            length = int(self.headers.get("Content-Length", ""))
            if not 0 <= length <= LARGEST:
                raise ValueError(f"a request of {length} bytes, at most {LARGEST}")
            return one_line(what(json.loads(self.rfile.read(length)))).encode()
        except CaseError as error:
            return one_line({"errors": error.errors}).encode()
        except (ValueError, ArithmeticError, RecursionError) as error:
            return one_line({"errors": [str(error)]}).encode()

    def _send(self, code: int, kind: str, body: bytes) -> None:
        self.send_response(code)
        for name, value in {**HEADERS, "Content-Type": kind, "Content-Length": str(len(body))}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing: the address would stand in a log."""


class Server(ThreadingHTTPServer):
    """Serves an app on a port of this machine, 0 for a free one. Errors: OSError where the port is taken."""

    daemon_threads = True

    def __init__(self, app: App, port: int = 0):
        self.app, self.token = app, secrets.token_urlsafe(24)
        super().__init__((HERE, port), Handler)

    @property
    def address(self) -> str:
        return f"http://{HERE}:{self.server_port}/{self.token}/"
