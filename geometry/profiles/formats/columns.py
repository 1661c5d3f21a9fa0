"""Two columns of text: y and z by blanks, tabs, semicolons or commas; decimal commas; headings and comments. Read and
write."""

import re
from pathlib import Path

import numpy as np

from geometry.profiles.formats.raw import RawProfile, collect, numbers, read_text
from geometry.profiles.formats.units import UNITS
from geometry.profiles.profile import ProfileError

COMMENT = ("#", "!", "%", "//", '"')
DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")
QUOTED = re.compile(r'"\s*([+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*"\s*[,;\t ]?')  # a cell of a spreadsheet
BEGINS = re.compile(r"[+-]?(?:[\d.]|(?:nan|inf)\b)", re.IGNORECASE)  # a row of numbers
UNIT_SAID = re.compile(r"\bunits?\s*[:=]\W*([^\W\d_]+)", re.IGNORECASE)
SPELT = {"in": "inch", "millimetres": "mm", "millimeters": "mm", "metres": "m", "meters": "m"}
BACK_SAID = re.compile(r"flange.back\s*[:=]\s*([+-]?\d*\.?\d+)", re.IGNORECASE)


def read_columns(path: Path, unit: float | None = None) -> RawProfile:
    """Read two-column text. Further columns are left out and said so; heading lines may come first.

    unit : length of the file's unit [m]; None: what it says itself

    Raises ProfileError with file and line for what is not a number, for an unknown unit, and for commas that may be
    both kinds.
    """
    lines, notes = read_text(path)
    lines = [QUOTED.sub(r"\1;", line) if '"' in line else line for line in lines]
    wanted = [
        (i, line.strip()) for i, line in enumerate(lines, 1) if line.strip() and not line.lstrip().startswith(COMMENT)
    ]
    first = next((k for k, (_, line) in enumerate(wanted) if BEGINS.match(line)), 1)
    notes += [f'heading "{line[:40]}" on line {i}' for i, line in wanted[:first]]
    wanted = wanted[first:]
    comma = has_decimal_comma([line for _, line in wanted], path)
    rows = [(i, numbers(split(line, comma), path, i)) for i, line in wanted]
    if comma:
        notes.append("decimal commas read as points")
    if any(len(values) > 2 for _, values in rows):
        notes.append(f"{max(len(v) for _, v in rows)} columns: the first two are used")
    comments = "\n".join(line for line in lines if line.lstrip().startswith(COMMENT))
    back = BACK_SAID.search(comments)
    return collect(
        rows,
        path,
        "two-column text",
        unit=said_unit(lines, path) if unit is None else unit,
        kind="wheel" if back else None,
        notes=tuple(notes),
        flange_back=float(back[1]) if back else None,
    )


def said_unit(lines: list[str], path: Path) -> float | None:
    """Length [m] of the unit that a comment or heading says, as in "# unit: mm"; None where none does. Errors:
    ProfileError for one that is not known, where the line speaks of nothing else ("angle unit: deg")."""
    for i, line in enumerate(lines, 1):
        if found := UNIT_SAID.search(line):
            word = SPELT.get(found[1].lower(), found[1].lower())
            if word in UNITS:
                return UNITS[word]
            if not re.search(r"\w", line[: found.start()]):
                raise ProfileError(f"{path}: line {i}: unit '{found[1]}': known are {', '.join(UNITS)}")
    return None


def has_decimal_comma(lines: list[str], path: Path) -> bool:
    """True where commas stand inside numbers: only beside another separator can one tell."""
    if commas_are_decimal(lines):
        return True
    inside = [line for line in lines if DECIMAL_COMMA.search(line)]
    if any(line.count(",") > 2 and not re.search(r"[;\t ]", line) for line in inside):
        raise ProfileError(
            f'{path}: "{inside[0]}": commas both inside and between numbers; separate the columns by semicolons'
        )
    return False


def commas_are_decimal(lines: list[str]) -> bool:
    """True where each line with a comma inside a number has another separator between its words."""
    inside = [re.split(r"[;\t ]+", line.strip("; \t")) for line in lines if DECIMAL_COMMA.search(line)]
    return bool(inside) and all(len(words) >= 2 and not any(word.endswith(",") for word in words) for words in inside)


def split(line: str, comma: bool) -> list[str]:
    if comma:
        return re.split(r"[;\t ]+", line.replace(",", ".").strip("; \t"))
    return [word for word in re.split(r"[;,\t ]+", line) if word]


def write_columns(path: Path, points: np.ndarray, unit: str = "mm", notes: tuple[str, ...] = ()) -> None:
    """Write points (n, 2) [m] as two columns; y + to the field side, z up, stated in the file with the unit."""
    head = [f"# unit: {unit}", "# axes: y + to the field side, z up", *(f"# {note}" for note in notes if note), "y,z"]
    body = [f"{y:.9g},{z:.9g}" for y, z in np.asarray(points) / UNITS[unit]]
    Path(path).write_text("\n".join([*head, *body]) + "\n", encoding="utf-8")
