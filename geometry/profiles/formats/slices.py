"""Slices of a rail that changes along the track, .slcs: stations and one section file each."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from geometry.profiles.formats.columns import read_columns
from geometry.profiles.profile import ProfileError
from geometry.profiles.formats.raw import RawProfile, numbers, read_text

ROW = re.compile(r"^\s*(\S+)\s+'([^']+)'")


@dataclass(frozen=True, eq=False)
class Slices:
    """Sections of one rail along the track.

    x : (m,)  stations, growing [m];  sections : the raw profile at each, in metres (unit 1), vertical axis down
    """

    x: np.ndarray
    sections: tuple[RawProfile, ...]
    path: Path


def read_slices(path: Path) -> Slices:
    """Read a .slcs and the files it names (relative to it). Stations times S_SCALE are mm; U_OFFSET is added.

    Raises ProfileError where a number is missing, stations do not grow, a section file is missing or counts disagree.
    """
    path = Path(path)
    lines, _ = read_text(path)
    rows = [(i, line.split("%")[0].rstrip()) for i, line in enumerate(lines, 1) if line.split("%")[0].strip()]
    if len(rows) < 5:
        raise ProfileError(f"{path}: {len(rows)} line(s) of data: not a whole .slcs file")
    offset, scale = numbers(rows[0][1].replace(",", " ").split()[:2], path, rows[0][0])
    count = int(numbers(rows[1][1].split()[:1], path, rows[1][0], 1)[0])
    found = [(i, match) for i, text in rows if (match := ROW.match(text))]
    if len(found) != count:
        raise ProfileError(f"{path}: NSLC = {count}, but {len(found)} section(s) are named")
    x = np.array([(numbers([m[1]], path, i, 1)[0] + offset) * scale * 1e-3 for i, m in found])
    if np.any(np.diff(x) <= 0):
        at = int(np.argmax(np.diff(x) <= 0)) + 1
        raise ProfileError(f"{path}: line {found[at][0]}: station {x[at]:g} m does not lie beyond {x[at - 1]:g} m")
    return Slices(x, tuple(section(path, i, match[2], scale * 1e-3) for i, match in found), path)


def section(path: Path, line: int, name: str, unit: float) -> RawProfile:
    file = path.parent / name
    if not file.is_file():
        raise ProfileError(f"{path}: line {line}: section file {file} is not there")
    raw = read_columns(file)
    return RawProfile(raw.points * unit, raw.lines, raw.path, raw.layout, 1.0, "rail", -1, raw.notes)
