"""The example cases that come with the program: in cases/ of a checkout, in share/rail-fem of an installation."""

import sys
from pathlib import Path

from rail_fem.scene.input_errors import suggest

FOLDERS = Path(__file__).resolve().parents[2] / "cases", Path(sys.prefix) / "share" / "rail-fem" / "cases"


def examples() -> dict[str, Path]:
    """Name, with its folder below cases/, -> case file, design file or file of groups."""
    folder = next((folder for folder in FOLDERS if folder.is_dir()), FOLDERS[0])
    return {path.relative_to(folder).with_suffix("").as_posix(): path for path in sorted(folder.rglob("*.toml"))}


def example(name: str) -> Path:
    """The case file of an example.

    Parameters
    ----------
    name : str
        E.g. "nose_transfer" or "damage/crossing_mix"; `rail-fem list` has all.

    Returns
    -------
    Path

    Raises
    ------
    KeyError
        For another name, with what there is.

    Examples
    --------
    >>> rail_fem.example("nose_transfer").name
    'nose_transfer.toml'
    """
    found = examples()
    if name not in found:
        there = ", ".join(found) or "none: is the installation whole?"
        raise KeyError(f"no example case '{name}'{suggest(name, found)}; there are {there}")
    return found[name]
