"""A window that travels with the wheel: only the slabs of the rail near it are computed.

A slab enters ahead in the state it has (no stress, or what an earlier pass left there) with the motion of the rigid
base. Behind, a slab leaves: its nodes move with the base from then on, at the offset that they had, and stress, plastic
strain and shape stay as they are. The nodes of the planes at both ends of the window belong to the rigid base too, so
what the window's steel presses against is the base, and the body weighs the same at any moment: a node's mass is its
own or the base's. Momentum is kept where nodes leave (the base takes theirs up). The kinetic energy that this takes and
the elastic energy that leaves in the slabs are booked (`left_kinetic`, `left_elastic`), so that the balance of energies
closes.

Nodes outside are not touched by a step. Their place is what it was relative to the base (`anchor`), and `bring_up`
gives them their position and velocity when somebody looks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rail_fem.fe.contact.contact import Contact
from rail_fem.fe.dynamics_part import DynamicsPart, Reach
from rail_fem.fe.node_kernels import within
from rail_fem.fe.slabs import EQUAL, Slabs
from rail_fem.fe.state import PLASTIC_WORK
from rail_fem.fe.structure import Structure
from rail_fem.fe.supports import RigidGroup


@dataclass(frozen=True)
class Extent:
    """The window along the track: x of the wheel at the start [m], direction of travel (+1, -1), lengths ahead of the
    wheel and behind it [m] (infinite: all of the body)."""

    start: float
    sign: float
    ahead: float
    behind: float

    def ends(self, offset: float) -> tuple[float, float]:
        """Low and high end [m] when the wheel has moved by `offset` along x [m]."""
        ends = self.start + offset + self.sign * np.array([-self.behind, self.ahead])
        return float(ends.min()), float(ends.max())


def heaviest(slabs: Slabs, extent: Extent, masses: tuple[np.ndarray, ...]) -> float:
    """The most that active slabs weigh at any position of the wheel [kg]. masses : (slabs of the region,) [kg] of each
    region"""
    planes = np.concatenate(slabs.planes)
    # slabs enter where the front end comes to a plane and leave where the rear end does
    fronts = planes + 2 * EQUAL * extent.sign - extent.start - extent.sign * extent.ahead
    most = 0.0
    for offset in fronts[np.isfinite(fronts)] if np.isfinite(extent.ahead) else (0.0,):
        ranges = slabs.near(*extent.ends(offset))
        most = max(most, sum(float(mass[low:high].sum()) for mass, (low, high) in zip(masses, ranges)))
    return most


class TravellingWindow(DynamicsPart):
    """Which slabs are active, and what enters and leaves.

    slabs : of the bodies on `group`, the rigid base that all of them stand on
    contact : moves on with the wheel and ends where the window ends;  facet_region : (q,) of its facets of the rail

    Attributes: active (n_regions, 2) range of active slabs of each body;  left_elastic, left_kinetic : energy that left
    with slabs so far [J];  late_flow : plastic work done in slabs while they were the last of the window [J]; all
    replicated.
    """

    STATE = ("active", "left_elastic", "left_kinetic", "late_flow", "rear_work")
    SCRATCH = ("quiet_until",)

    def __init__(
        self,
        structure: Structure,
        slabs: Slabs,
        extent: Extent,
        group: RigidGroup,
        contact: Contact,
        facet_region: np.ndarray,
    ):
        self.structure, self.slabs, self.extent, self.group = structure, slabs, extent, group
        self.contact, self.facet_region = contact, facet_region
        rail = contact.surfaces.quads[0]
        self.facet_slab = slabs.of_cells(contact.surfaces.reference[rail].mean(axis=1)[:, 0], facet_region)
        domain = structure.domain
        self.comm = domain.comm
        region = np.zeros(domain.n_nodes, np.int8)
        region[domain.cells.ravel()] = np.repeat(domain.region, 8)
        self.region, self.in_slabs = region, (slabs.counts > 0)[region]
        self.first, self.last = slabs.of_nodes(domain.reference[::3], region)
        clamped, _ = domain.local_nodes(group.input_nodes, owned_only=False)
        self.clamped = np.zeros(domain.n_nodes, bool)
        self.clamped[clamped] = True
        self.active = slabs.near(*extent.ends(0.0))
        self.left_elastic, self.left_kinetic, self.late_flow = 0.0, 0.0, 0.0
        self.rear_work = np.zeros(len(slabs.planes))
        self.after_restore()
        self.quiet_until = 0.0  # distance of the wheel from its start up to which no slab enters or leaves [m]

    def after_restore(self) -> None:
        """What follows from the range of active slabs. Collective."""
        self.within = self._reach(self.active)
        self._activate()
        self.group.weigh(self.structure, self.rigid, self.within.touched)
        self.quiet_until = 0.0

    def _reach(self, active: np.ndarray) -> Reach:
        return Reach(*within(active, self.region, self.first, self.last, self.in_slabs))

    def _blocks(self, ranges: np.ndarray) -> list[tuple[int, int]]:
        """Ranges of finite-strain blocks that hold the slabs `ranges` (n_regions, 2), one for each body that has any.
        Rank-local."""
        blocks, out = self.structure.finite, []
        for region in np.flatnonzero(self.slabs.counts):
            low, high = ranges[region]
            at = np.flatnonzero((blocks.material_of == region) & (blocks.slab_of >= low) & (blocks.slab_of < high))
            if len(at):
                out.append((int(at[0]), int(at[-1]) + 1))
        return out

    def _activate(self) -> None:
        """Tell the structure which blocks to compute: those of active slabs, and of bodies without slabs; weigh the
        nodes that no step touches."""
        blocks = self.structure.finite
        uncut = np.setdiff1d(blocks.material_of, np.flatnonzero(self.slabs.counts))
        whole = [np.flatnonzero(blocks.material_of == region) for region in uncut]
        self.structure.compute(self._blocks(self.active) + [(int(at[0]), int(at[-1]) + 1) for at in whole])
        owned = self.structure.domain.n_owned
        self.mass_outside = float(self.structure.mass[:owned][~self.within.touched[:owned]].sum())
        self.group.holds = np.flatnonzero(self.rigid & self.within.touched)

    def reach(self) -> Reach:
        return self.within

    def follow(self, touched: np.ndarray) -> None:
        self.contact.search.let_reach(self.facets)

    @property
    def rigid(self) -> np.ndarray:
        """Nodes (n_nodes,) bool that belong to the base now. Rank-local."""
        return self.in_slabs & (self.clamped | ~self.within.inside)

    @property
    def facets(self) -> np.ndarray:
        """Contact facets of the rail (q,) bool in active slabs. Replicated."""
        first, end = self.active[self.facet_region].T
        return (self.facet_slab >= first) & (self.facet_slab < end)

    def bring_up(self) -> None:
        """Positions and velocities of the nodes outside, which no step touches. Rank-local."""
        outside = ~self.within.touched
        self._place(outside)
        self.structure.v.reshape(-1, 3)[outside] = self.group.velocities(np.flatnonzero(outside))

    @property
    def motion_outside(self) -> np.ndarray:
        """Mass [kg], momentum along x, y, z [kg m/s] and kinetic energy [J] of the owned nodes that no step touches
        (5,). Rank-local."""
        owned = self.structure.domain.n_owned
        return self.group.motion(np.flatnonzero(~self.within.touched[:owned]), self.mass_outside)

    def _place(self, nodes: np.ndarray) -> None:
        s = self.structure
        moved = self.group.displacements(np.flatnonzero(nodes))
        s.x.reshape(-1, 3)[nodes] = s.anchor.reshape(-1, 3)[nodes] + moved

    def advance(self, offset: float) -> bool:
        """Let slabs enter and leave where the wheel has moved on by `offset` [m] since the start; true where any did.
        Between the drift of a step and its forces. Collective."""
        if abs(offset) < self.quiet_until:
            return False
        self.quiet_until = self._next_event(offset)
        active = self.slabs.near(*self.extent.ends(offset))
        if np.array_equal(active, self.active):
            return False
        s, before, after, was_rigid = self.structure, self.within, self._reach(active), self.rigid
        self._enter(before, after)
        leaves, enters = self._blocks(self._less(self.active, active)), self._blocks(self._less(active, self.active))
        elastic = sum(s.energy_of_blocks(*b) for b in leaves) - sum(s.energy_of_blocks(*b) for b in enters)
        self.left_elastic += float(self.comm.allreduce(elastic))
        self._book_late_flow(self.active, active)
        self.active, self.within = active, after
        self._activate()
        self.left_kinetic += self.group.take_up(s, was_rigid, self.rigid, after.touched)
        held = np.flatnonzero(self.rigid & self.within.touched)
        s.v.reshape(-1, 3)[held] = self.group.velocities(held)
        gone = before.touched & ~after.touched
        s.anchor.reshape(-1, 3)[gone] = s.x.reshape(-1, 3)[gone] - self.group.displacements(np.flatnonzero(gone))
        return True

    def looks(self, dt: float) -> bool:
        wheel = self.contact.wheel
        return abs(wheel.offset + dt * wheel.speed) >= self.quiet_until

    def moved_on(self) -> bool:
        return self.advance(self.contact.wheel.offset)

    def _next_event(self, offset: float) -> float:
        """Distance of the wheel from its start [m] at which an end of the window comes to the next plane."""
        ends = np.array(self.extent.ends(offset))
        ahead = np.concatenate([self.extent.sign * (planes[:, None] - ends).ravel() for planes in self.slabs.planes])
        return abs(offset) + float(ahead[ahead > 0].min(initial=np.inf))

    def _enter(self, before: Reach, after: Reach) -> None:
        coming = after.touched & ~before.touched
        self._place(coming)
        self.structure.v.reshape(-1, 3)[coming] = self.group.velocities(np.flatnonzero(coming))

    def _less(self, ranges: np.ndarray, others: np.ndarray) -> np.ndarray:
        """Slabs in `ranges` (n_regions, 2) that are not in `others`, which lack some at one end or all."""
        out = np.zeros_like(ranges)
        for region, ((first, end), (low, high)) in enumerate(zip(ranges, others)):
            kept = [slab for slab in range(first, end) if not low <= slab < high]
            out[region] = (kept[0], kept[-1] + 1) if kept else (0, 0)
        return out

    def _rear(self, active: np.ndarray) -> np.ndarray:
        """The slab of each body (n_regions,) that leaves next; -1 where none is active."""
        rear = active[:, 0] if self.extent.sign > 0 else active[:, 1] - 1
        return np.where(active[:, 1] > active[:, 0], rear, -1)

    def _plastic_work(self, slab: np.ndarray) -> np.ndarray:
        """Plastic work (n_regions,) so far in one slab of each body [J]. Rank-local."""
        ranges = np.column_stack([slab, slab + 1])
        out = np.zeros(len(slab))
        for first, last in self._blocks(ranges):
            out[self.structure.finite.material_of[first]] = self.structure.block_work[first:last, PLASTIC_WORK].sum()
        return out

    def _book_late_flow(self, active: np.ndarray, later: np.ndarray) -> None:
        """Plastic work done in a slab that leaves since it became the last of the window. Collective."""
        left, last = self._rear(active), self._rear(later)
        work = self.comm.allreduce(np.array([self._plastic_work(left), self._plastic_work(last)]))
        changed = left != last
        self.late_flow += float((work[0] - self.rear_work)[changed].sum())
        self.rear_work[changed] = work[1][changed]

    def energies(self) -> dict[str, float]:
        return {"left_elastic": self.left_elastic, "left_kinetic": self.left_kinetic}

    def shares(self) -> tuple[float, float]:
        return 0.0 if self.group.weighs_nodes else float(self.motion_outside[4]), 0.0

    def end_message(self) -> str | None:
        """Where contact comes as near to an end of the window as a slab."""
        x, offset = self.contact.carrying_x(), self.contact.wheel.offset
        (low, high), slab = self.extent.ends(offset), self.slabs.shortest
        if not len(x) or (x.min() > low + slab and x.max() < high - slab):
            return None
        wheel = self.extent.start + offset
        return (
            f"contact from x = {x.min() * 1e3:.1f} to {x.max() * 1e3:.1f} mm comes to the end of the travelling window"
            f" ({low * 1e3:.1f} to {high * 1e3:.1f} mm, wheel at {wheel * 1e3:.1f} mm): make window_ahead and"
            f" window_behind longer than {1e3 * (abs(x - wheel).max() + slab):.0f} mm"
        )
