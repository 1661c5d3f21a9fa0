"""Search and proof by turns: what a proof finds corrects the numbers that the next search goes by."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from rail_fem.design.correction import learned, proven_scores
from rail_fem.design.problem import Problem
from rail_fem.design.proof import MODEL, ProofRun, prove_design
from rail_fem.design.search import Correct, Found, Trial, search
from rail_fem.processes.pool import Workers


@dataclass(frozen=True)
class ProvenSearch:
    """found : of the last search, its best the one of least score by the explicit model among those proven so far;
    runs : all proofs so far, the start's first"""

    found: Found
    runs: list[ProofRun]


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
) -> Iterator[ProvenSearch]:
    """One a round, `finer` in the last. The trials of a round belong to the next, whose search begins with the best of
    them as corrected.

    """
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
        yield ProvenSearch(_with_proven_best(problem, found, runs), runs)


def _with_proven_best(problem: Problem, found: Found, runs: list[ProofRun]) -> Found:
    """The start is no find; where no shape ran every pass the search's own best stays."""
    for shape, *_ in proven_scores(problem, runs):
        for trial in found.trials:
            if tuple(trial.values) == tuple(shape.trial.values):
                return replace(found, best=trial, best_by=f"the score by {MODEL}, of the shapes that were proven")
    return found
