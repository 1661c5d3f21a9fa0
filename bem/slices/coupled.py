"""Contact patch by slices, controlled by displacement: the 2.5D method (b).

Each slice has its own gap, measured between the bodies' sections there. All slices share one approach; how the load is
shared along the patch comes out and is not assumed. Slices feel each other through the elastic bodies:

    displacement = half-space (three-dimensional, all cells)  +  correction of each body's cross-section
    (three-dimensional prism)

The correction holds what a half-space has not: the curvature of conforming faces, the nearness of an edge, the depth of
the body and how it is held. It is found by boundary elements in the section, wavenumber by wavenumber
(bem/slices/section_flexibility.py).

Three-dimensional: the gap in every slice, the elasticity of both bodies as prisms of their section at x = 0, and with
it the spread of load along the patch. For a large block the method is the half-space's, for a long patch the
plane-strain one's (bem/plane/contact.py). The gap is that of the undeformed bodies at the approach found, taken anew in
turns: on a steep face they slide along each other by more than the patch's depth while they close. Not
three-dimensional: the bodies' elasticity does not know that their sections change along x (a wheel's roundness, a nose
that widens), nor their ends; the normal's component along x is neglected (x/R); pressures act along the lower face's
normals, and developed lengths along it take the place of distances in the half-space's share, which the correction
makes up for. No friction. Source of the idea: displacement-controlled slices are the further work named in the thesis,
chapter 6.2.4.
Error: against CONTACT's conformal contact of S1002 on UIC60 at 50 kN below 0.3 % in force and 0.8 % in largest pressure
on tread and root; on the flange +1.2 to +2.4 % and -0.8 to -4.0 %, which finer cells do not see and the estimate adds;
half-space: bem/halfspace/pressure.py; correction: second order in the station spacing
(tests/bem/test_slices.py).
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from numbers import Integral

import numpy as np
from scipy import fft

from bem.halfspace.coarse import coarse_grid, error_bound
from bem.halfspace.input import check_cells, check_control, check_inside, gap_values, strain_warning
from bem.halfspace.positioning import Window, position_grid, widened
from bem.halfspace.pressure import NormalOperator, PressureSolution, solve_pressure
from bem.material import Pair
from bem.patch import ContactInputError, Cost, ErrorEstimate, Grid, NoContactError, Patch
from bem.slices.section_flexibility import Flexibility, body_flexibility
from bem.slices.slices import SliceGap, Slices
from bem.stages import StageClock

# largest error of pressure and force against CONTACT's conformal contact, 4.0 and 2.4 % on flanks of 70 degrees, over
# 1 - the cosine between face normal and approach there
_LEANING = 0.04 / (1 - np.cos(np.radians(70))), 0.024 / (1 - np.cos(np.radians(70)))
_STEEPEST = 0.05  # least cosine between face normal and approach: steeper faces are not closed by it
_STATIONS = 16
_GAP_KEPT = 1e-3  # of the largest closure, by which the gap may change over the patch when it is taken anew
_MOST_TURNS = 12  # times the gap is taken anew
_MOST_STRETCHES = 12  # times the sections are laid anew for a grid that cut the patch
# of the changes between grids taken for the error of pressure, area, approach (bem/verification/estimates_study.py)
_SHARES = 1.2, 0.6, 1.1
_ZONE = 0.15  # of the patch's width, by which stations reach beyond it on each side


@dataclass
class SlicePatch(Patch):
    """A patch laid along a curved face.

    gap : along the lower face's normals at the approach, and led back from there in a line: closed by approach * cosine
    points, normals : (ny, 2) [m] where the grid's lateral coordinate lies in the section, and the lower face's outward
        normals
    direction : (2,) direction of the approach; seconds : time by stage; initial_approach : (2,) [m] move of the upper
        body into contact at x = 0
    """

    points: np.ndarray = field(kw_only=True)
    normals: np.ndarray = field(kw_only=True)
    direction: np.ndarray = field(kw_only=True)
    initial_approach: np.ndarray = field(kw_only=True)
    seconds: dict[str, float] | None = None

    curved = True  # the patch bends with the section: its normals differ from slice to slice

    @property
    def force(self) -> np.ndarray:
        """(2,) force of the pressures on the upper body (lateral, up) [N]."""
        return self.pressure.sum(axis=0) @ self.normals * self.grid.cell_area

    @property
    def line_load(self) -> np.ndarray:
        """(nx,) load along the approach in each slice [N/m]."""
        return self.pressure @ -(self.normals @ self.direction) * self.grid.dy


class SliceOperator(NormalOperator):
    """Displacement along the approach under loads along the approach: half-space and corrections, both divided by the
    cosines.

    With P = cosine * pressure and all displacements over the cosine, contact on a curved face has the form of contact
    on a plane.
    """

    def __init__(self, grid: Grid, pair: Pair, corrections: list[Flexibility], cosines: np.ndarray) -> None:
        super().__init__(grid, pair)
        self.cosines = cosines
        self._along = fft.next_fast_len(2 * grid.nx, real=True)
        self._corrections = []
        for correction in corrections:
            kernel = correction.between_slices(grid)
            wrapped = np.zeros((self._along, *kernel.shape[1:]))
            wrapped[: grid.nx] = kernel
            wrapped[self._along - grid.nx + 1 :] = kernel[:0:-1]
            self._corrections.append((correction.interpolation(grid.y), fft.rfft(wrapped, axis=0).real))

    def correction(self, pressure: np.ndarray) -> np.ndarray:
        """(nx, ny) displacement [m] that the cross-sections add, under pressure (nx, ny) [Pa]."""
        total = np.zeros_like(pressure)
        for positions, spectrum in self._corrections:
            loads = fft.rfft(pressure @ positions * self.grid.dy, n=self._along, axis=0)
            moved = fft.irfft(np.einsum("kij,kj->ki", spectrum, loads, optimize=True), n=self._along, axis=0)[
                : self.grid.nx
            ]
            total += moved @ positions.T
        return total

    def displacement(self, pressure: np.ndarray) -> np.ndarray:
        """Displacement along the normals (nx, ny) [m] by pressures (nx, ny) [Pa]."""
        load = pressure / self.cosines
        return (super().displacement(load) + self.correction(load)) / self.cosines

    def precondition(self, residual: np.ndarray) -> np.ndarray:
        """As of the half-space, for pressures along the normals."""
        return super().precondition(residual * self.cosines) * self.cosines


def slice_contact(
    slices: Slices,
    *,
    load: float | None = None,
    approach: float | None = None,
    cells: tuple[int, int] = (50, 80),
    length: tuple[float, float] | None = None,
    grid: Grid | None = None,
    stations: int = _STATIONS,
    threads: int | None = None,
    cut: bool = False,
    estimate: bool = True,
) -> SlicePatch:
    """Frictionless contact of the two bodies of `slices`, with the coupling of the slices.

    Parameters
    ----------
    slices : Slices
        The two bodies.
    load, approach : float
        One of them: [N] along slices.direction, or [m] of the held edges after contact at x = 0.
    cells : (int, int)
        Slices along x, cells across; they are laid over the patch, which is searched for within `length` and the lower
        face.
    length : (float, float), optional
        x_min, x_max [m]; None: as long as the lower face is wide on both sides.
    grid : Grid, optional
        The cells themselves.
    stations : int
        Across the patch, where the cross-sections' correction is computed.
    threads : int, optional
        None: all processors of this process.
    cut : bool
        Allow the patch to reach the grid's edge; a patch that reaches the end of a face is always allowed.
    estimate : bool
        Also solve with doubled and fourfold cells and half the stations, for the error estimate.

    Returns
    -------
    SlicePatch

    Raises
    ------
    ContactInputError
        And its kinds, OutlineError, with what is wrong and what to do.

    Examples
    --------
    >>> from rail_fem.bem.plane.outline import block_behind
    >>> y = np.linspace(-0.04, 0.04, 161)
    >>> crown, tread = np.column_stack([y, -(y**2) / 0.6]), np.column_stack([y, y**2 / 2.0])
    >>> rail, wheel = (bem.Body(block_behind(line, end), bem.STEEL) for line, end in ((crown, -0.1), (tread, 0.1)))
    >>> rolled = lambda x: [tread + [0.0, x**2 / 0.92]]  # of a wheel of 0.46 m
    >>> slices = bem.Slices(rail, wheel, upper_section=rolled)
    >>> patch = bem.slice_contact(slices, load=50e3, cells=(8, 12), threads=1, estimate=False)
    >>> bool(abs(patch.normal_force / 50e3 - 1) < 0.01)
    True
    """
    check_control(load, approach)
    cells = check_cells(cells)
    if not (isinstance(stations, Integral) and stations >= 1):
        raise ContactInputError(f"stations = {stations!r}: give a whole number, at least 1")
    clock = StageClock()
    first, second = slices.upper.material, slices.lower.material
    gap = SliceGap(slices)
    problem = _Problem(gap, Pair.of(first, second), load, approach, threads or len(os.sched_getaffinity(0)))
    window = (length or _default_length(gap), gap.window)
    if load == 0:
        return _untouched(problem, grid or Grid.over(*window, *cells), clock)
    if grid is not None:
        _check_beside_face(grid, gap)
        stretches = 1
    else:
        grid = position_grid(problem.gap_along, window, problem.pair, load, approach, cells)
        stretches = _MOST_STRETCHES
    clock.stop("positioning")
    patch = _solve(problem, grid, window, stations, clock, stretches, cut)
    if estimate:
        patch.error = _estimate(problem, patch, stations)
        clock.stop("estimate")
    patch.warnings += strain_warning(patch.pressure, first, second)
    patch.seconds = clock.seconds
    patch.cost = replace(patch.cost, seconds=sum(clock.seconds.values()))
    return patch


@dataclass
class _Problem:
    gap: SliceGap
    pair: Pair
    load: float | None
    approach: float | None
    threads: int

    def cosines(self, y: np.ndarray) -> np.ndarray:
        return np.maximum(self.gap.cosines(y), _STEEPEST)

    def gap_along(self, x: np.ndarray, y: np.ndarray, approach: float = 0.0) -> np.ndarray:
        """The approach that closes the gap, led on in a line from the gap at an approach."""
        values = self.gap(x, y, approach)
        values[:, self.gap.cosines(y[0]) < _STEEPEST] = np.inf
        return values / self.cosines(y[0]) + approach

    def flexibilities(self, low: float, high: float, size: float, length: float) -> list[Flexibility]:
        """Rest of both bodies for a zone between lateral coordinates, by stations `size` apart."""
        first, last = self.gap.window
        zone = self.gap.face(np.arange(max(low, first), min(high, last), size / 4))[0]
        y = np.arange(max(low - 3 * size, first), min(high + 3 * size, last), size / 100)
        along = self.gap.face(y)[0], y
        return [
            body_flexibility(body, zone, size, length, along, self.threads)
            for body in (self.gap.slices.lower, self.gap.upper)
        ]


def _check_beside_face(grid: Grid, gap: SliceGap) -> None:
    low, high = gap.window
    if grid.edges[2] >= high or grid.edges[3] <= low:
        raise ContactInputError(
            f"grid from y = {grid.edges[2]:.4g} to {grid.edges[3]:.4g} m lies beside the lower face, which reaches from"
            f" {low:.4g} to {high:.4g} m: move the grid"
        )


def _default_length(gap: SliceGap) -> tuple[float, float]:
    width = gap.window[1] - gap.window[0]
    return -width, width


def _solve(
    problem: _Problem, grid: Grid, window: Window, stations: int, clock: StageClock, attempts: int, cut: bool
) -> SlicePatch:
    """Solve on a grid that is stretched as long as it cuts the patch and attempts are left."""
    low, high, corrections = np.inf, -np.inf, []
    for attempt in range(attempts):
        width = grid.edges[3] - grid.edges[2]
        if grid.edges[2] < low or grid.edges[3] > high:
            low, high = grid.edges[2] - _ZONE * width, grid.edges[3] + _ZONE * width
            corrections = problem.flexibilities(low, high, width / stations, grid.nx * grid.dx)
            clock.stop("sections")
        patch = _solve_on(problem, grid, corrections)
        clock.stop("contact")
        if cut or not _cut(patch, window).any():
            return patch
        if attempt + 1 < attempts:
            grid = widened(grid, patch.pressure, window)
    check_inside(patch.pressure, grid)
    return patch


def _cut(patch: Patch, window: Window) -> np.ndarray:
    """The pressures, without those at the lateral ends of the window: the face itself ends there."""
    inner, slack = patch.pressure.copy(), 1e-6 * patch.grid.dy
    inner[1:-1, 1:-1] = 0.0
    if patch.grid.edges[2] < window[1][0] + slack:
        inner[1:-1, 0] = 0.0
    if patch.grid.edges[3] > window[1][1] - slack:
        inner[1:-1, -1] = 0.0
    return inner


def _solve_on(problem: _Problem, grid: Grid, corrections: list[Flexibility]) -> SlicePatch:
    """Contact on one grid; the gap is taken anew at the approach found until it stays."""
    cosines = problem.cosines(grid.y)
    operator = SliceOperator(grid, problem.pair, corrections, cosines)
    along = _gap_at(problem, grid, problem.approach or 0.0)
    solution = solve_pressure(operator, along, problem.load, problem.approach)
    iterations, change = solution.iterations, 0.0
    for _ in range(_MOST_TURNS if problem.approach is None else 0):
        anew = _gap_at(problem, grid, solution.approach)
        change = _gap_change(along, anew, cosines, solution)
        if change <= _GAP_KEPT:
            break
        along = anew
        solution = solve_pressure(operator, along, problem.load, problem.approach, solution.pressure)
        iterations += solution.iterations
    notes = solution.notes
    if change > _GAP_KEPT:
        notes += (
            f"the gap still changes by {change:.1g} of the deepest closure after it was taken anew {_MOST_TURNS} times:"
            " the bodies slide along each other as far as they close; press along a direction nearer to the face's"
            " normal",
        )
    fields, place = (along * cosines, solution.pressure / cosines, solution.approach), problem.gap.place(grid.y)
    cost = Cost(np.nan, iterations, operator.products)
    return SlicePatch(grid, *fields, "2.5D slices", cost=cost, warnings=notes, modulus=problem.pair.modulus, **place)


def _gap_at(problem: _Problem, grid: Grid, approach: float) -> np.ndarray:
    return gap_values(lambda x, y: problem.gap_along(x, y, approach), grid)


def _gap_change(before: np.ndarray, anew: np.ndarray, cosines: np.ndarray, solution: PressureSolution) -> float:
    """Largest change of the gap where the bodies touch, or would touch now, over the deepest closure there [1]."""
    near = (solution.pressure > 0) | (np.minimum(before, anew) < solution.approach) & np.isfinite(before) & np.isfinite(
        anew
    )
    before, anew, share = before[near], anew[near], np.broadcast_to(cosines, near.shape)[near]
    return float((np.abs(anew - before) * share).max() / ((solution.approach - before) * share).max())


def _estimate(problem: _Problem, fine: SlicePatch, stations: int) -> ErrorEstimate:
    """Changes from doubled cells with doubled station spacing, and from doubled cells there; what the model leaves on
    leaning faces is added."""
    grid = coarse_grid(fine.grid)
    try:
        low, high = grid.edges[2:]
        width = fine.grid.ny * fine.grid.dy
        corrections = problem.flexibilities(
            low - _ZONE * width, high + _ZONE * width, 2 * width / stations, grid.nx * grid.dx
        )
        levels = [fine, _solve_on(problem, grid, corrections), _solve_on(problem, coarse_grid(grid), corrections)]
    except NoContactError:
        return ErrorEstimate()
    normal = [patch.approach if problem.approach is None else patch.normal_force for patch in levels]
    pressure, area, controlled = (
        share * error_bound(*values)
        for share, values in zip(
            _SHARES, zip(*((patch.max_pressure, patch.contact_area, force) for patch, force in zip(levels, normal)))
        )
    )
    leaning = 1 - float(problem.cosines(fine.grid.y[fine.contact.any(axis=0)]).min())
    of_pressure, of_force = (share * leaning for share in _LEANING)
    return ErrorEstimate(
        max_pressure=pressure + of_pressure,
        contact_area=area,
        normal=controlled + of_force,
        note=f"changes from {grid.nx} x {grid.ny} cells and {stations // 2} stations, and from doubled cells there,"
        f" with {of_pressure:.1%} of pressure and {of_force:.1%} of force for a face that leans to the approach",
    )


def _untouched(problem: _Problem, grid: Grid, clock: StageClock) -> SlicePatch:
    values, place = gap_values(problem.gap, grid), problem.gap.place(grid.y)
    clock.stop("positioning")
    patch = SlicePatch(grid, values, np.zeros(grid.shape), float(values.min()), "2.5D slices", **place)
    patch.seconds, patch.cost = clock.seconds, Cost(clock.seconds["positioning"], 0, 0)
    patch.warnings = ("load 0 N: the bodies touch without pressure, the patch is empty",)
    return patch
