"""Which nodes of one surface may come into contact with which facets of the other before the next search.

All facets are looked at from time to time only, those that were near then in between. Surface data are replicated;
positions of the nodes in question, and projections of which each rank computes its part, are summed over the ranks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from mpi4py import MPI

from rail_fem.fe.contact import forces as kernel
from rail_fem.fe.contact.continuing import close_pairs, time_to_contact
from rail_fem.fe.contact.messages import OWNER
from rail_fem.fe.contact.near_facets import (
    facet_boxes,
    facet_centres,
    nearest_facets,
    nodes_of,
    share_space,
    with_neighbours,
)
from rail_fem.fe.contact.pairs import Frames, Pairs
from rail_fem.fe.contact.projection import PROJECTION, project_share, take_projections
from rail_fem.fe.contact.surface import ContactSurfaces, node_normals
from rail_fem.fe.rolling_wheel import RollingWheel

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


class PairSearch:
    """Searches of a contact. Replicated.

    Attributes: pairs, of the rail's nodes (side 0) and of the wheel's (side 1) over facets of the other, those to watch
    until the next search;  position, before (n, 3) of surface nodes after the step without contact and before it [m],
    as they were when they were last looked at, in the rail's frame;  steps_left to the next search;  raised, rise : of
    the rail's frame, where it has one (rail_fem.fe.beam_track) [m, m/s]
    """

    STATE = (
        "raised",
        "rise",
        "pairs",
        "position",
        "before",
        "near",
        "nearer_left",
        "reachable",
        "farther_left",
        "steps_left",
        "started",
    )
    SCRATCH = ("velocity",)

    def __init__(self, surfaces: ContactSurfaces, settings: ContactSettings, wheel: RollingWheel):
        self.surfaces, self.settings, self.wheel = surfaces, settings, wheel
        self.reachable = np.ones(len(surfaces.quads[0]), np.bool_)  # facets of the rail that a search looks at
        # facets of rail and wheel, one list, that a search looks at, and until when these are all that matter [m]
        self.near, self.nearer_left, self.farther_left = np.empty(0, np.int64), 0.0, 0.0
        self.position, self.before = surfaces.reference.copy(), surfaces.reference.copy()
        self.velocity = np.zeros((surfaces.n, 3))
        self.steps_left, self.started = 0, False
        self.raised, self.rise = 0.0, 0.0
        nobody = np.empty(0, np.int64)
        self.pairs = [self._pairs(side, nobody, nobody, np.empty((0, 2))) for side in (0, 1)]

    @property
    def frames(self) -> Frames:
        return Frames(self.wheel.offset, self.wheel.speed, self.raised, self.rise)

    def due(self, dt: float) -> bool:
        """Count a step of dt [s], after a search where one is due; whether there was one. Collective."""
        due = self.steps_left <= 0
        if due:
            self.search(dt)
        self.steps_left -= 1
        return due

    def _pairs(
        self, side: int, slaves: np.ndarray, facets: np.ndarray, where: np.ndarray, usable: np.ndarray | None = None
    ) -> Pairs:
        """Nodes of the rail (side 0) or of the wheel (side 1) over facets of the other; usable : None for none of
        them."""
        quads, neighbours = self.surfaces.quads[1 - side], self.surfaces.neighbours[1 - side]
        usable = np.zeros(len(quads), np.bool_) if usable is None else usable
        return Pairs.over(quads, neighbours, usable, slaves, facets, where)

    def _share_pairs(self) -> None:
        """What the owners' pairs have come to, which go on from there. Collective."""
        comm = self.surfaces.comm
        if comm.size > 1:
            for pairs in self.pairs:
                for of_pairs in (pairs.facets, pairs.where, pairs.gap, pairs.ahead):
                    comm.Bcast(of_pairs, root=OWNER)

    def _take_motion(self, nodes: np.ndarray) -> None:
        """`position` [m] and `velocity` [m/s] of these nodes as they are now. Collective."""
        s = self.surfaces
        slot, motion = np.full(s.n, -1), np.empty((len(nodes), 6))
        slot[nodes] = np.arange(len(nodes))
        kernel.pack_motion(s.structure.x, s.structure.v, s.local, s.here, slot, motion)
        if s.comm.size > 1:
            s.comm.Allreduce(MPI.IN_PLACE, motion)
        kernel.unpack_motion(motion, nodes, s.n_rail, self.frames, self.position, self.velocity)

    def let_reach(self, facets: np.ndarray) -> None:
        """From now on a search looks at these of the rail's facets (q,) bool; those that come anew count as near.
        Replicated."""
        self.near = np.union1d(self.near, np.flatnonzero(facets & ~self.reachable))
        self.reachable = facets

    def _near_facets(self) -> list[np.ndarray]:
        """Reachable facets of the rail and facets of the wheel that are near, ascending."""
        k = len(self.surfaces.quads[0])
        rail, wheel = self.near[self.near < k], self.near[self.near >= k] - k
        return [rail[self.reachable[rail]], wheel]

    def search(self, dt: float) -> None:
        """Choose the nodes and facets that may come into contact before the next search, after `steps_left` steps of dt
        [s], and where their projections start. Collective."""
        self._share_pairs()
        longest = self.steps_between_searches(dt)
        self._look_ahead(longest * dt)
        facets = self._near_facets()
        reach = self.settings.margin if self.started else START_REACH
        candidates = self._candidates(self.position, facets, np.full(3, reach))
        found = [self._over_nearest(side, *candidates[side], facets[1 - side]) for side in (0, 1)]
        self.project(self.position, *found)
        if not self.started:
            for side in (0, 1):
                self._refuse_deep_start(self.position, found[side], side)
        free = min(time_to_contact(pairs, self.velocity, self.settings.margin, APPROACH) for pairs in found)
        self.steps_left = int(min(longest, max(1.0, free / dt)))
        self.nearer_left -= self.steps_left * dt * self._approach_velocity()
        self.farther_left -= self.steps_left * dt * abs(self.wheel.speed)
        self.pairs = [self._close_pairs(side, found[side]) for side in (0, 1)]
        self.started = True

    def _look_ahead(self, ahead: float) -> None:
        """See that `near` holds for this time [s]; position and velocity of its nodes as they are now. Collective."""
        nearer, farther = ahead * self._approach_velocity(), ahead * abs(self.wheel.speed)
        if nearer > self.nearer_left or farther > self.farther_left:
            self._take_motion(np.arange(self.surfaces.n))
            self.nearer_left, self.farther_left = max(NEARER, nearer), max(FARTHER, farther)
            self.near = self._look_at_all(self.position)
        else:
            near = zip(self.surfaces.quads, self._near_facets())
            self._take_motion(np.concatenate([nodes_of(quads, facets, self.surfaces.n) for quads, facets in near]))

    def _over_nearest(self, side: int, nodes: np.ndarray, opposite: np.ndarray, allowed: np.ndarray) -> Pairs:
        """Each of the nodes over the nearest of the facets `opposite`; projections stay on the facets `allowed` (k,).
        Each rank finds those of its part of the projections. Rank-local."""
        usable = np.zeros(len(self.surfaces.quads[1 - side]), np.bool_)
        usable[allowed] = True
        nearest = np.zeros(len(nodes), np.int64)
        if len(nodes):
            centres = facet_centres(self.position, self.surfaces.quads[1 - side], opposite)
            nearest = nearest_facets(self.position, nodes, self.surfaces.comm.rank, self.surfaces.comm.size, centres)
        return self._pairs(side, nodes, opposite[nearest], np.zeros((len(nodes), 2)), usable)

    def _close_pairs(self, side: int, found: Pairs) -> Pairs:
        """Those with a gap within the margin; projections stay on the facets near them. Replicated."""
        s, slot = self.settings, np.empty(self.surfaces.n, np.int64)
        number, facets, where, ahead = close_pairs(found, self.pairs[side], s.margin, s.deepest, slot)
        around = with_neighbours(facets, found.neighbours, 2) & found.usable
        return self._pairs(side, found.slaves[number], facets, where, around)._replace(ahead=ahead)

    def _look_at_all(self, position: np.ndarray) -> np.ndarray:
        """The facets of both surfaces, the rail's first, that can come within the margin of the other's before
        `nearer_left` and `farther_left` are used up. Replicated."""
        reach = (self.settings.margin if self.started else START_REACH) + self.nearer_left
        every = [np.flatnonzero(self.reachable), np.arange(len(self.surfaces.quads[1]))]
        rail, wheel = self._sharing_space(position, every, reach + np.array([self.farther_left, 0.0, 0.0]))
        return np.concatenate([rail, wheel + len(self.surfaces.quads[0])])

    def _sharing_space(
        self, position: np.ndarray, facets: list[np.ndarray], reach: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Those of the facets of rail and wheel whose boxes, wider by `reach` (3,) [m], may share space with the
        other's. Replicated."""
        kept = share_space(*(facet_boxes(position, q[f], reach) for q, f in zip(self.surfaces.quads, facets)))
        return facets[0][kept[0]], facets[1][kept[1]]

    def _candidates(
        self, position: np.ndarray, facets: list[np.ndarray], reach: np.ndarray
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """For each side its nodes and the opposite facets, of those given, that come within reach of the other surface.
        Replicated."""
        near = self._sharing_space(position, facets, reach)
        nodes = [nodes_of(quads, found, self.surfaces.n) for quads, found in zip(self.surfaces.quads, near)]
        return [(nodes[k], near[1 - k]) if len(near[1 - k]) else (nodes[k][:0], near[1 - k]) for k in (0, 1)]

    def _refuse_deep_start(self, position: np.ndarray, pairs: Pairs, side: int) -> None:
        """Raise ValueError where a surface starts deeper in the other than contact would believe: such nodes would
        never be pushed out. Replicated."""
        nodes, gap = pairs.slaves, pairs.gap
        outward = node_normals(position, self.surfaces.quads[side])
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

    def project(self, position: np.ndarray, *all_pairs: Pairs) -> None:
        """Projections of pairs at positions (n, 3), each rank its part of them; the same numbers on any number of
        ranks. Collective."""
        ends = np.cumsum([0, *(len(pairs.slaves) for pairs in all_pairs)])
        rows = np.empty((ends[-1], PROJECTION))
        for pairs, first, last in zip(all_pairs, ends[:-1], ends[1:]):
            project_share(position, pairs, self.surfaces.comm.rank, self.surfaces.comm.size, rows[first:last])
        if self.surfaces.comm.size > 1:
            self.surfaces.comm.Allreduce(MPI.IN_PLACE, rows)
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
        return SLOPE * abs(self.wheel.speed) + APPROACH
