"""Slices of a rail that changes along the track, .slcs of CONTACT: stations, and one section file each.

Layout, after comments from % on: offset and scale of the stations; number of slices; numbers of features, kinks and
accelerations; method; a row (station, 'file') a slice. What follows of features along the sections is left.
Source: CONTACT's open-source reader, matlab/read_slices.m (V. Vollebregt, revision of 2023), and its test bank.
"""

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from geometry.profiles.formats.columns import read_columns
from geometry.profiles.formats.raw import RawProfile, numbers, read_text
from geometry.profiles.formats.simpack import read_simpack
from geometry.profiles.formats.units import UNITS, WIDTHS, fitting_units
from geometry.profiles.profile import ProfileError

ROW = re.compile(r"""^\s*(\S+)\s+(['"])(.+?)\2""")
ROUND_A_WHEEL = re.compile(r"\bTH_(OFFSET|SCALE|SLC|METHOD|INTPOL)\b", re.IGNORECASE)
NEAREST = 10e-6  # two stations of a rail [m]


@dataclass(frozen=True, eq=False)
class RailSlices:
    """Sections of one rail along the track.

    x : (m,)  stations, growing [m];  sections : the raw profile at each, in metres (unit 1)
    features : number of those named along each section, which nothing here asks for
    """

    x: np.ndarray
    sections: tuple[RawProfile, ...]
    path: Path
    features: int = 0


def read_slices(path: Path, section_unit: float | None = None) -> RailSlices:
    """Read a .slcs and the files it names (relative to it): .prr, or two columns with the vertical axis down. Stations
    times S_SCALE are mm.

    section_unit : length of the unit of two-column sections [m]; None: what the files say, else the one that makes
        their widths fit. S_SCALE is
        the stations' own.

    Raises ProfileError where a number is missing, stations do not grow, a section file is missing, counts disagree, or
    it is a wheel.
    """
    path = Path(path)
    lines, _ = read_text(path)
    refuse_wheel(path, lines)
    rows = [(i, line.split("%")[0].strip()) for i, line in enumerate(lines, 1) if line.split("%")[0].strip()]
    if len(rows) < 5:
        raise ProfileError(f"{path}: {len(rows)} line(s) of data: not a whole .slcs file")
    offset, scale = (values_of(rows[0], path, 2) + [0.0])[:2]
    count, features = int(values_of(rows[1], path, 1)[0]), int(values_of(rows[2], path, 2)[0])
    found = [(i, match) for i, text in rows if (match := ROW.match(text))]
    if len(found) != count:
        raise ProfileError(f"{path}: NSLC = {count}, but {len(found)} section(s) are named")
    named = np.array([numbers([m[1]], path, i, 1)[0] for i, m in found])
    x = stations(path, found, (named + offset) * scale * 1e-3)
    sections = in_metres(path, [section(path, i, m[3]) for i, m in found], section_unit)
    return RailSlices(x, sections, path, features if features > 1 else 0)


def refuse_wheel(path: Path, lines: list[str]) -> None:
    """Slices round a wheel (.slcw: flats, out-of-round) have angles for stations: no rail, and nothing here runs on
    such a wheel."""
    angles = next((i for i, line in enumerate(lines, 1) if ROUND_A_WHEEL.search(line)), None)
    if path.suffix.lower() == ".slcw" or angles is not None:
        where = "" if angles is None else f" (line {angles})"
        raise ProfileError(
            f"{path}: slices round a wheel, with angles for stations{where}: a wheel with a flat or out of round is not"
            " supported; read one of its section files as a wheel"
        )


def values_of(row: tuple[int, str], path: Path, least: int) -> list[float]:
    """The leading numbers of a row, at least so many; names of what they are may follow them."""
    words = row[1].replace(",", " ").split()
    leading = next((k for k, word in enumerate(words) if not re.match(r"[+-]?\.?\d", word)), len(words))
    return numbers(words[: max(leading, min(least, len(words)))], path, row[0], least)


def stations(path: Path, found: list, x: np.ndarray) -> np.ndarray:
    step = np.diff(x)
    if np.any(step < NEAREST):
        at = int(np.argmax(step < NEAREST)) + 1
        near = f"lies {1e6 * step[at - 1]:.3g} um beyond" if step[at - 1] > 0 else "does not lie beyond"
        raise ProfileError(f"{path}: line {found[at][0]}: station {x[at]:g} m {near} {x[at - 1]:g} m")
    return x


def section(path: Path, line: int, name: str) -> RawProfile:
    """One section as its own file declares it."""
    file = path.parent / name
    if not file.is_file():
        raise ProfileError(f"{path}: line {line}: section file {file} is not there")
    return read_simpack(file) if file.suffix.lower() == ".prr" else read_columns(file)


def in_metres(path: Path, sections: list[RawProfile], section_unit: float | None) -> tuple[RawProfile, ...]:
    """Sections in metres, on the track's zero, vertical axis down where their format does not say."""
    unit, note = common_unit(path, sections, section_unit)
    out = []
    for raw in sections:
        points = raw.points * (unit if raw.unit is None else raw.unit)
        notes = (*raw.notes, *([note] if note and raw.unit is None else []))
        out.append(replace(raw, points=points, unit=1.0, kind="rail", up=raw.up or -1, notes=notes, placed=True))
    return tuple(out)


def common_unit(path: Path, sections: list[RawProfile], told: float | None) -> tuple[float | None, str]:
    """One unit [m] of all sections that do not say theirs, as told or by their median width, and a note where it is the
    width's; None where all say theirs. Errors: ProfileError where no unit, or more than one, fits the width."""
    silent = [raw for raw in sections if raw.unit is None]
    if told is not None or not silent:
        return told, ""
    width = float(np.median([np.ptp(raw.points[:, 0]) for raw in silent]))
    fitting = fitting_units(width, "rail")
    if len(fitting) != 1:
        limits = " to ".join(f"{1e3 * limit:g}" for limit in WIDTHS["rail"])
        raise ProfileError(
            f"{path}: its sections span {width:.4g} in the median; a rail is {limits} mm wide: give the unit of the"
            " sections"
        )
    unit = UNITS[fitting[0]]
    return unit, f"sections in {fitting[0]} by their width of {1e3 * width * unit:.4g} mm in the median"
