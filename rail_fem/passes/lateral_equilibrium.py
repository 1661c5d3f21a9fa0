"""Where a wheelset that is pushed across the track comes to stand: the lateral position at which the force across it,
gravity on the inclined contacts, flange, check rail and creep cancel, as it runs on without moving against the track.

For every lateral position the other unknowns (heights, roll, tracks) are in equilibrium; the force that is left across
is followed from the centred position to where it changes sign.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from rail_fem.passes.wheelset_dynamics import (
    LATERAL,
    ROLL,
    YAW,
    WheelsetContacts,
    WheelsetSystem,
    for_kernels,
    static_forces,
)

STEP = 0.1e-3  # of the lateral positions that are looked at [m]
MOST_ITERATIONS, CLOSED = 200, 1e-13  # of Newton's method; change of heights [m] and angles [rad]
LONGEST = 1e-3  # change of an iteration: contacts stiffen as they close [m]
ROUNDS = 8  # of lateral position and roll; each gains a digit or more
PAST_FACE = 0.7  # of the steepest slope: a flange that has climbed stands on less


class Equilibrium(NamedTuple):
    """Position (8,), forces of the contacts (c,) and of the check rail [N], lateral position at rail level [m]."""

    position: np.ndarray
    contact: np.ndarray
    check: float
    across: float


def lateral_equilibrium(
    system: WheelsetSystem, contacts: WheelsetContacts, position: np.ndarray, held: float | None = None
) -> Equilibrium:
    """From a position (8,) to the nearest equilibrium on the side to which the forces push; yaw is held, and with
    `held` the lateral position at rail level [m] as well.

    Errors: ValueError where there is none within the lateral positions of the contacts: the wheelset derails or
    overturns, or the contacts do not reach far enough; FloatingPointError where Newton's method does not close.
    """
    system, contacts = for_kernels(system), for_kernels(contacts)
    widest = float(np.abs(contacts.shift).max())
    if held is not None:
        return _equilibrium(system, contacts, _held_at(system, contacts, np.array(position, float), held, widest))
    here = _settled(system, contacts, np.array(position, float))
    pushed = _push(system, contacts, here)
    sign = 1.0 if pushed >= 0 else -1.0
    while sign * pushed > 0:
        if abs(system.across(here)) + STEP > widest:
            raise ValueError(_no_equilibrium(system, contacts, here, pushed))
        before, here = here, here.copy()
        here[LATERAL] += sign * STEP
        here = _settled(system, contacts, here)
        pushed = _push(system, contacts, here)
        if sign * pushed <= 0:
            here = _between(system, contacts, before, here)
    return _equilibrium(system, contacts, here)


def _equilibrium(system: WheelsetSystem, contacts: WheelsetContacts, position: np.ndarray) -> Equilibrium:
    clearance, stiffness = system.stop
    across = float(system.across(position))
    found = static_forces(system, contacts, position)
    return Equilibrium(position, found.contact, stiffness * max(across - clearance, 0.0), across)


def _held_at(
    system: WheelsetSystem, contacts: WheelsetContacts, position: np.ndarray, held: float, widest: float
) -> np.ndarray:
    """Position (8,) with `held` across at rail level [m]; by steps, so that Newton's method starts near."""
    if abs(held) > widest:
        raise ValueError(
            f"lateral = {held * 1e3:g} mm lies beyond the {widest * 1e3:g} mm that are looked at: widen lateral_range"
            " (run.rigid_hertz)"
        )
    for y in np.linspace(0.0, held, max(int(np.ceil(abs(held) / STEP)), 1) + 1):
        for _ in range(ROUNDS):
            position[LATERAL] = y - system.rolling_radius * position[ROLL]
            position = _settled(system, contacts, position)
    return position


def _push(system: WheelsetSystem, contacts: WheelsetContacts, position: np.ndarray) -> float:
    """Force that is left across the wheelset, + to the left [N]."""
    return float(static_forces(system, contacts, position).load[LATERAL])


def _between(system: WheelsetSystem, contacts: WheelsetContacts, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The equilibrium between two positions whose pushes differ in sign."""

    def at(y: float) -> np.ndarray:
        start = one.copy()
        start[LATERAL] = y
        return _settled(system, contacts, start)

    return at(brentq(lambda y: _push(system, contacts, at(y)), one[LATERAL], other[LATERAL], xtol=1e-12))


def _settled(system: WheelsetSystem, contacts: WheelsetContacts, position: np.ndarray) -> np.ndarray:
    """All but lateral position and yaw in equilibrium, from a position (8,)."""
    free = system.free_dofs.copy()
    free[[LATERAL, YAW]] = 0.0
    k = np.flatnonzero(free)
    position = position.copy()
    for _ in range(MOST_ITERATIONS):
        found = static_forces(system, contacts, position)
        if min(found.contact[contacts.side == side].sum() for side in (1.0, -1.0)) <= 0:
            raise ValueError(
                f"the wheelset overturns: at y = {position[LATERAL] * 1e3:.2f} mm one of its wheels carries nothing:"
                " give less lateral_force or another check_rail"
            )
        change = np.linalg.solve(found.stiffness[np.ix_(k, k)], found.load[k])
        largest = np.abs(change).max()
        position[k] += change * min(1.0, LONGEST / max(largest, 1e-300))
        if largest < CLOSED:
            return position
    raise FloatingPointError(
        f"static wheelset at y = {position[LATERAL] * 1e3:.2f} mm: heights still change by {largest:.1e} m after"
        f" {MOST_ITERATIONS} iterations"
    )


def _no_equilibrium(system: WheelsetSystem, contacts: WheelsetContacts, position: np.ndarray, pushed: float) -> str:
    """Why there is none, and what to do."""
    side, force = ("outside", "outwards") if pushed > 0 else ("inside", "inwards")
    leading = contacts.side == (1.0 if pushed > 0 else -1.0)
    slope = np.abs(contacts.slope[leading, 0])
    steepest = slope.max(axis=0)
    derails = steepest[-1] < PAST_FACE * steepest.max() and steepest.max() > 1.0
    across = system.across(position) * 1e3
    what = (
        f"the wheelset derails: {abs(pushed) / 1e3:.1f} kN still push it {force} at {across:.2f} mm, where its flange"
        " has climbed the rail"
        if derails
        else f"no lateral equilibrium: {abs(pushed) / 1e3:.1f} kN still push the wheelset {force} at {across:.2f} mm,"
        " the last position that was looked at"
    )
    remedy = "a nearer check_rail, " if side == "outside" and not system.stop[0] < 1e-3 * across else ""
    wider = "" if derails else "a larger lateral_range (run.rigid_hertz), "
    return (
        f"{what}. Across it act {system.load[LATERAL] / 1e3:.1f} kN of the vehicle and creep at an angle of attack of"
        f" {position[YAW] * 1e3:.1f} mrad: give {wider}{remedy}less lateral_force or angle_of_attack"
    )
