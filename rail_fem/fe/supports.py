"""What holds and loads the bodies: rigid groups of nodes with added mass, springs and dampers between them, gravity.

Forces, velocities and positions of groups are replicated: every rank does the same few operations on them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import fsum
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np

from rail_fem.fe.dynamics_part import DynamicsPart
from rail_fem.fe.node_kernels import drift_groups, group_reactions, impose_velocities
from rail_fem.fe.structure import Structure


@dataclass
class RigidGroup:
    """Nodes that move as one body without rotation.

    input_nodes : (k,) nodes of the input mesh (may be empty: a lumped mass);  added_mass [kg];
    free : directions that may move
    lateral_mass : more mass that only moves along y: the other half of a wheelset [kg]
    mesh_mass : of the whole mesh that the group holds [kg]: what its nodes and those that hang on them weigh
    moving_mass : the most of it that ever moves on its own [kg], None: all of it
    load : (3,) constant force [N]
    velocity, displacement, reaction : (3,), change in place with time: Supports holds those of all groups in rows
    holds : local nodes that are its own now, where a travelling window says so, which sets `node_mass` too; else None
    """

    name: str
    input_nodes: np.ndarray
    added_mass: float = 0.0
    free: tuple[bool, bool, bool] = (False, False, False)
    load: np.ndarray = field(default_factory=lambda: np.zeros(3))
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    displacement: np.ndarray = field(default_factory=lambda: np.zeros(3))
    node_mass: float = 0.0
    holds: np.ndarray | None = None
    mesh_mass: float = 0.0
    moving_mass: float | None = None
    load_work: float = 0.0
    lateral_mass: float = 0.0
    # force of the elements on the group in the last step [N]
    reaction: np.ndarray = field(default_factory=lambda: np.zeros(3))
    members: np.ndarray = field(default_factory=lambda: np.empty(0, np.int64))  # local nodes that a step moves with it

    STATE: ClassVar[tuple[str, ...]] = (
        "added_mass",
        "free",
        "load",
        "velocity",
        "displacement",
        "load_work",
        "reaction",
    )

    size: ClassVar[int] = 0  # of what it sums over the ranks in a step, beside the reaction
    weighs_nodes: ClassVar[bool] = False  # whether `kinetic_energy` has that of all its nodes

    def join(self, structure: Structure, local: np.ndarray) -> None:
        """Take nodes (k,) of this rank. Collective."""
        if self.holds is None:
            own = np.zeros(structure.domain.n_nodes, bool)
            own[local] = True
            self.weigh(structure, own, own)

    def weigh(self, structure: Structure, own: np.ndarray, touched: np.ndarray) -> None:
        """Know the mass of the nodes that are its own now, (n_nodes,) bool, and of those a step touches. Collective."""
        owned = structure.domain.n_owned
        self.node_mass = float(structure.domain.comm.allreduce(structure.mass[:owned][own[:owned]].sum()))

    def take_up(self, structure: Structure, before: np.ndarray, own: np.ndarray, touched: np.ndarray) -> float:
        """Nodes (n_nodes,) bool are its own from now on, of which a step touches some; others were before: with those
        that join comes their momentum. Returns the kinetic energy that ends so [J]. Collective."""
        owned, joins = structure.domain.n_owned, own & ~before
        v, mass = structure.v.reshape(-1, 3)[:owned][joins[:owned]], structure.mass[:owned][joins[:owned]]
        sums = structure.domain.comm.allreduce(np.array([*(mass @ v), 0.5 * mass @ (v**2).sum(axis=1), mass.sum()]))
        momentum, kinetic, joined = sums[:3], sums[3], sums[4]
        self.weigh(structure, own, touched)
        old = self.velocity.copy()
        kinetic += 0.5 * (self.mass - joined) * old @ old
        for c in range(3):
            if self.free[c] and self.mass > 0:
                self.velocity[c] = ((self.mass - joined) * old[c] + momentum[c]) / self.mass
        return float(kinetic - 0.5 * self.mass * self.velocity @ self.velocity)

    def displacements(self, nodes: np.ndarray) -> np.ndarray:
        """Of nodes (k,) that ride on it, (k, 3) or of all (3,) [m]. Rank-local."""
        return self.displacement

    def velocities(self, nodes: np.ndarray) -> np.ndarray:
        """Of nodes (k,) that ride on it, (k, 3) or of all (3,) [m/s]. Rank-local."""
        return self.velocity

    def motion(self, nodes: np.ndarray, mass: float) -> np.ndarray:
        """Of its nodes (k,) that no step touches, of some mass together: this [kg], momentum along x, y, z [kg m/s] and
        kinetic energy [J] (5,). Rank-local."""
        return mass * np.array([1.0, *self.velocity, 0.5 * self.velocity @ self.velocity])

    def pack(self, force: np.ndarray, mine: np.ndarray) -> None:
        """This rank's share of what the group sums over all ranks beside the reaction -> mine (size,), from the
        elements' forces (3 n,) [N]."""

    def take(self, summed: np.ndarray) -> None:
        """Those sums (size,), before `kick`."""

    def bend(self, v: np.ndarray) -> None:
        """What its nodes' velocities have beside its own, added in v (3 n,) [m/s]."""

    def drift(self, dt: float) -> None:
        """What it has beside its rigid motion, after the step."""

    def frequency(self, dampers: float) -> float:
        """Above those of what it moves by forces of its own and of dampers on it [N s/m] [rad/s]."""
        return 0.0

    @property
    def mass(self) -> float:
        """Of nodes and added mass [kg], without `lateral_mass`."""
        return self.node_mass + self.added_mass

    def relaxing(self, damping: float) -> RigidGroup:
        """The same nodes, moved by who relaxes the bodies on them with damping [1/s]."""
        return RigidGroup(self.name, self.input_nodes)

    def stand_as(self, other: Any) -> None:
        """Take the place of the group of `relaxing`."""
        self.displacement[2] = other.displacement[2]

    def add_mass_up_to(self, total: float, remedy: str) -> None:
        """Added mass such that group and mesh together weigh `total` [kg]. Errors: ValueError where the mesh alone
        weighs more."""
        if (self.mesh_mass if self.moving_mass is None else self.moving_mass) > total:
            raise ValueError(
                f"the mesh of the {self.name} weighs {self.mesh_mass:.1f} kg, more than the {total:.1f} kg that the"
                f" case gives it: steel that is modelled cannot be taken away again; {remedy}"
            )
        self.added_mass = total - self.mesh_mass

    def kick(self, upwards: float, dt: float, across: float = 0.0) -> None:
        """Velocity of the free directions from the reaction at hand, the load and forces upwards and along y [N]."""
        own = self.mass
        for c in range(3):
            if not self.free[c] or own <= 0:
                continue
            mass = own + (self.lateral_mass if c == 1 else 0.0)
            load, old = self.load.item(c), self.velocity.item(c)
            new = old + dt / mass * (self.reaction.item(c) + load + (0.0, across, upwards)[c])
            self.velocity[c] = new
            self.load_work += dt * load * 0.5 * (new + old)

    def kinetic_energy(self) -> float:
        """Of the added mass [J]; the nodes' own is counted with the nodes."""
        lateral = 0.5 * self.lateral_mass * float(self.velocity[1]) ** 2 if self.lateral_mass else 0.0
        return 0.5 * self.added_mass * float(self.velocity @ self.velocity) + lateral


@dataclass
class Link:
    """Vertical spring and damper between two groups (b None: the ground).

    Force on a: -stiffness * (za - zb - natural_length) - damping * (va - vb - rate). Energies: `spring_energy` stored,
    `dissipated` so far [J].
    """

    name: str
    a: RigidGroup
    b: RigidGroup | None
    stiffness: float
    damping: float
    natural_length: float = 0.0
    rate: float = 0.0
    dissipated: float = 0.0

    STATE = ("stiffness", "damping", "natural_length", "rate", "dissipated")

    def stretch(self) -> float:
        """za - zb - natural_length [m]."""
        ground = 0.0 if self.b is None else self.b.displacement.item(2)
        return self.a.displacement.item(2) - ground - self.natural_length

    def stretch_rate(self) -> float:
        """va - vb [m/s]."""
        return self.a.velocity.item(2) - (0.0 if self.b is None else self.b.velocity.item(2))

    def spring_force(self) -> float:
        """Of the spring on a, upwards [N]."""
        return -self.stiffness * self.stretch()

    def damper_force(self) -> float:
        """Of the damper on a, upwards [N]."""
        return -self.damping * (self.stretch_rate() - self.rate)

    def spring_power(self) -> float:
        """Power of the spring on what it joins [W]."""
        return self.spring_force() * self.stretch_rate()

    def spring_energy(self) -> float:
        """In the spring [J]."""
        return 0.5 * self.stiffness * self.stretch() ** 2


@runtime_checkable
class Springs(Protocol):
    """What has springs and dampers of its own: `dissipated` by these so far [J]."""

    dissipated: float

    def spring_power(self) -> float:
        """Power of the springs on what they join [W]."""

    def spring_energy(self) -> float:
        """In the springs [J]."""


class HeldAcross(Springs, Protocol):
    """What holds a group along y, such as rail_fem.fe.lateral_guide.LateralGuide."""

    axle: RigidGroup

    def spring_force(self) -> float:
        """Of springs on the group along y [N]."""

    def creep_force(self) -> float:
        """Of what slides, along y [N]."""

    def book(self, force: float, old: float, dt: float) -> None:
        """Add the work that a sliding force [N] took from the group in a step from lateral velocity `old` [m/s]."""


class Supports(DynamicsPart):
    """All groups, links, and guides along y; `advance` moves the groups by one kick."""

    STATE = ("groups", "links", "guides")
    ROWS = ("velocity", "displacement", "reaction")  # of each group (n_groups, 3)

    def __init__(self, groups: list[RigidGroup], links: Sequence[Link] = (), guides: Sequence[HeldAcross] = ()):
        self.groups, self.links, self.guides = list(groups), list(links), list(guides)
        self.elastic = [group for group in self.groups if isinstance(group, Springs)]  # a slow question
        ends = np.cumsum([3 * len(self.groups), *(group.size for group in self.elastic)]).tolist()
        # of the message: all reactions, then what elastic groups sum beside their own
        self.stretches, self.size = [slice(*both) for both in zip([0, *ends], ends)], ends[-1]
        self.after_restore()

    def after_restore(self) -> None:
        """Each group's motion is a row of that of all. Replicated."""
        self.velocity, self.displacement, self.reaction = map(self._rows, self.ROWS)

    def _rows(self, name: str) -> np.ndarray:
        """(n_groups, 3), each group's own among them from now on."""
        rows = np.array([getattr(group, name) for group in self.groups]).reshape(-1, 3)
        for group, row in zip(self.groups, rows):
            setattr(group, name, row)
        return rows

    def join(self, structure: Structure) -> None:
        self.structure, domain = structure, structure.domain
        self.grouped = [domain.local_nodes(group.input_nodes, owned_only=False)[0] for group in self.groups]
        for group, local in zip(self.groups, self.grouped):
            group.join(structure, local)

    def moves(self) -> np.ndarray:
        return np.concatenate([np.empty(0, np.int64), *self.grouped])

    def follow(self, touched: np.ndarray) -> None:
        """Which nodes, and which of the owned, move with each group."""
        members = [
            local[touched[local]] if group.holds is None else group.holds
            for group, local in zip(self.groups, self.grouped)
        ]
        for group, own in zip(self.groups, members):
            group.members = own
        owned = [local[local < self.structure.domain.n_owned] for local in members]
        self.members, self.owned_members = (np.concatenate([np.empty(0, np.int64), *of]) for of in (members, owned))
        self.first_member, self.first_owned = (np.cumsum([0, *map(len, of)]) for of in (members, owned))

    def changes(self) -> np.ndarray:
        return self.members

    def pack(self, dt: float, mine: np.ndarray) -> None:
        group_reactions(self.structure.force, self.owned_members, self.first_owned, mine)
        for group, own in zip(self.elastic, self.stretches[1:]):
            group.pack(self.structure.force, mine[own])

    def kick(self, dt: float, summed: np.ndarray) -> None:
        for group, own in zip(self.elastic, self.stretches[1:]):
            group.take(summed[own])
        self.advance(summed[self.stretches[0]].reshape(-1, 3), dt)
        self.impose()

    def impose(self) -> None:
        impose_velocities(self.structure.v, self.members, self.first_member, self.velocity)
        for group in self.elastic:
            group.bend(self.structure.v)

    def advance(self, reactions: np.ndarray, dt: float) -> None:
        """Kick: velocities of all groups from element reactions (n_groups, 3) [N], loads and links. Replicated."""
        self.reaction[:] = reactions
        upwards, across = dict.fromkeys(map(id, self.groups), 0.0), dict.fromkeys(map(id, self.groups), 0.0)
        pulled, sliding = [], []
        for link in self.links:
            damper, rate = link.damper_force(), link.stretch_rate()
            pull = link.spring_force() + damper
            upwards[id(link.a)] += pull
            if link.b is not None:
                upwards[id(link.b)] -= pull
            pulled.append((link, damper, rate))
        for guide in self.guides:
            sliding.append((guide, guide.creep_force(), guide.axle.velocity.item(1)))
            across[id(guide.axle)] += guide.spring_force() + sliding[-1][1]
        for group in self.groups:
            group.kick(upwards[id(group)], dt, across[id(group)])
        for guide, creep, old in sliding:
            guide.book(creep, old, dt)
        for link, damper, old in pulled:
            link.dissipated -= dt * damper * 0.5 * (old + link.stretch_rate())

    def drift(self, dt: float) -> None:
        drift_groups(self.displacement, self.velocity, dt)
        for group in self.elastic:
            group.drift(dt)

    @property
    def parts(self) -> list[Springs]:
        """What has springs and dampers."""
        return [*self.links, *self.guides, *self.elastic]

    def frequency(self) -> float:
        dampers = lambda group: sum(link.damping for link in self.links if group is link.a or group is link.b)
        return max((group.frequency(dampers(group)) for group in self.groups), default=0.0)

    def power(self) -> float:
        """Of all springs on the groups [W]."""
        return fsum(part.spring_power() for part in self.parts)

    def energies(self) -> dict[str, float]:
        """Kinetic energy of added masses, spring energy, damper losses and work of loads [J]. Summed exactly: `sum` is
        more exact for Python's numbers than for NumPy's, which a restart file gives (Python 3.12)."""
        parts = self.parts
        return {
            "lumped_kinetic": fsum(g.kinetic_energy() for g in self.groups),
            "springs": fsum(part.spring_energy() for part in parts),
            "dampers": fsum(part.dissipated for part in parts),
            "loads": fsum(g.load_work for g in self.groups),
        }
