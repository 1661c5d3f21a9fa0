"""The proof of a design: which shapes are run, what is finished is not run again, a run that fails is named."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rail_fem.case.casefile import load_case
from rail_fem.design.problem import DesignError, read_design
from rail_fem.design.proof import PROVEN, SEARCHED, ProofRun, check_proof, keys_of, prove_design, shapes, without_finer
from rail_fem.design.proof_report import HIGHER, LOWER, SAME, UNKNOWN, WITHIN, verdict, write_proof
from rail_fem.design.search import Found, Trial
from rail_fem.settings.explicit import FeSettings
from rail_fem.sweeps.trends import MEASURES
from tests.commands import call
from tests.rail_fem.test_design import design
from tests.rail_fem.test_error_bars import at_size

ROOT = Path(__file__).resolve().parents[2]
PROOF = """
[proof]
"run.fe_full.start" = "330 mm"
"run.fe_full.end" = "390 mm"
"run.fe_full.element_size" = "6 mm"
"run.fe_full.element_aspect" = 1
"run.fe_full.wheel_element_ratio" = 1
"run.fe_full.error_twin" = false
"run.fe_full.field_frames" = 1
"run.fe_full.max_steps" = 50
"""


def trial(value, number, score, fault=""):
    return Trial(np.array([value]), np.array([number]), score, fault)


def found(*trials):
    start = trial(np.nan, 100.0, 1.0)
    return Found(start, min(trials, key=lambda t: t.score), list(trials))


def test_start_and_best_are_proven_and_the_best_that_is_worse_nowhere(tmp_path):
    problem = read_design(design(tmp_path))
    some = found(
        trial(0.1, 90.0, 0.9), trial(0.2, 101.0, 0.5), trial(0.3, np.nan, 0.1, "derails"), trial(0.4, 99.0, 0.8)
    )
    assert [shape.name for shape in shapes(problem, some, 1)] == ["start", "trial_0002", "trial_0004"]
    assert [shape.name for shape in shapes(problem, some, 3)] == ["start", "trial_0002", "trial_0004", "trial_0001"]
    assert shapes(problem, some, 1)[0].values is None and shapes(problem, some, 1)[1].values == [0.2]


def test_a_gain_is_one_where_both_bars_leave_room():
    assert verdict((200.0, 10.0), (180.0, 5.0)) == LOWER
    assert verdict((200.0, 10.0), (186.0, 5.0)) == WITHIN
    assert verdict((200.0, 10.0), (220.0, 5.0)) == HIGHER
    assert verdict((200.0, 0.0), (199.0, 0.0)) == LOWER and verdict((0.0, 0.0), (0.0, 0.0)) == SAME
    assert verdict((np.nan, 0.0), (199.0, 0.0)) == UNKNOWN


def test_what_the_search_calls_its_quantities_is_known():
    assert set(SEARCHED) <= set(PROVEN) and set(SEARCHED.values()) <= set(MEASURES)


def test_a_proof_judges_by_the_impact_on_the_wheel_too(tmp_path):
    """Of all bodies together, with its bar, first; what the search found of it beside it: 90 of 100 kN."""
    text = design(tmp_path).read_text(encoding="utf-8")
    quantity = [line for line in text.splitlines() if line.startswith("quantity")][0]
    (tmp_path / "impact.toml").write_text(text.replace(quantity, 'quantity = "impact on the wheel"'), encoding="utf-8")
    problem = read_design(tmp_path / "impact.toml")
    start, best = shapes(problem, found(trial(0.7, 90.0, 0.9)), 1)
    one, bars = problem.design.passes[0], {"impact_on_wheel": 2e3}
    pair = [
        ProofRun(shape, one, 2e-3, at_size(2e-3, slope, error_bars=bars))
        for shape, slope in ((start, 1.0), (best, 0.0))
    ]
    change = 100 * (pair[1].value("impact on the wheel")[0] / pair[0].value("impact on the wheel")[0] - 1)
    assert change == pytest.approx(100 * (1 / 1.08 - 1)) and next(iter(PROVEN)) == "impact on the wheel"
    row = next(line for line in write_proof(problem, pair, tmp_path).splitlines() if "| impact on the wheel |" in line)
    assert "+- 2 kN" in row and row.endswith("| -7 % | lower | -10 % |")


def test_a_pass_may_want_another_window_than_the_proof_s():
    """A hollow wheel's patch is longer: what its pass sets goes before [proof], what is given now before both."""
    problem = read_design(ROOT / "cases" / "design" / "leg_and_nose.toml")
    key = "run.fe_full.window_ahead"
    ahead = {one.name: keys_of(problem, one, {})[key] for one in problem.design.passes}
    assert ahead["hollow P8"] == "75 mm" and ahead["worn P8"] == problem.design.proof[key] == "65 mm"
    assert all(keys_of(problem, one, {key: "90 mm"})[key] == "90 mm" for one in problem.design.passes)


def test_a_design_is_proven_run_by_run_and_goes_on_where_it_was(tmp_path):
    """By a few coarse steps of the explicit model itself; a shape that cannot be is a named failure."""
    problem = read_design(design(tmp_path, extra=PROOF))
    some = found(trial(99.0, 95.0, 0.95))
    told: list[str] = []
    runs = prove_design(problem, some, tmp_path / "out", say=told.append)
    assert [bool(run.fault) for run in runs] == [False, True] and "nose_lowering" in runs[1].fault
    assert "[1/2] start, 75 mph" in told[0] and "FAILED" in told[1] and runs[0].value("wing force")[0] > 0
    (file,) = (tmp_path / "out" / "proof").rglob("result.json")
    written = file.stat().st_mtime_ns
    again = prove_design(problem, some, tmp_path / "out", say=told.append)
    assert file.stat().st_mtime_ns == written and again[0].value("wing force") == runs[0].value("wing force")
    text = write_proof(problem, again, tmp_path / "out")
    assert "Could not be run:" in text and "trial 1, 75 mph" in text


def test_the_report_has_start_and_best_with_bars_and_what_holds(tmp_path):
    """A strain 8 % lower at best, within bars of 1 % each: not a gain; a mean over the volume 8 % lower without a bar:
    lower."""
    problem = read_design(design(tmp_path))
    start, best = shapes(problem, found(trial(0.7, 90.0, 0.9)), 1)
    one, size = problem.design.passes[0], 2e-3
    pair = [
        ProofRun(shape, one, size, at_size(size, slope, error_bars={"block_nose": 0.01}))
        for shape, slope in ((start, 1.0), (best, 0.0))
    ]
    text = write_proof(problem, pair, tmp_path)
    assert "| 75 mph | PEEQ worst 5 x 5 x 3 mm of nose | 8.64 +- 1 % | 8 +- 1 % | -7 % | within the bars | - |" in text
    assert "- PEEQ integral of nose: lower in 1 of 1" in text
    assert (tmp_path / "proof.png").stat().st_size > 10_000


def test_each_pass_counts_at_its_own_element_size_and_a_finer_run_of_it_does_not(tmp_path):
    problem = read_design(design(tmp_path))
    pair, one = shapes(problem, found(trial(0.7, 90.0, 0.9)), 1), problem.design.passes[0]
    other = one.model_copy(update={"name": "at 4 mm"})
    own = [ProofRun(shape, p, size, at_size(size)) for p, size in ((one, 2e-3), (other, 4e-3)) for shape in pair]
    assert without_finer([*own, *(ProofRun(shape, one, 1e-3, at_size(1e-3)) for shape in pair)]) == own


def test_bars_are_those_of_the_runs(tmp_path):
    """A value in the measure's unit with the bar that its run claims; a flight claims none."""
    problem = read_design(design(tmp_path))
    shape, one = shapes(problem, found(trial(0.7, 90.0, 0.9)), 1)[0], problem.design.passes[0]
    result = at_size(4e-3, error_bars={"block_nose": 0.01})
    run = ProofRun(shape, one, 4e-3, result)
    strain = 100 * result.metal["nose"]["values"]["block"]
    assert run.value("PEEQ worst 5 x 5 x 3 mm of nose") == pytest.approx((strain, 1.0))
    assert run.value("PEEQ integral of nose")[1] == 0.0
    assert np.isnan(ProofRun(shape, one, 4e-3, None, "folded").value("nose force")[0])


@pytest.mark.parametrize(
    "words, complaint",
    [
        (["--set", "run.fe_full.element_size=4mm"], "give --prove"),
        (["--prove", "1", "--set", "scene.crossing.nose_lowering=1 mm"], "is what the search varies"),
        (["--prove", "1", "--set", "run.fe_full.element_sise=4mm"], "did you mean 'element_size'"),
        (["--prove", "1", "--finer", "3 kg"], "element_size"),
    ],
)
def test_a_proof_that_cannot_be_is_refused_before_the_search(tmp_path, words, complaint):
    assert complaint in call("design", design(tmp_path), "--out", tmp_path / "out", *words, code=2).output
    assert not (tmp_path / "out").exists()


def test_a_start_that_cannot_be_meshed_is_refused_before_the_search(tmp_path):
    """A travelling window shorter than contact, plastic zone and a slab."""
    short = PROOF + '"run.fe_full.window_ahead" = "22 mm"\n"run.fe_full.window_behind" = "22 mm"\n'
    with pytest.raises(DesignError, match="the start, 75 mph, cannot be proven: .*window_ahead"):
        check_proof(read_design(design(tmp_path, extra=short)), {}, ())


def test_a_case_without_the_explicit_model_is_proven_by_its_defaults(tmp_path):
    case = tmp_path / "light.toml"
    text = (design(tmp_path).read_text()).split('case = "')[1].split('"')[0]
    whole = open(text, encoding="utf-8").read()
    case.write_text(whole.replace("[run.fe_full]", "[run.fe_window]"), encoding="utf-8")
    problem = replace(read_design(design(tmp_path)), case=case)
    assert check_proof(problem, {}, ()) == {}
    assert load_case(case).by("fe_full").runs["fe_full"] == FeSettings()
