"""A search corrected by proofs: exact at what was proven, and nearer to the truth from round to round."""

from dataclasses import replace

import numpy as np
import pytest

from rail_fem.design import correction as correction_module
from rail_fem.design import search as search_module
from rail_fem.design.correction import learned, proven_numbers, search_and_prove
from rail_fem.design.problem import DesignError, read_design
from rail_fem.design.proof import ProofRun, ProvenShape, shapes
from rail_fem.design.proof_report import proof_report
from rail_fem.design.search import Trial, search, trials_of
from rail_fem.result.result import Peak
from tests.commands import call
from tests.rail_fem.test_design import CHECK, HERE, design
from tests.rail_fem.test_error_bars import at_size

SIZE = 2e-3
UNPROVEN = CHECK.replace("check", "pass").replace("[pass.set]", "proven = false\n[pass.set]")
ALSO = """
[[objective]]
quantity = "longest flight"
"""


def _with_impact(force):
    """An explicit run whose impact on the wheel is so much [kN]."""
    made = at_size(SIZE, 0.0)
    made.peaks["impact_on_wheel"] = Peak(1e3 * force, "N", x=0.38)
    return made


def shape(name, value, *numbers):
    return ProvenShape(name, name, Trial(np.array([value]), np.array(numbers), 1.0))


def proofs(problem, *proven):
    return [ProofRun(one, problem.design.passes[0], SIZE, _with_impact(force)) for one, force in proven]


def test_corrected_numbers_are_the_explicit_model_s_where_it_was_run(tmp_path):
    problem = read_design(design(tmp_path, extra=UNPROVEN))
    start, best = shape("start", np.nan, 100.0, 70.0), shape("trial_0001", 1.5, 80.0, 60.0)
    correction = learned(problem, proofs(problem, (start, 150.0), (best, 96.0)))
    for one, force in ((start, 150.0), (best, 96.0)):
        corrected = correction.of(problem, one.trial.values, one.trial.numbers)
        assert corrected == pytest.approx([force, one.trial.numbers[1]], rel=1e-9)  # the other pass was not proven
    between = correction.of(problem, np.array([0.75]), np.array([90.0, 65.0]))
    assert between[0] == pytest.approx(90.0 * (1.5 + 1.2) / 2)  # as far from 0 mm as from 1.5 mm


def test_a_flight_is_corrected_by_its_difference_and_is_none_at_least(tmp_path):
    problem = read_design(design(tmp_path, extra=ALSO))
    start = shape("start", np.nan, 100.0, 40.0)
    run = proofs(problem, (start, 150.0))
    assert proven_numbers(problem, run, "start")[0] == 150.0 and np.isnan(proven_numbers(problem, run, "start")[1])
    correction = learned(problem, run)
    correction.added[0, 1], correction.factors[0, 1] = -30.0, 1.0  # the explicit model's flight is 30 mm shorter
    assert correction.of(problem, np.array([1.0]), np.array([80.0, 50.0])) == pytest.approx([120.0, 20.0])
    assert correction.of(problem, np.array([1.0]), np.array([80.0, 10.0])) == pytest.approx([120.0, 0.0])


def light(values):
    return 100.0 + 40.0 * (values - 1.6) ** 2


def true(values):
    """Least where the light model's is not."""
    return light(values) * (1.0 + 0.4 * values)


@pytest.fixture
def rounds(tmp_path, monkeypatch):
    """Three rounds with a light and an explicit model of one variable, their least values apart."""
    problem = read_design(design(tmp_path, trials=60))
    at = lambda values: 0.0 if values is None else float(values[0])
    monkeypatch.setattr(search_module, "numbers_of", lambda p, v: (np.array([light(at(v))]), ""))

    def prove(problem, found, out, count, *rest):
        chosen = shapes(problem, found, count)
        return proofs(problem, *((one, true(at(one.values))) for one in chosen))

    monkeypatch.setattr(correction_module, "prove_design", prove)
    return problem, lambda n: list(search_and_prove(problem, tmp_path / "out", 1, n, HERE, say=lambda text: None))


def test_rounds_come_nearer_to_the_explicit_model_s_own_best(rounds):
    problem, run = rounds
    (first, few), _, (last, every) = run(3)
    best = min(true(x) for x in np.linspace(-1, 2, 3001))
    proven = [run.result.peaks["impact_on_wheel"].value / 1e3 for run in every]
    assert abs(first.best.values[0] - 1.6) < 0.05  # the light model's own
    assert min(proven) - best < 0.2 * (proven[1] - best)  # a fifth of what the first proof was off
    assert last.best.corrected is not None and len(every) > len(few)


def test_rounds_go_on_where_they_were(rounds, tmp_path):
    _, run = rounds
    whole = run(2)
    text = (tmp_path / "out" / "trials.csv").read_text()
    again = run(2)
    assert (tmp_path / "out" / "trials.csv").read_text() == text
    assert again[-1][0].best.values == whole[-1][0].best.values


def test_the_proof_ranks_shapes_by_the_explicit_model(tmp_path):
    """The light model's best is the explicit model's worst, and says where."""
    problem = read_design(design(tmp_path))
    start, good, bad = shape("start", np.nan, 100.0), shape("trial 1", 0.5, 90.0), shape("trial 2", 1.5, 80.0)
    text = proof_report(problem, proofs(problem, (start, 100.0), (bad, 130.0), (good, 95.0)))
    rows = text[text.index("| shape |") :].splitlines()[2:5]
    assert rows == [
        "| trial 1 | 0.9500 | nothing |",
        "| start | 1.0000 | nothing |",
        "| trial 2 | 1.3000 | 75 mph: impact on the wheel +30 % |",
    ]


def test_a_search_begins_with_the_best_of_another_s_trials(rounds, tmp_path):
    problem, run = rounds
    run(1)
    known = trials_of(problem, tmp_path / "out")
    heavy = replace(problem, design=problem.design.model_copy(update={"worse": 9.0}))  # weights may be others
    found = search(heavy, tmp_path / "again", HERE, lambda text: None, earlier=trials_of(heavy, tmp_path / "out"))
    assert [tuple(trial.values) for trial in found.trials[: len(known)]] == [tuple(trial.values) for trial in known]
    assert len(known) < len(found.trials) <= 1.6 * len(known)
    with pytest.raises(DesignError, match="has no trials.csv"):
        trials_of(problem, tmp_path)


def test_rounds_are_for_proofs(tmp_path):
    words = ["design", str(design(tmp_path)), "--out", str(tmp_path / "out"), "--rounds", "2"]
    assert "--rounds is for the runs that prove" in call(*words, code=2).output
    words = [*words[:4], "--begin", str(tmp_path / "nowhere")]
    assert "to begin with" in call(*words, code=2).output and not (tmp_path / "out").exists()
