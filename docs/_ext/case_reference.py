"""Directives that write tables from the program itself, so that the documents cannot say another thing than the code.

`.. case-keys:: module:Class` lists the keys of a typed section: key, unit, range, default, meaning.
`.. history-columns::` lists the columns of a history, `.. commands::` the commands of the terminal with their options.
"""

import importlib

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.util.docutils import SphinxDirective
from typer.main import get_command

from rail_fem.case.keys import section_keys
from rail_fem.cli import app as terminal
from rail_fem.files.markdown import markdown_table
from rail_fem.result.history import COLUMNS


class MarkdownTable(SphinxDirective):
    """A directive that gives its rows as a Markdown table."""

    def table(self, head: list[str], rows: list[list[str]]) -> list[nodes.Node]:
        node = nodes.container()
        self.state.nested_parse(
            StringList(markdown_table(head, rows), source=self.get_source_info()[0]), self.content_offset, node
        )
        return [node]


class CaseKeys(MarkdownTable):
    """Keys of a typed section of a case file."""

    required_arguments = 1

    def run(self):
        module, _, name = self.arguments[0].partition(":")
        section = getattr(importlib.import_module(module), name)
        rows = [
            [f"`{key.name}`", key.unit, key.allowed, f"**{key.default}**" if key.required else key.default, key.meaning]
            for key in section_keys(section)
        ]
        return self.table(["key", "unit", "range or choices", "default", "meaning"], rows)


class HistoryColumns(MarkdownTable):
    """Columns of a history file."""

    def run(self):
        return self.table(
            ["column", "unit in `history.csv`", "meaning"],
            [[f"`{name}`", c.unit, c.meaning] for name, c in COLUMNS.items()],
        )


class Commands(MarkdownTable):
    """Commands of the terminal."""

    def run(self):
        rows = []
        for name, command in get_command(terminal).commands.items():
            said = [one.opts[0] if one.opts[0][0] == "-" else one.name.upper() for one in command.params]
            rows.append([f"`{name}`", command.get_short_help_str(100), " ".join(f"`{one}`" for one in said)])
        return self.table(["`rail-fem`", "what it does", "takes (`--help` says more)"], rows)


def setup(app):
    """Register the directives."""
    app.add_directive("case-keys", CaseKeys)
    app.add_directive("history-columns", HistoryColumns)
    app.add_directive("commands", Commands)
    return {"parallel_read_safe": True}
