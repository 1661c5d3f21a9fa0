"""The scene behind a source: trials spread over the bounds, then where the facts make scenes likely, and what they say
of the unknowns."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.stats import qmc

from rail_fem.design.correction import proven_numbers
from rail_fem.design.observations import FactGroup
from rail_fem.design.posterior import (
    LEAST_TRIALS,
    SAMPLES,
    Known,
    form_of,
    interval,
    known_by_trials,
    sample,
    with_proof,
)
from rail_fem.design.problem import DesignError, Problem
from rail_fem.design.proof import ProofRun
from rail_fem.design.search import SearchRecord, Trial, numbers_of, rounded
from rail_fem.pool import executor

FOLDS = 8  # of the trials that are spread over the bounds, each found again by the others
FORMS = np.linspace(0, 1, 25)  # between their bounds, at which a trial is judged


@dataclass(frozen=True)
class Inversion:
    """known : facts and emulators;  samples (m, k + 1) : of the posterior, unknowns and error of form between their
    bounds 0 and 1;  without (g, k + 1, 2) : mean and standard deviation of each unknown with one group of facts left
    out;  start : the case as it is;  likely : the trial that the facts make most likely;  trials : how many, those that
    could not be run"""

    known: list[Known]
    samples: np.ndarray
    without: np.ndarray
    start: Trial
    likely: Trial
    trials: tuple[int, int]

    @property
    def interval(self) -> np.ndarray:
        """(2, k + 1)  of 95 %, between the bounds 0 and 1."""
        return interval(self.samples)


def invert(problem: Problem, out: Path, workers: int = 2, say: Callable[[str], None] = print) -> Inversion:
    """Make the trials, or go on with them, and judge them. Errors: DesignError where too few trials can be run, or
    `out` holds another search."""
    record, design = SearchRecord(problem, Path(out)), problem.design
    with executor(workers, home=__name__) as pool:
        start = record.start(lambda points: list(pool.map(numbers_of, [problem] * len(points), points)))
        trials = _made(record, pool, _spread(problem))
        late = 0
        for number in range(design.rounds):
            known = _known(problem, trials, late)
            samples = sample(known, len(design.vary), design.seed + number)
            drawn = samples[:: max(1, 4 * len(samples) // design.trials), :-1]
            more = _made(record, pool, scaled_back(problem, drawn))
            trials, late = trials + more, late + len(_run(more))
            say(f"{len(trials)} trials, of them {late} where the facts make scenes likely")
        if design.guess:
            trials = trials + _made(record, pool, np.array([design.guessed]))
    known = _known(problem, trials, late)
    likely = max(_run(trials), key=lambda trial: likelihood(problem, trial))
    counts = len(trials), len(trials) - len(_run(trials))
    return Inversion(known, *_sampled(problem, known), start, likely, counts)


def proved(problem: Problem, found: Inversion, proofs: Sequence[ProofRun]) -> Inversion:
    """The same trials corrected by runs of the explicit model of their most likely scene."""
    known = with_proof(found.known, proof_ratios(problem, proofs, found.likely))
    samples, without = _sampled(problem, known)
    return replace(found, known=known, samples=samples, without=without)


def _sampled(problem: Problem, known: list[Known]) -> tuple[np.ndarray, np.ndarray]:
    """Samples of the posterior, and its `Inversion.without`."""
    count, seed = len(problem.design.vary), problem.design.seed
    left_out = [sample([*known[:k], *known[k + 1 :]], count, seed) for k in range(len(known))]
    without = np.array([np.column_stack([own.mean(axis=0), own.std(axis=0)]) for own in left_out])
    return sample(known, count, seed), without


def scaled(problem: Problem, values: np.ndarray) -> np.ndarray:
    """Values (n, k) of the unknowns between their bounds 0 and 1."""
    low, high = np.array([variable.bounds for variable in problem.design.vary]).T
    return (values - low) / (high - low)


def scaled_back(problem: Problem, points: np.ndarray) -> np.ndarray:
    """The inverse, in the variables' units."""
    low, high = np.array([variable.bounds for variable in problem.design.vary]).T
    return low + points * (high - low)


def facts_of(problem: Problem, group: FactGroup, numbers: np.ndarray) -> np.ndarray:
    """(n, len(group.value))  what trials' numbers (n, m) make of a group, as compared."""
    return group.of(numbers[:, [problem.columns.index(column) for column in group.columns]])


def likelihood(problem: Problem, trial: Trial) -> float:
    """Logarithm, up to a constant, of a trial's own numbers at the error of form at which it is largest."""
    form, total = form_of(FORMS), np.zeros(len(FORMS))
    for group in problem.facts:
        found = facts_of(problem, group, trial.numbers[None])
        total += group.log_likelihood(np.repeat(found, len(form), axis=0), np.zeros((1, 1)), form)
    return float(np.nan_to_num(total, nan=-np.inf).max())


def proof_ratios(problem: Problem, runs: Sequence[ProofRun], likely: Trial) -> dict[str, dict[str, float]]:
    """By group and pass what the explicit model has beside the light one, as compared; of passes that were proven."""
    explicit = proven_numbers(problem, runs, runs[0].shape.name)
    ratios = {}
    for group in problem.facts:
        beside = facts_of(problem, group, explicit[None])[0] - facts_of(problem, group, likely.numbers[None])[0]
        ratios[group.name] = {name: float(one) for name, one in zip(group.value, beside) if np.isfinite(one)}
    return ratios


def covered(problem: Problem, out: Path, scenes: int, workers: int = 2) -> np.ndarray:
    """(scenes, k, 2)  whether each unknown of a known scene lies in its 95 % interval, and the interval's width over
    that of the bounds.

    The scenes are the first of the trials that are spread over the bounds, their passes by the model itself; each is
    found again by the emulators of trials of other folds, from facts with all errors that the likelihood counts.
    """
    record = SearchRecord(problem, Path(out))
    with executor(workers, home=__name__) as pool:
        trials = _run(_made(record, pool, _spread(problem)))
        numbers = np.arange(min(scenes, len(trials)))
        folds = [numbers[fold::FOLDS] for fold in range(min(FOLDS, len(numbers)))]
        return np.concatenate(list(pool.map(_found_again, *zip(*((problem, trials, fold) for fold in folds)))))


def _found_again(problem: Problem, trials: Sequence[Trial], fold: np.ndarray) -> np.ndarray:
    """(n, k, 2)  of the trials of these numbers (n,), as `covered`."""
    design, found = problem.design, []
    others = [trial for number, trial in enumerate(trials) if (number - fold[0]) % FOLDS]
    emulated = _known(problem, others, 0)
    for number in fold:
        rng, truth = np.random.default_rng([design.seed, number]), trials[number]
        form = float(form_of(rng.random()))
        known = []
        for one in emulated:
            columns = [problem.columns.index(column) for column in one.group.columns]
            known += [one.of(group) for group in one.group.drawn(truth.numbers[columns], form, rng)]
        low, high = interval(sample(known, len(design.vary), design.seed, SAMPLES // 2))[:, :-1]
        place = scaled(problem, truth.values[None])[0]
        found.append(np.column_stack([(low <= place) & (place <= high), high - low]))
    return np.array(found)


def _known(problem: Problem, trials: Sequence[Trial], late: int) -> list[Known]:
    good = _run(trials)
    if len(good) < LEAST_TRIALS:
        raise DesignError(
            f"{len(good)} of {len(trials)} trials could be run, at least {LEAST_TRIALS} are needed, the last:"
            f" {[trial.fault for trial in trials if trial.fault][-1:]}"
        )
    points = scaled(problem, np.array([trial.values for trial in good]))
    numbers = np.array([trial.numbers for trial in good])
    return known_by_trials(problem.facts, problem.columns, points, numbers, late)


def _spread(problem: Problem) -> np.ndarray:
    """(trials, k)  values spread evenly over the bounds."""
    design = problem.design
    sobol = qmc.Sobol(len(design.vary), seed=design.seed)
    return scaled_back(problem, sobol.random_base2(int(np.ceil(np.log2(design.trials))))[: design.trials])


def _run(trials: Sequence[Trial]) -> list[Trial]:
    return [trial for trial in trials if not trial.fault]


def _made(record: SearchRecord, pool: Executor, values: np.ndarray) -> list[Trial]:
    """The trials of these values (n, k), each kept as soon as it is made."""
    points = [rounded(value) for value in values]
    missing = [point for point in points if point not in record]
    for point, (numbers, fault) in zip(missing, pool.map(numbers_of, [record.problem] * len(missing), missing)):
        record.add(Trial(point, numbers, np.nan, fault))
    return [record[point] for point in points]
