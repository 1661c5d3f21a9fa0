"""Values of a case file changed from outside it: `--set KEY=VALUE` and `--vary KEY=VALUES`, and the cases they make.

A changed case is read and checked as if its file had been written so.
"""

import hashlib
import itertools
import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from rail_fem.case.casefile import Case, CaseError, load_case
from rail_fem.case.casetext import CaseTextError, check_size
from rail_fem.hierarchy import MODELS
from rail_fem.scene.input_errors import quantity_of, suggest, table_of
from rail_fem.scene.scene import Scene
from rail_fem.scene.units import Quantity, QuantityError, typed

MOST_CASES = 10_000
LONGEST_NAME = 120  # characters of a folder
WORDS = {"/": "_per_", "%": "pct", "^": "", " ": "", "\u00b7": ""}  # of units, in the name of a folder


class VariationError(ValueError):
    """A --set or --vary that cannot be read; the message says which and how it is written."""


def read_setting(text: str) -> tuple[str, Any]:
    """ "scene.speed=60mph" to its key and value: numbers, true, false, lists as TOML has them, else text.

    Errors: VariationError.
    """
    key, equals, value = (part.strip() for part in text.partition("="))
    if not equals or not key or not value:
        raise VariationError(f'--set {typed(text)}: write KEY=VALUE, e.g. --set "scene.speed=60 mph"')
    return key, plain_value(value)


def read_settings(texts: Sequence[str]) -> dict[str, Any]:
    """All of them. Errors: VariationError, also for a key given twice."""
    found: dict[str, Any] = {}
    for key, value in map(read_setting, texts):
        if key in found:
            raise VariationError(f"--set {key}: given twice")
        found[key] = value
    return found


def plain_value(text: str) -> Any:
    """A value as TOML reads it, or else the text itself. Errors: VariationError for one beyond a case file's bounds."""
    if "\n" in text:
        return text
    try:
        check_size(f"value = {text}")
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text
    except CaseTextError as error:
        if text[:1].isalpha():
            return text
        raise VariationError(f"{typed(text)}: {str(error).removeprefix('line 1: ')}") from None


def as_setting(key: str, value: Any) -> str:
    """The inverse of `read_setting`, for another process's command line."""
    plain = isinstance(value, str) and value == value.strip() != "" and plain_value(value) == value
    return f"{key}={value if plain else as_toml(value)}"


def as_toml(value: Any) -> str:
    """A value on one line as TOML has it."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{as_toml(str(name))} = {as_toml(inner)}" for name, inner in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(as_toml, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else repr(value)


def read_variation(text: str) -> tuple[str, list[Any]]:
    """ "scene.speed=30mph:100mph:8" or "scene.wheel.profile=P8,P1" to its key and values. Errors: VariationError,
    QuantityError for a series in the wrong dimension."""
    from rail_fem.scene.series import is_series, read_series

    key, equals, values = (part.strip() for part in text.partition("="))
    if not equals or not key or not values:
        raise VariationError(
            f'--vary {typed(text)}: write KEY=FIRST:LAST:COUNT or KEY=A,B,C, e.g. --vary "scene.speed=30mph:100mph:8"'
        )
    if not is_series(values):
        return key, [plain_value(value.strip()) for value in values.split(",") if value.strip()]
    quantity = quantity_at(key)
    if quantity is None:
        raise VariationError(f"--vary {key}: is no physical quantity, give its values: {key}=A,B,C")
    try:
        return key, read_series(values, quantity.unit).texts()
    except QuantityError as error:
        raise VariationError(f"--vary {key}: {error}") from error


def field_of(key: str) -> FieldInfo:
    """The field of "scene.wheel.radius" or "run.lumped.start", of a list for one of its entries, "scene.bearers.
    unlike_ballast.0". Errors: VariationError that names the nearest."""
    section, names = _section_of(key)
    if names[-1].isdecimal():
        names = names[:-1]
    for name in names[:-1]:
        inner = table_of(section.model_fields[name].annotation) if name in section.model_fields else None
        if inner is None:
            raise VariationError(f"{key}: unknown key, {name} is no table{suggest(name, section.model_fields)}")
        section = inner
    if names[-1] not in section.model_fields or section.model_fields[names[-1]].exclude:
        raise VariationError(f"{key}: unknown key{suggest(names[-1], section.model_fields)}")
    return section.model_fields[names[-1]]


def quantity_at(key: str) -> Quantity | None:
    """The physical quantity of such a key, None where it is none. Errors: as field_of."""
    return quantity_of(field_of(key))


def value_of(case: Case, key: str) -> Any:
    """What a case has under such a key [SI]; None where it leaves it to the program or has no such table."""
    holder: Any = {"scene": case.scene, "run": case.runs}
    for name in key.split("."):
        if isinstance(holder, tuple) and name.isdecimal():
            holder = holder[int(name)] if int(name) < len(holder) else None
        else:
            holder = holder.get(name) if isinstance(holder, Mapping) else getattr(holder, name, None)
    return holder


def _section_of(key: str) -> tuple[type[BaseModel], list[str]]:
    top, *names = key.split(".")
    if top == "scene" and names:
        return Scene, names
    if top == "run" and len(names) > 1 and names[0] in MODELS:
        return MODELS[names[0]].settings, names[1:]
    if top == "run" and names:
        raise VariationError(f"{key}: write run.MODEL.KEY with a model among {', '.join(MODELS)}")
    raise VariationError(f"{key}: unknown key{suggest(top, ('scene', 'run'))}; write scene.KEY or run.MODEL.KEY")


def combinations(variations: Sequence[tuple[str, list[Any]]]) -> list[dict[str, Any]]:
    """Every value of every key with every value of the others; one empty change where nothing varies. Errors:
    VariationError for a key given twice or too many cases."""
    keys = [key for key, _ in variations]
    for key in keys:
        if keys.count(key) > 1:
            raise VariationError(f"--vary {key}: given twice; write all its values in one")
    count = 1
    for key, values in variations:
        if len({repr(value) for value in values}) < len(values):
            raise VariationError(f"--vary {key}: has a value twice")
        count *= len(values)
    if count > MOST_CASES:
        raise VariationError(f"--vary makes {count} cases, at most {MOST_CASES} are run at once: take fewer values")
    return [dict(zip(keys, chosen)) for chosen in itertools.product(*(values for _, values in variations))]


def vary_case(
    path: Path, settings: Mapping[str, Any], variations: Sequence[tuple[str, list[Any]]]
) -> tuple[list[Case], list[str]]:
    """The cases that a file makes with these changes, and the faults of those that cannot be run, each told once.

    Errors: VariationError, also where a key is both set and varied.
    """
    if both := sorted(set(settings) & {key for key, _ in variations}):
        raise VariationError(f"{', '.join(both)}: both set and varied")
    cases, errors = [], []
    short = short_keys([key for key, _ in variations])
    for change in combinations(variations):
        words = {short[key]: value for key, value in change.items()}
        try:
            cases.append(load_case(path, {**settings, **change}, folder_name(Path(path).stem, words)))
        except CaseError as error:
            errors += error.errors
    return cases, [str(CaseError(path, list(dict.fromkeys(errors))))] if errors else []


def short_keys(keys: Sequence[str]) -> dict[str, str]:
    """Key -> the end of it that tells it from the others: "scene.speed" -> "speed"."""
    short = {}
    for key in keys:
        parts = key.split(".")
        ends = [".".join(parts[-count:]) for count in range(1, len(parts) + 1)]
        short[key] = next(
            end for end in ends if not any(other != key and f".{other}".endswith(f".{end}") for other in keys)
        )
    return short


def folder_name(stem: str, values: Mapping[str, Any]) -> str:
    """A case's name with what varies: "nose_transfer-speed=30mph"; files by their stems."""
    whole = "-".join([stem, *(f"{key}={_in_a_name(str(value))}" for key, value in values.items())])
    digest = hashlib.sha256(whole.encode()).hexdigest()[:12]
    return whole if len(whole) <= LONGEST_NAME else f"{whole[: LONGEST_NAME - 13]}-{digest}"


def _in_a_name(text: str) -> str:
    plain = text if re.match(r"[+-]?\.?\d", text) else Path(text).stem
    for sign, word in WORDS.items():
        plain = plain.replace(sign, word)
    return re.sub(r"[^\w.+-]", "_", plain)
