"""An elastic cap rolls over a long plastic block on a rigid base that moves on springs: the scene of
tests/fe/test_travelling_window.py, and its run on several ranks.

    python -m mpi4py tests/fe/rolling_job.py OUT.npz STEPS
"""

import sys
from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
from mpi4py import MPI

from geometry.meshing.blocks import mesh_cap, mesh_grid
from geometry.meshing.hexmesh import merge_bodies
from rail_fem.fe.blocks import ElementSettings
from rail_fem.fe.contact.contact import Contact
from rail_fem.fe.contact.search import ContactSettings
from rail_fem.fe.contact.surface import ContactSurfaces, Surface
from rail_fem.fe.domain import Domain
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.rolling_wheel import RollingWheel
from rail_fem.fe.slabs import cut_into_slabs, slab_parts
from rail_fem.fe.structure import Structure
from rail_fem.fe.supports import Link, RigidGroup, Supports
from rail_fem.fe.window import Extent, TravellingWindow
from rail_fem.scene.steel import MN13, R8T, Steel
from tests.fe.gathered import gather_cells, gather_nodes

MM = 1e-3
LENGTH, WIDTH, DEPTH, SIZE = 48 * MM, 6 * MM, 6 * MM, 1 * MM
RADIUS, START, SPEED = 30 * MM, 12.13 * MM, 100.0
ASIDE = 0.17 * MM  # y of the cap: none of its nodes lies over an edge of the block, where either facet would do
BODY_MASS = 2.0  # of block and base [kg]


def bodies(start: float):
    """Block, its top at z = 0, in slabs of 1 mm elements, and a cap above x = start [m]."""
    x, y = np.linspace(0, LENGTH, round(LENGTH / SIZE) + 1), np.linspace(-WIDTH / 2, WIDTH / 2, 7)
    block = mesh_grid(x, y, np.linspace(-DEPTH, 0.0, 7), "block")
    cap = mesh_cap(RADIUS, RADIUS, (4 * MM, 3 * MM), 5 * MM, 0.8 * MM, (2.4 * MM, 2.4 * MM, 2.4 * MM), name="cap")
    cap.points[:] += [start, ASIDE, 0.0]
    return merge_bodies([block, cap])


def rolling(
    comm,
    ahead: float | None = None,
    behind: float | None = None,
    sign: float = 1.0,
    steel: Steel = MN13,
    settings: ElementSettings = ElementSettings(),
    friction: float = 0.3,
    bodies: Callable = bodies,
    start: float = START,
):
    """The scene at its start. ahead, behind : of the travelling window [m], None for the whole block;  sign : +1
    towards +x, -1 its mirror image;  steel : of the block;  start : x of the cap [m]"""
    start = start if sign > 0 else LENGTH - start
    mesh, shortest, load = bodies(start), 3 * MM, 4e3
    slabs = None if ahead is None else cut_into_slabs(mesh.points, mesh.cells, mesh.region, (0,), shortest)
    centres = mesh.points[mesh.cells].mean(axis=1)
    part = slabs and slab_parts(centres, mesh.region, slabs.of_cells(centres[:, 0], mesh.region), np.ones(comm.size))
    given = (mesh.points, mesh.cells, mesh.region, part if slabs else None) if comm.rank == 0 else ()
    domain = Domain(comm, *given)
    slab = slabs and slabs.of_cells(domain.cell_centres()[:, 0], domain.region)
    structure = Structure(domain, [steel, R8T], (1,), settings, slab if slabs else None)
    is_cap = np.isin(mesh.clamp, mesh.cells[mesh.region == 1])
    vertical = (False, False, True)
    base = RigidGroup("base", mesh.clamp[~is_cap], free=vertical)
    plate = RigidGroup("plate", mesh.clamp[is_cap], 0.5, vertical, load=np.array([0.0, 0.0, -load]))
    plate.velocity = np.array([0.0, 0.0, -0.6])
    structure.v.reshape(-1, 3)[np.unique(domain.cells[domain.region == 1])] = plate.velocity
    block, cap = (Surface.from_quads(mesh.surface[mesh.surface_region == body]) for body in (0, 1))
    law = ContactSettings(MN13.density * MN13.wave_speed**2 / SIZE, friction=friction, refresh=20)
    wheel = RollingWheel(sign * SPEED, sign * SPEED / RADIUS, axle=(start, 0.0, RADIUS), inertia=1e-3)
    contact = Contact(ContactSurfaces(structure, block, cap), law, wheel)
    window = None
    if slabs is not None:
        extent = Extent(start, sign, ahead, behind)
        window = TravellingWindow(structure, slabs, extent, base, contact, np.zeros(len(block.quads), np.int64))
    damper = Link("settling", plate, None, 0.0, 4e3)
    ground = Link("ground", base, None, 2e7, 1e3)
    dynamics = Dynamics(structure, Supports([base, plate], [damper, ground]), contact, window=window)
    base.mesh_mass = float(structure.region_masses()[0])
    base.add_mass_up_to(BODY_MASS, "")
    return SimpleNamespace(mesh=mesh, dynamics=dynamics, base=base, plate=plate, window=window, slabs=slabs)


def run(scene, steps: int, dt: float | None = None) -> SimpleNamespace:
    """So many steps; forces on the block (steps, 3) and the energies every 25 steps."""
    d = scene.dynamics
    dt = dt or d.stable_step()
    force, energies = [], []
    for step in range(steps):
        d.step(dt)
        force.append(d.contact.force_on_rail())
        if step % 25 == 24:
            d.check()
            energies.append(d.energies())
    d.bring_up()
    return SimpleNamespace(force=np.array(force), energies=energies, dt=dt)


def main(out: str, steps: int) -> None:
    scene = rolling(MPI.COMM_WORLD, 9 * MM, 9 * MM)
    found, d = run(scene, steps), scene.dynamics
    x, cells = gather_nodes(d.domain, d.structure.x), gather_cells(d)
    if MPI.COMM_WORLD.rank == 0:
        last = found.energies[-1]
        np.savez(
            out,
            force=found.force,
            x=x,
            stress=cells[:, :6],
            plastic_strain=cells[:, 6],
            energies=np.array(list(last.values())),
            base=scene.base.displacement,
            mass=scene.base.node_mass,
            active=scene.window.active,
            updates=d.updates,
        )


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
