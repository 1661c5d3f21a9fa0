"""The wheel brought to rest on the crossing where it stands, under the load of the pass's start: dynamic relaxation.

Central differences in a time of their own: element masses with which all elements have the same critical step, nothing
rolls and nothing rubs. The slowest motion, of the wheel on its contact, is left out: its axle is moved, as fast as the
contact lacks of the load, so that what the contact carries comes to the load from below and steel that yields never
carries more; the damping is of the next slower ones, the waves within the bodies. Displacement, stress and plastic
strain of the static contact remain. The foundation and the suspension balance the load by their natural lengths, so
that nothing moves when the wheel is let go on a straight path.

Source of the method: Underwood, Dynamic relaxation, in Belytschko and Hughes (eds), Computational Methods for Transient
Analysis (1983), ch. 5 (from memory, not verified).
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from mpi4py import MPI

from geometry.meshing.cell_measures import eigen_length
from geometry.meshing.quality import over_cells
from rail_fem.fe.contact.contact import Contact
from rail_fem.fe.contact.pairs import CARRIED
from rail_fem.fe.contact.surface import ContactSurfaces
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.dynamics_part import DynamicsPart
from rail_fem.fe.elastic_group import ElasticGroup
from rail_fem.fe.elastic_kernels import add_functions
from rail_fem.fe.pass_supports import loaded_stiffness
from rail_fem.fe.passage import Passage, start_velocities
from rail_fem.fe.state import LINEAR_VISCOSITY, QUADRATIC_VISCOSITY
from rail_fem.fe.structure import Structure
from rail_fem.fe.supports import Supports
from rail_fem.scene.scene import Scene

COURANT = 0.9
# of the frequency of the wheel on its contact: the damping; over one over it: the time in which the axle would make up
# for what the contact lacks, and that of giving up. What follows a frequency w with damping a is stable where the time
# is longer than 1/a, whatever w is: here six times as long, for waves of the bodies beside one another
DAMPING, DELAY, PATIENCE = 16.0, 0.4, 60.0
# at rest: force of the contact and of the axle off the load, mean of two steps; kinetic energy over the load's work
LOAD_ERROR, ENERGY_SHARE = 3e-3, 1e-5
# at rest too where single nodes of the contact go on bouncing: forces within LOAD_ERROR and steady to STEADY over two
# times DELAY, kinetic energy below CHATTER of the work
STEADY, CHATTER = 1e-3, 1e-3
LOOK = 20  # steps between looks


@dataclass(frozen=True)
class StaticStart:
    """approach : of the wheel to the crossing [m];  error : force of contact over the load, less 1;  steps : taken"""

    approach: float
    error: float
    steps: int


class Relaxation:
    """The nodes and elements of a pass on their way to rest, with masses and supports of their own; from its STATE it
    goes on to the same end.

    base, axle : groups of base and wheel;  frequency : of the wheel on its contact [rad/s];  dt : step [s]
    errors : of contact and axle at each look;  spent : time so far [s], kept for the run
    """

    STATE = ("dynamics", "dt", "errors", "spent")

    def __init__(self, passage: Passage, scene: Scene):
        """Collective."""
        self.passage, self.stiffness = passage, loaded_stiffness(scene, passage.running)
        structure = _with_even_steps(passage.dynamics.structure)
        of_pass = passage.dynamics.contact
        surfaces = ContactSurfaces(structure, *of_pass.surfaces.each())
        contact = Contact(surfaces, replace(of_pass.settings, friction=0.0, refresh=LOOK))
        owned = structure.domain.n_owned
        wheel = structure.mass[:owned] @ passage.on_wheel[:owned]
        self.frequency = np.sqrt(self.stiffness / structure.domain.comm.allreduce(float(wheel)))
        damping = DAMPING * self.frequency
        self.base, self.axle = (group.relaxing(damping) for group in (passage.crossing, passage.axle))
        structure.v[:] = 0.0
        still = (passage.dynamics.inverse_mass == 0.0).reshape(-1, 3) & ~passage.on_wheel[:, None]
        along = [_GoingAlong(self.axle, passage.on_wheel)] if isinstance(self.axle, ElasticGroup) else []
        self.dynamics = Dynamics(structure, Supports([self.base, self.axle]), contact, still, damping, more=along)
        self.dt = self.dynamics.stable_step(COURANT)
        self.errors: list[tuple[float, float]] = []
        self.spent = 0.0


def settle_in_place(
    relaxation: Relaxation, most_steps: int | None = None, look: Callable[[str], None] | None = None
) -> StaticStart:
    """Static contact at the start of the pass, without motion. Collective.

    most_steps : after which it is taken as it is, for runs whose result has no meaning;  look : hears as it goes on
        how far it is, and may keep it then
    Errors: ArithmeticError where the wheel does not come to rest.
    """
    passage = relaxation.passage
    error = _relax(relaxation, most_steps, look)
    passage.axle.stand_as(relaxation.axle)
    passage.crossing.stand_as(relaxation.base)
    if passage.sprung is not None:
        passage.sprung.displacement[2] = relaxation.axle.displacement[2]
    passage.dynamics.structure.v[:] = 0.0
    start_velocities(passage.dynamics, passage.running, passage.axle, passage.sprung)
    passage.dynamics.begin_here()
    return StaticStart(-float(relaxation.axle.displacement[2]), error, relaxation.dynamics.step_count)


class _GoingAlong(DynamicsPart):
    """Carries the nodes of a body along with the rigid motion of its elastic base, which leans slowly: against their
    damping it would take long."""

    def __init__(self, group: ElasticGroup, nodes: np.ndarray) -> None:
        self.group, self.nodes = group, nodes

    def join(self, structure: Structure) -> None:
        held, _ = structure.domain.local_nodes(self.group.input_nodes, owned_only=False)
        self.place, self.own = structure.x, np.setdiff1d(np.flatnonzero(self.nodes), held)
        self.along = self.group.rigid_functions(structure.domain.reference.reshape(-1, 3)[self.own])

    def drift(self, dt: float) -> None:
        add_functions(self.own, self.along, dt * self.group.rigid_rates, self.place)


def _with_even_steps(structure: Structure) -> Structure:
    """A structure over the same state whose elements all have the critical step of the one that has the least;
    without bulk viscosity, which would overdamp the large ones. Collective."""
    own = copy(structure)
    own.works = np.zeros(3)
    own.least_step = 0.0  # steel again: the steps are made even below
    length = over_cells(eigen_length, own.domain.reference.reshape(-1, 3), own.domain.cells)
    least = own.domain.comm.allreduce(float(length.min(initial=np.inf)), op=MPI.MIN)
    own.mass = own.lumped_mass((least / length) ** 2)
    rows = structure.table.rows.copy()
    rows[:, [LINEAR_VISCOSITY, QUADRATIC_VISCOSITY]] = 0.0
    own.table = structure.table._replace(rows=rows)
    own.settings = replace(structure.settings, linear_viscosity=0.0, quadratic_viscosity=0.0)
    return own


def _relax(r: Relaxation, most_steps: int | None, look: Callable[[str], None] | None) -> float:
    """Steps until contact and axle carry the load of the start and nothing moves; the contact's relative error then.
    Collective."""
    d, axle, load = r.dynamics, r.axle, r.passage.start.force
    work, delay = load**2 / (2 * r.stiffness), DELAY / r.frequency
    long = max(2, int(np.ceil(2 * delay / (LOOK * r.dt))))  # in looks
    while True:
        before = _carried(d), float(axle.reaction[2])
        axle.velocity[2] = (before[0] - load) / (r.stiffness * delay)
        d.step(r.dt)
        cut = most_steps is not None and d.step_count >= most_steps
        if d.step_count % LOOK and not cut:
            continue
        # mean of two steps: a node of the contact that bounces from one step to the next stands at its middle
        now = _carried(d), float(axle.reaction[2])
        r.errors.append(((now[0] + before[0]) / (2 * load) - 1, (now[1] + before[1]) / (2 * load) - 1))
        error = r.errors[-1][0]
        kinetic = d.comm.allreduce(d.structure.kinetic_energy())
        steady = len(r.errors) > long and np.ptp(r.errors[-long:], axis=0).max() < STEADY
        still = kinetic < ENERGY_SHARE * work or (steady and kinetic < CHATTER * work)
        if cut or (np.abs(r.errors[-1]).max() < LOAD_ERROR and still):
            return error
        if d.time * r.frequency > PATIENCE or not np.isfinite(kinetic):
            raise ArithmeticError(
                f"the wheel does not come to rest at the start: after {d.step_count} steps the contact lacks"
                f" {-error:.2%} of {load / 1e3:.1f} kN, kinetic energy {kinetic:.2g} J: begin elsewhere"
            )
        if look:
            look(f"static contact at the start: step {d.step_count}, force off by {error:+.2%}")


def _carried(d: Dynamics) -> float:
    """Force of the contact upwards on the wheel [N]. Replicated."""
    return float(d.contact.sums[CARRIED])
