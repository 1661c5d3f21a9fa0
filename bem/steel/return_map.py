"""Radial return of J2 plasticity on deviators, and its consistent tangent in two numbers per cell.

With the trial deviator s, back stress a, xi = s - a and N = xi / |xi|: the plastic strain grows by dgamma N, and
d(2 G plastic strain)/d s = m_n N x N + m_t (I - N x N), m_n = 1 / (1 + H / 3 G), m_t = 2 G dgamma / |xi|.
Source: Simo and Taylor, Comput. Methods Appl. Mech. Eng. 48 (1985) 101 (the operator theta, theta'), in the form of
Simo and Hughes, Computational Inelasticity (1998), section 3.3; derived here, held to differences
(tests/bem/plastic/test_return_map.py). Error: exact for proportional loading, first order in the increment otherwise.
Of a law over many cycles the increment is a root of one equation, the tangent along N that of the root with N held;
what the recovery of back stresses adds across N is left out, so that the tangent is symmetric and Newton's method a
little slower.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bem.steel.hardening import Hardening, YieldLaw
from bem.steel.nonlinear_kinematic import NonlinearKinematic, law_of, return_nonlinear
from kernel_cache import njit


@dataclass
class PlasticState:
    """strain : (nz, 5, nx, ny) plastic strain; back : (nz, 5 m, nx, ny) m back stresses one after another [Pa]; peeq :
    (nz, nx, ny) equivalent plastic strain."""

    strain: np.ndarray
    back: np.ndarray
    peeq: np.ndarray

    @classmethod
    def virgin(cls, shape: tuple[int, int, int, int], back_stresses: int = 1) -> PlasticState:
        nz, nc, nx, ny = shape
        return cls(np.zeros(shape), np.zeros((nz, back_stresses * nc, nx, ny)), np.zeros((nz, nx, ny)))

    @property
    def centre(self) -> np.ndarray:
        """(nz, 5, nx, ny) of the yield surface, the sum of the back stresses [Pa]."""
        nz, nc, nx, ny = self.strain.shape
        return self.back.reshape(nz, -1, nc, nx, ny).sum(axis=1)

    def copy(self) -> PlasticState:
        return PlasticState(self.strain.copy(), self.back.copy(), self.peeq.copy())


@dataclass
class Returned:
    """increment (nz, 5, nx, ny) of plastic strain; direction N; along, across (nz, nx, ny) : m_n and m_t, 0 where
    elastic."""

    increment: np.ndarray
    direction: np.ndarray
    along: np.ndarray
    across: np.ndarray

    @property
    def growth(self) -> np.ndarray:
        """(nz, nx, ny) of the equivalent plastic strain."""
        return np.sqrt(2 / 3 * np.einsum("kc...,kc...->k...", self.increment, self.increment))

    def root(self, field: np.ndarray) -> np.ndarray:
        """The square root of the tangent times a field (nz, 5, nx, ny)."""
        across = np.sqrt(self.across)
        normal = np.einsum("kc...,kc...->k...", self.direction, field) * (np.sqrt(self.along) - across)
        return across[:, None] * field + normal[:, None] * self.direction


def radial_return(trial: np.ndarray, state: PlasticState, hardening: YieldLaw, shear: float) -> Returned:
    """trial : (nz, 5, nx, ny) deviator with the plastic strain of `state` held [Pa]. Pure."""
    found = Returned(*(np.zeros(trial.shape) for _ in range(2)), *(np.zeros(state.peeq.shape) for _ in range(2)))
    if isinstance(hardening, NonlinearKinematic):
        return_nonlinear(
            trial, state.back, state.peeq, law_of(hardening, shear), found.increment, found.direction, found.along,
            found.across,
        )  # fmt: skip
        return found
    if not isinstance(hardening, Hardening):
        raise TypeError(f"hardening is a {type(hardening).__name__}: give a Hardening or a NonlinearKinematic")
    _return(
        trial, state.back, state.peeq, hardening.strain, hardening.stress, hardening.kinematic, shear, found.increment,
        found.direction, found.along, found.across,
    )  # fmt: skip
    return found


def advanced(state: PlasticState, found: Returned, hardening: YieldLaw) -> PlasticState:
    """The state after an increment."""
    grown = found.growth
    peeq, back = state.peeq + grown, state.back
    if isinstance(hardening, NonlinearKinematic):
        back = hardening.moved(back, found.direction, grown)
    elif isinstance(hardening, Hardening) and hardening.kinematic:
        rise = np.sqrt(2 / 3) * (hardening.at(peeq) - hardening.at(state.peeq))
        back = back + rise[:, None] * found.direction
    return PlasticState(state.strain + found.increment, back, peeq)


@njit(cache=True)
def plastic_growth(excess, strain, curve_strain, curve_stress, shear):
    """Growth d of the equivalent plastic strain with excess = 3 G d + Y(strain + d) - Y(strain), and Y' behind it.

    Y is linear between the points of its curve, so this is exact.
    """
    triple, growth, left = 3 * shear, 0.0, excess
    last = len(curve_strain) - 1
    k = min(np.searchsorted(curve_strain, strain, side="right") - 1, last)
    while k < last:
        slope = (curve_stress[k + 1] - curve_stress[k]) / (curve_strain[k + 1] - curve_strain[k])
        room = curve_strain[k + 1] - strain - growth
        if left <= (triple + slope) * room:
            return growth + left / (triple + slope), slope
        left -= (triple + slope) * room
        growth += room
        k += 1
    return growth + left / triple, 0.0


@njit(cache=True)
def _return(trial, back, peeq, curve_strain, curve_stress, kinematic, shear, increment, direction, along, across):
    nz, nc, nx, ny = trial.shape
    for k in range(nz):
        for i in range(nx):
            for j in range(ny):
                square = 0.0
                for c in range(nc):
                    square += (trial[k, c, i, j] - back[k, c, i, j]) ** 2
                size = np.sqrt(square)
                limit = curve_stress[0] if kinematic else np.interp(peeq[k, i, j], curve_strain, curve_stress)
                excess = np.sqrt(1.5) * size - limit
                if excess <= 1e-12 * limit:
                    continue
                growth, slope = plastic_growth(excess, peeq[k, i, j], curve_strain, curve_stress, shear)
                step = np.sqrt(1.5) * growth
                along[k, i, j] = 1 / (1 + slope / (3 * shear))
                across[k, i, j] = 2 * shear * step / size
                for c in range(nc):
                    normal = (trial[k, c, i, j] - back[k, c, i, j]) / size
                    direction[k, c, i, j] = normal
                    increment[k, c, i, j] = step * normal
