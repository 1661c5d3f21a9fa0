"""The scene behind a source: trials spread over the bounds, then where the facts make scenes likely, and what they say
of the unknowns; once the likely scene is proven, the same with the light model's numbers as the proofs correct them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.stats import qmc

from rail_fem.design.correction import learned, proven_numbers, with_common
from rail_fem.design.posterior import LEAST_TRIALS, SAMPLES, Fact, Known, form_of, interval, known_by_trials, sample
from rail_fem.design.problem import DesignError, Problem
from rail_fem.design.proof import ProofRun
from rail_fem.design.search import SearchRecord, Trial
from rail_fem.processes.pool import Pool, Workers

FOLDS = 8  # of the trials that are spread over the bounds, each found again by the others
BEST, NEAR = 10, 0.01  # trials about which others are made, and their least distance over the bounds
FORMS = np.linspace(0, 1, 25)  # between their bounds, at which a trial is judged


@dataclass(frozen=True)
class Inversion:
    """known : facts and emulators;  samples (m, k + 1) : of the posterior, unknowns and error of form between their
    bounds 0 and 1;  without (g, k + 1, 2) : mean and standard deviation of each unknown with one group of facts left
    out, none of a group alone;  start : the case as it is;  likely : the trial that the facts make most likely;
    trials : all, the last `late` that could be run where the facts make scenes likely"""

    known: list[Known]
    samples: np.ndarray
    without: np.ndarray
    start: Trial
    likely: Trial
    trials: list[Trial]
    late: int

    @property
    def interval(self) -> np.ndarray:
        """(2, k + 1)  of 95 %, between the bounds 0 and 1."""
        return interval(self.samples)


def invert(
    problem: Problem,
    out: Path,
    workers: Workers = Workers(2),
    say: Callable[[str], None] = print,
    earlier: Inversion | None = None,
    proofs: Sequence[ProofRun] = (),
) -> Inversion:
    """Make the trials, or go on with them, and judge them; more than `earlier` has, by the light model as `proofs`
    correct it. Errors: DesignError where too few trials can be run, or `out` holds another search."""
    record, design = SearchRecord(problem, Path(out)), problem.design
    with Pool(workers, __name__) as pool:
        start = record.start(pool)
        trials, late = (earlier.trials, earlier.late) if earlier else (record.made(pool, _spread(problem)), 0)
        for number in range(design.rounds):
            known = _known(problem, trials, late, proofs)
            samples = sample(known, len(design.vary), design.seed + number)
            drawn = samples[:: max(1, 4 * len(samples) // design.trials), :-1]
            if problem.records:
                drawn[::2] = _about_best(problem, trials, known, len(drawn[::2]), design.seed + number)
            more = record.made(pool, problem.scaled_back(drawn))
            trials, late = trials + more, late + len(_run(more))
            say(f"{len(trials)} trials, of them {late} where the facts make scenes likely")
        if problem.records:  # a trace is met by few: the likeliest sample becomes a trial, that the fit be seen
            known = _known(problem, trials, late, proofs)
            samples = sample(known, len(design.vary), design.seed, SAMPLES // 4)
            at = np.argmax(np.sum([one.log_likelihood(samples) for one in known], axis=0))
            more = record.made(pool, problem.scaled_back(samples[at : at + 1, :-1]))
            trials, late = trials + more, late + (len(_run(more)) if late else 0)
        if design.guess and not earlier:
            trials = record.made(pool, np.array([design.guessed])) + trials
    return judged(problem, trials, late, start, proofs)


def _about_best(problem: Problem, trials: Sequence[Trial], known: Sequence[Known], count: int, seed: int) -> np.ndarray:
    """(count, k)  between the bounds 0 and 1, about the trials that meet the records best by themselves: where an
    emulator of a trace is far off it does not know where to look. Moves as in posterior."""
    rng = np.random.default_rng([seed, count])
    ranked = sorted(_run(trials), key=lambda trial: -likelihood(problem, trial, known))
    best = problem.scaled(np.array([trial.values for trial in ranked[: max(BEST, len(problem.design.vary) + 2)]]))
    one, two, three = rng.integers(len(best), size=(3, count))
    at = best[np.minimum(one, two)] + rng.uniform(0.3, 0.9, (count, 1)) * (best[two] - best[three])
    at = np.abs(at + NEAR * rng.standard_normal(at.shape))
    return (1 - np.abs(1 - at)).clip(0, 1)


def judged(
    problem: Problem, trials: list[Trial], late: int, start: Trial, proofs: Sequence[ProofRun] = ()
) -> Inversion:
    """What trials say, corrected by all runs of the explicit model of some of them."""
    known, count, seed = _known(problem, trials, late, proofs), len(problem.design.vary), problem.design.seed
    fewer = SAMPLES // 4 if problem.records else SAMPLES  # of traces: each takes longer
    others = [[*known[:k], *known[k + 1 :]] for k in range(len(known))] if len(known) > 1 else []
    left_out = [sample(those, count, seed, fewer) for those in others]
    without = np.array([np.column_stack([own.mean(axis=0), own.std(axis=0)]) for own in left_out])
    start, *run = corrected(problem, [start, *_run(trials)], proofs)
    likely = max(run, key=lambda trial: likelihood(problem, trial, known))
    return Inversion(known, sample(known, count, seed), without, start, likely, trials, late)


def corrected(problem: Problem, trials: Sequence[Trial], proofs: Sequence[ProofRun]) -> list[Trial]:
    """Trials with what a proof is expected to find of each."""
    if not any(run.result for run in proofs):
        return list(trials)
    correction = with_common(problem, learned(problem, proofs))
    return [replace(trial, corrected=correction.of(problem, trial.values, trial.numbers)) for trial in trials]


def scatter_of(problem: Problem, group: Fact, proofs: Sequence[ProofRun]) -> tuple[float, int]:
    """Root mean square of what the correction by all other proofs misses of each, in the group's facts of its pass, as
    compared (0 where there is one proof alone); and how many of the group's passes have a proof."""
    missed: list[float] = []
    for run in proofs:
        others = [other for other in proofs if other is not run]
        if run.one.name in group.value and any(other.result for other in others):
            (trial,) = corrected(problem, [run.shape.trial], others)
            explicit = proven_numbers(problem, proofs, run.shape.name)
            beside = facts_of(problem, group, np.array([explicit, trial.expected]))
            missed.append(float(np.subtract(*beside[:, list(group.value).index(run.one.name)])))
    known = [one for one in missed if np.isfinite(one)]
    return float(np.sqrt(np.mean(np.square(known)))) if known else 0.0, len(
        {run.one.name for run in proofs if run.result} & {*group.value}
    )


def facts_of(problem: Problem, group: Fact, numbers: np.ndarray) -> np.ndarray:
    """(n, len(group.value))  what trials' numbers (n, m) make of a group, as compared."""
    return group.of(numbers[:, [problem.columns.index(column) for column in group.columns]])


def likelihood(problem: Problem, trial: Trial, known: Sequence[Known]) -> float:
    """Logarithm, up to a constant, of a trial's own numbers at the error of form at which it is largest."""
    form, total = form_of(FORMS), np.zeros(len(FORMS))
    for one in known:
        found = np.repeat(facts_of(problem, one.group, trial.expected[None]), len(form), axis=0)
        error = one.scatter**2 * np.eye(found.shape[1])
        total += one.group.judge(error, one.proven)(found, form)
    return float(np.nan_to_num(total, nan=-np.inf).max())


def covered(problem: Problem, out: Path, scenes: int, workers: Workers = Workers(2)) -> np.ndarray:
    """(scenes, k, 2)  whether each unknown of a known scene lies in its 95 % interval, and the interval's width over
    that of the bounds.

    The scenes are the first of the trials that are spread over the bounds, their passes by the model itself; each is
    found again by the emulators of trials of other folds, from facts with all errors that the likelihood counts.
    """
    record = SearchRecord(problem, Path(out))
    with Pool(workers, __name__) as pool:
        trials = _run(record.made(pool, _spread(problem)))
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
        place = problem.scaled(truth.values)
        found.append(np.column_stack([(low <= place) & (place <= high), high - low]))
    return np.array(found)


def _known(problem: Problem, trials: Sequence[Trial], late: int, proofs: Sequence[ProofRun] = ()) -> list[Known]:
    good = corrected(problem, _run(trials), proofs)
    if len(good) < LEAST_TRIALS:
        raise DesignError(
            f"{len(good)} of {len(trials)} trials could be run, at least {LEAST_TRIALS} are needed, the last:"
            f" {[trial.fault for trial in trials if trial.fault][-1:]}"
        )
    points = problem.scaled(np.array([trial.values for trial in good]))
    numbers = np.array([trial.expected for trial in good])
    known = known_by_trials(problem.facts, problem.columns, points, numbers, late)
    told = [scatter_of(problem, one.group, proofs) for one in known]
    return [replace(one, scatter=scatter, proven=proven) for one, (scatter, proven) in zip(known, told)]


def _spread(problem: Problem) -> np.ndarray:
    """(trials, k)  values spread evenly over the bounds."""
    design = problem.design
    sobol = qmc.Sobol(len(design.vary), seed=design.seed)
    return problem.scaled_back(sobol.random_base2(int(np.ceil(np.log2(design.trials))))[: design.trials])


def _run(trials: Sequence[Trial]) -> list[Trial]:
    return [trial for trial in trials if not trial.fault]
