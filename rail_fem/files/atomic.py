"""Files that appear whole or not at all: written under another name in the same folder, then renamed."""

import csv
import errno
import io
import os
import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

PARTIAL = re.compile(r"\..+\.\d+\.partial(\.[^.]*)?")


def partial_name(path: Path) -> Path:
    """Under which this process writes a file before it gets its name."""
    path = Path(path)
    return path.with_name(f".{path.stem}.{os.getpid()}.partial{path.suffix}")


def write_atomically(path: Path, write: Callable[[Path], object]) -> None:
    """Call `write(temporary)` and rename the temporary file to `path`; a reader or a kill never meets half a file.

    Errors: whatever `write` raises, an OSError by the name of `path`; the temporary file is then removed and `path`
    is as before.
    """
    if not Path(path).name or Path(path).is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    temporary = partial_name(path)
    try:
        write(temporary)
        os.replace(temporary, path)
    except OSError as error:
        if error.filename is None or str(error.filename) == str(temporary):
            error.filename = str(path)
            del error.filename2  # None would be printed, as "-> None"
        raise
    finally:
        temporary.unlink(missing_ok=True)


def remove_partial(*folders: Path) -> None:
    """Remove what killed writers left in these folders. Nobody else may be writing there. Errors: OSError."""
    for folder in folders:
        for entry in sorted(Path(folder).glob(".*")):
            if PARTIAL.fullmatch(entry.name):
                entry.unlink(missing_ok=True)


def write_text_atomically(path: Path, text: str) -> None:
    """The file holds all of the text (UTF-8) or is not changed."""
    write_atomically(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))


def csv_text(rows: Iterable[Iterable[Any]]) -> str:
    """Rows of cells as the text of a .csv file."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()
