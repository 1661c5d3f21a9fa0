"""What yielding cells harden by: the yield curve, a table of yield stress over equivalent plastic strain, isotropic or
kinematic; or a law over many cycles (bem.steel.nonlinear_kinematic)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bem.material import Elastic, MaterialError, refuse_yield_curve


class YieldLaw(Protocol):
    """What every hardening says: the first yield stress [Pa]; how many back stresses a cell remembers; the size of the
    yield surface, and the stress of a first loading, at an equivalent plastic strain [Pa]."""

    @property
    def first_yield(self) -> float: ...

    @property
    def back_stresses(self) -> int: ...

    def size(self, strain: np.ndarray) -> np.ndarray: ...

    def at(self, strain: np.ndarray) -> np.ndarray: ...


@dataclass(frozen=True, eq=False)
class Hardening:
    """J2 hardening, linear between the points of a table and constant behind its last.

    Parameters
    ----------
    strain : (k,) array
        Equivalent plastic strain, from 0, strictly increasing.
    stress : (k,) array
        Yield stress in tension [Pa], positive, never falling.
    kinematic : bool
        The yield surface keeps its first size and moves along the curve (Prager) instead of growing.

    Raises
    ------
    MaterialError
        Also for softening: it has no answer that is independent of the cells.

    Examples
    --------
    >>> float(bem.Hardening([0.0, 0.1], [300e6, 400e6]).at(0.05))
    350000000.0
    """

    strain: np.ndarray
    stress: np.ndarray
    kinematic: bool = False

    def __post_init__(self) -> None:
        for name in ("strain", "stress"):
            object.__setattr__(self, name, np.array(getattr(self, name), float))
        refuse_yield_curve(self.strain, self.stress)

    @classmethod
    def linear(cls, yield_stress: float, slope: float = 0.0, kinematic: bool = False) -> Hardening:
        """First yield and d(stress)/d(plastic strain) [Pa]; slope 0 is perfectly plastic."""
        if not (np.isfinite(yield_stress) and np.isfinite(slope)):
            raise MaterialError(f"yield stress {yield_stress!r} Pa, slope {slope!r} Pa: give finite numbers")
        return cls(np.array([0.0, 100.0]), np.array([yield_stress, yield_stress + 100.0 * slope]), kinematic)

    @property
    def first_yield(self) -> float:
        """[Pa]"""
        return float(self.stress[0])

    back_stresses = 1  # which stays 0 where the surface grows

    def at(self, strain: np.ndarray) -> np.ndarray:
        """Yield stress [Pa] at an equivalent plastic strain."""
        return np.interp(strain, self.strain, self.stress)

    def size(self, strain: np.ndarray) -> np.ndarray:
        """Of the yield surface [Pa] at an equivalent plastic strain."""
        return np.full(np.shape(strain), self.first_yield) if self.kinematic else self.at(strain)


def nearly_incompressible(elastic: Elastic) -> tuple[str, ...]:
    """A warning where Poisson's ratio leaves the mean stress without digits."""
    if elastic.poisson > 0.495:
        return (
            f"Poisson's ratio {elastic.poisson:g}: the mean stress by plastic strain loses "
            f"{np.log10(1 / (1 - 2 * elastic.poisson)):.0f} digits; deviators and plastic strain are not touched by it",
        )
    return ()
