"""Impact with Coulomb friction: a striker that also moves along the face that it strikes.

The striker moves along its axis and along the tangent beside it; it does not turn. Pressures and shears of a step
follow from the gaps at its end and from the slip in it, so that each node is open, sticks, or slides against its shear
at the bound. Gaps are those of the outlines where they met: slides are small beside the radius. What slips turns into
heat, which belongs to the balance of energy.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import cast

import numpy as np

from bem.checks import refuse_unless_finite, refuse_unless_positive
from bem.dynamic.body import DynamicsError
from bem.dynamic.impact import (
    Carriage,
    Impact,
    Striker,
    StrikerMotion,
    Struck,
    check_strike,
    strike,
    warn_of_edges,
    warn_unless_touching,
)
from bem.dynamic.marching import March
from bem.dynamic.pivoting import FrictionalContact
from bem.plane.coulomb import STICK, refuse_bad_friction


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


@dataclass
class SlidingImpact(Impact):
    """An Impact with friction, k + 1 instants: shear (k+1, n) [Pa] on the struck body along its tangent (the normal
    turned clockwise); slide, slide_velocity, drag (k+1,) of the striker along its tangent [m, m/s] and the force on it
    [N/m]; heat (k+1,) of slipping since the beginning [J/m]; status (k+1, n) open 0, stick 2, slip 1 and -1.

    energy : the striker's kinetic energy and the work along the tangent are counted in.
    """

    shear: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    slide: np.ndarray = field(default_factory=lambda: np.zeros(0))
    slide_velocity: np.ndarray = field(default_factory=lambda: np.zeros(0))
    drag: np.ndarray = field(default_factory=lambda: np.zeros(0))
    heat: np.ndarray = field(default_factory=lambda: np.zeros(0))
    status: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), int))

    @property
    def imbalance(self) -> np.ndarray:
        """Energy and heat beyond the work done (k+1,), over the largest total so far."""
        total = self.energy[:, :3].sum(axis=1)
        scale = np.maximum(np.maximum.accumulate(np.abs(total)), 1e-300)
        return (total + self.heat - self.energy[:, 3]) / scale

    @property
    def sticking(self) -> np.ndarray:
        """Share of the touching nodes that stick (k+1,); NaN where none touches."""
        touch = (self.status != 0).sum(axis=1)
        return np.where(touch > 0, (self.status == STICK).sum(axis=1) / np.maximum(touch, 1), np.nan)


def strike_sliding(
    struck: Struck,
    striker: Striker,
    sliding: TangentialMotion,
    march: March,
    steps: int,
    keep: Callable[[int], bool] | None = None,
) -> Impact:
    """As bem.dynamic.impact.strike, with friction. A body that was not made ready for it takes friction 0 only: that is
    the impact of `strike`, the same bits.

    Raises DynamicsError, ConvergenceError (bem.plane.coulomb) where no consistent sticking and sliding is found.
    """
    if not struck.friction:
        if sliding.friction == 0:
            return strike(struck, striker, march, steps, keep)
        raise DynamicsError("the struck body knows pressures only: make it with Struck(..., friction=True)")
    check_strike(struck, march, steps)
    impact = _SlidingRun(struck, striker, sliding, march).go(steps, keep or (lambda k: False))
    warn_unless_touching(impact)
    warn_of_edges(impact)
    return impact


class _SlidingRun:
    """One march with a striker that slides."""

    def __init__(self, struck: Struck, striker: Striker, sliding: TangentialMotion, march: March) -> None:
        self.struck, self.striker, self.march = struck, striker, march
        both = striker, sliding.striker(striker.axis)
        self._carriages = [Carriage(one, march) for one in both]
        normals, weight = struck.interface.normals, struck.mass[:, None]
        tangents = np.column_stack([normals[:, 1], -normals[:, 0]])
        axes = np.array([one.axis for one in both]).T
        # gaps and slips per unit of both motions, and forces on the striker per unit of pressure and shear
        self._arm = np.vstack([weight * (normals @ axes), -weight * (tangents @ axes)])
        self._gap = struck.mass * struck.interface.gap
        mobility = np.array([carriage.mobility for carriage in self._carriages])
        matrix = march.compliance + struck.local + (self._arm * mobility) @ self._arm.T
        self._contact = FrictionalContact((matrix + matrix.T) / 2, sliding.friction)

    def go(self, steps: int, keep: Callable[[int], bool]) -> SlidingImpact:
        march, striker, carriages, n = self.march, self.striker, self._carriages, len(self._gap)
        state, at = march.start(), [carriage.begin() for carriage in carriages]
        slip, traction = self._arm[n:] @ [one.x for one in at], np.zeros(2 * n)
        energy, heat, done = march.energy(state), 0.0, 0.0
        stored = self._stored(energy, at, traction)
        begun = sum(stored)
        rows, energies = [(0.0, at[0].x, at[0].v, 0.0, at[1].x, at[1].v, 0.0, 0.0)], [(*stored, begun)]
        tractions, status = [traction], [np.zeros(n, int)]
        states = {0: state} if keep(0) else {}
        for k in range(1, steps + 1):
            time, free = k * march.step, march.free(state)
            ahead = [carriage.predicted(one, time) for carriage, one in zip(carriages, at)]
            moved = free[1] + self._arm @ ahead
            before, traction, touching = traction, np.zeros(2 * n), np.zeros(n, int)
            if striker.release is None or time <= striker.release:
                found = self._contact.solve(self._gap + moved[:n], moved[n:] - slip)
                traction, touching = np.r_[found.pressure, found.shear], found.state
            following = march.advance(state, traction, free)
            energy = march.energy(following, (state, energy))
            pushed, mean = self._arm.T @ traction, self._arm.T @ (traction + before) / 2
            former, at = at, [c.moved(one, *rest) for c, one, *rest in zip(carriages, at, ahead, pushed)]
            done += sum(
                carriage.work(mean[i], at[i].x - former[i].x) for i, carriage in enumerate(carriages)
            )  # fmt: skip
            past, slip = slip, following.q[n:] + self._own_slip(traction) + self._arm[n:] @ [one.x for one in at]
            heat -= float((traction + before)[n:] @ (slip - past)) / 2
            rows.append((time, at[0].x, at[0].v, pushed[0], at[1].x, at[1].v, pushed[1], heat))
            energies.append((*self._stored(energy, at, traction), begun + done))
            tractions.append(traction)
            status.append(touching)
            state = following
            if keep(k):
                states[k] = state
        times, x, v, force, slide, slide_velocity, drag, heats = np.array(rows).T
        both = np.array(tractions)
        return SlidingImpact(
            self.struck, times, x, v, force, both[:, :n], np.array(energies), states, shear=both[:, n:], slide=slide,
            slide_velocity=slide_velocity, drag=drag, heat=heats, status=np.array(status),
        )  # fmt: skip

    def _own_slip(self, traction: np.ndarray) -> np.ndarray:
        """What the striker's yielding adds to the slip (n,), weighted."""
        return (self.struck.local @ traction)[len(self._gap) :]

    def _stored(self, energy, at: list[StrikerMotion], traction: np.ndarray) -> tuple[float, float, float]:
        """Kinetic and strain energy of the body (and of the striker's yielding), kinetic energy of the striker."""
        moving = sum(
            0.5 * cast(float, carriage.striker.mass) * one.v**2
            for carriage, one in zip(self._carriages, at)
            if carriage.striker.mass is not None
        )
        own = 0.5 * float(traction @ self.struck.local @ traction)
        return energy.kinetic, energy.strain + own, float(moving)
