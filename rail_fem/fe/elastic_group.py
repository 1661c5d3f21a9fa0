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
from rail_fem.fe.elastic_kernels import Modes, add_functions, kick_modes, rates_of_functions, work_on_functions
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
    SCRATCH: ClassVar[tuple[str, ...]] = ("work", "rates", "pressed", "push")

    def __post_init__(self) -> None:
        # of the elements' forces on each function [N], and how fast each moves [m/s]
        self.work, self.rates = np.zeros((2, self.body.functions.shape[2]))
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
        square, self.modes = np.maximum(square[kept], 0.0), modes[:, kept]
        self.frequencies = np.sqrt(square)  # with the rigid motion held [rad/s]
        of_functions = np.ascontiguousarray(self.modes[: self.size])
        b = body.momentum @ self.modes + momentum @ of_functions
        self.decoupled = Modes(of_functions, square, 2 * self.damping_ratio * self.frequencies, b, b @ b.T)
        self.amplitude, self.rate, self.pressed, self.push = np.zeros((4, len(square)))
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

    def frequency(self, dampers: float) -> float:
        """Of the fastest mode, the rigid motion free where it is [rad/s]."""
        free = [c for c in range(3) if self.free[c] and self.mass > 0]
        b = self.decoupled.momentum[free]
        mass = np.block([[self.mass * np.eye(len(free)), b], [b.T, np.eye(len(self.rate))]])
        stiffness = np.diag(np.r_[np.zeros(len(free)), self.frequencies**2])
        return float(np.sqrt(eigh(stiffness, mass, eigvals_only=True)[-1]))

    def bend(self, v: np.ndarray) -> None:
        rates_of_functions(self.decoupled, self.rate, self.rates)
        add_functions(self.nodes, self.functions, self.rates, v)

    def rigid_functions(self, points: np.ndarray) -> np.ndarray:
        """Motions of a rigid body at points (n, 3) [m] (3 n, 9): the first six functions, and along x, y, z."""
        along = np.tile(np.eye(3), (len(points), 1))
        return np.ascontiguousarray(np.hstack([self.body.at(points - self.origin)[:, :RIGID], along]))

    @property
    def rigid_rates(self) -> np.ndarray:
        """(9,) rates of those [m/s]."""
        rates_of_functions(self.decoupled, self.rate, self.rates)
        return np.r_[self.rates[:RIGID], self.velocity]

    def kick(self, upwards: float, dt: float, across: float = 0.0) -> None:
        own, old = self.mass, self.velocity.copy()
        mass = np.where(self.free, (own, own + self.lateral_mass, own), 0.0) if own > 0 else np.zeros(3)
        force = self.reaction + self.load + (0.0, across, upwards)
        moving = self.work, self.amplitude, self.rate, self.velocity
        kicked = kick_modes(self.decoupled, *moving, force, self.reaction, mass, dt, self.pressed, self.push)
        self.dissipated += kicked.dissipated
        self.load_work += dt * float(self.load @ (0.5 * (self.velocity + old)))
        if self.structure.domain.comm.rank == 0:  # the nodes were kicked with the velocity before
            self.structure.works[1] -= 0.5 * dt * kicked.changed

    def drift(self, dt: float) -> None:
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
