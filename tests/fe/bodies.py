"""Bodies for the tests of the explicit solver: serial structures on simple meshes, and motions imposed on all their
nodes."""

import dataclasses

import numpy as np
from mpi4py import MPI

from geometry.meshing.hexmesh import HexMesh, boundary_faces
from rail_fem.fe.blocks import ElementSettings
from rail_fem.fe.domain import Domain
from rail_fem.fe.structure import Structure
from rail_fem.scene.steel import Steel

STEEL = Steel(210e9, 0.3, 7850.0)
NO_VISCOSITY = ElementSettings(linear_viscosity=0.0, quadratic_viscosity=0.0)


def plastic(steel: Steel, yield_stress: float, hardening: float = 0.0) -> Steel:
    """The steel with linear isotropic hardening: yield stress [Pa], slope over plastic strain [Pa]; the line ends at a
    strain of 10."""
    return Steel(
        steel.youngs_modulus, steel.poisson, steel.density, [0.0, 10.0], [yield_stress, yield_stress + 10 * hardening]
    )


def lame(steel: Steel) -> tuple[float, float]:
    """Lame's constants lambda and mu [Pa]."""
    return steel.elastic.bulk - 2 / 3 * steel.elastic.shear, steel.elastic.shear


def structure_of(mesh: HexMesh, *steels: Steel, **options) -> Structure:
    """The mesh as a serial structure, steel by default."""
    domain = Domain(MPI.COMM_SELF, mesh.points, mesh.cells, mesh.region, keep_mesh=True)
    return Structure(domain, list(steels) or [STEEL], **options)


def distort(mesh: HexMesh, amount: float, seed: int, boundary: bool = True) -> HexMesh:
    """All nodes, or only those inside, moved at random by up to `amount` [m] along each axis."""
    points = mesh.points
    shift = np.random.default_rng(seed).uniform(-amount, amount, points.shape)
    if not boundary:
        shift[((points == points.min(axis=0)) | (points == points.max(axis=0))).any(axis=1)] = 0.0
    return dataclasses.replace(mesh, points=points + shift)


def bottom(mesh: HexMesh) -> np.ndarray:
    """Facets (k, 4) of the lowest plane of an undistorted mesh, outward."""
    faces, _ = boundary_faces(mesh.cells)
    z = mesh.points[:, 2]
    return faces[(z[faces] < z.min() + 1e-9).all(axis=1)]


def place(structure: Structure, points: np.ndarray, dt: float) -> None:
    """Move all nodes to `points` (n, 3) [m] in one step of dt [s]; stresses and forces follow."""
    target = points.ravel()
    structure.v[:] = (target - structure.x) / dt
    structure.x[:] = target
    structure.force[:] = 0.0
    structure.add_internal_force(dt)


def at(structure: Structure, axis: int, value: float, tolerance: float = 1e-9) -> np.ndarray:
    """Nodes (n_nodes,) bool whose reference coordinate is `value` [m]."""
    return np.abs(structure.domain.reference.reshape(-1, 3)[:, axis] - value) < tolerance


def dense_stiffness(structure: Structure, free: np.ndarray) -> np.ndarray:
    """K (f, f) [N/m] of the free unknowns, free : (3 n_nodes,) bool, column by column."""
    columns = np.flatnonzero(free)
    stiffness = np.empty((len(columns), len(columns)))
    for j, column in enumerate(columns):
        unit = structure.domain.nodal_vector()
        unit[column] = 1.0
        stiffness[:, j] = structure.stiffness_times(unit)[columns]
    return stiffness


def momentum(structure: Structure) -> tuple[np.ndarray, np.ndarray]:
    """Linear and angular momentum, (3,) each [kg m/s], [kg m2/s]."""
    p = structure.mass[:, None] * structure.v.reshape(-1, 3)
    return p.sum(axis=0), np.cross(structure.x.reshape(-1, 3), p).sum(axis=0)
