"""Case files: TOML text to a typed scene and typed numerics, with every fault reported at once."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from rail_fem.case.casefaults import describe_faults, suggest
from rail_fem.ladder import LADDER
from rail_fem.scene.scene import Frozen, Scene

CASE_VERSION = 1
TOP_KEYS = ("version", "title", "scene", "run")


class CaseError(ValueError):
    """A case file that cannot be run; `faults` holds one line for each fault."""

    def __init__(self, path: Path, faults: list[str]):
        self.path, self.faults = path, faults
        super().__init__("\n  ".join([f"{path}: {len(faults)} fault(s)", *faults]))

    def __reduce__(self):
        return CaseError, (self.path, self.faults)  # as it goes from rank to rank


@dataclass(frozen=True)
class Case:
    """A scene and, by the name of the model, its numerics."""

    path: Path
    title: str
    scene: Scene
    runs: Mapping[str, Frozen]


def load_case(path: Path, changes: Mapping[str, Any] | None = None) -> Case:
    """Read and check a case file. Nothing is meshed or written. Errors: CaseError with all faults.

    changes : values in place of the file's, by keys such as "scene.speed" or "run.lumped.start"
    """
    path = Path(path)
    table = _read_table(path)
    for key, value in (changes or {}).items():
        _change(table, key, value, path)
    version = table.get("version", CASE_VERSION)
    if version != CASE_VERSION or isinstance(version, bool):
        raise CaseError(path, [f"version: the file is of case version {version!r}, this program reads version {CASE_VERSION}: "
                               "use the program that the file was written for, or rewrite it after cases/nose_transfer.toml"])
    faults = [f"{key}: unknown key{suggest(key, TOP_KEYS)}" for key in table if key not in TOP_KEYS]
    title = table.get("title", path.stem)
    if not isinstance(title, str):
        faults.append(f'title: {title!r} is not text, write e.g. "nose transfer, facing"')
    context = {"units_required": True, "folder": path.resolve().parent}
    scene = _read_section(Scene, table.get("scene"), "scene", context, faults)
    runs = _read_runs(table.get("run"), context, faults)
    if scene is not None:
        faults += [fault for name, run in runs.items() for fault in _disagreements(scene, name, run)]
    if faults:
        raise CaseError(path, faults)
    return Case(path, title, scene, runs)


def _read_table(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except FileNotFoundError:
        raise CaseError(path, ["no such file; the examples lie in cases/"]) from None
    except OSError as error:
        raise CaseError(path, [f"cannot be read: {error.strerror}"]) from error
    except UnicodeDecodeError as error:
        raise CaseError(path, [f"byte {error.start} is not UTF-8 text: save the file as UTF-8"]) from error
    except tomllib.TOMLDecodeError as error:
        raise CaseError(path, [f"not valid TOML: {error}"]) from error


def _change(table: dict[str, Any], key: str, value: Any, path: Path) -> None:
    *sections, last = key.split(".")
    for section in sections:
        table = table.setdefault(section, {})
        if not isinstance(table, dict):
            raise CaseError(path, [f"{key}: cannot be changed, {section} is no table"])
    table[last] = value


def _read_section(section: type[Frozen], value: Any, key: str, context: dict, faults: list[str]) -> Any:
    if value is None:
        faults.append(f"{key}: missing, write a table [{key}]")
        return None
    try:
        return section.model_validate(value, context=context)
    except ValidationError as error:
        faults += describe_faults(error, section, key)
        return None


def _read_runs(value: Any, context: dict, faults: list[str]) -> dict[str, Frozen]:
    if not isinstance(value, dict) or not value:
        faults.append(f"run: missing, write a table [run.MODEL] (it may be empty); models: {', '.join(LADDER)}")
        return {}
    runs = {}
    for name, table in value.items():
        if name not in LADDER:
            faults.append(f"run.{name}: unknown model{suggest(name, LADDER)}; models: {', '.join(LADDER)}")
            continue
        settings = _read_section(LADDER[name].settings, table, f"run.{name}", context, faults)
        if settings is not None:
            runs[name] = settings
    return runs


def _disagreements(scene: Scene, name: str, run: Frozen) -> list[str]:
    """Faults that only scene and numerics together show."""
    start, end = getattr(run, "start", None), getattr(run, "end", None)
    if start is None or end is None or (end - start) * scene.direction_sign > 0:
        return []
    side = "above" if scene.direction_sign > 0 else "below"
    return [f"run.{name}.end: {end * 1e3:g} mm must lie {side} start {start * 1e3:g} mm for a {scene.direction} pass: exchange the two"]
