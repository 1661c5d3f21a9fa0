"""The run folder that the examples of the explicit model look at: the reference pass, coarse and short, made once.

What it finds has no meaning beyond the examples: elements of 6 mm resolve no plastic strain. In your own script put the
folder of your run in its place, e.g. ``folder = Path("runs/nose_transfer")``.
"""

import contextlib
import fcntl
import hashlib
import io
from pathlib import Path

import rail_fem
from rail_fem.result.runfolder import digest, fingerprint
from rail_fem.run.job import run_case

RUNS = Path(__file__).resolve().parents[1] / "_build" / "runs"
CHANGES = {
    "run.fe_full.element_size": "6 mm",
    "run.fe_full.element_aspect": 1,
    "run.fe_full.wheel_element_ratio": 1,
    "run.fe_full.start": "335 mm",
    "run.fe_full.end": "375 mm",
    "run.fe_full.field_frames": 8,
}


def coarse_pass() -> Path:
    """The folder of the finished coarse pass, under the name of its case and of the program that made it; made where it
    is not there. Scripts that run at the same time wait for the first of them."""
    case = rail_fem.load_case(rail_fem.example("nose_transfer"), CHANGES)
    mark = digest(fingerprint("fe_full", case.scene, case.runs["fe_full"]))
    folder = RUNS / f"coarse_pass_{mark[:8]}_{_program()[:8]}"
    RUNS.mkdir(parents=True, exist_ok=True)
    with open(RUNS / "lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / "result.json").is_file():
            with contextlib.redirect_stdout(io.StringIO()):  # its progress is no output of the example
                fault = run_case(case, "fe_full", folder, restart=folder.exists(), overwrite=False, say=print)
            if fault:
                raise RuntimeError(fault)
    return folder


def _program() -> str:
    """SHA-256 of the program's sources: a changed program makes the pass again."""
    root = Path(rail_fem.__file__).resolve().parents[1]
    sources = sorted(path for room in ("geometry", "bem", "rail_fem") for path in (root / room).rglob("*.py"))
    return hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()
