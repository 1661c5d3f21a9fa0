"""Sections of a crossing from files, read once: a .slcs, a table of x, y, z, a folder of two-column files, or STEP.

A run keeps what it used as crossing_sections.csv in its folder, to the last bit, so that it can be shown, gone on with
and repeated when the first file has gone or has changed.
"""

import functools
import hashlib
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from geometry.cad.step_crossing import LARGEST_EXTENT, StepReading, read_step
from geometry.profiles.formats.columns import COMMENT, commas_are_decimal, read_columns, said_unit
from geometry.profiles.formats.raw import LARGEST_SECTIONS, RawProfile, numbers, open_file, read_text
from geometry.profiles.formats.simpack import read_simpack
from geometry.profiles.formats.slices import common_unit, read_slices
from geometry.profiles.formats.units import UNITS, metres_of
from geometry.profiles.profile import ProfileError
from geometry.surfaces.measured_crossing import MeasuredCrossing, measured_crossing, moved
from geometry.surfaces.sections import points_up
from rail_fem.files.atomic import write_text_atomically
from rail_fem.scene.base import KEPT_SECTIONS, STEP_SUFFIXES

STATIONS = "stations.csv"
ROUGH = 5e-6  # scatter of sections of which smoothing leaves what moves forces by some percent [m]
COARSE = 50e-6  # of arcs over the chords between points: every millimetre 39 um, which move forces by 1 % [m]
SPLIT = re.compile(r"[;,\s]+")
NAMED = re.compile(
    r"[\"']?([xyz])[\s_]*[\[(]?\s*(mm|cm|m|inch)?\s*[\])]?[\"']?", re.IGNORECASE
)  # a column, with its unit


@dataclass(frozen=True)
class SectionReading:
    """What is known of the files and overrules what they say.

    stations : name of the list of stations in a folder;  unit, station_unit : "mm", "cm", "m" or "inch"
    mirror : y grows towards the gauge side in the files;  lateral, height, along : added to y, z and x [m]
    faces, tolerance : of a STEP file (geometry.cad.step_crossing.StepReading)
    """

    stations: str = ""
    unit: str | None = None
    station_unit: str | None = None
    mirror: bool = False
    lateral: float = 0.0
    height: float = 0.0
    along: float = 0.0
    faces: str = "named"
    tolerance: float = 10e-6


@dataclass(frozen=True, eq=False)
class CrossingFile:
    """Sections as they were read: x (m,) stations, sections of y, z up in the project's axes [m].

    source : path of the file;  digest : SHA-256 of stations and points, not of names and comments
    """

    source: str
    x: np.ndarray
    sections: tuple[np.ndarray, ...]

    @functools.cached_property
    def digest(self) -> str:
        """SHA-256 of stations and sections, whatever the file is called."""
        data = hashlib.sha256(np.ascontiguousarray(self.x, "<f8").tobytes())
        for points in self.sections:
            data.update(f"{points.shape}".encode() + np.ascontiguousarray(points, "<f8").tobytes())
        return data.hexdigest()

    @functools.cached_property
    def warnings(self) -> list[str]:
        """What is doubtful about the sections, one line each."""
        bodies, told, label = self.crossing(False).sections, [], f"sections {Path(self.source).name}:"
        if found := bodies.outliers():
            name, x, y, off = max(found, key=lambda one: abs(one[-1]))
            told.append(
                f"{label} {len(found)} point(s) stand out of the line of their section, most the"
                f" {name}'s at x = {x * 1e3:.1f} mm, y = {y * 1e3:.2f} mm, by {off * 1e3:+.2g} mm, and forces"
                " follow them: correct them or take them out"
            )
        if (scatter := bodies.scatter()) > ROUGH:
            told.append(
                f"{label} scatter {1e6 * scatter:.2g} um > {1e6 * ROUGH:g} um: what smoothing leaves of it moves forces"
                " (of sections 10 mm apart, 10 um an impact and the largest force on the wing by up to 13 and 10 %,"
                " 20 um by 14 %): measure again"
            )
        if (sag := bodies.sag()) > COARSE:
            told.append(
                f"{label} points too far apart across: arcs stand {1e6 * sag:.2g} um > {1e6 * COARSE:g} um off their"
                " chords, and forces follow (of points every 2 mm the largest on the wing by 6 %, every 3 mm by 22 %):"
                " give points closer"
            )
        return told

    def crossing(self, extend: bool) -> MeasuredCrossing:
        """The crossing; the same object for the same sections. Errors: CrossingError."""
        return _crossing(self, extend)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, CrossingFile) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    def keep(self, folder: Path) -> None:
        """Write crossing_sections.csv into a run's folder. Errors: OSError."""
        rows = [
            f"{float(x)!r},{float(y)!r},{float(z)!r}" for x, points in zip(self.x, self.sections) for y, z in points
        ]
        head = ["# rail-fem sections of a crossing as a run used them", "# unit: m", "x,y,z"]
        write_text_atomically(Path(folder) / KEPT_SECTIONS, "\n".join([*head, *rows]) + "\n")


@functools.lru_cache(maxsize=8)
def _crossing(file: CrossingFile, extend: bool) -> MeasuredCrossing:
    return measured_crossing(file.x, list(file.sections), extend, Path(file.source).name)


def read_crossing(path: Path, reading: SectionReading = SectionReading()) -> CrossingFile:
    """Read a crossing's sections. Errors: ProfileError that says file, position and remedy; CrossingError for sections
    that are no crossing; OSError."""
    path = Path(path)
    if not path.is_dir():
        open_file(path, LARGEST_SECTIONS).close()
    if path.is_dir():
        x, sections = _read_folder(path, reading)
    elif path.suffix.lower() in STEP_SUFFIXES:
        x, sections = read_step(path, StepReading(reading.faces == "named", reading.tolerance))
    elif path.suffix.lower() == ".slcs":
        found = read_slices(path, metres_of(reading.unit))
        x, sections = found.x, [raw.points * [1.0, raw.up or -1] for raw in found.sections]
    elif path.suffix.lower() in (".csv", ".txt"):
        x, sections = _read_table(path, reading)
    else:
        raise ProfileError(
            f'{path}: sections are read from a .slcs, a .csv of x, y, z, or a folder; "{path.suffix}" is none of them'
        )
    placed = tuple(moved(points, reading.mirror, reading.lateral, reading.height) for points in sections)
    if not np.ptp(x) < LARGEST_EXTENT:
        raise ProfileError(f"{path}: stations from x = {np.min(x):g} to {np.max(x):g} m: is their unit right?")
    file = CrossingFile(str(path), np.asarray(x, float) + reading.along, placed)
    file.crossing(False)
    return file


def _read_table(path: Path, reading: SectionReading) -> tuple[np.ndarray, list[np.ndarray]]:
    """A table of x, y, z with z up; rows of one section stand together, its unit in the file or told."""
    lines, _ = read_text(path, LARGEST_SECTIONS)
    rows = [(i, line.strip(";, \t")) for i, line in enumerate(lines, 1) if line.strip(";, \t")]
    first = next((k for k, (_, line) in enumerate(rows) if re.match(r"[+-]?\.?\d", line)), None)
    if first is None:
        raise ProfileError(f"{path}: holds no row of x, y, z")
    rows = [(i, line) for i, line in rows[first:] if not line.startswith(COMMENT)]
    if commas_are_decimal([line for _, line in rows]):
        rows = [(i, line.replace(",", ".")) for i, line in rows]
    named, units = _columns(path, lines[: rows[0][0] - 1], rows[0][1])
    factor = metres_of(reading.unit) or units or said_unit(lines, path)
    if factor is None:
        raise ProfileError(f'{path}: write "# unit: mm" (or m) on its first line, or give unit')
    words = ((i, SPLIT.split(line)) for i, line in rows)
    values = np.array([numbers([row[k] for k in named if k < len(row)], path, i, 3) for i, row in words]) * factor
    starts = np.flatnonzero(np.r_[True, np.diff(values[:, 0]) != 0])
    return values[starts, 0], np.split(values[:, 1:], starts[1:])


def _columns(path: Path, heads: list[str], row: str) -> tuple[list[int], list[float] | None]:
    """Which columns are x, y and z, and the units that their names say [m], None where not all do: by the last of the
    lines before the first row that has as many words as it; without such a line the three that there are."""
    count = len(SPLIT.split(row))
    for at, line in reversed([*enumerate(heads, 1)]):
        names = re.split(r"\s*[;,\t]\s*" if re.search(r"[;,\t]", line) else r"\s+", line.strip("#%! \t"))
        found = {match[1].lower(): (k, match[2]) for k, name in enumerate(names) if (match := NAMED.fullmatch(name))}
        if len(names) == count and (found or count > 3):
            missing = [axis for axis in "xyz" if axis not in found]
            if missing:
                there = ", ".join(f'"{name[:20]}"' for name in names[:12])
                raise ProfileError(f"{path}: line {at}: columns {there}: no column is named {' or '.join(missing)}")
            order, units = zip(*(found[axis] for axis in "xyz"))
            return list(order), [UNITS[unit.lower()] for unit in units] if all(units) else None
    if count > 3:
        raise ProfileError(
            f"{path}: line {len(heads) + 1}: {count} columns without names: write a line above with x, y and z in it"
        )
    return [0, 1, 2], None


def _read_folder(folder: Path, reading: SectionReading) -> tuple[np.ndarray, list[np.ndarray]]:
    """Two-column files (or .prr) named, with their stations, in a list: a row holds the file's name and x."""
    path = folder / (reading.stations or STATIONS)
    if not path.is_file():
        raise ProfileError(
            f'{folder}: no list of stations "{path.name}": one row a section with its x and the name of its file'
        )
    lines, _ = read_text(path)
    factor = metres_of(reading.station_unit) or said_unit(lines, path)
    if factor is None:
        raise ProfileError(f'{path}: write "# unit: mm" (or m) on its first line, or give station_unit')
    x: list[float] = []
    raw = []
    rows = [line.split("#")[0].strip() for line in lines]
    comma = commas_are_decimal(rows)
    for i, line in enumerate(rows, 1):
        words = [word for word in SPLIT.split(line.replace(",", ".") if comma else line) if word]
        if not words:
            continue
        files = [word for word in words if (folder / word.strip("\"'")).is_file()]
        if len(files) != 1 or len(words) != 2:
            if not x and not any(re.match(r"[+-]?\.?\d", word) for word in words):
                continue  # a heading
            raise ProfileError(f'{path}: line {i}: "{line[:60]}" is not a file of {folder.name} and its x')
        file = folder / files[0].strip("\"'")
        x.append(numbers([word for word in words if word != files[0]], path, i, 1)[0] * factor)
        raw.append(read_simpack(file) if file.suffix.lower() == ".prr" else read_columns(file))
    if not x:
        raise ProfileError(f"{path}: names no section")
    return np.array(x), _in_metres(folder, raw, metres_of(reading.unit))


def _in_metres(folder: Path, raw: list[RawProfile], told: float | None) -> list[np.ndarray]:
    """Sections in metres, z up, y growing. One unit for all that do not say theirs."""
    unit, _ = common_unit(folder, raw, told)
    sections = [part.points * (part.unit or unit) for part in raw]
    sections = [points if points[0, 0] < points[-1, 0] else points[::-1] for points in sections]
    up = raw[0].up or points_up(sections[0][:, 1])
    return [points * [1.0, part.up or up] for points, part in zip(sections, raw)]
