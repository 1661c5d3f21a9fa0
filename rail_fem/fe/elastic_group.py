"""A group of nodes that rides on an elastic body, which the group's rigid motion holds: a wheel's sector on rim, web
and hub, held by the axle.

The body is condensed (rail_fem.fe.condensed_body): its displacement relative to the rigid motion is a sum
of few coordinates, functions of the nodes first, then modes of the body behind them. With the mass of the nodes they
are decoupled once, into modes z of mass 1 and momentum b per rate, and kicked with the rigid motion U together,

    z'' + b^T U'' = forces on z - w^2 z - 2 d w z',    m U'' + b z'' = forces on U,

by central differences as all else; d is the share of critical damping. Replicated: every rank does the same.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from scipy.linalg import eigh

from rail_fem.fe.condensed_body import RIGID, Condensed
from rail_fem.fe.elastic_kernels import add_velocity_of_functions, work_on_functions
from rail_fem.fe.structure import Structure
from rail_fem.fe.supports import RigidGroup

FASTEST = 2 * np.pi * 25e3  # of the modes that are kept [rad/s]: faster ones would shorten the step


@dataclass(kw_only=True)
class ElasticGroup(RigidGroup):
    """body : that the nodes ride on;  origin : of its functions (3,) [m];  damping_ratio : of each mode

    amplitude, rate (m,) : of the modes z;  dissipated : by their damping so far [J]
    """

    body: Condensed
    origin: np.ndarray
    damping_ratio: float
    amplitude: np.ndarray = field(default_factory=lambda: np.zeros(0))
    rate: np.ndarray = field(default_factory=lambda: np.zeros(0))
    dissipated: float = 0.0

    STATE: ClassVar[tuple[str, ...]] = (*RigidGroup.STATE, "amplitude", "rate", "dissipated")
    SCRATCH: ClassVar[tuple[str, ...]] = ("work",)

    def __post_init__(self) -> None:
        self.work = np.zeros(self.body.functions.shape[2])  # of the elements' forces on each function [N]
        self.size = len(self.work)  # type: ignore[misc]

    def join(self, structure: Structure, local: np.ndarray) -> None:
        super().join(structure, local)
        self.structure, self.nodes, domain, body = structure, local, structure.domain, self.body
        self.functions = np.ascontiguousarray(body.at(domain.reference.reshape(-1, 3)[local] - self.origin))
        weights = np.repeat(np.where(local < domain.n_owned, structure.mass[local], 0.0), 3)
        own = domain.comm.allreduce((weights[:, None] * self.functions).T @ self.functions)
        momentum = domain.comm.allreduce(np.stack([weights[c::3] @ self.functions[c::3] for c in range(3)]))
        mass = body.mass.copy()
        mass[: self.size, : self.size] += own
        self.inertia = mass
        square, modes = eigh(body.stiffness, mass)
        kept = square < FASTEST**2
        square, self.modes = square[kept], modes[:, kept]
        self.frequencies = np.sqrt(np.maximum(square, 0.0))  # with the rigid motion held [rad/s]
        self.of_functions = np.ascontiguousarray(self.modes[: self.size])
        self.momentum = body.momentum @ self.modes + momentum @ self.of_functions
        self.amplitude, self.rate = np.zeros((2, len(square)))
        self.behind = self.modes.T @ body.mass @ self.modes, body.momentum @ self.modes

    def pack(self, force: np.ndarray, mine: np.ndarray) -> None:
        work_on_functions(force, self.nodes, self.structure.domain.n_owned, self.functions, mine)

    def take(self, summed: np.ndarray) -> None:
        self.work[:] = summed

    @property
    def mass(self) -> float:
        """Of nodes, body and added mass [kg], without `lateral_mass`."""
        return self.node_mass + self.added_mass + self.body.weight

    def relaxing(self, damping: float) -> ElasticGroup:
        body = self.body.for_relaxation(damping / 2)
        return ElasticGroup(self.name, self.input_nodes, body=body, origin=self.origin, damping_ratio=1.0)

    def stand_as(self, other: ElasticGroup) -> None:
        super().stand_as(other)
        self.amplitude = self.modes.T @ self.inertia @ (other.modes @ other.amplitude)

    @property
    def frequency(self) -> float:  # type: ignore[override]
        """Of the fastest mode, the rigid motion free where it is [rad/s]."""
        free = [c for c in range(3) if self.free[c] and self.mass > 0]
        b = self.momentum[free]
        mass = np.block([[self.mass * np.eye(len(free)), b], [b.T, np.eye(len(self.rate))]])
        stiffness = np.diag(np.r_[np.zeros(len(free)), self.frequencies**2])
        return float(np.sqrt(eigh(stiffness, mass, eigvals_only=True)[-1]))

    def bend(self, v: np.ndarray) -> None:
        add_velocity_of_functions(v, self.nodes, self.functions, self.of_functions @ self.rate)

    def rigid_functions(self, points: np.ndarray) -> np.ndarray:
        """The first six functions (3 n, 6), motions of a rigid body, at points (n, 3) [m]."""
        return self.body.at(points - self.origin)[:, :RIGID]

    @property
    def rigid_rates(self) -> np.ndarray:
        """(6,) rates of those [m/s]."""
        return self.of_functions[:RIGID] @ self.rate

    def kick(self, upwards: float, dt: float, across: float = 0.0) -> None:
        pressed = self.work @ self.of_functions
        damping = 2 * self.damping_ratio * self.frequencies * self.rate
        push = pressed - self.frequencies**2 * self.amplitude - damping
        free = [c for c in range(3) if self.free[c] and self.mass > 0]
        force = self.reaction + self.load + (0.0, across, upwards)
        b = self.momentum[free]
        mass = np.diag([self.mass + (self.lateral_mass if c == 1 else 0.0) for c in free]) - b @ b.T
        rigid = np.linalg.solve(mass, force[free] - b @ push) if free else np.zeros(0)
        change, old = dt * (push - b.T @ rigid), self.velocity.copy()
        self.velocity[free] += dt * rigid
        self.dissipated += dt * float(damping @ (self.rate + 0.5 * change))
        self.load_work += dt * float(self.load @ (0.5 * (self.velocity + old)))
        self.rate += change
        if self.structure.domain.comm.rank == 0:  # the nodes were kicked with the velocity before
            changed = float(pressed @ change + self.reaction @ (self.velocity - old))
            self.structure.works[1] -= 0.5 * dt * changed

    def drift(self, dt: float) -> None:
        super().drift(dt)
        self.amplitude += dt * self.rate

    def kinetic_energy(self) -> float:
        """Of the added mass and the body [J]; the nodes' own is counted with the nodes."""
        mass, momentum = self.behind
        rigid = 0.5 * self.body.weight * float(self.velocity @ self.velocity) + self.velocity @ momentum @ self.rate
        return super().kinetic_energy() + float(rigid + 0.5 * self.rate @ mass @ self.rate)

    def spring_power(self) -> float:
        """Power of the body's elastic forces [W]."""
        return -float(self.frequencies**2 * self.amplitude @ self.rate)

    def spring_energy(self) -> float:
        """Elastic energy of the body [J]."""
        return 0.5 * float((self.frequencies * self.amplitude) ** 2 @ np.ones(len(self.rate)))
