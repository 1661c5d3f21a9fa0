"""Contact between two surfaces of a structure: the forces of a step, on any number of ranks.

One rank, of many some, computes them (rail_fem.fe.contact.messages): in a step it hears where the nodes near contact
are, and tells each rank the forces on its nodes. Searches are of all ranks.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from rail_fem.fe.contact import forces as kernel
from rail_fem.fe.contact.messages import ContactMessages
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
from rail_fem.processes.launcher import on_root


class Contact(DynamicsPart):
    """Contact of a rail (Lagrangian nodes, carry friction) and a wheel, whose material flows through its mesh.

    After a step, on its owners, at the surface nodes: force (n, 3), normal_force (n,) [N], pressure_at (n,) as a slave
    [Pa], slip (n, 3) elastic [m], tributary_area (n,) of active pairs [m2]; others know the force on their nodes.
    sums (N_SUMS,) of the step, replicated;  lost : pairs that carried and lost their facet in it
    work : on the bodies, of the nodes of this rank;  friction_work [J]
    """

    STATE = (
        *("wheel", "search", "force", "normal_force", "pressure_at", "slip", "tributary_area"),
        *("sums", "friction_work"),
    )
    SUMMED = ("work",)
    SCRATCH = ("rows", "nodes", "found", "sliding", "lost", "messages")

    def __init__(
        self,
        surfaces: ContactSurfaces,
        settings: ContactSettings,
        wheel: RollingWheel | None = None,
        owners: int | None = None,
    ):
        self.surfaces, self.settings, self.wheel = surfaces, settings, wheel or RollingWheel()
        self.search = PairSearch(surfaces, settings, self.wheel)
        self.messages = ContactMessages(surfaces.comm, surfaces.here, surfaces.ghosts_here, owners)
        self.lost = 0
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
        """Which nodes are watched, what the step's kernels take, and room for their results. Rank-local."""
        s, search = self.surfaces, self.search
        watched = np.zeros(s.n, bool)
        for pairs in self.pairs:
            watched[pairs.slaves] = True
            watched[pairs.quads[pairs.usable].ravel()] = True
        self.is_watched, self.watched = watched, np.flatnonzero(watched)
        mine, others = watched[s.here], watched[s.ghosts_here]
        # watched nodes of this rank: local number, position in the surface arrays
        self.own_local, self.own_at = s.local[mine], s.here[mine]
        self.ghost_local, self.ghost_at = s.ghosts[others], s.ghosts_here[others]
        k = len(self.pairs[0].slaves)
        self.rows = np.zeros((k + len(self.pairs[1].slaves), PROJECTION))
        self.sliding = Sliding(np.zeros(k, np.bool_), np.zeros((k, 3)), np.zeros((k, 3)))
        self.nodes = Nodes(s.area, s.inverse_mass, self.from_axle, search.position, search.before)
        of_nodes = self.tributary_area, self.normal_force, self.force, self.pressure_at, self.slip
        self.found = NodalForces(*of_nodes, np.full(s.n, -1, np.int64))

    def changes(self) -> np.ndarray:
        return np.concatenate([self.own_local, self.ghost_local])

    def looks(self, dt: float) -> bool:
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

    @property
    def is_owner(self) -> bool:
        """Whether this rank computes it, alone or among others."""
        return self.messages.is_owner

    def begin(self, dt: float, summed: np.ndarray) -> None:
        """Watched nodes at `structure.x` and, by `structure.v` (velocity without contact), dt [s] later, to the owners,
        with this rank's share of the step's sums; they answer with the forces. Collective."""
        s, messages = self.surfaces.structure, self.messages
        kernel.pack(s.x, s.v, dt, self.own_local, messages.rows)
        messages.send(summed)
        if self.is_owner:
            self.add_forces(dt)
            messages.answer(summed, self.sums, self.lost, self.force)

    def end(self, summed: np.ndarray) -> None:
        """An owner's answer, sums in place. Collective."""
        if self.is_owner:
            self.messages.sent()
        else:
            self.lost = self.messages.take(summed, self.sums, self.force)
        if self.lost:
            self.search.steps_left = min(self.search.steps_left, SOON)

    def kick(self, dt: float, summed: np.ndarray) -> None:
        """Forces of the step onto velocities, and their works."""
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

    def add_forces(self, dt: float) -> None:
        """Contact forces of the step from what `begin` sent -> `force`, `sums`, `lost`. Collective of the owners."""
        search, wheel, messages, n_rail = self.search, self.wheel, self.messages, self.surfaces.n_rail
        self.sums[:], self.lost, group = 0.0, 0, messages.group
        if not len(self.watched):
            return
        kernel.predict(
            *(messages.given, messages.at, messages.order, n_rail, search.frames, dt, self.nodes),
            *(*self.pairs, group.rank, group.size, self.rows),
        )
        if group.size > 1:
            group.Allreduce(MPI.IN_PLACE, self.rows)
        self.lost = kernel.contact_forces(
            *(self.rows, *self.pairs, self.watched, n_rail, self.nodes, self.law),
            *(wheel.spin, float(wheel.yaw), dt, self.found, self.sliding, self.sums),
        )

    def force_on_rail(self) -> np.ndarray:
        """(3,) [N]. Collective."""
        rail = self.force[: self.surfaces.n_rail]
        return on_root(lambda: np.array([along.sum() for along in rail.T]), self.surfaces.comm)

    def carrying_x(self) -> np.ndarray:
        """Positions along x [m] of the rail's nodes that carry normal force. Collective."""
        rail = self.normal_force[: self.surfaces.n_rail]
        return on_root(lambda: self.search.position[np.flatnonzero(rail > 0), 0], self.surfaces.comm)

    def overlap(self) -> list[float]:
        """How deep the surfaces lie in one another after the step before the last, at the pairs that carry: largest
        [m], force times overlap summed up [N m], force [N]. Measured on the geometry. Collective."""
        return on_root(self._overlap, self.surfaces.comm)

    def _overlap(self) -> list[float]:
        found = np.zeros(3)
        for pairs in self.pairs:
            add_overlap(self.search.before, pairs, self.surfaces.area, found)
        return found.tolist()
