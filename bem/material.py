"""Linear elastic, isotropic material and the modulus of two bodies in contact; what yield curves and back stresses
must be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bem.checks import refuse_unless_finite, refuse_unless_positive


class MaterialError(ValueError):
    """An elastic constant that no stable isotropic solid has."""


@dataclass(frozen=True)
class Elastic:
    """Isotropic linear elasticity.

    Parameters
    ----------
    young : float
        Young's modulus [Pa], > 0.
    poisson : float
        Poisson's ratio, -1 < nu < 0.5 (0.5 itself leaves the bulk modulus infinite).

    Examples
    --------
    >>> round(bem.Elastic(young=210e9, poisson=0.3).shear / 1e9, 2)  # [GPa]
    80.77
    """

    young: float
    poisson: float

    def __post_init__(self) -> None:
        refuse_unless_positive(MaterialError, **{"Young's modulus [Pa]": self.young})
        refuse_unless_finite(MaterialError, **{"Poisson's ratio": self.poisson})
        if not -1 < self.poisson < 0.5:
            raise MaterialError(
                f"Poisson's ratio {self.poisson!r}: must lie in (-1, 0.5); for rubber take 0.4999 or less"
            )

    @property
    def shear(self) -> float:
        """Shear modulus G [Pa]."""
        return self.young / (2 * (1 + self.poisson))

    @property
    def bulk(self) -> float:
        """Bulk modulus K [Pa]."""
        return self.young / (3 * (1 - 2 * self.poisson))

    @property
    def kolosov(self) -> float:
        """Kolosov's constant of plane strain, 3 - 4 nu."""
        return 3 - 4 * self.poisson

    @property
    def plane_modulus(self) -> float:
        """E / (1 - nu^2) [Pa]."""
        return self.young / (1 - self.poisson**2)

    @classmethod
    def from_shear(cls, shear: float, poisson: float) -> Elastic:
        """Material of shear modulus [Pa] and Poisson's ratio."""
        return cls(2 * shear * (1 + poisson), poisson)


STEEL = Elastic(210e9, 0.3)
"""Rail and wheel steel: Young's modulus 210 GPa, Poisson's ratio 0.3."""


def contact_modulus(first: Elastic, second: Elastic) -> float:
    """Modulus of two bodies in contact.

    Parameters
    ----------
    first, second : Elastic
        In any order.

    Returns
    -------
    float
        E* [Pa]: 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2 (Johnson, Contact Mechanics, 1985, eq. 4.8).

    Examples
    --------
    >>> round(bem.contact_modulus(bem.STEEL, bem.STEEL) / 1e9, 2)  # [GPa]
    115.38
    """
    return 1 / (1 / first.plane_modulus + 1 / second.plane_modulus)


@dataclass(frozen=True)
class Pair:
    """Combined elastic constants of two bodies: shear G [Pa], poisson nu, coupling K (0 for like materials)."""

    shear: float
    poisson: float
    coupling: float

    @classmethod
    def of(cls, first: Elastic, second: Elastic) -> Pair:
        """first: body 1 (above), second: body 2 (below)."""
        for body in (first, second):
            if not isinstance(body, Elastic):
                raise TypeError(f"a body in contact is an Elastic, not {type(body).__name__}")
        shear = 2 / (1 / first.shear + 1 / second.shear)
        poisson = shear / 2 * (first.poisson / first.shear + second.poisson / second.shear)
        coupling = shear / 4 * ((1 - 2 * first.poisson) / first.shear - (1 - 2 * second.poisson) / second.shear)
        return cls(shear, poisson, coupling)

    @property
    def modulus(self) -> float:
        """Contact modulus E* = G / (1 - nu) [Pa]."""
        return self.shear / (1 - self.poisson)


def first_loading(law, strain: np.ndarray) -> np.ndarray:
    """Stress [Pa] of a first loading from rest of a law with these constants at an equivalent plastic strain, in one
    direction throughout: Y(p) + sum of min(C / gamma, C (1 - exp(-mu gamma p)) / (mu gamma))."""
    strain = np.asarray(strain, float)
    back = np.zeros(strain.shape)
    for c, gamma, mu in zip(law.modulus, law.recovery, law.mixing, strict=True):
        free = c * strain if mu * gamma == 0 else -c / (mu * gamma) * np.expm1(-mu * gamma * strain)
        back = back + (free if gamma == 0 else np.minimum(free, c / gamma))
    return law.yield_stress - law.hardening * np.expm1(-law.hardening_rate * strain) + back


def refuse_yield_curve(strain: np.ndarray, stress: np.ndarray) -> None:
    """Raise MaterialError where yield stresses [Pa] over equivalent plastic strains are no hardening steel's curve."""
    if strain.ndim != 1 or strain.shape != stress.shape or not strain.size:
        raise MaterialError(f"yield curve: {strain.shape} strains, {stress.shape} stresses: give two equal lists")
    if not (np.isfinite(strain).all() and np.isfinite(stress).all()):
        raise MaterialError("yield curve: holds a value that is not finite")
    if strain[0] != 0 or (np.diff(strain) <= 0).any():
        raise MaterialError("yield curve: plastic strains must start at 0 and increase strictly")
    if stress[0] <= 0:
        raise MaterialError(f"yield curve: first yield stress {stress[0]:g} Pa, must be positive")
    if (np.diff(stress) < 0).any():
        k = int(np.argmin(np.diff(stress)))
        raise MaterialError(
            f"yield curve: falls from {stress[k] / 1e6:g} to {stress[k + 1] / 1e6:g} MPa behind a plastic strain "
            f"of {strain[k]:g}: softening localises in one cell and has no answer independent of the cells; give a "
            "curve that never falls"
        )


def back_stress_constants(
    yield_stress: float,
    modulus: np.ndarray,
    recovery: np.ndarray,
    mixing: np.ndarray | float,
    hardening: float,
    hardening_rate: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Modulus, recovery and mixing, each (m,), m 0 or more. Errors: MaterialError that names the constant, its value
    and its limit."""
    modulus, recovery, given = (np.atleast_1d(np.array(v, float)) for v in (modulus, recovery, mixing))
    if modulus.ndim != 1 or modulus.shape != recovery.shape:
        raise MaterialError(
            f"back stresses: {modulus.size} moduli and {recovery.size} recoveries: give as many of each"
        )
    if given.shape not in ((1,), modulus.shape):
        raise MaterialError(f"{modulus.size} back stresses and {given.size} mixings: give one, or one for each")
    mixing = np.broadcast_to(given, modulus.shape).copy()
    refuse_outside("yield_stress", yield_stress, 0, np.inf)
    refuse_outside("hardening", hardening, -yield_stress, np.inf)
    refuse_outside("hardening_rate", hardening_rate, 0, np.inf, closed=True)
    for k in range(modulus.size):
        refuse_outside(f"modulus {k + 1}", modulus[k], 0, np.inf)
        refuse_outside(f"recovery {k + 1}", recovery[k], 0, np.inf, closed=True)
        refuse_outside(f"mixing {k + 1}", mixing[k], 0, 1, closed=True)
    return modulus, recovery, mixing


def refuse_outside(name: str, value: float, low: float, high: float, closed: bool = False) -> None:
    """Raise MaterialError for a constant that is not finite or not between its limits, which count where closed."""
    if np.isfinite(value) and (low <= value <= high if closed else low < value < high):
        return
    brackets = "[]" if closed else "()"
    raise MaterialError(f"{name} is {float(value)!r}, must lie in {brackets[0]}{low:g}, {high:g}{brackets[1]}")
