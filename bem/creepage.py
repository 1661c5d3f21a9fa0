"""Creepage: three numbers for a plane patch, three for each strip of a curved one.

Where the bodies conform, a patch bends around a rounding and each strip along x has a normal n of its own. A rigid
motion of body 1 over body 2, velocity v at the origin and rotation w per rolling speed, then slips by

    longitudinal(y) = v_x + w_y z - w_z y',   lateral(y) = v.t + w_x (y' t_z - z t_y),   spin(y) = w.n

at x = 0, (y', z) the strip's place in the section, t = (n_z, -n_y) its tangent; along x the lateral slip grows by
spin(y) x. Along the developed coordinate d longitudinal / dy = -spin: on a flat patch these are the three numbers of
Creepage. A wheel of rolling radius r turns with w_y = 1/r, so spin is the sine of the local angle over r.
Source: Vollebregt and Segal, Vehicle System Dynamics 52 suppl. 1 (2014) 455 (not opened; its example in the program
CONTACT is, tests/bem/test_conformal_rolling.py).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from bem.checks import ContactInputError


@dataclass(frozen=True)
class Creepage:
    """Rigid slip of the upper body over the lower one divided by the rolling speed.

    The rigid slip at (x, y) is (longitudinal - spin * y, lateral + spin * x). In a shift the same three numbers are
    displacements [m] and a rotation [1].

    Parameters
    ----------
    longitudinal, lateral : float
        [1]
    spin : float
        [1/m]

    Examples
    --------
    >>> creepage = bem.Creepage(longitudinal=1e-3, spin=0.5)
    >>> [float(v) for v in creepage.rigid_slip(np.float64(0.0), np.float64(2e-3))]
    [0.0, 0.0]
    """

    longitudinal: float = 0.0
    lateral: float = 0.0
    spin: float = 0.0

    def rigid_slip(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """(2, ...) at x, y (...)."""
        return np.stack([self.longitudinal - self.spin * y, self.lateral + self.spin * x])

    def about(self, y: float) -> Creepage:
        """As of LocalCreepage: that of a strip; all strips of a plane patch have the same."""
        return self

    def added(self, longitudinal: float, lateral: float) -> Creepage:
        """With a uniform slip more."""
        return Creepage(self.longitudinal + longitudinal, self.lateral + lateral, self.spin)


@dataclass(frozen=True, eq=False)
class LocalCreepage:
    """Creepage of strips at y (m,) [m], rising: longitudinal, lateral (m,) [1], spin (m,) [1/m]; cubic in between.

    The rigid slip at (x, y) is (longitudinal(y), lateral(y) + spin(y) x).
    Raises ContactInputError for fewer than two strips, positions that do not rise, numbers that are not finite.
    """

    y: np.ndarray
    longitudinal: np.ndarray
    lateral: np.ndarray
    spin: np.ndarray

    def __post_init__(self) -> None:
        rows = [np.asarray(getattr(self, name), float) for name in ("y", "longitudinal", "lateral", "spin")]
        if len({row.shape for row in rows}) != 1 or rows[0].ndim != 1 or len(rows[0]) < 2:
            raise ContactInputError(
                f"local creepage: rows of {[row.shape for row in rows]}: give four of one length >= 2"
            )
        if not all(np.isfinite(row).all() for row in rows):
            raise ContactInputError("local creepage: every number must be finite")
        if not (np.diff(rows[0]) > 0).all():
            raise ContactInputError("local creepage: positions of the strips must rise")

    @cached_property
    def _rows(self) -> BSpline:
        rows = np.stack([self.longitudinal, self.lateral, self.spin], axis=1)
        return make_interp_spline(self.y, rows, k=min(3, len(self.y) - 1))

    def strips(self, y: np.ndarray) -> np.ndarray:
        """(n, 3) longitudinal, lateral, spin of strips at y (n,)."""
        return self._rows(np.asarray(y, float))

    def rigid_slip(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """(2, ...) at x, y (...) [1]."""
        longitudinal, lateral, spin = np.moveaxis(self.strips(y), -1, 0)
        return np.stack([longitudinal, lateral + spin * x])

    def about(self, y: float) -> Creepage:
        """That of the strip at y as one creepage about x = y = 0."""
        longitudinal, lateral, spin = map(float, self.strips(np.array(y)))
        return Creepage(longitudinal + spin * y, lateral, spin)

    def added(self, longitudinal: float, lateral: float) -> LocalCreepage:
        """With a uniform slip more."""
        return LocalCreepage(
            self.y, np.asarray(self.longitudinal) + longitudinal, np.asarray(self.lateral) + lateral, self.spin
        )
