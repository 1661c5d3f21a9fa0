"""A cheap stand-in for a model: what it would answer anywhere between the trials that it has made.

A Gaussian process for each column of answers: a linear trend, and a departure from it whose covariance is Matern's of
order 5/2 in the variables over lengths, with a nugget for what jumps from trial to trial. Lengths and nugget are common
to all columns and maximise their likelihood.
Source: Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), eqs. 2.23, 4.17, 5.9, 5.12.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize
from scipy.spatial.distance import cdist

LENGTHS = 0.05, 20.0  # between which a variable's length lies, its bounds 0 and 1 apart
NUGGETS = 1e-4, 1.0  # of the departure's variance
FOLDS = 5  # of trials, by which the emulator is judged
# share of the samples that holds 95 % of the unknowns of known scenes, as an emulator's errors are no Gaussian's: by 26
# scenes of cases/design/casting.toml, half of them 0.977, half 0.980, each then held to the other half
CENTRAL = 0.98
MOST_TO_LEARN = 250  # trials by which lengths and nugget are found; all trials are interpolated


@dataclass(frozen=True)
class Emulator:
    """points (n, k) : trials, variables between their bounds 0 and 1;  weights (n, q), trend (k + 1, q);  lengths (k,);
    residuals (n, q) : what others miss of each trial, NaN if they were not asked"""

    points: np.ndarray
    weights: np.ndarray
    trend: np.ndarray
    lengths: np.ndarray
    residuals: np.ndarray

    def only(self, columns: Sequence[int]) -> "Emulator":
        """Of these columns of the answers."""
        parts = {name: getattr(self, name)[:, columns] for name in ("weights", "trend", "residuals")}
        return replace(self, **parts)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """(m, q)  answers at points (m, k)."""
        return _linear(points) @ self.trend + _covariance(points, self.points, self.lengths)[0] @ self.weights


def emulator(points: np.ndarray, answers: np.ndarray) -> Emulator:
    """From trials (n, k) and their answers (n, q), all known."""
    trend, *_ = np.linalg.lstsq(_linear(points), answers, rcond=None)
    departure = answers - _linear(points) @ trend
    scale = np.maximum(departure.std(axis=0), 1e-12)
    some = np.linspace(0, len(points) - 1, min(len(points), MOST_TO_LEARN)).astype(int)
    bounds = [np.log(LENGTHS)] * points.shape[1] + [np.log(NUGGETS)]
    start = np.r_[np.zeros(points.shape[1]), np.log(0.1)]
    best = minimize(_cost, start, (points[some], (departure / scale)[some]), jac=True, bounds=bounds)
    lengths, nugget = np.exp(best.x[:-1]), np.exp(best.x[-1])
    weights = _inverse(points, lengths, nugget) @ departure
    return Emulator(points, weights, trend, lengths, np.full_like(answers, np.nan))


def judged_emulator(points: np.ndarray, answers: np.ndarray) -> Emulator:
    """The same with its residuals: each fold of trials by an emulator of the others, whose trend, lengths and nugget
    know nothing of it."""
    residuals = np.empty_like(answers)
    for fold in range(FOLDS):
        out = np.arange(len(points)) % FOLDS == fold
        residuals[out] = answers[out] - emulator(points[~out], answers[~out])(points[out])
    return replace(emulator(points, answers), residuals=residuals)


def _linear(points: np.ndarray) -> np.ndarray:
    return np.column_stack([np.ones(len(points)), points])


def _covariance(a: np.ndarray, b: np.ndarray, lengths: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(m, n)  Matern 5/2, and its derivative to the squared distance, times -2."""
    far = np.sqrt(5.0) * cdist(a / lengths, b / lengths)
    fade = np.exp(-far)
    return (1 + far + far**2 / 3) * fade, 5 / 3 * (1 + far) * fade


def _inverse(points: np.ndarray, lengths: np.ndarray, nugget: float) -> np.ndarray:
    matrix = _covariance(points, points, lengths)[0] + nugget * np.eye(len(points))
    return cho_solve(cho_factor(matrix), np.eye(len(points)))


def _cost(logs: np.ndarray, points: np.ndarray, departure: np.ndarray) -> tuple[float, np.ndarray]:
    """Less the log likelihood of all columns, each with its own best variance, and its gradient."""
    lengths, nugget = np.exp(logs[:-1]), np.exp(logs[-1])
    near, steep = _covariance(points, points, lengths)
    factor = cho_factor(near + nugget * np.eye(len(points)))
    inverse = cho_solve(factor, np.eye(len(points)))
    weights = inverse @ departure
    variance = np.maximum((departure * weights).mean(axis=0), 1e-12)
    count, columns = departure.shape
    cost = 0.5 * count * np.log(variance).sum() + columns * np.log(np.diag(factor[0])).sum()
    inner = 0.5 * (columns * inverse - (weights / variance) @ weights.T)
    slopes = [
        (inner * steep * cdist(x[:, None], x[:, None], "sqeuclidean")).sum() / length**2
        for x, length in zip(points.T, lengths)
    ]
    return float(cost), np.r_[slopes, nugget * np.trace(inner)]
