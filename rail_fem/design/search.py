"""The search: SciPy's differential evolution on a pool of processes, every trial kept on disk.

Seeded, so that it makes the same trials each time: started again it finds those that are done in trials.csv and goes on
behind them. A trial that cannot be run counts as FAILED and keeps its reason.
"""

import csv
import hashlib
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy.optimize import differential_evolution

from rail_fem.design.problem import FAILED, DesignError, Problem
from rail_fem.files.atomic import write_text_atomically
from rail_fem.processes.pool import Lost, Pool, Workers

TRIALS = "trials.csv"
PER_VARIABLE = 6  # trials of one generation for each variable, at least LEAST in all
LEAST = 12
DIGITS = 6  # to which values are written, run and remembered

Correct = Callable[[np.ndarray, np.ndarray], np.ndarray]  # values and numbers of a trial to the numbers that count


@dataclass(frozen=True)
class Trial:
    """values (k,) in the variables' units;  numbers (m,) of Problem.columns, NaN where it failed;  fault : why;
    corrected (m,) : the numbers as earlier proofs correct them, None before there is one"""

    values: np.ndarray
    numbers: np.ndarray
    score: float
    fault: str = ""
    corrected: np.ndarray | None = None

    @property
    def expected(self) -> np.ndarray:
        """(m,)  what a proof is expected to find: the numbers, or as earlier proofs correct them."""
        return self.numbers if self.corrected is None else self.corrected


@dataclass(frozen=True)
class Found:
    """start : the case as it is;  best : the least score;  trials : all, in the order in which they were made;
    best_by : by what the best is so"""

    start: Trial
    best: Trial
    trials: list[Trial]
    best_by: str = "the weighted score"


def search(
    problem: Problem,
    out: Path,
    workers: Workers = Workers(2),
    say: Callable[[str], None] = print,
    correct: Correct | None = None,
    earlier: Sequence[Trial] = (),
) -> Found:
    """Search, or go on with a search.

    correct : values and numbers of a trial to the numbers that count;  earlier : trials of a search before, whose best
    by these numbers begin this one, which makes half as many and has them among its own
    Errors: DesignError where the start cannot be run or lacks a quantity, or `out` holds another search.
    """
    record, design = SearchRecord(problem, Path(out)), problem.design
    with Pool(workers, __name__) as pool:
        judge = _Judge(problem, correct, record.start(pool))
        seen = {tuple(trial.values): judge(trial) for trial in earlier}
        bounds = [variable.bounds for variable in design.vary]
        members = int(np.ceil(max(LEAST, PER_VARIABLE * len(bounds)) / len(bounds)))
        generation, asked = members * len(bounds), int(np.ceil(design.trials / 2 if earlier else design.trials))
        generations = max(2, int(np.ceil(asked / generation)))
        if (made := generations * generation) != asked:
            say(f"{asked} trials asked for, {made} made: {generations} generations of {generation}, two at least")
        differential_evolution(
            lambda x: 0.0,  # never called: `workers` is given the points of a generation
            bounds,
            popsize=members,
            init=_best(seen.values(), generation) or "latinhypercube",
            maxiter=generations - 1,
            seed=design.seed,
            x0=None if earlier else design.guessed or None,
            updating="deferred",
            polish=False,
            tol=1e-6,
            workers=lambda _, points: _scores(record, pool, judge, seen, points, say),
        )
    found = list(seen.values())
    if all(trial.fault for trial in found):
        raise DesignError(f"none of the {len(found)} trials could be run, the last: {found[-1].fault}")
    return Found(judge.start, min(found, key=lambda trial: trial.score), found)


def trials_of(problem: Problem, folder: Path) -> list[Trial]:
    """Of a search of the same passes and bounds, whatever its weights. Errors: DesignError where there is none."""
    trials = SearchRecord(problem, Path(folder)).trials if (Path(folder) / TRIALS).is_file() else []
    if not trials:
        raise DesignError(f"{folder}: has no {TRIALS} of a search to begin with, or no trial in it")
    return trials


class _Judge:
    """Scores of trials against the start, by the numbers that count."""

    def __init__(self, problem: Problem, correct: Correct | None, start: Trial):
        self.problem, self.correct, self.start = problem, correct, start
        self.start = self(start)

    def __call__(self, trial: Trial) -> Trial:
        corrected = None if trial.fault or self.correct is None else self.correct(trial.values, trial.numbers)
        own = replace(trial, corrected=corrected)
        first = own if own.values is self.start.values else self.start
        return replace(own, score=FAILED if own.fault else self.problem.score(own.expected, first.expected))


def _best(trials: Iterable[Trial], count: int) -> list[np.ndarray]:
    """Values of the `count` trials of least score; none where there are fewer that could be run."""
    good = sorted((trial for trial in trials if not trial.fault), key=lambda trial: trial.score)
    return [trial.values for trial in good[:count]] if len(good) >= count else []


def _scores(
    record: "SearchRecord", pool: Pool, judge: _Judge, seen: dict[tuple, Trial], points: Iterable, say: Callable
) -> list[float]:
    points = [rounded(point) for point in points]
    unseen = record.made(pool, [point for point in points if tuple(point) not in seen])
    seen.update({tuple(trial.values): judge(trial) for trial in unseen})
    failed, best = sum(bool(trial.fault) for trial in seen.values()), min(trial.score for trial in seen.values())
    say(f"{len(seen)} trials, best {best:.4f} (start {judge.start.score:.4f}), {failed} failed")
    return [seen[tuple(point)].score for point in points]


def rounded(point: np.ndarray) -> np.ndarray:
    """As it is written into a case and into trials.csv."""
    return np.array([float(f"{value:.{DIGITS}g}") for value in point])


def trials_by(pool: Pool, problem: Problem, points: Sequence[np.ndarray | None]) -> Iterator[Trial]:
    """Of each, by the workers, as it ends; a trial whose process is ended again and again has no numbers. NaN for the
    values of the case as it is."""
    none = np.full(len(problem.columns), np.nan)
    for number, one in pool.each(partial(numbers_of, problem), points):
        numbers, fault = (none, str(one)) if isinstance(one, Lost) else one
        values = points[number]
        yield Trial(np.full(len(problem.design.vary), np.nan) if values is None else values, numbers, np.nan, fault)


def numbers_of(problem: Problem, values: np.ndarray | None) -> tuple[np.ndarray, str]:
    """In a process of the pool: the numbers of a trial, or why there are none."""
    try:
        return problem.numbers(values), ""
    except Exception as error:  # whatever a trial dies of, the search goes on
        return np.full(len(problem.columns), np.nan), " ".join(str(error).split())[:300]


class SearchRecord:
    """trials.csv in a folder: the search's own digest, the start, and a row a trial, written as they come."""

    def __init__(self, problem: Problem, out: Path):
        self.problem, self.path = problem, out / TRIALS
        self.trials: list[Trial] = []
        self._known: dict[tuple, Trial] = {}
        self._start: Trial | None = None
        out.mkdir(parents=True, exist_ok=True)
        if self.path.is_file():
            self._read()
        else:
            self._begin()

    def _begin(self) -> None:
        titles = [variable.title for variable in self.problem.design.vary]
        titles += [f"{name}: {quantity}" for name, quantity in self.problem.columns]
        write_text_atomically(self.path, "")
        self._write([f"# search {self.digest}"])
        self._write([*titles, "fault"])

    @property
    def digest(self) -> str:
        """Of what the trials depend on: the case's text, what its files hold, what may vary and what is run; not of
        weights and targets, nor of what a pass sets for another model."""
        design = self.problem.design
        own = lambda key: not key.startswith("run.") or key.startswith(f"run.{design.model}.")
        about = [
            design.model,
            [v.model_dump() for v in design.vary],
            [{key: value for key, value in p.set.items() if own(key)} for p in design.passes],
            [o.quantity for o in design.objective] or self.problem.columns,
            self.problem.case.read_text(encoding="utf-8"),
        ]
        scenes = [self.problem.changed(None, p).scene for p in design.passes]
        files = [part.digest for scene in scenes for part in (scene.wheel, scene.crossing)]
        about += [files] if any(files) else []
        return hashlib.sha256(json.dumps(about, default=str).encode()).hexdigest()[:16]

    def start(self, pool: Pool) -> Trial:
        """The case as it is: kept, or run now."""
        if self._start is None:
            (start,) = trials_by(pool, self.problem, [None])
            if start.fault:
                raise DesignError(f"the case as it is cannot be run: {start.fault}")
            if unknown := [
                f"{quantity} in {name}"
                for value, (name, quantity) in zip(start.numbers, self.problem.columns)
                if np.isnan(value) and self.problem.design.objective
            ]:
                raise DesignError(
                    f"{self.problem.design.model} does not find {', '.join(unknown)} for the case as it is: take a"
                    " quantity that it resolves, or passes in which it does"
                )
            self._start = start
            self._row(start)
        return self._start

    def made(self, pool: Pool, values: Iterable[np.ndarray]) -> list[Trial]:
        """The trials of these values (n, k): kept ones, or made now and each kept as soon as it ends."""
        points = [rounded(value) for value in values]
        missing = {tuple(point): point for point in points if tuple(point) not in self._known}
        for trial in trials_by(pool, self.problem, [*missing.values()]):
            self._row(trial)
            self._remember(trial)
        return [self._known[tuple(point)] for point in points]

    def _remember(self, trial: Trial) -> None:
        self.trials.append(trial)
        self._known[tuple(trial.values)] = trial

    def _row(self, trial: Trial) -> None:
        self._write([*(repr(float(v)) for v in (*trial.values, *trial.numbers)), trial.fault])

    def _write(self, row: list[str]) -> None:
        try:
            with self.path.open("a", newline="", encoding="utf-8") as file:
                csv.writer(file, lineterminator="\n").writerow(row)
        except OSError as error:  # of a full disk, which names no file
            raise OSError(error.errno, error.strerror, str(self.path)) from error

    def _read(self) -> None:
        text = self.path.read_text(encoding="utf-8")
        if not text.endswith("\n"):  # cut off as a row was written: that trial is made again
            text = text[: text.rfind("\n") + 1]
            write_text_atomically(self.path, text)
        rows = list(csv.reader(text.splitlines()))
        if not rows or rows[0] != [f"# search {self.digest}"]:
            if not rows or rows[0][:1] and rows[0][0].startswith("# search ") and len(rows) <= 2:
                return self._begin()  # of a search that was refused, or ended before its first trial
            raise DesignError(f"{self.path}: holds trials of another search: give another folder, or remove it")
        count = len(self.problem.design.vary)
        for line, row in enumerate(rows[2:], 3):
            try:
                found = np.array([float(v) for v in row[:-1]])
            except ValueError:
                found = np.array([])
            if len(found) != count + len(self.problem.columns):
                raise DesignError(
                    f"{self.path}: line {line} is no trial: {','.join(row)[:50]}: take it out, it is made again"
                )
            values, numbers = found[:count], found[count:]
            trial = Trial(values, numbers, np.nan, row[-1])
            if np.isnan(values).all():
                self._start = trial
            else:
                self._remember(trial)
