"""Closed forms of friction in Hertz contact: Cattaneo and Mindlin's partial slip, Carter's rolling, Spence's loading.

Source: Johnson, Contact Mechanics (1985), sections 5.4, 7.2 and 8.3.
"""

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipkm1, expit

from bem.checks import refuse_unless_finite, refuse_unless_positive
from bem.exact.hertz import HertzError
from bem.material import Elastic


def cattaneo_line_stick(tangential: float, limit: float) -> float:
    """Stick width over contact width of a line contact under Q after P; limit is mu P (eq. 7.26)."""
    refuse_unless_positive(HertzError, limit=limit)
    refuse_unless_finite(HertzError, tangential=tangential)
    if abs(tangential) > limit:
        raise HertzError(
            f"tangential load {tangential:g} exceeds friction times normal load {limit:g}: the contact slides"
        )
    return float(np.sqrt(1 - abs(tangential) / limit))


def cattaneo_line_shear(x: np.ndarray, half_width: float, max_traction: float, stick: float) -> np.ndarray:
    """Shear traction [Pa] of a line contact in partial slip; max_traction is mu p0, stick the stick ratio (eq.
    7.27)."""
    refuse_unless_positive(HertzError, half_width=half_width)
    outer = np.sqrt(np.clip(1 - (np.asarray(x) / half_width) ** 2, 0, None))
    inner = np.sqrt(np.clip(stick**2 - (np.asarray(x) / half_width) ** 2, 0, None))
    return max_traction * (outer - inner)


def carter_creepage(force_share: float, half_width: float, radius: float, friction: float) -> float:
    """Creepage of tractive rolling of like materials from Q / (mu P); stick width over contact width is sqrt(1 - share)
    (eq. 8.36)."""
    refuse_unless_positive(HertzError, half_width=half_width, radius=radius, friction=friction)
    if not abs(force_share) <= 1:
        raise HertzError(f"Q / (mu P) = {force_share:g}: beyond 1 the contact slides")
    return float(-np.sign(force_share) * friction * half_width / radius * (1 - np.sqrt(1 - abs(force_share))))


def dundurs_beta(first: Elastic, second: Elastic) -> float:
    """Dundurs' second constant in plane strain, positive when the first body is the more compressible."""
    numerator = (1 - 2 * first.poisson) / first.shear - (1 - 2 * second.poisson) / second.shear
    return 0.5 * numerator / ((1 - first.poisson) / first.shear + (1 - second.poisson) / second.shear)


def spence_line_stick(beta: float, friction: float) -> float:
    """Stick width over contact width of a line contact loaded without tangential force: K'(c)/K(c) = |beta| / mu (eq.
    5.33).

    The pressure is taken as unchanged by friction (Goodman): error of order beta^2.
    """
    refuse_unless_finite(HertzError, beta=beta)
    if not (beta and friction > 0):
        raise HertzError(
            f"beta {beta:g}, friction {friction:g}: without mismatch nothing slips, without friction nothing sticks"
        )
    wanted = np.log(abs(beta) / friction)

    def mismatch(log_odds: float) -> float:
        return np.log(ellipkm1(expit(log_odds)) / ellipkm1(expit(-log_odds))) - wanted  # expit(log_odds) = (c/a)^2

    if abs(wanted) > 5:  # c/a within 1e-100 of a limit
        return 0.0 if wanted > 0 else 1.0
    return float(np.sqrt(expit(brentq(mismatch, -700, 700))))
