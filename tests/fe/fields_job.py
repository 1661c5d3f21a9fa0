"""A field file that all ranks write, for tests/fe/test_fields.py:

    mpirun -n N python -m mpi4py tests/fe/fields_job.py FOLDER [full|lost]

Writes FOLDER/frame.vtu; prints what went wrong on each rank. full: a rank cannot write; lost: a rank ends in the middle
of it.
"""

import dataclasses
import json
import sys
from pathlib import Path

import numpy as np
from mpi4py import MPI

from geometry.meshing.blocks import mesh_box
from geometry.meshing.hexmesh import HexMesh, merge_bodies
from rail_fem.fe.domain import Domain
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.fields import write_frame
from rail_fem.fe.structure import Structure
from tests.fe.bodies import STEEL, distort, place, plastic
from tests.fe.shared_job import break_last_rank

COUNTS = {"wing": (18, 16, 16), "nose": (4, 3, 3), "wheel": (5, 4, 4)}  # cells: more than a chunk of rows
OFFSET, TIME = 0.25, 1.25e-3  # how far the wheel has run [m], time of the fields [s]


def bodies() -> HexMesh:
    """Three boxes of distorted cells of 1 m; numbers of cells and nodes shuffled."""
    parts = []
    for seed, (name, counts) in enumerate(COUNTS.items()):
        box = distort(mesh_box(tuple(map(float, counts)), counts, name=name), 0.1, seed)
        parts.append(dataclasses.replace(box, points=box.points + [0.0, 30.0 * seed, 0.0]))
    mesh, rng = merge_bodies(parts), np.random.default_rng(7)
    cells, nodes = rng.permutation(len(mesh.cells)), rng.permutation(len(mesh.points))
    points = np.empty_like(mesh.points)
    points[nodes] = mesh.points
    return dataclasses.replace(
        mesh,
        points=points,
        cells=nodes[mesh.cells[cells]],
        region=mesh.region[cells],
        surface=nodes[mesh.surface],
        clamp=nodes[mesh.clamp],
    )


def motion(points: np.ndarray) -> np.ndarray:
    """A smooth displacement [m] that makes the first two bodies yield here and there."""
    x, y, z = points.T
    return 1e-3 * np.column_stack([np.sin(x + 2 * y), x * z / 10, np.cos(y) * z / 10])


def displaced(comm) -> Dynamics:
    """The bodies displaced by `motion`."""
    mesh = bodies()
    domain = Domain(comm, *((mesh.points, mesh.cells, mesh.region) if comm.rank == 0 else ()))
    structure = Structure(domain, [plastic(STEEL, 50e6, 2e9)] * 2 + [STEEL], small=(2,))
    start = structure.x.reshape(-1, 3).copy()
    place(structure, start + motion(start), 1e-3)
    dynamics = Dynamics(structure)
    dynamics.time = TIME
    return dynamics


def main(folder: Path, how: str) -> None:
    comm = MPI.COMM_WORLD
    dynamics, fault = displaced(comm), None
    if how:
        break_last_rank(comm, how)
    try:
        write_frame(folder / "frame.vtu", dynamics, OFFSET)
    except ValueError as error:
        fault = str(error)
    faults = comm.gather(fault)
    if comm.rank == 0:
        print(json.dumps(faults))


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else "")
