"""An elastic body by what it is at its boundary: stiffness and mass of a few displacement functions of an interface,
and the modes of the body behind it while that stands still.

Craig and Bampton's component modes on a reduced interface: u = X p + Y e, X the static displacements while the
interface moves as each function says, Y the modes with the interface held. Forms by dolfinx (quadratic displacements on
trilinear hexahedra), factors by PETSc with MUMPS, modes by SLEPc; one rank.
Source: R. R. Craig, M. C. C. Bampton, AIAA J. 6 (1968) 1313; reduced interfaces: M. P. Castanier, Y.-C. Tan, C. Pierre,
AIAA J. 39 (2001) 1182 (both from memory, not verified).
Error: from above in stiffness and frequency, by what the functions and the modes left out lack.
"""

import numpy as np
import ufl
from mpi4py import MPI
from scipy import sparse
from scipy.spatial import cKDTree

from bem.material import Elastic
from geometry.meshing.hexmesh import HexMesh
from rail_fem.fe.compat import PETSc, SLEPc, fem, lagrange_vectors
from rail_fem.static_fe.small_strain import assembled, hexahedra

FIRST_MODES = 32  # looked for at first, twice as many as long as all of them lie below the limit


class Solid:
    """Stiffness and mass (3 n, 3 n) [N/m, kg] of hexahedra with displacements of a degree, 1 or 2; x, y, z of each node
    in turn. nodes (n, 3) [m]"""

    def __init__(self, mesh: HexMesh, steel: Elastic, density: float, degree: int = 2) -> None:
        solid = hexahedra(mesh)
        space = lagrange_vectors(solid, degree)
        self.points, self.degree = mesh.points, degree
        self.nodes = space.tabulate_dof_coordinates()
        u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
        dx, own = ufl.dx(metadata={"quadrature_degree": 2 * degree}), np.arange(len(self.nodes))
        self.stiffness = assembled(ufl.inner(elastic_stress(u, steel, solid), ufl.grad(v)) * dx, own)
        self.mass = density * assembled(ufl.inner(u, v) * dx, own)

    def nodes_on(self, faces: np.ndarray) -> np.ndarray:
        """Nodes on faces (k, 4) of the mesh, corners, middles of edges and of the faces."""
        corner = self.points[faces]
        if self.degree == 1:
            return np.unique(cKDTree(self.nodes).query(corner.reshape(-1, 3))[1])
        at = [corner, (corner + np.roll(corner, 1, axis=1)) / 2, corner.mean(axis=1, keepdims=True)]
        return np.unique(cKDTree(self.nodes).query(np.concatenate(at, axis=1).reshape(-1, 3))[1])


def elastic_stress(u, material: Elastic, mesh):
    """Stress of a displacement as a form."""
    shear = material.young / (2 * (1 + material.poisson))
    lame = 2 * shear * material.poisson / (1 - 2 * material.poisson)
    shear, lame = (fem.Constant(mesh, float(value)) for value in (shear, lame))
    strain = ufl.sym(ufl.grad(u))
    return 2 * shear * strain + lame * ufl.tr(strain) * ufl.Identity(mesh.geometry.dim)


class Factor:
    """Cholesky factor of a symmetric positive definite sparse matrix."""

    def __init__(self, matrix: sparse.csr_matrix) -> None:
        self.matrix, self.solver = petsc_matrix(matrix), PETSc.KSP().create(MPI.COMM_SELF)
        self.solver.setOperators(self.matrix)
        by_cholesky(self.solver)
        self.solver.setUp()

    def __call__(self, right: np.ndarray) -> np.ndarray:
        """Solutions (n, k) for right-hand sides (n, k)."""
        b, x = (PETSc.Mat().createDense(right.shape, comm=MPI.COMM_SELF) for _ in range(2))
        for one in (b, x):
            one.setUp()
        b.getDenseArray()[:] = right
        b.assemble(), x.assemble()
        self.solver.getPC().getFactorMatrix().matSolve(b, x)
        answer = x.getDenseArray().copy()
        b.destroy(), x.destroy()
        return answer

    def give_back(self) -> None:
        """Its memory, some hundred MB; it solves no more."""
        self.solver.destroy(), self.matrix.destroy()


def petsc_matrix(matrix: sparse.csr_matrix):
    """The same as a matrix of PETSc on this rank, which keeps it until `destroy` (3.18 does so)."""
    matrix = matrix.tocsr().sorted_indices()
    return PETSc.Mat().createAIJ(
        matrix.shape,
        csr=(matrix.indptr.astype(PETSc.IntType), matrix.indices.astype(PETSc.IntType), matrix.data),
        comm=MPI.COMM_SELF,
    )


def by_cholesky(solver) -> None:
    """Have a KSP solve by MUMPS' factor alone."""
    solver.setType("preonly")
    solver.getPC().setType("cholesky")
    solver.getPC().setFactorSolverType("mumps")


def modes_below(stiffness: sparse.csr_matrix, mass: sparse.csr_matrix, highest: float) -> tuple[np.ndarray, np.ndarray]:
    """Angular frequencies (k,) [rad/s] below `highest` of a body that is held, and its modes (n, k) of mass 1."""
    a, b = petsc_matrix(stiffness), petsc_matrix(mass)
    wanted = FIRST_MODES
    while True:
        wanted = min(wanted, stiffness.shape[0])
        solver = SLEPc.EPS().create(MPI.COMM_SELF)
        solver.setOperators(a, b)
        solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
        solver.setDimensions(wanted)
        solver.setTarget(0.0)
        solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
        transform = solver.getST()
        transform.setType("sinvert")
        by_cholesky(transform.getKSP())
        solver.solve()
        count = solver.getConverged()
        square = np.array([solver.getEigenvalue(k).real for k in range(count)])
        if count < wanted:
            raise ArithmeticError(f"SLEPc found {count} of {wanted} modes of {stiffness.shape[0]} unknowns")
        if square.max() > highest**2 or wanted == stiffness.shape[0]:
            break
        solver.destroy()
        wanted *= 2
    vector = a.createVecRight()
    found = []
    for k in np.flatnonzero(square < highest**2):
        solver.getEigenvector(int(k), vector)
        shape = vector.getArray().copy()
        found.append(shape / np.sqrt(shape @ (mass @ shape)))
    for one in (solver, a, b, vector):
        one.destroy()
    square = square[square < highest**2]
    return np.sqrt(square), np.array(found).reshape(len(square), stiffness.shape[0]).T


def condense(
    solid: Solid, held: np.ndarray, interface: np.ndarray, values: np.ndarray, highest: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Stiffness and mass (m, m) of m = f + e coordinates, f of interface functions, e of modes below `highest`
    [rad/s]; their momentum (3, m) per velocity of each [kg]; mass of the body [kg].

    held (h,), interface (g,) : nodes;  values (g, 3, f) : of the functions there
    """
    unknowns = lambda nodes: (3 * nodes[:, None] + np.arange(3)).ravel()
    count = values.shape[2]
    given, still = unknowns(interface), unknowns(held)
    free = np.setdiff1d(np.arange(solid.stiffness.shape[0]), np.r_[given, still])
    behind = solid.stiffness[free]
    factor = Factor(behind[:, free])
    shapes = np.zeros((solid.stiffness.shape[0], count))
    shapes[given] = values.reshape(-1, count)
    shapes[free] = factor(-(behind[:, given] @ values.reshape(-1, count)))
    factor.give_back()
    frequency, modes = modes_below(behind[:, free], solid.mass[free][:, free], highest)
    all_modes = np.zeros((len(shapes), len(frequency)))
    all_modes[free] = modes
    shapes = np.hstack([shapes, all_modes])
    shift = np.tile(np.eye(3), (len(solid.nodes), 1))
    stiffness, mass = (shapes.T @ (matrix @ shapes) for matrix in (solid.stiffness, solid.mass))
    momentum, weight = shift.T @ (solid.mass @ shapes), float(shift[:, 0] @ (solid.mass @ shift[:, 0]))
    return (stiffness + stiffness.T) / 2, (mass + mass.T) / 2, momentum, weight
