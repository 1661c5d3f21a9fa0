"""One run with everything in it, for tests/fe/test_ranks.py:
mpirun -n N python -m mpi4py tests/fe/rank_job.py OUT.npz [cyclic]

A plastic block on a fixed base, an elastic cap under a loaded sprung plate that slides over it with friction. Root
writes forces, energies and the state of all nodes and cells in the order of the input mesh.
"""

import sys

import numpy as np
from mpi4py import MPI

from geometry.meshing.blocks import mesh_cap
from geometry.meshing.hexmesh import merge_bodies
from rail_fem.fe.contact.contact import Contact
from rail_fem.fe.contact.search import ContactSettings
from rail_fem.fe.contact.surface import ContactSurfaces, Surface
from rail_fem.fe.domain import Domain
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.rolling_wheel import RollingWheel
from rail_fem.fe.structure import Structure
from rail_fem.fe.supports import Link, RigidGroup, Supports
from rail_fem.scene.steel import MN13, R8T, cyclic_steel
from tests.fe.gathered import gather_nodes, gather_rows

CYCLIC = cyclic_steel(190.772e9, 0.3, 7433.0, yield_stress=310e6, modulus=[60e9, 5e9], recovery=[600.0, 20.0])


class Counting(MPI.Intracomm):
    """Counts the sums over all ranks."""

    sums = 0

    def Allreduce(self, *arguments, **options):
        Counting.sums += 1
        return super().Allreduce(*arguments, **options)


def build(comm, steel=MN13):
    block = mesh_cap(np.inf, np.inf, (6e-3, 5e-3), 5e-3, 0.6e-3, (3e-3, 2.4e-3, 2.4e-3), facing="up", name="block")
    cap = mesh_cap(0.03, 0.02, (4e-3, 4e-3), 5e-3, 0.5e-3, (2e-3, 2e-3, 2e-3), facing="down", name="cap")
    mesh = merge_bodies([block, cap])
    domain = Domain(comm, *((mesh.points, mesh.cells, mesh.region) if comm.rank == 0 else (None,) * 3))
    structure = Structure(domain, [steel, R8T], small=(1,))
    split = len(block.clamp)
    base = RigidGroup("base", mesh.clamp[:split])
    plate = RigidGroup(
        "plate", mesh.clamp[split:], added_mass=0.5, free=(False, False, True), load=np.array([0.0, 0.0, -8e3])
    )
    axle = RigidGroup("axle", np.empty(0, int), added_mass=5.0, free=(False, False, True))
    plate.velocity = np.array([0.0, 0.0, -3.0])
    links = [Link("suspension", plate, axle, 5e7, 2e3), Link("ground", axle, None, 1e6, 1e3)]
    cap_nodes = np.unique(domain.cells[domain.region == 1])
    structure.v.reshape(-1, 3)[cap_nodes] = plate.velocity
    surfaces = [Surface.from_quads(mesh.surface[mesh.surface_region == body]) for body in (0, 1)]
    settings = ContactSettings(10 * MN13.density * MN13.wave_speed**2 / 0.5e-3, friction=0.3, refresh=20)
    wheel, owners = RollingWheel(5.0, -5.0 / 0.03, (0.0, 0.0, 0.03)), max(comm.size - 1, 1)
    contact = Contact(ContactSurfaces(structure, *surfaces), settings, wheel, owners)
    return mesh, Dynamics(structure, Supports([base, plate, axle], links), contact)


def apart(domain: Domain, field: np.ndarray) -> float:
    """By how much the values of one node differ between the ranks that have it, at most. Collective."""
    low, high = np.full((2, domain.n_global, 3), np.inf)
    low[domain.node_input], high[domain.node_input] = field.reshape(-1, 3), -field.reshape(-1, 3)
    for least in (low, high):
        domain.comm.Allreduce(MPI.IN_PLACE, least, MPI.MIN)
    return float(np.abs(low + high).max())


def wrong_sums(domain: Domain) -> float:
    """By how much, at most, sums of the nodes with an even number in the input, and of all, are off: each rank adds
    numbers of its own. Collective."""
    comm, number, some = domain.comm, np.repeat(domain.node_input, 3), domain.halo()
    of_rank = lambda rank: np.pi ** (rank + 1.0) + number
    there = comm.allgather(np.bincount(domain.node_input, minlength=domain.n_global))
    expected = sum(there[rank][number] * of_rank(rank) for rank in range(comm.size))
    even, summed, every = number % 2 == 0, of_rank(comm.rank), of_rank(comm.rank)
    some.choose(even[::3])
    some.sum_up(summed)
    domain.sum_up(every)
    off = max(np.abs(every / expected - 1).max(), np.abs(summed - np.where(even, every, of_rank(comm.rank))).max())
    return comm.allreduce(float(off), op=MPI.MAX)


def main(out, law=""):
    comm = MPI.COMM_WORLD
    mesh, dynamics = build(comm, CYCLIC if law == "cyclic" else MN13)
    structure, domain, contact = dynamics.structure, dynamics.domain, dynamics.contact
    dt, force, sums = dynamics.stable_step(), [], []
    dynamics.comm = contact.surfaces.comm = Counting(comm)
    for _ in range(400):
        before = Counting.sums
        dynamics.step(dt)
        sums.append(Counting.sums - before)
        force.append(contact.force_on_rail())
    dynamics.check()
    energies = dynamics.energies()
    plastic = structure.finite.plastic_strain()
    x, v = gather_nodes(domain, structure.x), gather_nodes(domain, structure.v)
    peeq = gather_rows(comm, domain.cell_input[structure.finite_cells], plastic, len(mesh.cells))
    stress = gather_rows(comm, domain.cell_input[structure.finite_cells], structure.finite.stress(), len(mesh.cells))
    of_one_node = [apart(domain, field) for field in (structure.x, structure.v, structure.force)]
    exchange, ahead = wrong_sums(domain), comm.allreduce(len(dynamics.ahead))
    if comm.rank == 0:
        reactions = np.array([group.reaction for group in dynamics.supports.groups[:2]])
        np.savez(
            out,
            dt=dt,
            force=np.array(force),
            x=x,
            v=v,
            peeq=peeq[mesh.region == 0],
            stress=stress[mesh.region == 0],
            pressure=contact.pressure_at,
            reactions=reactions,
            energies=np.array(list(energies.values())),
            ranks=comm.size,
            sums=np.array(sums),
            ahead=ahead,
            exchange=exchange,
            apart=of_one_node,
        )


if __name__ == "__main__":
    main(*sys.argv[1:])
