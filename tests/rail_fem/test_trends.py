"""Trends of a sweep: verdicts on numbers that are known, faults of the file, and the page with its figures."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from rail_fem import cli
from rail_fem.casefile import load_case
from rail_fem.result import PassResult, Peak
from rail_fem.trends import Trend, TrendError, check, load_groups, verdict

ROOT = Path(__file__).resolve().parents[2]
TRENDS = ROOT / "cases" / "thesis" / "trends.toml"
SCENE = load_case(ROOT / "cases" / "nose_transfer.toml").scene


def made(model: str, nose: float, dip: float = 1e-3) -> PassResult:
    x = np.linspace(0.1, 0.5, 50)
    history = {"time": np.linspace(0, 1e-2, 50), "x": x, "force": np.full(50, nose), "wheel_height": 0 * x, "crossing_height": -0.5e-3 - dip * np.sin(5 * x) ** 2}
    return PassResult(model, SCENE, {}, history, {"force_nose": Peak(nose, "N"), "force": Peak(nose, "N")}, transfer_x=0.36)


@pytest.mark.parametrize(
    "values, word",
    [([1, 2, 3], "agrees"), ([1, 2, 1.9], "differs"), ([1, 1.005, 1.0], "same"), ([1, 1.005, 1.1], "agrees"), ([3, 2], "differs"), ([1, 1.5, 1.495], "agrees"), ([-2, -1], "agrees")],
)
def test_verdicts(values, word):
    assert verdict(np.array(values, float)) == word


def test_a_rung_is_judged_only_where_it_has_all_cases():
    trend = Trend(says="more", quantity="nose peak", order=("a", "b"))
    results = {"a": {"lumped": made("lumped", 1e5), "fe_full": made("fe_full", 1e5)}, "b": {"fe_full": made("fe_full", 2e5)}}
    assert [(f.model, f.verdict, f.values) for f in check(trend, results)] == [("fe_full", "agrees", (100.0, 200.0))]
    deeper = Trend(says="down", quantity="crossing dip", order=("a", "b"))
    results["b"]["fe_full"] = made("fe_full", 2e5, dip=2e-3)
    wave = np.sin(5 * np.linspace(0.1, 0.5, 50)) ** 2
    found = check(deeper, results)[0]
    assert found.verdict == "agrees" and found.values == pytest.approx((wave.max() - wave[0], 2 * (wave.max() - wave[0])), rel=1e-12)  # mm


def test_the_trends_of_the_thesis_name_cases_that_exist():
    cases = {path.stem for path in TRENDS.parent.glob("case_*.toml")}
    groups = load_groups(TRENDS)
    assert {case for group in groups for case in group.cases} == cases
    assert {case for group in groups for trend in group.trend for case in trend.order} <= cases


@pytest.mark.parametrize(
    "text, words",
    [("[[group]]\ntitle = 'a'\n", "cases"), ("[[group]]\ntitle='a'\ncases=['b']\n[[group.trend]]\nsays='c'\nquantity='colour'\norder=['b','b']\n", "'colour' is not one of"),
     ("[[group]]\ntitle='a'\ncases=['b']\ntrends=1\n", "group.0.trends"), ("[[group]\n", "cannot be read")],
)  # fmt: skip
def test_faults_of_a_file_of_trends_are_named(tmp_path, text, words):
    path = tmp_path / "trends.toml"
    path.write_text(text)
    with pytest.raises(TrendError, match="trends.toml") as fault:
        load_groups(path)
    assert words in str(fault.value)


def test_the_page_holds_table_trends_and_figures(tmp_path):
    for case, nose in (("slow", 1e5), ("fast", 2e5)):
        made("lumped", nose).save(tmp_path / "sweep" / case / "lumped")
    trends = tmp_path / "trends.toml"
    trends.write_text("[[group]]\ntitle='Speed'\ncases=['slow','fast']\n[[group.trend]]\nsays='faster is harder'\nquantity='nose peak'\norder=['slow','fast']\npublished='1, 2'\n")
    run = lambda *arguments: CliRunner().invoke(cli.app, ["report", *map(str, arguments), "--groups", str(trends)])
    done = run(tmp_path / "sweep")
    assert done.exit_code == 0, done.output
    page = (tmp_path / "sweep" / "report" / "report.md").read_text()
    assert "lumped agrees: 100, 200 kN" in page and "| slow |" in page and "published: 1, 2" in page
    assert all((tmp_path / "sweep" / "report" / name).stat().st_size > 10_000 for name in ("summary.png", "speed.png"))
    nothing = run(tmp_path / "empty")
    assert nothing.exit_code == 2 and "no results in CASE/MODEL" in " ".join(nothing.output.split())
