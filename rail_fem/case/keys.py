"""The keys of a case file's sections as the program itself knows them, for tables, templates and documents."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel

from rail_fem.scene.input_errors import choices_of, meaning, quantity_of, table_of

WRITTEN = ("digest",)  # by runs into their own case.json


@dataclass(frozen=True)
class Key:
    """One key: unit ("" for none), range or choices in words, default in words ("required", "none"), meaning; section :
    its class where it is a table,
    table : what that holds by default, None where it must be written or is left out."""

    name: str
    unit: str
    allowed: str
    default: str
    meaning: str
    required: bool
    section: type[BaseModel] | None = None
    table: BaseModel | None = None


def section_keys(section: type[BaseModel], values: BaseModel | None = None) -> Iterator[Key]:
    """The keys of a typed section in the order of its class; what only the program writes is left out.

    values : a section whose values are shown as the defaults of keys that have none
    """
    for name, field in section.model_fields.items():
        if field.exclude or name in WRITTEN:
            continue
        quantity = quantity_of(field)
        fixed = values is None or not field.is_required()
        yield Key(
            name,
            quantity.unit if quantity else "",
            _allowed(field, quantity),
            _default(field, quantity) if fixed else getattr(values, name),
            meaning(field),
            field.is_required(),
            table_of(field.annotation),
            None if field.is_required() else field.default,
        )


def _allowed(field: Any, quantity: Any) -> str:
    if quantity is not None:
        words = "".join(f' or "{word}"' for word in quantity.words)
        return f"{quantity.low:g} to {quantity.high:g} {quantity.unit}".strip() + words
    if choices := choices_of(field.annotation):
        return ", ".join(choices)
    limits = {type(limit).__name__.lower(): limit for limit in field.metadata}
    return " to ".join(str(getattr(limits[name], name)) for name in ("ge", "le") if name in limits)


def _default(field: Any, quantity: Any) -> str:
    if field.is_required():
        return "required"
    if field.default is None:
        return "none"
    if isinstance(field.default, BaseModel):
        return "see its table"
    if quantity is not None and isinstance(field.default, float):
        return quantity.show(field.default)
    return str(field.default).lower() if isinstance(field.default, bool) else str(field.default)
