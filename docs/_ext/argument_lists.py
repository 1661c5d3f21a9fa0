"""Docstrings list arguments as lines `name : meaning [unit]`, deeper lines going on; on the pages they are lists."""

import re

ITEM = re.compile(r"^(\w[^:`]*?) +: +(\S.*)$")


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


def as_lists(lines: list[str]) -> list[str]:
    """The same lines, with every run of items under one indentation made a bullet list."""
    out: list[str] = []
    item: int | None = None  # indentation of the list's items while inside one
    for line in lines:
        inside = item is not None and line.strip() and _indent(line) > item
        found = ITEM.match(line.strip())
        if inside:
            out[-1] += " " + line.strip()
        elif found and (item == _indent(line) or not out or not out[-1].strip()):
            item = _indent(line)
            out.append(" " * item + f"* **{found[1].replace('*', chr(92) + '*')}** : {found[2]}")
        else:
            if item is not None and line.strip():
                out.append("")
            item = None
            out.append(line)
    return out


def setup(app):
    # after napoleon, which takes the sections that it knows
    app.connect("autodoc-process-docstring", lambda app, what, name, obj, options, lines: _replace(lines), priority=600)
    return {"parallel_read_safe": True}


def _replace(lines: list[str]) -> None:
    lines[:] = as_lists(lines)
