"""What is told in a table and a figure: on the screen, and in a folder as Markdown, CSV and PNG."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import typer
from matplotlib.figure import Figure

from rail_fem.files.atomic import csv_text, write_text_atomically
from rail_fem.files.markdown import markdown_table
from rail_fem.show.panels import Panel, panels_figure
from rail_fem.show.style import DOTS, lettering, save


def write_table_and_figure(
    table: Path, text: str, figure: Path | None = None, draw: Callable[[], Figure] | None = None
) -> None:
    """Write the text to `table` (.md) and what `draw` makes to `figure` (.png), each whole or not at all, in folders
    made when missing. Errors: OSError."""
    table.parent.mkdir(parents=True, exist_ok=True)
    write_text_atomically(table, text.rstrip("\n") + "\n")
    if figure is not None and draw is not None:
        write_figure(figure, draw)


def write_figure(figure: Path, draw: Callable[[], Figure], dots: int = DOTS) -> Path:
    """Write what `draw` makes to `figure` (.png) in the common lettering, whole or not at all. dots : per inch. Errors:
    OSError."""
    with lettering():
        return save(draw(), figure, dots)


class Table(NamedTuple):
    """Rows of cells, text or numbers, under a head."""

    head: Sequence[str]
    rows: Sequence[Sequence[Any]]
    title: str = ""

    @classmethod
    def of(cls, rows: Sequence[Mapping[str, Any]], title: str = "") -> Table:
        """Of rows that say the column of each cell."""
        return cls([*rows[0]] if rows else [], [[*row.values()] for row in rows], title)

    def markdown(self) -> str:
        """With its title above; "-" where a number is not known."""
        told = lambda cell: ("-" if math.isnan(cell) else f"{cell:.4g}") if isinstance(cell, float) else str(cell)
        cells = [[told(cell) for cell in row] for row in self.rows]
        return "\n".join([*([self.title, ""] if self.title else []), *markdown_table(list(self.head), cells)])

    def csv(self) -> str:
        """Without its title."""
        return csv_text([self.head, *self.rows])


def publish(
    name: str,
    out: Path | None,
    tables: Iterable[Table],
    panels: Sequence[Panel] = (),
    title: str = "",
    note: str = "",
    columns: int = 2,
) -> None:
    """Print the tables, and with a folder `out` write NAME.md, NAME.csv (tables one below the other) and the panels as
    NAME.png, each whole or not at all. title : of the figure;  note : a line above the tables. Errors: OSError."""
    tables = list(tables)
    text = "\n\n".join([*([note] if note else []), *(table.markdown() for table in tables)]) + "\n"
    typer.echo(text, nl=False)
    if out is None:
        return
    out.mkdir(parents=True, exist_ok=True)
    write_text_atomically(out / f"{name}.md", text)
    if tables:
        write_text_atomically(out / f"{name}.csv", "\n".join(table.csv() for table in tables))
    if panels:
        write_figure(out / f"{name}.png", lambda: panels_figure(panels, title, columns))
