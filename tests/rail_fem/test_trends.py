"""Trends of a sweep: verdicts on numbers that are known, input errors of the file, and the page with its figures."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from rail_fem import hierarchy
from rail_fem.case.casefile import CaseError, load_case
from rail_fem.passes.dip import trajectory_dip
from rail_fem.result.result import PassResult, Peak
from rail_fem.sweeps.published_table import published_table
from rail_fem.sweeps.trend_words import control_words, count_lines, run_control, trend_lines
from rail_fem.sweeps.trends import ControlExperiment, Group, Trend, TrendError, check, load_source, verdict
from tests.commands import call

ROOT = Path(__file__).resolve().parents[2]
TRENDS = ROOT / "cases" / "thesis" / "trends.toml"
SCENE = load_case("nose_transfer").scene


def made(model: str, nose: float, dip: float = 1e-3) -> PassResult:
    x = np.linspace(0.1, 0.5, 50)
    history = {
        "time": np.linspace(0, 1e-2, 50),
        "x": x,
        "force": np.full(50, nose),
        "wheel_height": 0 * x,
        "crossing_height": -0.5e-3 - dip * np.sin(5 * x) ** 2,
    }
    return PassResult(
        model,
        SCENE,
        {},
        history,
        dict.fromkeys(("first_impact_on_nose", "largest_force"), Peak(nose, "N")),
        transfer_x=0.36,
    )


@pytest.mark.parametrize(
    "values, unchanged, word",
    [
        ([1, 2, 3], 0.0, "agrees"),
        ([1, 2, 1.9], 0.0, "differs"),
        ([1, 1.005, 1.0], 0.0, "same"),
        ([1, 1.005, 1.1], 0.0, "agrees"),
        ([3, 2], 0.0, "differs"),
        ([1, 1.5, 1.495], 0.0, "agrees"),
        ([-2, -1], 0.0, "agrees"),
        ([1, 1.015, 1], 0.02, "agrees"),
        ([1, 1.03, 1], 0.02, "differs"),
        ([3, 2.97], 0.02, "agrees"),
    ],
)
def test_verdicts(values, unchanged, word):
    assert verdict(np.array(values, float), unchanged) == word


def test_a_model_is_judged_only_where_it_has_all_cases():
    trend = Trend(says="more", quantity="first impact on the nose", order=("a", "b"))
    results = {
        "a": {"lumped": made("lumped", 1e5), "fe_full": made("fe_full", 1e5)},
        "b": {"fe_full": made("fe_full", 2e5)},
    }
    assert [(f.model, f.verdict, f.values) for f in check(trend, results)] == [("fe_full", "agrees", (100.0, 200.0))]
    deeper = Trend(says="down", quantity="crossing dip", order=("a", "b"))
    results["b"]["fe_full"] = made("fe_full", 2e5, dip=2e-3)
    wave = np.sin(5 * np.linspace(0.1, 0.5, 50)) ** 2
    found = check(deeper, results)[0]
    assert found.verdict == "agrees" and found.values == pytest.approx(
        (wave.max() - wave[0], 2 * (wave.max() - wave[0])), rel=1e-12
    )  # mm


def test_values_are_told_with_their_bars_and_where_these_overlap():
    trend = Trend(says="more", quantity="first impact on the nose", order=("a", "b"))
    results = {
        "a": {name: made(name, 1e5) for name in ("lumped", "fe_full")},
        "b": {name: made(name, 1.2e5) for name in ("lumped", "fe_full")},
    }
    for case, bar in (("a", 5e3), ("b", 9e3)):
        results[case]["fe_full"] = replace(results[case]["fe_full"], error_bars={"first_impact_on_nose": bar})
    light, full = check(trend, results)
    assert light.words("kN") == "lumped agrees: 100, 120 kN"
    assert full.sure and full.words("kN") == "fe_full agrees: 100±5, 120±9 kN"
    results["b"]["fe_full"] = replace(results["b"]["fe_full"], error_bars={"first_impact_on_nose": 15e3})
    assert check(trend, results)[1].words("kN").endswith(" kN (within bars)")


def test_the_count_goes_by_the_most_expensive_model():
    """A cheap model that agrees does not hide that the most expensive differs."""
    trend = Trend(says="more", quantity="first impact on the nose", order=("a", "b"))
    results = {
        "a": {"lumped": made("lumped", 1e5), "fe_full": made("fe_full", 2e5)},
        "b": {"lumped": made("lumped", 2e5), "fe_full": made("fe_full", 1e5)},
    }
    assert count_lines((Group(title="G", cases=("a", "b"), trend=(trend,)),), results)[0].startswith("0 of 1")


def test_a_statement_of_each_case_is_judged_case_by_case_and_by_both_bars():
    """Nose forces of 100 and 200 kN against largest ones of 90 and 210: one speaks against, by 10 kN."""
    results = {}
    for case, nose, largest in (("a", 1e5, 0.9e5), ("b", 2e5, 2.1e5)):
        peaks = {"first_impact_on_nose": Peak(nose, "N", x=0.36), "largest_force": Peak(largest, "N", x=0.4)}
        results[case] = {"fe_full": replace(made("fe_full", nose), peaks=peaks)}
    above = Trend(says="more", quantity="first impact on the nose", exceeds=("largest force",), order=("a", "b"))
    (found,) = check(above, results)
    assert (found.verdict, found.against, found.sure) == ("differs", ("b",), True)
    assert found.words("kN") == "fe_full differs in 1 of 2 (b): 100, 200 kN"
    assert above.statement == "first impact on the nose above largest force: a, b"
    bars = {"first_impact_on_nose": 6e3, "largest_force": 5e3}  # together more than the margin
    results["b"]["fe_full"] = replace(results["b"]["fe_full"], error_bars=bars)
    assert not check(above, results)[0].sure
    for bounds, verdict_of in (((0, 150), "differs"), ((1, np.inf), "agrees"), ((100, 100), "differs")):
        inside = above.model_copy(update={"exceeds": (), "within": bounds})
        assert check(inside, results)[0].verdict == verdict_of
    with pytest.raises(ValueError, match="one case has no order"):
        Trend(says="more", quantity="largest force", order=("a",))


def test_what_should_not_change_is_sure_where_no_bar_could_turn_it():
    """3 % apart where 10 % are allowed: sure by bars of 2 %, not by bars of 5 %."""
    trend = Trend(says="alike", quantity="first impact on the nose", unchanged=0.1, order=("a", "b"))
    for bar, sure in ((2e3, True), (5e3, False)):
        results = {
            case: {"fe_full": replace(made("fe_full", nose), error_bars={"first_impact_on_nose": bar})}
            for case, nose in (("a", 1e5), ("b", 1.03e5))
        }
        assert [(f.verdict, f.sure) for f in check(trend, results)] == [("agrees", sure)]


def test_only_models_that_find_something_else_stand_on_a_line_of_their_own(tmp_path):
    group = Group(title="G", cases=("a", "b"), trend=(TREND.model_copy(update={"order": ("a", "b"), "because": ""}),))
    results = {
        case: {name: made(name, nose) for name in ("lumped", "bem_passage", "fe_full")}
        | {"rigid_hertz": made("rigid_hertz", 3e5 - nose)}
        for case, nose in (("a", 1e5), ("b", 2e5))
    }
    assert trend_lines(group, results, tmp_path)[1:] == [
        "  - rigid_hertz differs: 200, 100 kN",
        "  - fe_full agrees (so lumped, bem_passage): 100, 200 kN",
    ]


def test_the_trends_of_the_thesis_name_cases_that_exist():
    cases = {path.stem for path in TRENDS.parent.glob("case_*.toml")}
    groups = load_source(TRENDS).group
    assert {case for group in groups for case in group.cases} == cases
    assert {case for group in groups for trend in group.trend for case in trend.order} <= cases


@pytest.mark.parametrize(
    "text, words",
    [
        ("[[group]]\ntitle = 'a'\n", "cases"),
        (
            "[[group]]\ntitle='a'\ncases=['b']\n[[group.trend]]\nsays='c'\nquantity='colour'\norder=['b','b']\n",
            "'colour' is not one of",
        ),
        (
            (
                "[[group]]\ntitle='a'\ncases=['b']\n[[group.trend]]\nsays='c'\nquantity='largest"
                " force'\norder=['b','b']\n[[group.trend.control]]\nsays='d'\nquantity='smell'\n"
            ),
            "'smell' is not one of",
        ),
        ("[[group]]\ntitle='a'\ncases=['b']\ntrends=1\n", "group[0].trends: unknown key, did you mean 'trend'?"),
        ("title = 'a'\n", "group: missing"),
        ("[[group]\n", "not valid TOML"),
    ],
)
def test_faults_of_a_file_of_trends_are_named(tmp_path, text, words):
    path = tmp_path / "trends.toml"
    path.write_text(text)
    with pytest.raises(TrendError, match="trends.toml") as error:
        load_source(path)
    assert words in str(error.value)


def test_the_page_holds_table_trends_and_figures(tmp_path):
    for case, nose in (("slow", 1e5), ("fast", 2e5)):
        for model in ("lumped", "rigid_hertz"):
            made(model, nose).save(tmp_path / "sweep" / case / model)
    trends = tmp_path / "trends.toml"
    trends.write_text(
        "reference='slow'\nabsent=['7-99: a photograph']\n"
        "[[group]]\ntitle='Speed'\ncases=['slow','fast']\nfigures=['7-13','']\n"
        "[[group.trend]]\nsays='faster is harder'\nquantity='first impact on the nose'\n"
        "order=['slow','fast']\npublished='1, 2'\n"
    )
    run = partial(call, "report", "--groups", trends)
    run(tmp_path / "sweep")
    page = (tmp_path / "sweep" / "report" / "report.md").read_text()
    assert "rigid_hertz agrees (so lumped): 100, 200 kN" in page and "| slow |" in page and "published: 1, 2" in page
    assert (
        "1 of 1 trends agree" in page
        and "| 7-13 | `speed.png` |" in page
        and "because" not in page
        and "| 7-99 | - | a photograph |" in page
    )
    assert all(
        (tmp_path / "sweep" / "report" / name).stat().st_size > 10_000
        for name in ("summary.png", "speed.png", "reference_forces.png", "reference_dip.png")
    )
    assert "no results in CASE/MODEL" in " ".join(run(tmp_path / "empty", code=2).output.split())


TREND = Trend(
    says="faster is harder",
    quantity="first impact on the nose",
    order=("case_03", "case_02", "case_01"),
    because="of the wing's bend",
)


def test_a_reason_is_said_only_where_a_model_does_not_agree(tmp_path):
    group = lambda trend: Group(title="Speed", cases=("a", "b"), trend=(trend,))
    trend = TREND.model_copy(update={"order": ("a", "b")})
    of = lambda a, b, model="fe_full": {"a": {model: made(model, a)}, "b": {model: made(model, b)}}
    say = lambda results: "\n".join(trend_lines(group(trend), results, tmp_path))
    assert "because" not in say(of(1e5, 2e5))
    assert "  - differs because: of the wing's bend" in say(of(2e5, 1e5)) and "  - no change because" in say(
        of(1e5, 1e5)
    )
    mixed = {case: of(1e5, 2e5)[case] | of(2e5, 1e5, "lumped")[case] for case in "ab"}
    assert "  - some models differ because" in say(mixed)
    assert count_lines((group(trend),), of(2e5, 1e5)) == [
        "0 of 1 trends agree by the most expensive model that resolves them, 0 of these by more than the bars; 1"
        " differ, 0 show no change above 1 %. By group: Speed 0 of 1."
    ]


def test_a_control_changes_what_it_says_and_nothing_else():
    """Speed against nose force differs on the thesis' cases and agrees where the wheel begins on the falling wing: the
    reason in trends.toml."""
    plain = run_control(ControlExperiment(says="as it is"), TREND, TRENDS.parent)
    begun = run_control(
        ControlExperiment(says="later", change={"run.rigid_hertz.start": "300 mm"}), TREND, TRENDS.parent
    )
    assert (plain.verdict, begun.verdict) == ("differs", "agrees")
    same = run_control(
        ControlExperiment(says="all alike", only={c: {"scene.speed": "75 mph"} for c in TREND.order}),
        TREND,
        TRENDS.parent,
    )
    assert same.verdict == "same" and len(set(same.values)) == 1 and same.values[0] == plain.values[1]


@pytest.mark.parametrize(
    "control, words",
    [
        ({"change": {"scene.speeed": "50 mph"}}, "scene.speeed: unknown key"),
        ({"change": {"version.of": 1}}, "version is no table"),
        ({"change": {"run.rigid_hertz.start": 300}}, "run.rigid_hertz.start"),
    ],
)
def test_a_change_that_cannot_be_made_is_named(control, words):
    with pytest.raises(CaseError) as error:
        run_control(ControlExperiment(says="bad", **control), TREND, TRENDS.parent)
    assert words in " ".join(str(error.value).split())


def test_controls_are_light_models_that_resolve_the_trend():
    with pytest.raises(ValueError, match="none of the light models p2_formula"):
        ControlExperiment(says="dear", model="fe_full")
    blind = ControlExperiment(says="blind", model="lumped")
    assert run_control(blind, TREND, TRENDS.parent) is None
    assert control_words(blind, TREND, TRENDS.parent) == "blind: lumped does not resolve it on this scene"


def test_every_trend_of_the_thesis_that_a_model_of_the_sweep_contradicts_has_a_reason():
    """By the quick models, run here: the page leaves no difference without a because."""
    groups = load_source(TRENDS).group
    results = {}
    for name in {case for group in groups for trend in group.trend for case in trend.order}:
        case = load_case(TRENDS.parent / f"{name}.toml")
        results[name] = {
            model: hierarchy.solve(model, case.scene, case.runs[model])
            for model in ("p2_formula", "lumped", "rigid_hertz")
        }
    bare = [
        trend.says
        for group in groups
        for trend in group.trend
        if {f.verdict for f in check(trend, results)} - {"agrees"} and not trend.because
    ]
    assert not bare


def test_dip_of_a_bent_path_is_the_angle_between_its_sides():
    """Two straight lines with 12 mrad between them: exact but for the chord, which straight sides do not feel."""
    x = np.linspace(0.1, 0.55, 901)
    height = np.where(x < 0.36, -7e-3 * (x - 0.36), 5e-3 * (x - 0.36))
    result = PassResult("rigid_hertz", SCENE, {}, {"time": x / 33.5, "x": x, "wheel_height": height}, transfer_x=0.36)
    assert trajectory_dip(result).angle == pytest.approx(np.arctan(7e-3) + np.arctan(5e-3), rel=1e-9)
    trailing = SCENE.model_copy(update={"direction": "trailing"})
    back = PassResult(
        "rigid_hertz", trailing, {}, {"time": x / 33.5, "x": x[::-1], "wheel_height": height[::-1]}, transfer_x=0.36
    )
    assert trajectory_dip(back).angle == pytest.approx(trajectory_dip(result).angle, rel=1e-9)
    assert np.isnan(trajectory_dip(PassResult("lumped", SCENE, {}, {"time": x, "x": x})).angle)


X = np.linspace(0.3, 0.4, 5)
ONE_IMPACT = {
    "history": {"time": X / 30, "x": X, "force": 1e3 * np.array([90, 100, 200, 90, 90.0])}
    | {"force_nose": 1e3 * np.array([0, 0, 150, 90, 90.0]), "force_wing": 1e3 * np.array([90, 100, 50, 0, 0.0])}
}


def test_table_7_5_beside_our_columns():
    source, case = load_source(TRENDS), load_case(TRENDS.parent / "case_02.toml")
    results = {"case_02": {"p2_formula": hierarchy.solve("p2_formula", case.scene, case.runs["p2_formula"])}}
    head, _, row = published_table(source.published, results)
    cells = dict(zip([c.strip() for c in head.split("|")], [c.strip() for c in row.split("|")]))
    assert cells["our P2 with that 2a [kN]"] == "175.32" and cells["published P2 [kN]"] == "175.28"
    results["case_02"]["rigid_hertz"] = PassResult("rigid_hertz", case.scene, {}, **ONE_IMPACT)
    head, _, row = published_table(source.published, results)
    assert head.count("rigid_hertz: impact on the wheel, first on the nose, largest on nose [kN]") == 1
    assert row.endswith(" 200.0, 150.0, 150.0 |")  # the wing carries 50 kN as the nose is struck
    assert published_table((), results) == [] and published_table(source.published, {}) == []


def test_results_of_an_older_scene_are_named_and_left_out_of_the_page(tmp_path):
    """A case file that was changed after its run: its result is named with what differs, the other one stays; with none
    left there is no page."""
    text = (TRENDS.parent / "case_02.toml").read_text()
    for name in ("new", "old"):
        (tmp_path / f"{name}.toml").write_text(text)
        case = load_case(tmp_path / f"{name}.toml")
        hierarchy.solve("p2_formula", case.scene, case.runs["p2_formula"]).save(
            tmp_path / "sweep" / name / "p2_formula"
        )
    (tmp_path / "trends.toml").write_text("[[group]]\ntitle='Speed'\ncases=['old','new']\n")
    (tmp_path / "old.toml").write_text(text.replace('speed = "75 mph"', 'speed = "50 mph"'))
    run = partial(call, "report", tmp_path / "sweep", "--groups", tmp_path / "trends.toml")
    run()
    page = (tmp_path / "sweep" / "report" / "report.md").read_text()
    assert "| new |" in page and "| old |" not in page and "of another scene than its case file: speed: 33.5" in page
    assert "remove" not in page
    (tmp_path / "new.toml").write_text(text.replace('speed = "75 mph"', 'speed = "60 mph"'))
    said = " ".join(run(code=2).output.split())  # the reason once, not for each of a sweep's cases
    assert "that can be used" in said and said.endswith("and 1 more")


def test_a_digest_holds_the_text_and_small_figures(tmp_path):
    for case, nose in (("slow", 1e5), ("fast", 2e5)):
        made("lumped", nose).save(tmp_path / "sweep" / case / "lumped")
    trends = tmp_path / "trends.toml"
    trends.write_text("[[group]]\ntitle='Speed'\ncases=['slow','fast']\n")
    digest = "--digest", tmp_path / "docs" / "page.md"
    run = partial(call, "report", tmp_path / "sweep", "--groups", trends, *digest)
    run("--show", "speed")
    assert {path.name for path in (tmp_path / "docs").iterdir()} == {
        "page.md",
        "page_speed.png",
    } and "(page_speed.png)" in (tmp_path / "docs" / "page.md").read_text()
    assert (tmp_path / "docs" / "page_speed.png").stat().st_size < 150_000
    refused = run("--show", "colour", code=2)
    assert "--show colour: no such figure; there are summary, speed" in " ".join(refused.output.split())
