"""Hardening over many cycles: a sum of back stresses with dynamic recovery, and a yield stress that saturates.

Each back stress follows Abdel-Karim and Ohno,
    d alpha = 2/3 C d eps_p - mu gamma alpha dp   within   |alpha| <= C / gamma,
with mu = 1 Armstrong and Frederick's rule (a sum of them Chaboche's), with mu = 0 Ohno and Wang's first model; the
yield stress is Y(p) = yield_stress + hardening (1 - exp(-hardening_rate p)). Norms are von Mises'.
The step of a point is that of the finite elements (bem.steel.cyclic_law, where its sources stand); here are what cells
of boundary elements need besides: deviators of three or five numbers, and the tangent.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bem.material import MaterialError, back_stress_constants, first_loading
from bem.steel.cyclic_law import CyclicLaw, equivalent, plastic_increment, slope_of, yield_stress_at
from kernel_cache import njit


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


def law_of(law: NonlinearKinematic, shear: float) -> CyclicLaw:
    """The constants as the compiled step takes them; of the volume it asks nothing."""
    isotropic = law.first_yield, float(law.hardening), float(law.hardening_rate)
    return CyclicLaw(shear, np.nan, *isotropic, law.modulus, law.recovery, law.mixing)


@njit(cache=True)
def _as_tensor(values, tensor):
    """Fill a tensor (6,), order VOIGT, with the same norm as a deviator of three or five numbers: all that the law asks
    of a deviator are inner products."""
    tensor[:] = 0.0
    for c in range(values.size):
        tensor[c] = values[c] if c < 3 else values[c] * np.sqrt(0.5)


@njit(cache=True)
def return_nonlinear(trial, back, peeq, law, increment, direction, along, across):
    """The return of every cell by a CyclicLaw; arrays as of bem.steel.return_map, back (nz, m nc, nx, ny)."""
    nz, nc, nx, ny = trial.shape
    m = law.modulus.size
    point, backs, normal, factor = np.empty(6), np.empty((m, 6)), np.empty(6), np.empty(m)
    for k in range(nz):
        for i in range(nx):
            for j in range(ny):
                _as_tensor(trial[k, :, i, j], point)
                normal[:] = point
                for b in range(m):
                    _as_tensor(back[k, b * nc : (b + 1) * nc, i, j], backs[b])
                    normal -= backs[b]
                limit = yield_stress_at(law, peeq[k, i, j])
                if equivalent(normal) - limit <= 1e-12 * limit:
                    continue
                growth = plastic_increment(law, point, backs, peeq[k, i, j], normal, factor)
                slope = slope_of(law, backs, peeq[k, i, j], growth, normal, factor)
                for b in range(m):
                    point -= factor[b] * backs[b]
                along[k, i, j] = min(1.0, 3 * law.shear / slope) if slope > 0.0 else 1.0
                across[k, i, j] = 3 * law.shear * growth / equivalent(point)
                for c in range(nc):
                    unit = np.sqrt(1.5) * normal[c] if c < 3 else np.sqrt(3.0) * normal[c]
                    direction[k, c, i, j] = unit
                    increment[k, c, i, j] = np.sqrt(1.5) * growth * unit
