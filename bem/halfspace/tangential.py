"""Tangential contact of two elastic half-spaces by the full theory: a shift (Cattaneo) and steady rolling.

Both take a solved normal contact (bem/halfspace/normal.py, or any patch that carries gap and pressure) and return the
patch with tractions, stick and slip. Where the materials differ (coupling K of bem/halfspace/influence.py) pressure
moves the surfaces sideways and tractions move them apart: normal and tangential problem are then solved in turn until
the pressure stays (Panagiotopoulos). Creepages or forces may be given, along each axis one of them.
Source: Kalker (1990), chapters 2 to 5; Panagiotopoulos, Ingenieur-Archiv 44 (1975) 421.
Error: tractions and forces of first order in the cell (tests/bem/test_halfspace_rolling.py, test_halfspace_shift.py).
So is the spin moment, but where it nearly vanishes: of an ellipse nine times as long as wide at little spin it is three
times too large with 24 cells, twice with 48.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from bem.checks import refuse_unless_positive
from bem.creepage import LocalCreepage
from bem.halfspace.coarse import FORCE_STAIRS, coarse_field, coarse_grid, edge_share, error_bound
from bem.halfspace.friction import FrictionSolution, TangentialOperator, rolled_step, solve_friction
from bem.halfspace.influence import backward, forward, kernel_spectrum, padded_shape
from bem.halfspace.input import check_creepage, check_force, check_friction, check_rolling, check_shift, contact_bounds
from bem.halfspace.pressure import NormalOperator, solve_pressure
from bem.material import Elastic, Pair
from bem.patch import HALF_SPACE, ContactInputError, Cost, Creepage, ErrorEstimate, Grid, Patch
from bem.renamed import renamed

Force = tuple[float | None, float | None]

_MAX_TURNS = 60
_COARSEST_CELLS = 6
_ROUND_OFF = 1e-12  # of mu N, below which a tangential force is none
# of the changes between the grids that is taken for the error (bem/verification/estimates_study.py): first order,
_SHARE_ROLLING = 1.6
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
    check_rolling(direction)
    if isinstance(creepage, LocalCreepage) and force[1] is not None:
        raise ContactInputError(
            f"lateral force {force[1]!r} N with strips of their own normals: each takes another part of a lateral slip;"
            " give the creepages, and look for the motion that gives the force"
        )
    notes = check_friction(friction) + check_creepage(creepage, contact_bounds(patch))
    problem = _Problem.of(patch, Pair.of(upper, lower), friction, creepage, force, direction, tolerance)
    return _solve(patch, problem, estimate, patch.method == HALF_SPACE, notes)


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
    check_shift(shift, contact_bounds(patch))
    problem = _Problem.of(patch, Pair.of(upper, lower), friction, shift, force, 0, tolerance)
    if previous is not None:
        before = np.moveaxis(previous.traction, -1, 0)
        problem = replace(problem, traction_before=before, pressure_before=previous.pressure)
    return _solve(patch, problem, estimate, patch.method == HALF_SPACE and previous is None, notes)


@dataclass
class _Problem:
    """One tangential problem on one grid, rolling along direction * x, or a shift (0)."""

    pair: Pair
    grid: Grid
    gap: np.ndarray | None
    pressure: np.ndarray
    approach: float
    friction: float
    motion: Creepage | LocalCreepage
    force: Force
    direction: int
    tolerance: float
    traction_before: np.ndarray | None = None
    pressure_before: np.ndarray | None = None

    @classmethod
    def of(cls, patch: Patch, pair: Pair, friction: float, motion, force: Force, direction: int, tolerance: float):
        """On a patch; refuses a force that friction cannot carry, and other bodies than the patch's."""
        patch.refuse_other_modulus(pair.modulus)
        check_force(force, friction * patch.normal_force)
        refuse_unless_positive(ContactInputError, tolerance=tolerance)
        place = patch.grid, patch.gap, patch.pressure, patch.approach
        return cls(pair, *place, friction, motion, (force[0], force[1]), direction, tolerance)


def _solve(patch: Patch, problem: _Problem, estimate: bool, own_pressure: bool, notes: tuple[str, ...]) -> Patch:
    started, friction, motion = time.perf_counter(), problem.friction, problem.motion
    solution, turned, turns = _turns(problem)
    error = replace(patch.error, tangential_force=np.nan)  # one that has rolled before holds that of then
    error = _estimate(problem, solution, turned, error, own_pressure) if estimate else error
    notes += _convergence_notes(solution, turns, problem.tolerance)
    if estimate and np.isnan(error.tangential_force) and solution.traction.any():
        notes += (
            f"error of the tangential force not estimated: it vanishes, or the patch is under {2 * _COARSEST_CELLS}"
            " cells across; refine the grid",
        )
    moved, (_, _, low, high) = motion.added(*map(float, solution.rigid)), contact_bounds(patch)
    cost = patch.cost + Cost(time.perf_counter() - started, solution.iterations, 2 * solution.iterations + 1)
    return replace(
        patch, pressure=turned.pressure, approach=turned.approach, traction=_last(solution.traction),
        slip=_last(solution.slip), stick=solution.stick, friction=friction, creepage=moved.about((low + high) / 2),
        cost=cost, error=error, warnings=patch.warnings + notes,
        local_creepage=moved if isinstance(moved, LocalCreepage) else None,
    )  # fmt: skip


def _last(field: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(np.moveaxis(field, 0, -1))


def _rigid_slip(problem: _Problem) -> np.ndarray:
    """(2, nx, ny) rigid slip; in rolling a quarter of a cell ahead of the cells' centres.

    The elastic slip is measured from centre to centre, half a cell ahead of the tractions. As in lattices of
    singularities (Pistolesi's quarter-point rule) the edge without traction then acts a quarter of a cell ahead of the
    last such position:
    the solved patch lies a quarter of a cell ahead of the given one, which this takes back. Measured: at 24 cells the
    force of pure spin is off by 0.3 % so, by 3 % with the slip at the centres or half a cell ahead.
    """
    x, y = problem.grid.points()
    return problem.motion.rigid_slip(x + problem.direction * problem.grid.dx / 4, y)


def _turns(problem: _Problem) -> tuple[FrictionSolution, _Problem, int]:
    """Tangential problem; for unlike materials normal and tangential problem in turn. Returns the turns taken, or
    -1."""
    pair = problem.pair
    if pair.coupling == 0 or problem.friction == 0:
        return _tangential(problem), problem, 1
    if problem.gap is None:
        raise ContactInputError(
            "unlike materials: the normal problem is solved anew, so the patch must carry its gap (normal_contact)"
        )
    coupling = CouplingOperator(problem.grid, pair)
    operator = NormalOperator(problem.grid, pair)
    load = problem.pressure.sum() * problem.grid.cell_area
    solution = _tangential(problem, coupling)
    for turn in range(1, _MAX_TURNS + 1):
        if turn > 1:
            again = _tangential(problem, coupling, solution)
            solution = replace(again, iterations=solution.iterations + again.iterations)
        if not (problem.pressure > 0).any():
            return solution, problem, turn
        moved = problem.gap + coupling.normal_displacement(solution.traction)
        normal = solve_pressure(operator, moved, load, start=problem.pressure)
        change = np.linalg.norm(normal.pressure - problem.pressure) / np.linalg.norm(normal.pressure)
        # the pressure that bounds these tractions, not the one that follows
        solved = replace(problem, approach=normal.approach)
        if change < 10 * problem.tolerance:
            return solution, solved, turn
        problem = replace(problem, pressure=normal.pressure, approach=normal.approach)
    return solution, solved, -1


def _tangential(
    problem: _Problem, coupling: CouplingOperator | None = None, last: FrictionSolution | None = None
) -> FrictionSolution:
    """Friction for the present pressure, on the box of the patch (of both steps' patches)."""
    box = _box(problem)
    shape = problem.grid.shape
    counts = (part.stop - part.start for part in box)
    grid = Grid(problem.grid.x[box[0]][0], problem.grid.y[box[1]][0], problem.grid.dx, problem.grid.dy, *counts)
    operator = TangentialOperator(grid, problem.pair, problem.direction)
    slip = _rigid_slip(problem)
    if coupling is not None:
        before = 0.0 if problem.pressure_before is None else problem.pressure_before
        slip += coupling.tangential_motion(problem.pressure - before, problem.direction)
    slip = slip[:, box[0], box[1]]
    if problem.traction_before is not None:
        slip = slip - operator.product(problem.traction_before[:, box[0], box[1]])
    bound = problem.friction * problem.pressure[box]
    along, across = (None if value is None else value / problem.grid.cell_area for value in problem.force)
    start = slide_start(operator, slip, bound) if last is None else last.traction[:, box[0], box[1]]
    solution = solve_friction(operator, slip, bound, (along, across), start, problem.tolerance)
    embedded = {name: _embed(getattr(solution, name), box, shape) for name in ("traction", "slip", "stick")}
    return replace(solution, **embedded)


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

    def tangential_motion(self, pressure: np.ndarray, direction: int) -> np.ndarray:
        """(2, nx, ny) displacement difference [m] by pressure, or in rolling its slip per metre [1]."""
        spectrum = -forward(pressure, self.size) * rolled_step(self.size[0], self.grid.dx, direction)
        return np.stack(
            [backward(kernel * spectrum, self.grid.shape, self.size) for kernel in (self.along, self.across)]
        )


def _estimate(
    problem: _Problem, fine: FrictionSolution, turned: _Problem, error: ErrorEstimate, own_pressure: bool
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
    if not given and np.hypot(*found[0]) < _ROUND_OFF * problem.friction * turned.pressure.sum():
        return error
    for _ in range(2):
        level = _coarsened(level)
        coupling = None if level.pair.coupling == 0 else CouplingOperator(level.grid, level.pair)
        share = 1.0 if given else level.grid.cell_area / turned.grid.cell_area
        found.append(quantity(_tangential(level, coupling)) * share)
    of_cells, doubled, fourfold = found
    bound = (
        _SHARE_ROLLING * error_bound(of_cells, doubled, fourfold, 1, edge_share(turned.pressure, FORCE_STAIRS))
        if problem.direction
        else _SHARE_SHIFT * error_bound(of_cells, doubled, fourfold)
    )
    return replace(
        error,
        tangential_force=bound,
        note=f"changes from doubled and fourfold cell sides{'; tangential: of the rigid slip found' if given else ''}",
    )


def _coarsened(problem: _Problem) -> _Problem:
    """The problem at doubled cell sides; its pressure solved there where the gap is known, else means over the fine
    cells."""
    grid, before, gap = coarse_grid(problem.grid), problem.traction_before, problem.gap
    pressure = coarse_field(problem.pressure, "constant")
    if gap is not None:
        gap = coarse_field(gap)
        pressure = solve_pressure(
            NormalOperator(grid, problem.pair), gap, pressure.sum() * grid.cell_area, start=pressure, tolerance=1e-5
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
