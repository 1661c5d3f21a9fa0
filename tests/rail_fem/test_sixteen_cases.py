"""docs/sixteen_cases.md and docs/sixteen_whole.md are the pages that the program writes of the sweeps of the thesis'
cases, not older ones."""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from rail_fem.case.casefile import load_case
from rail_fem.hierarchy import MODELS, solve
from rail_fem.result.events import leg_flight
from rail_fem.sweeps.published_table import leg_words
from rail_fem.sweeps.sweep_report import forces_of
from rail_fem.sweeps.trends import Source, load_source

ROOT = Path(__file__).resolve().parents[2]
CASES = sorted((ROOT / "cases" / "thesis").glob("case_*.toml"))


class Page(NamedTuple):
    """A page: its file and text, the groups it was made of, in how many tables each case stands, parts of the
    crossing."""

    path: Path
    text: str
    source: Source
    tables: int
    parts: tuple[str, ...]


@pytest.fixture(
    scope="module",
    params=[
        ("sixteen_cases", "trends", 2, ("wing", "nose")),
        ("sixteen_whole", "whole_crossing", 3, ("leg", "wing", "nose")),
    ],
    ids=lambda found: found[0],
)
def page(request) -> Page:
    name, groups, tables, parts = request.param
    path = ROOT / "docs" / f"{name}.md"
    source = load_source(ROOT / "cases" / "thesis" / f"{groups}.toml")
    return Page(path, path.read_text(encoding="utf-8"), source, tables, parts)


def test_it_holds_every_case_trend_and_reason(page):
    text, source = page.text, page.source
    assert len(CASES) == 16 and all(text.count(f"\n| {case.stem} |") == page.tables for case in CASES)
    for trend in (trend for group in source.group for trend in group.trend):
        assert f"- **{trend.says}**" in text
        assert not trend.because or trend.because in text
        assert all(f"control: {control.says}" in text for control in trend.control)
    for figure in [
        *(name for group in source.group for name in group.figures if name),
        *(line.split(":")[0] for line in source.absent),
        *(name for name in source.reference_figures if name),
    ]:
        assert f"\n| {figure} |" in text


def test_it_and_all_its_runs_are_of_one_committed_state(page):
    assert re.search(r"^All runs at commit [0-9a-f]{12}\.$", page.text, re.MULTILINE) and "-dirty" not in page.text


def test_no_trend_differs_without_a_reason(page):
    """By the most expensive model that has all of its cases."""
    for block in page.text.split("\n- **")[1:]:
        verdicts = re.findall(r"\n  - (?:p2_formula|lumped|rigid_hertz|bem_passage|fe_full) (\w+)", block)
        assert verdicts or "no model has all of these results" in block, block[:80]
        assert verdicts[-1:] in (["agrees"], []) or " because: " in block, block[:80]


def test_its_figures_lie_beside_it_and_are_small(page):
    names = re.findall(r"!\[.*?\]\((.*?)\)", page.text)
    assert 1 <= len(names) <= 3 and all((page.path.parent / name).is_file() for name in names)
    assert page.path.stat().st_size + sum((page.path.parent / name).stat().st_size for name in names) < 600_000


@pytest.mark.parametrize("case", CASES[1::7], ids=lambda case: case.stem)
def test_its_numbers_are_those_of_the_program(page, case):
    """The light models, as they are printed."""
    found = load_case(case, page.source.of(case.stem))
    row, *others = (line for line in page.text.splitlines() if line.startswith(f"| {case.stem} |"))
    result = solve("rigid_hertz", found.scene, found.runs["rigid_hertz"])
    assert row.split(" | ")[2 + list(MODELS).index("rigid_hertz")] == forces_of(result, page.parts)
    assert leg_flight(result) is None or any(f" | {leg_words(result)} | " in line for line in others)


def test_how_far_each_light_model_is_off_is_that_of_the_page():
    """Forces on the body taking over, wing and nose beside fe_full's; of a formula its one force beside the first, of a
    model without bodies beside the largest."""
    lines = (ROOT / "docs" / "sixteen_cases.md").read_text(encoding="utf-8").splitlines()
    head = next(line for line in lines if line.startswith("| case |")).split(" | ")
    rows = [row for line in lines if line.startswith("| case_") and len(row := line.split(" | ")) == len(head)]
    column = {words.split(":")[0]: at for at, words in enumerate(head) if ":" in words}
    force = lambda cell: [float(one) for one in re.findall(r"(?<!- )(?<![\d.±])\d+\.\d", cell)]
    for name in ("p2_formula", "lumped", "rigid_hertz", "bem_passage"):
        off = []
        for row in rows:
            exact, own = force(row[column["fe_full"]])[-3:], force(row[column[name]])[-3:]
            exact = [max(exact)] if name == "lumped" else exact[: len(own)]
            off += [abs(a / b - 1) for a, b in zip(own, exact, strict=True)]
        assert MODELS[name].off == pytest.approx((np.quantile(off, 0.9), max(off)), abs=5e-3), name
