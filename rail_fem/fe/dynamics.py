"""One step of explicit dynamics: central differences with lumped mass, supports, contact; and the energies of it all.

A step is kick (velocities from the forces at hand, then contact), drift (positions), forces (stresses and internal forces
at the new positions). Between steps the state is x and forces at one time, v half a step earlier.
"""

from __future__ import annotations

import time

import numba
import numpy as np
from mpi4py import MPI

from rail_fem.fe.contact import Contact
from rail_fem.fe.contact_kernel import DRIVE_WORK, FRICTION_WORK, NORMAL_ENERGY
from rail_fem.fe.domain import raise_together
from rail_fem.fe.stable_step import damped_limit, largest_frequency, round_down
from rail_fem.fe.state import HOURGLASS_WORK, PLASTIC_WORK, VISCOUS_WORK
from rail_fem.fe.structure import Structure
from rail_fem.fe.supports import Supports

WHEEL_DAMPING = 0.06  # share of critical damping that the small-displacement kernel gives the highest frequency


@numba.njit(cache=True, error_model="numpy")
def kick(v, force, inverse_mass, mass_damping, dt, group_of, reactions, small, works):
    """Velocities of owned nodes from internal forces; sums up reactions of groups and the internal work.

    v, force : (3 n,);  inverse_mass, small, group_of : (n,), group_of -1: free node, -2 - mask: fixed directions (bits x, y, z)
    mass_damping [1/s];  works : (3,) internal work of finite-strain nodes, of small-displacement nodes, damping work, added to [J]
    """
    finite_work, small_work, damping_work = 0.0, 0.0, 0.0
    for n in range(inverse_mass.size):
        g = group_of[n]
        power = 0.0
        if g >= 0:
            for c in range(3):
                reactions[g, c] += force[3 * n + c]
                power += force[3 * n + c] * v[3 * n + c]
        else:
            for c in range(3):
                i = 3 * n + c
                if g < -1 and (-2 - g) >> c & 1:
                    v[i] = 0.0
                    continue
                old = v[i]
                v[i] = old + dt * (force[i] * inverse_mass[n] - mass_damping * old)
                power += 0.5 * force[i] * (old + v[i])
                damping_work += 0.5 * dt * mass_damping / inverse_mass[n] * old * (old + v[i])
        if small[n]:
            small_work -= dt * power
        else:
            finite_work -= dt * power
    works[0] += finite_work
    works[1] += small_work
    works[2] += damping_work


@numba.njit(cache=True, error_model="numpy")
def apply_contact(v, internal, force, inverse_mass, local, at, small, dt, works):
    """Contact forces onto the velocities of owned nodes; returns their work on the bodies [J].

    v, internal : (3 n,) velocities after the kick without contact, internal forces;  force : (m, 3), inverse_mass : (m,) of surface nodes
    local, at : (k,) node and surface number of the nodes in question. All works go with the mean of the velocities before and after
    the whole kick; `works` (see `kick`) gets what contact changes of the internal work.
    """
    work = 0.0
    for i in range(local.size):
        n, a = local[i], at[i]
        for c in range(3):
            f, inner = force[a, c], internal[3 * n + c]
            change = dt * f * inverse_mass[a]
            v[3 * n + c] += change
            work += dt * f * (v[3 * n + c] - 0.5 * (change + dt * inner * inverse_mass[a]))
            works[small[n]] -= 0.5 * dt * inner * change
    return work


class Dynamics:
    """A structure with its supports and, by choice, a contact, moving in time.

    fixed : (n_nodes, 3) bool of local nodes, directions held (symmetry planes);  mass_damping : alpha [1/s], for relaxation to rest
    """

    def __init__(self, structure: Structure, supports: Supports = None, contact: Contact = None, fixed: np.ndarray | None = None, mass_damping: float = 0.0):
        self.structure, self.supports, self.contact = structure, supports or Supports([]), contact
        self.domain, self.comm = structure.domain, structure.domain.comm
        self.mass_damping = mass_damping
        n = self.domain.n_nodes
        self.group_of = np.full(n, -1, np.int64)
        if fixed is not None:
            mask = (np.asarray(fixed) * np.array([1, 2, 4])).sum(axis=1)
            self.group_of[mask > 0] = -2 - mask[mask > 0]
        self.members = []
        for i, group in enumerate(self.supports.groups):
            local, _ = self.domain.local_nodes(group.input_nodes, owned_only=False)
            self.group_of[local] = i
            self.members.append(local)
            owned = local[local < self.domain.n_owned]
            group.node_mass = self.comm.allreduce(float(structure.mass[owned].sum()))
        self.small = np.zeros(n, np.int64)
        self.small[self.domain.cells[structure.small_cells].ravel()] = 1
        self.inverse_mass = 1.0 / structure.mass
        self.works = np.zeros(3)
        self.contact_work, self.contact_normal, self.friction_work, self.drive_work = 0.0, 0.0, 0.0, 0.0
        self.time, self.step_count, self.dt = 0.0, 0, 0.0
        self.kernel_time = 0.0  # wall time in the element kernels on this rank [s]
        self._give_group_velocities()

    # ---- step size

    def free(self) -> np.ndarray:
        """Unknowns that are free to move on their own (3 n_nodes,) bool; rank-local."""
        out = np.ones((self.domain.n_nodes, 3), bool)
        out[self.group_of >= 0] = False
        mask = np.where(self.group_of < -1, -2 - self.group_of, 0)
        for c in range(3):
            out[(mask >> c & 1).astype(bool), c] = False
        return out.ravel()

    def stable_step(self, courant: float = 0.9) -> float:
        """courant times the stable step of the bodies as they are now, few digits [s]; sets the wheel's damping to match. Collective."""
        s = self.structure
        frequency = largest_frequency(s, self.free())
        s.damping = 2 * WHEEL_DAMPING / frequency
        ratio = max(s.settings.linear_viscosity, WHEEL_DAMPING if s.small.n_cells else 0.0)
        return round_down(courant * damped_limit(frequency, ratio))

    # ---- one step

    def step(self, dt: float) -> None:
        """Advance by dt [s]. Collective."""
        self._kick(dt)
        self._drift(dt)
        self._forces(dt)
        self.time += dt
        self.step_count += 1
        self.dt = dt

    def _kick(self, dt: float) -> None:
        s, n = self.structure, self.domain.n_owned
        reactions = np.zeros((len(self.supports.groups), 3))
        kick(s.v[: 3 * n], s.force[: 3 * n], self.inverse_mass[:n], self.mass_damping, dt, self.group_of[:n], reactions, self.small[:n], self.works)
        if len(reactions):
            if self.comm.size > 1:
                self.comm.Allreduce(MPI.IN_PLACE, reactions)
            self.supports.advance(reactions, dt)
            self._give_group_velocities()
        if self.contact is not None:
            self._contact(dt)
        self.domain.copy_to_ghosts(s.v)

    def _give_group_velocities(self) -> None:
        v = self.structure.v.reshape(-1, 3)
        for group, local in zip(self.supports.groups, self.members):
            v[local] = group.velocity

    def _contact(self, dt: float) -> None:
        c, s = self.contact, self.structure
        c.add_forces(dt)
        self.contact_work += apply_contact(s.v, s.force, c.force, c.inverse_mass, c.own_local, c.own_at, self.small, dt, self.works)
        self.friction_work += c.sums[FRICTION_WORK]
        on_wheel = c.force[c.watched[np.searchsorted(c.watched, c.n_rail) :], 0]
        self.drive_work += c.sums[DRIVE_WORK] + dt * c.speed * float(on_wheel.sum())
        self.contact_normal = c.sums[NORMAL_ENERGY]

    def _drift(self, dt: float) -> None:
        self.structure.x += dt * self.structure.v
        self.supports.drift(dt)
        if self.contact is not None:
            self.contact.offset += dt * self.contact.speed

    def _forces(self, dt: float) -> None:
        s = self.structure
        s.force[:] = 0.0
        clock = time.perf_counter()
        s.add_internal_force(dt)
        self.kernel_time += time.perf_counter() - clock
        self.domain.sum_to_owner(s.force)

    # ---- what is known of it

    def check(self) -> None:
        """Raise ArithmeticError on all ranks when an element is inside out or a number is not finite. Collective."""
        s = self.structure
        sick = not s.smallest_volume > 0 or not np.isfinite(s.v).all()
        fault = None
        if sick:
            fault = s.inverted_fault() or f"velocities are not finite at step {self.step_count}, t = {self.time * 1e3:.4f} ms: the run is unstable, take a smaller courant number"
        try:
            raise_together(self.comm, fault)
        except ValueError as error:
            raise ArithmeticError(f"step {self.step_count}, t = {self.time * 1e3:.4f} ms: {error}") from None

    def energies(self) -> dict[str, float]:
        """All energies and works so far [J], replicated. Collective.

        balance = everything stored and lost minus everything put in; its change over time is the error of the integration.
        contact_loss = what the contact forces take from the bodies beyond penalty energy, friction and drive: the error of the contact.
        """
        s = self.structure
        finite, small = s.elastic_energy()
        local = np.array([s.kinetic_energy(), finite, small, *s.work, *self.works, self.contact_work])
        total = self.comm.allreduce(local, op=MPI.SUM)
        kinetic, finite, small = total[:3]
        plastic, hourglass, viscous = total[3 + PLASTIC_WORK], total[3 + HOURGLASS_WORK], total[3 + VISCOUS_WORK]
        finite_work, small_work, mass_damping, contact = total[6:]
        out = {
            "kinetic": kinetic,
            "elastic": finite + small,
            "plastic": plastic,
            "hourglass": hourglass,
            "viscous": viscous,
            "wheel_damping": small_work - small if s.small.n_cells else 0.0,
            "mass_damping": mass_damping,
            **self.supports.energies(),
            "contact": contact,
            "contact_penalty": self.contact_normal,
            "friction": self.friction_work,
            "drive": self.drive_work,
            "internal_work_mismatch": finite_work - (finite + plastic + hourglass + viscous),
        }
        stored = out["kinetic"] + out["lumped_kinetic"] + out["elastic"] + out["springs"]
        lost = plastic + hourglass + viscous + out["wheel_damping"] + mass_damping + out["dampers"]
        out["balance"] = stored + lost - out["loads"] - contact
        out["contact_loss"] = -contact - out["drive"] - out["friction"] - out["contact_penalty"]
        return out
