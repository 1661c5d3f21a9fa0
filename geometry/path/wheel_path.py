"""Path of a rigid wheel over a crossing: axle height, contact points on wing and nose, transfer. Axes: geometry.axes.

The wheel is a body of revolution that rolls straight on at a fixed lateral position. Its axle stands as high as the
highest of all points where it would touch: H(x) = max over (x', y) of z_rail(x', y) + sqrt(r(y)^2 - (x' - x)^2), so
that contact ahead of or behind the axle is found as it is. Facing and trailing differ in the direction of travel only.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from geometry.axes import tread_datum_y
from geometry.path.path_search import BodySearch
from geometry.profiles.profile import Profile
from geometry.surfaces.crossing import CrossingError

if TYPE_CHECKING:
    from geometry.surfaces.any_crossing import AnyCrossing

RESOLUTION, REACH = 0.25e-3, 0.1  # lateral spacing of the first search, and how far ahead and behind it looks [m]
LARGEST_FALL = 15e-3  # of the axle below or above plain line, beyond which the wheel has left its rail [m]


@dataclass(frozen=True)
class WheelPath:
    """What a rigid wheel does over a crossing; arrays over the n axle positions x [m].

    height : (n,)  axle height relative to plain line [m]
    slope : (n,)  d height / dx, exact (from the contact point's position ahead of the axle) [1]
    wing_point, nose_point : (n, 3)  nearest point of wing and nose, where they touch or would touch first [m]
    wing_gap, nose_gap : (n,)  height by which that body is clear of the wheel [m]; 0 where it carries; NaN: out of
        reach
    on_nose : (n,)  True where the nose carries
    transfers : (k,)  x where wing and nose carry at once, in order of x [m]
    """

    x: np.ndarray
    height: np.ndarray
    slope: np.ndarray
    wing_point: np.ndarray
    nose_point: np.ndarray
    wing_gap: np.ndarray
    nose_gap: np.ndarray
    transfers: np.ndarray
    radius: float
    wheel: str
    on_nose: np.ndarray = field(init=False)

    def __post_init__(self):
        object.__setattr__(self, "on_nose", self.nose_gap == 0.0)

    @property
    def contact_point(self) -> np.ndarray:
        """(n, 3)  the point that carries."""
        return np.where(self.on_nose[:, None], self.nose_point, self.wing_point)


def wheel_path(
    wheel: Profile,
    crossing: AnyCrossing,
    x: np.ndarray,
    radius: float = 0.425,
    lateral_shift: float = 0.0,
    resolution: float = RESOLUTION,
    reach: float = REACH,
    within: float = np.inf,
) -> WheelPath:
    """Path of the rigid wheel.

    Parameters
    ----------
    wheel : Profile
        In its own axes, datum at (0, 0).
    crossing : CastCrossing, RailSurface or another that geometry.surfaces.any_crossing names
        With its heights.
    x : (n,) array
        Axle positions [m], in any order.
    radius : float
        Of the wheel at its tread datum [m].
    lateral_shift : float
        Of the wheelset, + towards the field side [m].
    resolution : float
        Lateral spacing of the first search [m]; the points found are then refined on the exact surface.
    reach : float
        How far ahead of and behind the axle contact is looked for [m].
    within : float
        How far below the one that carries a body is looked at [m]; further down it is out of reach.

    Returns
    -------
    WheelPath
        Height, points on wing and nose, transfers. Error: 1e-9 m in height on planes, ramps and crowns with exact
        answers; the first search alone is second order in its resolution (tests/geometry/test_path.py).

    Raises
    ------
    CrossingError
        Where x +- reach leaves the modelled crossing, or the wheel stands over neither body.

    Examples
    --------
    >>> path = geometry.wheel_path(geometry.wheel_profile("P8"), geometry.CastCrossing(), np.linspace(0.2, 0.5, 31))
    >>> bool(path.on_nose[0]), bool(path.on_nose[-1])
    (False, True)
    """
    if isinstance(crossing, Profile):
        warnings.warn(
            "wheel_path takes the wheel before the crossing now; the old order goes with the next release",
            DeprecationWarning,
            stacklevel=2,
        )
        wheel, crossing = crossing, wheel
    x = np.atleast_1d(np.asarray(x, float))
    check_inputs(crossing, x, radius, resolution, reach)
    datum = tread_datum_y() + lateral_shift
    find = lambda body, at: BodySearch(crossing, wheel, body, at, radius, datum, resolution, reach)
    wing, nose = find("wing", x), find("nose", x)
    near = bodies_within(wing.first_search(x), nose.first_search(x), within)
    wing_height, wing_point = contacts_at(wing, x, near[0])
    nose_height, nose_point = contacts_at(nose, x, near[1])
    best = np.fmax(wing_height, nose_height)
    if np.isnan(best).any():
        raise CrossingError(
            f"the wheel stands over neither wing nor nose at x = {x[np.isnan(best)][0]:g} m, shift {lateral_shift:g} m"
        )
    carrier = np.where((nose_height == best)[:, None], nose_point, wing_point)
    ahead = carrier[:, 0] - x
    rolling = rolling_radius(wheel, radius, carrier[:, 1] - datum)
    plain_x = np.array([crossing.plain_x])
    plain, _ = find("wing", plain_x).contacts(plain_x)
    check_height(x, best - plain[0], lateral_shift)
    return WheelPath(
        x=x,
        height=best - plain[0],
        slope=ahead / np.sqrt(rolling**2 - ahead**2),
        wing_point=wing_point,
        nose_point=nose_point,
        wing_gap=best - wing_height,
        nose_gap=best - nose_height,
        transfers=transfer_positions(x, wing, nose, wing_height, nose_height),
        radius=radius,
        wheel=wheel.label,
    )


def other_contacts(
    crossing: AnyCrossing, wheel: Profile, path: WheelPath, body: str, within: float, lateral_shift: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Where else the wheel of a path comes as near to a body as `within` [m], path_search.APART across from its
    nearest point: gap (n,) as of WheelPath, and point (n, 3) [m]; NaN where nowhere."""
    nearest, gap = (path.wing_point, path.wing_gap) if body == "wing" else (path.nose_point, path.nose_gap)
    datum = tread_datum_y() + lateral_shift
    search = BodySearch(crossing, wheel, body, path.x, path.radius, datum, RESOLUTION, REACH)
    rolling, ahead = rolling_radius(wheel, path.radius, nearest[:, 1] - datum), nearest[:, 0] - path.x
    top = nearest[:, 2] + np.sqrt(rolling**2 - ahead**2) - path.radius
    near = search.first_search(path.x, nearest[:, 1]) > top + gap - within
    height, point = np.full(len(path.x), np.nan), np.full((len(path.x), 3), np.nan)
    height[near], point[near] = search.contacts(path.x[near], nearest[near, 1])
    return gap + top - height, point


def bodies_within(wing: np.ndarray, nose: np.ndarray, within: float) -> tuple[np.ndarray, np.ndarray]:
    """Where (n,) each body stands at most `within` [m] below the higher one, by heights (n,) [m]."""
    lowest = np.fmax(wing, nose) - within
    return wing >= lowest, nose >= lowest


def contacts_at(search: BodySearch, x: np.ndarray, near: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """As BodySearch.contacts where near (n,), NaN elsewhere."""
    height, point = np.full(len(x), np.nan), np.full((len(x), 3), np.nan)
    height[near], point[near] = search.contacts(x[near])
    return height, point


def rolling_radius(wheel: Profile, radius: float, y: np.ndarray) -> np.ndarray:
    """Radius (n,) of the wheel at distances y from its tread datum [m]."""
    return radius - wheel.height(y)


def transfer_positions(
    x: np.ndarray, wing: BodySearch, nose: BodySearch, wing_height: np.ndarray, nose_height: np.ndarray
) -> np.ndarray:
    """x (k,) where wing and nose carry at once: sign changes of their difference, closed in by bisection to 1e-7 m."""
    order = np.argsort(x)
    x, difference = x[order], (wing_height - nose_height)[order]
    positions = []
    for i in np.flatnonzero(np.diff(np.sign(difference)) != 0):
        low, high, sign = x[i], x[i + 1], np.sign(difference[i])
        if not np.isfinite(difference[i] + difference[i + 1]):
            continue
        while abs(high - low) > 1e-7:
            middle = np.array([(low + high) / 2])
            gap = wing.contacts(middle)[0][0] - nose.contacts(middle)[0][0]
            low, high = (middle[0], high) if np.sign(gap) == sign else (low, middle[0])
        positions.append((low + high) / 2)
    return np.array(sorted(positions))


def check_height(x: np.ndarray, height: np.ndarray, lateral_shift: float) -> None:
    """A wheel whose axle leaves plain line's height by more than any crossing has derailed. Errors: CrossingError."""
    worst = int(np.argmax(np.abs(height)))
    if np.isnan(height[worst]) or abs(height[worst]) > LARGEST_FALL:
        first = int(np.argmax(~(np.abs(height) <= LARGEST_FALL)))
        does = "falls into the flangeway" if height[first] < 0 else "climbs with its flange"
        raise CrossingError(
            f"the wheel derails: at x = {x[first]:g} m its axle lies {1e3 * height[first]:+.1f} mm from plain line's"
            f" height (at most {1e3 * LARGEST_FALL:g}), it {does}; lateral shift {1e3 * lateral_shift:g} mm"
        )


def check_inputs(crossing: AnyCrossing, x: np.ndarray, radius: float, resolution: float, reach: float) -> None:
    low, high = crossing.x_range
    if not (np.isfinite(x).all() and x.size and x.ndim == 1):
        raise CrossingError("wheel_path: x must hold at least one finite axle position, as (n,)")
    if x.min() - reach < low or x.max() + reach > high:
        raise CrossingError(
            f"wheel_path: x {x.min():g} to {x.max():g} m with reach {reach:g} m leaves the modelled crossing, {low:g}"
            f" to {high:.3f} m: keep x within {low + reach:g} to {high - reach:.3f} m"
        )
    limits = (
        ("radius", radius, 0.1, 1.0),
        ("resolution", resolution, 1e-6, 5e-3),
        ("reach", reach, 0.01, 0.9 * radius),
    )
    for name, value, least, most in limits:
        if not least <= value <= most:
            raise CrossingError(f"wheel_path: {name} = {value:g} m is outside [{least:g}, {most:g}] m")
