"""Linear elastic stiffness of hexahedra by dolfinx, as a sparse matrix in the order of the mesh's own nodes."""

from __future__ import annotations

import numpy as np
import ufl
from mpi4py import MPI
from scipy import sparse
from scipy.spatial import cKDTree

from bem.material import Elastic
from geometry.meshing.hexmesh import HexMesh, MeshError
from rail_fem.fe.compat import create_hexahedral_mesh, fem, lagrange_vectors, petsc
from rail_fem.fe.domain import VTK_TO_DOLFINX


def stiffness(mesh: HexMesh, material: Elastic) -> sparse.csr_matrix:
    """Stiffness (3n, 3n) [N/m] of trilinear hexahedra, 2 x 2 x 2 Gauss points; x, y, z of node 0, then of node 1, and
    so on.

    Error: second order in stress-free shapes' displacement; exact for constant strain
    (tests/versus/test_solid_contact.py).
    """
    cells = mesh.cells[:, VTK_TO_DOLFINX].astype(np.int64)
    solid = create_hexahedral_mesh(
        MPI.COMM_SELF, cells, np.ascontiguousarray(mesh.points), np.zeros(len(cells), np.int32)
    )
    space = lagrange_vectors(solid, 1)
    away, dof_of = cKDTree(space.tabulate_dof_coordinates()).query(mesh.points)
    if len(np.unique(dof_of)) < len(mesh.points):
        raise MeshError(f"nodes of the mesh coincide (nearest {away.max():.3g} m): merge them first")
    u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
    stress = elastic_stress(u, material, solid)
    return assembled(ufl.inner(stress, ufl.grad(v)) * ufl.dx(metadata={"quadrature_degree": 2}), dof_of)


def elastic_stress(u, material: Elastic, mesh):
    """Stress of a displacement as a form: of a solid, or of plane strain on a plane mesh."""
    shear = material.young / (2 * (1 + material.poisson))
    lame = 2 * shear * material.poisson / (1 - 2 * material.poisson)
    shear, lame = (fem.Constant(mesh, float(value)) for value in (shear, lame))
    strain = ufl.sym(ufl.grad(u))
    return 2 * shear * strain + lame * ufl.tr(strain) * ufl.Identity(mesh.geometry.dim)


def assembled(form, dof_of: np.ndarray) -> sparse.csr_matrix:
    """A bilinear form as a matrix, all components of node 0, then of node 1, and so on; dof_of : of each node."""
    matrix = petsc.assemble_matrix(fem.form(form))
    matrix.assemble()
    (start, column, value), total = matrix.getValuesCSR(), matrix.getSize()[0]
    count = total // len(dof_of)
    order = (count * dof_of[:, None] + np.arange(count)).ravel()
    return sparse.csr_matrix((value, column, start), shape=matrix.getSize())[order][:, order]
