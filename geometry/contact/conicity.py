"""Rolling radius difference, contact angles and positions against lateral shift, and the equivalent conicity of EN
15302.

A free wheelset follows y'' + Dr(y) / (e r0) = 0 along the track (Klingel), e the distance of the rolling circles, r0
the radius, Dr the rolling radius difference. A pair of cones has Dr = 2 y tan(gamma) and the wavelength L = 2 pi sqrt(e
r0 / (2 tan gamma)); the equivalent conicity of any pair is that of the cones with the same wavelength: tan(gamma) = 2 e
r0 (pi / L)^2.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from geometry.contact.prismatic_search import ContactSearch
from geometry.wheelset import SIDES, WheelsetError, check_range

ROLLING_CIRCLES = 1.500  # distance of the rolling circles, EN 15302 [m]
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)


@dataclass(frozen=True)
class ShiftCurves:
    """What rolls on what at lateral shifts (n,) [m]; arrays (2, n) for left and right.

    roll : (n,) [rad];  height : (n,)  of the axle [m]
    rolling_radius, angle, station (on the wheel from its tread datum), rail_station : (2, n)  [m, rad]
    """

    shift: np.ndarray
    roll: np.ndarray
    height: np.ndarray
    rolling_radius: np.ndarray
    angle: np.ndarray
    station: np.ndarray
    rail_station: np.ndarray

    @property
    def radius_difference(self) -> np.ndarray:
        """(n,)  left less right rolling radius [m]."""
        return self.rolling_radius[0] - self.rolling_radius[1]

    @property
    def angle_difference(self) -> np.ndarray:
        """(n,)  left less right contact angle [rad]."""
        return self.angle[0] - self.angle[1]

    def jumps(self) -> np.ndarray:
        """(k,)  shifts [m], in the middle of a step, at which a contact moves by more than 2 mm on a wheel."""
        moved = np.abs(np.diff(self.station, axis=1)).max(axis=0) > 2e-3
        return ((self.shift[1:] + self.shift[:-1]) / 2)[moved]


def shift_curves(search: ContactSearch, shift: np.ndarray) -> ShiftCurves:
    """Curves of a wheelset that touches with both wheels at each shift (n,) [m], + to the left, held at the level of
    the rails."""
    shift = np.asarray(shift, float)
    states = [search.settle(y) for y in shift]
    points = [[search.contacts(state, side).lowest() for state in states] for side in SIDES]
    of_points = ("rolling_radius", "angle", "station", "rail_station")
    found = [np.array([[getattr(p, name)[0] for p in row] for row in points]) for name in of_points]
    return ShiftCurves(shift, np.array([s.roll for s in states]), np.array([s.z for s in states]), *found)


def wavelength(
    shift: np.ndarray, difference: np.ndarray, amplitude: float, radius: float, base: float = ROLLING_CIRCLES
) -> float:
    """Wavelength [m] of Klingel's motion in a tabulated rolling radius difference.

    shift, difference : (n,)  lateral shifts and left less right rolling radius there [m];
    amplitude : half the swing [m]
    radius : mean rolling radius;  base : distance of the rolling circles [m]

    The curve is taken as monotone cubic between its points. Error: 1e-6 relative on cones and on y + y^3, second order
    in the table's spacing elsewhere (tests/geometry/test_conicity.py). Raises WheelsetError where the wheelset is not
    driven back.
    """
    check_range(
        "wavelength", (("amplitude", amplitude, 1e-5, 0.05), ("radius", radius, 0.1, 1.0), ("base", base, 0.5, 2.0))
    )
    if np.size(shift) < 2 or not (np.diff(shift) > 0).all():
        raise WheelsetError("wavelength: the shifts must rise, at least two of them")
    curve = PchipInterpolator(shift, difference)
    middle = _middle(shift, curve)
    energy = curve.antiderivative()
    low = _left_end(shift, energy, middle, amplitude)
    top = energy(low)
    # 2 y'^2 = (E - W(y)) 4 / (e r0); y = c + A sin t takes the roots at both ends out of the integrand
    edges = np.linspace(-np.pi / 2, np.pi / 2, 17)
    t = (edges[:-1, None] + edges[1:, None]) / 2 + np.diff(edges)[:, None] / 2 * _NODES
    weight = np.diff(edges)[:, None] / 2 * _WEIGHTS
    speed = 2 / (base * radius) * (top - energy(low + amplitude + amplitude * np.sin(t)))
    if (speed <= 0).any():
        raise WheelsetError(
            f"amplitude {amplitude:g} m: the rolling radius difference does not drive the wheelset back everywhere"
        )
    return float(2 * (weight * amplitude * np.cos(t) / np.sqrt(speed)).sum())


def equivalent_conicity(
    curves: ShiftCurves, amplitude: float = 3e-3, radius: float | None = None, base: float = ROLLING_CIRCLES
) -> float:
    """tan(gamma) of EN 15302 at an amplitude, by integrating the wave. Exact for cones, whose rolling radius difference
    is 2 y tan(gamma).

    Parameters
    ----------
    curves : ShiftCurves
        Rolling radii over the lateral shift (geometry.contact.conicity.shift_curves).
    amplitude : float
        [m]; 3 mm is the one that approvals quote.
    radius : float, optional
        Of the wheels [m]; None: that of the curves.
    base : float
        Distance of the contact points [m].

    Returns
    -------
    float
        [1]

    Raises
    ------
    WheelsetError
        For shifts that do not rise, and where the wheelset is not driven back.

    Examples
    --------
    >>> from rail_fem.geometry.contact.conicity import shift_curves
    >>> wheel, rail = geometry.wheel_profile("S1002"), geometry.rail_head("60E1", inclination=1 / 40)
    >>> search = geometry.ContactSearch(geometry.Wheelset(wheel, radius=0.46), geometry.Track(rail))
    >>> 0.1 < geometry.equivalent_conicity(shift_curves(search, np.linspace(-5e-3, 5e-3, 41))) < 0.3
    True
    """
    at_rest = float(np.mean(curves.rolling_radius[:, np.argmin(np.abs(curves.shift))])) if radius is None else radius
    length = wavelength(curves.shift, curves.radius_difference, amplitude, at_rest, base)
    return 2 * base * at_rest * (np.pi / length) ** 2


def _middle(shift: np.ndarray, curve: PchipInterpolator) -> float:
    """Shift at which the wheelset runs straight: the rising zero of the radius difference nearest to the middle."""
    zeros = [z for z in curve.roots(extrapolate=False) if np.isfinite(z)]
    if not zeros:
        raise WheelsetError(
            f"the rolling radius difference has no zero within {shift[0]:g} to {shift[-1]:g} m: extend the shifts"
        )
    rising = [z for z in zeros if curve(z, 1) >= 0]
    if not rising:
        raise WheelsetError(
            f"the rolling radius difference only falls through zero, at {min(zeros, key=abs):g} m: the wheelset is not"
            " driven back"
        )
    return float(min(rising, key=abs))


def _left_end(shift: np.ndarray, energy, middle: float, amplitude: float) -> float:
    """Left end of a swing of 2 amplitude with equal energy at both ends."""
    imbalance = lambda left: float(energy(left + 2 * amplitude) - energy(left))
    low, high = max(shift[0], middle - 2 * amplitude), min(middle, shift[-1] - 2 * amplitude)
    if low >= high or imbalance(low) * imbalance(high) > 0:
        raise WheelsetError(
            f"amplitude {amplitude:g} m about {middle:g} m leaves the shifts {shift[0]:g} to {shift[-1]:g} m or is not"
            " driven back: extend them"
        )
    return brentq(imbalance, low, high, xtol=1e-15, rtol=1e-14)
