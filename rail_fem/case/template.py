"""Case files written by the program: one to begin with, of every key of the scene and of some models with unit, range,
default and meaning; and that of a run, to repeat it."""

from collections.abc import Iterator
from pathlib import PurePath
from typing import Any

from pydantic import BaseModel

from rail_fem.case.casefile import LONGEST_TITLE
from rail_fem.case.keys import WRITTEN, Key, section_keys
from rail_fem.case.variations import as_toml
from rail_fem.hierarchy import MODELS
from rail_fem.scene.input_errors import meaning, quantity_of
from rail_fem.scene.scene import READING, Scene
from rail_fem.scene.units import Quantity, show
from rail_fem.scene.wheel_profile import KEPT

EXAMPLES = {
    "profile": '"P8"',
    "vehicle_sprung_mass": '"66.25 t"',
    "wheelset_unsprung_mass": '"1 t"',
    "stiffness": '"80 kN/mm"',
    "speed": '"75 mph"',
    "direction": '"facing"',
    "grade": '"Mn13"',
}


def template(models: list[str]) -> Iterator[str]:
    """Lines of a case file with every key of the scene and of these models."""
    yield 'version = 1\ntitle = "a wheel passes a crossing"'
    yield from _section("scene", Scene)
    for model in models:
        yield from _section(f"run.{model}", MODELS[model].settings)


def _section(name: str, section: type, values: Any = None) -> Iterator[str]:
    keys = list(section_keys(section, values))
    yield f"\n[{name}]"
    for key in keys:
        if key.section is None:
            yield _line(key)
    for key in keys:
        if key.section is not None and key.required:
            yield from _section(f"{name}.{key.name}", key.section)
        elif key.section is not None and key.table is None:
            yield f"\n# [{name}.{key.name}]  # {key.meaning}; its keys: docs/case_file.md"
        elif key.section is not None:
            yield from _section(f"{name}.{key.name}", key.section, key.table)


def _line(key: Key) -> str:
    about = f"  # {key.meaning}" + (f"; {key.allowed}" if key.allowed else "")
    if key.name in EXAMPLES and key.default in ("required", "none"):
        return f"{key.name} = {EXAMPLES[key.name]}{about}"
    plain = key.default in ("true", "false") or (not key.unit and key.default.replace(".", "", 1).isdigit())
    value = key.default if plain else f'"{key.default}"'
    return f"{'' if key.required else '# '}{key.name} = {value}{about}"


def written(title: str, scene: Scene, model: str, settings: BaseModel) -> str:
    """The text of a case file that gives this scene and these numerics again, to the last bit; keys at their defaults
    are left out. Files stand there by their names: they belong beside it, a wheel's profile as its run's folder keeps
    it."""
    lines = [
        "version = 1",
        f"title = {_toml(title[:LONGEST_TITLE])}",
        *_told("scene", scene),
        *_told(f"run.{model}", settings),
    ]
    return "\n".join(lines) + "\n"


def _told(name: str, section: BaseModel) -> Iterator[str]:
    yield f"\n[{name}]"
    kept, inner = getattr(section, "measured", None) is not None, []
    for key, field in type(section).model_fields.items():
        value = getattr(section, key)
        left_out = field.exclude or key.endswith(WRITTEN) or (kept and key in READING)
        if left_out or value is None or (not field.is_required() and value == field.default):
            continue
        if isinstance(value, BaseModel):
            inner.append((f"{name}.{key}", value))
            continue
        if (key == "profile" and kept) or key in ("file", "mesh"):
            value = KEPT if kept else PurePath(value).name
        yield f"{key} = {_toml(value, quantity_of(field))}  # {meaning(field)}"
    for place, value in inner:
        yield from _told(place, value)


def _toml(value: Any, quantity: Quantity | None = None) -> str:
    """A value as TOML has it: a number with the unit that engineers write, in as many digits as it has."""
    if isinstance(value, tuple):
        return f"[{', '.join(_toml(entry, quantity) for entry in value)}]"
    if quantity is None or isinstance(value, str):
        return as_toml(value)
    texts = [show(value, quantity.unit, digits) for digits in range(6, 18)]
    exact = next((text for text in texts if quantity.read(text) == value), texts[-1])
    return as_toml(exact) if quantity.unit else exact
