"""Directives that write tables from the program itself, so that the documents cannot say another thing than the code.

`.. case-keys:: module:Class` lists the keys of a typed section: key, unit, range, default, meaning.
`.. history-columns::` lists the columns of a history.
"""

from __future__ import annotations

import importlib
import types
import typing

from docutils import nodes
from docutils.statemachine import StringList
from pydantic import BaseModel
from sphinx.util.docutils import SphinxDirective

UNITS_MODULE, HISTORY_MODULE = "rail_fem.scene.units", "rail_fem.output.history"


def _quantity(field):
    """The Quantity that annotates a field, also inside `... | None` and `tuple[..., ...]`; None where there is none."""
    quantity = importlib.import_module(UNITS_MODULE).Quantity
    ahead = [*field.metadata, field.annotation]
    while ahead:
        item = ahead.pop()
        if isinstance(item, quantity):
            return item
        if typing.get_origin(item) is typing.Annotated or typing.get_origin(item) in (tuple, typing.Union, types.UnionType):
            ahead.extend(typing.get_args(item))
    return None


def _default(field, quantity) -> str:
    if field.is_required():
        return "**required**"
    value = field.default
    if value is None:
        return "none"
    if isinstance(value, BaseModel):
        return "see below"
    if quantity is not None and isinstance(value, float):
        return quantity.show(value)
    return f"`{value}`"


def _range(field, quantity) -> str:
    if quantity is not None:
        return f"{quantity.low:g} to {quantity.high:g} {quantity.unit}".strip()
    members = (field.annotation, *typing.get_args(field.annotation))  # a Literal, or one that may be left out
    choices = [item for member in members for item in typing.get_args(member) if isinstance(item, str)]
    if choices:
        return ", ".join(f"`{choice}`" for choice in choices)
    limits = {type(limit).__name__.lower(): limit for limit in field.metadata}
    low, high = (getattr(limits.get(name), name, None) for name in ("ge", "le"))
    return " to ".join(str(limit) for limit in (low, high) if limit is not None)


class MarkdownTable(SphinxDirective):
    """A directive that gives its rows as a Markdown table."""

    def table(self, head: list[str], rows: list[list[str]]) -> list[nodes.Node]:
        lines = [head, ["---"] * len(head), *rows]
        text = ["| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines]
        node = nodes.container()
        self.state.nested_parse(StringList(text, source=self.get_source_info()[0]), self.content_offset, node)
        return [node]


class CaseKeys(MarkdownTable):
    """Keys of a typed section of a case file."""

    required_arguments = 1

    def run(self):
        module, _, name = self.arguments[0].partition(":")
        section = getattr(importlib.import_module(module), name)
        rows = []
        for key, field in section.model_fields.items():
            if field.exclude:
                continue
            quantity = _quantity(field)
            meaning = quantity.meaning if quantity is not None else field.description or ""
            rows.append([f"`{key}`", quantity.unit if quantity is not None else "", _range(field, quantity), _default(field, quantity), meaning])
        return self.table(["key", "unit", "range or choices", "default", "meaning"], rows)


class HistoryColumns(MarkdownTable):
    """Columns of a history file."""

    def run(self):
        columns = importlib.import_module(HISTORY_MODULE).COLUMNS
        return self.table(["column", "unit in `history.csv`", "meaning"], [[f"`{name}`", c.unit, c.meaning] for name, c in columns.items()])


def setup(app):
    """Register the directives."""
    app.add_directive("case-keys", CaseKeys)
    app.add_directive("history-columns", HistoryColumns)
    return {"parallel_read_safe": True}
