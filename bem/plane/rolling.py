"""Steady rolling in the plane: creepage, stick and slip of two bodies whose contact stands still while their material
flows.

A particle now at a node was at the node before it, nearer the leading edge, when the bodies had rolled by the distance
between them. Its slip over that distance is the change of the elastic tangential displacement plus creepage times
distance: that replaces the slip of bem.plane.coulomb, and the tangential motion of the slave by the creepage.
Error: first order in element size, from the backward difference (tests/bem/test_contact_friction.py).
"""

import numpy as np

from bem.checks import refuse_unless_finite
from bem.plane.contact import ContactResult
from bem.plane.coulomb import OPEN, STICK, ContactState, ContactSystem, Control, refuse_bad_friction, solve_step


class RollingError(ValueError):
    """Rolling that is not defined: what moves it, or which way it goes."""


def rolling_system(system: ContactSystem, distance: np.ndarray, leading: np.ndarray) -> ContactSystem:
    """System whose slip is that of steady rolling and whose first motion is the creepage along the tangent [1].

    distance : (n,) from each node to its leading neighbour [m]; leading : (n,) index of that neighbour
    """
    n = system.nodes
    compliance, motion = system.compliance.copy(), system.motion.copy()
    compliance[n:] -= system.compliance[n:][leading]
    motion[n:] -= system.motion[n:][leading]
    motion[:, 0] = np.r_[np.zeros(n), distance]
    return ContactSystem(system.gap, compliance, motion, system.forces)


def solve_rolling(
    pressed: ContactResult,
    friction: float,
    creepage: float | None = None,
    tangential_load: float | None = None,
    forward: int = 1,
) -> tuple[ContactState, float]:
    """Steady rolling of a contact that has been pressed together (its last control is kept in y and rotation).

    creepage        : slave's surface velocity over the master's along the slave's tangent, over the rolling speed, or
        None
    tangential_load : force on the slave along x [N/m] instead; forward : +1 if the contact moves towards later nodes,
        else -1
    Returns the state (its slip is per element passed) and the creepage.
    Raises RollingError, FrictionError; EquilibriumError for a tangential load beyond friction.
    """
    refuse_bad_friction(friction)
    if (creepage is None) == (tangential_load is None):
        raise RollingError("give either the creepage or the tangential load, not both or none")
    refuse_unless_finite(
        RollingError,
        **({"creepage": creepage} if tangential_load is None else {"tangential_load [N/m]": tangential_load}),
    )
    if forward not in (1, -1):
        raise RollingError(f"forward = {forward!r}: must be 1 or -1")
    if not (pressed.last.pressure > 0).any():
        raise RollingError("the bodies do not touch: press them together first")
    points, n = pressed.interface.points, pressed.system.nodes
    leading = np.clip(np.arange(n) + forward, 0, n - 1)
    distance = np.hypot(*(points[leading] - points).T)
    distance[leading == np.arange(n)] = distance[distance > 0].mean()
    last = pressed.controls[-1]
    control = Control(
        np.r_[np.nan if creepage is None else creepage, last.motion[1:]],
        np.r_[np.nan if tangential_load is None else tangential_load, last.load[1:]],
    )
    start = np.where(pressed.last.state == OPEN, OPEN, STICK)
    state = solve_step(rolling_system(pressed.system, distance, leading), control, friction, state=start)
    return state, float(state.motion[0])
