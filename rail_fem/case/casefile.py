"""Case files: TOML text to a typed scene and typed numerics, with every input error reported at once."""

from __future__ import annotations

import copy
import functools
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from pydantic import ValidationError

from rail_fem.case.casetext import CaseTextError, located, read_table
from rail_fem.hierarchy import MODELS
from rail_fem.scene.input_errors import Tables, belongs, describe_errors, plain, quoted, suggest
from rail_fem.scene.scene import LOAD_KEYS, NO_VALUE, Frozen, Scene
from rail_fem.scene.units import typed
from rail_fem.settings.explicit import PRESETS
from rail_fem.settings.light import PassSettings

if TYPE_CHECKING:
    from rail_fem.settings.damage import DamageSettings

CASE_VERSION = 1
LONGEST_TITLE = 200
MOST_ERRORS = 50  # told of one file
MOST_TOLD = 3  # changes in a title
FEWEST_ROWS = 10  # of a history
OWN_PATH = "fe_window"  # the model that finds its path itself
OTHER_FILES = {"rows": "sweep", "fleet": "sweep", "vary": "design"}  # what reads them, by a key that no case has
TOP_KEYS = ("version", "title", "scene", "run", "damage")


Settings = TypeVar("Settings", bound=Frozen)


class CaseError(ValueError):
    """A case file that cannot be run.

    Parameters
    ----------
    path : Path
        The file.
    errors : list of str
        All of its input errors, a line each: key, what stands there, what to write.

    Examples
    --------
    >>> try:
    ...     rail_fem.load_case(rail_fem.example("nose_transfer"), {"scene.speed": "900 mph"})
    ... except rail_fem.CaseError as error:
    ...     print(len(error.errors), "scene.speed" in error.errors[0])
    1 True
    """

    def __init__(self, path: Path, errors: list[str]):
        self.path, self.errors = path, errors
        super().__init__("\n  ".join([f"{path}: {len(errors)} input error(s)", *errors]))

    def __reduce__(self):
        return CaseError, (self.path, self.errors)  # as it goes from rank to rank


@dataclass(frozen=True)
class Case:
    """A scene and, by the name of the model, its numerics.

    Parameters
    ----------
    path : Path
        The case file.
    title : str
        As the file says.
    scene : Scene
        What is there: physics alone.
    runs : mapping of str to settings
        Numerics of each model that the file names, by the model's name.
    changes : mapping of str to value
        What was read in place of the file's values, by key.
    name : str
        Of its folder in a sweep.
    damage : DamageSettings or None
        Of a damage study, where the file has one.

    Examples
    --------
    >>> case = rail_fem.load_case(rail_fem.example("nose_transfer"))
    >>> "fe_full" in case.runs, case.scene.direction
    (True, 'facing')
    """

    path: Path
    title: str
    scene: Scene
    runs: Mapping[str, Frozen]
    changes: Mapping[str, Any] = field(default_factory=dict)
    name: str = ""
    damage: DamageSettings | None = None

    def settings(self, kind: type[Settings]) -> Settings:
        """Numerics of the model that takes this kind.

        Parameters
        ----------
        kind : type
            The model's class of settings, as `rail_fem.MODELS[name].settings`.

        Raises
        ------
        KeyError
            Where the case does not run that model.
        """
        for run in self.runs.values():
            if type(run) is kind:
                return run
        raise KeyError(f"{self.path}: runs no model by {kind.__name__}")

    def by(self, model: str) -> Case:
        """The same case, which runs this model.

        Parameters
        ----------
        model : str
            A name of `rail_fem.MODELS`. Where the file does not name it, it runs by its defaults, over the path of the
            file's most expensive model.

        Returns
        -------
        Case

        Raises
        ------
        CaseError
            Where these do not fit the scene.
        """
        if model in self.runs:
            return self
        kind, path = MODELS[model].settings, {}
        if "start" in kind.model_fields and model != OWN_PATH:
            runs: list[Any] = [self.runs[name] for name in MODELS if name in self.runs and name != OWN_PATH]
            ends = [(run.start, run.end) for run in runs if hasattr(run, "start") and None not in (run.start, run.end)]
            path = dict(zip(("start", "end"), self.scene.in_order_of_travel(*ends[-1]))) if ends else {}
        settings = kind(**path)
        if errors := _disagreements(self.scene, model, settings):
            raise CaseError(self.path, errors)
        return replace(self, runs={**self.runs, model: settings})


def load_case(path: Path | str, changes: Mapping[str, Any] | None = None, name: str = "") -> Case:
    """Read and check a case file. Nothing is meshed or written.

    Parameters
    ----------
    path : Path or str
        The file; or the name of an example that comes along, "nose_transfer" (`rail-fem list`).
    changes : mapping of str to value, optional
        Values in place of the file's, by keys such as "scene.speed" or "run.lumped.start", written as in the file.
    name : str, optional
        Of the case in a sweep; none: the file's.

    Returns
    -------
    Case

    Raises
    ------
    CaseError
        With all input errors of the file.

    Examples
    --------
    >>> case = rail_fem.load_case(rail_fem.example("nose_transfer"), {"scene.speed": "100 mph"})
    >>> round(case.scene.speed, 3)  # [m/s]
    44.704
    """
    path = located(path)
    table = _read_table(path)
    command = next((OTHER_FILES[key] for key in OTHER_FILES if key in table and "scene" not in table), None)
    if command:
        raise CaseError(path, [f"is no case but names the case that it changes: 'rail-fem {command}' takes it"])
    changes = {} if changes is None else changes
    if not isinstance(changes, Mapping) or not all(isinstance(key, str) for key in changes):
        raise CaseError(path, [f'changes: {typed(changes)}: give them by their keys, {{"scene.speed": "60 mph"}}'])
    for key, value in changes.items():
        _change(table, key, value, path)
        holder, _, last = key.rpartition(".")
        if holder == "scene.vehicle" and value not in NO_VALUE and f"{holder}.{LOAD_KEYS.get(last)}" not in changes:
            table["scene"]["vehicle"].pop(LOAD_KEYS.get(last), None)
        if holder.startswith("run.") and last == "preset" and value not in NO_VALUE:  # in place of the file's own
            for given in set().union(*PRESETS.values()):
                if f"{holder}.{given}" not in changes:
                    table["run"][holder.removeprefix("run.")].pop(given, None)
    version = table.get("version", CASE_VERSION)
    if version != CASE_VERSION or isinstance(version, bool):
        raise CaseError(
            path,
            [
                f"version: the file is of case version {quoted(version)}, this program reads version {CASE_VERSION}: "
                "use the program that the file was written for, or rewrite it after cases/nose_transfer.toml"
            ],
        )
    tables = functools.partial(_tables, table.get("run"))
    strange = [key for key in table if key not in TOP_KEYS]
    errors = [f"{plain(key)}: unknown key{belongs(key, tables()) or suggest(key, TOP_KEYS)}" for key in strange]
    title = table.get("title", path.stem)
    if not isinstance(title, str) or not title.isprintable() or len(title) > LONGEST_TITLE:
        errors.append(
            f'title: {typed(title)} is not a line of text of at most {LONGEST_TITLE} characters, write e.g. "nose'
            ' transfer, facing"'
        )
    context = {"units_required": True, "folder": path.resolve().parent}
    scene = _read_section(Scene, table.get("scene"), "scene", context, errors, tables)
    damage, asked = None, table.get("damage")
    if asked is not None:
        from rail_fem.settings.damage import DamageSettings

        damage = _read_section(DamageSettings, asked, "damage", context, errors, tables)
    # a damage study needs no model of its own
    runs = {} if asked is not None and "run" not in table else _read_runs(table.get("run"), context, errors, tables)
    if scene is not None:
        errors += [error for name, run in runs.items() for error in _disagreements(scene, name, run)]
    if errors:
        more = [f"and {len(errors) - MOST_ERRORS} more"] if len(errors) > MOST_ERRORS else []
        raise CaseError(path, errors[:MOST_ERRORS] + more)
    return Case(
        path,
        f"{title}; changed: {_told(changes)}" if changes else title,
        scene,
        runs,
        dict(changes),
        name or path.stem,
        damage,
    )


def _told(changes: Mapping[str, Any]) -> str:
    """What was changed in words: the scene first, and how many more than a title has room for."""
    first = sorted(changes, key=lambda key: not key.startswith("scene."))
    words = [f"{_words_of(key)} {_value_in_words(changes[key])}".rstrip() for key in first[:MOST_TOLD]]
    return ", ".join([*words, *([f"{len(first) - MOST_TOLD} more"] if len(first) > MOST_TOLD else [])])


def _words_of(key: str) -> str:
    """ "scene.crossing.wing_raise" -> "crossing wing raise", "run.fe_full.element_size" -> "element size"."""
    words = " ".join(key.split(".")[1 if key.startswith("scene.") else -1 :]).replace("_", " ")
    return re.sub(r"\b(\w+) \1\b", r"\1", words)


def _value_in_words(value: Any) -> str:
    if isinstance(value, Mapping):
        return " ".join(map(_value_in_words, value.values()))
    return ("on" if value else "off") if isinstance(value, bool) else str(value)


def _read_table(path: Path) -> dict[str, Any]:
    try:
        return read_table(path)
    except CaseTextError as error:
        raise CaseError(path, [str(error)]) from error


def _change(table: dict[str, Any], key: str, value: Any, path: Path) -> None:
    *sections, last = key.split(".")
    if last.isdecimal():  # an entry of a list
        holder = table
        for section in sections:
            holder = holder.get(section, {}) if isinstance(holder, dict) else {}
        if not isinstance(holder, list) or int(last) >= len(holder):
            told = f"{len(holder)} entries, the first is 0" if isinstance(holder, list) else "no list in this case"
            raise CaseError(path, [f"{key}: cannot be changed, {sections[-1]} has {told}"])
        key, value = ".".join(sections), [*holder[: int(last)], value, *holder[int(last) + 1 :]]
        *sections, last = sections
    for section in sections:
        if isinstance(table.get(section), str) and sections[:2] == ["scene", "materials"]:
            table[section] = {"grade": table[section]}  # a steel may stand there by its grade alone
        table = table.setdefault(section, {})
        if not isinstance(table, dict):
            raise CaseError(path, [f"{key}: cannot be changed, {section} is no table"])
    table[last] = copy.deepcopy(value)  # a later key may change an entry of it


def _tables(run: Any) -> dict[str, type[Frozen]]:
    """All tables of a case by their names, of models those that it runs first."""
    from rail_fem.settings.damage import DamageSettings

    names = sorted(MODELS, key=lambda name: not isinstance(run, dict) or name not in run)
    return {"scene": Scene, **{f"run.{name}": MODELS[name].settings for name in names}, "damage": DamageSettings}


def _read_section(section: type[Frozen], value: Any, key: str, context: dict, errors: list[str], tables: Tables) -> Any:
    if value is None:
        errors.append(f"{key}: missing, write a table [{key}]")
        return None
    try:
        return section.model_validate(value, context=context)
    except ValidationError as error:
        errors += describe_errors(error, section, key, 4 * MOST_ERRORS, tables)
        return None


def _read_runs(value: Any, context: dict, errors: list[str], tables: Tables) -> dict[str, Frozen]:
    if not isinstance(value, dict) or not value:
        errors.append(f"run: missing, write a table [run.MODEL] (it may be empty); models: {', '.join(MODELS)}")
        return {}
    runs = {}
    for name, table in value.items():
        if name not in MODELS:
            errors.append(f"run.{plain(name)}: unknown model{suggest(name, MODELS)}; models: {', '.join(MODELS)}")
            continue
        settings = _read_section(MODELS[name].settings, table, f"run.{name}", context, errors, tables)
        if settings is not None:
            runs[name] = settings
    return runs


def _disagreements(scene: Scene, name: str, run: Frozen) -> list[str]:
    """Input errors that only scene and numerics together show, whether the model is run or not."""
    start, end = (
        run.window(scene) if isinstance(run, PassSettings) else (getattr(run, "start", None), getattr(run, "end", None))
    )
    if start is None or end is None:
        return []
    if not {"start", "end"} & run.model_fields_set:  # a path that nobody gave has no direction
        start, end = scene.in_order_of_travel(start, end)
    if (end - start) * scene.direction_sign <= 0:
        side = "above" if scene.direction_sign > 0 else "below"
        return [
            f"run.{name}.end: {end * 1e3:g} mm must lie {side} start {start * 1e3:g} mm for a {scene.direction} pass:"
            " exchange the two"
        ]
    return [
        f"run.{name}.{error}"
        for error in (*_too_long(scene.travel_time(start, end), run), *late_approach(scene, start, run))
    ]


def _too_long(duration: float, run: Any) -> list[str]:
    """Times that do not fit into a pass of `duration` [s]."""
    whole = f"the pass takes {duration * 1e3:.4g} ms"
    errors = []
    if getattr(run, "settle_time", 0.0) >= duration:
        errors.append(
            f"settle_time: {run.settle_time * 1e3:g} ms, but {whole}: the wheel would never be let go; settle for less,"
            " or run farther"
        )
    if duration < FEWEST_ROWS * run.history_interval:
        errors.append(
            f"history_interval: {run.history_interval * 1e6:g} us gives {duration / run.history_interval:.2g} rows,"
            f" {whole}; at most {duration / FEWEST_ROWS * 1e6:.3g} us gives {FEWEST_ROWS}"
        )
    return errors


def late_approach(scene: Scene, start: float, run: Frozen) -> list[str]:
    """Why a rigid wheel cannot begin where approach_start says, ahead of a window from `start` [m]."""
    approach = getattr(run, "approach_start", None)
    if approach is None or (start - approach) * scene.direction_sign > 0:
        return []
    return [
        f"approach_start: {approach * 1e3:g} mm lies behind start {start * 1e3:g} mm of a {scene.direction} pass: begin"
        " the approach ahead of it"
    ]
