"""Flange back against check rail or wing: how far it is, and the wheelset's shift limited by it as by a rigid stop
(thesis section 3.4).

A check rail fills everything on the track's side of its face and below its top. Of a wheel circle of radius r, its
centre at height h over that top, the points below the top span the angles with cos(theta) >= h / (r cos(roll)); yawed,
the circle reaches farthest towards the check rail where it dips under its top, ahead of or behind the axle.
"""

import numpy as np
from scipy.optimize import minimize_scalar

from geometry.wheelset import SIDES, CheckRail, Wheelset, WheelsetError

CLOSE = 1e-12


def reach_of_circles(stations: np.ndarray, radius: np.ndarray, state: Wheelset, side: str, top: float) -> np.ndarray:
    """Least y (n,) in side axes [m] of the wheel circles at stations (n,) of radius (n,) below the level `top`; inf
    where none is."""
    sign = SIDES[side]
    sine_yaw, cosine_yaw = np.sin(sign * state.yaw), np.cos(state.yaw)
    sine_roll, cosine_roll = np.sin(sign * state.roll), np.cos(state.roll)
    along = state.datum_arm + stations
    # cosine of the angle at which the circle passes the top
    share = (state.z + along * sine_roll - top) / (radius * cosine_roll)
    with np.errstate(invalid="ignore"):
        ahead = np.sqrt(1 - share**2)
    position = sign * state.y + along * cosine_roll * cosine_yaw
    # y = position + radius (sin theta sin yaw + cos theta sin roll cos yaw): least at the top's level, unless its own
    # least lies lower
    own = np.arctan2(abs(sine_yaw), sine_roll * cosine_yaw) + np.pi
    lowest = np.where(
        np.cos(own) > share,
        np.hypot(sine_yaw, sine_roll * cosine_yaw) * -1.0,
        share * sine_roll * cosine_yaw - ahead * abs(sine_yaw),
    )
    return np.where(share <= 1, position + radius * lowest, np.inf)


def back_gap(state: Wheelset, side: str, check: CheckRail, face: float) -> float:
    """Horizontal distance [m] from the flange back to a check rail whose face lies at `face` in side axes; negative: it
    is passed.

    +inf where the whole flange is above the check rail. Error: 1e-9 m (tests/geometry/test_flange_back.py).
    """
    profile = state.profile(side)
    y, z = profile.points.T
    back = y[: int(np.argmin(z)) + 1]
    of = lambda s: reach_of_circles(s, state.radius_of(side) - profile.height(s), state, side, check.top)
    reach = of(back)
    k = int(np.argmin(reach))
    if not np.isfinite(reach[k]):
        return np.inf
    near = minimize_scalar(
        lambda s: float(of(np.array([s]))[0]),
        bounds=(back[max(k - 1, 0)], back[min(k + 1, len(back) - 1)]),
        method="bounded",
        options={"xatol": 1e-10},
    )
    return min(float(reach[k]), float(near.fun)) - face


def back_gap_at(search, side: str, lateral: float, yaw: float, held_at: str) -> float:
    """Distance [m] of a flange back from its check rail where a wheelset stands; +inf without one."""
    check = search.track.check_rail(side)
    if check is None:
        return np.inf
    return back_gap(search.touching(lateral, yaw, held_at), side, check, search.track.gauge / 2 - check.flangeway)


def within_stops(search, lateral: float, yaw: float, held_at: str) -> float:
    """The lateral shift [m] nearest to the one asked for at which no flange back passes its check rail. search :
    ContactSearch."""
    for side in SIDES:
        stopped = False
        for _ in range(20):  # the back moves as the wheelset does, but for its roll
            gap = back_gap_at(search, side, lateral, yaw, held_at)
            stopped = stopped or gap < -CLOSE
            if not stopped or abs(gap) < CLOSE:
                break
            lateral -= SIDES[side] * gap
    for side in SIDES:
        gap = back_gap_at(search, side, lateral, yaw, held_at)
        if gap < -1e-9:
            raise WheelsetError(
                f"the flange backs do not fit between the check rails: {side} back {-gap * 1e3:.3g} mm beyond its"
                f" face at yaw {yaw:g} rad; widen a flangeway or lessen back_to_back or yaw"
            )
    return lateral
