"""A measured acceleration as facts of an inversion: how likely each scene makes it, wherever along the track it was
begun.

What lies between record and model: noise of the sensor, its constant and drift, the emulator's error, and the model's
relative error of form, frequency by frequency, a share of it one factor on all (a calibration, for one). The offset
along the track is found anew for each scene, that of the nearest record, and integrated over about there.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.stats import chi2

from rail_fem.design.emulator import CENTRAL, FOLDS
from rail_fem.design.observations import FORM, SHARED, Likelihood
from rail_fem.measurement.trace import Trace
from rail_fem.scene.scene import Scene
from rail_fem.settings.light import RigidHertzSettings

LEVELS = np.geomspace(*FORM, 13)  # of the error of form, at which covariances are made
SMOOTH = 2  # frequencies to both sides, over which the record's own size is taken


class Nearness(NamedTuple):
    """A record at all its offsets (s, n), and its slope there, in units of standard deviations by `whiten` (n, n);
    volume : logarithm of the covariance's"""

    whiten: np.ndarray
    seen: np.ndarray
    slope: np.ndarray
    volume: float

    def place(self, model: np.ndarray) -> np.ndarray:
        """(m,)  at which offset the record is nearest to models (m, n), in these units."""
        return ((self.seen**2).sum(axis=1) - 2 * model @ self.seen.T).argmin(axis=1)

    def __call__(self, found: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Squared distance (m,) of numbers (m, n) to the record where it is nearest, and how fast it grows with the
        offset's square (m,) [1/m2]."""
        model = found @ self.whiten.T
        near = self.place(model)
        beside, slope = model - self.seen[near], self.slope[near]
        width = (slope**2).sum(axis=1)
        return (beside**2).sum(axis=1) - (beside * slope).sum(axis=1) ** 2 / width, width


@dataclass(frozen=True, eq=False)
class RecordFact:
    """What one record says of the pass `name`."""

    name: str
    trace: Trace

    @property
    def value(self) -> dict[str, str]:
        """By pass, the record."""
        return {self.name: self.trace.record.label}

    @property
    def columns(self) -> list[tuple[str, str]]:
        """Pass and quantity of the numbers that it needs."""
        return [(self.name, f"{self.trace.sensor.words}, {name}") for name in self.trace.window.names]

    def measured(self, scene: Scene, settings: RigidHertzSettings) -> np.ndarray:
        """(n,)  the numbers of a scene [m/s^2]. Errors: those of the model."""
        return self.trace.window.of(self.trace.sensor.of(scene, settings))

    def of(self, numbers: np.ndarray) -> np.ndarray:
        """(m, n)  as they are compared."""
        return numbers

    def places(self, passes: Iterable[str]) -> list[int]:
        """Which of the emulator's answers are those of its only pass."""
        return list(range(len(self.columns)))

    @cached_property
    def size(self) -> np.ndarray:
        """(n,)  mean square of the record about each frequency [m2/s4]."""
        half = self.trace.reference.reshape(2, -1)
        power = (half**2).mean(axis=0)
        near = [power[max(0, k - SMOOTH) : k + SMOOTH + 1].mean() for k in range(len(power))]
        return np.tile(near, 2)

    def covariance(self, form: float, error: np.ndarray | float = 0.0) -> np.ndarray:
        """(n, n)  of record less model at a relative error of form."""
        common = self.trace.reference
        own = (1 - SHARED) * np.diag(self.size) + SHARED * np.outer(common, common)
        return self.trace.noise + error + form**2 * own

    def judge(self, error: np.ndarray, proven: int = 0) -> Likelihood:
        """As FactGroup.judge. error : (n, n) covariance of numbers beside the model's form; no proof tells of it"""
        near = [self._nearness(self.covariance(level, error)) for level in LEVELS]

        def likelihood(found: np.ndarray, form: np.ndarray) -> np.ndarray:
            at = np.abs(np.log(form)[:, None] - np.log(LEVELS)).argmin(axis=1)
            likely = np.empty(len(found))
            for level in np.unique(at):
                square, width = near[level](found[at == level])
                likely[at == level] = -0.5 * (square + np.log(width)) - near[level].volume
            return likely

        return likelihood

    @staticmethod
    def error_of(missed: np.ndarray) -> np.ndarray:
        """(n, n)  covariance about 0 of an emulator's residuals (m, n), where trials may be fewer than numbers: half it
        and half its diagonal where they are as many, and so large that CENTRAL of the trials, each by the others', lie
        within it."""

        def alike(own: np.ndarray) -> np.ndarray:
            trials, count = own.shape
            together = own.T @ own / trials
            return (trials * together + count * np.diag(np.diag(together))) / (trials + count)

        number, square = np.arange(len(missed)) % FOLDS, np.empty(len(missed))
        for fold in range(FOLDS):
            own, others = missed[number == fold], alike(missed[number != fold])
            square[number == fold] = (own * np.linalg.solve(others, own.T).T).mean(axis=1)
        return alike(missed) * max(1.0, float(np.quantile(square, CENTRAL)))

    def _nearness(self, covariance: np.ndarray) -> "Nearness":
        factor = cholesky(covariance, lower=True)
        whiten = solve_triangular(factor, np.eye(len(factor)), lower=True)
        by = lambda rows: rows @ whiten.T
        return Nearness(whiten, by(self.trace.seen), by(self.trace.slope), float(np.log(np.diag(factor)).sum()))

    def misfit(self, numbers: np.ndarray, form: float) -> tuple[float, float]:
        """Chi-square of a scene's numbers (n,) over its n - 1 degrees of freedom at an error of form, and the
        probability that it is as large or larger."""
        square = float(self._nearness(self.covariance(form))(numbers[None])[0][0])
        free = len(numbers) - 1
        return square / free, float(chi2.sf(square, free))

    def offset(self, numbers: np.ndarray) -> float:
        """How far the record is to be moved along the track to meet a scene's numbers (n,) [m]."""
        near = self._nearness(self.covariance(FORM[0]))
        return float(self.trace.moved[near.place(numbers[None] @ near.whiten.T)[0]])

    def missed(self, numbers: np.ndarray, form: float) -> np.ndarray:
        """(n,)  by how many standard deviations of record and form."""
        seen = self.trace.window.of(self.trace.record, self.offset(numbers))
        return (numbers - seen) / np.sqrt(np.diagonal(self.covariance(form)))

    def drawn(self, truth: np.ndarray, form: float, rng: np.random.Generator) -> list["RecordFact"]:
        """The same record as it would be of a scene whose numbers (n,) are `truth`, seen with all errors that
        `judge` counts, somewhere within the offsets."""
        trace = self.trace
        own = replace(self, trace=replace(trace, seen=truth[None], strongest=0))
        errors = cholesky(own.covariance(form) + 1e-12 * np.eye(len(truth)) * own.size.max(), lower=True)
        seen = truth + errors @ rng.standard_normal(len(truth))
        begun = rng.uniform(*np.quantile(trace.moved, (0.25, 0.75)))
        every = np.array([trace.window.turned(seen, moved - begun) for moved in trace.moved])
        slope = np.gradient(every, trace.moved[1] - trace.moved[0], axis=0)
        return [
            replace(
                self,
                trace=replace(trace, seen=every, slope=slope, strongest=int(np.argmin(np.abs(trace.moved - begun)))),
            )
        ]

    def told(self) -> dict[str, Any]:
        """Of a table: record, sensor, window, noise."""
        window = self.trace.window
        return {
            "record": self.trace.record.label,
            "sensor": self.trace.sensor.words,
            "window": f"{1e3 * window.start:.0f} to {1e3 * window.end:.0f} mm",
            "band": f"{window.frequencies[0]:.0f} to {window.frequencies[-1]:.0f} Hz",
            "noise": f"{self.trace.deviation:.3g} m/s^2",
        }
