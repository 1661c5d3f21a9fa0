"""A profile as a file holds it, before anybody has judged its units, its side, its order or its datum."""

import math
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from io import BufferedReader
from pathlib import Path
from stat import S_ISREG

import numpy as np

from geometry.profiles.profile import ProfileError

KINDS = ("rail", "wheel")
LARGEST_FILE = 20_000_000  # bytes of a file that a user names
LARGEST_SECTIONS = 200_000_000  # a crossing's, in one table or as STEP
LARGEST_MESH = 8_000_000_000  # a million hexahedra have 100 MB


@dataclass(frozen=True, eq=False)
class RawProfile:
    """Points in a file's own units and order; only what the file itself declares has been applied.

    points : (n, 2)  lateral and vertical coordinate, in the file's unit
    lines : (n,)  line of the file each point stands on, counted from 1
    path, layout : the file and the name of its format
    unit : length of the file's unit [m]; None where the file does not say
    kind : "rail" or "wheel"; None where the file does not say
    up : +1 where the file's vertical axis points up, -1 down; None where its format does not say
    notes : what was applied or put right while reading, in words
    unit_told : the unit is the caller's word, not the file's
    placed : the zero is that of a track, shared with other sections
    flange_back : y of a wheel's flange back, in the file's unit; None where it does not say
    """

    points: np.ndarray
    lines: np.ndarray
    path: Path
    layout: str
    unit: float | None = None
    kind: str | None = None
    up: int | None = None
    notes: tuple[str, ...] = field(default=())
    unit_told: bool = False
    placed: bool = False
    flange_back: float | None = None

    @property
    def as_read(self) -> str:
        """Behind a refusal: how the file was read, should that be the reason."""
        return "".join(f"; {note}" for note in self.notes)


def open_file(
    path: Path, most: int = LARGEST_FILE, refused: Callable[[str], Exception] | None = None
) -> BufferedReader:
    """A file that a user names, open for reading: a regular one of at most `most` bytes, else refused before a byte of
    it is read; pipes and devices have no end.

    refused : the error of a reason;  Errors: ProfileError unless `refused` makes another, OSError.
    """
    refused = refused or (lambda why: ProfileError(f"{path}: {why}"))
    number = os.open(path, os.O_RDONLY | os.O_NONBLOCK)  # an open of a pipe would wait for its writer
    about = os.fstat(number)
    why = "" if S_ISREG(about.st_mode) else "cannot be read: it is no file"
    if about.st_size > most:
        why = why or f"{about.st_size / 1e6:.0f} MB, the largest that is read here has {most / 1e6:.0f} MB"
    if why:
        os.close(number)
        raise refused(why)
    return os.fdopen(number, "rb")


def read_text(path: Path, most: int = LARGEST_FILE) -> tuple[list[str], list[str]]:
    """Lines of a text file of at most `most` bytes without byte-order mark, and notes on its encoding. Raises
    ProfileError where it is no text."""
    with open_file(path, most) as stream:
        data = stream.read(most)
    notes = []
    if data.startswith(b"\xef\xbb\xbf"):
        data, notes = data[3:], ["byte-order mark left out"]
    elif data.startswith((b"\xff\xfe", b"\xfe\xff")):
        try:
            return data.decode("utf-16").splitlines(), ["UTF-16 text"]
        except UnicodeDecodeError as error:
            raise ProfileError(f"{path}: byte {error.start} is not the UTF-16 text that its first bytes tell") from None
    if b"\0" in data:
        raise ProfileError(f"{path}: byte {data.index(0)} is zero: this is no text file; export the profile as text")
    try:
        return data.decode("utf-8").splitlines(), notes
    except UnicodeDecodeError:
        return data.decode("latin-1").splitlines(), [*notes, "not UTF-8, read as Latin-1"]


def numbers(words: list[str], path: Path, line: int, least: int = 2) -> list[float]:
    """The words of one line as finite numbers. Raises ProfileError with file, line and word otherwise."""
    if len(words) < least:
        raise ProfileError(f"{path}: line {line}: {len(words)} number(s), a point needs {least}")
    values = []
    for word in words:
        try:
            value = float(word)
        except ValueError:
            raise ProfileError(f'{path}: line {line}: "{word}" is not a number') from None
        if not math.isfinite(value):
            raise ProfileError(f'{path}: line {line}: "{word}" is not finite; take the point out or measure it again')
        values.append(value)
    return values


def collect(rows: list[tuple[int, list[float]]], path: Path, layout: str, **known) -> RawProfile:
    """RawProfile of (line, values) rows. Raises ProfileError for fewer than 3 points."""
    if len(rows) < 3:
        raise ProfileError(f"{path}: {len(rows)} point(s) found as {layout}; a profile needs at least 3")
    points = np.array([values[:2] for _, values in rows])
    return RawProfile(points, np.array([line for line, _ in rows]), Path(path), layout, **known)
