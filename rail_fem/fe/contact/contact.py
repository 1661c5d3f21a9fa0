"""Contact between two surfaces of a structure: the forces of a step, on any number of ranks.

What moves is summed over the ranks twice a step: positions of the nodes near contact, in the step's message, and their
projections, of which each rank computes its part. From these every rank finds the same pressures and applies the forces
on the nodes that it has.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from rail_fem.fe.contact import forces as kernel
from rail_fem.fe.contact.pairs import (
    AXLE_MOMENT,
    FRICTION_WORK,
    N_SUMS,
    NORMAL_ENERGY,
    TOWED,
    Law,
    NodalForces,
    Nodes,
    Pairs,
    Sliding,
)
from rail_fem.fe.contact.projection import PROJECTION, add_overlap
from rail_fem.fe.contact.search import SOON, ContactSettings, PairSearch
from rail_fem.fe.contact.surface import ContactSurfaces
from rail_fem.fe.dynamics_part import DynamicsPart
from rail_fem.fe.node_kernels import apply_contact
from rail_fem.fe.rolling_wheel import RollingWheel


class Contact(DynamicsPart):
    """Contact of a rail (Lagrangian nodes, carry friction) and a wheel, whose material flows through its mesh.

    After `add_forces`, at the surface nodes: force (n, 3), normal_force (n,) [N], pressure_at (n,) as a slave [Pa],
    slip (n, 3) elastic [m], tributary_area (n,) of active pairs [m2];  sums (N_SUMS,) of the step;  all replicated.
    work : on the bodies, of the nodes of this rank;  friction_work [J]
    """

    STATE = (
        *("wheel", "search", "force", "normal_force", "pressure_at", "slip", "tributary_area"),
        *("sums", "friction_work"),
    )
    SUMMED = ("work",)
    SCRATCH = ("rows", "nodes", "found", "sliding")

    def __init__(self, surfaces: ContactSurfaces, settings: ContactSettings, wheel: RollingWheel | None = None):
        self.surfaces, self.settings, self.wheel = surfaces, settings, wheel or RollingWheel()
        self.search = PairSearch(surfaces, settings, self.wheel)
        self.from_axle, n = surfaces.reference - np.asarray(self.wheel.axle), surfaces.n
        self.law = Law(1.0 / settings.stiffness, float(settings.friction), float(settings.deepest))
        self.force, self.slip = np.zeros((n, 3)), np.zeros((n, 3))
        self.normal_force, self.tributary_area = np.zeros(n), np.zeros(n)
        self.pressure_at = np.zeros(n)
        self.sums = np.zeros(N_SUMS)
        self.work, self.friction_work = 0.0, 0.0
        self.after_restore()

    @property
    def pairs(self) -> list[Pairs]:
        """To watch until the next search, of the rail's nodes and of the wheel's."""
        return self.search.pairs

    def after_restore(self) -> None:
        """Which nodes are watched, where they stand in the step's message, what its kernels take, and room for their
        results. Rank-local."""
        s, search = self.surfaces, self.search
        watched = np.zeros(s.n, bool)
        for pairs in self.pairs:
            watched[pairs.slaves] = True
            watched[pairs.quads[pairs.usable].ravel()] = True
        self.watched = np.flatnonzero(watched)
        slot = np.full(s.n, -1)
        slot[self.watched] = np.arange(len(self.watched))
        mine = watched[s.here]
        # watched nodes of this rank: local number, position in the surface arrays
        self.own_local, self.own_at = s.local[mine], s.here[mine]
        self.own_slot = slot[self.own_at]
        others = watched[s.ghosts_here]
        self.ghost_local, self.ghost_at = s.ghosts[others], s.ghosts_here[others]
        self.size = 6 * len(self.watched)
        k = len(self.pairs[0].slaves)
        self.rows = np.zeros((k + len(self.pairs[1].slaves), PROJECTION))
        self.sliding = Sliding(np.zeros(k, np.bool_), np.zeros((k, 3)), np.zeros((k, 3)))
        self.nodes = Nodes(s.area, s.inverse_mass, self.from_axle, search.position, search.before)
        of_nodes = self.tributary_area, self.normal_force, self.force, self.pressure_at, self.slip
        self.found = NodalForces(*of_nodes, np.full(s.n, -1, np.int64))

    def changes(self) -> np.ndarray:
        return np.concatenate([self.own_local, self.ghost_local])

    def looks(self) -> bool:
        return self.search.steps_left <= 0

    def ready(self, dt: float) -> bool:
        """A search where one is due."""
        rubbed, watched = self.pairs[0].slaves, self.watched
        if not self.search.due(dt):
            return False
        slaves = self.pairs[0].slaves
        slip = self.slip[slaves]
        self.slip[rubbed] = 0.0
        self.slip[slaves] = slip
        for of_nodes in (self.force, self.normal_force, self.pressure_at):
            of_nodes[watched] = 0.0
        self.after_restore()
        return True

    def pack(self, dt: float, mine: np.ndarray) -> None:
        """Watched nodes of this rank at `structure.x` and, by `structure.v` (velocity without contact), dt [s] later; 0
        for all others."""
        s = self.surfaces.structure
        kernel.pack(s.x, s.v, dt, self.own_local, self.own_slot, mine.reshape(-1, 6))

    def kick(self, dt: float, summed: np.ndarray) -> None:
        """Forces of the step onto velocities, and their works."""
        self.add_forces(dt, summed)
        s = self.surfaces.structure
        moving = s.v, s.force, self.force, self.surfaces.inverse_mass
        self.work += apply_contact(*moving, self.own_local, self.own_at, s.on_small, dt, s.works)
        if len(self.ghost_local):  # their owners count the work
            apply_contact(*moving, self.ghost_local, self.ghost_at, s.on_small, dt, np.empty(3))
        self.friction_work += self.sums[FRICTION_WORK]
        self.wheel.kick(float(self.sums[AXLE_MOMENT]), float(self.sums[TOWED]), dt)

    def drift(self, dt: float) -> None:
        self.wheel.drift(dt)

    def energies(self) -> dict[str, float]:
        return {
            "contact_penalty": self.sums[NORMAL_ENERGY],
            "friction": self.friction_work,
            "prescribed_motion": self.wheel.towed,
            "rotation": self.wheel.rotation,
        }

    def shares(self) -> tuple[float, float]:
        return 0.0, self.work

    def add_forces(self, dt: float, summed: np.ndarray) -> None:
        """Contact forces of the step from what `pack` gave, summed over the ranks -> `force`. Collective."""
        if not len(self.watched):
            self.sums[:] = 0.0
            return
        search, wheel, comm, n_rail = self.search, self.wheel, self.surfaces.comm, self.surfaces.n_rail
        kernel.predict(
            *(summed.reshape(-1, 6), self.watched, n_rail, search.frames, dt),
            *(search.before, search.position, *self.pairs, comm.rank, comm.size, self.rows),
        )
        if comm.size > 1:
            comm.Allreduce(MPI.IN_PLACE, self.rows)
        lost = kernel.contact_forces(
            *(self.rows, *self.pairs, self.watched, n_rail, self.nodes, self.law),
            *(wheel.spin, float(wheel.yaw), dt, self.found, self.sliding, self.sums),
        )
        if lost:
            search.steps_left = min(search.steps_left, SOON)

    def force_on_rail(self) -> np.ndarray:
        """(3,) [N]. Replicated."""
        return np.array([along.sum() for along in self.force[: self.surfaces.n_rail].T])

    def carrying_x(self) -> np.ndarray:
        """Positions along x [m] of the rail's nodes that carry normal force. Replicated."""
        carries = np.flatnonzero(self.normal_force[: self.surfaces.n_rail] > 0)
        return self.search.position[carries, 0]

    def overlap(self) -> list[float]:
        """How deep the surfaces lie in one another after the step before the last, at the pairs that carry: largest
        [m], force times overlap summed up [N m], force [N]. Measured on the geometry. Replicated."""
        found = np.zeros(3)
        for pairs in self.pairs:
            add_overlap(self.search.before, pairs, self.surfaces.area, found)
        return found.tolist()
