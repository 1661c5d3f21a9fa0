"""One name, one thing: a public class has a name of its own among all packages, or stands below with the reason; and
files are told apart by their names."""

import ast
from collections import Counter, defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("geometry", "bem", "rail_fem")
SHARED = {
    "CellError": "of the cells of its own room",
    "Cells": "what fills a body in its own room: cuboids, polygons with plastic strain, polygons with inertia; no file"
    " uses two of them",
    "Cost": "the same idea: of one contact (bem), of a run (rail_fem), which sums what its contacts cost",
    "NoEquilibriumError": "the same refusal: a load beyond what the yielding body carries",
    "Trial": "the field's word in both rooms: a plastic step not accepted yet, one design of a search",
}


def public_classes() -> dict[str, list[str]]:
    """Name -> files in which a class of that name is defined at the top."""
    found = defaultdict(list)
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            for node in ast.parse(path.read_text(encoding="utf-8")).body:
                if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                    found[node.name].append(str(path.relative_to(ROOT)))
    return found


def test_a_class_has_a_name_of_its_own():
    twice = {name: files for name, files in public_classes().items() if len(files) > 1}
    assert len(public_classes()) > 300  # the walk finds them
    assert not {name: files for name, files in twice.items() if name not in SHARED}
    assert not SHARED.keys() - twice.keys()


MOST_FILES = 3  # of one name: a fourth is told from the others by nothing but its folder


def test_no_file_name_stands_more_than_three_times():
    paths = [path for package in (*PACKAGES, "tests") for path in (ROOT / package).rglob("*.py")]
    often = Counter(path.name for path in paths if path.name != "__init__.py")
    assert not {name: count for name, count in often.items() if count > MOST_FILES}
