"""Files of others that stay outside the repository: where tests look for them, and how they say that they were not
there.

The folder is named by the environment variable RAIL_FEM_DATA; without it, `shared/data` beside the project's folder. A
file is looked for at its path there and, for those of CONTACT's test bank, directly in the folder, so that the folder
can be `testbank/profiles` of its sources.
"""

import os
from pathlib import Path

import pytest

PROJECT = Path(__file__).resolve().parents[1]
VARIABLE = "RAIL_FEM_DATA"
ABSENT = "outside file not at hand: "
CONTACT = "test bank of CONTACT (Apache 2.0): github.com/eve70a/CONTACT, folder testbank/profiles"
SOURCES = {
    "formats/uk_crossing.slcs": f"sections of the S&C benchmark's UK crossing, 1:9.25; {CONTACT}",
    "formats": CONTACT,
    "profiles/wheel_P": "this project's own surrogates for worn wheels and P1; not public",
    "profiles/wheel_": (
        "wheel profiles of EN 13715, as transcribed in github.com/rohrbecka/EN13715; y and z of the standard in two"
        " columns, in mm"
    ),
    "profiles/rail_": (
        "rail heads of EN 13674-1, as transcribed in github.com/rohrbecka/EN13674; y and depth in two columns, in mm"
    ),
}


def outside(name: str) -> Path:
    """Path of an outside file or folder, there or not."""
    folder = Path(os.environ.get(VARIABLE) or PROJECT.parent / "shared" / "data")
    direct = folder / name.partition("/")[2]
    return direct if name.startswith("formats/") and direct.exists() else folder / name


def needs(name: str) -> pytest.MarkDecorator:
    """Mark of tests that need this outside file."""
    return pytest.mark.skipif(not outside(name).exists(), reason=ABSENT + name)


def found(name: str) -> Path:
    """Path of an outside file; skips the test where it is not there."""
    if not outside(name).exists():
        pytest.skip(ABSENT + name)
    return outside(name)


def report(skipped: dict[str, list[str]]) -> list[str]:
    """Lines that say which tests were not run for want of which files, and where those can be had. skipped : {file:
    names of tests}"""
    count = sum(map(len, skipped.values()))
    lines = [
        f"{count} test(s) were NOT RUN, among them the strongest evidence from outside: they need files of others,"
        " which this repository does not hold."
    ]
    for name, tests in sorted(skipped.items()):
        names = sorted({test.split("[")[0] for test in tests})
        source = next((text for start, text in SOURCES.items() if name.startswith(start)), "not named")
        lines += [f"  {name}: {len(tests)} test(s)", f"    from: {source}", *(f"    {test}" for test in names)]
    return [
        *lines,
        (
            f"Put the files into a folder and name it: {VARIABLE}=FOLDER ./test.sh (the part before the / is a folder"
            " in it). Beside each such test one runs"
        ),
        "that needs no outside file.",
    ]
