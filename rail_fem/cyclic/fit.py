"""Constants of Chaboche's law from a cyclic stress-strain curve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares


@dataclass(frozen=True)
class CyclicCurveFit:
    """yield_stress [Pa], modulus (k,) [Pa], recovery (k,);  misfit : rms over the largest stress amplitude"""

    yield_stress: float
    modulus: np.ndarray
    recovery: np.ndarray
    misfit: float


def stress_amplitude(plastic: np.ndarray, yield_stress: float, modulus: np.ndarray, recovery: np.ndarray) -> np.ndarray:
    """Of closed symmetric loops of plastic strain amplitude `plastic`: Y + sum C / gamma tanh(gamma plastic) [Pa].

    From alpha running between -a and a along the law of `closed_forms.back_stress`.
    """
    plastic = np.asarray(plastic, float)[..., None]
    return yield_stress + (np.asarray(modulus) / recovery * np.tanh(np.asarray(recovery) * plastic)).sum(axis=-1)


def fit_cyclic_curve(plastic: np.ndarray, stress: np.ndarray, count: int = 3) -> CyclicCurveFit:
    """Yield stress and `count` back stresses of least squares.

    plastic, stress : (n,) amplitudes of plastic strain [1] and stress [Pa] of stabilised symmetric loops, n > count
    The recoveries are spread over the range of the data, the rest follows; all stay positive.
    Errors: ValueError for unequal lengths, numbers that are not positive, or too few of them.
    """
    plastic, stress = np.asarray(plastic, float), np.asarray(stress, float)
    if plastic.shape != stress.shape or plastic.ndim != 1 or plastic.size < 2 * count:
        raise ValueError(
            f"{plastic.size} plastic strain and {stress.size} stress amplitudes for {count} back stresses:"
            f" give at least {2 * count} of each"
        )
    if not (np.isfinite(plastic).all() and np.isfinite(stress).all() and plastic.min() > 0 and stress.min() > 0):
        raise ValueError("amplitudes of plastic strain and stress must be positive and finite")
    scale = stress.max()
    recovery = 2 / np.geomspace(plastic.min(), plastic.max(), count)
    guess = np.log(np.concatenate([[0.5 * stress.min() / scale], np.full(count, 0.5 / count) * recovery, recovery]))

    def misfit(logarithms: np.ndarray) -> np.ndarray:
        values = np.exp(logarithms)
        return stress_amplitude(plastic, values[0], values[1 : count + 1], values[count + 1 :]) - stress / scale

    found = least_squares(misfit, guess, xtol=1e-14, ftol=1e-14, gtol=1e-14, max_nfev=2000)
    values = np.exp(found.x)
    order = np.argsort(-values[count + 1 :])
    return CyclicCurveFit(
        float(values[0] * scale),
        values[1 : count + 1][order] * scale,
        values[count + 1 :][order],
        float(np.sqrt(np.mean(found.fun**2))),
    )
