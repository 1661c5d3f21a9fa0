"""A thick ring under internal pressure by boundary elements with yielding cells, held to an exact solution."""

from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from bem.material import Elastic
from bem.plane.boundary import MEMORY_LIMIT, BoundaryProblem, Condition, conditions_of, solution_of
from bem.plane.curve import arc
from bem.plane.internal import displacement_at
from bem.plane.mesh import BoundaryMesh, mesh_outline
from bem.plane.outline import Edge, Outline
from bem.plane_plastic.cells import Cells, check_inside, from_corner_grid
from bem.plane_plastic.increment import Increment
from bem.plane_plastic.loading import Step, accepted, reach, section_stress
from bem.plane_plastic.section import PlasticSection
from bem.steel.hardening import Hardening, YieldLaw
from tests.bem.plane_plastic.exact_ring import PlasticRing
from tests.bem.plane_plastic.radial_ring import radial_ring

YIELD, SHEAR = 300e6, 80e9
POISSON = 0.3
NAMES = "wall", "hoop stress", "radial stress", "plastic strain", "residual hoop stress"


class PlasticBoundaryBody:
    """A plane body under conditions that grow in proportion to a factor.

    mesh, elastic, hardening : the body; conditions : edge name -> Condition at the factor 1 (the rest free of traction)
    cells : where it may yield
    Errors: those of solve_boundary, CellError, TooLargeError.
    """

    def __init__(
        self,
        mesh: BoundaryMesh,
        elastic: Elastic,
        hardening: YieldLaw,
        conditions: dict[str, Condition],
        cells: Cells,
        memory_limit: float = MEMORY_LIMIT,
    ) -> None:
        held, local, resultants, known = conditions_of(mesh, conditions)
        problem = BoundaryProblem(mesh, elastic, held, local, memory_limit, dilating=True)
        problem.refuse_unbalanced(resultants)
        density, shift = problem.solve(resultants[:, None], known[:, None])
        self.section = PlasticSection(problem, cells, hardening, memory_limit)
        self.elastic = solution_of(problem, density[:, 0], shift[:, 0])
        self.density, self.load = density[:, 0], 0.0
        self.steps: list[Step] = []

    def go_to(self, load: float, tolerance: float = 1e-8) -> Step:
        """Bring the load factor from where it is to `load`, in smaller steps where it must be.

        Errors: NoEquilibriumError with the factor reached (the state is that of it), CellError.
        """
        begin = self.load

        def factor(share: float) -> float:
            return load if share == 1.0 else begin + share * (load - begin)

        def accept(share: float, done: Increment, used: Any) -> None:
            self.load = factor(share)
            self.steps.append(accepted(self.section, done, self.load))

        reach(
            self.section,
            lambda share: _Proportional(self.section, self.density, factor(share)),
            accept,
            lambda share: f"the load factor {factor(share):.6g}",
            tolerance,
        )
        return self.steps[-1]

    def displacement(self, points: np.ndarray) -> np.ndarray:
        """(k, 2) [m] at points (k, 2) inside the body."""
        plastic = self.section.plastic_stress()
        elastic = self.load * displacement_at(self.elastic, points)
        if not len(plastic):
            return elastic
        return elastic + (self.section.displacement_matrix(points) @ plastic).reshape(2, -1).T

    def stress(self) -> np.ndarray:
        """(m, 4) xx yy zz xy [Pa] of all cells: means of those that take part, values at the middle of the others."""
        return section_stress(self.section, self.load * self.density)


class _Proportional:
    """The load of fixed densities (2 n,) times a factor."""

    def __init__(self, section: PlasticSection, density: np.ndarray, factor: float) -> None:
        self.section, self.density = section, factor * density
        self.loads = ()

    def __call__(self, plastic: np.ndarray, tangent: bool) -> tuple[np.ndarray, None]:
        return self.section.from_layers @ self.density, None


def polar_cells(mesh: BoundaryMesh, inner: str, radii: np.ndarray) -> Cells:
    """Cells of a whole ring about the origin: angles of the vertices of the circle `inner`, radii (k,) [m] growing from
    its own. Those that end at the outer boundary need its vertices at the same angles.

    Errors: CellError.
    """
    element = np.flatnonzero(mesh.names == inner)
    around = mesh.vertices[element]
    around = around[np.argsort(np.arctan2(around[:, 1], around[:, 0]))]
    unit = around / np.hypot(*around.T)[:, None]
    grid = _snapped(np.asarray(radii, float)[:, None, None] * unit, mesh)
    cells = from_corner_grid(np.concatenate([grid, grid[:, :1]], axis=1))
    check_inside(cells, mesh)
    return cells


def _snapped(points: np.ndarray, mesh: BoundaryMesh) -> np.ndarray:
    """Points (..., 2) with those that a vertex of the mesh nearly is put on it."""
    flat = points.reshape(-1, 2).copy()
    away, vertex = cKDTree(mesh.vertices).query(flat)
    near = away < 1e-3 * mesh.lengths[vertex]
    flat[near] = mesh.vertices[vertex[near]]
    return flat.reshape(points.shape)


def ring(slope: float = 0.0) -> PlasticRing:
    """Radii 1 and 2 m; incompressible: it gives the scale of pressures."""
    return PlasticRing(1.0, 2.0, SHEAR, YIELD, slope)


def ring_body(size: float, hardening: Hardening, poisson: float = POISSON, radius: float = 2.0) -> PlasticBoundaryBody:
    """Elements and cells of `size` [m] at the inner wall, growing with the radius, cells out to a radius [m]; load
    factor 1 is 1 Pa inside."""
    begin, end = 0.0, 2 * np.pi
    outline = Outline(
        [[Edge(arc((0, 0), 2, begin, end, 721), "outer")], [Edge(arc((0, 0), 1, begin, end, 721), "inner")]]
    )
    mesh = mesh_outline(outline, lambda points: size * np.hypot(*points.T))
    rows = max(round(np.log(2) / size), 2)
    radii = 2.0 ** (np.arange(rows + 1) / rows)
    cells = polar_cells(mesh, "inner", radii[radii <= radius * (1 + 1e-9)])
    conditions = {"inner": Condition(traction=(-1.0, None), local=True)}
    return PlasticBoundaryBody(mesh, Elastic.from_shear(SHEAR, poisson), hardening, conditions, cells)


def polar_means(body: PlasticBoundaryBody, stress: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Radius, radial and hoop stress (m,) of the cells' stress (m, 4)."""
    x, y = body.section.cells.centers.T
    r, c, s = np.hypot(x, y), x / np.hypot(x, y), y / np.hypot(x, y)
    xx, yy, _, xy = stress.T
    radial = xx * c**2 + yy * s**2 + 2 * xy * c * s
    return r, radial, xx + yy - radial


class RingErrors(NamedTuple):
    """Relative errors (5,) of wall displacement, hoop stress, radial stress, plastic strain and residual hoop stress.

    largest : at any cell, over the largest of the field;  mean : root mean square over the cells by their area, over
    that of the field (the wall is one number: the same in both)
    """

    largest: np.ndarray
    mean: np.ndarray


def ring_errors(
    size: float, slope: float, front: float = 1.5, steps: int = 4, kinematic: bool = False, poisson: float = POISSON
) -> tuple[RingErrors, PlasticBoundaryBody, Step]:
    """Errors under the pressure that yields out to about `front` [m], and after it has gone, against radial finite
    elements of 800 layers; the body and its last loaded step."""
    hardening, scale = Hardening.linear(YIELD, slope, kinematic), ring(slope)
    pressure, first = scale.pressure(front), scale.first_pressure
    pressures = first + np.linspace(0, 1, steps + 1)[1:] * (pressure - first)
    *_, loaded, unloaded = radial_ring(
        1.0, 2.0, Elastic.from_shear(SHEAR, poisson), hardening, np.append(pressures, 0.0)
    )
    body = ring_body(size, hardening, poisson)
    for each in pressures:
        done = body.go_to(each)
    moved = np.hypot(*body.displacement(np.array([[1.0 + 1e-9, 0.0]]))[0])
    r, radial, hoop = polar_means(body, body.stress())
    areas = body.section.cells.areas

    def off(found: np.ndarray, reference: np.ndarray) -> tuple[float, float]:
        exact = np.interp(r, loaded.r, reference)
        mean = np.sqrt((areas * (found - exact) ** 2).sum() / (areas * exact**2).sum())
        return np.abs(found - exact).max() / np.abs(reference).max(), float(mean)

    wall = abs(moved / loaded.wall - 1)
    errors = [(wall, wall), off(hoop, loaded.hoop), off(radial, loaded.radial), off(done.peeq, loaded.peeq)]
    body.go_to(0.0)
    errors.append(off(polar_means(body, body.stress())[2], unloaded.hoop))
    return RingErrors(*np.array(errors).T), body, done
