"""Normal contact of two elastic half-spaces: pressure and patch from a gap, by load or by approach.

Valid where the patch is small against the bodies and against their radii; conformal contact and edges need the 2.5D
slices. Give the gap as an array on a grid, or as a function with a search window: then the grid is placed on the patch,
stretched where it would cut it, and refined until the asked accuracy is met.
Unlike materials: `rolling_contact` and `shift_contact` (bem/halfspace/tangential.py) iterate normal and tangential
problem; without friction, as here, the pressure depends on E* alone.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from bem.checks import refuse_unless_positive
from bem.halfspace.coarse import coarse_field, coarse_grid, edge_share, error_bound, fine_pressure, refined
from bem.halfspace.input import Gap, check_cells, check_control, check_inside, gap_values, strain_warning
from bem.halfspace.positioning import Window, position_grid, widened
from bem.halfspace.pressure import NormalOperator, solve_pressure
from bem.material import Elastic, Pair
from bem.patch import HALF_SPACE, ContactInputError, Cost, ErrorEstimate, Grid, Patch
from bem.renamed import renamed

_LARGEST_GRID = 704
_COARSEST_GRID = 6
_MOST_STRETCHES = 60  # tenths by which a grid that cuts the patch is stretched: 300 times its sides
# of the changes between the grids that is taken for the error (bem/verification/estimates_study.py)
_PRESSURE_SHARE = 1.1
_AREA_SHARE, _AREA_STAIRS = 0.3, 0.18  # of the area's changes, and of a cell over the width
_NESTED_GRID = 160  # cells from which a start from doubled cell sides saves time


@renamed(first="upper", second="lower")
def normal_contact(
    gap: Gap,
    upper: Elastic,
    lower: Elastic,
    *,
    load: float | None = None,
    approach: float | None = None,
    grid: Grid | None = None,
    window: Window | None = None,
    cells: int | tuple[int, int] = 44,
    accuracy: float | None = None,
    cut: bool = False,
    estimate: bool = True,
) -> Patch:
    """Frictionless contact of two bodies, which deform as half-spaces.

    Parameters
    ----------
    gap : (nx, ny) array or function
        On `grid`, or gap(x, y) [m]; open positive, +inf where a body has no surface.
    upper, lower : Elastic
        Bodies 1 (above) and 2 (below).
    load, approach : float
        One of them [N], [m]; load 0 gives an empty patch, an approach that does not close the gap an error.
    grid : Grid, optional
        The cells; without it `window` is searched and `cells` laid on the patch.
    window : ((x_min, x_max), (y_min, y_max)), optional
        [m]
    cells : int or (int, int)
        Over the patch.
    accuracy : float, optional
        Cells are doubled until the estimated relative error of the largest pressure is below it (function gaps).
    cut : bool
        Allow the patch to reach the grid's edge, because the bodies end there.
    estimate : bool
        Also solve at doubled and at fourfold cell sides, for the error estimate (a third of the cost).

    Returns
    -------
    Patch
        Error and source: bem/halfspace/pressure.py.

    Raises
    ------
    ContactInputError
        For what no solver can answer, with what to do.

    Examples
    --------
    >>> window = (-0.01, 0.01), (-0.01, 0.01)
    >>> sphere = lambda x, y: (x**2 + y**2) / 0.6
    >>> patch = bem.normal_contact(sphere, bem.STEEL, bem.STEEL, load=50e3, window=window)
    >>> exact = bem.point_contact(50e3, 0.3, 0.3, bem.contact_modulus(bem.STEEL, bem.STEEL))
    >>> bool(abs(patch.max_pressure / exact.max_pressure - 1) < 5e-3)
    True
    """
    check_control(load, approach)
    started = time.perf_counter()
    pair = Pair.of(upper, lower)
    cells = check_cells(cells)
    if accuracy is not None:
        refuse_unless_positive(ContactInputError, accuracy=accuracy)
    if load == 0:
        return _empty(gap, grid, window, cells)
    if grid is None:
        patch = _placed(gap, pair, load, approach, window, cells, accuracy, estimate)
    else:
        patch = _solve(gap, grid, pair, load, approach, estimate)
        if not cut:
            check_inside(patch.pressure, grid)
    patch.warnings += strain_warning(patch.pressure, upper, lower)
    patch.cost = Cost(time.perf_counter() - started, patch.cost.iterations, patch.cost.products)
    return patch


def _placed(gap, pair, load, approach, window, cells, accuracy, estimate) -> Patch:
    if window is None or not callable(gap):
        raise ContactInputError(
            "without a grid: give gap as a function gap(x, y) and a search window ((x_min, x_max), (y_min, y_max))"
        )
    grid = position_grid(gap, window, pair, load, approach, cells)
    stretches = 0
    while True:
        patch = _solve(gap, grid, pair, load, approach, estimate or accuracy is not None)
        p = patch.pressure
        if p[0].any() or p[-1].any() or p[:, 0].any() or p[:, -1].any():
            stretches += 1
            if stretches > _MOST_STRETCHES:
                check_inside(p, grid)
            grid = widened(grid, p, window)
        elif accuracy is None or patch.error.max_pressure <= accuracy:
            return patch
        elif 2 * max(grid.shape) > _LARGEST_GRID:
            patch.warnings += (
                f"accuracy {accuracy:g} not reached at {grid.nx} x {grid.ny} cells: estimated "
                f"{patch.error.max_pressure:.1g}",
            )
            return patch
        else:
            grid = refined(grid, 2)


def _solve(gap: Gap, grid: Grid, pair: Pair, load, approach, estimate: bool) -> Patch:
    """Pressure on one grid, started from doubled cell sides where these are solved for the estimate or save time."""
    values = gap_values(gap, grid)
    finer = min(grid.shape) >= (2 * _COARSEST_GRID if estimate else _NESTED_GRID)
    coarse = _coarse_patch(gap, grid, values, pair, load, approach) if finer else None
    start = fine_pressure(coarse.pressure, grid.shape) if coarse is not None else None
    operator = NormalOperator(grid, pair)
    solution = solve_pressure(operator, values, load, approach, start)
    cost = Cost(np.nan, solution.iterations, operator.products)
    fields = values, solution.pressure, solution.approach
    patch = Patch(grid, *fields, HALF_SPACE, cost=cost, warnings=solution.notes, modulus=pair.modulus)
    if estimate and coarse is not None:
        coarser = _coarse_patch(gap, coarse.grid, coarse.gap, pair, load, approach)
        patch.error = _estimate(coarser, coarse, patch, approach is None)
    return patch


def _coarse_patch(gap: Gap, fine: Grid, values: np.ndarray, pair: Pair, load, approach) -> Patch | None:
    """The same problem at doubled cell sides, itself started from there; None where it has no contact."""
    grid = coarse_grid(fine)
    values = np.asarray(gap(*grid.points()), float) if callable(gap) else coarse_field(values)
    if not np.isfinite(values).any() or approach is not None and approach <= values.min():
        return None
    inner = _coarse_patch(gap, grid, values, pair, load, approach) if min(grid.shape) >= _NESTED_GRID else None
    start = fine_pressure(inner.pressure, grid.shape) if inner is not None else None
    solution = solve_pressure(NormalOperator(grid, pair), values, load, approach, start, tolerance=1e-5)
    return Patch(grid, values, solution.pressure, solution.approach, HALF_SPACE)


def _estimate(coarser: Patch | None, coarse: Patch, fine: Patch, by_load: bool) -> ErrorEstimate:
    def bound(quantity: Callable[[Patch], float]) -> float:
        return error_bound(quantity(fine), quantity(coarse), None if coarser is None else quantity(coarser))

    normal = bound(lambda patch: patch.closure if by_load else patch.normal_force)
    area = np.hypot(_AREA_SHARE * bound(lambda patch: patch.contact_area), edge_share(fine.pressure, _AREA_STAIRS))
    return ErrorEstimate(
        _PRESSURE_SHARE * bound(lambda patch: patch.max_pressure),
        float(area),
        normal,
        note=f"changes from {coarse.grid.nx} x {coarse.grid.ny} cells and from doubled ones there",
    )


def _empty(gap: Gap, grid: Grid | None, window: Window | None, cells: tuple[int, int]) -> Patch:
    """Nothing pressed together: no pressure, approach at the least gap, and a warning that says so."""
    if grid is None:
        if window is None or not callable(gap):
            raise ContactInputError("give a grid, or a gap function with a window")
        grid = Grid.over(*window, *cells)
    values = gap_values(gap, grid)
    patch = Patch(grid, values, np.zeros(grid.shape), float(values.min()), HALF_SPACE, cost=Cost(0.0, 0, 0))
    patch.warnings = ("load 0 N: the bodies touch without pressure, the patch is empty",)
    return patch
