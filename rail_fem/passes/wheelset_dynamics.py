"""A wheelset on two rails, free up and down, in roll, laterally and in yaw: the time step of rigid_hertz with that
freedom.

q = (sprung mass left and right, wheelset height z, roll phi, lateral y, yaw psi, track left and right); senses of
geometry.wheelset: y to the left, phi > 0 lifts the left wheel, psi > 0 heads to the left. A contact's potential is the
work of its approach
    d = H(x, u) - z - phi (Y - y) + r phi^2 / 2 + track,   u = side * (y + r phi),
H the height at which a wheel shifted by u towards its field side touches the rail, Y the contact's position across the
track. Its gradient gives every force: of the normal, of the contact angle (dH/du), and the lever in roll. So lateral
and roll motion exchange energy with the vertical one exactly; what it leaves out is of second order in the slopes and
of third in y and phi. Creep forces: Kalker's linear theory, bounded by friction as Vermeulen and Johnson do; spin
creepage left out. The axle turns so that its longitudinal creep forces cancel. In a curve y and psi are taken against
the track, the left rail the outer one: what lies at Y runs a path longer by Y / R. Scheme: implicit midpoint as in
vertical_dynamics, Newton's method for the middle velocity.
Source: Wickens, Fundamentals of Rail Vehicle Dynamics (2003), chapters 2, 3; Vermeulen and Johnson, J. Appl. Mech. 31
(1964) 338.
"""

from typing import NamedTuple, TypeVar

import numpy as np

from geometry.hermite import cubic_between
from kernel_cache import njit
from rail_fem.contact.contact_law import contact_energy, contact_force, first_dents, follow, lagging, put
from rail_fem.passes.vertical_dynamics import PassMotion, begun

SPRUNG_LEFT, SPRUNG_RIGHT, HEIGHT, ROLL, LATERAL, YAW, TRACK_LEFT, TRACK_RIGHT = range(8)
MOST_ITERATIONS = 100
CLOSED = 1e-14  # to which heights [m] and angles [rad] are found at the middle of a step


class WheelsetContacts(NamedTuple):
    """c contacts at the ends and middles of m steps, t = 2 m + 1, on a grid of k evenly spaced lateral position of the
    wheel.

    side   : (c,) +1 left, -1 right;  position : (c, t) Y, across the track from its middle, + to the left [m]
    shift  : (k,) u [m];  height, slope : (c, t, k) H [m] (-inf out of reach) and dH/du [1];
    radius : (c, t, k) of the wheel there [m]
    law    : (c, t, 6) of rail_fem.contact.contact_law
    creep  : (c, t, 2) longitudinal and lateral creep coefficient [N] at the normal force `reference` [N]; they grow
        with its 2/3 power
    """

    side: np.ndarray
    contact_y: np.ndarray
    shift: np.ndarray
    height: np.ndarray
    slope: np.ndarray
    radius: np.ndarray
    law: np.ndarray
    creep: np.ndarray
    reference: float
    friction: float


class WheelsetSystem(NamedTuple):
    """Linear part: mass (8,), stiffness, damping (8, 8), load (8,); free_dofs (8,) 1 where the motion is let go, 0
    where it is held.

    rolling_radius [m];  speed V > 0 along the path [m/s];  stop : clearance [m] and stiffness [N/m] of the check rail
    curvature : 1 / R of the track, + where the left rail is the outer one [1/m]
    """

    mass: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    load: np.ndarray
    free_dofs: np.ndarray
    rolling_radius: float
    speed: float
    stop: tuple[float, float]
    curvature: float = 0.0

    def across(self, position: np.ndarray) -> np.ndarray:
        """Lateral position at rail level (...) [m] of positions (..., 8)."""
        return position[..., LATERAL] + self.rolling_radius * position[..., ROLL]


Values = TypeVar("Values", WheelsetContacts, WheelsetSystem)


def march(
    system: WheelsetSystem, contacts: WheelsetContacts, position: np.ndarray, velocity: np.ndarray, step: float
) -> PassMotion:
    """From the start (8,), (8,) over all steps of `step` [s]. Error: second order in the step
    (tests/rail_fem/test_wheelset_dynamics.py).

    Errors: ValueError when the wheelset leaves the lateral position of the contacts, FloatingPointError when a step
    does not close.
    """
    motion, bad = _march(
        for_kernels(system), for_kernels(contacts), np.array(position, float), np.array(velocity, float), step
    )
    if bad >= 0:
        raise FloatingPointError(
            f"wheelset dynamics: step {bad} of {len(motion.path_work)} does not close, t = {bad * step:.4g} s: take a"
            " shorter time_step"
        )
    across = system.across(motion.position)
    widest = np.abs(contacts.shift).max()
    if np.abs(across).max() > widest:
        i = int(np.argmax(np.abs(across) > widest))
        raise ValueError(
            f"wheelset dynamics: lateral position {across[i] * 1e3:.2f} mm at step {i} is beyond the"
            f" {widest * 1e3:.1f} mm that were looked at: widen lateral_range"
        )
    return motion


def for_kernels(values: Values) -> Values:
    """The same with contiguous, writable arrays and floats, so that kernels are compiled for one set of types."""
    plain = lambda value: np.require(value, float, ["C", "W"]) if isinstance(value, np.ndarray) else value
    return type(values)(*(plain(value) for value in values))


class StaticForces(NamedTuple):
    """Generalised force (8,) on a wheelset that keeps its position, its derivative (8, 8) with minus sign, forces of
    the contacts (c,) [N]."""

    load: np.ndarray
    stiffness: np.ndarray
    contact: np.ndarray


def static_forces(system: WheelsetSystem, contacts: WheelsetContacts, position: np.ndarray) -> StaticForces:
    """What acts on a wheelset at a position (8,) at the beginning of the contacts, running on without moving against
    the track: springs, loads, contacts, check rail, creep. system, contacts : as `for_kernels` gives them."""
    count = len(contacts.side)
    found, normal, stiff, creep, slip = (np.zeros(shape) for shape in (count, 8, (8, 8), 8, (2, 8, 8)))
    here = contacts.law[:, 0], np.zeros(count)
    _normal(position, 0, contacts, *here, system.rolling_radius, *system.stop, found, normal, stiff)
    speed, curvature = system.speed, system.curvature
    _creep(position, np.zeros(8), 0, contacts, system.rolling_radius, speed, curvature, found, creep, slip)
    load = system.load + normal + creep - system.stiffness @ position
    return StaticForces(load, system.stiffness + stiff + slip[1], found)


def potential(system: WheelsetSystem, contacts: WheelsetContacts, position: np.ndarray, dent: np.ndarray) -> np.ndarray:
    """Energy (m + 1,) [J] in contacts and check rail at the ends of the steps, for positions (m + 1, 8), dents that
    lag (c, m + 1)."""
    c = contacts
    at_ends = c._replace(
        contact_y=c.contact_y[:, ::2], height=c.height[:, ::2], slope=c.slope[:, ::2], law=c.law[:, ::2]
    )
    return _potentials(position, for_kernels(at_ends), dent, system.rolling_radius, *system.stop)


@njit(cache=True)
def surface(u, shift, height, slope):
    """H, dH/du and d2H/du2 at u: cubic Hermite on the grid, its ends going on straight; -inf beside a position out of
    reach."""
    step = shift[1] - shift[0]
    i = int(min(max((u - shift[0]) // step, 0), len(shift) - 2))
    if not (np.isfinite(height[i]) and np.isfinite(height[i + 1])):
        return -np.inf, 0.0, 0.0
    t = (u - shift[i]) / step
    if t < 0.0:
        return height[i] + slope[i] * t * step, slope[i], 0.0
    if t > 1.0:
        return height[i + 1] + slope[i + 1] * (t - 1.0) * step, slope[i + 1], 0.0
    found = cubic_between(t, step, height[i], height[i + 1], slope[i], slope[i + 1])
    return found.value, found.slope, found.second


@njit(cache=True)
def approach(q, c, t, contacts, rolling, gradient):
    """Approach d of contact c at time t of the arrays and d2H/du2; `gradient` (8,) takes d's derivative to q."""
    side, contact_y = contacts.side[c], contacts.contact_y[c, t]
    value, tangent, bend = surface(
        side * (q[4] + rolling * q[3]), contacts.shift, contacts.height[c, t], contacts.slope[c, t]
    )
    gradient[:] = 0.0
    gradient[2] = -1.0
    gradient[3] = side * rolling * tangent - (contact_y - q[4]) + rolling * q[3]
    gradient[4] = side * tangent + q[3]
    gradient[6 if side > 0 else 7] = 1.0
    return value - q[2] - q[3] * (contact_y - q[4]) + rolling * q[3] ** 2 / 2 + q[6 if side > 0 else 7], bend


@njit(cache=True)
def _energy(q, t, contacts, dent, rolling, clearance, check):
    """Energy of all contacts at time t of the arrays with dents that lag (c,), and of the check rail."""
    gradient, none = np.empty(8), np.zeros(1)
    energy = 0.5 * check * max(q[4] + rolling * q[3] - clearance, 0.0) ** 2
    for c in range(len(contacts.side)):
        d, _ = approach(q, c, t, contacts, rolling, gradient)
        d -= dent[c]
        if d > 0:
            energy += contact_energy(-d, none, contacts.law[c, t : t + 1])
    return energy


@njit(cache=True)
def _potentials(position, contacts, dent, rolling, clearance, check):
    out = np.empty(len(position))
    for i in range(len(position)):
        out[i] = _energy(position[i], i, contacts, dent[:, i], rolling, clearance, check)
    return out


@njit(cache=True)
def _normal(q, t, contacts, law, top, rolling, clearance, check, force, into, stiff):
    """Forces of contacts (c,) by their laws (c, 6), with heights changed by `top` (c,), their generalised force into
    (8,), and minus its derivative to q (8, 8)."""
    gradient = np.empty(8)
    into[:], stiff[:] = 0.0, 0.0
    past = q[4] + rolling * q[3] - clearance
    if past > 0:
        into[4] -= check * past
        into[3] -= check * past * rolling
        stiff[4, 4] += check
        stiff[3, 4] += check * rolling
        stiff[4, 3] += check * rolling
        stiff[3, 3] += check * rolling**2
    for c in range(len(contacts.side)):
        d, bend = approach(q, c, t, contacts, rolling, gradient)
        force[c], rate = contact_force(d + top[c], law[c])
        into -= force[c] * gradient
        for i in range(8):
            for j in range(8):
                stiff[i, j] += rate * gradient[i] * gradient[j]
        stiff[4, 4] += force[c] * bend
        stiff[3, 3] += force[c] * (bend * rolling**2 + rolling)
        cross = force[c] * (bend * rolling + 1.0)
        stiff[3, 4] += cross
        stiff[4, 3] += cross


@njit(cache=True)
def friction_share(along, aside, friction, force):
    """What friction leaves of linear creep forces along and across the rail [N] under a normal force [N]: Vermeulen and
    Johnson."""
    size = np.hypot(along, aside) / (3 * friction * force)
    return 1 - size + size**2 / 3 if size < 1 else 1 / (3 * size)


@njit(cache=True)
def _creep(q, v, t, contacts, rolling, speed, curvature, force, into, stiff):
    """Generalised creep force (8,); stiff[0], stiff[1] (8, 8): minus its derivative to v and to q, with the share that
    friction leaves held."""
    into[:], stiff[:] = 0.0, 0.0
    side, creep, friction = contacts.side, contacts.creep, contacts.friction
    total = force.sum()
    if total <= 0 or friction <= 0:
        return
    at, mean, middle = np.empty(len(side)), 0.0, 0.0
    for c in range(len(side)):
        at[c] = np.interp(side[c] * (q[4] + rolling * q[3]), contacts.shift, contacts.radius[c, t])
        mean += force[c] * at[c] / total
        middle += force[c] * contacts.contact_y[c, t] / total
    lateral = (v[4] + rolling * v[3]) / speed - q[5]
    for c in range(len(side)):
        if force[c] <= 0:
            continue
        grown, arm = (force[c] / contacts.reference) ** (2 / 3), contacts.contact_y[c, t]
        along = -arm * v[5] / speed - (at[c] - mean) / rolling + curvature * (arm - middle)
        wanted_x, wanted_y = -creep[c, t, 0] * grown * along, -creep[c, t, 1] * grown * lateral
        share = friction_share(wanted_x, wanted_y, friction, force[c])
        into[5] -= arm * share * wanted_x
        into[4] += share * wanted_y
        into[3] += rolling * share * wanted_y
        fx, fy = creep[c, t, 0] * grown * share, creep[c, t, 1] * grown * share
        stiff[0, 5, 5] += fx * arm**2 / speed
        stiff[0, 4, 4] += fy / speed
        stiff[0, 3, 4] += fy * rolling / speed
        stiff[0, 4, 3] += fy * rolling / speed
        stiff[0, 3, 3] += fy * rolling**2 / speed
        stiff[1, 4, 5] -= fy
        stiff[1, 3, 5] -= fy * rolling


@njit(cache=True)
def _march(system, contacts, q, v, step):
    """PassMotion from q, v (8,), and the step that did not close, -1: none."""
    mass, damper, rolling, (clearance, check) = system.mass, system.damping, system.rolling_radius, system.stop
    count, steps = len(contacts.side), (contacts.contact_y.shape[1] - 1) // 2
    friction = np.zeros(steps)
    motion = begun(q, v, count, steps, friction, None, None)
    now, normal_load, creep_load = np.zeros(count), np.zeros(8), np.zeros(8)
    stiff, slip = np.zeros((8, 8)), np.zeros((2, 8, 8))
    held, dent = np.diag(1.0 - system.free_dofs), motion.dent
    level, top, here = np.zeros(count), np.zeros(count), contacts.law[:, 0].copy()
    _normal(q, 0, contacts, here, top, rolling, clearance, check, now, normal_load, stiff)
    first_dents(now, contacts.law[:, 0], dent)
    for i in range(steps):
        t, middle, closed = 2 * i + 1, v.copy(), False
        lagging(dent[:, i], level, contacts.law[:, t], step, top, here)
        for _ in range(MOST_ITERATIONS):
            at = q + step / 2 * middle
            _normal(at, t, contacts, here, top, rolling, clearance, check, now, normal_load, stiff)
            _creep(at, middle, t, contacts, rolling, system.speed, system.curvature, now, creep_load, slip)
            residual = (
                2 / step * mass * (middle - v)
                + system.stiffness @ at
                + damper @ middle
                - system.load
                - normal_load
                - creep_load
            )
            tangent = np.diag(2 / step * mass) + damper + step / 2 * (system.stiffness + stiff + slip[1]) + slip[0]
            for k in range(8):
                if system.free_dofs[k] == 0.0:
                    tangent[k, :], tangent[:, k], residual[k] = 0.0, 0.0, 0.0
            change = np.linalg.solve(tangent + held, residual)
            middle = middle - change
            closed = np.abs(change).max() * step / 2 <= CLOSED
            if closed:
                break
        if not closed:
            return motion, i
        at = q + step / 2 * middle
        follow(dent, i, now, contacts.law[:, t], step)
        after = _energy(at, t + 1, contacts, dent[:, i + 1], rolling, clearance, check)
        motion.path_work[i] = after - _energy(at, t - 1, contacts, dent[:, i], rolling, clearance, check)
        motion.loss[i], friction[i] = step * (middle @ (damper @ middle)), -step * (middle @ creep_load)
        put(motion.force[:, i], now)
        q, v = q + step * middle, 2 * middle - v
        put(motion.position[i + 1], q)
        put(motion.velocity[i + 1], v)
    return motion, -1
