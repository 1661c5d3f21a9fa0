"""How likely each scene is by what a source says of it: a light model's trials, an emulator between them, and samples
of the posterior by tempering.

All unknowns are evenly likely between their bounds beforehand, and so is the logarithm of the model's error of form.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import brentq
from scipy.stats import qmc

from rail_fem.design.emulator import CENTRAL, Emulator, judged_emulator
from rail_fem.design.observations import FORM, FactGroup, Likelihood
from rail_fem.design.record_facts import RecordFact

Fact = FactGroup | RecordFact
SAMPLES = 1024
MOVES = 8  # of each sample at each temperature
LAST_MOVES = 40
KEPT_SHARE = 0.5  # of the samples' effective number, from one temperature to the next
LEAST_TRIALS = 20  # by which an emulator can be made


@dataclass(frozen=True)
class Known:
    """A group of facts, or a record, and what stands in for the model. scatter : of the explicit model's answers
    about the light model's as corrected, as compared;  proven : passes that have told of it"""

    group: Fact
    model: Emulator
    local: np.ndarray  # (trials of the emulator,) whether by them its error is judged
    scatter: float = 0.0
    proven: int = 0

    def of(self, group: Fact) -> "Known":
        """The same of a group of some of its passes."""
        return replace(self, group=group, model=self.model.only(self.group.places(group.value)))

    @cached_property
    def error(self) -> np.ndarray:
        """(n, n)  covariance of the errors of emulator and correction about 0."""
        missed = self.model.residuals[self.local]
        return self.group.error_of(missed) + self.scatter**2 * np.eye(missed.shape[1])

    @cached_property
    def judge(self) -> Likelihood:
        """What is made once for all samples."""
        return self.group.judge(self.error, self.proven)

    def log_likelihood(self, samples: np.ndarray) -> np.ndarray:
        """(m,)  at samples (m, k + 1): unknowns and error of form, each between its bounds 0 and 1."""
        return self.judge(self.model(samples[:, :-1]), form_of(samples[:, -1]))


def form_of(share: np.ndarray) -> np.ndarray:
    """Relative error of form at `share` of the way between its bounds."""
    low, high = np.log(FORM)
    return np.exp(low + (high - low) * share)


def known_by_trials(
    groups: Sequence[Fact], columns: Sequence[tuple[str, str]], points: np.ndarray, numbers: np.ndarray, local: int = 0
) -> list[Known]:
    """Emulators of all groups.

    points (n, k) : trials, variables between their bounds 0 and 1;  numbers (n, len(columns));  local : the last so
    many trials lie where the posterior does: by them the emulators' errors are judged, by all if 0
    """
    known = []
    late = np.arange(len(points)) >= len(points) - local if local else np.ones(len(points), bool)
    for group in groups:
        own = group.of(numbers[:, [columns.index(column) for column in group.columns]])
        runs = np.isfinite(own).all(axis=1)
        known.append(Known(group, judged_emulator(points[runs], own[runs]), late[runs]))
    return known


def sample(known: Sequence[Known], variables: int, seed: int, count: int = SAMPLES) -> np.ndarray:
    """(count, variables + 1)  of the posterior: sequential tempering from the prior, moves by differences of samples.

    Source: Chopin, Biometrika 89 (2002) 539; ter Braak, Statistics and Computing 16 (2006) 239.
    """
    rng = np.random.default_rng(seed)
    likely: Callable[[np.ndarray], np.ndarray] = lambda at: np.sum([one.log_likelihood(at) for one in known], axis=0)
    samples = qmc.Sobol(variables + 1, seed=rng).random(count)
    value, power = likely(samples), 0.0
    while power < 1.0:
        step = _step(value, 1.0 - power)
        weight = np.exp(step * (value - value.max()))
        power += step
        # systematic resampling
        at = (np.arange(count) + rng.random()) / count
        chosen = np.minimum(np.searchsorted(np.cumsum(weight) / weight.sum(), at), count - 1)
        samples, value = samples[chosen], value[chosen]
        for _ in range(MOVES if power < 1.0 else LAST_MOVES):
            samples, value = _moved(samples, value, power, likely, rng)
    return samples


def _step(value: np.ndarray, most: float) -> float:
    """By how much the power of the likelihood may rise, `most` at most."""

    def missing(step: float) -> float:
        weight = np.exp(step * (value - value.max()))
        return weight.sum() ** 2 / (weight**2).sum() - KEPT_SHARE * len(value)

    return most if missing(most) >= 0 else brentq(missing, 0.0, most, xtol=1e-12)


def _moved(samples: np.ndarray, value: np.ndarray, power: float, likely: Callable, rng: np.random.Generator):
    """Each sample by the difference of two others, where the tempered posterior takes it."""
    count, width = samples.shape
    first, second = rng.integers(count, size=(2, count))
    scale = np.where(rng.random(count) < 0.1, 1.0, rng.uniform(0.4, 1.0, count) * 2.38 / np.sqrt(2 * width))[:, None]
    trial = samples + scale * (samples[first] - samples[second]) + 1e-3 * rng.standard_normal(samples.shape)
    inside = ((trial >= 0) & (trial <= 1)).all(axis=1)
    found = np.full(count, -np.inf)
    if inside.any():
        found[inside] = likely(trial[inside])
    taken = np.log(rng.random(count)) < power * (found - value)
    return np.where(taken[:, None], trial, samples), np.where(taken, found, value)


def interval(samples: np.ndarray) -> np.ndarray:
    """(2, k)  the 95 % interval of each unknown of samples (m, k): the central CENTRAL of them."""
    return np.quantile(samples, (0.5 - CENTRAL / 2, 0.5 + CENTRAL / 2), axis=0)
