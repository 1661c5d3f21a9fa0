"""The folder of one run: who may write into it, and what makes a run restartable.

case.json says which case the folder holds. Nothing in a folder is ever written over unless asked for.
"""

import contextlib
import hashlib
import json
import os
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from rail_fem.files import lock
from rail_fem.files.atomic import PARTIAL, remove_partial, write_text_atomically
from rail_fem.processes.progress import GO_ON, STATUS_FILE
from rail_fem.processes.stopping import last_words
from rail_fem.scene.scene import Frozen, Scene
from rail_fem.scene.wheel_profile import KEPT

MARK = "case.json"
OWN = {MARK, lock.LOCK, STATUS_FILE, KEPT, "result.json", "history.npz", "history.csv", "trust.txt", "damage.json",
       "mesh.npz", "mesh_quality.txt", "checkpoint.npz", "static_start.npz", "crossing_sections.csv"}  # fmt: skip
PROFILE_KEY = "scene.wheel.profile"


class RunFolderError(ValueError):
    """A folder that this run must not write into; the message says what to do."""


class FolderHeld(RunFolderError):
    """Another process runs there."""


def fingerprint(model: str, scene: Scene, settings: Frozen) -> dict[str, Any]:
    """What must agree for a restart: model, scene and numerics as plain values, less what may change between two
    starts."""
    numerics = settings.model_dump(mode="json")
    for name in getattr(settings, "free_on_restart", ()):
        numerics.pop(name)
    return {"model": model, "scene": scene.plain(), f"run.{model}": numerics}


def digest(mark: Mapping[str, Any]) -> str:
    """SHA-256 of a fingerprint: one word for a case, to tie files of a run to it."""
    return hashlib.sha256(json.dumps(mark, sort_keys=True).encode()).hexdigest()


@contextlib.contextmanager
def held(folder: Path) -> Iterator[None]:
    """The folder is this process's alone, and made if need be. Root only under MPI. Errors: RunFolderError, FolderHeld
    naming who else runs there."""
    folder = Path(folder)
    _entries(folder)
    try:
        owner = lock.take(folder)
    except OSError as error:
        raise RunFolderError(
            f"--out {folder}: {error.strerror or error}, choose a folder that can be written"
        ) from error
    if owner is not None:
        raise FolderHeld(f"--out {folder}: {owned(folder, owner, 'wait until it ends, or choose another folder')}")

    def leave() -> str:
        lock.release(folder)
        return GO_ON

    with last_words(leave):
        try:
            yield
        finally:
            lock.release(folder)


def owned(folder: Path, owner: Mapping[str, Any], advice: str) -> str:
    """Who runs in a folder, and what to do: of a process of another host nobody here knows whether it lives."""
    here = owner["host"] == lock.this_process()["host"]
    what = advice if here else f"if it has ended there, remove {folder / lock.LOCK}"
    return f"process {owner['pid']} on {owner['host']} runs there: {what}"


def lost(folder: Path) -> str:
    """A sentence where the folder was removed, emptied or taken by another run since it was `held`; root only."""
    if lock.is_ours(folder) and (Path(folder) / MARK).is_file():
        return ""
    return f"{folder} was removed or emptied while the run went on, which saves nothing there: run it again"


def _entries(folder: Path) -> list[str]:
    """Names of what a folder holds, made if need be, less the lock. Errors: RunFolderError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return sorted(entry.name for entry in folder.iterdir() if entry.name != lock.LOCK)
    except FileExistsError:
        raise RunFolderError(f"--out {folder}: a file of that name exists, choose another folder") from None
    except OSError as error:
        raise RunFolderError(f"--out {folder}: {error.strerror}, choose a folder that can be written") from error


def prepare_folder(folder: Path, case: Mapping[str, Any], restart: bool = False, overwrite: bool = False) -> bool:
    """Make `folder` ready for the case with this fingerprint; True when it holds a run to go on with.

    Root only under MPI, while the folder is `held`. What killed writers left is removed. An empty or absent folder
    starts afresh, also with `restart` (a queue may start the same line again).
    Errors: RunFolderError when the folder holds something else, or cannot be written.
    """
    folder = Path(folder)
    there = [name for name in _entries(folder) if not PARTIAL.fullmatch(name)]
    goes_on = bool(there) and _may_go_on(folder, there, case, restart, overwrite)
    try:
        remove_partial(folder, folder / "fields", folder / "figures")
        if there and overwrite:
            _empty(folder)
        write_text_atomically(folder / MARK, json.dumps(case, indent=1) + "\n")
    except OSError as error:
        raise RunFolderError(f"--out {folder}: {error.strerror}, choose a folder that can be written") from error
    return goes_on


def _may_go_on(folder: Path, there: list[str], case: Mapping[str, Any], restart: bool, overwrite: bool) -> bool:
    if restart and overwrite:
        raise RunFolderError("--restart goes on with what is there, --overwrite removes it: give one of the two")
    if MARK not in there:
        raise RunFolderError(
            f"--out {folder}: holds {len(there)} file(s) that no run wrote, the first is {there[0]}: choose another"
            " folder"
        )
    if overwrite:
        return False
    if not restart:
        raise RunFolderError(
            f"--out {folder}: holds a run already; --restart goes on with it, --overwrite begins again, or choose"
            " another folder"
        )
    if different := differences(_read_mark(folder), case):
        what = f"--out {folder}: holds another case, {len(different)} difference(s); choose another folder"
        raise RunFolderError("\n  ".join([what, *different, *_other_profile(folder, different)]))
    return True


def _other_profile(folder: Path, different: list[str]) -> list[str]:
    """What to do when a restart finds another wheel than its run began with."""
    if not (any(line.startswith(PROFILE_KEY) for line in different) and (folder / KEPT).is_file()):
        return []
    return [
        f"the profile file has changed since the run began: put it back, or name {folder / KEPT}, the profile that the"
        " run used"
    ]


def only_profile_differs(different: list[str]) -> bool:
    """Whether a folder holds the same case but for what its profile file held then."""
    return [line for line in different if not line.startswith(PROFILE_KEY)] == [] != different


def _read_mark(folder: Path) -> dict[str, Any]:
    try:
        return json.loads((folder / MARK).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise RunFolderError(f"--out {folder}: {MARK} cannot be read ({error}); choose another folder") from error


def differences(there: Any, here: Any, key: str = "") -> list[str]:
    """Keys whose plain values differ, with both, one line each."""
    if isinstance(there, dict) and isinstance(here, dict):
        names = [*there, *(name for name in here if name not in there)]
        return [
            line for name in names for line in differences(there.get(name), here.get(name), f"{key}.{name}".lstrip("."))
        ]
    shown = lambda value: f"{value:.15g}" if isinstance(value, float) else value
    return [] if there == here else [f"{key}: {shown(there)} there, {shown(here)} in this case (SI)"]


def _empty(folder: Path) -> None:
    """Remove what an earlier run left; the mark goes last, so that a kill in between leaves a run's folder."""
    for entry in sorted(folder.iterdir(), key=lambda entry: entry.name == MARK):
        if entry.name == lock.LOCK:
            continue
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry)
        else:
            os.unlink(entry)
