"""Contact between two surfaces of a structure: which nodes may come into contact, the forces of a step, on any number
of ranks.

Surface data are replicated; what moves is summed over the ranks twice a step: positions of the nodes near contact, and
their projections, of which each rank computes its part. From these every rank finds the same pressures and applies the
forces on the nodes that it owns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from mpi4py import MPI

from rail_fem.fe.contact import forces as kernel
from rail_fem.fe.contact.continuing import close_pairs, time_to_contact
from rail_fem.fe.contact.near_facets import (
    facet_boxes,
    facet_centres,
    nearest_facets,
    nodes_of,
    share_space,
    with_neighbours,
)
from rail_fem.fe.contact.pairs import (
    AXLE_MOMENT,
    FRICTION_WORK,
    N_SUMS,
    NORMAL_ENERGY,
    TOWED,
    Frames,
    Law,
    NodalForces,
    Nodes,
    Pairs,
    Sliding,
)
from rail_fem.fe.contact.projection import PROJECTION, project_share, take_projections
from rail_fem.fe.contact.surface import Surface, edge_neighbours, node_normals, tributary_areas
from rail_fem.fe.dynamics_part import DynamicsPart
from rail_fem.fe.node_kernels import apply_contact
from rail_fem.fe.structure import Structure

OPPOSED = -0.3  # cosine between the normals of a node and of a facet that it can lie in
START_REACH = 20e-3  # how deep a wrong start is looked for [m]
# fastest that surfaces close: by travelling over surfaces so much apart in slope [1], and on their own [m/s]; by the
# latter too may the rate at which a pair closes change until the next search
SLOPE, APPROACH = 0.1, 2.0
SOON = 3  # steps to the next search where a pair that carried has lost its facet
# how much nearer the surfaces come, and how far the wheel travels, before all facets are looked at again and not only
# those that were so near [m]
NEARER, FARTHER = 1e-3, 8e-3


@dataclass(frozen=True)
class ContactSettings:
    """stiffness : penalty per area [Pa/m];  friction [1];  margin : gap below which a node is watched [m];
    refresh : most steps between searches, None: as many as the motion allows;
    deepest : penetration beyond which a projection is not believed [m]"""

    stiffness: float
    friction: float = 0.0
    margin: float = 0.3e-3
    refresh: int | None = 50
    deepest: float = 1e-3


class Contact(DynamicsPart):
    """Contact of surface `rail` (Lagrangian nodes, carry friction) and surface `wheel`, whose mesh moves along x at
    `speed` and whose material flows through it at angular velocity `spin` about the y axis through `axle` (reference
    coordinates) [rad/s].
    inertia : about the axle, of all that turns with the wheel [kg m2]; None: the spin is held
    yaw : small angle by which the axle heads to +y: only the material's velocity knows of it [rad]
    The rail may stand in a frame of its own that has risen by `raised` [m] and rises at `rise` [m/s]
    (rail_fem.fe.beam_track): positions here are in that frame.

    After `add_forces`: pressure on the rail's nodes and wheel's nodes, `force` (n, 3) on all surface nodes (rail
    first), replicated;
    sums : (N_SUMS,) of the step.
    """

    STATE = (
        "offset",
        "raised",
        "rise",
        "spin",
        "steps_to_search",
        "near",
        "nearer_left",
        "farther_left",
        "started",
        "pairs",
        "position",
        "before",
        "slip",
        "force",
        "normal_force",
        "tributary_area",
        "pressure_at",
        "sums",
        "friction_work",
        "motion_work",
        "rotation",
    )
    SUMMED = ("work",)
    SCRATCH = ("rows", "velocity", "sticking", "moved", "drag", "slot")

    def __init__(
        self,
        structure: Structure,
        rail: Surface,
        wheel: Surface,
        settings: ContactSettings,
        speed=0.0,
        spin=0.0,
        axle=(0.0, 0.0, 0.0),
        fixed=None,
        inertia=None,
        yaw=0.0,
    ):
        self.structure, self.settings, self.speed, self.spin, self.inertia = structure, settings, speed, spin, inertia
        self.yaw = float(yaw)
        domain = structure.domain
        self.comm = domain.comm
        self.n_rail = len(rail.nodes)
        self.input_nodes = np.concatenate([rail.nodes, wheel.nodes])
        n = self.n = len(self.input_nodes)
        self.is_wheel = np.arange(n) >= self.n_rail
        self.local, self.here = domain.local_nodes(self.input_nodes)
        self.reference = self._gather_all(domain.reference)
        mass = self._gather_all(np.repeat(structure.mass, 3))[:, 0]
        self.inverse_mass = 1.0 / mass
        if fixed is not None:
            self.inverse_mass[self._gather_all(np.where(fixed, 1.0, 0.0)).max(axis=1) > 0.5] = 0.0
        self.quads = (rail.quads.astype(np.int64), wheel.quads.astype(np.int64) + self.n_rail)
        self.reachable = np.ones(len(rail.quads), np.bool_)  # facets of the rail that a search looks at
        # facets of rail and wheel, one list, that a search looks at, and until when these are all that matter [m]
        self.near, self.nearer_left, self.farther_left = np.empty(0, np.int64), 0.0, 0.0
        self.neighbours = tuple(edge_neighbours(q) for q in self.quads)
        self.area = sum(tributary_areas(self.reference, q) for q in self.quads)
        self.from_axle = self.reference - np.asarray(axle)
        self.offset, self.raised, self.rise = 0.0, 0.0, 0.0  # how far the wheel's frame has moved along x
        self.position, self.before = self.reference.copy(), self.reference.copy()
        self.velocity = np.zeros((n, 3))
        self.force, self.slip = np.zeros((n, 3)), np.zeros((n, 3))
        self.normal_force, self.tributary_area = np.zeros(n), np.zeros(n)
        self.pressure_at, self.slot = np.zeros(n), np.full(n, -1, np.int64)
        self.sums = np.zeros(N_SUMS)
        self.steps_to_search, self.started = 0, False
        # on the bodies, of the nodes of this rank; of friction and of what tows and drives the wheel; what a free
        # wheel's rotation has gained since the start [J]
        self.work, self.friction_work, self.motion_work, self.rotation = 0.0, 0.0, 0.0, 0.0
        self.pairs = [
            self._pairs(side, np.empty(0, np.int64), np.empty(0, np.int64), np.empty((0, 2))) for side in (0, 1)
        ]
        self._prepare()

    def _pairs(
        self, side: int, slaves: np.ndarray, facets: np.ndarray, where: np.ndarray, usable: np.ndarray | None = None
    ) -> Pairs:
        """Nodes of the rail (side 0) or of the wheel (side 1) over facets of the other; usable : None for none of
        them."""
        usable = np.zeros(len(self.quads[1 - side]), np.bool_) if usable is None else usable
        return Pairs.over(self.quads[1 - side], self.neighbours[1 - side], usable, slaves, facets, where)

    def _gather_all(self, field: np.ndarray) -> np.ndarray:
        """Nodal field at all surface nodes (n, 3), replicated. Collective."""
        out = np.zeros((self.n, 3))
        out[self.here] = field.reshape(-1, 3)[self.local]
        if self.comm.size > 1:
            self.comm.Allreduce(MPI.IN_PLACE, out)
        return out

    def _take_motion(self, nodes: np.ndarray) -> None:
        """`position` [m] and `velocity` [m/s] of these nodes as they are now. Collective."""
        slot, motion = np.full(self.n, -1), np.empty((len(nodes), 6))
        slot[nodes] = np.arange(len(nodes))
        kernel.pack_motion(self.structure.x, self.structure.v, self.local, self.here, slot, motion)
        if self.comm.size > 1:
            self.comm.Allreduce(MPI.IN_PLACE, motion)
        kernel.unpack_motion(motion, nodes, self.n_rail, self.frames, self.position, self.velocity)

    @property
    def frames(self) -> Frames:
        return Frames(self.offset, self.speed, self.raised, self.rise)

    def let_reach(self, facets: np.ndarray) -> None:
        """From now on a search looks at these of the rail's facets (q,) bool; those that come anew count as near.
        Replicated."""
        self.near = np.union1d(self.near, np.flatnonzero(facets & ~self.reachable))
        self.reachable = facets

    def _near_facets(self) -> list[np.ndarray]:
        """Reachable facets of the rail and facets of the wheel that are near, ascending."""
        k = len(self.quads[0])
        rail, wheel = self.near[self.near < k], self.near[self.near >= k] - k
        return [rail[self.reachable[rail]], wheel]

    def search(self, dt: float) -> None:
        """Choose the nodes and facets that may come into contact before the next search, after `steps_to_search` steps
        of dt [s], and where their projections start. All facets are looked at from time to time only. Collective."""
        longest = self.steps_between_searches(dt)
        self._look_ahead(longest * dt)
        facets = self._near_facets()
        reach = self.settings.margin if self.started else START_REACH
        candidates = self._candidates(self.position, facets, np.full(3, reach))
        found = [self._over_nearest(side, *candidates[side], facets[1 - side]) for side in (0, 1)]
        self._project(self.position, *found)
        if not self.started:
            for side in (0, 1):
                self._refuse_deep_start(self.position, found[side], side)
        free = min(time_to_contact(pairs, self.velocity, self.settings.margin, APPROACH) for pairs in found)
        self.steps_to_search = int(min(longest, max(1.0, free / dt)))
        self.nearer_left -= self.steps_to_search * dt * self._approach_velocity()
        self.farther_left -= self.steps_to_search * dt * abs(self.speed)
        rubbed, watched = self.pairs[0].slaves, self.watched
        self.pairs = [self._close_pairs(side, found[side]) for side in (0, 1)]
        self.started = True
        slaves = self.pairs[0].slaves
        slip = self.slip[slaves]
        self.slip[rubbed] = 0.0
        self.slip[slaves] = slip
        for of_nodes in (self.force, self.normal_force, self.pressure_at):
            of_nodes[watched] = 0.0
        self._prepare()

    def _look_ahead(self, ahead: float) -> None:
        """See that `near` holds for this time [s]; position and velocity of its nodes as they are now. Collective."""
        nearer, farther = ahead * self._approach_velocity(), ahead * abs(self.speed)
        if nearer > self.nearer_left or farther > self.farther_left:
            self._take_motion(np.arange(self.n))
            self.nearer_left, self.farther_left = max(NEARER, nearer), max(FARTHER, farther)
            self.near = self._look_at_all(self.position)
        else:
            facets = self._near_facets()
            self._take_motion(np.concatenate([nodes_of(q, f, self.n) for q, f in zip(self.quads, facets)]))

    def _over_nearest(self, side: int, nodes: np.ndarray, opposite: np.ndarray, allowed: np.ndarray) -> Pairs:
        """Each of the nodes over the nearest of the facets `opposite`; projections stay on the facets `allowed` (k,).
        Each rank finds those of its part of the projections. Rank-local."""
        usable = np.zeros(len(self.quads[1 - side]), np.bool_)
        usable[allowed] = True
        nearest = np.zeros(len(nodes), np.int64)
        if len(nodes):
            centres = facet_centres(self.position, self.quads[1 - side], opposite)
            nearest = nearest_facets(self.position, nodes, self.comm.rank, self.comm.size, centres)
        return self._pairs(side, nodes, opposite[nearest], np.zeros((len(nodes), 2)), usable)

    def _close_pairs(self, side: int, found: Pairs) -> Pairs:
        """Those with a gap within the margin; projections stay on the facets near them. Replicated."""
        s, slot = self.settings, np.empty(self.n, np.int64)
        number, facets, where, ahead = close_pairs(found, self.pairs[side], s.margin, s.deepest, slot)
        around = with_neighbours(facets, found.neighbours, 2) & found.usable
        return self._pairs(side, found.slaves[number], facets, where, around)._replace(ahead=ahead)

    def _look_at_all(self, position: np.ndarray) -> np.ndarray:
        """The facets of both surfaces, the rail's first, that can come within the margin of the other's before
        `nearer_left` and `farther_left` are used up. Replicated."""
        reach = (self.settings.margin if self.started else START_REACH) + self.nearer_left
        every = [np.flatnonzero(self.reachable), np.arange(len(self.quads[1]))]
        rail, wheel = self._sharing_space(position, every, reach + np.array([self.farther_left, 0.0, 0.0]))
        return np.concatenate([rail, wheel + len(self.quads[0])])

    def _sharing_space(
        self, position: np.ndarray, facets: list[np.ndarray], reach: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Those of the facets of rail and wheel whose boxes, wider by `reach` (3,) [m], may share space with the
        other's. Replicated."""
        kept = share_space(*(facet_boxes(position, q[f], reach) for q, f in zip(self.quads, facets)))
        return facets[0][kept[0]], facets[1][kept[1]]

    def _candidates(
        self, position: np.ndarray, facets: list[np.ndarray], reach: np.ndarray
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """For each side its nodes and the opposite facets, of those given, that come within reach of the other surface.
        Replicated."""
        near = self._sharing_space(position, facets, reach)
        nodes = [nodes_of(quads, found, self.n) for quads, found in zip(self.quads, near)]
        return [(nodes[k], near[1 - k]) if len(near[1 - k]) else (nodes[k][:0], near[1 - k]) for k in (0, 1)]

    def _refuse_deep_start(self, position: np.ndarray, pairs: Pairs, side: int) -> None:
        """Raise ValueError where a surface starts deeper in the other than contact would believe: such nodes would
        never be pushed out. Replicated."""
        nodes, gap = pairs.slaves, pairs.gap
        outward = node_normals(position, self.quads[side])
        inside = (
            (pairs.facets >= 0)
            & (gap <= -self.settings.deepest)
            & (np.einsum("ij,ij->i", outward[nodes], pairs.normal) < OPPOSED)
        )
        if inside.any():
            worst = np.flatnonzero(inside)[np.argmin(gap[inside])]
            x, y, z = 1e3 * position[nodes[worst]]
            raise ValueError(
                f"the wheel starts inside the rail: {inside.sum()} surface node(s) are deeper than"
                f" {self.settings.deepest * 1e3:g} mm, the worst by {-gap[worst] * 1e3:.3f} mm at ({x:.2f}, {y:.2f},"
                f" {z:.2f}) mm: start with a gap or exact initial contact"
            )

    def _prepare(self) -> None:
        """Which nodes are watched, where they stand in the gathered buffer, and room for the results of a step."""
        watched = np.zeros(self.n, bool)
        for pairs in self.pairs:
            watched[pairs.slaves] = True
            watched[pairs.quads[pairs.usable].ravel()] = True
        self.watched = np.flatnonzero(watched)
        slot = np.full(self.n, -1)
        slot[self.watched] = np.arange(len(self.watched))
        mine = watched[self.here]
        # watched nodes of this rank: local number, position in the surface arrays
        self.own_local, self.own_at = self.local[mine], self.here[mine]
        self.own_slot = slot[self.own_at]
        self.size = 6 * len(self.watched)
        k = len(self.pairs[0].slaves)
        self.rows = np.zeros((k + len(self.pairs[1].slaves), PROJECTION))
        self.sticking, self.moved, self.drag = np.zeros(k, np.bool_), np.zeros((k, 3)), np.zeros((k, 3))

    def after_restore(self) -> None:
        """What follows from the pairs. Replicated."""
        self._prepare()

    def ready(self, dt: float) -> None:
        """A search where one is due."""
        if self.steps_to_search <= 0:
            self.search(dt)
        self.steps_to_search -= 1

    def pack(self, dt: float, mine: np.ndarray) -> None:
        """Watched nodes of this rank at `structure.x` and, by `structure.v` (velocity without contact), dt [s] later; 0
        for all others."""
        kernel.pack(self.structure.x, self.structure.v, dt, self.own_local, self.own_slot, mine.reshape(-1, 6))

    def kick(self, dt: float, summed: np.ndarray) -> None:
        """Forces of the step onto velocities, and their works."""
        self.add_forces(dt, summed)
        s = self.structure
        self.work += apply_contact(
            s.v, s.force, self.force, self.inverse_mass, self.own_local, self.own_at, s.on_small, dt, s.works
        )
        self.friction_work += self.sums[FRICTION_WORK]
        self.motion_work += dt * self.speed * self.sums[TOWED]
        turning = self.turn(dt)
        if self.inertia is None:
            self.motion_work += turning
        else:
            self.rotation += turning

    def drift(self, dt: float) -> None:
        self.offset += dt * self.speed

    def energies(self) -> dict[str, float]:
        return {
            "contact_penalty": self.sums[NORMAL_ENERGY],
            "friction": self.friction_work,
            "prescribed_motion": self.motion_work,
            "rotation": self.rotation,
        }

    def shares(self) -> tuple[float, float]:
        return 0.0, self.work

    def add_forces(self, dt: float, summed: np.ndarray) -> None:
        """Contact forces of the step from what `pack` gave, summed over the ranks -> `force`. Collective."""
        if not len(self.watched):
            self.sums[:] = 0.0
            return
        ranks = self.comm.rank, self.comm.size
        kernel.predict(
            *(summed.reshape(-1, 6), self.watched, self.n_rail, self.frames, dt, self.before, self.position),
            *(*self.pairs, *ranks, self.rows),
        )
        if self.comm.size > 1:
            self.comm.Allreduce(MPI.IN_PLACE, self.rows)
        s = self.settings
        lost = kernel.contact_forces(
            self.rows,
            *self.pairs,
            self.watched,
            self.n_rail,
            Nodes(self.area, self.inverse_mass, self.from_axle, self.position, self.before),
            Law(1.0 / s.stiffness, float(s.friction), float(s.deepest)),
            self.spin,
            self.yaw,
            dt,
            NodalForces(self.tributary_area, self.normal_force, self.force, self.pressure_at, self.slip, self.slot),
            Sliding(self.sticking, self.moved, self.drag),
            self.sums,
        )
        if lost:
            self.steps_to_search = min(self.steps_to_search, SOON)

    def _project(self, position: np.ndarray, *all_pairs: Pairs) -> None:
        """Projections of pairs at positions (n, 3), each rank its part of them; the same numbers on any number of
        ranks. Collective."""
        ends = np.cumsum([0, *(len(pairs.slaves) for pairs in all_pairs)])
        rows = np.empty((ends[-1], PROJECTION))
        for pairs, first, last in zip(all_pairs, ends[:-1], ends[1:]):
            project_share(position, pairs, self.comm.rank, self.comm.size, rows[first:last])
        if self.comm.size > 1:
            self.comm.Allreduce(MPI.IN_PLACE, rows)
        for pairs, first, last in zip(all_pairs, ends[:-1], ends[1:]):
            take_projections(rows[first:last], pairs)

    def steps_between_searches(self, dt: float) -> int:
        """How many steps of dt [s] surfaces that are two margins apart need to come into contact at the soonest. Nodes
        and facets farther from each other a search does not look at; of nearer ones it knows gap and rate
        (`time_to_contact`)."""
        steps = max(int(2 * self.settings.margin / (self._approach_velocity() * dt)), 1)
        return steps if self.settings.refresh is None else min(steps, self.settings.refresh)

    def _approach_velocity(self) -> float:
        """How fast the surfaces come nearer to each other at most [m/s]."""
        return SLOPE * abs(self.speed) + APPROACH

    def carrying_x(self) -> np.ndarray:
        """Positions along x [m] of the rail's nodes that carry normal force. Replicated."""
        carries = np.flatnonzero(self.normal_force[: self.n_rail] > 0)
        return self.position[carries, 0]

    def overlap(self) -> list[float]:
        """How deep the surfaces lie in one another after the step before the last, at the pairs that carry: largest
        [m], force times overlap summed up [N m], force [N]. Measured on the geometry. Replicated. Collective."""
        deepest = work = force = 0.0
        for pairs in self.pairs:
            there = pairs._replace(
                facets=pairs.facets.copy(),
                where=pairs.where.copy(),
                gap=np.zeros_like(pairs.gap),
                normal=np.zeros_like(pairs.normal),
                ahead=np.zeros_like(pairs.ahead),
                weight=np.zeros_like(pairs.weight),
            )
            self._project(self.before, there)
            carries = pairs.active & (there.facets >= 0) & (pairs.pressure > 0)
            depth, normal_force = (
                np.maximum(-there.gap[carries], 0.0),
                pairs.pressure[carries] * self.area[pairs.slaves[carries]],
            )
            deepest = max(deepest, float(depth.max(initial=0.0)))
            work, force = work + float(normal_force @ depth), force + float(normal_force.sum())
        return [deepest, work, force]

    def turn(self, dt: float) -> float:
        """Spin after the step, where it is free, from the moment of its forces; returns the work of that moment on the
        turning wheel [J].

        The step's forces went with the spin at its start; the work goes with the mean, so it is the change of the
        rotation's energy exactly.
        """
        moment, before = float(self.sums[AXLE_MOMENT]), self.spin
        if self.inertia is not None:
            self.spin += dt * moment / self.inertia
        return dt * moment * 0.5 * (before + self.spin)
