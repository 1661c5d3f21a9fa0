"""An inversion: the emulator, the sampler and the likelihood against closed forms, known scenes found again, the
command."""

import numpy as np
import pytest
from scipy.stats import kstest

from rail_fem.design.emulator import _cost, judged_emulator
from rail_fem.design.inversion import corrected, covered, judged, scatter_of
from rail_fem.design.observations import FactGroup
from rail_fem.design.posterior import known_by_trials, sample
from rail_fem.design.problem import DesignError, read_design
from rail_fem.design.proof import ProofRun, ProvenShape
from rail_fem.design.search import Trial
from rail_fem.processes.pool import Workers
from rail_fem.result.result import Peak
from tests.commands import call
from tests.rail_fem.test_casefile import ROOT
from tests.rail_fem.test_error_bars import at_size

FACTS = """
[[group]]
name = "nose"
quantity = "largest nose force"
source = "table"
sd = "2 %"
why = "rounded"
value = { slow = "150 kN", fast = "200 kN" }
[[group]]
name = "faster is harder"
quantity = "largest nose force"
over_pass = "slow"
source = "text"
sd = "2 %"
why = "an order"
bound = "least"
value = { fast = 1 }
"""
DESIGN = """
case = "CASE"
observations = "facts.toml"
trials = 32
rounds = 1
[set]
"run.rigid_hertz.start" = "150 mm"
"run.rigid_hertz.end" = "420 mm"
"run.rigid_hertz.path_spacing" = "10 mm"
"run.rigid_hertz.time_step" = "40 us"
[[vary]]
key = "scene.foundation.track_mass"
low = "100 kg"
high = "500 kg"
[[vary]]
key = "scene.foundation.damping"
low = "20 kN s/m"
high = "120 kN s/m"
[[pass]]
name = "slow"
set = { "scene.speed" = "50 mph" }
[[pass]]
name = "fast"
set = { "scene.speed" = "100 mph" }
"""


@pytest.fixture
def problem(tmp_path):
    (tmp_path / "facts.toml").write_text(FACTS)
    path = tmp_path / "design.toml"
    path.write_text(DESIGN.replace("CASE", str(ROOT / "cases" / "nose_transfer.toml")))
    return path


def group(**changes):
    told = {"name": "a", "quantity": "largest nose force", "source": "s", "why": "w", "sd": "10 kN"}
    return FactGroup(**told | {"value": {"one": "100 kN", "two": "130 kN"}} | changes)


def test_lengths_follow_the_slope_of_the_likelihood():
    """Central differences of the cost: their error is the square of the step times its third derivative."""
    rng = np.random.default_rng(0)
    points = rng.random((40, 2))
    departure = np.column_stack([np.sin(4 * points[:, 0]), points.prod(axis=1)])
    at, step = np.log([0.4, 0.9, 0.01]), 1e-4
    slopes = [
        (_cost(at + d, points, departure)[0] - _cost(at - d, points, departure)[0]) / (2 * step)
        for d in step * np.eye(3)
    ]
    assert _cost(at, points, departure)[1] == pytest.approx(slopes, rel=1e-5)


def test_an_emulator_knows_its_own_error():
    """What emulators of four fifths of the trials miss of the rest is what that of all misses of new ones, or somewhat
    more; the scatter of a hundred of either, whose largest weigh most, is within a factor of two."""
    rng = np.random.default_rng(1)
    answer = lambda at: np.column_stack([np.sin(5 * at[:, 0]) * at[:, 1], np.cos(6 * at[:, 2])])
    points, new = rng.random((100, 3)), rng.random((100, 3))
    found = judged_emulator(points, answer(points))
    missed = np.sqrt(((found(new) - answer(new)) ** 2).mean(axis=0))
    ratio = missed / np.sqrt((found.residuals**2).mean(axis=0))
    assert ((ratio > 0.25) & (ratio < 2)).all()
    assert (missed < 0.15 * answer(new).std(axis=0)).all()


def test_a_straight_model_has_the_posterior_of_the_textbook():
    """Two facts of an unknown a, (a, 2 a) seen with an error of 1: mean (y1 + 2 y2) / 5, standard deviation 1 / sqrt(5)
    of values between bounds 0 and 30, which cut off nothing. 512 samples: both within 4 standard errors."""
    facts = group(sd="1 kN", value={"one": "15.2 kN", "two": "29.1 kN"})
    points = np.random.default_rng(2).random((30, 1))
    numbers = 30.0 * points * [1.0, 2.0]
    samples = 30.0 * sample(known_by_trials([facts], facts.columns, points, numbers), 1, seed=3)[:, 0]
    deviation = 1 / np.sqrt(5)
    assert samples.mean() == pytest.approx((15.2 + 2 * 29.1) / 5, abs=4 * deviation / np.sqrt(512))
    assert samples.std() == pytest.approx(deviation, rel=4 / np.sqrt(2 * 512))


def test_a_shared_error_of_form_is_not_averaged_away():
    """Many facts of one kind leave what they share: the posterior of a factor common to them is as wide as it."""
    facts = group(sd="1 %", value={f"p{k}": "100 kN" for k in range(20)})
    form = np.array([0.1])
    at = np.log(100.0) + np.linspace(-0.5, 0.5, 401)[:, None] * np.ones(20)
    value = facts.log_likelihood(at, np.zeros((20, 20)), np.repeat(form, 401))
    weight = np.exp(value - value.max())
    wide = np.sqrt(np.average((at[:, 0] - np.log(100)) ** 2, weights=weight))
    # a share of a half common, the rest and 1 % over 20 facts
    assert wide == pytest.approx(np.sqrt(0.5 * 0.01 + (0.5 * 0.01 + 1e-4) / 20), rel=0.01)
    proven = facts.log_likelihood(at, np.zeros((20, 20)), np.repeat(form, 401), proven=3)
    weight = np.exp(proven - proven.max())
    assert np.sqrt(np.average((at[:, 0] - np.log(100)) ** 2, weights=weight)) < 0.55 * wide


def test_a_bound_is_even_where_it_is_met_and_certain_far_beyond():
    bound = group(value={"one": "100 kN"}, bound="least")
    value = bound.log_likelihood(np.array([[50.0], [100.0], [200.0]]), np.zeros((1, 1)), np.zeros(3))
    assert value == pytest.approx([-15.065, np.log(0.5), 0.0], abs=1e-3)  # log of the normal distribution at -5, 0, 10


def test_facts_are_drawn_with_the_errors_that_are_counted():
    """Of 400 draws the squared distance from the truth, by the covariance of all errors, is chi-squared of two degrees
    (Kolmogorov and Smirnov at 1 %)."""
    facts, rng, form = group(sd="5 %"), np.random.default_rng(5), 0.1
    truth = np.array([100.0, 130.0])
    covariance = (0.05**2 + 0.5 * form**2) * np.eye(2) + 0.5 * form**2
    drawn = np.array([facts.drawn(truth, form, rng)[0].values for _ in range(400)]) - np.log(truth)
    square = (drawn * np.linalg.solve(covariance, drawn.T).T).sum(axis=1)
    assert kstest(square, "chi2", args=(2,)).pvalue > 0.01


def proofs(problem, trial, **forces):
    """Runs of the explicit model of a trial's scene, with such forces on the nose [kN]."""
    runs = []
    for one in problem.design.passes:
        if one.name in forces:
            made = at_size(2e-3, 0.0)
            made.peaks["largest_force_nose"] = Peak(1e3 * forces[one.name], "N", x=0.38)
            runs.append(ProofRun(ProvenShape("likely", "likely", trial), one, 2e-3, made))
    return runs


def test_a_proof_moves_what_was_not_proven_by_what_is_common(problem):
    """One of two passes is 20 % higher by the explicit model: the other moves by half of it, as far as one can tell."""
    problem = read_design(problem)
    trial = Trial(np.array([200.0, 50.0]), np.array([100.0, 100.0]), 0.0)
    (moved,) = corrected(problem, [trial], proofs(problem, trial, fast=120.0))
    by_pass = dict(zip([name for name, _ in problem.columns], moved.expected))
    assert by_pass == pytest.approx({"fast": 120.0, "slow": 100.0 * np.sqrt(1.2)})


def test_what_a_correction_cannot_know_is_its_scatter(problem):
    """Factors of 1.2 and 1.1: each is missed by what the square root of the other does not tell of it."""
    problem = read_design(problem)
    trial = Trial(np.array([200.0, 50.0]), np.array([100.0, 100.0]), 0.0)
    runs = proofs(problem, trial, fast=120.0, slow=110.0)
    missed = np.log([1.2 / np.sqrt(1.1), 1.1 / np.sqrt(1.2)])
    scatter, passes = scatter_of(problem, problem.facts[0], runs)
    assert scatter == pytest.approx(np.sqrt(np.mean(missed**2))) and passes == 2
    assert scatter_of(problem, problem.facts[0], runs[:1]) == (0.0, 1)  # one proof alone: nothing to hold it to


def test_the_likely_scene_is_that_of_the_corrected_numbers(problem):
    """The light model meets the facts (150, 200 kN) at the first trial; the explicit model has a quarter more there."""
    problem = read_design(problem)
    at = np.linspace(0.0, 1.0, 40)
    numbers = np.array([150.0, 200.0]) if problem.columns[0][0] == "slow" else np.array([200.0, 150.0])
    trials = [Trial(np.array([100 + 400 * x, 20 + 100 * (7 * x % 1)]), numbers * (1 - 0.4 * x), 0.0) for x in at]
    assert judged(problem, trials, 0, trials[0]).likely is trials[0]
    runs = proofs(problem, trials[0], slow=187.5, fast=250.0)
    assert judged(problem, trials, 0, trials[0], runs).likely.expected == pytest.approx(numbers, rel=0.02)


def test_known_scenes_are_found_again(problem, tmp_path):
    """Twelve scenes of two unknowns, found by the emulators of others. Of 24 unknowns of 95 % intervals at least 20 lie
    inside with a probability of 0.998."""
    found = covered(read_design(problem), tmp_path / "out", 12, Workers(1))
    assert found.shape == (12, 2, 2) and found[..., 0].sum() >= 20
    assert found[..., 1].mean() < 0.9, "intervals that say nothing"


def test_the_command_inverts_and_says_what_decides(problem, tmp_path):
    out = tmp_path / "out"
    call("design", problem, "--out", out, "--workers", "1")
    text = (out / "inversion.md").read_text()
    assert "(scene.foundation.track_mass) | 100 kg to 500 kg |" in text and "| faster is harder | fast | >= 1 " in text
    assert (out / "inversion.png").stat().st_size > 10_000


def test_facts_of_no_pass_and_of_no_quantity_are_refused(problem, tmp_path):
    facts = tmp_path / "facts.toml"
    facts.write_text(FACTS.replace("slow = ", "slaw = "))
    with pytest.raises(DesignError, match="observations of slaw, which is none of the passes, did you mean"):
        read_design(problem)
    facts.write_text(FACTS.replace("largest nose force", "largest nose farce"))
    with pytest.raises(DesignError, match="largest nose farce"):
        read_design(problem)
