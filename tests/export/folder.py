"""A small run folder for tests of the exports: written by the program's own writers, every value another number."""

import dataclasses
from pathlib import Path

import numpy as np

from geometry.meshing.blocks import mesh_box
from geometry.meshing.hexmesh import HexMesh, merge_bodies
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.fields import write_frame
from rail_fem.models.fe_full import _write_mesh
from tests.fe.bodies import STEEL, distort, place, plastic, structure_of
from tests.fe.gathered import gather_cells

SIDES = {"wing": (3, 2, 2), "nose": (2, 2, 2), "wheel": (2, 3, 2)}
SHIFT = {"wing": (0, 0, 0), "nose": (0, 3, 0), "wheel": (1, 1, 3)}
OFFSET = 0.25  # how far the wheel has run [m]


def three_bodies() -> HexMesh:
    """Three boxes of cells of about 1 m, their inner nodes moved at random so that no cell is a parallelepiped; the
    wheel's contact surface is its lowest plane, its clamp the highest."""
    bodies = []
    for seed, (name, counts) in enumerate(SIDES.items()):
        box = mesh_box(tuple(map(float, counts)), counts, name=name)
        if name == "wheel":
            turned = box.points * [1, -1, -1]  # upside down, still right-handed
            box = dataclasses.replace(box, points=turned - turned.min(axis=0))
        box = distort(box, 0.25, seed, boundary=False)
        bodies.append(dataclasses.replace(box, points=box.points + SHIFT[name]))
    return merge_bodies(bodies)


def bend(points: np.ndarray) -> np.ndarray:
    """A smooth displacement of some 1e-3 [m]."""
    x, y, z = points.T
    return 1e-3 * np.column_stack([np.sin(x + 2 * y), x * z, np.cos(y) * z])


def write_run(folder: Path, motion=bend) -> tuple[HexMesh, np.ndarray]:
    """mesh.npz and fields/final.vtu of the bodies displaced by `motion`, which makes them yield; the mesh, and stress
    (6) and plastic strain of its cells (m, 7)."""
    mesh = three_bodies()
    structure = structure_of(mesh, *[plastic(STEEL, 50e6, 2e9)] * 3)
    start = structure.x.reshape(-1, 3).copy()
    place(structure, start + motion(start), 1e-3)
    dynamics = Dynamics(structure)
    dynamics.time = 1.25e-3
    _write_mesh(folder / "mesh.npz", mesh, 0.0, 0.0, {})
    write_frame(folder / "fields" / "final.vtu", dynamics, OFFSET)
    return mesh, gather_cells(dynamics)
