"""The text of a case file, read within bounds: what is too large or too deep to be a case is refused before it is
parsed.

A reader of TOML takes time that grows with the square of a key's parts, recurses into nested arrays, and works out
integers of any length.
"""

import re
import tomllib
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from geometry.profiles.formats.raw import LARGEST_FILE, open_file
from rail_fem.scene.input_errors import describe_errors, plain, suggest

Kind = TypeVar("Kind", bound=BaseModel)

LARGEST_TEXT = 200_000  # characters without comments; the largest case of the thesis has 2000
LONGEST_STRING = 2000
DEEPEST = 12  # brackets in brackets
MOST_KEYS = 2000
MOST_BESIDE = 20  # files named beside one that is not there
MOST_PARTS = 12  # of a key: [run.fe_full] has 2
LONGEST_WORD = 100  # of a number or a key's part
# Every alternative matches in one pass, an unclosed text to the end of the file: no part of it is looked at twice.
STRINGS_AND_COMMENTS = re.compile(
    r"""
    \"\"\"(?:[^"\\]++|\\.|"(?!""))*+(?:"{3,5}|\\?\Z) | \'\'\'(?:[^']++|'(?!''))*+(?:'{3,5}|\Z)
    | "(?:[^"\\\n]++|\\.)*+"? | '[^'\n]*+'? | \#[^\n]*+
""",
    re.DOTALL | re.VERBOSE,
)


class CaseTextError(ValueError):
    """A file that is no case; the message says why and what to do."""


def located(path: Path | str) -> Path:
    """A file, or the example of that name where it is given by a name that is no file's."""
    path = Path(path)
    if path.suffix or path.exists():
        return path
    from rail_fem.case.examples import examples

    return examples().get(path.as_posix(), path)


def read_table(path: Path) -> dict[str, Any]:
    """The tables of a TOML file as plain values. Errors: CaseTextError with one sentence."""
    try:
        str(path.resolve()).encode()
        with open_file(path, refused=CaseTextError) as stream:
            text = stream.read(LARGEST_FILE).decode("utf-8-sig")
        check_size(text)
        return tomllib.loads(text)
    except FileNotFoundError:
        raise CaseTextError(_absent(path)) from None
    except OSError as error:
        raise CaseTextError(f"cannot be read: {error.strerror}") from error
    except UnicodeEncodeError as error:
        raise CaseTextError("its folder's or its own name is not UTF-8 text: give it another name") from error
    except UnicodeDecodeError as error:
        raise CaseTextError(f"byte {error.start} is not UTF-8 text: save the file as UTF-8") from error
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise CaseTextError(f"not valid TOML: {error}") from error


def _absent(path: Path) -> str:
    """That there is no such file, and what there is: beside it, or of examples by their names."""
    from rail_fem.case.examples import examples

    beside = sorted(file.name for file in path.parent.glob("*.toml"))[:MOST_BESIDE] if path.suffix else []
    there = f"; beside it: {', '.join(map(plain, beside))}" if beside else ""
    close = suggest(path.name, beside) if beside else suggest(path.as_posix(), examples())
    return f"no such file{close}{there}; 'rail-fem list' names the examples"


def read_as(path: Path, kind: type[Kind], refused: type[ValueError]) -> Kind:
    """A TOML file of another kind than a case. Errors: `refused` with the file, each key and what to do."""
    try:
        return kind.model_validate(read_table(path), context={"units_required": True})
    except CaseTextError as error:
        raise refused(f"{path}: {error}") from error
    except ValidationError as error:
        errors = describe_errors(error, kind, "")
        raise refused("\n  ".join([f"{path}: {len(errors)} input error(s)", *errors])) from error


def check_size(text: str) -> None:
    """Refuse what no case needs, in time that grows as the text does. Errors: CaseTextError with line, size and
    bound."""
    bare = STRINGS_AND_COMMENTS.sub(_blank, text)
    written = len(bare) - bare.count("\n")
    if written > LARGEST_TEXT:
        raise CaseTextError(f"{written} characters without comments, a case has at most {LARGEST_TEXT}")
    if bare.count("=") > MOST_KEYS:
        raise CaseTextError(f"{bare.count('=')} keys, a case has at most {MOST_KEYS}")
    for number, line in enumerate(bare.split("\n"), 1):
        if line.count(".") > MOST_PARTS * (1 + line.count(",") + line.count("=")):
            raise CaseTextError(f"line {number}: {line.count('.')} dots, a key has at most {MOST_PARTS} parts")
    long = re.search(rf"[\w+-]{{{LONGEST_WORD + 1},}}", bare)
    if long:
        length = long.end() - long.start()
        raise CaseTextError(f"line {_line(long)}: a word of {length} characters, the longest allowed is {LONGEST_WORD}")
    depth = 0
    for bracket in re.finditer(r"[\[{\]}]", bare):
        depth = depth + 1 if bracket[0] in "[{" else max(depth - 1, 0)
        if depth > DEEPEST:
            raise CaseTextError(f"line {_line(bracket)}: brackets {depth} deep, at most {DEEPEST} are allowed")


def _line(found: re.Match) -> int:
    return found.string.count("\n", 0, found.start()) + 1


def _blank(found: re.Match) -> str:
    """A comment gives nothing, a string its quotes and line ends, so that positions stay on their lines."""
    text = found[0]
    if text.startswith("#"):
        return ""
    if len(text) > LONGEST_STRING:
        raise CaseTextError(
            f"line {_line(found)}: a text of {len(text)} characters, the longest allowed is {LONGEST_STRING}"
        )
    return '""' + "\n" * text.count("\n")
