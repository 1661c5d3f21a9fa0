"""Boundary value problems by the indirect method: fictitious forces whose field meets the conditions on the boundary.

    u = (integral of Kelvin's displacement times w) + shift,     integral of w = 0

The constraint and the shift make the answer independent of the unit of length: without them the logarithm has no level,
and at certain sizes (the degenerate scales) a fixed boundary has no unique w. An infinite body without displacement
conditions has neither; its displacement then grows as the logarithm of the distance if its loads do not balance, and is
known up to a constant.

Each density gives two equations: its traction as resultant over its cell, or its displacement at the middle of the
cell. Resultants over all cells sum up to zero identically, so equilibrium of forces holds to round-off.
A body that the conditions leave free to move is held by setting its mean displacement (and rotation) to zero; its loads
must balance. Error: second order in element size on smooth boundaries (tests/bem/test_boundary.py). A slender body adds
up what is left of couples along it: a cantilever 50 and 100 times as long as thick bends 3 and 10 % too far with
elements of a fifth of its thickness, 0.8 and 3 % with a tenth.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from bem.checks import point_text, refuse_unless_finite
from bem.material import Elastic, MaterialError
from bem.plane.dilatation import Dilatation, in_holes
from bem.plane.kelvin import ResultantIntegrals, components, displacement_integrals, resultant_integrals
from bem.plane.mesh import BoundaryMesh
from bem.plane.point_load import InnerLoad, PointLoad

MEMORY_LIMIT = 4e9  # bytes that one system may take at its peak
_HOLLOW_POISSON = 0.495  # beyond it a body with a hole loses more than two digits without centres of dilatation
_OPENED_POISSON = 0.35  # beyond it holes get them: at 0.3 they change nothing, at 0.49 errors are seven times smaller
_BALANCE = 1e-3  # largest unbalanced part of the loads on a free body; discretised balanced loads reach (h/R)^2


class EquilibriumError(ValueError):
    """Loads that no state of the body balances."""


class ConditionError(ValueError):
    """A boundary condition that is no number, or not one for each component."""


class TooLargeError(ValueError):
    """A dense system that does not fit the memory allowed."""


def memory_need(unknowns: int) -> float:
    """Peak memory [bytes] of one system: 3.25 matrices of unknowns^2 numbers, while it is set up
    (tests/bem/test_boundary.py)."""
    return 3.25 * 8.0 * unknowns**2


def check_memory(unknowns: int, limit: float) -> None:
    """Refuse a dense system whose peak of memory exceeds `limit` [bytes]."""
    need = memory_need(unknowns)
    if need > limit:
        raise TooLargeError(
            f"{unknowns} unknowns need {need / 1e9:.2f} GB of dense matrices at the peak and {limit / 1e9:.2f} GB are "
            "allowed: coarsen the mesh away from the contact, or raise memory_limit"
        )


def displacement_matrix(points: np.ndarray, mesh: BoundaryMesh, material: Elastic) -> np.ndarray:
    """Displacement (2m, 2n) [m/Pa] at points (m, 2), all x then all y, of the densities."""
    return displacement_map(*hat_displacements(points, mesh), material)


def hat_displacements(points: np.ndarray, mesh: BoundaryMesh) -> tuple[np.ndarray, np.ndarray]:
    """Integrals (m, n) of ln r and e^(2 i theta) [m] at points (m, 2) over the hats of a mesh."""
    z = points[:, 0] + 1j * points[:, 1]
    return displacement_integrals(z, mesh.start, mesh.end, mesh.first, mesh.last, mesh.densities)


def displacement_map(
    log_r: np.ndarray, twist: np.ndarray, material: Elastic, area: np.ndarray | float = 1.0
) -> np.ndarray:
    """Displacement (2m, 2n), all x then all y, by forces of the integrals of ln r and e^(2 i theta) (m, n), which are
    changed; area : (n,) over which each force is spread [m^2], where it is one force."""
    c = 1 / (2 * np.pi * (1 + material.kolosov)) / (2 * material.shear) / area
    log_r *= -2 * c * material.kolosov
    twist *= c
    m, n = log_r.shape
    matrix = np.empty((2 * m, 2 * n))
    matrix[:m, :n] = log_r + twist.real  # u = log_r w + twist conj(w)
    matrix[m:, n:] = log_r - twist.real
    matrix[:m, n:] = matrix[m:, :n] = twist.imag
    return matrix


def stress_map(a: np.ndarray, b: np.ndarray, kappa: float, area: np.ndarray | float = 1.0) -> np.ndarray:
    """Stress (3, m, 2, n) xx yy xy by forces x, y of the integrals a of 1 / zeta and b of conj(zeta) / zeta^2 (m, n);
    area as of `displacement_map`."""
    c = 1 / (2 * np.pi * (1 + kappa)) / area
    fields = [
        components(-4 * c * (force * a).real, 2 * c * (kappa * np.conj(force) * a + force * b)) for force in (1.0, 1j)
    ]
    return np.stack(fields, axis=2)


def resultant_matrix(mesh: BoundaryMesh, material: Elastic, out: np.ndarray | None = None) -> np.ndarray:
    """Resultant of the traction over each cell (2n, 2n) [m], all x then all y, of the densities; written into `out`
    where given."""
    return resultant_map(cell_integrals(mesh), material, out)


def cell_integrals(mesh: BoundaryMesh) -> ResultantIntegrals:
    """Of the hats of a mesh over its own cells."""
    points, begin, end, cell = mesh.paths()
    n = mesh.densities
    return resultant_integrals(points, begin, end, cell, n, mesh.start, mesh.end, mesh.first, mesh.last, n)


def resultant_map(integrals: ResultantIntegrals, material: Elastic, out: np.ndarray | None = None) -> np.ndarray:
    """Real matrix (2m, 2n) [m] from densities to resultants, of the integrals over m paths."""
    log_r, angle, twist = integrals
    kappa, (m, n) = material.kolosov, log_r.shape
    c = 1 / (2 * np.pi * (1 + kappa))
    matrix = np.empty((2 * m, 2 * n)) if out is None else out
    # force = -c [(kappa + 1) angle + i (kappa - 1) log_r] w + i c twist conj(w), built in place: matrices are large
    np.multiply(angle, -c * (kappa + 1), out=matrix[:m, :n])
    np.multiply(log_r, c * (kappa - 1), out=matrix[:m, n:])
    matrix[m:, n:], matrix[m:, :n] = matrix[:m, :n], -matrix[:m, n:]
    turned = c * twist.imag
    matrix[:m, :n] -= turned
    matrix[m:, n:] += turned
    np.multiply(twist.real, c, out=turned)
    matrix[:m, n:] += turned
    matrix[m:, :n] += turned
    return matrix


def rigid_modes(points: np.ndarray, center: np.ndarray) -> np.ndarray:
    """Displacement (2m, 3), all x then all y, of two unit translations and a unit rotation [1/m] about center."""
    one, zero = np.ones(len(points)), np.zeros(len(points))
    x, y = (points - center).T
    return np.column_stack([np.r_[one, zero], np.r_[zero, one], np.r_[-y, x]])


@dataclass
class BoundaryProblem:
    """One body with displacements prescribed at some components of some densities, tractions elsewhere; factorised
    once.

    held  : (n, 2) bool, component whose displacement is prescribed
    local : (n,) bool, components are (normal, tangential) there, tangential along the boundary; else (x, y)
    free  : (3, f) rigid motions that the conditions leave free
    dilating : give each hole a centre of dilatation where Poisson's ratio is large; strengths of the `centres` (h,) are
        unknowns after the densities
    """

    mesh: BoundaryMesh
    material: Elastic
    held: np.ndarray
    local: np.ndarray
    memory_limit: float = MEMORY_LIMIT
    dilating: bool = False
    free: np.ndarray = field(init=False)
    centres: tuple[Dilatation, ...] = field(init=False, default=())

    def __post_init__(self) -> None:
        n = self.mesh.densities
        check_memory(2 * n + 5, self.memory_limit)
        hollow = self.mesh.infinite or len(self.mesh.loops) > 1
        if hollow and self.material.poisson > _HOLLOW_POISSON and not self.dilating:
            raise MaterialError(
                f"Poisson's ratio {self.material.poisson} of a body with a hole: the fictitious material in the hole "
                f"cannot change its area, and errors grow as 1/(1 - 2 nu); stay below {_HOLLOW_POISSON}"
            )
        self.center = self.mesh.vertices.mean(axis=0)
        self.size = np.ptp(self.mesh.vertices, axis=0).max()
        self._mask = np.r_[self.held[:, 0], self.held[:, 1]]
        self._anchored = not self.mesh.infinite or bool(self.held.any())  # has a shift and a constraint on w
        modes = self._turn(rigid_modes(self.mesh.middles, self.center) / [1, 1, self.size])
        self.free = np.zeros((3, 0))
        if not self.mesh.infinite:
            _, values, rows = np.linalg.svd(np.vstack([modes[self._mask], np.zeros((3, 3))]))
            self.free = rows[values[:3] < 1e-9 * np.sqrt(n)].T
        self._factorise(modes @ self.free)
        if hollow and self.dilating and self.material.poisson > _OPENED_POISSON:
            self._open_holes()

    def _open_holes(self) -> None:
        """Centres of dilatation, and the densities and shift that answer each."""
        mesh, material = self.mesh, self.material
        centres, self._means = in_holes(mesh)
        resultants = np.column_stack([each.resultants(mesh, material) for each in centres])
        moved = np.column_stack([each.displacement(mesh.middles, material).T.ravel() for each in centres])
        self._answers = self._solve(self._turn(resultants), self._turn(moved))
        self.centres = centres

    def _turn(self, rows: np.ndarray, back: bool = False, out: np.ndarray | None = None) -> np.ndarray:
        """Rows (2n, m), x then y, in the components of the conditions (or back); a copy, unless `out` is given."""
        if not self.local.any():
            return rows
        out, k, n = rows.copy() if out is None else out, np.flatnonzero(self.local), self.mesh.densities
        a, b = self.mesh.normals[k].T[..., None] * [[[1]], [[-1 if back else 1]]]
        out[k], out[n + k] = a * rows[k] + b * rows[n + k], -b * rows[k] + a * rows[n + k]
        return out

    def _factorise(self, free_modes: np.ndarray) -> None:
        n, f = self.mesh.densities, free_modes.shape[1]
        shift = 2 if self._anchored else 0
        length = np.r_[self.mesh.cell_length, self.mesh.cell_length]
        self._stiffness = 2 * self.material.shear / self.size
        self.displacement_at_middles = displacement_matrix(self.mesh.middles, self.mesh, self.material)
        matrix = np.zeros((2 * n + shift + f, 2 * n + shift + f))
        rows = matrix[: 2 * n, : 2 * n]
        resultant_matrix(self.mesh, self.material, rows)
        self._turn(rows, out=rows)
        rows /= length[:, None]
        rows[self._mask] = self._turn(self.displacement_at_middles)[self._mask] * self._stiffness
        if self._anchored:
            modes = self._turn(rigid_modes(self.mesh.middles, self.center)[:, :2])
            matrix[: 2 * n, 2 * n : 2 * n + 2][self._mask] = modes[self._mask]  # the unknown is shift * stiffness
            mass = self.mesh.cell_length / self.size
            matrix[2 * n, :n] = matrix[2 * n + 1, n : 2 * n] = mass
        if f:
            matrix[: 2 * n, 2 * n + shift :][~self._mask] = free_modes[~self._mask]
            mean = (self._turn(free_modes, back=True) * length[:, None]).T / length.sum()
            matrix[2 * n + shift :, : 2 * n] = mean @ self.displacement_at_middles * self._stiffness
            if self._anchored:
                matrix[2 * n + shift :, 2 * n : 2 * n + 2] = mean @ rigid_modes(self.mesh.middles, self.center)[:, :2]
        # of the transpose, so that LAPACK needs no copy
        self._lu = lu_factor(matrix.T, overwrite_a=True, check_finite=False)

    def solve(self, resultants: np.ndarray, displacements: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Densities and shift for many right sides.

        resultants    : (2n, m) force per cell, in the components of the conditions, all first then all second [N/m]
        displacements : (2n, m) prescribed displacement at the middle of the cell [m], read where held
        Returns w (2n, m) [Pa], x then y, and shift (2, m) [m]. With centres w is (2n + h, m), strengths last: the
        densities on each hole then have no mean along its normal.
        """
        density, shift = self._solve(resultants, displacements)
        if not self.centres:
            return density, shift
        own, moved = self._answers
        strength = np.linalg.solve(self._means @ own, self._means @ density)
        return np.vstack([density - own @ strength, strength]), shift - moved @ strength

    def _solve(self, resultants: np.ndarray, displacements: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Densities (2n, m) and shift (2, m) alone."""
        n = self.mesh.densities
        length = np.r_[self.mesh.cell_length, self.mesh.cell_length][:, None]
        right = np.zeros((self._lu[0].shape[0], resultants.shape[1]))
        right[: 2 * n] = np.where(self._mask[:, None], displacements * self._stiffness, resultants / length)
        answer = lu_solve(self._lu, right, trans=1, overwrite_b=True, check_finite=False)
        shift = answer[2 * n : 2 * n + 2] / self._stiffness if self._anchored else np.zeros((2, right.shape[1]))
        return answer[: 2 * n], shift

    def refuse_unbalanced(self, resultants: np.ndarray) -> None:
        """Raise EquilibriumError if loads (2n,) on the free motions do not balance."""
        if not self.free.shape[1]:
            return
        modes = self._turn(rigid_modes(self.mesh.middles, self.center) / [1, 1, self.size]) @ self.free
        loads = np.where(self._mask, 0.0, resultants)
        left, whole = modes.T @ loads, np.abs(loads).sum()
        if np.abs(left).max() > _BALANCE * whole:
            force_x, force_y, moment = self.free @ left
            raise EquilibriumError(
                f"nothing holds the body against its loads: force ({force_x:.4g}, {force_y:.4g}) N/m, moment "
                f"{moment * self.size:.4g} N about {point_text(self.center)} m; hold an edge or balance "
                "the loads"
            )


@dataclass(frozen=True)
class Condition:
    """What is known on an edge, component by component: displacement [m] or traction [Pa] (the other is None).

    displacement, traction : (first, second), each a number, None, or (for traction) a function(points, normals) -> (m,)
    local : components are (normal, tangential), tangential with the material on the left; else (x, y)
    """

    displacement: tuple = (None, None)
    traction: tuple = (None, None)
    local: bool = False

    def __post_init__(self) -> None:
        for name, pair in (("displacement", self.displacement), ("traction", self.traction)):
            if not isinstance(pair, (tuple, list, np.ndarray)) or len(pair) != 2:
                raise ConditionError(f"{name} {pair!r}: give two components, each a number or None")
            for component, value in zip(("first", "second"), pair):
                if value is not None and not (name == "traction" and callable(value)):
                    refuse_unless_finite(ConditionError, **{f"{component} component of the {name}": value})
        for component, known, load in zip(("first", "second"), self.displacement, self.traction):
            if known is not None and load is not None:
                raise EquilibriumError(
                    f"the {component} component has both a displacement ({known!r}) and a traction ({load!r}):"
                    " choose one"
                )


FIXED = Condition(displacement=(0.0, 0.0))
_GAUSS, _GAUSS_WEIGHT = np.polynomial.legendre.leggauss(3)


def cell_resultants(mesh: BoundaryMesh, element: np.ndarray, load: Callable) -> np.ndarray:
    """Force (n,) [N/m] on each cell of a traction component load(points (m, 2), normals (m, 2)) -> (m,) [Pa] on
    elements."""
    force = np.zeros(mesh.densities)
    start, step = mesh.start[element], (mesh.end - mesh.start)[element]
    length = np.abs(step)
    normal = np.column_stack([step.imag, -step.real]) / length[:, None]
    for cell, offset in ((mesh.first, 0.0), (mesh.last, 0.5)):
        for position, weight in zip(_GAUSS, _GAUSS_WEIGHT):
            z = start + step * (offset + (1 + position) / 4)
            value = np.asarray(load(np.column_stack([z.real, z.imag]), normal), float)
            if value.shape not in ((), z.shape) or not np.isfinite(value).all():
                raise ConditionError(
                    f"the traction's function gives shape {value.shape}, {np.count_nonzero(~np.isfinite(value))} not"
                    f" finite, at {len(z)} points: it must give one finite number [Pa] for each"
                )
            np.add.at(force, cell[element], value * weight / 4 * length)
    return force


@dataclass(frozen=True)
class BoundarySolution:
    """Field of a solved problem: densities w (n, 2) [Pa], shift (2,) [m] and rotation [rad] about the origin, loads
    inside."""

    mesh: BoundaryMesh
    material: Elastic
    density: np.ndarray
    shift: np.ndarray
    loads: tuple[InnerLoad, ...] = ()
    rotation: float = 0.0


def conditions_of(
    mesh: BoundaryMesh, conditions: dict[str, Condition]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Held (n, 2), local (n,), force per cell (2n,) [N/m] and prescribed displacement (2n,) [m] of conditions by edge
    name; force and displacement in the components of the conditions, all first then all second."""
    n = mesh.densities
    held, local = np.zeros((n, 2), bool), np.zeros(n, bool)
    displacement, force = np.zeros((2, n)), np.zeros((2, n))
    for name, condition in conditions.items():
        if not isinstance(condition, Condition):
            raise ConditionError(f"the condition on {name!r} is {condition!r}: give a Condition")
        chosen, element = mesh.of_edge(name), np.flatnonzero(mesh.names == name)
        local[chosen] = condition.local
        for component in range(2):
            known, load = condition.displacement[component], condition.traction[component]
            if known is not None:
                held[chosen, component] = True
                displacement[component, chosen] = known
            elif load is not None:
                function = load if callable(load) else (lambda points, normals, value=load: value)
                force[component] += cell_resultants(mesh, element, function)
    return held, local, force.ravel(), displacement.ravel()


def solve_boundary(
    mesh: BoundaryMesh,
    material: Elastic,
    conditions: dict[str, Condition],
    loads: tuple[PointLoad, ...] = (),
    memory_limit: float = MEMORY_LIMIT,
) -> BoundarySolution:
    """Solve one body: any mix of displacement and traction on its edges, and point loads inside it.

    conditions : edge name -> Condition; edges and components left out are free of traction
    """
    held, local, force, displacement = conditions_of(mesh, conditions)
    problem = BoundaryProblem(mesh, material, held, local, memory_limit, dilating=True)
    resultants, known = force[:, None], displacement[:, None]
    for load in loads:
        load.refuse_outside(mesh)
        resultants = resultants - problem._turn(load.resultants(mesh, material)[:, None])
        known = known - problem._turn(load.displacement(mesh.middles, material).T.reshape(-1, 1))
    problem.refuse_unbalanced(resultants[:, 0])
    density, shift = problem.solve(resultants, known)
    return solution_of(problem, density[:, 0], shift[:, 0], tuple(loads))


def solution_of(
    problem: BoundaryProblem, density: np.ndarray, shift: np.ndarray, loads: tuple[InnerLoad, ...] = ()
) -> BoundarySolution:
    """The field of densities (2n,) and, after them, strengths of centres (h,), as `solve` gives them."""
    n = 2 * problem.mesh.densities
    opened = tuple(centre.scaled(s) for centre, s in zip(problem.centres, density[n:]))
    return BoundarySolution(problem.mesh, problem.material, density[:n].reshape(2, -1).T, shift, (*loads, *opened))
