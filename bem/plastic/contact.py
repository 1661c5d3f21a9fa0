"""Indentation of an elastic-plastic half-space: pressure, plastic strain and residual surface displacement together.

Body 2 (below) yields, body 1 (above) is elastic, no friction. At each load the pressure follows from the gap plus the
residual displacement of the surface, the plastic strain from the pressure, and the displacement from the plastic
strain; the three are brought to agree by Anderson's mixing. Plastic strain lives in a box of cells around the yielding
zone. Source: the scheme of Jacq, Nelias, Lormand and Girodin, J. Tribol. 124 (2002) 653 (not looked at), with the
increment of bem.plastic.increment. Error: about first order in the cell, see docs/models/boundary_elements.md.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np

from bem.halfspace.input import check_inside, gap_values
from bem.halfspace.pressure import NormalOperator, solve_pressure
from bem.material import Elastic, Pair
from bem.patch import HALF_SPACE, ContactInputError, Cost, Grid, Patch
from bem.plastic.deviator import equivalent_stress, stress_of
from bem.plastic.hardening import Hardening, nearly_incompressible
from bem.plastic.increment import NoEquilibriumError, solve_increment
from bem.plastic.influence import Cells, StressInfluence
from bem.plastic.mixing import Mixing
from bem.plastic.return_map import PlasticState, Returned, advanced
from bem.plastic.surface import LoadStress, SurfaceDisplacement

_MARGIN = 2  # cells about the zone that yields
_NEARLY = 0.95  # of the yield stress by which the zone is guessed
_MOST_TURNS = 60
_LARGE_STRAIN = 0.05


@dataclass(frozen=True)
class Box:
    """Cells of a grid: x, y slices, and layers from the surface down."""

    x: slice
    y: slice
    layers: int

    def cells(self, grid: Grid, thickness: float) -> Cells:
        return Cells(grid.dx, grid.dy, thickness, self.x.stop - self.x.start, self.y.stop - self.y.start, self.layers)

    def of(self, fields: np.ndarray) -> np.ndarray:
        """The box of fields (nz, ..., nx, ny)."""
        return np.ascontiguousarray(fields[: self.layers, ..., self.x, self.y])


@dataclass
class PlasticContact:
    """A solved indentation step.

    patch    : pressure and approach
    state    : plastic strain, back stress, equivalent plastic strain on (nz, nx, ny) of patch.grid and depths
    stress   : (nz, nx, ny, 6) under load [Pa], order VOIGT; residual : the part by plastic strain
    surface  : (nx, ny) residual displacement of the surface, positive into the body [m]
    In depth-positive axes (bem.plastic.symbols): for z up, yz and xz change their sign.
    """

    patch: Patch
    depths: np.ndarray
    state: PlasticState
    stress: np.ndarray
    residual: np.ndarray
    surface: np.ndarray
    turns: int = 0
    products: int = 0
    warnings: tuple[str, ...] = ()


@dataclass
class PlasticHalfSpace:
    """An elastic-plastic body 2 on a grid, its state carried from load to load.

    layers, thickness : of the cells in depth; the grid's cells are those of the contact
    first : body 1, elastic; second : elasticity of body 2; hardening : its yield curve
    Errors: ContactInputError where the grid is too small for the zone that yields or the kernels too large (said before
    they are made), NoEquilibriumError.
    """

    grid: Grid
    thickness: float
    layers: int
    first: Elastic
    second: Elastic
    hardening: Hardening
    state: PlasticState = field(init=False)

    def __post_init__(self) -> None:
        if self.layers < 1 or not (np.isfinite(self.thickness) and self.thickness > 0):
            raise ContactInputError(f"{self.layers} layers of {self.thickness!r} m: give at least one, of finite depth")
        self.pair = Pair.of(self.first, self.second)
        self.operator = NormalOperator(self.grid, self.pair)
        self.depths = (np.arange(self.layers) + 0.5) * self.thickness
        self.load_stress = LoadStress(self.grid, self.depths, self.second.poisson)
        self.displacement = SurfaceDisplacement(self.grid, self.layers, self.thickness, self.second)
        self.state = PlasticState.virgin((self.layers, 5, *self.grid.shape))
        self.box: Box | None = None
        self.influence: StressInfluence | None = None
        self.residual = np.zeros(self.state.strain.shape)  # deviator by the plastic strain so far
        self._pressure: np.ndarray | None = None

    def press(self, gap: np.ndarray, load: float, tolerance: float = 1e-4) -> PlasticContact:
        """Bring the load [N] from what it was to this value on a gap (nx, ny) [m]; the state moves on.

        tolerance : change of the surface over the approach at which pressure and plastic strain agree
        """
        started = time.perf_counter()
        gap = gap_values(gap, self.grid)
        surface = self.displacement.normal(self.state.strain)
        mixing, returned, turns, products = Mixing(), None, 0, 0
        while True:
            solution = solve_pressure(self.operator, gap + surface, load, start=self._pressure, tolerance=1e-6)
            deviator, mean = self.load_stress((solution.pressure,))
            returned, count = self._yield(deviator, returned)
            products += count
            turns += 1
            strain = self.state.strain.copy()
            if returned is not None:
                strain[: self.box.layers, :, self.box.x, self.box.y] += returned.increment
            answer = self.displacement.normal(strain)
            self._pressure = solution.pressure
            off = float(np.abs(answer - surface).max()) / max(abs(solution.approach - gap.min()), 1e-300)
            if off <= tolerance:
                break
            if turns >= _MOST_TURNS or not np.isfinite(off):
                raise NoEquilibriumError(
                    f"load {load:g} N: pressure and plastic strain do not agree after {turns} turns (surface off by "
                    f"{off:.2g} of the approach); take smaller load steps"
                )
            surface = mixing(surface, answer)
        check_inside(solution.pressure, self.grid)
        return self._finish(gap, solution, returned, deviator, mean, answer, turns, products, started)

    def _yield(self, deviator: np.ndarray, before: Returned | None) -> tuple[Returned | None, int]:
        """Plastic strain of this step under a load's deviator, in a box that holds the yielding zone."""
        trial = equivalent_stress(deviator + self.residual)
        self._cover(trial > _NEARLY * self._limit())
        if self.influence is None:
            return None, 0
        products = 0
        while True:
            box = self.box
            state = PlasticState(box.of(self.state.strain), box.of(self.state.back), box.of(self.state.peeq))
            fits = before is not None and before.increment.shape == state.strain.shape
            found = solve_increment(
                self.influence, box.of(deviator + self.residual), state, self.hardening,
                before.increment.copy() if fits else None,
            )  # fmt: skip
            products += found.products
            flowing = np.zeros(self.state.peeq.shape, bool)
            flowing[: box.layers, box.x, box.y] = found.returned.along > 0
            if not self._cover(flowing):
                return found.returned, products

    def _limit(self) -> np.ndarray:
        """Yield stress for a guess of the zone: kinematic hardening moves the surface by less than the first yield."""
        return self.hardening.first_yield if self.hardening.kinematic else self.hardening.at(self.state.peeq)

    def _cover(self, zone: np.ndarray) -> bool:
        """Let the box hold a zone (nz, nx, ny) with its margin; whether it grew."""
        if not zone.any():
            return False
        ranges = [np.flatnonzero(zone.any(axis=axes)) for axes in ((0, 2), (0, 1), (1, 2))]
        self._refuse_at_edge(ranges)
        low = [max(r[0] - _MARGIN, 0) for r in ranges]
        high = [min(r[-1] + 1 + _MARGIN, n) for r, n in zip(ranges, (*self.grid.shape, self.layers))]
        old = self.box
        if old is not None:
            inner = [r[0] >= s.start + 1 and r[-1] < s.stop - 1 for r, s in zip(ranges, (old.x, old.y))]
            if all(inner) and ranges[2][-1] < old.layers - 1:
                return False
            low = [min(low[0], old.x.start), min(low[1], old.y.start)]
            high = [max(high[0], old.x.stop), max(high[1], old.y.stop), max(high[2], old.layers)]
        self.box = Box(slice(low[0], high[0]), slice(low[1], high[1]), high[2])
        self.influence = StressInfluence(self.box.cells(self.grid, self.thickness), self.second)
        return True

    def _refuse_at_edge(self, ranges: list[np.ndarray]) -> None:
        grid = self.grid
        for name, cells, count in zip(("x", "y"), ranges, grid.shape):
            if cells[0] < 1 or cells[-1] > count - 2:
                raise ContactInputError(
                    f"the plastic zone reaches the window's edge along {name} (cells {cells[0]} to {cells[-1]} of"
                    f" {count}): widen the grid, or lower the load"
                )
        if ranges[2][-1] > self.layers - 2:
            raise ContactInputError(
                f"the plastic zone reaches the deepest layer, {self.depths[-1] * 1e3:.3g} mm: give more layers than"
                f" {self.layers}, or thicker ones"
            )

    def _finish(self, gap, solution, returned, deviator, mean, surface, turns, products, started) -> PlasticContact:
        hydrostatic = np.zeros(self.state.peeq.shape)
        if returned is not None and self.box is not None:
            box = self.box
            inside = (slice(0, box.layers), slice(None), box.x, box.y)
            part = PlasticState(box.of(self.state.strain), box.of(self.state.back), box.of(self.state.peeq))
            part = advanced(part, returned, self.hardening)
            self.state.strain[inside], self.state.back[inside] = part.strain, part.back
            self.state.peeq[: box.layers, box.x, box.y] = part.peeq
            self.residual[inside] = self.influence.deviator(part.strain)
            hydrostatic[: box.layers, box.x, box.y] = self.influence.mean(part.strain)
        patch = Patch(
            self.grid, gap, solution.pressure, solution.approach, HALF_SPACE,
            cost=Cost(time.perf_counter() - started, turns, products),
        )  # fmt: skip
        residual = stress_of(self.residual, hydrostatic)
        return PlasticContact(
            patch, self.depths, self.state.copy(), stress_of(deviator, mean) + residual, residual, surface.copy(),
            turns, products, self._warnings(),
        )  # fmt: skip

    def _warnings(self) -> tuple[str, ...]:
        worst = float(self.state.peeq.max())
        large = ()
        if worst > _LARGE_STRAIN:
            large = (
                f"plastic strain up to {worst:.1%}: above {_LARGE_STRAIN:.0%} small-strain theory and the flat surface"
                " are an approximation",
            )
        return large + nearly_incompressible(self.second)
