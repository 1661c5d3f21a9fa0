"""The element's weak form as UFL says it, assembled by dolfinx on the mesh of a structure: nothing of the kernels.

The one-point element takes the velocity gradient as its mean over the cell, a field G of its own that is constant in
each cell (Flanagan & Belytschko, Int. J. Numer. Meth. Eng. 17 (1981) 679, as a three-field form):
    int (grad v - G) : H dx = 0 for all H constant in each cell,      int stress(G) : grad w dx = work of the forces.
Integrands are polynomials of degree 2 along each edge of the reference cell once multiplied by its Jacobian, so three
Gauss points along each are exact on whatever cell.
"""

import inspect

import mpi4py.MPI  # noqa: F401
import numpy as np
import ufl
from dolfinx import fem

from rail_fem.fe.compat import cell_dofs, discontinuous, geometry_dofmap, lagrange_vectors
from tests.fe.bodies import lame

EXACT = 4  # quadrature degree: three points along each edge
CORNERS = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]])


def compiled(form):
    """A form compiled without optimisation: it is assembled a few times only."""
    options = next(name for name in inspect.signature(fem.form).parameters if name.startswith("jit"))
    return fem.form(form, **{options: {"cffi_extra_compile_args": ["-O0"]}})


def array(vector) -> np.ndarray:
    return np.asarray(vector.array if hasattr(vector, "array") else vector)


def dx(degree: int):
    return ufl.dx(metadata={"quadrature_degree": degree})


class WeakForm:
    """Mean gradients and forces of a serial structure's cells and nodes, both in its own numbering."""

    def __init__(self, structure):
        self.mesh = structure.domain.mesh
        self.vectors, self.tensors = lagrange_vectors(self.mesh, 1), discontinuous(self.mesh, 0, (3, 3))
        self.u, self.stress = fem.Function(self.vectors), fem.Function(self.tensors)
        self.row = np.empty(structure.domain.n_nodes, int)  # where dolfinx keeps each node
        self.row[geometry_dofmap(self.mesh).ravel()] = cell_dofs(self.vectors).ravel()
        self.cell_row = cell_dofs(self.tensors)[:, 0]
        h, w = ufl.TestFunction(self.tensors), ufl.TestFunction(self.vectors)
        self._gradient = compiled(ufl.inner(ufl.grad(self.u), h) * dx(EXACT))
        self._force = compiled(ufl.inner(self.stress, ufl.grad(w)) * dx(EXACT))

    def move_to(self, x: np.ndarray) -> None:
        """Integrals are over the body with its nodes at x (n, 3) from now on."""
        self.mesh.geometry.x[:] = x

    def _cells(self, values: np.ndarray) -> np.ndarray:
        self.u.x.array.reshape(-1, 3)[self.row] = values
        return array(fem.assemble_vector(self._gradient)).reshape(-1, 3, 3)[self.cell_row]

    def volumes(self) -> np.ndarray:
        """(m,): the integral of the gradient of the position, a third of its trace."""
        return np.trace(self._cells(self.mesh.geometry.x), axis1=1, axis2=2) / 3

    def mean_gradient(self, values: np.ndarray) -> np.ndarray:
        """G (m, 3, 3) of nodal values (n, 3): G[:, i, j] = mean of d v_i / d x_j."""
        return self._cells(values) / self.volumes()[:, None, None]

    def forces(self, stress: np.ndarray) -> np.ndarray:
        """Internal forces (n, 3) of stresses constant in each cell (m, 3, 3)."""
        self.stress.x.array.reshape(-1, 3, 3)[self.cell_row] = stress
        return array(fem.assemble_vector(self._force)).reshape(-1, 3)[self.row]

    def elastic_force_form(self, steel, degree: int):
        """Internal forces of small displacements by quadrature of a degree (1: the point at the cell's centre)."""
        lam, mu = lame(steel)
        w, strain = ufl.TestFunction(self.vectors), ufl.sym(ufl.grad(self.u))
        stress = lam * ufl.tr(strain) * ufl.Identity(3) + 2 * mu * strain
        return compiled(ufl.inner(stress, ufl.grad(w)) * dx(degree))

    def assembled(self, form, values: np.ndarray) -> np.ndarray:
        """Forces (n, 3) of a compiled form at the nodal displacements (n, 3)."""
        self.u.x.array.reshape(-1, 3)[self.row] = values
        return array(fem.assemble_vector(form)).reshape(-1, 3)[self.row]

    def elastic_forces(self, values: np.ndarray, steel, degree: int) -> np.ndarray:
        """Internal forces (n, 3) of small displacements (n, 3), see elastic_force_form."""
        return self.assembled(self.elastic_force_form(steel, degree), values)


class Hourglass:
    """The hourglass part of Flanagan & Belytschko's element, from the corners of each cell (their equations 30 to 38):
    gamma = h - B (x . h) / V, orthogonal to every affine field; B_I = integral of grad N_I, by 2x2x2 Gauss points."""

    def __init__(self, x: np.ndarray, cells: np.ndarray):
        xi, eta, zeta = CORNERS.T
        h = np.stack([eta * zeta, zeta * xi, xi * eta, xi * eta * zeta], axis=1)  # (8, 4)
        corner = x[cells]
        gradient, volume = np.zeros(corner.shape), np.zeros(len(cells))
        for point in CORNERS / np.sqrt(3):
            factors = 1 + CORNERS * point
            local = np.stack([CORNERS[:, k] * np.delete(factors, k, axis=1).prod(axis=1) / 8 for k in range(3)], axis=1)
            jacobian = np.einsum("cni,nk->cik", corner, local)
            weight = np.linalg.det(jacobian)
            gradient += weight[:, None, None] * np.einsum("nk,cki->cni", local, np.linalg.inv(jacobian))
            volume += weight
        self.gamma = (
            h - np.einsum("cni,cik->cnk", gradient, np.einsum("cni,nk->cik", corner, h)) / volume[:, None, None]
        )
        self.stiffness = (gradient**2).sum(axis=(1, 2)) / volume  # times the hourglass modulus [m]
        self.cells, self.shape = cells, x.shape

    def amplitudes(self, values: np.ndarray) -> np.ndarray:
        """q (m, 3, 4) of nodal values (n, 3): an eighth of gamma's product with them."""
        return np.einsum("cnk,cni->cik", self.gamma, values[self.cells]) / 8

    def forces(self, q: np.ndarray) -> np.ndarray:
        """Nodal forces (n, 3) of generalised forces Q (m, 3, 4)."""
        out = np.zeros(self.shape)
        np.add.at(out, self.cells, np.einsum("cnk,cik->cni", self.gamma, q))
        return out
