"""Hardening over many cycles: a sum of back stresses with dynamic recovery, and a yield stress that saturates.

Each back stress follows Abdel-Karim and Ohno,
    d alpha = 2/3 C d eps_p - mu gamma alpha dp   within   |alpha| <= C / gamma,
with mu = 1 Armstrong and Frederick's rule (a sum of them Chaboche's), with mu = 0 Ohno and Wang's first model; the
yield stress is Y(p) = yield_stress + hardening (1 - exp(-hardening_rate p)). Norms are von Mises'.
Written apart from the law of the finite elements (bem.steel.cyclic_law, where its sources stand), which it is held to
step by step (tests/versus/test_cyclic_cells.py): the two packages judge each other.
Source of the implicit step: Kobayashi and Ohno, Int. J. Numer. Meth. Eng. 53 (2002) 2217 (not opened), derived here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bem.material import MaterialError, back_stress_constants, first_loading
from kernel_cache import njit

_MOST_TURNS, _MOST_ROOTS = 60, 200
_ACCURACY = 1e-13  # of the yield stress
_NUDGE = 1e-6  # of the plastic strain increment, by which the slope is found


@dataclass(frozen=True, eq=False)
class NonlinearKinematic:
    """yield_stress [Pa], first; modulus : (m,) C of each back stress [Pa]; recovery : (m,) gamma [1]; mixing : mu, 0 to
    1, one of all or (m,); hardening [Pa] and hardening_rate [1] : what the yield stress gains (below 0: loses, as long
    as a first loading never falls), and how fast.

    Errors: MaterialError that names the constant, its value and its limit; for a first loading that softens.
    """

    yield_stress: float
    modulus: np.ndarray
    recovery: np.ndarray
    mixing: np.ndarray = 1.0  # or one of all; an array from here on
    hardening: float = 0.0
    hardening_rate: float = 0.0

    def __post_init__(self) -> None:
        if not np.size(self.modulus):
            raise MaterialError("back stresses: give at least one modulus and its recovery")
        found = back_stress_constants(
            self.yield_stress, self.modulus, self.recovery, self.mixing, self.hardening, self.hardening_rate
        )
        for name, value in zip(("modulus", "recovery", "mixing"), found, strict=True):
            object.__setattr__(self, name, value)
        strain = np.linspace(0.0, 1.0, 4001)
        stress = self.at(strain)
        if (np.diff(stress) < -1e-9 * self.yield_stress).any():
            k = int(np.argmin(np.diff(stress)))
            raise MaterialError(
                f"back stresses: a first loading falls from {stress[k] / 1e6:g} MPa behind a plastic strain of"
                f" {strain[k]:g}: softening has no answer independent of the cells; give more back stress"
            )

    @property
    def first_yield(self) -> float:
        """[Pa]"""
        return float(self.yield_stress)

    @property
    def back_stresses(self) -> int:
        """How many a cell remembers."""
        return len(self.modulus)

    def size(self, strain: np.ndarray) -> np.ndarray:
        """Of the yield surface [Pa] at an equivalent plastic strain."""
        return self.yield_stress - self.hardening * np.expm1(-self.hardening_rate * np.asarray(strain))

    def at(self, strain: np.ndarray) -> np.ndarray:
        """Stress [Pa] of a first loading at an equivalent plastic strain."""
        return first_loading(self, strain)

    def moved(self, back: np.ndarray, direction: np.ndarray, grown: np.ndarray) -> np.ndarray:
        """Back stresses (nz, m nc, nx, ny) after the plastic strain has grown by (nz, nx, ny) along unit directions
        (nz, nc, nx, ny)."""
        nz, nc, nx, ny = direction.shape
        parts = back.reshape(nz, self.back_stresses, nc, nx, ny).copy()
        for i, (c, gamma, mu) in enumerate(zip(self.modulus, self.recovery, self.mixing, strict=True)):
            part = parts[:, i] + (np.sqrt(2 / 3) * c * grown)[:, None] * direction
            part /= 1 + mu * gamma * grown[:, None]
            if gamma > 0:
                size = np.sqrt(1.5 * np.einsum("kc...,kc...->k...", part, part))
                part *= (c / np.maximum(gamma * size, c))[:, None]
            parts[:, i] = np.where(grown[:, None] > 0, part, parts[:, i])
        return parts.reshape(back.shape)


class Constants(NamedTuple):
    """Those of the law, as the compiled functions take them."""

    yield_stress: float
    hardening: float
    hardening_rate: float
    modulus: np.ndarray
    recovery: np.ndarray
    mixing: np.ndarray


def constants_of(law: NonlinearKinematic) -> Constants:
    return Constants(
        law.first_yield, float(law.hardening), float(law.hardening_rate), law.modulus, law.recovery, law.mixing
    )


@njit(cache=True)
def _left_over(dp, trial, back, strain, law, shear, normal, factor):
    """Stress beyond the yield surface after a growth dp, with the flow's unit direction `normal` (nc,) and the factors
    (m,) by which back stresses are multiplied after they have grown by C dp along it, both filled in."""
    modulus, recovery, mixing = law.modulus, law.recovery, law.mixing
    nc, m, size = normal.size, factor.size, 0.0
    for i in range(m):
        factor[i] = 1.0 / (1.0 + mixing[i] * recovery[i] * dp)
    for _ in range(_MOST_TURNS):
        square = 0.0
        for c in range(nc):
            normal[c] = trial[c]
            for i in range(m):
                normal[c] -= factor[i] * back[i, c]
            square += normal[c] ** 2
        size = np.sqrt(square)
        changed = 0.0
        for c in range(nc):
            normal[c] /= size
        for i in range(m):
            if recovery[i] == 0.0 or mixing[i] == 1.0:
                continue
            grown, inner, outer = modulus[i] * dp, 0.0, 0.0
            for c in range(nc):
                inner += back[i, c] ** 2
                outer += back[i, c] * normal[c]
            held = np.sqrt(max(1.5 * inner + np.sqrt(6.0) * grown * outer + grown**2, 0.0))
            new = 1.0 / (1.0 + mixing[i] * recovery[i] * dp)
            if held * new * recovery[i] > modulus[i]:
                new = modulus[i] / (recovery[i] * held)
            changed = max(changed, abs(new - factor[i]))
            factor[i] = new
        if changed <= 1e-15:
            break
    stiffness = 3.0 * shear
    for i in range(m):
        stiffness += factor[i] * modulus[i]
    surface = law.yield_stress - law.hardening * np.expm1(-law.hardening_rate * (strain + dp))
    return np.sqrt(1.5) * size - surface - stiffness * dp


@njit(cache=True)
def nonlinear_growth(trial, back, strain, law, shear, normal, factor):
    """Growth dp of the plastic strain of a point whose trial deviator (nc,) is beyond the yield surface, and the slope
    -d(stress left over)/d(dp) there; leaves `normal` (nc,) and `factor` (m,) as `_left_over` does.

    back : (m, nc);  strain : plastic strain so far;  law : its constants. By regula falsi (Illinois).
    """
    low, high, size = 0.0, 0.0, 0.0
    for c in range(normal.size):
        size += trial[c] ** 2
    high = np.sqrt(1.5 * size)
    for i in range(factor.size):
        size = 0.0
        for c in range(normal.size):
            size += back[i, c] ** 2
        high += np.sqrt(1.5 * size)
    high /= 3.0 * shear
    at_low = _left_over(low, trial, back, strain, law, shear, normal, factor)
    at_high = _left_over(high, trial, back, strain, law, shear, normal, factor)
    dp, side, width = low, 0, high
    for _ in range(_MOST_ROOTS):
        dp = (low * at_high - high * at_low) / (at_high - at_low)
        left = _left_over(dp, trial, back, strain, law, shear, normal, factor)
        if abs(left) <= _ACCURACY * law.yield_stress or high - low <= 1e-16 * width:
            break
        if left > 0.0:
            low, at_low = dp, left
            if side == 1:
                at_high /= 2.0
            side = 1
        else:
            high, at_high = dp, left
            if side == -1:
                at_low /= 2.0
            side = -1
    ahead = dp * (1.0 + _NUDGE)
    slope = _left_over(ahead, trial, back, strain, law, shear, normal, factor)
    left = _left_over(dp, trial, back, strain, law, shear, normal, factor)
    return dp, (left - slope) / (ahead - dp) if dp > 0.0 else 3.0 * shear


@njit(cache=True)
def return_nonlinear(trial, back, peeq, law, shear, increment, direction, along, across):
    """The return of every cell; arrays as of bem.steel.return_map, back (nz, m nc, nx, ny)."""
    nz, nc, nx, ny = trial.shape
    m = law.modulus.size
    normal, factor, point, backs = np.empty(nc), np.empty(m), np.empty(nc), np.empty((m, nc))
    for k in range(nz):
        for i in range(nx):
            for j in range(ny):
                square = 0.0
                for c in range(nc):
                    point[c] = relative = trial[k, c, i, j]
                    for b in range(m):
                        backs[b, c] = back[k, b * nc + c, i, j]
                        relative -= backs[b, c]
                    square += relative**2
                limit = law.yield_stress - law.hardening * np.expm1(-law.hardening_rate * peeq[k, i, j])
                if np.sqrt(1.5 * square) - limit <= 1e-12 * limit:
                    continue
                growth, slope = nonlinear_growth(point, backs, peeq[k, i, j], law, shear, normal, factor)
                square = 0.0
                for c in range(nc):
                    relative = point[c]
                    for b in range(m):
                        relative -= factor[b] * backs[b, c]
                    square += relative**2
                step = np.sqrt(1.5) * growth
                along[k, i, j] = min(1.0, 3 * shear / slope) if slope > 0.0 else 1.0
                across[k, i, j] = 2 * shear * step / np.sqrt(square)
                for c in range(nc):
                    direction[k, c, i, j] = normal[c]
                    increment[k, c, i, j] = step * normal[c]
