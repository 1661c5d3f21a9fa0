"""The JSON Schema of a case file, made from the classes that read it: editors complete keys and tell units, ranges,
defaults and meanings by it."""

import json
import re
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from rail_fem.files.atomic import write_text_atomically
from rail_fem.hierarchy import MODELS
from rail_fem.scene.input_errors import meaning, quantity_of, table_of
from rail_fem.scene.scene import Material, Scene
from rail_fem.scene.steel import GRADES
from rail_fem.scene.wheel_profile import WHEEL_NAMES
from rail_fem.settings.damage import DamageSettings

SCHEMA_FILE = "rail-fem.schema.json"
DRAFT = "http://json-schema.org/draft-07/schema#"  # that editors of TOML read


def case_schema() -> dict[str, Any]:
    """Of a whole case file: title, [scene], [run.MODEL] for every model, [damage]. Its types are those of a file as it
    is written: a quantity is text with its unit; ranges stand in the descriptions, since a schema cannot read units."""
    definitions: dict[str, Any] = {}
    scene = _section(Scene, definitions)
    runs = {name: _section(model.settings, definitions) | {"title": model.meaning} for name, model in MODELS.items()}
    return {
        "$schema": DRAFT,
        "title": "rail-fem case file",
        "type": "object",
        "required": ["scene"],
        "properties": {
            "version": {"const": 1, "description": "of the case file's format"},
            "title": {"type": "string", "maxLength": 200, "description": "one line that tables and figures show"},
            "scene": scene,
            "run": {
                "type": "object",
                "description": "numerics of each model that the case is run with",
                "properties": runs,
                "additionalProperties": False,
            },
            "damage": _section(DamageSettings, definitions),
        },
        "additionalProperties": False,
        "definitions": definitions,
    }


def write_schema(path: Path) -> None:
    """The schema as a file, whole or not at all. Errors: OSError."""
    write_text_atomically(path, json.dumps(case_schema(), indent=1) + "\n")


def _section(section: type[BaseModel], definitions: dict[str, Any]) -> dict[str, Any]:
    """A reference to a section's definition, which is made where it is not there yet."""
    name = section.__name__
    if name not in definitions:
        definitions[name] = {}  # a section that held itself would end here
        properties, made = {}, section.model_json_schema(ref_template="#/definitions/{model}")
        for key, entry in section.model_fields.items():
            if not entry.exclude and key in made["properties"]:
                properties[key] = _key(entry, made["properties"][key], definitions)
                if entry.default is None:
                    about = properties[key].pop("description")
                    properties[key] = {"description": about, "anyOf": [properties[key], {"const": "none"}]}
        told = {
            "type": "object",
            "description": re.sub(r"\s+", " ", (section.__doc__ or "").partition("\n\n")[0]).strip(),
        }
        required = {"required": made["required"]} if made.get("required") else {}
        definitions[name] = told | required | {"properties": properties, "additionalProperties": False}
        if section is Material:
            alone = {"enum": [*GRADES], "description": "a steel by its grade alone"}
            definitions[name] = {"anyOf": [alone, definitions[name]]}
    return {"$ref": f"#/definitions/{name}"}


def _key(entry: Any, made: dict[str, Any], definitions: dict[str, Any]) -> dict[str, Any]:
    inner = table_of(entry.annotation)
    if inner is not None:
        held = _section(inner, definitions)
        rows = {"type": "array", "items": held} if made.get("type") == "array" else {"allOf": [held]}
        return rows | {"description": meaning(entry)}
    quantity = quantity_of(entry)
    if quantity is None:
        return _plain(entry, made)
    one = quantity.file_schema()
    listed = "array" in str(made)
    default = entry.default if isinstance(entry.default, float) else None
    told: dict[str, str | float] = {
        "description": f"{meaning(entry)}; {quantity.range()}" + _default_words(entry, quantity)
    }
    if default is not None:
        told["default"] = quantity.show(default) if quantity.unit else default
    return ({"type": "array", "items": one} if listed else one) | told


def _default_words(entry: Any, quantity: Any) -> str:
    if entry.is_required():
        return "; required"
    return f"; default {quantity.show(entry.default)}" if isinstance(entry.default, float) else "; default none"


def _plain(entry: Any, made: dict[str, Any]) -> dict[str, Any]:
    """Text, numbers of things, choices: as the class says, without null, which TOML does not know."""
    found = {
        name: value for name, value in made.items() if name != "title" and not (name == "default" and value is None)
    }
    choices = [one for one in found.pop("anyOf", []) if one.get("type") != "null"]
    found = (choices[0] if len(choices) == 1 else {"anyOf": choices} if choices else {}) | found
    if entry.description and "steel grade" in entry.description:
        found |= {"enum": [*GRADES]}
    if entry.description and entry.description.startswith("name of a wheel profile"):
        found |= {"examples": [*WHEEL_NAMES]}
    return found | {"description": meaning(entry)}
