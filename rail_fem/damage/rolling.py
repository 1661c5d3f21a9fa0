"""From a wheelset at rest on worn rails to rolling contacts: all points, their creepages, tractions and slip.

A point's patch is the ellipse with the second moments of the pressure that load sharing found
(rail_fem.contact.load_sharing), its tractions are FASTSIM's. The wheelset turns freely: its spin is the one at which
the longitudinal forces of all its points have no moment about the axle. Lateral position and yaw are given; forces
across the track come from normal contact alone, and rails may yield to them.
"""

import functools
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from bem.halfspace.fastsim import elliptic_patch, fastsim
from bem.halfspace.slip_dependent_friction import SlipDependentFriction
from bem.material import STEEL, Elastic
from bem.patch import Creepage, Patch
from geometry.contact.prismatic_search import ContactSearch, Motion, creepages
from geometry.wheelset import SIDES, WheelsetError
from rail_fem.contact.load_sharing import LoadedSide, LoadedWheelset, static_equilibrium
from rail_fem.damage.wear import tgamma

COARSE = 16  # cells each way while the spin is looked for
SPINS = 0.02  # first half width of the bracket of the spin, relative
LEAST_FORCE = 1.0  # of a point that is looked at [N]
YIELD_MET = 5e-7  # of a rail's yielding that counts as met [m]
FIRST_STEP, MOST_RESTS = 2e-6, 40
NUDGES = (0.0, 1e-6, -1e-6, 3e-6, -3e-6, 1e-5, -1e-5)  # of a position where no rest is found, on rough worn lines [m]
LEAST_AXIS = 1e-5  # semi-axis of a patch at least: an edge has none of its own [m]
LONGEST = 59.0  # ratio of a patch's axes at most: FASTSIM's flexibilities end at 60, and a ridge is longer


@dataclass(frozen=True)
class Rolling:
    """How a wheelset rolls: speed [m/s], friction, third-body slope (bem.halfspace.fastsim), cells each way of a patch,
    steels of wheel and rail."""

    speed: float
    friction: float | SlipDependentFriction = 0.3
    initial_slope: float = 1.0
    cells: int = 50
    wheel_steel: Elastic = STEEL
    rail_steel: Elastic = STEEL


@dataclass(frozen=True)
class RollingPoint:
    """One point of a rolling wheelset that carries.

    side : "left" or "right";  patch : solved, x along the rail, y to the left in the tangent plane, about the centre of
    pressure;  position : (2,) y, z of that centre on the unmoved rail profile's axes [m];  station : on the wheel [m]
    angle : of contact [rad];  normal_force [N];  radius : of rolling [m];  speed [m/s]
    """

    side: str
    patch: Patch
    position: tuple[float, float]
    station: float
    angle: float
    normal_force: float
    radius: float
    speed: float

    @property
    def tgamma(self) -> float:
        """Tractive forces times creepages without the spin moment [N]: thesis 2.3.3's T gamma."""
        return tgamma(self.patch)

    @property
    def outwards(self) -> np.ndarray:
        """(ny,) positions of the strips from the centre along the rail's line, towards its field side [m]."""
        return SIDES[self.side] * self.patch.grid.y


def roll(search: ContactSearch, state: LoadedWheelset, rolling: Rolling) -> tuple[RollingPoint, ...]:
    """All carrying points of a wheelset at rest, rolling freely at its speed."""
    sides = [side for side in (state.left, state.right) if len(side.contacts)]
    motion = Motion(rolling.speed, spin=free_spin(state, sides, rolling))
    points = []
    for side in sides:
        for k, creepage in enumerate(side_creepages(state, side, motion)):
            if side.normal_force[k] < LEAST_FORCE:
                continue
            points.append(_point(search, side, k, creepage, rolling))
    return tuple(points)


def side_creepages(state: LoadedWheelset, side: LoadedSide, motion: Motion) -> np.ndarray:
    """(n, 3) creepages at the centres of pressure."""
    return creepages(state.state, replace(side.contacts, position=side.centre_of_pressure), motion)


def free_spin(state: LoadedWheelset, sides: list[LoadedSide], rolling: Rolling) -> float:
    """Spin [rad/s] at which the longitudinal forces have no moment about the axle."""
    own = rolling.speed / state.state.radius
    coarse = replace(rolling, cells=min(COARSE, rolling.cells))
    slow, fast = (
        [side_creepages(state, side, Motion(rolling.speed, spin=own * (1 + turn))) for side in sides]
        for turn in (0.0, 1.0)
    )

    @functools.cache
    def moment(turn: float) -> float:
        total = 0.0
        for side, a, b in zip(sides, slow, fast, strict=True):
            arm = state.state.z - side.centre_of_pressure[:, 2]
            for k in np.flatnonzero(side.normal_force >= LEAST_FORCE):
                total += arm[k] * tractions(side, int(k), a[k] + turn * (b[k] - a[k]), coarse).tangential_force[0]
        return total

    low, high = -SPINS, SPINS
    while moment(low) > 0 and low > -0.3:
        low *= 2
    while moment(high) < 0 and high < 0.3:
        high *= 2
    one, two = moment(low), moment(high)
    if one * two > 0:  # no friction, or none that turns the axle
        return own
    return own * (1 + (0.0 if one == two == 0 else brentq(moment, low, high, xtol=1e-8)))


def no_more_slender(semi: np.ndarray) -> np.ndarray:
    """Half lengths (..., 2) [m] of patches, the shorter ones widened where creepage coefficients end."""
    return np.maximum(semi, semi.max(axis=-1, keepdims=True, initial=0.0) / LONGEST)


def tractions(side: LoadedSide, k: int, creepage: np.ndarray, rolling: Rolling) -> Patch:
    """Patch of point k of a side with tractions and slip."""
    along, across = no_more_slender(np.maximum(side.patch[k], LEAST_AXIS))
    patch = elliptic_patch(float(along), float(across), float(side.normal_force[k]), (rolling.cells, rolling.cells))
    return fastsim(
        patch,
        rolling.wheel_steel,
        rolling.rail_steel,
        rolling.friction,
        Creepage(*map(float, creepage)),
        initial_slope=rolling.initial_slope,
        direction=1 if rolling.speed > 0 else -1,
        estimate=False,
    )


def _point(search: ContactSearch, side: LoadedSide, k: int, creepage: np.ndarray, rolling: Rolling) -> RollingPoint:
    name = side.contacts.side
    position = getattr(search.track, f"{name}_position")
    _, y, z = side.centre_of_pressure[k]
    at = search.rail_station(name, np.array([SIDES[name] * y]), np.array([z]))[0]
    return RollingPoint(
        name,
        tractions(side, k, creepage, rolling),
        (float(at), float(z - position.vertical)),
        float(side.pressure_station[k]),
        float(side.contacts.angle[k]),
        float(side.normal_force[k]),
        float(side.contacts.rolling_radius[k]),
        rolling.speed,
    )


def equilibrium_on_yielding_rails(
    search: ContactSearch,
    loads: tuple[float, float],
    lateral: float,
    yaw: float,
    stiffness: float,
    start: float | None = None,
) -> LoadedWheelset:
    """The wheelset at rest where a guidance wants it at `lateral` [m] and the rails yield to the lateral force by their
    stiffness [N/m]; inf: rigid rails.

    A wheelset whose position is given and whose flange meets a rigid rail climbs it; a rail that yields takes over only
    what the guidance forces on it. start : a lateral position to begin from.
    Error: YIELD_MET times the stiffness in lateral force, 10 N at 20 MN/m.
    """
    if np.isinf(stiffness):
        return equilibrium_near(search, loads, lateral, yaw)
    here = lateral if start is None else start
    state = equilibrium_near(search, loads, here, yaw)
    left_over = here - lateral - state.lateral_force / stiffness
    low, high, step = (-np.inf, 0.0), (np.inf, 0.0), FIRST_STEP
    for _ in range(MOST_RESTS):
        if abs(left_over) < YIELD_MET:
            break
        low, high = ((here, left_over), high) if left_over < 0 else (low, (here, left_over))
        if np.isfinite([low[0], high[0]]).all():
            share = -low[1] / (high[1] - low[1])
            here = low[0] + np.clip(share, 0.05, 0.95) * (high[0] - low[0])
        else:
            here -= np.sign(left_over) * max(min(abs(left_over), 1e-3), step)
            step *= 3
        state = equilibrium_near(search, loads, float(here), yaw)
        left_over = here - lateral - state.lateral_force / stiffness
    return state


def equilibrium_near(search: ContactSearch, loads: tuple[float, float], lateral: float, yaw: float) -> LoadedWheelset:
    """The wheelset at rest at a lateral position, or within 10 um of it where worn lines are so rough that a force
    jumps there; the search by bounds is left for where none of these positions is found without. Raises WheelsetError
    where it finds none."""
    tries = [(nudge, thorough) for thorough in (False, True) for nudge in NUDGES]
    for nudge, thorough in tries[:-1]:
        try:
            return static_equilibrium(search, loads, lateral + nudge, yaw, thorough=thorough)
        except WheelsetError:
            continue
    return static_equilibrium(search, loads, lateral + NUDGES[-1], yaw)
