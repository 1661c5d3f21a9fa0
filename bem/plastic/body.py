"""A window of an elastic-plastic half-space: its cells, what they remember, and the box of them that yields now."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bem.material import Elastic
from bem.patch import ContactInputError, Grid
from bem.plastic.increment import solve_increment
from bem.plastic.influence import Cells, StressInfluence
from bem.plastic.surface import SurfaceDisplacement
from bem.steel.deviator import equivalent_stress
from bem.steel.hardening import YieldLaw
from bem.steel.return_map import PlasticState, Returned, advanced

MARGIN = 2  # cells about the zone that yields, at least
_SHARE = 6  # or this part of its width: a larger box costs less than another kernel
_NEARLY = 0.95  # of the yield stress by which the zone is guessed
_LOADED = 0.3  # of the yield stress that the load itself must bring there


@dataclass(frozen=True)
class Box:
    """Cells of a window: x, y slices, and layers from the surface down."""

    x: slice
    y: slice
    layers: int

    @property
    def inside(self) -> tuple:
        """Index of the box in fields (nz, 5, nx, ny)."""
        return slice(0, self.layers), slice(None), self.x, self.y

    def of(self, field: np.ndarray) -> np.ndarray:
        """The box of a field (nz, ..., nx, ny)."""
        return np.ascontiguousarray(field[: self.layers, ..., self.x, self.y])

    def cells(self, grid: Grid, thickness: float) -> Cells:
        return Cells(grid.dx, grid.dy, thickness, self.x.stop - self.x.start, self.y.stop - self.y.start, self.layers)


@dataclass
class Trial:
    """Plastic strain of a step that is not accepted yet, in a box; products with the influence."""

    box: Box
    returned: Returned
    interaction: np.ndarray
    products: int = 0


class PlasticBody:
    """An elastic-plastic half-space below a window of cells.

    grid, thickness, layers : the cells; elastic, hardening : the steel
    state    : plastic strain, back stresses, equivalent plastic strain (nz, [5,] nx, ny)
    residual : (nz, 5, nx, ny) deviator by the plastic strain [Pa]; in the box of cells that have yielded
    surface  : (nx, ny) displacement of the surface by it, positive into the body [m]
    faint    : part of the largest plastic strain by which a cell at the window's edge may grow in a step: steel that
        other loads left at its limit gives way a little where none is now
    Errors: ContactInputError where the yielding zone leaves the window or the kernels are too large (said before they
    are made).
    """

    def __init__(self, grid: Grid, thickness: float, layers: int, elastic: Elastic, hardening: YieldLaw) -> None:
        if not (float(layers).is_integer() and layers >= 2 and np.isfinite(thickness) and thickness > 0):
            raise ContactInputError(
                f"{layers} layers of {thickness!r} m: give at least two whole ones, of finite depth"
            )
        window = Cells(grid.dx, grid.dy, float(thickness), grid.nx, grid.ny, int(layers))
        window.refuse_too_large(window.window_memory)
        self.grid, self.thickness, self.layers = grid, float(thickness), int(layers)
        self.elastic, self.hardening = elastic, hardening
        self.depths = window.depths
        self.state = PlasticState.virgin((layers, 5, *grid.shape), hardening.back_stresses)
        self.residual = np.zeros((layers, 5, *grid.shape))
        self.surface, self.faint = np.zeros(grid.shape), 0.0
        self.displacement = SurfaceDisplacement(grid, layers, thickness, elastic)
        self.box: Box | None = None
        self._influences: dict[Cells, StressInfluence] = {}

    def influence(self, cells: Cells) -> StressInfluence:
        """Of a box of cells; kept, as moving a box does not change it."""
        if cells not in self._influences:
            self._influences = {
                **dict(list(self._influences.items())[-3:]),
                cells: StressInfluence(cells, self.elastic),
            }
        return self._influences[cells]

    def look(self, deviator: np.ndarray) -> None:
        """Let the box hold all cells that a load's deviator (nz, 5, nx, ny) would bring to yield."""
        limit = self.hardening.size(self.state.peeq)
        near = equivalent_stress(deviator + self.residual - self.state.centre) > _NEARLY * limit
        near &= equivalent_stress(deviator) > _LOADED * limit  # not what other loads left at its limit
        near[-1] = False  # that it really flows at an end of the window is for `attempt` to find
        if self.grid.ny > 1:
            near[:, :, [0, -1]] = False
        near[:, [0, -1]] = False
        self._cover(near)

    def attempt(self, deviator: np.ndarray, before: Trial | None, tolerance: float = 1e-6) -> Trial | None:
        """Plastic strain under a load's deviator (layers of the box or more); None where nothing yields."""
        if self.box is None:
            return None
        products = 0
        while True:
            box = self.box
            influence = self.influence(box.cells(self.grid, self.thickness))
            start = before.returned.increment.copy() if before is not None and before.box == box else None
            so_far = influence.products
            returned, interaction = solve_increment(
                influence, box.of(deviator) + box.of(self.residual), self.part(box), self.hardening, start, tolerance
            )
            products += influence.products - so_far
            grown = np.zeros(self.state.peeq.shape)
            grown[: box.layers, box.x, box.y] = np.linalg.norm(returned.increment, axis=1)
            faint = self.faint * max(float(grown.max()), float(self.state.peeq.max()))
            if (grown > faint).any():
                self._refuse_at_edge(_ranges(grown > faint))
            if not self._cover(grown > 0) or len(deviator) < self.box.layers:
                return Trial(box, returned, interaction, products)

    def part(self, box: Box) -> PlasticState:
        """The state in a box."""
        return PlasticState(box.of(self.state.strain), box.of(self.state.back), box.of(self.state.peeq))

    def lowering(self, trial: Trial | None) -> np.ndarray:
        """(nx, ny) displacement of the surface with the plastic strain of a trial, positive into the body [m]."""
        if trial is None:
            return self.surface
        strain = np.zeros((trial.box.layers, 5, *self.grid.shape))
        strain[trial.box.inside] = trial.returned.increment
        return self.surface + self.displacement(strain)

    def accept(self, trial: Trial | None) -> None:
        """The state moves on by a trial; residual stress in the box only."""
        if trial is None:
            return
        self.surface = self.lowering(trial)
        inside, box = trial.box.inside, trial.box
        part = advanced(self.part(box), trial.returned, self.hardening)
        self.state.strain[inside], self.state.back[inside] = part.strain, part.back
        self.state.peeq[: box.layers, box.x, box.y] = part.peeq
        self.residual[inside] += trial.interaction

    def mean_residual(self) -> np.ndarray:
        """(nz, nx, ny) mean stress by the plastic strain [Pa], in the box."""
        mean = np.zeros(self.state.peeq.shape)
        if self.box is not None:
            box = self.box
            mean[: box.layers, box.x, box.y] = self.influence(box.cells(self.grid, self.thickness)).mean(
                box.of(self.state.strain)
            )
        return mean

    def _cover(self, zone: np.ndarray) -> bool:
        """Let the box hold a zone (nz, nx, ny) with its margin; whether it grew."""
        if not zone.any():
            return False
        ranges = _ranges(zone)
        margin = [max(MARGIN, int(r[-1] - r[0]) // _SHARE) for r in ranges]
        low = [max(r[0] - m, 0) for r, m in zip(ranges[:2], margin)]
        high = [min(r[-1] + 1 + m, n) for r, m, n in zip(ranges, margin, (*self.grid.shape, self.layers))]
        old = self.box
        if old is not None:
            inner = [
                n == 1 or r[0] >= s.start + 1 and r[-1] < s.stop - 1
                for r, s, n in zip(ranges, (old.x, old.y), self.grid.shape)
            ]
            if all(inner) and ranges[2][-1] < old.layers - 1:
                return False
            low = [min(low[0], old.x.start), min(low[1], old.y.start)]
            high = [max(high[0], old.x.stop), max(high[1], old.y.stop), max(high[2], old.layers)]
        self.box = Box(slice(low[0], high[0]), slice(low[1], high[1]), high[2])
        return self.box != old

    def _refuse_at_edge(self, ranges: list[np.ndarray]) -> None:
        for name, cells, count in zip(("x", "y"), ranges, self.grid.shape):
            if count > 1 and (cells[0] < 1 or cells[-1] > count - 2):  # one cell across is a plane problem
                raise ContactInputError(
                    f"the plastic zone reaches the window's edge along {name} (cells {cells[0]} to {cells[-1]} of"
                    f" {count}): widen the grid, or lower the load"
                )
        if ranges[2][-1] > self.layers - 2:
            raise ContactInputError(
                f"the plastic zone reaches the deepest layer, {self.depths[-1] * 1e3:.3g} mm: give more layers than"
                f" {self.layers}, or thicker ones"
            )


def _ranges(zone: np.ndarray) -> list[np.ndarray]:
    """Columns, rows and layers that a zone (nz, nx, ny) of cells has a part of."""
    return [np.flatnonzero(zone.any(axis=axes)) for axes in ((0, 2), (0, 1), (1, 2))]
