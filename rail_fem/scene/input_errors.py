"""Input errors of a case file in words: each with its key, the value as typed, and the remedy."""

import difflib
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Literal, cast, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from rail_fem.scene.units import Quantity, typed

Tables = Callable[[], Mapping[str, type[BaseModel]]]  # of a file by their names, asked for where a key is unknown

LONGEST_GUESS = 60  # characters of a word for which a known one is looked for
MOST_GUESSES = 5  # that are looked at


def suggest(word: str, known: Iterable[str]) -> str:
    """', did you mean ...?' when a known word is close, else nothing; before the closest by its letters one that has
    the same last part, the thing that is meant: 'axle_load' or 'wheel_count' for wheel_load."""
    close = difflib.get_close_matches(word, list(known), n=MOST_GUESSES) if 0 < len(word) <= LONGEST_GUESS else []
    first, _, last = word.rpartition("_")
    same = [one for one in close if first and one.rpartition("_")[2] == last]
    guesses = " or ".join(f"'{one}'" for one in dict.fromkeys([*same[:1], *close[:1]]))
    return f", did you mean {guesses}?" if guesses else ""


def belongs(name: str, tables: Mapping[str, type[BaseModel]]) -> str:
    """', it belongs under ...' where one of these tables, or one in them, has a key of exactly this name, else
    nothing."""
    paths = (path for key, table in tables.items() for path in _all_keys(table, key))
    for holder, _, last in (path.rpartition(".") for path in paths):
        if last == name:
            return f", it belongs under [{holder}]" if holder else ", it belongs above all tables"
    return ""


def describe_errors(
    error: ValidationError, section: type[BaseModel], key: str, most: int = 1000, others: Tables = dict
) -> list[str]:
    """One line for each input error, up to `most`, that pydantic found in `section`, which the file calls `key`.
    others : the file's other tables, to which a key may belong"""
    return [": ".join(filter(None, fault)) for fault in faults_of(error, section, key, most, others)]


def faults_of(
    error: ValidationError, section: type[BaseModel], key: str, most: int = 1000, others: Tables = dict
) -> list[tuple[str, str]]:
    """Key, "" for the whole of a section without a name, and remedy of each input error, as in describe_errors."""
    faults = error.errors()[:most]
    holders = {fault["loc"][:end] for fault in faults for end in range(len(fault["loc"]))}
    own = [fault for fault in faults if fault["type"] != "too_short" or fault["loc"] not in holders]  # told by entries
    return [(_dotted(key, _position(fault)), _remedy(fault, section, key, others)) for fault in own]


def _position(error: ErrorDetails) -> tuple:
    """Where an input error is; of the field that it names, if it names one."""
    own = error.get("ctx", {}).get("key")
    return (*error["loc"][:-1], own) if own else error["loc"]


def plain(word: Any) -> str:
    """A key as it was typed, on one short line."""
    return typed(str(word))[1:-1]


def quoted(value: Any) -> str:
    """A value as it was typed, on one short line, text in single quotes."""
    return f"'{plain(value)}'" if isinstance(value, str) else typed(value)


def choices_of(annotation: Any) -> tuple[str, ...]:
    """The values of a Literal, also inside an optional one."""
    if get_origin(annotation) is Literal:
        return get_args(annotation)
    return tuple(choice for member in get_args(annotation) for choice in choices_of(member))


def _dotted(key: str, position: tuple) -> str:
    for step in position:
        key += f"[{step}]" if isinstance(step, int) else f".{plain(step)}"
    return key.removeprefix(".")


def _remedy(error: ErrorDetails, section: type[BaseModel], key: str, others: Tables) -> str:
    position, kind, value = error["loc"], error["type"], quoted(error["input"])
    if kind == "extra_forbidden":
        parent, name = _model_at(section, position[:-1]), str(position[-1])
        return "unknown key" + (belongs(name, {key: section, **others()}) or suggest(name, fields_of(parent)))
    if kind == "missing":
        return f"missing{_about(_field(section, position))}"
    if kind == "value_error":
        return error["msg"].removeprefix("Value error, ")
    if kind in ("choice", "literal_error"):
        choices = error["ctx"].get("choices") or choices_of(_field(section, position).annotation)
        return f"unknown value {value}{suggest(str(error['input']), choices)} (choose from: {', '.join(choices)})"
    if kind in ("model_type", "model_attributes_type"):
        return f"{value} is not a table, write [{_dotted(key, position)}] with its keys below"
    if "message" in error.get("ctx", {}):
        return error["ctx"]["message"]
    message = error["msg"].removeprefix("Input should be ")
    return f"{value} must be {message}{_about(_field(section, position))}"


def _about(entry: FieldInfo) -> str:
    return f" ({meaning(entry)})" if quantity_of(entry) or entry.description else ""


def _all_keys(section: type[BaseModel], key: str) -> list[str]:
    paths = []
    for name, entry in fields_of(section).items():
        paths.append(_dotted(key, (name,)))
        if (table := table_of(entry.annotation)) is not None:
            paths += _all_keys(table, paths[-1])
    return paths


def table_of(annotation: Any) -> type[BaseModel] | None:
    """The section that a key holds, also where it may be left out; None where it holds a value."""
    for one in (annotation, *get_args(annotation)):
        if isinstance(one, type) and issubclass(one, BaseModel):
            return one
    return None


def fields_of(section: type[BaseModel]) -> dict[str, FieldInfo]:
    """The fields of a section by the keys that a file has for them."""
    return {entry.alias or name: entry for name, entry in section.model_fields.items()}


def _model_at(section: type[BaseModel], position: tuple) -> type[BaseModel]:
    for name in (step for step in position if isinstance(step, str)):
        section = cast(type[BaseModel], table_of(fields_of(section)[name].annotation))
    return section


def _field(section: type[BaseModel], position: tuple) -> FieldInfo:
    """Of a position; what pydantic names beyond a key, such as the kinds of value it may have, is passed over."""
    key, *inner = (step for step in position if isinstance(step, str))
    entry = fields_of(section)[key]
    table = table_of(entry.annotation)
    return entry if table is None or not inner else _field(table, tuple(inner))


def quantity_of(entry: FieldInfo) -> Quantity | None:
    """The Quantity of a field, also inside an optional one or of a list's entries; None when it has none."""
    return next((extra for extra in [*entry.metadata, *_extras(entry.annotation)] if isinstance(extra, Quantity)), None)


def _extras(annotation: Any) -> list[Any]:
    return [
        *getattr(annotation, "__metadata__", ()),
        *(extra for member in get_args(annotation) for extra in _extras(member)),
    ]


def meaning(entry: FieldInfo) -> str:
    """What a field is, from its Quantity or its description."""
    quantity = quantity_of(entry)
    return quantity.meaning if quantity else (entry.description or "no description")
