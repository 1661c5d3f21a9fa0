"""Tangential contact of two elastic half-spaces by the full theory: a shift (Cattaneo) and steady rolling.

Both take a solved normal contact (bem/halfspace/normal.py, or any patch that carries gap and pressure) and return the
patch with tractions, stick and slip. Where the materials differ (coupling K of bem/halfspace/influence.py) pressure
moves the surfaces sideways and tractions move them apart: normal and tangential problem are then solved in turn until
the pressure stays (Panagiotopoulos). Creepages or forces may be given, along each axis one of them.
Source: Kalker (1990), chapters 2 to 5; Panagiotopoulos, Ingenieur-Archiv 44 (1975) 421.
Error: tractions and forces of first order in the cell (tests/bem/test_halfspace_rolling.py, test_halfspace_shift.py).
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from bem.creepage import LocalCreepage
from bem.halfspace.coarse import FORCE_STAIRS, coarse_field, coarse_grid, edge_share, error_bound
from bem.halfspace.friction import FrictionSolution, TangentialOperator, solve_friction
from bem.halfspace.influence import backward, forward, kernel_spectrum, padded_shape
from bem.halfspace.input import check_creepage, check_force, check_friction, check_shift
from bem.halfspace.pressure import NormalOperator, solve_pressure
from bem.material import Elastic, Pair
from bem.patch import HALF_SPACE, ContactInputError, Cost, Creepage, ErrorEstimate, Grid, Patch
from bem.renamed import renamed

Force = tuple[float | None, float | None]

_MAX_TURNS = 60
_COARSEST_CELLS = 6
# of the changes between the grids that is taken for the error (bem/verification/estimates_study.py): first order,
_SHARE_ROLLING = 1.2
_SHARE_SHIFT = 0.6  # and nearly second


@renamed(first="upper", second="lower")
def rolling_contact(
    patch: Patch,
    upper: Elastic,
    lower: Elastic,
    friction: float,
    creepage: Creepage | LocalCreepage = Creepage(),
    force: Force = (None, None),
    *,
    direction: int = 1,
    tolerance: float = 1e-5,
    estimate: bool = True,
) -> Patch:
    """Steady rolling along direction * x with Coulomb friction.

    Parameters
    ----------
    patch : Patch
        Of `normal_contact`; the normal load is kept.
    upper, lower : Elastic
        Bodies 1 and 2.
    friction : float
        Coefficient [1].
    creepage : Creepage or LocalCreepage
        Rigid slip of the upper body over the lower one per rolling speed (a positive number whatever the direction); on
        a patch laid along a curved face each strip's own (bem/creepage.py).
    force : (float or None, float or None)
        On the upper body along x and y [N]; where a number, the creepage along that axis is what comes out, added to
        the given.
    direction : {1, -1}
        Where along x the leading edge lies.
    tolerance : float
        Of the tractions, relative.
    estimate : bool
        Also solve at doubled cell sides, for the error estimate.

    Returns
    -------
    Patch
        With traction [Pa], slip per metre rolled [1], stick.

    Raises
    ------
    ContactInputError
        For what no solver can answer, with what to do.

    Examples
    --------
    >>> window = (-0.01, 0.01), (-0.01, 0.01)
    >>> sphere = lambda x, y: (x**2 + y**2) / 0.6
    >>> patch = bem.normal_contact(sphere, bem.STEEL, bem.STEEL, load=50e3, window=window, cells=24)
    >>> creepage = bem.Creepage(longitudinal=1e-3)
    >>> rolled = bem.rolling_contact(patch, bem.STEEL, bem.STEEL, friction=0.3, creepage=creepage)
    >>> 0.0 < abs(float(rolled.tangential_force[0])) < 0.3 * 50e3  # [N]
    True
    """
    if direction not in (1, -1):
        raise ContactInputError(f"direction {direction!r}: give +1 or -1")
    if isinstance(creepage, LocalCreepage) and force[1] is not None:
        raise ContactInputError(
            f"lateral force {force[1]!r} N with strips of their own normals: each takes another part of a lateral slip;"
            " give the creepages, and look for the motion that gives the force"
        )
    notes = check_friction(friction) + check_creepage(creepage, _bounds(patch))
    return _solve(patch, Pair.of(upper, lower), friction, creepage, force, None, direction, tolerance, estimate, notes)


@renamed(first="upper", second="lower")
def shift_contact(
    patch: Patch,
    upper: Elastic,
    lower: Elastic,
    friction: float,
    shift: Creepage = Creepage(),
    force: Force = (None, None),
    *,
    previous: Patch | None = None,
    tolerance: float = 1e-5,
    estimate: bool = True,
) -> Patch:
    """Shift of the upper body over the lower one under load, with Coulomb friction: one step, or the next one.

    Loads that grow together with a shift, or unlike materials pressed together, must be stepped: Coulomb's law
    remembers the path.

    Parameters
    ----------
    patch : Patch
        Of `normal_contact`.
    upper, lower : Elastic
        Bodies 1 and 2.
    friction : float
        Coefficient [1].
    shift : Creepage
        Rigid displacements [m] and rotation [1] of this step.
    force : (float or None, float or None)
        On the upper body along x and y [N]; where a number, the shift along that axis is what comes out, added to the
        given.
    previous : Patch, optional
        At the end of the step before, on the same grid; None starts from bodies without tractions.
    tolerance : float
        Of the tractions, relative.
    estimate : bool
        Also solve at doubled cell sides, for the error estimate.

    Returns
    -------
    Patch
        With traction [Pa], slip in this step [m], stick.

    Raises
    ------
    ContactInputError
        For what no solver can answer, with what to do.

    Examples
    --------
    >>> window = (-0.01, 0.01), (-0.01, 0.01)
    >>> sphere = lambda x, y: (x**2 + y**2) / 0.6
    >>> patch = bem.normal_contact(sphere, bem.STEEL, bem.STEEL, load=50e3, window=window, cells=24)
    >>> shifted = bem.shift_contact(patch, bem.STEEL, bem.STEEL, friction=0.3, force=(5e3, None))
    >>> round(float(shifted.tangential_force[0]))  # [N]
    5000
    """
    if previous is not None and (previous.grid != patch.grid or previous.traction is None):
        raise ContactInputError("previous: needs a patch with tractions on the same grid")
    notes = check_friction(friction)
    check_shift(shift, _bounds(patch))
    return _solve(patch, Pair.of(upper, lower), friction, shift, force, previous, 0, tolerance, estimate, notes)


def _bounds(patch: Patch) -> tuple[float, float, float, float]:
    """Bounds of the cells in contact [m]; of the grid where none is."""
    if not patch.contact.any():
        return patch.grid.edges
    x, y = patch.grid.x[patch.contact.any(axis=1)], patch.grid.y[patch.contact.any(axis=0)]
    return float(x[0]), float(x[-1]), float(y[0]), float(y[-1])


@dataclass
class _Problem:
    """One tangential problem on one grid, rolling towards +x (direction 1), or a shift (0)."""

    grid: Grid
    gap: np.ndarray | None
    pressure: np.ndarray
    approach: float
    friction: float
    motion: Creepage | LocalCreepage
    force: Force
    rolling: bool
    traction_before: np.ndarray | None
    pressure_before: np.ndarray | None


def _solve(
    patch: Patch,
    pair: Pair,
    friction: float,
    motion: Creepage | LocalCreepage,
    force: Force,
    previous: Patch | None,
    direction: int,
    tolerance: float,
    estimate: bool,
    notes: tuple[str, ...],
) -> Patch:
    started = time.perf_counter()
    force = force[0], force[1]
    check_force(force, friction * patch.normal_force)
    problem = _Problem(
        patch.grid,
        patch.gap,
        patch.pressure,
        patch.approach,
        friction,
        motion,
        force,
        direction != 0,
        *(_before(previous)),
    )
    if direction < 0:
        problem = _mirrored(problem)
    solution, turned, turns = _turns(problem, pair, tolerance)
    own = patch.method == HALF_SPACE and previous is None
    error = _estimate(problem, solution, turned, pair, patch.error, tolerance, own) if estimate else patch.error
    found = solution.rigid * [1 if direction >= 0 else -1, 1]
    notes += _convergence_notes(solution, turns, tolerance)
    if estimate and np.isnan(error.tangential_force) and solution.traction.any():
        notes += (
            f"error of the tangential force not estimated: the patch is under {2 * _COARSEST_CELLS} cells across;"
            " refine the grid",
        )
    if direction < 0:
        solution = replace(
            solution, traction=_flip(solution.traction), slip=_flip(solution.slip), stick=solution.stick[::-1]
        )
        turned = replace(turned, pressure=turned.pressure[::-1])
    moved, (_, _, low, high) = motion.added(*map(float, found)), _bounds(patch)
    return Patch(
        patch.grid,
        patch.gap,
        turned.pressure,
        turned.approach,
        patch.method,
        _last(solution.traction),
        _last(solution.slip),
        solution.stick,
        friction,
        moved.about((low + high) / 2),
        patch.cost + Cost(time.perf_counter() - started, solution.iterations, 2 * solution.iterations + 1),
        error,
        patch.warnings + notes,
        moved if isinstance(moved, LocalCreepage) else None,
    )


def _before(previous: Patch | None):
    return (None, None) if previous is None else (np.moveaxis(previous.traction, -1, 0), previous.pressure)


def _last(field: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(np.moveaxis(field, 0, -1))


def _flip(field: np.ndarray) -> np.ndarray:
    """A vector field (2, nx, ny) seen in the mirror x -> -x."""
    return np.stack([-field[0, ::-1], field[1, ::-1]])


def _mirrored(problem: _Problem) -> _Problem:
    grid, motion = problem.grid, problem.motion
    x_force = None if problem.force[0] is None else -problem.force[0]
    gap = None if problem.gap is None else problem.gap[::-1]
    return replace(
        problem,
        grid=replace(grid, x_first=-grid.x[-1]),
        gap=gap,
        pressure=problem.pressure[::-1],
        motion=motion.mirrored(),
        force=(x_force, problem.force[1]),
    )


def _rigid_slip(problem: _Problem) -> np.ndarray:
    """(2, nx, ny) rigid slip; in rolling a quarter of a cell ahead of the cells' centres.

    The elastic slip is measured from centre to centre, half a cell ahead of the tractions. As in lattices of
    singularities (Pistolesi's quarter-point rule) the edge without traction then acts a quarter of a cell ahead of the
    last such position:
    the solved patch lies a quarter of a cell ahead of the given one, which this takes back. Measured: at 24 cells the
    force of pure spin is off by 0.3 % so, by 3 % with the slip at the centres or half a cell ahead.
    """
    x, y = problem.grid.points()
    if problem.rolling:
        x = x + problem.grid.dx / 4
    return problem.motion.rigid_slip(x, y)


def _turns(problem: _Problem, pair: Pair, tolerance: float) -> tuple[FrictionSolution, _Problem, int]:
    """Tangential problem; for unlike materials normal and tangential problem in turn. Returns the turns taken, or
    -1."""
    if pair.coupling == 0 or problem.friction == 0:
        return _tangential(problem, pair, None, None, tolerance), problem, 1
    if problem.gap is None:
        raise ContactInputError(
            "unlike materials: the normal problem is solved anew, so the patch must carry its gap (normal_contact)"
        )
    coupling = CouplingOperator(problem.grid, pair)
    operator = NormalOperator(problem.grid, pair)
    load = problem.pressure.sum() * problem.grid.cell_area
    solution = _tangential(problem, pair, coupling, None, tolerance)
    for turn in range(1, _MAX_TURNS + 1):
        if turn > 1:
            again = _tangential(problem, pair, coupling, solution, tolerance)
            solution = replace(again, iterations=solution.iterations + again.iterations)
        if not (problem.pressure > 0).any():
            return solution, problem, turn
        moved = problem.gap + coupling.normal_displacement(solution.traction)
        normal = solve_pressure(operator, moved, load, start=problem.pressure)
        change = np.linalg.norm(normal.pressure - problem.pressure) / np.linalg.norm(normal.pressure)
        # the pressure that bounds these tractions, not the one that follows
        solved = replace(problem, approach=normal.approach)
        if change < 10 * tolerance:
            return solution, solved, turn
        problem = replace(problem, pressure=normal.pressure, approach=normal.approach)
    return solution, solved, -1


def _tangential(
    problem: _Problem, pair: Pair, coupling: CouplingOperator | None, last: FrictionSolution | None, tolerance: float
) -> FrictionSolution:
    """Friction for the present pressure, on the box of the patch (of both steps' patches)."""
    box = _box(problem)
    shape = problem.grid.shape
    grid = Grid(
        problem.grid.x[box[0]][0],
        problem.grid.y[box[1]][0],
        problem.grid.dx,
        problem.grid.dy,
        box[0].stop - box[0].start,
        box[1].stop - box[1].start,
    )
    operator = TangentialOperator(grid, pair, problem.rolling)
    slip = _rigid_slip(problem)
    if coupling is not None:
        before = 0.0 if problem.pressure_before is None else problem.pressure_before
        slip += coupling.tangential_motion(problem.pressure - before, problem.rolling)
    slip = slip[:, box[0], box[1]]
    if problem.traction_before is not None:
        slip = slip - operator.product(problem.traction_before[:, box[0], box[1]])
    bound = problem.friction * problem.pressure[box]
    along, across = (None if value is None else value / problem.grid.cell_area for value in problem.force)
    start = slide_start(operator, slip, bound) if last is None else last.traction[:, box[0], box[1]]
    solution = solve_friction(operator, slip, bound, (along, across), start, tolerance)
    return replace(
        solution,
        traction=_embed(solution.traction, box, shape),
        slip=_embed(solution.slip, box, shape),
        stick=_embed(solution.stick, box, shape),
    )


def slide_start(operator: TangentialOperator, slip: np.ndarray, bound: np.ndarray) -> np.ndarray:
    """Tractions to start from: full sliding, lowered where the elastic slip of that would exceed the rigid slip."""
    length = np.hypot(slip[0], slip[1])
    traction = -bound * slip / np.where(length > 0, length, 1.0)
    rigid, elastic = abs((slip * traction).sum()), abs((operator.product(traction) * traction).sum())
    return traction * min(1.0, rigid / elastic) if elastic > 0 else traction


def _box(problem: _Problem) -> tuple[slice, slice]:
    used = problem.pressure > 0
    if problem.traction_before is not None:
        used = used | (problem.traction_before != 0).any(axis=0)
    if not used.any():
        return slice(0, 1), slice(0, 1)
    rows, columns = np.flatnonzero(used.any(axis=1)), np.flatnonzero(used.any(axis=0))
    return slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)


def _embed(field: np.ndarray, box: tuple[slice, slice], shape: tuple[int, int]) -> np.ndarray:
    whole = np.zeros((*field.shape[:-2], *shape), field.dtype)
    whole[..., box[0], box[1]] = field
    return whole


class CouplingOperator:
    """What unlike materials add: sideways displacement by pressure, opening by tractions (K of
    bem/halfspace/influence.py)."""

    def __init__(self, grid: Grid, pair: Pair) -> None:
        self.grid = grid
        along, across = kernel_spectrum("x/r2", grid), kernel_spectrum("y/r2", grid)
        self.size = padded_shape(*grid.shape)
        scale = pair.coupling / (np.pi * pair.shear)
        self.along, self.across = scale * along, scale * across

    def normal_displacement(self, traction: np.ndarray) -> np.ndarray:
        """(nx, ny) opening [m] by tractions (2, nx, ny) [Pa] on body 1."""
        spectrum = self.along * forward(traction[0], self.size) + self.across * forward(traction[1], self.size)
        return backward(spectrum, self.grid.shape, self.size)

    def tangential_motion(self, pressure: np.ndarray, rolling: bool) -> np.ndarray:
        """(2, nx, ny) displacement difference [m] by pressure, or in rolling its slip per metre [1]."""
        spectrum = -forward(pressure, self.size)
        if rolling:
            wave = 2 * np.pi * np.arange(self.size[0]) / self.size[0]
            spectrum *= ((1 - np.exp(1j * wave)) / self.grid.dx)[:, None]
        return np.stack(
            [backward(kernel * spectrum, self.grid.shape, self.size) for kernel in (self.along, self.across)]
        )


def _estimate(
    problem: _Problem,
    fine: FrictionSolution,
    turned: _Problem,
    pair: Pair,
    error: ErrorEstimate,
    tolerance: float,
    own_pressure: bool,
) -> ErrorEstimate:
    """The same problem at doubled and at fourfold cell sides; own_pressure: the patch is this half-space's, so that
    they have theirs."""
    box = _box(turned)
    if problem.friction == 0 or not (turned.pressure > 0).any():
        return error
    if min(box[0].stop - box[0].start, box[1].stop - box[1].start) < 2 * _COARSEST_CELLS:
        return error
    given = any(value is not None for value in problem.force)
    quantity = lambda solution: solution.rigid if given else solution.traction.sum(axis=(1, 2))
    found, level = [quantity(fine)], turned if own_pressure else replace(turned, gap=None)
    for _ in range(2):
        level = _coarsened(level, pair)
        coupling = None if pair.coupling == 0 else CouplingOperator(level.grid, pair)
        share = 1.0 if given else level.grid.cell_area / turned.grid.cell_area
        found.append(quantity(_tangential(level, pair, coupling, None, tolerance)) * share)
    of_cells, doubled, fourfold = found
    bound = (
        _SHARE_ROLLING * error_bound(of_cells, doubled, fourfold, 1, edge_share(turned.pressure, FORCE_STAIRS))
        if problem.rolling
        else _SHARE_SHIFT * error_bound(of_cells, doubled, fourfold)
    )
    return replace(
        error,
        tangential_force=bound,
        note=f"changes from doubled and fourfold cell sides{'; tangential: of the rigid slip found' if given else ''}",
    )


def _coarsened(problem: _Problem, pair: Pair) -> _Problem:
    """The problem at doubled cell sides; its pressure solved there where the gap is known, else means over the fine
    cells."""
    grid, before, gap = coarse_grid(problem.grid), problem.traction_before, problem.gap
    pressure = coarse_field(problem.pressure, "constant")
    if gap is not None:
        gap = coarse_field(gap)
        pressure = solve_pressure(
            NormalOperator(grid, pair), gap, pressure.sum() * grid.cell_area, start=pressure, tolerance=1e-5
        ).pressure
    return replace(
        problem,
        grid=grid,
        gap=gap,
        pressure=pressure,
        traction_before=None if before is None else np.stack([coarse_field(part, "constant") for part in before]),
        pressure_before=None if before is None else coarse_field(problem.pressure_before, "constant"),
    )


def _convergence_notes(solution: FrictionSolution, turns: int, tolerance: float) -> tuple[str, ...]:
    notes: tuple[str, ...] = ()
    if solution.residual > tolerance:
        notes += (
            f"friction not converged: residual {solution.residual:.1e} of the tractions after {solution.iterations}"
            " iterations",
        )
    if turns < 0:
        notes += (f"normal and tangential problem still change each other after {_MAX_TURNS} turns",)
    return notes
