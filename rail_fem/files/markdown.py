"""Pages and tables of the reports, in Markdown."""

from collections.abc import Iterable, Mapping, Sequence


def markdown_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Lines of a table: column heads, the rule below them, a line for each row of cells.

    A bar or a line break inside a cell does not end it. Errors: ValueError for a row that has not a cell for each head.
    """
    lines = [_line(head), "|" + "---|" * len(head)]
    for row in rows:
        if len(row) != len(head):
            raise ValueError(f"a row of {len(row)} cells in a table of {len(head)} columns: {', '.join(row)}")
        lines.append(_line(row))
    return lines


def table_of(rows: Sequence[Mapping[str, str]]) -> list[str]:
    """The same of rows that say the column of each cell; nothing without rows."""
    return markdown_table([*rows[0]], [[*row.values()] for row in rows]) if rows else []


def page_of(blocks: Iterable[str | Sequence[str]]) -> str:
    """A page of paragraphs, headings, and lines of tables and lists, a blank line between two of them; what is empty is
    left out."""
    texts = (block if isinstance(block, str) else "\n".join(block) for block in blocks)
    return "\n\n".join(filter(None, texts)) + "\n"


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(" ".join(cell.splitlines()).replace("|", "\\|") for cell in cells) + " |"
