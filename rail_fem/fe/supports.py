"""What holds and loads the bodies: rigid groups of nodes with added mass, springs and dampers between them, gravity.

All numbers here are replicated: every rank does the same few operations on them.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


@dataclass
class RigidGroup:
    """Nodes that move as one body without rotation.

    input_nodes : (k,) nodes of the input mesh (may be empty: a lumped mass);  added_mass [kg];  free : directions that may move
    load : (3,) constant force [N];  velocity, displacement : (3,), change with time
    """

    name: str
    input_nodes: np.ndarray
    added_mass: float = 0.0
    free: tuple[bool, bool, bool] = (False, False, False)
    load: np.ndarray = field(default_factory=lambda: np.zeros(3))
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    displacement: np.ndarray = field(default_factory=lambda: np.zeros(3))
    node_mass: float = 0.0
    load_work: float = 0.0
    reaction: np.ndarray = field(default_factory=lambda: np.zeros(3))  # force of the elements on the group in the last step [N]

    @property
    def mass(self) -> float:
        return self.node_mass + self.added_mass

    def kinetic_energy(self) -> float:
        """Of the added mass [J]; the nodes' own is counted with the nodes."""
        return 0.5 * self.added_mass * float(self.velocity @ self.velocity)


@dataclass
class Link:
    """Vertical spring and damper between two groups (b None: the ground).

    Force on a: -stiffness * (za - zb - rest) - damping * (va - vb - rate). Energies: `spring_energy` stored, `dissipated` so far [J].
    """

    name: str
    a: RigidGroup
    b: RigidGroup | None
    stiffness: float
    damping: float
    rest: float = 0.0
    rate: float = 0.0
    dissipated: float = 0.0

    def _relative(self, attribute: str) -> float:
        other = getattr(self.b, attribute)[2] if self.b is not None else 0.0
        return getattr(self.a, attribute)[2] - other

    def force(self) -> float:
        """Force on a, upwards [N]."""
        return -self.stiffness * (self._relative("displacement") - self.rest) - self.damping * (self._relative("velocity") - self.rate)

    def spring_power(self) -> float:
        """Power of the spring on what it joins [W]."""
        return -self.stiffness * (self._relative("displacement") - self.rest) * self._relative("velocity")

    def spring_energy(self) -> float:
        return 0.5 * self.stiffness * (self._relative("displacement") - self.rest) ** 2


class Supports:
    """All groups and links; `advance` moves the groups by one kick."""

    def __init__(self, groups: list[RigidGroup], links: list[Link] = ()):
        self.groups, self.links = list(groups), list(links)

    def advance(self, reactions: np.ndarray, dt: float) -> None:
        """Kick: velocities of all groups from element reactions (n_groups, 3) [N], loads and links. Replicated."""
        link_forces = [link.force() for link in self.links]
        before = [g.velocity.copy() for g in self.groups]
        for g, reaction in zip(self.groups, reactions):
            g.reaction = reaction
            total = reaction + g.load
            for link, f in zip(self.links, link_forces):
                if link.a is g:
                    total[2] += f
                if link.b is g:
                    total[2] -= f
            if g.mass > 0:
                g.velocity = np.where(g.free, g.velocity + dt * total / g.mass, g.velocity)
        for g, old in zip(self.groups, before):
            g.load_work += dt * float(g.load @ (g.velocity + old)) / 2
        for link, f in zip(self.links, link_forces):
            i, j = self.groups.index(link.a), (self.groups.index(link.b) if link.b is not None else -1)
            mean = (before[i][2] + link.a.velocity[2] - (0.0 if j < 0 else before[j][2] + link.b.velocity[2])) / 2
            spring = -link.stiffness * (link._relative("displacement") - link.rest)
            link.dissipated -= dt * (f - spring) * mean

    def drift(self, dt: float) -> None:
        for g in self.groups:
            g.displacement = g.displacement + dt * g.velocity

    def spring_power(self) -> float:
        """Power of all springs on the groups [W]."""
        return sum(link.spring_power() for link in self.links)

    def energies(self) -> dict[str, float]:
        """Kinetic energy of added masses, spring energy, damper losses and work of loads [J]."""
        return {
            "lumped_kinetic": sum(g.kinetic_energy() for g in self.groups),
            "springs": sum(link.spring_energy() for link in self.links),
            "dampers": sum(link.dissipated for link in self.links),
            "loads": sum(g.load_work for g in self.groups),
        }

    def state(self) -> dict:
        """What a restart needs."""
        return {
            "groups": [[g.velocity.tolist(), g.displacement.tolist(), g.load_work, g.added_mass, list(g.free)] for g in self.groups],
            "links": [[link.dissipated, link.damping, link.rate, link.stiffness, link.rest] for link in self.links],
        }

    def restore(self, state: dict) -> None:
        for g, (velocity, displacement, work, added, free) in zip(self.groups, state["groups"]):
            g.velocity, g.displacement, g.load_work, g.added_mass, g.free = np.array(velocity), np.array(displacement), work, added, tuple(free)
        for link, (dissipated, damping, rate, stiffness, rest) in zip(self.links, state["links"]):
            link.dissipated, link.damping, link.rate, link.stiffness, link.rest = dissipated, damping, rate, stiffness, rest
