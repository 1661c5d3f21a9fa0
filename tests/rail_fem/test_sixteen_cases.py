"""docs/sixteen_cases.md is the page that the program writes of the sweep of the thesis' cases, not an older one."""

import re
from pathlib import Path

import pytest

from rail_fem.case.casefile import load_case
from rail_fem.hierarchy import MODELS, solve
from rail_fem.sweeps.trends import load_source

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "sixteen_cases.md"
CASES = sorted((ROOT / "cases" / "thesis").glob("case_*.toml"))


@pytest.fixture(scope="module")
def page() -> str:
    return PAGE.read_text(encoding="utf-8")


def test_it_holds_every_case_trend_and_reason(page):
    source = load_source(ROOT / "cases" / "thesis" / "trends.toml")
    assert len(CASES) == 16 and all(page.count(f"\n| {case.stem} |") == 2 for case in CASES)  # in both tables
    for trend in (trend for group in source.group for trend in group.trend):
        assert f"- **{trend.says}**" in page
        assert not trend.because or trend.because in page
        assert all(f"control: {control.says}" in page for control in trend.control)
    for figure in [
        *(name for group in source.group for name in group.figures),
        *(line.split(":")[0] for line in source.absent),
        *source.reference_figures,
    ]:
        assert f"\n| {figure} |" in page


def test_its_figures_lie_beside_it_and_are_small(page):
    names = re.findall(r"!\[.*?\]\((.*?)\)", page)
    assert 2 <= len(names) <= 3 and all((PAGE.parent / name).is_file() for name in names)
    assert PAGE.stat().st_size + sum((PAGE.parent / name).stat().st_size for name in names) < 600_000


@pytest.mark.parametrize("case", CASES[1::7], ids=lambda case: case.stem)
def test_its_numbers_are_those_of_the_program(page, case):
    """The light models, as they are printed."""
    found = load_case(case)
    row = next(line for line in page.splitlines() if line.startswith(f"| {case.stem} |"))
    cells = row.split(" | ")
    result = solve("rigid_hertz", found.scene, found.runs["rigid_hertz"])
    first, wing, nose = (
        result.peaks[name].value / 1e3 for name in ("first_impact", "largest_force_wing", "largest_force_nose")
    )
    assert cells[2 + list(MODELS).index("rigid_hertz")] == f"{first:.1f}; {wing:.1f} / {nose:.1f}"
