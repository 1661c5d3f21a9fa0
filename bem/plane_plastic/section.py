"""A body with cells that may yield: what their plastic stress does to it, made only for cells that take part.

With the layers' answer to the cells' traces on the boundary, u + (layers' field) meets the conditions of the elastic
problem: displacements where the body is held, no additional traction elsewhere. The influence of the cells that take
part is one dense matrix; it grows by rows and columns when the plastic zone spreads.
"""

from __future__ import annotations

import numpy as np

from bem.plane.boundary import MEMORY_LIMIT, BoundaryProblem, TooLargeError, displacement_matrix
from bem.plane.kelvin import stress_sums
from bem.plane.point_load import PointLoad
from bem.plane_plastic.cells import CellError, Cells, boundary_edges, check_inside
from bem.plane_plastic.influence import (
    OF_STRAIN,
    TO_PLANE,
    boundary_traces,
    cell_strain,
    displacement_by_cells,
    edge_forces,
    strain_by_layers,
    strain_of_stress,
)
from bem.steel.hardening import YieldLaw
from bem.steel.return_map import PlasticState


def memory_need(cells: int, densities: int) -> float:
    """Peak memory [bytes] of the influence of cells in a body of so many densities: matrices 3 cells x 3 cells (one
    kept, two more while it grows or is solved), 3 cells x 2 densities twice, and the edges' fields on the boundary."""
    return 8.0 * (3 * (3 * cells) ** 2 + 2 * 3 * cells * 2 * densities + 8 * 2 * cells * 2 * densities)


def flat(field: np.ndarray) -> np.ndarray:
    """(3 k,) vector, component by component, of a field (k, 3, 1, 1) of bem.steel.return_map."""
    return field[:, :, 0, 0].T.ravel()


def unflat(vector: np.ndarray) -> np.ndarray:
    """Field (k, 3, 1, 1) of a vector (3 k,)."""
    return np.ascontiguousarray(vector.reshape(3, -1).T)[:, :, None, None]


class PlasticSection:
    """A factorised body, its cells and what they remember.

    state    : plastic strain, back stress (m, 3, 1, 1) as deviators without yz and xz, and peeq (m, 1, 1), of all cells
    active   : (a,) the cells that take part so far; `position` (m,) their place in it, or -1
    matrix   : (3 a, 3 a) 2 G mean total strain, as deviators, by their plastic stress 2 G e^p
    density, shift : (2 n + h, 3 a), (2, 3 a) the layers' answer to it, and that of h centres of dilatation in holes
    from_layers : (3 a, 2 n + h) 2 G strain by the boundary's densities and these centres
    Errors: CellError where cells do not fit the body, TooLargeError before matrices beyond memory_limit [bytes] are
    made.
    """

    def __init__(
        self, problem: BoundaryProblem, cells: Cells, hardening: YieldLaw, memory_limit: float = MEMORY_LIMIT
    ) -> None:
        check_inside(cells, problem.mesh)
        self.problem, self.cells, self.hardening, self.memory_limit = problem, cells, hardening, memory_limit
        self.elastic, n = problem.material, 2 * problem.mesh.densities + len(problem.centres)
        self.state = PlasticState.virgin((cells.count, 3, 1, 1), hardening.back_stresses)
        self.active, self.position = np.zeros(0, int), np.full(cells.count, -1)
        self.matrix = np.zeros((0, 0))
        self.density, self.shift, self.from_layers = np.zeros((n, 0)), np.zeros((2, 0)), np.zeros((0, n))
        self.rim = self._rim()

    def _rim(self) -> np.ndarray:
        """(m,) bool: cells with a side where the cells end, but not the body."""
        key = self.cells.edge_keys
        alone = np.bincount(key, minlength=len(key))[key] == 1
        open_edge = alone & (boundary_edges(self.cells, self.problem.mesh) < 0)
        rim = np.zeros(self.cells.count, bool)
        rim[self.cells.owner[open_edge]] = True
        return rim

    def grow(self, wanted: np.ndarray) -> bool:
        """Let the cells `wanted` (m,) bool take part; whether any is new."""
        new = np.flatnonzero(wanted & (self.position < 0))
        if not len(new):
            return False
        mesh, cells, elastic = self.problem.mesh, self.cells, self.elastic
        need = memory_need(len(self.active) + len(new), mesh.densities)
        if need > self.memory_limit:
            raise TooLargeError(
                f"{len(self.active) + len(new)} cells that may yield need {need / 1e9:.3g} GB and"
                f" {self.memory_limit / 1e9:.3g} GB are allowed: choose larger cells or a lower load, or raise"
                " memory_limit"
            )
        old = self.active
        resultants = _by_deviators(boundary_traces(cells, new, mesh, elastic))
        moved = np.zeros_like(resultants)
        if self.problem.held.any():
            moved = _by_deviators(displacement_by_cells(mesh.middles, cells, new, elastic))
        turn = self.problem._turn
        density, shift = self.problem.solve(-turn(resultants), -turn(moved))
        layers = strain_by_layers(cells.points(new), mesh, elastic)
        layers = np.concatenate([layers, self._strain_by_centres(cells.points(new))], axis=2)
        layers = np.einsum("ac,cin->ain", OF_STRAIN, layers)
        every = np.r_[old, new]
        columns = _deviators(cell_strain(cells, every, new, elastic))
        rows = _deviators(cell_strain(cells, new, old, elastic)) if len(old) else np.zeros((3, len(new), 3, 0))
        a, k = len(old), len(new)
        whole = np.empty((3, a + k, 3, a + k))
        whole[:, :a, :, :a] = self.matrix.reshape(3, a, 3, a)
        whole[:, a:, :, :a] = rows + (layers.reshape(3 * k, -1) @ self.density).reshape(3, k, 3, a)
        from_layers = np.concatenate([self.from_layers.reshape(3, a, layers.shape[2]), layers], axis=1).reshape(
            3 * (a + k), -1
        )
        whole[:, :, :, a:] = columns + (from_layers @ density).reshape(3, a + k, 3, k)
        self.matrix, self.from_layers = whole.reshape(3 * (a + k), -1), from_layers
        self.density, self.shift = _joined(self.density, density), _joined(self.shift, shift)
        self.active = every
        self.position[new] = a + np.arange(k)
        return True

    def _strain_by_centres(self, points: np.ndarray) -> np.ndarray:
        """2 G strain (3, k, h), mean over the cells whose four points are in `points` (4 k, 2), by unit centres."""
        out = np.empty((3, len(points) // 4, len(self.problem.centres)))
        for h, centre in enumerate(self.problem.centres):  # no pressure in their field: stress is 2 G strain
            out[:, :, h] = centre.stress(points, self.elastic).reshape(-1, 4, 3).mean(axis=1).T
        return out

    def part(self) -> PlasticState:
        """The state of the cells that take part."""
        return PlasticState(*(field[self.active] for field in (self.state.strain, self.state.back, self.state.peeq)))

    def plastic_stress(self) -> np.ndarray:
        """(3 a,) 2 G e^p [Pa] of the cells that take part."""
        return 2 * self.elastic.shear * flat(self.state.strain[self.active])

    def displacement_matrix(self, points: np.ndarray) -> np.ndarray:
        """Displacement (2 k, 3 a) [m/Pa] of points (k, 2) by plastic stress, all x then all y."""
        layers = displacement_matrix(points, self.problem.mesh, self.elastic)
        opened = [c.displacement(points, self.elastic).T.reshape(-1, 1) for c in self.problem.centres]
        layers = np.hstack([layers, *opened]) @ self.density
        cells = _by_deviators(displacement_by_cells(points, self.cells, self.active, self.elastic))
        return layers + np.repeat(self.shift, len(points), axis=0) + cells

    def refuse_at_rim(self, flowing: np.ndarray) -> None:
        """Refuse where cells (m,) that flow are the last ones before the body goes on without cells."""
        out = np.flatnonzero(flowing & self.rim)
        if len(out):
            x, y = self.cells.centers[out[0]]
            raise CellError(
                f"the plastic zone reaches the end of the cells near ({x:.6g}, {y:.6g}) m ({len(out)} cells): give"
                " cells over a larger region, or lower the load"
            )

    def strain_at(
        self, points: np.ndarray, density: np.ndarray, plastic: np.ndarray, loads: tuple[PointLoad, ...] = ()
    ) -> np.ndarray:
        """2 G total strain as deviators (3, k) [Pa] at points (k, 2) outside the cells' edges; arguments as in
        field_stress."""
        stress = self.field_stress(points, density, plastic, loads)
        return OF_STRAIN @ strain_of_stress(stress.T.copy(), self.elastic.poisson)

    def field_stress(
        self, points: np.ndarray, density: np.ndarray, plastic: np.ndarray, loads: tuple[PointLoad, ...] = ()
    ) -> np.ndarray:
        """Stress (k, 3) xx yy xy [Pa] of the total strain at points (k, 2) outside the cells' edges.

        density : (2 n + h,) of the load; plastic : (3 a,) plastic stress
        """
        mesh, kappa = self.problem.mesh, self.elastic.kolosov
        z = points[:, 0] + 1j * points[:, 1]
        answer = density + self.density @ plastic
        w = _complex(answer[: 2 * mesh.densities])
        stress = stress_sums(z, mesh.start, mesh.end, w[mesh.first], w[mesh.last], kappa)
        for strength, centre in zip(answer[2 * mesh.densities :], self.problem.centres):
            stress += centre.scaled(strength).stress(points, self.elastic)
        if len(self.active):
            edges, forces = edge_forces(self.cells, self.active)
            force = _complex(forces @ (TO_PLANE @ plastic.reshape(3, -1)).ravel())
            corner = self.cells.complex_vertices
            stress += stress_sums(z, corner[edges], corner[self.cells.following[edges]], force, force, kappa)
        for load in loads:
            stress += load.stress(points, self.elastic)
        return stress

    def stress(self, strain: np.ndarray, plastic: np.ndarray, mean: np.ndarray | None = None) -> np.ndarray:
        """Stress (k, 4) xx yy zz xy [Pa] of 2 G total strain (3, k) and plastic stress (3, k), both as deviators.

        mean : stress (k,) [Pa], where it is known better than by the strain (a volume that hardly changes)
        """
        deviator = strain - plastic
        poisson = self.elastic.poisson
        if mean is None:
            mean = -np.sqrt(6) * strain[1] * (1 + poisson) / (3 * (1 - 2 * poisson))  # bulk modulus over 2 G
        xx, yy, xy = TO_PLANE @ deviator
        return np.column_stack([xx + mean, yy + mean, mean - xx - yy, xy])


def _complex(vector: np.ndarray) -> np.ndarray:
    x, y = np.asarray(vector).reshape(2, -1)
    return x + 1j * y


def _joined(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """Columns of two matrices of three components each, component by component."""
    rows = len(one)
    return np.concatenate([one.reshape(rows, 3, -1), two.reshape(rows, 3, -1)], axis=2).reshape(rows, -1)


def _by_deviators(columns: np.ndarray) -> np.ndarray:
    """(r, 3 k) by deviators of matrices (r, 3 k) by xx, yy, xy."""
    rows = len(columns)
    return np.einsum("rck,cd->rdk", columns.reshape(rows, 3, -1), TO_PLANE).reshape(rows, -1)


def _deviators(strain: np.ndarray) -> np.ndarray:
    """(3, i, 3, j) between deviators of (3, i, 3, j) between in-plane components."""
    return np.einsum("ac,cidj,de->aiej", OF_STRAIN, strain, TO_PLANE, optimize=True)
