"""What varies in a sweep: the keys of its cases whose values differ from run to run, read from the runs themselves."""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from rail_fem.case.variations import VariationError, quantity_at
from rail_fem.result.result import PassResult
from rail_fem.result.runfolder import MARK
from rail_fem.scene.crossing import FAMILY_KEYS, Crossing
from rail_fem.scene.input_errors import suggest
from rail_fem.scene.units import si_factor

PROFILE, CROSSING = "scene.wheel.profile", "scene.crossing."

Values = Mapping[str, Any]  # key of the case file -> value [SI]


def asked_values(folder: Path, result: PassResult) -> dict[str, Any]:
    """Every key of the case that a run's folder holds, as it was asked for [SI]; a profile file by its wheel's name.

    Errors: ValueError for a mark that cannot be read.
    """
    file = Path(folder) / MARK
    mark = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {"scene": result.scene.plain()}
    values = _flat({name: part for name, part in mark.items() if name != "model"})
    values.pop("scene.wheel.label", None)
    return values | {PROFILE: result.scene.wheel.name}


def with_left_out(asked: Values, crossing: Crossing, keys: Iterable[str]) -> Values:
    """The values of a run with those of its crossing's `keys` that its mark leaves out, as they are the benchmark's: a
    wing raised by 0 and 1 mm is one that varies."""
    own = FAMILY_KEYS[crossing.family]
    left_out = {key: key.removeprefix(CROSSING) for key in keys if key.startswith(CROSSING) and key not in asked}
    return {**asked, **{key: getattr(crossing, name) for key, name in left_out.items() if name in own}}


def _flat(table: Mapping[str, Any], key: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in table.items():
        inner = f"{key}.{name}".lstrip(".")
        flat |= _flat(value, inner) if isinstance(value, Mapping) else {inner: value}
    return flat


def varied_keys(runs: Iterable[Values]) -> list[str]:
    """Keys that have more than one value among runs that have the key, in the order of the case file."""
    seen: dict[str, set[str]] = {}
    for values in runs:
        for key, value in values.items():
            seen.setdefault(key, set()).add(json.dumps(value))
    return [key for key, different in seen.items() if len(different) > 1]


def unit_of(key: str) -> str:
    """The unit in which engineers write this key; "" for none."""
    try:
        quantity = quantity_at(key)
    except VariationError:  # of another version of the program
        return ""
    return quantity.unit if quantity else ""


def title_of(key: str) -> str:
    """The key with its unit: "scene.speed [mph]"."""
    unit = unit_of(key)
    return f"{key} [{unit}]" if unit else key


def shown_value(key: str, value: Any) -> Any:
    """A value in the unit of its title; what is no number as it is, a list in words."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return str(value) if isinstance(value, (list, tuple)) else value
    unit = unit_of(key)
    return float(f"{value / si_factor(unit):.12g}") if unit else value


def find_column(name: str, columns: Iterable[str], what: str) -> str:
    """The column that a user names, with its unit or without, in full or by its last words. Errors: ValueError with
    what there is."""
    bare = {column: column.partition(" [")[0] for column in columns}
    asked = name.strip().replace(" the ", " ").replace(" ", "_")
    for fits in (
        lambda column: name.strip() == column,
        lambda column: asked == bare[column].replace(" ", "_"),
        lambda column: f".{bare[column]}".endswith(f".{asked}"),
    ):
        found = [column for column in bare if fits(column)]
        if len(found) == 1:
            return found[0]
        if found:
            raise ValueError(f"{what} {name}: may be {' or '.join(bare[column] for column in found)}: write it in full")
    raise ValueError(
        f"{what} {name}: not there{suggest(name, bare.values())}; choose one of"
        f" {', '.join(bare.values()) or 'nothing: all runs have the same values'}"
    )
