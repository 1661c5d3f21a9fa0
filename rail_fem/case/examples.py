"""The example cases that come with the program: in cases/ of a checkout, in share/rail-fem of an installation."""

import sys
from pathlib import Path

FOLDERS = Path(__file__).resolve().parents[2] / "cases", Path(sys.prefix) / "share" / "rail-fem" / "cases"


def examples() -> dict[str, Path]:
    """Name -> case file."""
    return {
        path.stem: path for folder in reversed(FOLDERS) if folder.is_dir() for path in sorted(folder.glob("*.toml"))
    }


def example(name: str) -> Path:
    """The file of an example case, e.g. "nose_transfer". Errors: KeyError that names what there is."""
    found = examples()
    if name not in found:
        raise KeyError(f"no example case '{name}'; there are {', '.join(found) or 'none: is the installation whole?'}")
    return found[name]
