"""A measured record from a CSV file: force or acceleration over time or position, with units and sampling rate.

# sampling rate: 10 kHz          only where the file has no column of time or position
time [ms], force [kN]            a column with its unit; or x [mm]; or the measured column alone

What else lines before the titles may say, for a search of the crossing's state (rail_fem.measurement.trace):

# bearer: 2                      on which the accelerometer is, where the case has bearers
# place: 350 mm                  x of it on the casting, there
# filter: 500 Hz                 low pass with which it was recorded
# noise: 0.4 m/s^2               standard deviation of a sample; none: of the quietest fifth
# scene.speed: 62 mph            a quantity of the case, of this pass
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path

import numpy as np

from geometry.profiles.formats.raw import read_text
from geometry.profiles.profile import ProfileError
from rail_fem.result.low_pass import evenly
from rail_fem.result.result import PassResult
from rail_fem.scene.input_errors import suggest
from rail_fem.scene.units import QuantityError, parse, root_units, si_factor

NOTE = re.compile(r"^\s*#\s*([\w. ]+?)\s*[:=]\s*(.+?)\s*$")
RATE, BEARER, PLACE, FILTER, NOISE = NOTES = "sampling rate", "bearer", "place", "filter", "noise"
ALIKE = 0.8  # share of letters, from which on a line before the titles is taken for a misspelt note
TITLE = re.compile(r"\s*([A-Za-z_ ]+?)\s*\[\s*(.*?)\s*\]\s*$")
GRAVITY_UNIT = "g"  # an acceleration's, not the gram
FEWEST = 20  # samples
LARGEST_RECORD, LONGEST_LINE = 50_000_000, 1000  # bytes; characters
MOST_EVEN = 100  # even steps for a row, where rows are sampled unevenly
# name in the file -> unit it must be convertible to, column of a result that it is held against, what that is
QUANTITIES = {
    "force": ("N", "force", "vertical force on the wheel"),
    "axle_box_acceleration": ("m/s^2", "wheel_height", "second derivative of the wheel's height"),
    "sleeper_acceleration": ("m/s^2", "crossing_height", "second derivative of the crossing's height"),
    "casting_acceleration": ("m/s^2", "crossing_height", "second derivative of the crossing's height"),
}
ACCELERATIONS = tuple(name for name, (unit, *_) in QUANTITIES.items() if unit == "m/s^2")


class RecordError(ValueError):
    """A record that cannot be read or compared: says file, line or column, and what to do."""


@dataclass(frozen=True, eq=False)
class Record:
    """Evenly sampled. quantity : of QUANTITIES;  position : (n,) [m], growing or falling;  values : (n,) [SI]
    rate : samples per second [Hz];  notes : what lines before the titles say, by name;  placed : by a column x"""

    quantity: str
    position: np.ndarray
    values: np.ndarray
    rate: float
    label: str = ""
    notes: Mapping[str, str] = field(default_factory=dict)
    placed: bool = False

    def noted(self, name: str, unit: str) -> float | None:
        """A quantity of the notes [SI], None without one. Errors: RecordError."""
        return _noted(self.notes, self.label, name, unit)


def read_notes(path: Path) -> dict[str, str]:
    """What lines before the titles say. Errors: RecordError, OSError."""
    notes = _notes(_lines(Path(path)))
    if near := [(one, like) for one in {*notes} - {*NOTES} for like in get_close_matches(one, NOTES, 1, ALIKE)]:
        raise RecordError(f"{path}: # {near[0][0]}: is not known, did you mean '{near[0][1]}'?")
    return notes


def read_record(path: Path, speed: float) -> Record:
    """Read a record. speed : of the wheel, signed [m/s], by which time becomes position from 0 on. Errors: RecordError,
    OSError."""
    path = Path(path)
    lines = _lines(path)
    told = _notes(lines)
    rows = [(k, line) for k, line in enumerate(lines, 1) if line.strip() and not line.lstrip().startswith("#")]
    if not rows:
        raise RecordError(f"{path}: holds no line of data")
    titles = [_title(path, text) for text in _cells(rows[0][1])]
    names = [name for name, _ in titles]
    if twice := [name for name in names if names.count(name) > 1]:
        raise RecordError(f'{path}: column "{twice[0]}" stands twice: leave one of the two out')
    values = _table(path, rows[1:], len(titles))
    columns = {name: values[:, k] * factor for k, (name, factor) in enumerate(titles)}
    measured = [name for name in columns if name in QUANTITIES]
    if len(measured) != 1:
        raise RecordError(f"{path}: {len(measured)} measured columns: give one of {', '.join(QUANTITIES)}")
    return _even_record(path, columns, measured[0], told, speed)


def of_result(result: PassResult, quantity: str) -> Record:
    """The same quantity of a result, evenly sampled. Errors: RecordError where the model does not resolve it."""
    history, (_, column, what) = result.history, QUANTITIES[quantity]
    if column == "crossing_height" and result.scene.bearers is not None:
        raise RecordError(
            f"{result.model} keeps the beam's height under the wheel, no bearer's: hold the record against the case,"
            " rail-fem measured RECORD CASE --find ..."
        )
    if len(history["time"]) < FEWEST or not np.isfinite(history[column]).all():
        raise RecordError(f"{result.model} does not resolve the {what}")
    time, x, values = evenly(history["time"], history["x"], history[column])
    step = time[1] - time[0]
    if quantity in ACCELERATIONS:
        values = np.gradient(np.gradient(values, step), step)
    return Record(quantity, x, values, 1 / step, result.model)


def _lines(path: Path) -> list[str]:
    try:
        lines, _ = read_text(path, LARGEST_RECORD)
    except ProfileError as error:
        raise RecordError(str(error)) from error
    longest = max(range(len(lines)), key=lambda k: len(lines[k]), default=0)
    if lines and len(lines[longest]) > LONGEST_LINE:
        raise RecordError(f"{path}: line {longest + 1}: {len(lines[longest])} characters, at most {LONGEST_LINE}")
    return lines


def _notes(lines: Sequence[str]) -> dict[str, str]:
    found = (NOTE.match(line) for line in reversed(lines))  # the first of a name counts
    return {one[1] if "." in one[1] else one[1].lower(): one[2] for one in found if one}


def _noted(notes: Mapping[str, str], label: str, name: str, unit: str) -> float | None:
    if name not in notes:
        return None
    try:
        value, _ = parse(notes[name], unit)
    except QuantityError as error:
        raise RecordError(f"{label}: {name}: {error}") from error
    if name != PLACE and not value > 0:
        raise RecordError(f"{label}: {name}: {notes[name]} must be positive")
    return value


def _title(path: Path, text: str) -> tuple[str, float]:
    """Name of a column and how many SI units one of its unit is."""
    found = TITLE.match(text)
    if found is None:
        raise RecordError(
            f'{path}: the first line names each column with its unit, as "time [ms], force [kN]", not'
            f' "{text.strip()[:40]}"'
        )
    name, unit = found[1].strip().lower().replace(" ", "_"), found[2]
    known = {"time": "s", "x": "m"} | {quantity: about[0] for quantity, about in QUANTITIES.items()}
    if name not in known:
        raise RecordError(f'{path}: column "{name}" is not known{suggest(name, known)}: {", ".join(known)}')
    if unit == GRAVITY_UNIT and known[name] == "m/s^2":
        return name, 9.80665
    try:
        if root_units(unit)[1] != root_units(known[name])[1]:
            raise RecordError(f'{path}: column "{name}" is in "{unit}", which is no unit such as {known[name]}')
        return name, si_factor(unit)
    except QuantityError as error:
        raise RecordError(f'{path}: column "{name}": {error}') from error


def _cells(text: str) -> list[str]:
    """Of a line: apart by semicolons or tabs, where a comma is a decimal one, else by commas."""
    return text.split(next((apart for apart in ";\t" if apart in text), ","))


def _table(path: Path, rows: list[tuple[int, str]], count: int) -> np.ndarray:
    values = np.empty((len(rows), count))
    for k, (line, text) in enumerate(rows):
        words = _cells(text)
        try:
            values[k] = [float(word.replace(",", ".")) for word in words]
        except ValueError as error:
            raise RecordError(
                f"{path}: line {line}: {len(words)} value(s), not {count} numbers with a decimal point:"
                f" {text.strip()[:50]}"
            ) from error
        if not np.isfinite(values[k]).all():
            raise RecordError(f"{path}: line {line}: a value is not finite")
    if len(values) < FEWEST:
        raise RecordError(f"{path}: {len(values)} row(s), at least {FEWEST} are needed")
    return values


def _even_record(
    path: Path, columns: dict[str, np.ndarray], quantity: str, notes: dict[str, str], speed: float
) -> Record:
    values = columns[quantity]
    if "x" in columns or "time" in columns:
        name = "x" if "x" in columns else "time"
        axis = columns[name]
        if not (np.all(np.diff(axis) > 0) or (name == "x" and np.all(np.diff(axis) < 0))):
            at = int(np.argmin(np.abs(np.diff(axis)) * np.sign(axis[-1] - axis[0])))
            raise RecordError(f"{path}: {name} does not run one way about row {at + 1} of the data")
        step, unit = np.abs(np.diff(axis)), "m" if name == "x" else "s"
        if not abs(axis[-1] - axis[0]) / (MOST_EVEN * len(axis)) <= step.min():
            at = int(np.argmax(step))
            raise RecordError(
                f"{path}: {step[at]:.4g} {unit} between rows {at + 1} and {at + 2} of the data, where its smallest step"
                f" is {step.min():.4g} {unit}: leave the gap out, or give rows that are evenly sampled"
            )
        time = (axis - axis[0]) / speed if name == "x" else axis - axis[0]
        if time[-1] < 0:
            raise RecordError(f"{path}: x runs against the pass: the case's wheel runs the other way")
        time, values = evenly(time, values)
        start = axis[0] if name == "x" else 0.0
    else:
        rate = _noted(notes, str(path), RATE, "Hz")
        if rate is None:
            raise RecordError(f'{path}: has neither time nor x: say "# sampling rate: 10 kHz" on its first line')
        time, start = np.arange(len(values)) / rate, 0.0
    with np.errstate(over="ignore"):
        position = start + speed * time
    if not np.isfinite([*position[[0, -1]], *values]).all():
        raise RecordError(f"{path}: its numbers are too large to be placed along the track: are its units right?")
    return Record(quantity, position, values, 1 / (time[1] - time[0]), path.name, notes, "x" in columns)
