"""A pass whose steps are made on a card: the dynamics' arrays there, and back where somebody looks.

The processor keeps what decides: when contact is searched anew (from a copy of the surface nodes), when slabs of the
window enter and leave, when rows, checks and restart files are due. Between these the card makes its steps alone.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rail_fem.fe.blocks import ElementBlocks
from rail_fem.fe.card import kernels
from rail_fem.fe.card.bodies import CardElements, CardGroups, CardNodes, CardSmallElements, StepShared
from rail_fem.fe.card.device import SIMULATED, Launches, down, put, up
from rail_fem.fe.card.touching import (
    FRICTION,
    GOES,
    LEFT,
    MOTION,
    N_COLUMNS,
    N_MOTION,
    OFFSET,
    ROTATION,
    SPIN,
    TO_SEARCH,
    CardContact,
    FacetLists,
    GivenToNodes,
)
from rail_fem.fe.contact.pairs import Law, NodalForces, Pairs, Sliding
from rail_fem.fe.contact.pairs import Nodes as SurfaceNodes
from rail_fem.fe.contact.projection import PROJECTION
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.elastic import fixed_geometry
from rail_fem.fe.plasticity import MaterialTable
from rail_fem.fe.recorder import Recorder
from rail_fem.fe.state import CYCLIC, LANES, LAW, N_WORK

THREADS = 4 if SIMULATED else 256  # of a block, of the contact's and of the nodes'
NODE_BLOCKS = 1 if SIMULATED else 4096  # at most
CONTACT_THREADS = 4 if SIMULATED else 512
WARP = 2 if SIMULATED else LANES
FOUND = ("facets", "where", "gap", "normal", "weight", "pressure", "active", "ahead")  # that a step changes of pairs


def incidence(parts: list[tuple[np.ndarray, np.ndarray]], n_nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Where the nodal forces of each node's elements stand: first (n+1,), places.

    parts : nodes (blocks*8*LANES,) and filled lanes (blocks,) of all blocks, one after another
    """
    node, place, start = [], [], 0
    for nodes, filled in parts:
        block, corner, lane = np.indices((len(filled), 8, LANES))
        real = lane < filled[:, None, None]
        node.append(nodes.reshape(-1, 8, LANES)[real])
        place.append(((24 * (start + block) + 3 * corner) * LANES + lane)[real])
        start += len(filled)
    nodes, places = np.concatenate(node).astype(np.int64), np.concatenate(place)
    order = np.argsort(nodes, kind="stable")
    return np.cumsum([0, *np.bincount(nodes, minlength=n_nodes)]), places[order]


def around(quads: tuple[np.ndarray, ...], n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Facets of its own surface around each surface node: first (n+1,), facets, corners there."""
    nodes = np.concatenate([q.ravel() for q in quads])
    facet = np.concatenate([np.repeat(np.arange(len(q)), 4) for q in quads])
    corner = np.concatenate([np.tile(np.arange(4), len(q)) for q in quads])
    order = np.argsort(nodes, kind="stable")
    return np.cumsum([0, *np.bincount(nodes, minlength=n)]), facet[order], corner[order]


class OnCard:
    """The steps of a `Dynamics` with a contact on the card. region : (n_rail,) body of each surface node of the rail.
    Errors: ValueError for what the card does not take.

    Attributes: stale : what is here is newer than the card's, which takes it before the next step
    """

    def __init__(self, dynamics: Dynamics, region: np.ndarray):
        self.dynamics, self.region, self.stale = dynamics, region, True
        s = dynamics.structure
        domain, table = s.domain, s.table
        known = dynamics.window, dynamics.supports, dynamics.contact
        lacks = {
            f"{domain.comm.size} ranks: one drives it": domain.comm.size > 1,
            "a body without contact": dynamics.contact is None,
            "elements of eight points": s.finite.points > 1,
            "laws over cycles": bool((table.rows[:, LAW] == CYCLIC).any()),
            "damping by mass": dynamics.mass_damping > 0,
            "held directions": len(dynamics.held) > 0,
            "what holds a wheelset across the track": bool(dynamics.supports.guides),
            "a group on an elastic body": any(group.size for group in dynamics.supports.groups),
            "bearers, or another part of the dynamics": any(part not in known for part in dynamics.parts),
        }
        if found := [what for what, there in lacks.items() if there]:
            raise ValueError(f'device = "cuda" does not take {"; ".join(found)}: take device = "cpu"')
        cells, kind = domain.cells[s.small_cells], domain.region[s.small_cells]
        self.small = ElementBlocks(cells, kind, table, stateless=True)
        own = self.small.nodes, self.small.filled, self.small.material_of
        geometry, _ = fixed_geometry(domain.reference, *own, table.rows)
        self.small_elements = CardSmallElements(up(own[0]), up(own[2]), up(geometry))
        self.steels = MaterialTable(*map(up, table))
        blocks = [(s.finite.nodes, s.finite.filled), own[:2]]
        self.incidence = tuple(map(up, incidence(blocks, domain.n_nodes)))
        self.finite = tuple(map(up, (s.finite.nodes, s.finite.filled, s.finite.material_of)))
        forces = up(np.zeros(24 * LANES * sum(len(filled) for _, filled in blocks)))
        split = 24 * LANES * len(s.finite.filled)
        self.shared = StepShared(up(np.zeros(3, np.int64)), forces, forces[:split], forces[split:])
        self.launches: Launches | None = None
        self.constants = 0.0, 0.0

    # ---- to the card and back

    def push(self) -> None:
        """All that a step reads, as it is here now."""
        d, s = self.dynamics, self.dynamics.structure
        put(np.zeros(self.shared.forces.shape[0]), self.shared.forces)
        touched = np.zeros(d.domain.n_nodes, bool)
        for first, last in d.runs.astype(np.int64) // 3:
            touched[first:last] = True
        n = d.domain.n_nodes
        displaced = s.x - d.domain.reference + s.damping * s.v
        vectors = (s.x, s.v, s.force, d.domain.reference, d.inverse_mass, displaced, np.flatnonzero(touched))
        self.nodes = CardNodes(*map(up, (*vectors, np.zeros(n), np.zeros(n))), *self.incidence)
        computed = np.concatenate([np.empty(0, np.int64), *(np.arange(*active) for active in s.active)])
        lanes = LANES * len(s.finite.filled)
        each = s.finite.state, s.finite.back, computed, np.zeros(N_WORK * lanes), np.ones(lanes)
        self.elements, self.computed = CardElements(*self.finite, *map(up, each)), computed
        self._push_groups()
        self._push_contact()
        self.stale, self.launches = False, None

    def _push_groups(self) -> None:
        s = self.dynamics.supports
        groups, links = s.groups, s.links
        number = {id(group): k for k, group in enumerate(groups)}
        mass = np.full((len(groups), 3), np.inf)
        for own, g in zip(mass, groups):
            for c in range(3):
                if g.free[c] and g.mass > 0:
                    own[c] = g.mass + (g.lateral_mass if c == 1 else 0.0)
        rows = lambda name: np.array([getattr(g, name) for g in groups], float).reshape(len(groups), -1)
        of_links = lambda name: np.array([getattr(link, name) for link in links], float)
        arrays: list[Any] = [
            up(s.members),
            up(s.first_member),
            *(up(a) for a in (np.zeros((CONTACT_THREADS, 3 * len(groups))), rows("velocity"), rows("displacement"))),
            *(up(a) for a in (rows("load"), mass, rows("load_work").ravel(), rows("reaction"), np.zeros(len(groups)))),
            up(np.array([number[id(link.a)] for link in links], np.int64)),
            up(np.array([-1 if link.b is None else number[id(link.b)] for link in links], np.int64)),
            *(up(of_links(name)) for name in ("stiffness", "damping", "natural_length", "rate", "dissipated")),
            up(np.zeros(len(links))),
        ]
        self.groups = CardGroups(*arrays)

    def _push_contact(self) -> None:
        c, settings = self.dynamics.contact, self.dynamics.contact.settings
        surfaces, search, wheel = c.surfaces, c.search, c.wheel
        pairs = [Pairs(*map(up, own)) for own in c.pairs]
        sizes = [len(own.slaves) for own in c.pairs]
        pair_of = np.full(surfaces.n, -1, np.int64)
        for own in c.pairs:
            pair_of[own.slaves] = np.arange(len(own.slaves))
        heads = [np.full(len(q), -1, np.int64) for q in surfaces.quads]
        local = np.full(surfaces.n, -1, np.int64)
        local[surfaces.here] = surfaces.local
        both = lambda *shape: [up(np.zeros((k, *shape))) for k in sizes]
        numbers = [up(np.full(k, -1, np.int64)) for k in sizes]
        starts = map(up, (*around(surfaces.quads, surfaces.n), pair_of))
        lists: list[Any] = [*starts, up(heads[1]), numbers[0], up(heads[0]), numbers[1]]
        motion = np.zeros(N_MOTION)
        motion[OFFSET], motion[SPIN] = wheel.offset, wheel.spin
        arrays: list[Any] = [
            *pairs,
            SurfaceNodes(*map(up, (surfaces.area, surfaces.inverse_mass, c.from_axle, search.position, search.before))),
            Law(1.0 / settings.stiffness, float(settings.friction), float(settings.deepest)),
            NodalForces(*map(up, (c.tributary_area, c.normal_force, c.force, c.pressure_at, c.slip, c.slot))),
            Sliding(up(np.zeros(sizes[0], np.bool_)), up(np.zeros((sizes[0], 3))), up(np.zeros((sizes[0], 3)))),
            FacetLists(*lists),
            GivenToNodes(*both(), *both(3), *both(4)),
            up(c.watched),
            up(local),
            up(self.region),
            float(wheel.speed),
            np.inf if wheel.inertia is None else float(wheel.inertia),
            float(wheel.yaw),
            *map(
                up, (np.zeros((sum(sizes), PROJECTION)), np.zeros((surfaces.n, 3)), np.zeros((CONTACT_THREADS, 7, 3)))
            ),
            *map(up, (np.zeros((CONTACT_THREADS, N_COLUMNS)), c.sums, np.zeros(9), motion)),
            up(np.zeros((surfaces.n, 6))),
        ]
        self.touching = CardContact(*arrays)
        self.launches = None

    def pull(self) -> None:
        """All of it back, and the sums since the last time."""
        d, s, n = self.dynamics, self.dynamics.structure, self.nodes
        for name in ("x", "v", "force"):
            down(getattr(n, name), getattr(s, name))
        down(self.elements.state, s.finite.state)
        down(self.elements.back, s.finite.back)
        blocks = len(s.finite.filled)
        works, volume = np.empty(N_WORK * LANES * blocks), np.empty(LANES * blocks)
        down(self.elements.work, works)
        down(self.elements.volume, volume)
        real = np.arange(LANES) < s.finite.filled[:, None]
        s.block_work += (works.reshape(blocks, N_WORK, LANES) * real[:, None]).sum(axis=2)
        s.smallest_volume = volume.reshape(blocks, LANES)[self.computed][real[self.computed]].min(initial=np.inf)
        power, pushed, small = np.empty(d.domain.n_nodes), np.empty(d.domain.n_nodes), s.on_small.astype(bool)
        down(n.power, power)
        down(n.pushed, pushed)
        s.works[0] += power[~small].sum()
        s.works[1] += power[small].sum()
        d.contact.work += float(pushed.sum())
        for summed in (self.elements.work, n.power, n.pushed):
            put(np.zeros(summed.shape[0]), summed)
        self._pull_contact()

    def _pull_contact(self) -> None:
        c, t = self.dynamics.contact, self.touching
        for here, there in zip(c.pairs, (t.on_rail, t.on_wheel)):
            for name in FOUND:
                down(getattr(there, name), getattr(here, name))
        down(t.nodes.position, c.search.position)
        down(t.nodes.before, c.search.before)
        for name in ("tributary_area", "normal_force", "force", "pressure_at", "slip"):
            down(getattr(t.found, name), getattr(c, name))

    def _pull_motion(self, recorder: Recorder, steps: int) -> None:
        """After some steps: groups, the wheel, what the recorder adds up."""
        c, g, s, t = self.dynamics.contact, self.groups, self.dynamics.supports, self.touching
        motion, recorded, k = np.empty(N_MOTION), np.empty(9), len(s.groups)
        down(t.motion, motion)
        down(t.recorded, recorded)
        down(t.step, c.sums)
        wheel = c.wheel
        wheel.offset, wheel.spin = float(motion[OFFSET]), float(motion[SPIN])
        c.friction_work += float(motion[FRICTION])
        wheel.towed += float(motion[MOTION] + (motion[ROTATION] if wheel.inertia is None else 0.0))
        wheel.rotation += 0.0 if wheel.inertia is None else float(motion[ROTATION])
        motion[[FRICTION, MOTION, ROTATION]] = 0.0
        put(motion, t.motion)
        put(np.zeros(9), t.recorded)
        recorder.total += recorded[:5]
        recorder.moment += recorded[5:]
        recorder.steps += steps
        rows = {name: np.empty((k, 3)) for name in ("velocity", "displacement", "reaction")}
        for name, own in rows.items():
            down(getattr(g, name), own)
        works, lost = np.empty(k), np.empty(len(s.links))
        down(g.load_work, works)
        down(g.dissipated, lost)
        for number, group in enumerate(s.groups):
            group.load_work = float(works[number])
            for name, own in rows.items():
                getattr(group, name)[:] = own[number]
        for link, own in zip(s.links, lost):
            link.dissipated = float(own)

    # ---- steps

    def advance(self, dt: float, most: int, recorder: Recorder) -> None:
        """`most` steps of dt [s], their contact forces added to the recorder's."""
        d = self.dynamics
        if d.balance_mark is None:
            d.balance_mark = d._lagging_balance(d._energies())
        if self.stale:
            self.push()
        if (constants := (dt, d.structure.damping)) != self.constants:  # arguments of the recorded launches
            self.constants, self.launches = constants, None
        left = most
        while left:
            if d.contact.search.steps_left <= 0:
                self._search(dt)
            quiet = self._steps_without_slabs(dt, left)
            left -= self._make(dt, quiet, recorder) if quiet else self._make_one_with_slabs(dt, recorder)
        self.pull()

    def _search(self, dt: float) -> None:
        """By the processor, from the surface nodes as they are on the card."""
        d, t = self.dynamics, self.touching
        c, s = d.contact, d.structure
        kernels.collect[self._node_grid(t.local)](self.nodes, t)
        surfaces = c.surfaces
        motion = np.empty((surfaces.n, 6))
        down(t.surface, motion)
        for vector, columns in ((s.x, slice(3)), (s.v, slice(3, 6))):
            vector.reshape(-1, 3)[surfaces.local] = motion[surfaces.here, columns]
        self._pull_contact()
        c.ready(dt)
        c.search.steps_left += 1  # the card counts steps
        self._push_contact()

    def _steps_without_slabs(self, dt: float, most: int) -> int:
        """Steps before the next one in which slabs enter or leave, `most` at most."""
        w, wheel = self.dynamics.window, self.dynamics.contact.wheel
        if w is None:
            return most
        offset = wheel.offset
        for k in range(most):
            offset += dt * wheel.speed
            if abs(offset) >= w.quiet_until:
                return k
        return most

    def _make(self, dt: float, count: int, recorder: Recorder) -> int:
        """Up to so many steps, up to the next search; returns how many."""
        if self.launches is None:
            self.launches = Launches(lambda stream: self._step(dt, stream))
        self._count(count)
        for _ in range(min(count, self.dynamics.contact.search.steps_left)):
            self.launches.start()
        self.launches.wait()
        return self._made(dt, count, recorder)

    def _make_one_with_slabs(self, dt: float, recorder: Recorder) -> int:
        """A step between whose drift and forces slabs enter or leave."""
        d = self.dynamics
        self._count(1)
        halves = Launches(lambda stream: self._move(dt, stream)), Launches(lambda stream: self._forces(dt, stream))
        halves[0].start()
        halves[0].wait()
        made = self._made(dt, 1, recorder)
        self.pull()
        if sum(part.moved_on() for part in d.parts):
            d.structure.force[:] = 0.0
            d.follow()
            self.push()
        counters = np.zeros(3, np.int64)
        counters[GOES] = 1
        put(counters, self.shared.counters)
        halves[1].start()
        halves[1].wait()
        return made

    def _count(self, steps: int) -> None:
        counters = np.zeros(3, np.int64)
        counters[TO_SEARCH], counters[LEFT] = self.dynamics.contact.search.steps_left, steps
        put(counters, self.shared.counters)

    def _made(self, dt: float, asked: int, recorder: Recorder) -> int:
        d, counters = self.dynamics, np.empty(3, np.int64)
        down(self.shared.counters, counters)
        made = asked - int(counters[LEFT])
        d.contact.search.steps_left = int(counters[TO_SEARCH])
        for _ in range(made):
            d.time += dt
        d.step_count += made
        d.updates += made * d.updated_cells
        d.dt = dt
        self._pull_motion(recorder, made)
        return made

    def _node_grid(self, items: Any, stream: Any = None) -> tuple:
        blocks = max(1, min(NODE_BLOCKS, -(-items.shape[0] // THREADS)))
        return (blocks, THREADS) if stream is None else (blocks, THREADS, stream)

    def _step(self, dt: float, stream: Any) -> None:
        self._move(dt, stream)
        self._forces(dt, stream)

    def _move(self, dt: float, stream: Any) -> None:
        """Kick, rigid groups, contact, drift."""
        n, g, t, shared = self.nodes, self.groups, self.touching, self.shared
        one = (1, CONTACT_THREADS) if stream is None else (1, CONTACT_THREADS, stream)
        kernels.kick[self._node_grid(n.moved, stream)](dt, n, shared)
        kernels.groups[one](dt, g, n, shared)
        kernels.contact[one](dt, t, n, shared)
        kernels.impose[self._node_grid(g.members, stream)](g, n, shared)
        kernels.push[self._node_grid(t.watched, stream)](dt, t, n, shared)
        kernels.drift[self._node_grid(n.moved, stream)](dt, self.dynamics.structure.damping, n, shared)

    def _forces(self, dt: float, stream: Any) -> None:
        """Elements at the new positions, then the nodes' sums."""
        lanes = (WARP,) if stream is None else (WARP, stream)
        finite = self.elements, self.steels, self.shared
        small = self.small_elements, self.steels, self.shared
        if len(self.computed):
            kernels.elements[len(self.computed), *lanes](dt, self.nodes, *finite)
        if len(self.small.filled):
            kernels.small_elements[len(self.small.filled), *lanes](self.nodes, *small)
        kernels.gather[self._node_grid(self.nodes.moved, stream)](self.nodes, self.shared)
