"""What a study leaves in its folder: its table as Markdown, its figure beside it."""

from collections.abc import Callable
from pathlib import Path

from matplotlib.figure import Figure

from rail_fem.files.atomic import write_text_atomically
from rail_fem.show.style import lettering, save


def write_table_and_figure(
    table: Path, text: str, figure: Path | None = None, draw: Callable[[], Figure] | None = None
) -> None:
    """Write the text to `table` (.md) and what `draw` makes to `figure` (.png), each whole or not at all, in folders
    made when missing. Errors: OSError."""
    table.parent.mkdir(parents=True, exist_ok=True)
    write_text_atomically(table, text.rstrip("\n") + "\n")
    if figure is not None and draw is not None:
        write_figure(figure, draw)


def write_figure(figure: Path, draw: Callable[[], Figure]) -> None:
    """Write what `draw` makes to `figure` (.png) in the common lettering, whole or not at all. Errors: OSError."""
    with lettering():
        save(draw(), figure)
