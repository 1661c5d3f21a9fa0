"""A pass whose steps are made on a card: the dynamics' arrays there, and back where somebody looks.

The processor keeps what decides: when contact is searched anew (from a copy of the surface nodes), when slabs of the
window enter and leave, when rows, checks and restart files are due. Between these the card makes its steps alone.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rail_fem.fe.blocks import ElementBlocks
from rail_fem.fe.card import arrays, kernels
from rail_fem.fe.card.arrays import together
from rail_fem.fe.card.device import Launches, down, put, up
from rail_fem.fe.contact.pairs import Pairs
from rail_fem.fe.contact.projection import PROJECTION
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.elastic import fixed_geometry
from rail_fem.fe.plasticity import MaterialTable
from rail_fem.fe.recorder import Recorder
from rail_fem.fe.state import CYCLIC, LANES, LAW, N_WORK
from rail_fem.fe.supports import Supports

# what a step changes of each part, and somebody reads
CHANGED = {
    "Nodes": ("position", "before"),
    "NodalForces": ("tributary_area", "normal_force", "force", "pressure_at", "slip"),
    "Pairs": ("facets", "where", "gap", "normal", "weight", "pressure", "active", "ahead"),
    "CardNodes": ("x", "v", "force", "works", "pushed"),
    "CardElements": ("state", "back", "work", "volume"),
    "CardGroups": (*Supports.ROWS, "load_work", "links"),
    "CardContact": ("step", "motion", "since"),
}
SUMMED = ("works", "pushed", "work", "since")  # of these, what begins at 0 again when it was read
OF_LINK = "stiffness", "damping", "natural_length", "rate"


def fetch(there: Any, here: Any) -> None:
    """What steps have changed, of one part or all, into the arrays here."""
    for name, theirs, ours in zip(here._fields, there, here):
        if isinstance(ours, tuple):
            fetch(theirs, ours)
        elif name in CHANGED.get(type(here).__name__, ()):
            down(theirs, ours)
            if name in SUMMED:
                put(np.zeros(ours.shape), theirs)


def joined(rail: Pairs, wheel: Pairs) -> Pairs:
    """Both surfaces' pairs as one, facets numbered on."""
    found = {name: np.concatenate([getattr(pairs, name) for pairs in (rail, wheel)]) for name in Pairs._fields}
    for name in ("facets", "neighbours"):
        of_wheel = found[name][len(getattr(rail, name)) :]
        of_wheel[of_wheel >= 0] += len(rail.quads)
    return Pairs(**found)


def parted(both: Pairs, rail: Pairs, wheel: Pairs) -> None:
    """What steps have changed of `joined` pairs, back into those of each surface."""
    k, on_wheel = len(rail.slaves), both.facets >= len(rail.quads)
    both.facets[on_wheel] -= len(rail.quads)
    for name in CHANGED["Pairs"]:
        getattr(rail, name)[:], getattr(wheel, name)[:] = getattr(both, name)[:k], getattr(both, name)[k:]


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


def around(quads: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Facets around each surface node: first (n+1,), facets, corners there."""
    order = np.argsort(quads.ravel(), kind="stable")
    return np.cumsum([0, *np.bincount(quads.ravel(), minlength=n)]), order // 4, order % 4


class OnCard:
    """The steps of a `Dynamics` with a contact on the card, of what rail_fem.fe.card.fits lets through. region :
    (n_rail,) body of each surface node of the rail

    Attributes: stale : what is here is newer than the card's, which takes it before the next step
    """

    def __init__(self, dynamics: Dynamics, region: np.ndarray):
        self.dynamics, self.region, self.stale = dynamics, region, True
        s = dynamics.structure
        domain, table = s.domain, s.table
        small = ElementBlocks(domain.cells[s.small_cells], domain.region[s.small_cells], table, stateless=True)
        own = small.nodes, small.filled, small.material_of
        geometry, _ = fixed_geometry(domain.reference, *own, table.rows)
        blocks = [(s.finite.nodes, s.finite.filled), own[:2]]
        # what no step and no window changes goes there once
        self.small = up(together("CardSmall", nodes=own[0], material_of=own[2], geometry=geometry))
        self.steels: MaterialTable = up(table)
        self.incidence = dict(zip(("first", "places"), map(up, incidence(blocks, domain.n_nodes))))
        self.finite = {name: up(getattr(s.finite, name)) for name in ("nodes", "filled", "material_of")}
        self.n_forces = 24 * LANES * sum(len(filled) for _, filled in blocks)
        self.launches: Launches | None = None
        cycles = bool((table.rows[:, LAW] == CYCLIC).any())
        elements = kernels.of_elements(s.finite.points > 1, table.back_stresses if cycles else None)
        self.force = elements, *kernels.FORCE

    # ---- to the card and back

    def push(self, dt: float) -> None:
        """All that a step of dt [s] reads, as it is here now."""
        d, s = self.dynamics, self.dynamics.structure
        n, lanes = d.domain.n_nodes, LANES * len(s.finite.filled)
        nodes = together(
            "CardNodes",  # (3 n,), but for those that say
            x=s.x,
            v=s.v,
            force=s.force,
            reference=d.domain.reference,
            inverse_mass=d.inverse_mass,
            displaced=s.x - d.domain.reference + s.damping * s.v,  # for small-displacement elements
            moved=np.flatnonzero(d.touched),  # (k,) nodes that a step computes
            marks=d.marks,
            works=np.zeros((n, 3)),  # see rail_fem.fe.node_kernels.kick; since they were last read [J]
            pushed=np.zeros(n),  # work of contact on the body since it was last read [J]
            **self.incidence,  # (n+1,), (m,) where the nodal forces of each node's elements stand
        )
        elements = together(
            "CardElements",  # finite-strain blocks, as rail_fem.fe.hexahedron.update_elements has them
            **self.finite,
            state=s.finite.state,
            back=s.finite.back,
            computed=np.concatenate([np.empty(0, np.int64), *(np.arange(*active) for active in s.active)]),  # blocks
            work=np.zeros(N_WORK * lanes),  # since it was last read [J]
            volume=np.ones(lanes),  # [m3]
        )
        self.here = together(
            "CardStep",
            dt=dt,
            damping=s.damping,
            nodes=nodes,
            elements=elements,
            small=self.small,  # geometry of rail_fem.fe.elastic.fixed_geometry
            steels=self.steels,
            groups=self._groups_here(),
            contact=self._contact_here(),
            forces=np.zeros(self.n_forces),  # of all elements, the finite-strain ones' first (blocks*24*LANES,) [N]
            counters=np.zeros(3, np.int64),
        )
        self.there = up(self.here)
        self.stale, self.launches = False, None

    def _groups_here(self) -> Any:
        """Rigid groups and links between them, as rail_fem.fe.supports has them: replicated there, on the card here."""
        s = self.dynamics.supports
        number = {id(group): k for k, group in enumerate(s.groups)}
        heavy = [group.mass + np.array([0.0, group.lateral_mass, 0.0]) for group in s.groups]
        moves = [np.array(group.free) & (group.mass > 0) for group in s.groups]
        links = [[*(getattr(link, name) for name in OF_LINK), link.dissipated, 0.0] for link in s.links]
        ends = [[number.get(id(end), -1) for end in (link.a, link.b)] for link in s.links]
        return together(
            "CardGroups",
            members=s.members,  # nodes of each group, from first on
            first=s.first_member,
            partial=np.zeros((kernels.THREADS_OF_ONE, 3 * len(number))),  # sums of the threads [N]
            **{name: getattr(s, name) for name in s.ROWS},  # (g, 3), as load and mass
            load=np.array([group.load for group in s.groups]).reshape(-1, 3),
            mass=np.where(moves, heavy, np.inf).reshape(-1, 3),  # inf where a direction does not move
            load_work=np.array([group.load_work for group in s.groups]),
            upwards=np.zeros(len(number)),  # buffer
            ends=np.array(ends, np.int64).reshape(-1, 2),  # groups of each link, -1 the ground
            links=np.array(links, float).reshape(-1, 6),  # see arrays.STIFFNESS
        )

    def _contact_here(self) -> Any:
        """All of a contact: n surface nodes, k pairs, those of the rail's nodes first."""
        c = self.dynamics.contact
        surfaces, wheel, pairs = c.surfaces, c.wheel, joined(*c.pairs)
        n, k = surfaces.n, len(pairs.slaves)
        pair_of, local = np.full((2, n), -1, np.int64)
        pair_of[pairs.slaves] = np.arange(k)
        local[surfaces.here] = surfaces.local
        inertia = np.inf if wheel.inertia is None else wheel.inertia
        first, facet, corner = around(pairs.quads, n)
        return together(
            "CardContact",
            pairs=pairs,  # over facets of both surfaces
            nodes=c.nodes,
            law=c.law,
            found=c.found,
            sliding=c.sliding,
            split=len(c.pairs[0].slaves),  # pairs of the rail's nodes
            first=first,  # (n+1,) from where on the facets around each node stand, and its corner there
            facet=facet,
            corner=corner,
            pair_of=pair_of,  # (n,) the pair whose slave a node is, -1 none
            head=np.full(len(pairs.quads), -1, np.int64),  # the first of the pairs over each facet, -1 the end
            after=np.full(k, -1, np.int64),  # and the one after each
            given=np.zeros((k, 4)),  # what pairs give to nodes, an amount and a vector
            push=np.zeros((n, 4)),  # what nodes have of that
            state=np.zeros((k, 4)),  # as in rail_fem.fe.contact.pressure.take_active
            rows=np.zeros((k, PROJECTION)),
            watched=c.watched,
            local=local,  # (n,) their nodes
            region=self.region,
            room=np.zeros((kernels.THREADS_OF_ONE, 7, 3)),
            sums=np.zeros((kernels.THREADS_OF_ONE, arrays.N_COLUMNS)),
            step=c.sums,  # of the last step
            motion=np.array([wheel.offset, wheel.spin, wheel.speed, inertia, wheel.yaw], float),
            since=np.zeros(arrays.ROTATION + 1),  # see arrays.FRICTION
            surface=np.zeros((n, 6)),  # positions and velocities for a search
        )

    def pull(self) -> None:
        """Nodes and elements back, and their sums since the last time."""
        d, s, nodes, own = self.dynamics, self.dynamics.structure, self.here.nodes, self.here.elements
        fetch(self.there.nodes, nodes)
        fetch(self.there.elements, own)
        real = np.arange(LANES) < s.finite.filled[:, None]
        s.block_work += (own.work.reshape(-1, N_WORK, LANES) * real[:, None]).sum(axis=2)
        volume = own.volume.reshape(-1, LANES)[own.computed]
        s.smallest_volume = volume[real[own.computed]].min(initial=np.inf)
        s.works += nodes.works.sum(axis=0)
        d.contact.work += float(nodes.pushed.sum())

    def _pull_motion(self, recorder: Recorder, steps: int) -> None:
        """After some steps: contact, groups, the wheel, what the recorder adds up."""
        c, s, g, t = self.dynamics.contact, self.dynamics.supports, self.here.groups, self.here.contact
        fetch(self.there.groups, g)
        fetch(self.there.contact, t)
        parted(t.pairs, *c.pairs)
        wheel, held = c.wheel, c.wheel.inertia is None
        wheel.offset, wheel.spin = float(t.motion[arrays.OFFSET]), float(t.motion[arrays.SPIN])
        c.friction_work += float(t.since[arrays.FRICTION])
        wheel.towed += float(t.since[arrays.TOWING] + (t.since[arrays.ROTATION] if held else 0.0))
        wheel.rotation += 0.0 if held else float(t.since[arrays.ROTATION])
        recorder.total += t.since[:5]
        recorder.moment += t.since[5 : arrays.FRICTION]
        recorder.steps += steps
        for group, work in zip(s.groups, g.load_work):
            group.load_work = float(work)
        for link, own in zip(s.links, g.links):
            link.dissipated = float(own[arrays.DISSIPATED])

    # ---- steps

    def advance(self, dt: float, most: int, recorder: Recorder) -> None:
        """`most` steps of dt [s], their contact forces added to the recorder's."""
        d = self.dynamics
        if d.balance_mark is None:
            d.balance_mark = d._lagging_balance(d._energies())
        if self.stale or (dt, d.structure.damping) != self.here[:2]:
            self.push(dt)
        left = most
        while left:
            if d.contact.search.steps_left <= 0:
                self._search(dt)
            quiet = self._steps_without_slabs(dt, left)
            left -= self._make(dt, quiet, recorder) if quiet else self._make_one_with_slabs(dt, recorder)
        self.pull()

    def _search(self, dt: float) -> None:
        """By the processor, from the surface nodes as they are on the card."""
        c, s, surface = self.dynamics.contact, self.dynamics.structure, self.here.contact.surface
        self._count(0)
        self._launch(kernels.COLLECT)
        down(self.there.contact.surface, surface)
        for vector, columns in ((s.x, slice(3)), (s.v, slice(3, 6))):
            vector.reshape(-1, 3)[c.surfaces.local] = surface[c.surfaces.here, columns]
        c.ready(dt)
        c.search.steps_left += 1  # the card counts steps
        self.here = self.here._replace(contact=self._contact_here())
        self.there, self.launches = self.there._replace(contact=up(self.here.contact)), None

    def _steps_without_slabs(self, dt: float, most: int) -> int:
        """Steps before the next one in which slabs may enter or leave, `most` at most."""
        w, wheel = self.dynamics.window, self.dynamics.contact.wheel
        if w is None:
            return most
        ahead = (w.quiet_until - abs(wheel.offset)) / (dt * abs(wheel.speed)) - 1.0  # less one, for round-off
        return int(min(most, max(ahead, 0.0)))

    def _make(self, dt: float, count: int, recorder: Recorder) -> int:
        """Up to so many steps, up to the next search; returns how many."""
        if self.launches is None:
            self.launches = Launches(lambda stream: self._launch(kernels.MOVE + self.force, stream))
        self._count(count)
        for _ in range(min(count, self.dynamics.contact.search.steps_left)):
            self.launches.start()
        self.launches.wait()
        return self._made(dt, count, recorder)

    def _make_one_with_slabs(self, dt: float, recorder: Recorder) -> int:
        """A step between whose drift and forces slabs enter or leave."""
        d = self.dynamics
        self._count(1)
        self._launch(kernels.MOVE)
        made = self._made(dt, 1, recorder)
        self.pull()
        if sum(part.moved_on() for part in d.parts):
            d.structure.force[:] = 0.0
            d.follow()
            self.push(dt)
        self._count(0)
        self._launch(self.force)
        return made

    def _count(self, steps: int) -> None:
        """So many steps to be made."""
        put(np.array([self.dynamics.contact.search.steps_left, steps, 1]), self.there.counters)

    def _made(self, dt: float, asked: int, recorder: Recorder) -> int:
        d, counters = self.dynamics, self.here.counters
        down(self.there.counters, counters)
        made = asked - int(counters[arrays.LEFT])
        d.contact.search.steps_left = int(counters[arrays.TO_SEARCH])
        for _ in range(made):
            d.time += dt
        d.step_count += made
        d.updates += made * d.updated_cells
        d.dt = dt
        self._pull_motion(recorder, made)
        return made

    def _launch(self, parts: tuple, stream: Any = None) -> None:
        for part in parts:
            part(self.here, self.there, stream)
