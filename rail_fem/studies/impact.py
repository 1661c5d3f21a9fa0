"""Speed against error: two elastic bodies pressed together until they rest, held to Hertz at several element sizes.

    rail-fem study verification --only contact

Explicit dynamics with mass damping relaxes a quarter of wheel and rail (radii 460 and 300 mm, 100 kN) under the load.
Pressure is what a surface node carries over its area, for the balanced contact puts half of it there by the other
surface. The semi-axes come from second moments of that pressure, a^2 = 5 <x^2>, exact for Hertz' ellipse: counting the
nodes under pressure would be in error by half an element all round.
"""

import time
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI

from bem.exact.hertz import PointContact, point_contact
from bem.material import STEEL, contact_modulus
from geometry.meshing.blocks import mesh_cap
from geometry.meshing.hexmesh import HexMesh, merge_bodies
from rail_fem.fe.contact.contact import Contact
from rail_fem.fe.contact.search import ContactSettings
from rail_fem.fe.contact.surface import ContactSurfaces, Surface
from rail_fem.fe.domain import Domain
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.structure import Structure
from rail_fem.fe.supports import RigidGroup, Supports
from rail_fem.files.markdown import markdown_table
from rail_fem.scene.steel import Steel

WHEEL_RADIUS, RAIL_RADIUS, LOAD = 0.460, 0.300, 100e3
FE_STEEL = Steel(STEEL.young, STEEL.poisson, 7850.0)
# the contact carries the load within this part of it, and the kinetic energy is that part squared of the elastic one
REST = 1e-4
BOUNCE = 10.0  # on that energy: single nodes of meshes that do not match go on bouncing, the force by 2e-4


class MirroredContact(Contact):
    """Contact of bodies cut along symmetry planes: no force in directions that the planes hold, `held` (n_nodes, 3)
    bool of local nodes."""

    def __init__(self, surfaces: ContactSurfaces, settings: ContactSettings, held: np.ndarray):
        super().__init__(surfaces, settings)
        self.held = surfaces.gather(np.where(held, 1.0, 0.0)) > 0.5

    def add_forces(self, dt: float) -> None:
        super().add_forces(dt)
        self.force[self.held] = 0.0


def keep_positive(mesh: HexMesh, axes: tuple[int, ...]) -> HexMesh:
    """The part of a mesh on the positive side of the planes x = 0 (axis 0) and y = 0 (axis 1), which must be mesh
    planes."""
    keep = (mesh.points[mesh.cells].mean(axis=1)[:, list(axes)] > 0).all(axis=1)
    used = np.unique(mesh.cells[keep])
    number = np.full(len(mesh.points), -1)
    number[used] = np.arange(len(used))
    surface, clamp = number[mesh.surface], number[mesh.clamp]
    whole = (surface >= 0).all(axis=1)
    faces = surface[whole], mesh.surface_region[whole]
    cells = number[mesh.cells[keep]], mesh.region[keep]
    return HexMesh(mesh.points[used], *cells, mesh.region_names, *faces, clamp[clamp >= 0])


def press(
    comm: MPI.Comm,
    wheel: HexMesh,
    rail: HexMesh,
    load: float,
    frequency: float,
    penalty: float,
    mirrors=(0, 1),
    still=(),
    steel: Steel = FE_STEEL,
) -> Dynamics:
    """Rail on a fixed base, wheel under a rigid plate with the load [N], ready to relax.

    wheel, rail : meshes of `mesh_cap`, facing down and up;  mirrors : axes whose zero plane is a symmetry plane
    still : axes along which nothing moves (plane strain);  frequency : lowest angular frequency on the contact, for the
        damping [rad/s]
    penalty : in P-wave moduli per edge of the contact's smallest facet
    """
    mesh = merge_bodies([rail, wheel])
    domain = Domain(comm, *((mesh.points, mesh.cells, mesh.region) if comm.rank == 0 else (None,) * 3))
    structure = Structure(domain, [steel] * 2, small=(0, 1))
    split = len(rail.clamp)
    base = RigidGroup("base", mesh.clamp[:split])
    plate = RigidGroup("plate", mesh.clamp[split:], free=(False, False, True), load=np.array([0.0, 0.0, -load]))
    x = structure.x.reshape(-1, 3)
    fixed = np.zeros(x.shape, bool)
    for axis in mirrors:
        fixed[:, axis] = np.abs(x[:, axis]) < 1e-9
    fixed[:, list(still)] = True
    surfaces = ContactSurfaces(
        structure, *(Surface.from_quads(mesh.surface[mesh.surface_region == body]) for body in (0, 1))
    )
    edge = np.linalg.norm(mesh.points[mesh.surface[:, 1]] - mesh.points[mesh.surface[:, 0]], axis=1).min()
    modulus = steel.density * steel.wave_speed**2
    contact = MirroredContact(surfaces, ContactSettings(penalty * modulus / edge), fixed)
    return Dynamics(structure, Supports([base, plate]), contact, fixed, mass_damping=1.4 * frequency)


def settle(dynamics: Dynamics, load: float, energy: float, longest: float) -> None:
    """Step until the bodies rest: the contact carries the load [N], the kinetic energy is negligible against `energy`
    [J]. Collective.

    Raises ArithmeticError when that has not come after `longest` [s].
    """
    dt = dynamics.stable_step()
    while True:
        for _ in range(100):
            dynamics.step(dt)
        dynamics.check()
        kinetic = dynamics.comm.allreduce(dynamics.structure.kinetic_energy())
        carried = -dynamics.contact.force_on_rail()[2]
        if abs(carried / load - 1) < REST and kinetic < BOUNCE * REST**2 * energy:
            return
        if dynamics.time > longest:
            raise ArithmeticError(
                f"not at rest after {longest * 1e3:.3g} ms: the contact carries {carried:.4g} N of {load:.4g} N,"
                f" kinetic energy {kinetic:.3g} J"
            )


def rail_pressure(contact: Contact) -> np.ndarray:
    """Pressure at the rail's surface nodes (n_rail,) [Pa]: the normal force that each carries over its area."""
    return contact.normal_force[: contact.surfaces.n_rail] / contact.surfaces.area[: contact.surfaces.n_rail]


def moment_axis(contact: Contact, axis: int, moment: float) -> float:
    """Half length [m] of the pressed area along an axis: sqrt(<x^2> / moment), moment 1/5 for an ellipse, 1/4 for a
    line contact."""
    count = contact.surfaces.n_rail
    normal_force, x = contact.normal_force[:count], contact.surfaces.reference[:count, axis]
    return float(np.sqrt((normal_force * x**2).sum() / normal_force.sum() / moment))


@dataclass(frozen=True)
class Indentation:
    """Errors are relative to Hertz: (computed - exact) / exact. size [m] of the elements, across: of them over the
    minor axis;  overlap : largest of a node in the other surface, allowed : the largest pressure of a node over the
    penalty stiffness, both over Hertz' approach."""

    size: float
    across: float
    cells: int
    steps: int
    wall: float
    rate: float
    pressure_error: float
    area_error: float
    overlap: float
    allowed: float


def indent(
    across: int, wheel_to_rail: float = 1.0, penalty: float = 10.0, comm: MPI.Comm = MPI.COMM_WORLD
) -> Indentation:
    """Wheel on rail with `across` elements over the minor axis of the patch; the wheel's elements are `wheel_to_rail`
    times the rail's."""
    exact = point_contact(LOAD, WHEEL_RADIUS, RAIL_RADIUS, contact_modulus(STEEL, STEEL))
    size = 2 * exact.semi_y / across
    rail = body(exact, np.inf, RAIL_RADIUS, size, "up")
    wheel = body(exact, WHEEL_RADIUS, np.inf, size * wheel_to_rail, "down")
    mass = FE_STEEL.density * 0.04 * 0.035**2
    dynamics = press(comm, wheel, rail, LOAD / 4, np.sqrt(1.5 * LOAD / 4 / exact.approach / mass), penalty)
    start = time.perf_counter()
    settle(dynamics, LOAD / 4, 0.4 * LOAD / 4 * exact.approach, 5e-3)
    wall, contact = time.perf_counter() - start, dynamics.contact
    area = np.pi * moment_axis(contact, 0, 1 / 5) * moment_axis(contact, 1, 1 / 5)
    cells, steps = dynamics.domain.m_global, dynamics.step_count
    peak = rail_pressure(contact).max()
    return Indentation(
        size,
        across,
        cells,
        steps,
        wall,
        cells * steps / wall / comm.size,
        peak / exact.max_pressure - 1,
        area / exact.area - 1,
        contact.overlap()[0] / exact.approach,
        max(pairs.pressure.max() for pairs in contact.pairs) / contact.settings.stiffness / exact.approach,
    )


def body(exact: PointContact, radius_x: float, radius_y: float, size: float, facing: str) -> HexMesh:
    """A quarter of a block 80 x 70 x 35 mm with a curved face, fine a fifth beyond the patch, where its size changes
    the pressure by 0.2 %."""
    fine = tuple(np.ceil(reach / size) * size for reach in (1.2 * exact.semi_x, 1.2 * exact.semi_y, exact.semi_y))
    return keep_positive(
        mesh_cap(radius_x, radius_y, (0.04, 0.035), 0.035, size, fine, facing=facing, name=facing), (0, 1)
    )


def table(rows: list[Indentation]) -> str:
    """Markdown, coarse to fine; the order is that of a row against the one before."""
    head = ["element [mm]", "across patch", "elements", "steps", "wall [s]", "updates/s/core [million]"]
    head += ["peak pressure error", "order", "area error", "order", "largest overlap"]
    lines = []
    for i, row in enumerate(rows):
        orders = ["", ""]
        if i:
            ratio, before = np.log(rows[i - 1].size / row.size), rows[i - 1]
            pairs = [(before.pressure_error, row.pressure_error), (before.area_error, row.area_error)]
            orders = [f"{np.log(abs(coarse / fine)) / ratio:.2f}" for coarse, fine in pairs]
        cost = [f"{row.size * 1e3:.3f}", *map(str, (row.across, row.cells, row.steps))]
        cost += [f"{row.wall:.1f}", f"{row.rate / 1e6:.1f}"]
        errors = [f"{row.pressure_error:+.2%}", orders[0], f"{row.area_error:+.2%}", orders[1], f"{row.overlap:.2%}"]
        lines.append(cost + errors)
    return "\n".join(markdown_table(head, lines)) + "\n"
