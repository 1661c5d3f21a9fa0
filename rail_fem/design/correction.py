"""What proofs by the explicit model teach the search: its light model's numbers, corrected so that at every shape that
was proven they are the explicit model's; and search and proof by turns.

A force is multiplied by the explicit model's over the light model's, a length or time (a flight may be none) changed by
their difference. Between proven shapes both are interpolated by the radial functions abs(x - x_k) and a constant
(SciPy's RBFInterpolator), each variable counted in its bounds: along one variable, straight lines from shape to shape.
A pass that is not proven stays as the light model has it, or is moved by what is common to those that are
(`with_common`).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import RBFInterpolator

from rail_fem.design.problem import Problem
from rail_fem.design.proof import MODEL, ProofRun, ProvenShape, prove_design, without_finer
from rail_fem.design.search import Correct, Found, Trial, search
from rail_fem.processes.pool import Workers
from rail_fem.scene.units import si_factor
from rail_fem.sweeps.trends import MEASURES


@dataclass(frozen=True)
class Correction:
    """points (n, k) : proven shapes, variables between their bounds 0 and 1;  factors (n, m), added (n, m) : for each
    number of Problem.columns, NaN where it was not proven"""

    points: np.ndarray
    factors: np.ndarray
    added: np.ndarray

    def of(self, problem: Problem, values: np.ndarray, numbers: np.ndarray) -> np.ndarray:
        """(m,)  the numbers of a shape, corrected. values (k,) : of the variables, NaN for the case as it is"""
        at = _within_bounds(problem, values)
        factor, added = _between(self.points, self.factors, at, 1.0), _between(self.points, self.added, at, 0.0)
        corrected = numbers * np.maximum(factor, 0.0) + added
        flight = np.array(["flight" in quantity for _, quantity in problem.columns])
        return np.where(flight, np.maximum(corrected, 0.0), corrected)


def learned(problem: Problem, runs: Sequence[ProofRun]) -> Correction:
    """From proofs, each pass at its own element size."""
    own = without_finer(runs)
    shapes = list({run.shape.name: run.shape for run in own}.values())
    light = np.array([shape.trial.numbers for shape in shapes])
    proven = np.array([proven_numbers(problem, own, shape.name) for shape in shapes])
    force = np.array([MEASURES[quantity].unit == "kN" for _, quantity in problem.columns]) & (light > 0)
    ratio = proven / np.where(force, light, 1.0)
    unknown = np.where(np.isnan(proven), np.nan, 0.0)
    points = np.array([_within_bounds(problem, shape.trial.values) for shape in shapes])
    return Correction(points, np.where(force, ratio, 1.0 + unknown), np.where(force, unknown, proven - light))


def with_common(problem: Problem, correction: Correction) -> Correction:
    """Passes that no proof knows, at each shape by the mean of those of the same quantity that it does and one that is
    as the light model has it: so many can tell no more."""
    filled = {"factors": np.log(correction.factors), "added": correction.added.copy()}
    for quantity in {quantity for _, quantity in problem.columns}:
        own = [k for k, (_, q) in enumerate(problem.columns) if q == quantity]
        for part in filled.values():
            count = np.isfinite(part[:, own]).sum(axis=1, keepdims=True)
            common = np.nansum(part[:, own], axis=1, keepdims=True) / (1 + count)
            part[:, own] = np.where(np.isnan(part[:, own]), common, part[:, own])
    return replace(correction, factors=np.exp(filled["factors"]), added=filled["added"])


def proven_numbers(problem: Problem, runs: Sequence[ProofRun], shape: str) -> np.ndarray:
    """(m,)  what the explicit model has for Problem.columns of a shape; NaN where it has not run or does not know."""
    results = {run.one.name: run.result for run in runs if run.shape.name == shape and run.result is not None}
    measured = lambda name, q: (
        MEASURES[q].of(results[name]) / si_factor(MEASURES[q].unit) if name in results else np.nan
    )
    return np.array([measured(name, quantity) for name, quantity in problem.columns], dtype=float)


class ProvenScore(NamedTuple):
    """A shape, the search's score of it with the explicit model's numbers over the passes that were proven, and the
    numbers (m,) of Problem.columns that are above the start's, relative; NaN where they are not or were not proven."""

    shape: ProvenShape
    score: float
    above: np.ndarray


def proven_scores(problem: Problem, runs: Sequence[ProofRun]) -> list[ProvenScore]:
    """Of all shapes that ran every pass that the start ran, least score first."""
    own = without_finer(runs)
    start = proven_numbers(problem, own, own[0].shape.name) if own else np.array([])
    known, found = np.isfinite(start), []
    for shape in {run.shape.name: run.shape for run in own}.values() if known.any() else ():
        numbers = proven_numbers(problem, own, shape.name)
        if np.isfinite(numbers[known]).all():
            with np.errstate(divide="ignore", invalid="ignore"):
                above = np.where(known & (numbers > start), numbers / start - 1, np.nan)
            found.append(ProvenScore(shape, problem.score(numbers, start, known), above))
    return sorted(found, key=lambda one: one.score)


def _within_bounds(problem: Problem, values: np.ndarray) -> np.ndarray:
    at = np.where(np.isnan(values), problem.start_values, values)
    return np.where(np.isnan(at), 0.5, problem.scaled(at))


def _between(points: np.ndarray, known: np.ndarray, at: np.ndarray, without: float) -> np.ndarray:
    """(m,)  of known (n, m) at points (n, k); `without` where a column knows nothing."""
    found = np.full(known.shape[1], without)
    for own in np.unique(np.isfinite(known), axis=1).T:  # columns that know the same points together
        columns = (np.isfinite(known) == own[:, None]).all(axis=0)
        if own.any():
            rule = RBFInterpolator(points[own], known[own][:, columns], kernel="linear", degree=0)
            found[columns] = rule(at[None])[0]
    return found


def search_and_prove(
    problem: Problem,
    out: Path,
    count: int,
    rounds: int = 1,
    workers: Workers = Workers(2),
    settings: Mapping[str, Any] | None = None,
    finer: Sequence[str] = (),
    ranks: int = 1,
    say: Callable[[str], None] = print,
    tell: Callable[[str], None] = print,
    earlier: Sequence[Trial] = (),
) -> Iterator[tuple[Found, list[ProofRun]]]:
    """Of each round what its search found, its best the one of least score by the explicit model among those proven so
    far, and all proofs so far, the start's first; `finer` in the last. The trials of a round belong to the next, whose
    search begins with the best of them as corrected."""
    trials = earlier
    correct: Correct | None = None
    runs: list[ProofRun] = []
    for number in range(rounds):
        found = search(problem, out, workers, say, correct, trials)
        last = finer if number == rounds - 1 else ()
        own = prove_design(problem, found, out, count, settings, last, ranks, tell, workers)
        known = {run.shape.name for run in runs}
        runs = runs + [run for run in own if run.shape.name not in known]
        trials, correct = found.trials, partial(learned(problem, runs).of, problem)
        yield _with_proven_best(problem, found, runs), runs


def _with_proven_best(problem: Problem, found: Found, runs: list[ProofRun]) -> Found:
    """The start is no find; where no shape ran every pass the search's own best stays."""
    for shape, *_ in proven_scores(problem, runs):
        for trial in found.trials:
            if tuple(trial.values) == tuple(shape.trial.values):
                return replace(found, best=trial, best_by=f"the score by {MODEL}, of the shapes that were proven")
    return found
