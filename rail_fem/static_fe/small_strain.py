"""Small strain by dolfinx forms: elastic or J2 with hardening; plane strain, bodies of revolution, solids.

What all judges of the boundary elements are made of. Stress and plastic strain stand at Gauss points; what the steel
does there is the return of `bem.steel`, which has exact tests of its own; meshes, elements and equilibrium share
nothing with the boundary elements. `mean_dilatation` takes the change of volume by its mean over each element (B-bar),
so that plastic flow does not lock linear ones. Newton's method with the consistent tangent.
Sources: Simo and Hughes, Computational Inelasticity (1998), boxes 3.1 and 3.2 and ch. 4 (from memory; held to exact
solutions by tests/versus/test_axisymmetric.py). Error: with linear displacements second order in displacement, first in
the stress at a point; with quadratic ones third and second (tests/versus/test_plane_strain.py).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import ufl
from mpi4py import MPI
from scipy import sparse
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from bem.material import Elastic
from bem.steel.deviator import TO_DEVIATOR
from bem.steel.hardening import Hardening
from bem.steel.return_map import PlasticState, Returned, advanced, radial_return
from geometry.meshing.hexmesh import HexMesh
from rail_fem.fe.compat import (
    cell_dofs,
    create_hexahedral_mesh,
    discontinuous,
    evaluate,
    fem,
    lagrange_vectors,
    petsc,
    vectors_at_points,
)
from rail_fem.fe.domain import VTK_TO_DOLFINX

ELASTIC = Hardening.linear(1e30)  # yields nowhere
RULE = 2  # degree of the Gauss points' rule: 3 points in a triangle, 2 along each side of other elements
_MOST_STEPS, _PATIENCE = 30, 8
_VOIGT = (0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)


class SmallStrainError(ValueError):
    """A body, mesh or load that has no answer: what, where, what to do."""


class Answer(NamedTuple):
    """Of a displacement: deviatoric stress (1, k, e, p) [Pa] of e elements with p points each, in the numbers of
    `bem.steel.deviator` that are not zero (three in a plane, five in a solid); its return with the consistent tangent;
    the plastic state after it."""

    stress: np.ndarray
    returned: Returned
    plastic: PlasticState


@dataclass(frozen=True)
class BalancedState:
    """displacement (d m,) [m] of m nodes, their components in turn; nodal force (d m,) [N], over the whole circle of a
    body of revolution; the answer of the steel; amplitudes (q,) of the held motions; mismatch of each step of Newton's
    method."""

    displacement: np.ndarray
    force: np.ndarray
    answer: Answer
    amplitudes: np.ndarray
    mismatch: list[float]


@dataclass(frozen=True)
class HeldMotions:
    """Degrees of freedom (c,) that move as target (c,) + motions (c, q) times amplitudes, which fulfil
    on_force (q, d m) force + on_amplitude (q, q) amplitudes = 0."""

    dofs: np.ndarray
    target: np.ndarray
    motions: np.ndarray
    on_force: np.ndarray
    on_amplitude: np.ndarray

    @classmethod
    def still(cls, dofs: np.ndarray, total: int) -> HeldMotions:
        """Degrees of freedom that do not move, of `total`."""
        none = np.zeros((len(dofs), 0))
        return cls(dofs, np.zeros(len(dofs)), none, np.zeros((0, total)), np.zeros((0, 0)))


class SmallStrain:
    """A dolfinx mesh on one rank with nodes (m, d) [m], the order of all that goes in and out.

    degree : of the displacements;  revolved : about r = 0, with nodes (r, z);  elastic_rule : degree of the rule
    for the elastic stiffness, higher where elements are curved
    Errors: SmallStrainError for nodes that are not the mesh's, elements that are folded or left of the axis.
    """

    def __init__(
        self, mesh, nodes: np.ndarray, elastic: Elastic, hardening: Hardening = ELASTIC, degree: int = 1,
        revolved: bool = False, mean_dilatation: bool = False, elastic_rule: int = RULE,
    ) -> None:  # fmt: skip
        self.mesh, self.nodes, self.elastic, self.hardening = mesh, nodes, elastic, hardening
        self._revolved, self._mean_dilatation, self._elastic_rule = revolved, mean_dilatation, elastic_rule
        self.space, d = lagrange_vectors(mesh, degree), mesh.geometry.dim
        away, self._dof_of = cKDTree(self.space.tabulate_dof_coordinates()[:, :d]).query(nodes)
        if len(np.unique(self._dof_of)) < len(nodes) or away.max() > 1e-9 * np.ptp(nodes, axis=0).max():
            raise SmallStrainError(f"nodes coincide or are not the mesh's (farthest {away.max():.3g} m): merge them")
        self._order = (d * self._dof_of[:, None] + np.arange(d)).ravel()
        self._u, self._v = ufl.TrialFunction(self.space), ufl.TestFunction(self.space)
        self._shear, self._bulk = (fem.Constant(mesh, float(value)) for value in (elastic.shear, elastic.bulk))
        self._to_deviator = TO_DEVIATOR[[0, 1, 4] if d == 2 else slice(None)]  # those that are not zero
        self._cells = np.arange(len(cell_dofs(self.space)), dtype=np.int32)
        self._numbers, self._gauss = vectors_at_points(mesh, RULE, len(self._to_deviator))
        self._x = ufl.SpatialCoordinate(mesh)
        found = self._at_points(ufl.as_vector([*(self._x[i] for i in range(d)), ufl.JacobianDeterminant(mesh)]))()
        self.points, wrong = found[..., :d], (found[..., d] <= 0) | (revolved & (found[..., 0] <= 0))
        if wrong.any():
            raise SmallStrainError(f"{wrong.any(axis=1).sum()} elements are folded or left of the axis")

    @property
    def count(self) -> int:
        """Degrees of freedom."""
        return len(self._order)

    def virgin(self) -> PlasticState:
        """No plastic strain."""
        return PlasticState.virgin((1, len(self._to_deviator), *self.points.shape[:2]))

    def strain(self, displacement: np.ndarray) -> np.ndarray:
        """(e, p, 6) at the points, order VOIGT with tensor shears, of a displacement (d m,) [m]."""
        field, at_points = self._strain_at
        field.x.array[self._order] = displacement
        return at_points()

    def stress(self, displacement: np.ndarray) -> np.ndarray:
        """(e, p, 6) [Pa] at the points, order VOIGT, of an elastic body."""
        strain, shear = self.strain(displacement), self.elastic.shear
        stress = 2 * shear * strain
        stress[..., :3] += ((self.elastic.bulk - 2 / 3 * shear) * strain[..., :3].sum(axis=-1))[..., None]
        return stress

    def respond(self, displacement: np.ndarray, before: PlasticState) -> Answer:
        """What the steel answers to a displacement (d m,) [m]. Pure."""
        twice = 2 * self.elastic.shear
        deviator = np.moveaxis(self.strain(displacement) @ self._to_deviator.T, -1, 0)[None]
        trial = twice * (deviator - before.strain)
        found = radial_return(trial, before, self.hardening, self.elastic.shear)
        return Answer(trial - twice * found.increment, found, advanced(before, found, self.hardening))

    def force(self, stress: np.ndarray) -> np.ndarray:
        """Nodal forces (d m,) [N], of plane strain [N/m], that hold deviators (1, k, e, p) [Pa]."""
        values, form = self._force
        _fill(values, np.moveaxis(stress[0], 0, -1))
        return np.asarray(fem.assemble_vector(form).array)[self._order]

    def stiffness(self, returned: Returned | None = None) -> sparse.csr_matrix:
        """(d m, d m) [N/m], of plane strain [Pa]: elastic, or with the consistent tangent of a return."""
        if returned is None:
            one, two = self._deviator(self._u), self._deviator(self._v)
            return self._matrix(2 * self._shear * ufl.inner(one, two)) + self.volumetric
        values, form = self._tangent
        across, along = returned.across[0], returned.along[0]
        _fill(values, np.concatenate([[1 - across, across - along], returned.direction[0]]).transpose(1, 2, 0))
        return assembled(form, self._dof_of) + self.volumetric

    def mass(self, density: float) -> sparse.csr_matrix:
        """Consistent (d m, d m) [kg], of plane strain [kg/m], of a density [kg/m^3]."""
        return assembled(density * ufl.inner(self._u, self._v) * ufl.dx, self._dof_of)

    @cached_property
    def volumes(self) -> np.ndarray:
        """Of the elements (e,) [m^3], over the whole circle; areas [m^2] of plane strain."""
        return self._means[1]

    @cached_property
    def volumetric(self) -> sparse.csr_matrix:
        """The part of the stiffness by changes of volume, which stay elastic."""
        if not self._mean_dilatation:
            return self._matrix(self._bulk * self._dilatation(self._u) * self._dilatation(self._v))
        grown, volume = self._means
        return (grown.T @ sparse.diags(self.elastic.bulk / volume) @ grown).tocsr()

    def at_rest(self, amplitudes: int = 0) -> BalancedState:
        """Nothing moved, nothing yielded."""
        none = np.zeros(self.count)
        return BalancedState(none, none, self.respond(none, self.virgin()), np.zeros(amplitudes), [])

    def equilibrium(
        self, held: HeldMotions, start: BalancedState, load: np.ndarray | float = 0.0, tolerance: float = 1e-8
    ) -> BalancedState:
        """Balance with forces `load` (d m,) [N] after another balance, whose tangent the first step takes: what flowed
        flows on, until it is found to unload.

        tolerance : largest force that is not balanced, over the largest there is. Raises SmallStrainError when none is
        found.
        """
        free = np.setdiff1d(np.arange(self.count), held.dofs)
        u, s, mismatch = start.displacement.copy(), np.zeros(held.motions.shape[1]), []
        for step in range(_MOST_STEPS):
            answer = self.respond(u, start.answer.plastic)
            inner = self.force(answer.stress) + self.volumetric @ u
            residual = inner - load
            off = held.target + held.motions @ s - u[held.dofs]
            scale = max(np.abs(inner).max(), np.abs(load).max(), 1e-300)
            lacking = held.on_force @ residual + held.on_amplitude @ s
            mismatch.append(float(max(np.abs(residual[free]).max(), np.abs(lacking).max(initial=0.0)) / scale))
            if step and mismatch[-1] <= tolerance and np.abs(off).max() <= 1e-12 * np.abs(u).max():
                return BalancedState(u, residual, answer, s, mismatch)
            if not np.isfinite(mismatch[-1]) or min(mismatch[-_PATIENCE:]) > 0.5 and step >= _PATIENCE:
                break
            stiff = self.stiffness(answer.returned if step else start.answer.returned).tocsc()
            columns = np.column_stack([off, held.motions])
            right = -(stiff[:, held.dofs] @ columns)
            right[:, 0] -= residual
            change = np.zeros((self.count, columns.shape[1]))
            change[free], change[held.dofs] = factor(stiff, free).solve(np.ascontiguousarray(right[free])), columns
            if len(s):
                by = held.on_force @ (stiff @ change)
                ds = np.linalg.solve(by[:, 1:] + held.on_amplitude, -(lacking + by[:, 0]))
                s, u = s + ds, u + change[:, 0] + change[:, 1:] @ ds
            else:
                u = u + change[:, 0]
        shown = " ".join(f"{value:.1e}" for value in mismatch[-5:])
        raise SmallStrainError(f"no equilibrium in {len(mismatch)} steps (mismatch ... {shown}): take smaller loads")

    def _strain(self, u):
        """Strain (3, 3) of a displacement as a form; of a body of revolution z is the hoop's."""
        plane = ufl.sym(ufl.grad(u))
        if self.mesh.geometry.dim == 3:
            return plane
        hoop = u[0] / self._x[0] if self._revolved else 0.0
        return ufl.as_tensor([[plane[0, 0], plane[0, 1], 0.0], [plane[1, 0], plane[1, 1], 0.0], [0.0, 0.0, hoop]])

    def _dilatation(self, u):
        return ufl.tr(self._strain(u))

    def _deviator(self, u):
        voigt = [self._strain(u)[i, j] for i, j in _VOIGT]
        return ufl.as_vector([sum(float(a) * e for a, e in zip(row, voigt) if a) for row in self._to_deviator])

    def _over(self, integrand, rule: int = RULE):
        """Integral by the Gauss points or a higher rule; of a body of revolution over the whole circle."""
        measure = ufl.dx(metadata={"quadrature_degree": rule})
        return (2 * np.pi * self._x[0] if self._revolved else 1.0) * integrand * measure

    def _matrix(self, integrand) -> sparse.csr_matrix:
        return assembled(self._over(integrand, self._elastic_rule), self._dof_of)

    def _at_points(self, expression):
        """Function of nothing that gives values (e, p, n) of an expression."""
        compiled, shape = fem.Expression(expression, self._gauss), (len(self._cells), len(self._gauss), -1)
        return lambda: evaluate(compiled, self.mesh, self._cells).reshape(shape)

    @cached_property
    def _strain_at(self):
        field = fem.Function(self.space)
        return field, self._at_points(ufl.as_vector([self._strain(field)[i, j] for i, j in _VOIGT]))

    @cached_property
    def _force(self):
        values = fem.Function(self._numbers)
        return values, fem.form(self._over(ufl.inner(values, self._deviator(self._v))))

    @cached_property
    def _tangent(self):
        """1 - m_t, m_t - m_n, and the direction N at each point (bem.steel.return_map), and the form of them."""
        count = 2 + len(self._to_deviator)
        values = fem.Function(vectors_at_points(self.mesh, RULE, count)[0])
        isotropic, along, *normal = (values[i] for i in range(count))
        one, two, normal = self._deviator(self._u), self._deviator(self._v), ufl.as_vector(normal)
        shape = isotropic * ufl.inner(one, two) + along * ufl.inner(normal, one) * ufl.inner(normal, two)
        return values, fem.form(self._over(2 * self._shear * shape))

    @cached_property
    def _means(self) -> tuple[sparse.csr_matrix, np.ndarray]:
        """Change of each element's volume (e, d m) by displacements, and the volumes (e,)."""
        space = discontinuous(self.mesh)
        constant, rows = ufl.TestFunction(space), cell_dofs(space).ravel()
        grown = matrix_of(self._over(self._dilatation(self._u) * constant))[rows][:, self._order]
        return grown, np.asarray(fem.assemble_vector(fem.form(self._over(constant))).array)[rows]


def _fill(function, values: np.ndarray) -> None:
    """Set numbers (e, p, n) at the points."""
    dofs = cell_dofs(function.function_space).ravel()
    function.x.array.reshape(-1, values.shape[-1])[dofs] = values.reshape(-1, values.shape[-1])


def factor(matrix: sparse.spmatrix, free: np.ndarray):
    """Factor of the rows and columns `free` (f,) of a symmetric matrix; its `solve` takes (f, k)."""
    part = matrix.tocsc()[free][:, free]
    return splu(part, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})


def matrix_of(form) -> sparse.csr_matrix:
    """A bilinear form as a matrix, in dolfinx' own order."""
    matrix = petsc.assemble_matrix(fem.form(form))
    matrix.assemble()
    start, column, value = matrix.getValuesCSR()
    found = sparse.csr_matrix((value, column, start), shape=matrix.getSize())
    matrix.destroy()  # PETSc 3.18 keeps it else
    return found


def assembled(form, dof_of: np.ndarray) -> sparse.csr_matrix:
    """A bilinear form as a matrix, all components of node 0, then of node 1, and so on; dof_of : of each node."""
    matrix = matrix_of(form)
    count = matrix.shape[0] // len(dof_of)
    order = (count * dof_of[:, None] + np.arange(count)).ravel()
    return matrix[order][:, order]


def hexahedra(mesh: HexMesh):
    """The mesh as dolfinx' own, on one rank."""
    cells = mesh.cells[:, VTK_TO_DOLFINX].astype(np.int64)
    points = np.ascontiguousarray(mesh.points)
    return create_hexahedral_mesh(MPI.COMM_SELF, cells, points, np.zeros(len(cells), np.int32))


def solid(mesh: HexMesh, elastic: Elastic, hardening: Hardening = ELASTIC, **options) -> SmallStrain:
    """Trilinear hexahedra in the order of the mesh's nodes; options as of SmallStrain."""
    return SmallStrain(hexahedra(mesh), mesh.points, elastic, hardening, **options)
