"""A case file to begin with: every key of the scene and of some models, with unit, range, default and meaning."""

from collections.abc import Iterator
from typing import Any

from rail_fem.case.keys import Key, section_keys
from rail_fem.hierarchy import MODELS
from rail_fem.scene.scene import Scene

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
