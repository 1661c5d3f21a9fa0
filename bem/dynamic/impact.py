"""Something strikes a body: a mass that the contact force slows down, or a path that it is made to follow.

The striker's outline is stiff, or yields statically (its own waves are left out; its mass sits where it is held). Gaps
are measured along the normals of the struck body between the smooth outlines, as in bem.plane.pairing. The contact
nodes themselves carry no mass: what yields at once under a pressure is the body's static compliance less what inertia
holds back, so pressures follow the gaps without the chatter of masses that strike, and no restitution is to be chosen.

With friction the striker also moves along the tangent beside its axis; it does not turn. Pressures and shears of a step
follow from the gaps at its end and from the slip in it, so that each node is open, sticks, or slides against its shear
at the bound. Gaps are those of the outlines where they met: slides are small beside the radius. What slips turns into
heat, which belongs to the balance of energy.
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from bem.checks import refuse_unless_finite, refuse_unless_positive
from bem.dynamic.body import DynamicBody, DynamicsError, Inertial
from bem.dynamic.marching import Energy, March, State
from bem.dynamic.pivoting import StepContact
from bem.dynamic.schemes import Scheme
from bem.plane.body import Body, CondensedBody
from bem.plane.boundary import MEMORY_LIMIT
from bem.plane.coulomb import STICK, refuse_bad_friction
from bem.plane.mesh import BoundaryMesh
from bem.plane.pairing import Interface, pair

EDGES = 0.01  # of a striker's width: more of it counted too much or too little is said


class ImpactWarning(UserWarning):
    """An impact whose result means something else than expected."""


@dataclass(frozen=True)
class Striker:
    """What moves along the unit vector `axis` (2,): a mass per thickness [kg/m] with a velocity [m/s] and a load [N/m]
    along the axis, or a `path`: time [s] -> position [m] along the axis that it is made to follow.

    release : time [s] from which nothing presses any more (a wheel that has rolled on), or None
    """

    mass: float | None = None
    velocity: float = 0.0
    load: float = 0.0
    path: Callable[[float], float] | None = None
    axis: tuple[float, float] = (0.0, 1.0)
    release: float | None = None

    def __post_init__(self) -> None:
        refuse_unless_finite(DynamicsError, velocity=self.velocity, load=self.load)
        if (self.mass is None) == (self.path is None):
            raise DynamicsError("a striker has either a mass, which the contact slows, or a path that it follows")
        if self.mass is not None:
            refuse_unless_positive(DynamicsError, **{"mass of the striker [kg/m]": self.mass})
        if abs(np.hypot(*self.axis) - 1) > 1e-9:
            raise DynamicsError(f"axis {self.axis!r}: give a unit vector")


@dataclass(frozen=True)
class TangentialMotion:
    """How a striker moves along the tangent, its axis turned clockwise by a right angle ((1, 0) for the axis (0, 1)).

    friction : Coulomb's coefficient, finite: with no slip at all a node that touches may have to pull, and there is no
        answer; velocity [m/s] at the beginning
    mass     : per thickness [kg/m] that friction slows; None: the velocity is kept
    """

    friction: float
    velocity: float = 0.0
    mass: float | None = None

    def __post_init__(self) -> None:
        refuse_bad_friction(self.friction)
        refuse_unless_finite(DynamicsError, friction=self.friction, **{"velocity along the face": self.velocity})
        if self.mass is not None:
            refuse_unless_positive(DynamicsError, **{"mass along the face [kg/m]": self.mass})

    def striker(self, axis: tuple[float, float]) -> Striker:
        """The motion along the tangent beside an axis, as that of a striker."""
        tangent = axis[1], -axis[0]
        if self.mass is not None:
            return Striker(mass=self.mass, velocity=self.velocity, axis=tangent)
        return Striker(path=lambda time: self.velocity * time, velocity=self.velocity, axis=tangent)


class StrikerOutline(NamedTuple):
    """What strikes, in its position at time 0, and its boundary mesh."""

    body: Body
    mesh: BoundaryMesh


class Struck:
    """A body that may be struck on its face, ready for any step length and striker of one outline."""

    def __init__(
        self,
        solid: Inertial,
        outline: StrikerOutline,
        reach: float,
        yielding: bool = False,
        memory_limit: float = MEMORY_LIMIT,
        friction: bool = False,
    ) -> None:
        """yielding : the striker yields statically by its own material; reach [m] : largest gap considered; friction :
        ready for tractions along the face too, at twice the load patterns"""
        striker, striker_mesh = outline
        self.interface: Interface = pair(
            solid.mesh, solid.body.face, striker_mesh, striker.face, striker.outline, reach
        )
        self.width = float(striker_mesh.lengths[striker_mesh.names == striker.face].sum())
        self.inside = len(self.interface.nodes) < len(solid.mesh.of_edge(solid.body.face))
        nx, ny = self.interface.normals.T
        tractions = np.vstack([np.diag(-nx), np.diag(-ny)])  # unit pressures as x and y tractions
        if friction:
            tractions = np.hstack([tractions, np.vstack([np.diag(ny), np.diag(-nx)])])
        self.friction = friction
        self.body = DynamicBody(solid, self.interface.on_slave @ tractions, memory_limit=memory_limit)
        self.mass = self.interface.mass
        count = tractions.shape[1]
        self.local = np.zeros((count, count))
        if yielding:
            other = CondensedBody(striker, striker_mesh, memory_limit)
            other.condense(self.interface.on_master @ tractions)
            weight = np.resize(self.mass, count)
            yields = weight[:, None] * (tractions.T @ other.displacement(self.interface.feet))
            self.local = (yields + yields.T) / 2


@dataclass
class Impact:
    """k + 1 instants: time [s]; position, velocity, force (k+1,) of the striker along its axis [m, m/s, N/m]; pressure
    (k+1, n) [Pa]; energy (k+1, 4) [J/m]: kinetic and strain energy of body (and striker's yielding), kinetic energy of
    the striker, work of load and path.

    shear (k+1, n) [Pa] on the struck body along its tangent (the normal turned clockwise), n = 0 without friction;
    slide, slide_velocity, drag (k+1,) of the striker along its tangent [m, m/s] and the force on it [N/m]; heat (k+1,)
    of slipping since the beginning [J/m]; status (k+1, n) open 0, stick 2, slip 1 and -1, with friction
    states : of the instants kept, by number; struck : what was hit
    """

    struck: Struck
    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    pressure: np.ndarray
    energy: np.ndarray
    shear: np.ndarray
    slide: np.ndarray
    slide_velocity: np.ndarray
    drag: np.ndarray
    heat: np.ndarray
    status: np.ndarray
    states: dict[int, State] = field(default_factory=dict)

    @property
    def imbalance(self) -> np.ndarray:
        """Energy and heat beyond the work done (k+1,), over the largest total energy so far."""
        total = self.energy[:, :3].sum(axis=1)
        scale = np.maximum(np.maximum.accumulate(np.abs(total)), 1e-300)
        return (total + self.heat - self.energy[:, 3]) / scale

    @property
    def sticking(self) -> np.ndarray:
        """Share of the touching nodes that stick (k+1,); NaN where none touches."""
        touch = (self.status != 0).sum(axis=1)
        return np.where(touch > 0, (self.status == STICK).sum(axis=1) / np.maximum(touch, 1), np.nan)

    def contacts(self) -> list[tuple[float, float]]:
        """Begin and end [s] of each time in contact."""
        touch = np.r_[False, self.pressure.max(axis=1) > 0, False]
        begin, end = np.flatnonzero(~touch[:-1] & touch[1:]), np.flatnonzero(touch[:-1] & ~touch[1:]) - 1
        return [(float(self.time[a]), float(self.time[b])) for a, b in zip(begin, end)]

    def solution(self, instant: int):
        """Field of the struck body at an instant that was kept (bem.plane.internal)."""
        if instant not in self.states:
            raise DynamicsError(f"instant {instant} was not kept: there are {sorted(self.states)}")
        state = self.states[instant]
        return self.struck.body.solution(state.phi, state.t)


def strike(
    struck: Struck,
    striker: Striker,
    march: March,
    steps: int,
    keep: Callable[[int], bool] | None = None,
    sliding: TangentialMotion | None = None,
) -> Impact:
    """The Impact of a striker over so many steps of a march of struck.body; keep : which instants' fields are wanted;
    sliding : the striker's motion along the face and its friction there, of a body made ready for it.

    The edges of a flat striker belong midway between nodes of the struck face: there its force is within 1 % (8
    elements under it), on nodes 10 % high, for these count whole. Warns of a width that is counted wrong, and when they
    never touch. Raises DynamicsError for a number of steps that is none, ConvergenceError (bem.plane.coulomb) where no
    consistent sticking and sliding is found.
    """
    if not isinstance(steps, (int, np.integer)) or steps < 1:
        raise DynamicsError(f"steps = {steps!r}: must be a positive whole number")
    if march.body is not struck.body:
        raise DynamicsError("the march is of another body than the one struck: make it of struck.body")
    if struck.friction != (sliding is not None):
        raise DynamicsError(
            "a body made by Struck(..., friction=True) is struck with `sliding`, any other one without: it knows"
            " pressures only"
        )
    impact = _Run(struck, striker, march, sliding).go(steps, keep or (lambda k: False))
    warn_unless_touching(impact)
    warn_of_edges(impact)
    return impact


def warn_unless_touching(impact: Impact) -> None:
    """Warn of an impact that was none."""
    if not impact.pressure.any():
        warnings.warn(
            f"the striker never touches in {impact.time[-1]:.3g} s: smallest gap at the start"
            f" {impact.struck.interface.gap.min():.3g} m, moved {impact.position[-1]:.3g} m along its axis",
            ImpactWarning,
            stacklevel=3,
        )


def warn_of_edges(impact: Impact) -> None:
    """Warn where a striker presses with edges within the struck face, and nodes count more or less than its width."""
    struck, edge = impact.struck, impact.pressure[:, [0, -1]].any(axis=0)
    counted, width = float(struck.interface.mass.sum()), struck.width
    if struck.inside and edge.any() and abs(counted - width) > EDGES * width:
        warnings.warn(
            f"the striker's face is {width:.3g} m wide and counts as {counted:.3g} m, for it presses with its edges:"
            " lay these midway between nodes of the struck face, or make its elements smaller",
            ImpactWarning,
            stacklevel=3,
        )


class StrikerMotion(NamedTuple):
    """Of a striker along its axis: position [m], velocity [m/s], acceleration [m/s^2], contact force and load [N/m]."""

    x: float
    v: float
    a: float
    force: float


class Carriage:
    """How a striker moves along its axis from step to step of a scheme."""

    def __init__(self, striker: Striker, scheme: Scheme, step: float) -> None:
        self.striker, self.scheme, self.step = striker, scheme, step
        self.mass = np.inf if striker.mass is None else striker.mass  # nothing slows what follows a path
        self.mobility = scheme.flexibility(step) / self.mass  # position per force at a step's end [m^2/N]

    def begin(self) -> StrikerMotion:
        """The striker at the start, before it touches."""
        striker = self.striker
        if striker.path is not None:
            return StrikerMotion(float(striker.path(0.0)), striker.velocity, 0.0, striker.load)
        return StrikerMotion(0.0, striker.velocity, striker.load / self.mass, striker.load)

    def predicted(self, at: StrikerMotion, time: float) -> float:
        """Position at the end of a step in which no contact force acts at its end."""
        if self.striker.path is not None:
            return float(self.striker.path(time))
        return self._moved(at, self.striker.load)[0]

    def moved(self, at: StrikerMotion, ahead: float, pushed: float) -> StrikerMotion:
        """After a step at whose end the contact pushes with a force [N/m]; ahead : as predicted."""
        if self.striker.path is not None:
            return StrikerMotion(ahead, (ahead - at.x) / self.step, at.a, at.force)
        force = pushed + self.striker.load
        return StrikerMotion(*self._moved(at, force), force)

    def _moved(self, at: StrikerMotion, after: float) -> tuple[float, float, float]:
        return self.scheme.moved(self.step, self.mass, at.x, at.v, at.a, at.force, after)

    def work(self, mean: float, moved: float) -> float:
        """Of its load, or of what guides it along its path against a mean contact force [N/m], over a way [m]."""
        return (self.striker.load if self.striker.path is None else -mean) * moved

    def energy(self, at: StrikerMotion) -> float:
        """Kinetic energy of a mass that the contact slows [J/m]."""
        return 0.5 * (self.striker.mass or 0.0) * at.v**2


class _Run:
    """One march with a striker: n nodes, with friction n shears after their pressures."""

    def __init__(self, struck: Struck, striker: Striker, march: March, sliding: TangentialMotion | None) -> None:
        self.struck, self.striker, self.march = struck, striker, march
        both = [striker] if sliding is None else [striker, sliding.striker(striker.axis)]
        self.carriages = [Carriage(one, march.scheme, march.step) for one in both]
        normals = struck.interface.normals
        faced = [normals] if sliding is None else [normals, np.column_stack([-normals[:, 1], normals[:, 0]])]
        # gaps and slips per unit of each motion, and forces on the striker per unit of pressure and shear
        weigh = lambda axis: np.concatenate([struck.mass * (directions @ np.array(axis)) for directions in faced])
        self._arm = np.column_stack([weigh(one.axis) for one in both])
        self._gap = struck.mass * struck.interface.gap
        matrix = march.compliance + struck.local
        for carriage, arm in zip(self.carriages, self._arm.T):
            matrix = matrix + carriage.mobility * np.outer(arm, arm)
        self.contact = StepContact(matrix, None if sliding is None else sliding.friction)

    def go(self, steps: int, keep: Callable[[int], bool]) -> Impact:
        march, striker, carriages, n = self.march, self.striker, self.carriages, len(self._gap)
        state, at = march.start(), [carriage.begin() for carriage in carriages]
        slip, traction = self._arm[n:] @ [one.x for one in at], np.zeros(len(self._arm))
        energy, heat, done, pushed = march.energy(state), 0.0, 0.0, np.zeros(len(carriages))
        stored = self._stored(energy, at, traction)
        begun = sum(stored)
        rows, energies = [self._row(0.0, at, pushed, heat)], [(*stored, begun)]
        tractions, status = [traction], [np.zeros(n, int)]
        states = {0: state} if keep(0) else {}
        for k in range(1, steps + 1):
            time, free = k * march.step, march.free(state)
            ahead = [carriage.predicted(one, time) for carriage, one in zip(carriages, at)]
            before, traction, touching = traction, np.zeros(len(self._arm)), np.zeros(n, int)
            if striker.release is None or time <= striker.release:
                traction, touching = self.contact.solve(free[1] + self._arm @ ahead + np.r_[self._gap, -slip])
            following = march.advance(state, traction, free)
            energy = march.energy(following, (state, energy))
            past, pushed = pushed, self._arm.T @ traction
            former, at = at, [c.moved(one, *rest) for c, one, *rest in zip(carriages, at, ahead, pushed)]
            for carriage, mean, one, other in zip(carriages, (pushed + past) / 2, former, at):
                done += carriage.work(mean, other.x - one.x)
            own = (self.struck.local @ traction)[n:]  # what the striker's yielding adds to the slip
            left, slip = slip, following.q[n:] + own + self._arm[n:] @ [one.x for one in at]
            heat -= float((traction + before)[n:] @ (slip - left)) / 2
            rows.append(self._row(time, at, pushed, heat))
            energies.append((*self._stored(energy, at, traction), begun + done))
            tractions.append(traction)
            status.append(touching)
            state = following
            if keep(k):
                states[k] = state
        times, heats, x, v, force, slide, slide_velocity, drag = np.array(rows).T
        both = np.array(tractions)
        return Impact(
            self.struck, times, x, v, force, both[:, :n], np.array(energies), both[:, n:], slide, slide_velocity, drag,
            heats, np.array(status), states,
        )  # fmt: skip

    def _row(self, time: float, at: list[StrikerMotion], pushed: np.ndarray, heat: float) -> tuple[float, ...]:
        """Time, heat, and position, velocity, force along the axis and along the face, 0 where it does not slide."""
        motions = [(one.x, one.v, force) for one, force in zip(at, pushed)] + [(0.0, 0.0, 0.0)]
        return time, heat, *motions[0], *motions[1]

    def _stored(self, energy: Energy, at: list[StrikerMotion], traction: np.ndarray) -> tuple[float, float, float]:
        """Kinetic and strain energy of the body (and of the striker's yielding), kinetic energy of the striker."""
        moving = sum(carriage.energy(one) for carriage, one in zip(self.carriages, at))
        own = 0.5 * float(traction @ self.struck.local @ traction)
        return energy.kinetic, energy.strain + own, moving
