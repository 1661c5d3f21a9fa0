"""Thick ring of an incompressible elastic-plastic steel under internal pressure in plane strain, in closed form.

Poisson's ratio 1/2, von Mises with the yield stress Y and linear hardening of slope H over plastic strain; a, b inner
and outer radius, c the radius up to which it has yielded. The hoop strain is B / r^2 everywhere, the equivalent stress
3 G (2 / sqrt 3) B / r^2 where elastic, and d(radial stress)/dr = (2 / sqrt 3) (equivalent stress) / r.
A steel that is nearly incompressible is met to the second order in 1 - 2 nu by G / (1 + G / K) in the place of G, K the
bulk modulus, and a wall that moves by a p / (2 K) less (`nearly`).
Source: Hill, The Mathematical Theory of Plasticity (1950), chapter V, for H = 0 (from memory; derived here).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from bem.material import Elastic

_T = 2 / np.sqrt(3)


@dataclass(frozen=True)
class PlasticRing:
    """inner, outer : radii [m]; shear : modulus G [Pa]; yield_stress Y, slope H [Pa]; softness : 1 / K [1/Pa]"""

    inner: float
    outer: float
    shear: float
    yield_stress: float
    slope: float = 0.0
    softness: float = 0.0

    @classmethod
    def nearly(
        cls, inner: float, outer: float, elastic: Elastic, yield_stress: float, slope: float = 0.0
    ) -> PlasticRing:
        """Ring of a steel of Poisson's ratio just below 1/2."""
        softness = 3 * (1 - 2 * elastic.poisson) / elastic.young
        shear = elastic.shear / (1 + elastic.shear * softness)
        return cls(inner, outer, shear, yield_stress, slope, softness)

    @property
    def first_pressure(self) -> float:
        """Pressure [Pa] at which the inner wall yields."""
        return self.yield_stress / np.sqrt(3) * (1 - self.inner**2 / self.outer**2)

    @property
    def limit_pressure(self) -> float:
        """Pressure [Pa] at which all of it has yielded."""
        return self.pressure(self.outer)

    @property
    def _share(self) -> float:
        """Part of the yield stress by which hardening raises it for each (c / r)^2 - 1."""
        return self.slope / (3 * self.shear + self.slope)

    def pressure(self, front: float) -> float:
        """Internal pressure [Pa] that yields up to the radius `front` [m]."""
        return float(self._radial_elastic(front, front) * -1 + self._plastic_part(self.inner, front))

    def front(self, pressure: float) -> float:
        """Radius [m] up to which a pressure [Pa] yields; the inner radius where none."""
        if pressure <= self.first_pressure:
            return self.inner
        return float(brentq(lambda c: self.pressure(c) - pressure, self.inner, self.outer, xtol=1e-15))

    def _plastic_part(self, r, c):
        """Change of radial stress from r to c [Pa]."""
        h = self._share
        return _T * self.yield_stress * ((1 - h) * np.log(c / r) + h * (c**2 / r**2 - 1) / 2)

    def _radial_elastic(self, r, c):
        return -self.yield_stress / np.sqrt(3) * c**2 * (1 / r**2 - 1 / self.outer**2)

    def equivalent(self, r: np.ndarray, pressure: float) -> np.ndarray:
        """Von Mises stress [Pa] at radii [m] under a pressure first applied."""
        c = self._front_or_elastic(pressure)
        elastic = self.yield_stress * c**2 / r**2
        h = self._share
        return np.where(elastic > self.yield_stress, self.yield_stress * (1 - h) + h * elastic, elastic)

    def _front_or_elastic(self, pressure: float) -> float:
        """c, or where nothing yields the radius below `inner` that stands for the elastic state."""
        if pressure > self.first_pressure:
            return self.front(pressure)
        return self.inner * np.sqrt(max(pressure, 0.0) / self.first_pressure)

    def stress(self, r: np.ndarray, pressure: float) -> tuple[np.ndarray, np.ndarray]:
        """Radial and hoop stress [Pa] at radii [m]."""
        c = self._front_or_elastic(pressure)
        radial = np.where(r < c, self._radial_elastic(c, c) - self._plastic_part(r, c), self._radial_elastic(r, c))
        return radial, radial + _T * self.equivalent(r, pressure)

    def residual(self, r: np.ndarray, pressure: float) -> tuple[np.ndarray, np.ndarray]:
        """Radial and hoop stress [Pa] left when the pressure has gone, where that does not yield again."""
        radial, hoop = self.stress(r, pressure)
        level = pressure / (self.outer**2 / self.inner**2 - 1)
        return radial - level * (1 - self.outer**2 / r**2), hoop - level * (1 + self.outer**2 / r**2)

    def wall(self, pressure: float) -> float:
        """Radial displacement [m] of the inner wall."""
        c = self._front_or_elastic(pressure)
        return self.yield_stress * c**2 / (3 * self.shear * _T) / self.inner - self.inner * pressure * self.softness / 2

    def plastic_strain(self, r: np.ndarray, pressure: float) -> np.ndarray:
        """Equivalent plastic strain at radii [m]."""
        c = self._front_or_elastic(pressure)
        return np.maximum(c**2 / r**2 - 1, 0) * self.yield_stress / (3 * self.shear + self.slope)
