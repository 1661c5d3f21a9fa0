"""One step of explicit dynamics: central differences with lumped mass, supports, contact; and the energies of it all.

A step is kick (velocities from the forces at hand, then contact), drift (positions), forces (stresses and internal
forces at the new positions). Between steps the state is x and forces at one time, v half a step earlier.

On several ranks nobody waits for contact or sums: nodes that these do not change drift with their kick, and elements
that have only such nodes, which stand in the `ahead` blocks, are computed while messages are under way.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from mpi4py import MPI

from kernel_cache import working_time
from rail_fem.fe.contact.contact import Contact
from rail_fem.fe.domain import raise_together
from rail_fem.fe.dynamics_part import OF_PARTS, DynamicsPart
from rail_fem.fe.heap import give_back_free_memory
from rail_fem.fe.node_kernels import (
    CHANGED,
    SMALL,
    add_motion_energy,
    all_finite,
    drift,
    drift_nodes,
    free_inverse_mass,
    kick,
    unmarked,
)
from rail_fem.fe.stable_step import damped_limit, largest_frequency, round_down
from rail_fem.fe.state import HOURGLASS_WORK, PLASTIC_WORK, VISCOUS_WORK
from rail_fem.fe.structure import Structure
from rail_fem.fe.supports import Supports
from rail_fem.fe.window import TravellingWindow

WHEEL_DAMPING = 0.06  # share of critical damping that the small-displacement kernel gives the highest frequency

# change of the energy balance between two checks, over what the bodies hold or lost, that stops a run
STOP_BALANCE = 0.5
ROUND_OFF, LEAST_ENERGY = 1e-9, 1e-12  # of the springs' energy; [J]


def runs(nodes: np.ndarray) -> np.ndarray:
    """Ranges first..last-1 (k, 2) of the unknowns of nodes (n,) bool."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], nodes, [False]]).astype(np.int8)))
    return (3 * edges.reshape(-1, 2)).astype(np.uint64)  # a signed index costs a test at every access


class Dynamics:
    """A structure and what is attached to it, moving in time.

    fixed : (n_nodes, 3) bool of local nodes, directions held (symmetry planes);
    mass_damping : alpha [1/s], for relaxation to rest;  window : what of the bodies is active, None for all of them
    more : further parts (rail_fem.fe.dynamics_part)

    Attributes: parts, all of them in the order in which a step asks them: window, supports, contact, more
    """

    STATE = ("structure", "parts", "mass_damping", "time", "step_count", "dt", "balance_mark", "updates")
    SUMMED = ("kernel_time",)  # each rank's part of a sum
    SCRATCH = ("message", "stretches", "drifts")

    def __init__(
        self,
        structure: Structure,
        supports: Supports = None,
        contact: Contact = None,
        fixed: np.ndarray | None = None,
        mass_damping: float = 0.0,
        window: TravellingWindow | None = None,
        more: Sequence[DynamicsPart] = (),
    ):
        self.structure, self.supports, self.contact, self.window = structure, supports or Supports([]), contact, window
        self.parts: list[DynamicsPart] = [p for p in (window, self.supports, contact, *more) if p is not None]
        self.domain, self.comm = structure.domain, structure.domain.comm
        self.mass_damping = mass_damping
        n = self.domain.n_nodes
        held = np.zeros((n, 3), bool) if fixed is None else np.array(fixed, bool)
        moved = np.zeros(n, bool)
        for part in self.parts:
            part.join(structure)
            moved[part.moves()] = True
        self.held = np.flatnonzero(held & ~moved[:, None])  # unknowns at rest
        self.moving = ~held.ravel() & ~np.repeat(moved, 3)  # unknowns that move on their own where they are active
        self.inverse_mass = np.zeros(3 * n)
        self.changed = np.empty(0, np.int64)  # nodes whose velocities parts change after the kick
        self.marks = np.repeat(structure.on_small * np.int8(SMALL), 3)
        self.updates = 0  # of elements so far, of all ranks
        self.halo = self.domain.halo()  # of the nodes that a step computes
        self.follow()
        self.time, self.step_count, self.dt = 0.0, 0, 0.0
        # energy balance at the last check, None: taken afresh at the next step [J]
        self.balance_mark: float | None = None
        self.kernel_time = 0.0  # wall time in the element kernels on this rank [s]
        self.impose()

    def follow(self) -> None:
        """Which nodes and elements a step computes. Collective."""
        touched, inside = np.ones((2, self.domain.n_nodes), bool)
        for reach in filter(None, (part.reach() for part in self.parts)):
            touched, inside = touched & reach.touched, inside & reach.inside
        for part in self.parts:
            part.follow(touched)
        free_inverse_mass(self.structure.mass, self.moving, inside, self.inverse_mass)
        owned = np.arange(len(touched)) < self.domain.n_owned
        self.runs, self.owned_runs, self.ghost_runs = (
            runs(one) for one in (touched, touched & owned, touched & ~owned)
        )
        self.touched = touched
        self.halo.choose(touched)
        self.updated_cells = self.structure.count_active()
        self._mark()

    def _mark(self) -> None:
        """Which nodes drift after the parts' kicks and not with their own, and room for the message. Rank-local."""
        marks = self.marks.reshape(-1, 3)
        marks[self.changed] &= SMALL
        changed = np.unique(np.concatenate([np.empty(0, np.int64), *(part.changes() for part in self.parts)]))
        self.changed = changed[self.touched[changed]]  # contact watches nodes that have left until its next search
        marks[self.changed] |= CHANGED
        blocks = self.structure.blocks
        ahead = np.zeros(len(blocks), bool)
        if self.comm.size > 1:
            ahead = unmarked(blocks, self.structure.finite.nodes, self.marks, CHANGED)
        self.ahead, self.behind = blocks[ahead], blocks[~ahead]
        sizes = [part.size for part in self.parts]
        self.message = np.empty(sum(sizes))  # what the parts sum over the ranks, and the stretch of each
        self.stretches = np.split(self.message, np.cumsum(sizes)[:-1])
        if self.contact is not None:
            self.contact.messages.choose(self.contact.is_watched, len(self.message))

    after_restore = follow

    def impose(self) -> None:
        """Velocities of the parts onto the nodes that they move. Rank-local."""
        for part in self.parts:
            part.impose()

    # ---- step size

    def stable_step(self, courant: float = 0.9) -> float:
        """courant times the stable step of the bodies as they are now, few digits [s]; sets the wheel's damping to
        match. Collective."""
        s = self.structure
        self.bring_up()
        frequency = 1 / round_down(1 / largest_frequency(s, self.moving), 4)
        s.damping = 2 * WHEEL_DAMPING / frequency
        frequency = max(frequency, *(part.frequency() for part in self.parts))
        damped = self.comm.allreduce(len(s.small_cells)) > 0  # of all ranks: one without such cells takes the same step
        ratio = max(s.settings.linear_viscosity, WHEEL_DAMPING if damped else 0.0)
        give_back_free_memory()  # the vectors of Lanczos, and what was left of meshing
        return round_down(courant * damped_limit(frequency, ratio))

    # ---- one step

    def step(self, dt: float) -> None:
        """Advance by dt [s]. Collective."""
        if self.balance_mark is None:
            self.balance_mark = self._lagging_balance(self._energies())
        self._kick(dt)
        self._drift(dt)
        if sum(part.moved_on() for part in self.parts):  # every one is asked
            self.follow()
        self._forces(dt)
        self.time += dt
        self.step_count += 1
        self.updates += self.updated_cells
        self.dt = dt

    def _kick(self, dt: float) -> None:
        s = self.structure
        s.smallest_volume = np.inf
        if len(self.held):
            s.v[self.held] = 0.0
        self.drifts = not any(part.looks(dt) for part in self.parts)
        of_nodes = s.v, s.force, self.inverse_mass, self.mass_damping, dt, self.marks
        kick(*of_nodes, self.owned_runs, s.works, s.x, self.drifts)
        if len(self.ghost_runs):  # their owners count the work
            kick(*of_nodes, self.ghost_runs, np.empty(3), s.x, self.drifts)
        self._begin(dt)
        if self.drifts:
            self._forces_ahead(dt)
        if self.contact is not None:
            self.contact.end(self.message)
        for part, summed in zip(self.parts, self.stretches):
            part.kick(dt, summed)

    def _begin(self, dt: float) -> None:
        """What the parts sum over the ranks, in one message, which the contact's takes along; contact begins. Nodes of
        a group stand there with the group's last velocity: its change of a step moves them by less than a nanometre.
        Collective."""
        if sum(part.ready(dt) for part in self.parts):  # every one is asked
            self._mark()
        for part, mine in zip(self.parts, self.stretches):
            part.pack(dt, mine)
        if self.contact is not None:
            self.contact.begin(dt, self.message)
        elif self.comm.size > 1:
            self.comm.Allreduce(MPI.IN_PLACE, self.message)

    def _drift(self, dt: float) -> None:
        s = self.structure
        if self.drifts:
            drift_nodes(s.x, s.v, dt, s.force, self.changed)
        else:
            drift(s.x, s.v, dt, s.force, self.runs)
        for part in self.parts:
            part.drift(dt)

    def _forces_ahead(self, dt: float) -> None:
        if len(self.ahead):
            clock = working_time()
            self.structure.add_finite_force(dt, self.ahead)
            self.kernel_time += working_time() - clock

    def _forces(self, dt: float) -> None:
        s = self.structure
        if not self.drifts:
            self._forces_ahead(dt)
        clock = working_time()
        s.add_internal_force(dt, self.behind)
        for part in self.parts:
            part.add_force(dt)
        self.kernel_time += working_time() - clock
        self.halo.sum_up(s.force)

    def begin_here(self) -> None:
        """Take the present stresses as the state of a beginning: works of the elements are those that they hold.
        Rank-local."""
        finite, small = self.structure.elastic_energy()
        self.structure.works[:] = finite + self.structure.work.sum(), small, 0.0
        self.balance_mark = None
        self.impose()

    # ---- what is known of it

    def bring_up(self) -> None:
        """Nodes that no step touches to where they are now, for those who look at all of the bodies. Rank-local."""
        for part in self.parts:
            part.bring_up()

    def check(self) -> dict[str, float]:
        """Raise ArithmeticError on all ranks when an element is inside out, a number is not finite or the energy
        balance has broken since the last check: by more than STOP_BALANCE of what the bodies hold or lost. A step 1 %
        too long is found within 50 steps. Returns the `energies` that it looked at. Collective."""
        s = self.structure
        message = None
        if not s.smallest_volume > 0 or not all_finite(s.v, self.runs):
            self.bring_up()
            message = s.inversion_message() or "velocities are not finite"
        try:
            raise_together(self.comm, message)
            for message in filter(None, (part.end_message() for part in self.parts)):
                raise ValueError(message)
            return self._check_balance()
        except ValueError as error:
            raise ArithmeticError(f"step {self.step_count}, t = {self.time * 1e3:.4f} ms: {error}") from None

    def _check_balance(self) -> dict[str, float]:
        found = self._energies()
        e, before, self.balance_mark = found[0], self.balance_mark, self._lagging_balance(found)
        if before is None:
            return e
        change = abs(self.balance_mark - before)
        held = sum(abs(e[name]) for name in ("kinetic", "elastic", "plastic", "hourglass", "viscous", "contact"))
        if not change <= STOP_BALANCE * held + ROUND_OFF * abs(e["springs"]) + LEAST_ENERGY:
            raise ValueError(
                f"the energy balance changed by {change:.3g} J since the last check, of {held:.3g} J that the bodies"
                " hold or lost: the run is unstable, take a smaller courant number"
            )
        return e

    def _lagging_balance(self, energies: tuple[dict[str, float], float]) -> float:
        """The balance with velocities half a step behind [J], from what `_energies` found. Beyond the critical step a
        linear body grows while the balance at one time holds: it is the scheme's invariant, with ever more negative
        kinetic energy; this one grows with it. Replicated."""
        found, power = energies
        return found["balance"] - 0.5 * self.dt * power

    def energies(self) -> dict[str, float]:
        """All energies and works so far [J], replicated. Collective.

        balance = everything stored and lost minus everything put in; its change over time is the error of the
        integration. left_elastic (part of elastic) and left_kinetic have left with slabs that the window left behind.
        Velocities stand half a step before positions and stresses: kinetic energy and internal works get
        half the kick of the forces at hand. contact_loss = what the contact forces take from the bodies beyond penalty
        energy, friction, prescribed motion and rotation: the error of the contact.
        """
        return self._energies()[0]

    def _energies(self) -> tuple[dict[str, float], float]:
        """`energies`, and the power of the forces at hand on the velocities [W]. Nodes outside the window are not
        looked at: they have the base's velocity and no forces. Collective."""
        s = self.structure
        finite, small = s.elastic_energy()
        motion = np.zeros(3)
        add_motion_energy(s.v, s.force, s.mass, s.on_small, self.owned_runs, motion)
        half = 0.5 * self.dt * motion[1:]
        works = s.works - [half[0] - half[1], half[1], 0.0]
        untouched, contact = np.sum([part.shares() for part in self.parts], axis=0)
        local = np.array([motion[0] + half[0] + untouched, finite, small, *s.work, *works, contact, motion[1]])
        total = np.empty_like(local)
        self.comm.Allreduce(local, total)
        kinetic, finite, small = map(float, total[:3])
        out = dict.fromkeys(OF_PARTS, 0.0)
        for part in self.parts:
            for name, energy in part.energies().items():
                out[name] += energy
        finite += out["left_elastic"]
        plastic, hourglass, viscous = map(float, total[[3 + PLASTIC_WORK, 3 + HOURGLASS_WORK, 3 + VISCOUS_WORK]])
        finite_work, small_work, mass_damping, contact, power = map(float, total[6:])
        kinetic += 0.5 * self.dt * sum(part.power() for part in self.parts)
        out |= {
            "kinetic": kinetic,
            "elastic": finite + small,
            "plastic": plastic,
            "hourglass": hourglass,
            "viscous": viscous,
            "wheel_damping": small_work - small if len(s.small_cells) else 0.0,
            "mass_damping": mass_damping,
            "contact": contact,
            "internal_work_mismatch": finite_work - (finite + plastic + hourglass + viscous),
        }
        stored = out["kinetic"] + out["lumped_kinetic"] + out["elastic"] + out["springs"]
        lost = plastic + hourglass + viscous + out["wheel_damping"] + mass_damping + out["dampers"]
        lost += out["left_kinetic"]
        out["balance"] = stored + lost - out["loads"] - contact
        out["contact_loss"] = (
            -contact - out["prescribed_motion"] - out["rotation"] - out["friction"] - out["contact_penalty"]
        )
        return out, power
