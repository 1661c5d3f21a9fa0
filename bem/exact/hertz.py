"""Hertz contact in closed form: line, circle and ellipse. Stresses below: bem/exact/subsurface.py.

Everything SI. `modulus` is the contact modulus E* of bem.material.contact_modulus, so unlike materials are included.
Relative curvature is positive when the gap opens away from the contact: a concave body has a negative curvature.
Source: K. L. Johnson, Contact Mechanics (1985), section 4.2; K, E and their combinations in Carlson's forms,
which lose no digits as the ellipse becomes a circle or a line.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.special import elliprd, elliprf

from bem.checks import refuse_unless_positive
from bem.renamed import renamed


class HertzError(ValueError):
    """Input for which Hertz' theory has no contact to give."""


@dataclass(frozen=True)
class LineContact:
    """Hertz line contact: pressure max_pressure * sqrt(1 - (x/half_width)^2).

    force [N/m] per unit length, half_width [m], max_pressure [Pa], radius [m] relative, modulus E* [Pa].
    """

    force: float
    half_width: float
    max_pressure: float
    radius: float
    modulus: float

    def pressure(self, x: np.ndarray) -> np.ndarray:
        """Pressure [Pa] at distance x [m] from the middle."""
        return self.max_pressure * np.sqrt(np.clip(1 - (np.asarray(x) / self.half_width) ** 2, 0, None))


@dataclass(frozen=True)
class PointContact:
    """Hertz point contact over an ellipse: pressure max_pressure * sqrt(1 - (x/semi_x)^2 - (y/semi_y)^2).

    force [N], semi_x, semi_y [m], max_pressure [Pa], approach [m] of distant points, modulus E* [Pa].
    """

    force: float
    semi_x: float
    semi_y: float
    max_pressure: float
    approach: float
    modulus: float

    def pressure(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Pressure [Pa] at (x, y) [m]."""
        inside = 1 - (np.asarray(x) / self.semi_x) ** 2 - (np.asarray(y) / self.semi_y) ** 2
        return self.max_pressure * np.sqrt(np.clip(inside, 0, None))

    @property
    def area(self) -> float:
        """Contact area [m^2]."""
        return np.pi * self.semi_x * self.semi_y


@renamed(force="load")
def line_contact(load: float, radius: float, modulus: float) -> LineContact:
    """Hertz line contact.

    Parameters
    ----------
    load : float
        Per length [N/m].
    radius : float
        Relative [m].
    modulus : float
        E* [Pa] of `contact_modulus`.

    Returns
    -------
    LineContact
        Half-width and pressure (Johnson eq. 4.43 to 4.45).

    Raises
    ------
    HertzError
        For what is not positive.

    Examples
    --------
    >>> float(round(bem.line_contact(1e6, 0.3, 115e9).half_width * 1e3, 3))  # [mm]
    1.822
    """
    refuse_unless_positive(HertzError, load=load, radius=radius, modulus=modulus)
    half_width = np.sqrt(4 * load * radius / (np.pi * modulus))
    return LineContact(load, half_width, 2 * load / (np.pi * half_width), radius, modulus)


def line_contact_of_width(half_width: float, radius: float, modulus: float) -> LineContact:
    """Line contact from its half-width [m]: force = pi E* a^2 / (4 R)."""
    refuse_unless_positive(HertzError, half_width=half_width, radius=radius, modulus=modulus)
    return line_contact(np.pi * modulus * half_width**2 / (4 * radius), radius, modulus)


def _ellipse_integrals(ratio: float) -> tuple[float, float, float]:
    """K, D = (K - E)/e^2 and B = K - D of an ellipse with semi-axes ratio = minor/major, e^2 = 1 - ratio^2."""
    k = float(elliprf(0, ratio**2, 1))
    d = float(elliprd(0, ratio**2, 1)) / 3
    return k, d, k - d


def _axis_ratio(radius_ratio: float) -> float:
    """minor/major semi-axis of the ellipse whose relative radii are in the ratio small/large = radius_ratio <= 1."""
    if radius_ratio > 1 - 1e-14:
        return 1.0

    def mismatch(log_ratio: float) -> float:
        ratio = np.exp(log_ratio)
        _, d, b = _ellipse_integrals(ratio)
        return np.log(ratio**2 * d / b) - np.log(radius_ratio)

    return float(np.exp(brentq(mismatch, np.log(radius_ratio) - 1, 0.0, xtol=1e-15, rtol=1e-15)))


@renamed(force="load")
def point_contact(load: float, radius_x: float, radius_y: float, modulus: float) -> PointContact:
    """Hertz point contact over an ellipse.

    Parameters
    ----------
    load : float
        [N]
    radius_x, radius_y : float
        Relative, in the planes xz and yz [m].
    modulus : float
        E* [Pa] of `contact_modulus`.

    Returns
    -------
    PointContact
        Semi-axes, pressure, approach. Error: round-off (tests/bem/test_hertz.py).
        Source: Johnson (1985), eq. 4.26 and 4.28, solved exactly.

    Raises
    ------
    HertzError
        For what is not positive, or gives no patch.

    Examples
    --------
    >>> round(bem.point_contact(100e3, 0.46, 0.3, 115.4e9).max_pressure / 1e6)  # [MPa]
    1238
    """
    refuse_unless_positive(HertzError, load=load, radius_x=radius_x, radius_y=radius_y, modulus=modulus)
    large, small = max(radius_x, radius_y), min(radius_x, radius_y)
    if small / large < 1e-12:
        raise HertzError(f"radii {radius_x}, {radius_y} m: ratio below 1e-12, use line_contact")
    ratio = _axis_ratio(small / large)
    k, d, _ = _ellipse_integrals(ratio)
    major = (3 * load * d * large / (np.pi * modulus)) ** (1 / 3)
    minor = ratio * major
    if not 0 < major * minor < np.inf:
        raise HertzError(f"load {load} N on radii {radius_x}, {radius_y} m: a patch of {major} by {minor} m is none")
    pressure = 3 * load / (2 * np.pi * major * minor)
    semi_x, semi_y = (major, minor) if radius_x >= radius_y else (minor, major)
    return PointContact(load, semi_x, semi_y, pressure, pressure * minor * k / modulus, modulus)


def point_contact_of_approach(approach: float, radius_x: float, radius_y: float, modulus: float) -> PointContact:
    """Point contact from the approach of distant points [m]; force grows as approach^1.5."""
    refuse_unless_positive(HertzError, approach=approach, radius_x=radius_x, radius_y=radius_y, modulus=modulus)
    unit = point_contact(1.0, radius_x, radius_y, modulus)
    return point_contact((approach / unit.approach) ** 1.5, radius_x, radius_y, modulus)


def contact_stiffness(radius_x: float, radius_y: float, modulus: float) -> float:
    """K [N/m^1.5] in force = K * approach^1.5."""
    return point_contact_of_approach(1.0, radius_x, radius_y, modulus).force


def tangent_stiffness(constant: float, force: float) -> float:
    """dF/dd [N/m] of F = constant d^1.5 at a force [N]; constant [N/m^1.5] of `contact_stiffness`."""
    return 1.5 * constant ** (2 / 3) * force ** (1 / 3)
