"""MiniProf profiles: .whl (wheel), .ban (rail) and .mpt (several in one file)."""

import re
from pathlib import Path

from geometry.profiles.formats.raw import RawProfile, collect, numbers, read_text
from geometry.profiles.profile import ProfileError

NUMBER_ROW = re.compile(r"^\s*[+-]?\.?\d")
SWITCHED_OFF = re.compile(r'^\s*"\s*[+-]?\.?\d')
SECTION = re.compile(r"^\[Profile(\d+)(Info|Points)\]$", re.IGNORECASE)
KEYED = re.compile(r"^\s*[A-Za-z]\w*\s*=")
SHIFT = re.compile(r"^\s*([XY]Offset|Tilt)\s*=\s*([+-]?\d+\.?\d*)\s*$", re.IGNORECASE)
KINDS = {".whl": "wheel", ".ban": "rail"}


def read_miniprof(path: Path) -> RawProfile:
    """Points of a .whl or .ban: rows of X, Y and perhaps angle and curvature [mm] after a header.

    A point whose row begins with a quotation mark is switched off in the file and left out. The header's count of
    points is held against what is there. The vertical axis is not declared: some files draw it up, some down.
    """
    lines, notes = read_text(path)
    body = header_end(lines)
    rows, off = [], 0
    for i, line in enumerate(lines[body:], body + 1):
        if NUMBER_ROW.match(line):
            rows.append((i, numbers(line.split()[:2], path, i)))
        elif line.strip() and not line.lstrip().startswith('"'):
            raise ProfileError(f'{path}: line {i}: "{line.strip()[:40]}" is no point')
        off += bool(SWITCHED_OFF.match(line))
    if off:
        notes.append(f"{off} point(s) switched off by a quotation mark left out")
    said = [int(m[1]) for line in lines[:body] if (m := re.match(r"XYPoints\s*=\s*(\d+)", line))]
    if said and said[0] not in (len(rows), len(rows) + off):
        notes.append(f"header says {said[0]} points, file holds {len(rows)}")
    for line in lines[:body]:
        if (match := SHIFT.match(line)) and float(match[2]) != 0:
            notes.append(f"header says {match[1]} = {match[2]}, which is not applied: points are taken as they stand")
    kind = KINDS.get(Path(path).suffix.lower())
    return collect(rows, path, "MiniProf", unit=1e-3, kind=kind, notes=tuple(notes), flange_back=0.0)


def header_end(lines: list[str]) -> int:
    """Index of the first line after the header: after its last KEY=value, or, in the older layout without keys, after
    its first blank line."""
    keyed = [i for i, line in enumerate(lines) if KEYED.match(line)]
    if keyed:
        return keyed[-1] + 1
    return next((i + 1 for i, line in enumerate(lines) if not line.strip()), 0)


def read_mpt(path: Path) -> list[RawProfile]:
    """All profiles of an .mpt file, rails with the vertical axis up [mm]. Raises ProfileError where there is none."""
    lines, notes = read_text(path)
    blocks: dict = {}
    name = None
    for number, line in enumerate(lines, 1):
        text = line.strip()
        if text.startswith("["):
            match = SECTION.match(text)
            name = match[1] if match and match[2].lower() == "points" else None
        elif name and text:
            blocks.setdefault(name, []).append((number, numbers(text.split()[:2], path, number)))
    if not blocks:
        raise ProfileError(f"{path}: no [Profile..Points] in this file; is it a MiniProf .mpt?")
    return [
        collect(rows, path, "MiniProf several", unit=1e-3, notes=(*notes, f"profile {key} of {len(blocks)}"))
        for key, rows in blocks.items()
    ]
