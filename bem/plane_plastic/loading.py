"""Loads one after the other on a section that yields: each brought to equilibrium, the zone grown as it spreads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bem.checks import refuse_unless_finite
from bem.material import Elastic
from bem.plane.boundary import MEMORY_LIMIT, BoundaryProblem, Condition, EquilibriumError, conditions_of, solution_of
from bem.plane.internal import displacement_at
from bem.plane.mesh import BoundaryMesh
from bem.plane_plastic.cells import Cells
from bem.plane_plastic.increment import Increment, solve_increment
from bem.plane_plastic.section import PlasticSection, flat
from bem.plastic.hardening import YieldLaw, nearly_incompressible
from bem.plastic.increment import NoEquilibriumError
from bem.plastic.return_map import advanced

_NEARLY = 0.98  # of the yield stress from which a cell takes part
_HALVINGS = 7  # of a load step that has no equilibrium


@dataclass
class Step:
    """A load in equilibrium. load : its factor; residuals : of Newton, of the last solution; active, flowing : cells
    that take part and that flow in it; peeq : (m,) equivalent plastic strain; warnings"""

    load: float
    residuals: list[float]
    active: int
    flowing: int
    peeq: np.ndarray
    warnings: tuple[str, ...] = field(default=())


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

    def go_to(self, load: float, consistent: bool = True, tolerance: float = 1e-8) -> Step:
        """Bring the load factor from where it is to `load`, in smaller steps where it must be.

        Errors: NoEquilibriumError with the factor reached (the state is that of it), CellError.
        """
        refuse_unless_finite(EquilibriumError, **{"load factor": load})
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
            consistent,
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


def reach(
    section: PlasticSection,
    load_at: Callable[[float], Any],
    accept: Callable[[float, Increment, Any], None],
    describe: Callable[[float], str],
    consistent: bool = True,
    tolerance: float = 1e-8,
) -> None:
    """Equilibrium along a load's way from share 0 (held now) to 1, in smaller steps where it must be.

    load_at : share -> load, as for `settle`; accept : takes what was found; describe : a share in words
    Errors: NoEquilibriumError with the last share in equilibrium, which was accepted; CellError.
    """
    reached, step = 0.0, 1.0
    while reached < 1.0:
        share = 1.0 if reached + step > 1.0 - 1e-9 else reached + step
        load = load_at(share)
        try:
            found = settle(section, load, None, consistent, tolerance)
        except NoEquilibriumError as failure:
            step /= 2
            if step < 0.5**_HALVINGS:
                raise NoEquilibriumError(
                    f"no equilibrium beyond {describe(reached)} on the way to {describe(1.0)}: the body carries no"
                    f" more, or the cells are too coarse (steps down to {2 * step:.2g} of the way tried; {failure})"
                ) from None
            continue
        accept(share, found, load)
        reached = share


def settle(
    section: PlasticSection, load, start: np.ndarray | None = None, consistent: bool = True, tolerance: float = 1e-8
) -> Increment:
    """Equilibrium under a load, with as many cells as it takes. load : as in solve_increment, with `density` (2 n,) and
    `loads`, which after a call are those of the last plastic stress."""
    while True:
        if start is not None and len(start) != 3 * len(section.active):
            start = None
        found = solve_increment(section, load, start, tolerance, consistent)
        flowing = np.zeros(section.cells.count, bool)
        flowing[section.active] = found.returned.along[:, 0, 0] > 0
        section.refuse_at_rim(flowing)
        wanted = section.cells.around(flowing) | _yielding(section, load, found)
        before = len(section.active)
        if not section.grow(wanted):
            return found
        increment = (found.plastic - section_plastic_before(section, before)).reshape(3, -1)
        start = np.zeros((3, len(section.active)))
        start[:, :before] = increment
        start = start.ravel()


def section_plastic_before(section: PlasticSection, count: int) -> np.ndarray:
    """(3 count,) plastic stress so far of the first cells that take part."""
    return 2 * section.elastic.shear * flat(section.state.strain[section.active[:count]])


def _yielding(section: PlasticSection, load, found: Increment) -> np.ndarray:
    """(m,) bool: cells that do not take part and whose stress nearly yields."""
    out = np.zeros(section.cells.count, bool)
    others = np.flatnonzero(section.position < 0)
    if len(others):
        load(found.plastic, False)
        deviator = section.strain_at(section.cells.centers[others], load.density, found.plastic, load.loads)
        out[others] = np.sqrt(1.5 * (deviator**2).sum(axis=0)) > _NEARLY * section.hardening.first_yield
    return out


def accepted(section: PlasticSection, found: Increment, load: float) -> Step:
    """The state moves on by an increment."""
    part = advanced(section.part(), found.returned, section.hardening)
    section.state.strain[section.active] = part.strain
    section.state.back[section.active] = part.back
    section.state.peeq[section.active] = part.peeq
    flowing = int((found.returned.along > 0).sum())
    peeq = section.state.peeq[:, 0, 0].copy()
    warnings = nearly_incompressible(section.elastic)
    return Step(load, found.residuals, len(section.active), flowing, peeq, warnings)


def section_stress(section: PlasticSection, density: np.ndarray, loads: tuple = ()) -> np.ndarray:
    """(m, 4) xx yy zz xy [Pa] of all cells under densities (2 n,) of the load."""
    plastic = section.plastic_stress()
    stress = np.empty((section.cells.count, 4))
    own = section.from_layers @ density + section.matrix @ plastic
    mean = None
    if nearly_incompressible(section.elastic):
        field = section.field_stress(section.cells.points(section.active), density, plastic, loads)
        mean = (1 + section.elastic.poisson) / 3 * field[:, :2].sum(axis=1).reshape(-1, 4).mean(axis=1)
    stress[section.active] = section.stress(own.reshape(3, -1), plastic.reshape(3, -1), mean)
    others = np.flatnonzero(section.position < 0)
    strain = section.strain_at(section.cells.centers[others], density, plastic, loads)
    stress[others] = section.stress(strain, np.zeros_like(strain))
    return stress
