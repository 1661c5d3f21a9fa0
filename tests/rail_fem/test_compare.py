"""Results side by side: errors against a known history, refusals, the least expensive that is good enough."""

import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from rail_fem.case.casefile import load_case
from rail_fem.result.events import force_peaks
from rail_fem.result.result import Cost, PassResult, Peak
from rail_fem.sweeps.compare import QUANTITIES, CompareError, Comparison, common_path, compare, forces_on, history_error
from rail_fem.sweeps.compare_report import advice, strain_table, table
from tests.commands import call

SCENE = load_case("nose_transfer").scene


def made(model: str, factor: float, seconds: float, path=(0.1, 0.5), rows=401, backwards=False) -> PassResult:
    """A force of 100 kN (1 + sin 20 x) along the path, times a factor, on the nose from x = 0.26 m on: first impact and
    largest force of 200 kN at 0.3927 m."""
    x = np.linspace(*path, rows)[:: -1 if backwards else 1]
    force = factor * 1e5 * (1 + np.sin(20 * x))
    nose = np.where(x > 0.26, force, 0.0)
    history = {
        "time": np.linspace(0, 1e-2, rows),
        "x": x,
        "force": force,
        "force_nose": nose,
        "force_wing": force - nose,
    }
    peaks = force_peaks(history, 1.0, SCENE.static_wheel_load)
    return PassResult(
        model, SCENE, {}, history, peaks, transfer_x=0.26, cost=Cost(seconds), error_estimate={"step": 0.01}
    )


@pytest.fixture
def folders(tmp_path):
    for name, result in {
        "dear": made("fe_full", 1.0, 400.0),
        "middle": made("rigid_hertz", 0.96, 0.2),
        "cheap": made("lumped", 1.5, 0.1),
    }.items():
        result.save(tmp_path / name)
    return tmp_path


def test_errors_of_a_scaled_history_are_the_scale(folders):
    found = compare([folders])
    assert [r.model for r in found.results] == [
        "lumped",
        "rigid_hertz",
        "fe_full",
    ] and found.reference.model == "fe_full"
    for quantity in ("impact on the wheel", "largest force"):
        assert [found.error(r, quantity) for r in found.results] == pytest.approx([0.5, -0.04, 0.0], abs=1e-12)
    assert [found.error(r, "history") for r in found.results] == pytest.approx([0.5, 0.04, 0.0], abs=1e-12)
    assert np.isnan(found.error(found.results[0], "strain"))


def test_histories_are_compared_where_both_run_and_in_either_direction():
    reference = made("fe_full", 1.0, 1.0)
    part = made("lumped", 1.2, 1.0, path=(0.2, 0.9), rows=7001, backwards=True)
    # of interpolation between 0.1 mm: (20 h)^2 / 8
    assert history_error(part, reference) == pytest.approx(0.2, rel=1e-5)
    assert np.isnan(history_error(made("lumped", 1.0, 1.0, path=(0.6, 0.9)), reference))


def test_settling_is_compared_in_neither_run():
    """Force 0 while it settles, over the first 2.5 of 10 ms; exact afterwards."""
    reference, begun = made("fe_full", 1.0, 1.0), made("fe_window", 1.0, 1.0)
    settling = begun.history["time"] <= 2.5e-3
    begun = replace(
        begun,
        settings={"settle_time": 2.5e-3},
        history=begun.history | {"force": np.where(settling, 0.0, begun.history["force"])},
    )
    assert history_error(begun, reference) == 0.0
    assert history_error(replace(begun, settings={}), reference) > 0.3


@pytest.mark.parametrize(
    "end, largest, mark", [(0.36, 1e5 * (1 + np.sin(7.2)), " (outside)"), (0.4, 2e5, " (at its end)"), (0.5, 2e5, "")]
)
def test_forces_are_compared_on_the_common_way_and_marked_where_it_cuts_a_peak(end, largest, mark):
    """The reference ran to 0.5 m and has its largest force at 0.393 m: what the shorter run could not see must not
    count as its error."""
    short, reference = made("rigid_hertz", 1.1, 1.0, path=(0.2, end)), made("fe_full", 1.0, 9.0)
    assert common_path(short, reference).words == f"200 to {end * 1e3:.0f}"
    for result, factor in ((short, 1.1), (reference, 1.0)):
        assert forces_on(result, common_path(short, reference))["largest_force"].value == pytest.approx(
            factor * largest, rel=1e-3
        )
    assert QUANTITIES["largest force"].error(short, reference) == pytest.approx(0.1, rel=1e-2)
    row = table(Comparison(reference, (short, reference), ("short", "dear"))).splitlines()[2]
    assert f"| +10.0%{mark} |" in row and f"| 200 to {end * 1e3:.0f} |" in row


def test_a_formula_without_history_is_held_against_the_first_impact():
    formula = PassResult("p2_formula", SCENE, {}, {"time": [], "x": []}, {"p2": Peak(1.5e5, "N", x=0.26)})
    assert QUANTITIES["impact on the wheel"].error(formula, made("fe_full", 1.0, 1.0)) == pytest.approx(-0.25, rel=1e-3)
    assert np.isnan(QUANTITIES["largest force"].error(formula, made("fe_full", 1.0, 1.0))) and np.isnan(
        history_error(formula, made("fe_full", 1.0, 1.0))
    )


def strained(result, mean: float, x: float):
    """The result with a mean strain of the nose's worst block, there."""
    return replace(result, metal={"nose": {"values": {"block": mean}, "block": [x, 0.0, 0.0]}})


def test_a_strain_outside_the_common_way_is_not_compared():
    """Means over a stated volume are compared, never the largest value of an element."""
    window = strained(made("fe_window", 1.0, 1.0, path=(0.3, 0.5)), 0.04, 0.35)
    error = QUANTITIES["strain"].error
    assert error(window, strained(made("fe_full", 1.0, 1.0), 0.05, 0.36)) == pytest.approx(-0.2)
    assert np.isnan(error(window, strained(made("fe_full", 1.0, 1.0), 0.05, 0.25)))
    assert np.isnan(error(window, made("fe_full", 1.0, 1.0)))


def test_strains_of_all_parts_stand_beside_each_other_with_bars_and_flags(folders):
    """A light result that knows leg and nose, with a bar and flags, beside an explicit one that knows all three."""
    values = {"block": 0.03, "worst_1000": 0.02, "integral": 3e-7}
    here, far = ({"values": values, "block": [x, 0.0, 0.0]} for x in (0.3, 0.9))
    flags = [{"what": "corner", "reason": "leg: beside the patch", "where": ""}]
    flags += [{"what": "asymmetry", "reason": "leg: not about its strain", "where": ""}]
    light = replace(made("bem_plastic", 1.0, 1.0), metal={"leg": here, "nose": far}, error_bars={"block_leg": 0.004})
    light = replace(light, trust={"validity": flags})
    explicit = replace(made("fe_full", 1.0, 9.0), metal={"leg": here, "wing": here, "nose": here})
    text = strain_table(Comparison(explicit, (light, explicit), ("light", "dear")))
    rows = {line.split(" | ")[0].removeprefix("| "): line for line in text.splitlines()}
    assert list(rows)[2::4][:3] == [f"{part}: worst 5 x 5 x 3 mm" for part in ("leg", "wing", "nose")]
    assert "| 3 % +- 0.4 % | 3 % |" in rows["leg: worst 5 x 5 x 3 mm"]
    assert (
        "| (3 %) | 3 % |" in rows["nose: worst 5 x 5 x 3 mm"]
        and "300 mm3 | 300 mm3" in rows["nose: integral over the volume"]
    )
    assert "none | 3 %" in rows["wing: worst 5 x 5 x 3 mm"] and "leg corner | -" in rows["flags about it"]
    assert strain_table(Comparison(explicit, (made("lumped", 1.0, 1.0), explicit), ("cheap", "dear"))) == ""


def test_the_references_error_bar_counts_against_who_wants_to_be_within(folders):
    """Off by 4 %, and the reference's own limit within 2 %: within 6 %, not within 5 %."""
    found = compare([folders])
    claims = replace(
        found.reference, error_bars={"impact_on_wheel": 0.02 * found.reference.peaks["impact_on_wheel"].value}
    )
    results = tuple(claims if r is found.reference else r for r in found.results)
    barred = replace(found, reference=claims, results=results)
    assert (
        found.least_expensive_within(0.05, "impact on the wheel") is not None
        and barred.least_expensive_within(0.05, "impact on the wheel") is None
    )
    assert barred.least_expensive_within(0.061, "impact on the wheel") == found.least_expensive_within(
        0.05, "impact on the wheel"
    )
    assert "the error bar of dear, 2.00%, is counted in" in advice(barred, 0.061, "impact on the wheel")


def test_the_least_expensive_within_an_error_is_named_with_its_cost_and_warnings(folders):
    found = compare([folders])
    assert "middle (rigid_hertz) is the least expensive within 0.05" in advice(
        found, 0.05, "impact on the wheel"
    ) and "2e+03 times less" in advice(found, 0.05, "impact on the wheel")
    assert "cheap (lumped)" in advice(found, 0.6, "impact on the wheel")
    assert "nothing less expensive than dear" in advice(
        found, 0.001, "impact on the wheel"
    ) and "itself claims no less than 1.00%" in advice(found, 0.001, "impact on the wheel")
    assert "nothing less expensive" in advice(found, 0.5, "strain")  # what nobody resolves nobody meets
    assert compare([folders / "middle", folders / "cheap"], folders / "cheap").reference.model == "lumped"


def test_equal_runs_in_folders_of_one_name_are_told_apart(tmp_path):
    for name in ("old/case/fe", "new/case/fe"):
        made("rigid_hertz", 1.0, 1.0).save(tmp_path / name)
    found = compare([tmp_path / "old" / "case", tmp_path / "new" / "case", tmp_path / "new" / ".." / "new" / "case"])
    assert set(found.names) == {"old/case/fe", "new/case/fe"}
    assert "is the least expensive within 0.05" in advice(found, 0.05, "impact on the wheel")


def test_what_cannot_be_compared_is_refused_by_name(folders, tmp_path):
    other = replace(made("lumped", 1.0, 1.0), scene=SCENE.model_copy(update={"speed": 20.0}))
    other.save(tmp_path / "b" / "slow")
    with pytest.raises(CompareError, match=r"slow: another scene.*1 difference.*\n.*speed: "):
        compare([folders, tmp_path / "b" / "slow"])
    replace(made("lumped", 1.0, 1.0), fault="it broke").save(tmp_path / "c" / "broken")
    with pytest.raises(CompareError, match="broken: that run failed .it broke."):
        compare([folders, tmp_path / "c"])
    with pytest.raises(CompareError, match="one result only"):
        compare([folders / "cheap"])
    with pytest.raises(CompareError, match="no result.json.*or that of a case in a sweep"):
        compare([tmp_path / "nothing"])
    summary = json.loads((folders / "cheap" / "result.json").read_text())
    summary["scene"]["a_key_of_old"] = 1.0
    (folders / "cheap" / "result.json").write_text(json.dumps(summary))
    with pytest.raises(CompareError, match="cheap: cannot be read by this program, another version"):
        compare([folders])


def test_command_writes_table_and_figure_and_refuses_nonsense(folders, tmp_path):
    run = partial(call, "compare")
    assert "least expensive within 0.05" in run(folders, "--within", "5%", "--out", tmp_path / "page").output
    assert (tmp_path / "page" / "compare.png").stat().st_size > 10_000 and "rigid_hertz" in (
        tmp_path / "page" / "compare.md"
    ).read_text()
    assert table(compare([folders])).count("\n") == 5
    for arguments, words in [
        (["--within", "five"], "not a number"),
        (["--within", "500%"], "between 0 and 100"),
        (["--quantity", "colour"], "choose one of"),
    ]:
        assert words in " ".join(run(folders, *arguments, code=2).output.split())
