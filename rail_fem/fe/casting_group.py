"""The group of nodes on which a casting's meshes end, on an elastic block between them and the casting's rigid foot
(rail_fem.fe.condensed_body.CondensedBlock): plane sections at stations, in place of one plane.

A section has the lumped mass of the block's steel and of the nodes that ride on it, those that a travelling window does
not compute too, so that each motion is kicked by itself, relative to the foot of velocity U,

    m (a'' + r U'') = forces of the elements - K a - d m a',    M U'' = forces of supports + r^T (K a + d m a'),

r the motions of a foot that rises. What makes the nodes outside a window heavier than steel is not the sections' but
the foot's: M is the mass of the case less all the rest. Replicated: every rank does the same.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from rail_fem.fe.condensed_body import CondensedBlock
from rail_fem.fe.elastic_kernels import Riding, add_sections, kick_sections, mass_on_sections, work_on_sections
from rail_fem.fe.structure import Structure
from rail_fem.fe.supports import RigidGroup

# of the sections' rates over the foot [1/s]: 2 % of critical at 6 kHz, the first mode of a block of 100 mm
DAMPING = 2 * 0.02 * 2 * np.pi * 6e3


@dataclass(kw_only=True)
class CastingGroup(RigidGroup):
    """block : that the nodes ride on;  steel (m,) : its lumped mass [kg; kg m2];  damping [1/s]
    own_mass (n_nodes,), own_total : of local nodes, and of all of the mesh, as steel [kg]

    amplitude, rate (m,) : of the sections relative to the foot [m, rad];  dissipated : by their damping so far [J]
    """

    block: CondensedBlock
    steel: np.ndarray
    own_mass: np.ndarray
    own_total: float
    damping: float = DAMPING
    amplitude: np.ndarray = field(default_factory=lambda: np.zeros(0))
    rate: np.ndarray = field(default_factory=lambda: np.zeros(0))
    dissipated: float = 0.0

    STATE: ClassVar[tuple[str, ...]] = (*RigidGroup.STATE, "amplitude", "rate", "dissipated")
    SCRATCH: ClassVar[tuple[str, ...]] = ("work", "push")
    weighs_nodes: ClassVar[bool] = True

    def __post_init__(self) -> None:
        self.size = len(self.steel)  # type: ignore[misc]
        self.work, self.push, self.amplitude, self.rate = np.zeros((4, self.size))
        self.along_z = self.block.along_z
        self.riding: Riding | None = None

    def weigh(self, structure: Structure, own: np.ndarray, touched: np.ndarray) -> None:
        super().weigh(structure, own, touched)
        if self.riding is None:
            self.structure, domain = structure, structure.domain
            body = np.zeros(domain.n_nodes, np.int64)
            for number, region in enumerate(self.block.regions):
                body[domain.cells[domain.region == region]] = number
            self.ones = np.ones(domain.n_nodes)
            self.riding = Riding(*self.block.place(domain.reference.reshape(-1, 3), body))
        # elements press on the nodes that are touched: these keep the mass with which the step is stable
        self.ridden = np.where(own, np.where(touched, structure.mass, self.own_mass), 0.0)
        self.inertia = self.steel + self._on_sections(mass_on_sections, self.ridden, self._owned(own))
        self.on_sections = float(self.along_z @ self.inertia)  # mass [kg]

    def _owned(self, nodes: np.ndarray) -> np.ndarray:
        return np.flatnonzero(nodes[: self.structure.domain.n_owned])

    def _on_sections(self, kernel, *what) -> np.ndarray:
        """What a kernel sums up on the sections (m,), of all ranks. Collective."""
        out = np.zeros(self.size)
        kernel(*what, self.riding, out)
        return self.structure.domain.comm.allreduce(out)

    def take_up(self, structure: Structure, before: np.ndarray, own: np.ndarray, touched: np.ndarray) -> float:
        joins, leaves, mass = self._owned(own & ~before), self._owned(before & ~own), structure.mass
        joining, leaving, old = structure.v.reshape(-1, 3)[joins], self.velocities(leaves), self.rates
        moved, momentum = self._motion(old)
        self.weigh(structure, own, touched)
        mine = np.array(
            [
                mass[joins] @ (joining**2).sum(axis=1) - mass[leaves] @ (leaving**2).sum(axis=1),
                mass[joins] @ joining[:, 2] - mass[leaves] @ leaving[:, 2],
            ]
        )
        kinetic, gained = structure.domain.comm.allreduce(mine)
        pushed = self._on_sections(work_on_sections, structure.v, self.ridden, joins, structure.domain.n_owned)
        stays = self.inertia - self._on_sections(mass_on_sections, self.ridden, joins)
        new = (stays * old + pushed) / self.inertia
        if self.free[2]:
            self.velocity[2] = (momentum + gained - self.along_z @ (self.inertia * new)) / self.foot_mass
        self.rate[:] = new - self.along_z * self.velocity[2]
        return 0.5 * float(moved + kinetic - self._motion(new)[0])

    def _motion(self, rates: np.ndarray) -> tuple[float, float]:
        """Twice the kinetic energy [J], and momentum along z [kg m/s], of foot and sections at rates (m,)."""
        foot, pushed = self.foot_mass * self.velocity[2], self.inertia * rates
        return float(pushed @ rates + foot * self.velocity[2]), float(self.along_z @ pushed + foot)

    @property
    def rates(self) -> np.ndarray:
        """Of the sections, the foot's with them (m,) [m/s, rad/s]."""
        return self.rate + self.along_z * self.velocity[2]

    def displacements(self, nodes: np.ndarray) -> np.ndarray:
        return self._carried(nodes, self.amplitude + self.along_z * self.displacement[2])

    def velocities(self, nodes: np.ndarray) -> np.ndarray:
        return self._carried(nodes, self.rates)

    def motion(self, nodes: np.ndarray, mass: float) -> np.ndarray:
        v, steel = self.velocities(nodes), self.ridden[nodes]
        own = np.array([steel.sum(), *(steel @ v), 0.5 * steel @ (v**2).sum(axis=1)])
        return own + super().motion(nodes, mass - own[0])

    def _carried(self, nodes: np.ndarray, amounts: np.ndarray) -> np.ndarray:
        out = np.zeros(3 * self.structure.domain.n_nodes)
        add_sections(nodes, self.riding, amounts, out)
        return out.reshape(-1, 3)[nodes]

    @property
    def mass(self) -> float:
        """Of nodes, block and added mass [kg]."""
        return self.node_mass + self.added_mass + self.block.weight

    def frequency(self, dampers: float) -> float:
        """Also of dampers [N s/m] that take much of a light foot's velocity in a step."""
        foot = 1 / np.sqrt(self.foot_mass) if self.free[2] or self.added_mass else 0.0  # one that is held may be let go
        stretch = np.column_stack([np.diag(1 / np.sqrt(self.steel)), -foot * self.along_z])
        square = np.linalg.eigvalsh(stretch.T @ self.block.stiffness @ stretch)[-1]
        half = 0.5 * (self.damping * self.on_sections + dampers) * foot**2
        return float(half + np.sqrt(half**2 + square))

    def add_mass_up_to(self, total: float, remedy: str) -> None:
        # what a window does not compute rides as steel: at most all of the mesh
        moving = self.mesh_mass if self.moving_mass is None else self.moving_mass + self.own_total
        least = moving + float(self.along_z @ self.steel)
        if not least < total:
            raise ValueError(
                f"the casting weighs {least:.1f} kg over a foot at foot_depth, the {self.name} {total:.1f} kg in the"
                " case: steel that is modelled cannot be taken away again; give a larger track_mass, a shorter path, a"
                " smaller mass_scaling, or leave foot_depth out"
            )
        self.added_mass = total - self.mesh_mass - self.block.weight

    @property
    def foot_mass(self) -> float:
        """That moves with the foot [kg]: what no section has of the block, and what makes nodes heavier than steel."""
        return self.mass - self.on_sections

    def pack(self, force: np.ndarray, mine: np.ndarray) -> None:
        mine[:] = 0.0
        work_on_sections(force, self.ones, self.members, self.structure.domain.n_owned, self.riding, mine)

    def take(self, summed: np.ndarray) -> None:
        self.work[:] = summed

    def bend(self, v: np.ndarray) -> None:
        add_sections(self.members, self.riding, self.rate, v)

    def kick(self, upwards: float, dt: float, across: float = 0.0) -> None:
        load, old, foot = self.load.item(2), self.velocity.item(2), self.foot_mass if self.free[2] else np.inf
        moving = self.along_z, self.amplitude, self.rate
        rise, kicked = kick_sections(
            *(self.work, self.block.stiffness, self.inertia, self.damping, *moving),
            *(foot, load + upwards, dt, self.push),
        )
        self.velocity[2] = old + rise
        self.load_work += dt * load * (old + 0.5 * rise)
        self.dissipated += kicked.dissipated
        if self.structure.domain.comm.rank == 0:  # the nodes were kicked with the velocity before
            self.structure.works[0] -= 0.5 * dt * kicked.changed

    def drift(self, dt: float) -> None:
        self.amplitude += dt * self.rate

    def relaxing(self, damping: float) -> CastingGroup:
        steel = np.abs(self.block.stiffness).sum(axis=1) / (10 * damping) ** 2
        nodes, none = self.structure.domain.node_input[self.members], np.zeros_like(self.own_mass)
        return CastingGroup(
            self.name, nodes, block=self.block, steel=steel, own_mass=none, own_total=0.0, damping=damping
        )

    def stand_as(self, other: CastingGroup) -> None:
        self.amplitude[:] = other.amplitude

    def kinetic_energy(self) -> float:
        """Of foot, block and nodes, less what is counted with the nodes [J]. Collective."""
        s, own = self.structure, self.members[self.members < self.structure.domain.n_owned]
        counted = s.domain.comm.allreduce(float(s.mass[own] @ (s.v.reshape(-1, 3)[own] ** 2).sum(axis=1)))
        return 0.5 * (self._motion(self.rates)[0] - counted)

    def spring_power(self) -> float:
        """Power of the block's elastic forces [W]."""
        return -float(self.rate @ (self.block.stiffness @ self.amplitude))

    def spring_energy(self) -> float:
        """Elastic energy of the block [J]."""
        return 0.5 * float(self.amplitude @ (self.block.stiffness @ self.amplitude))
