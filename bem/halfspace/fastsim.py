"""FASTSIM: Kalker's simplified theory of rolling contact on any patch, and on a Hertz ellipse.

The surface is a bed of springs: u = L q in every point, so that each row of cells along x is marched from its leading
edge: q grows by -(rigid slip) / L per length. While it sticks, longitudinal and lateral creepage and spin have each a
flexibility of their own, those with which an elliptic patch without slip has the forces of Kalker's linear theory:
L1 = 8a/(3 G C11), L2 = 8a/(3 G C22), L3 = pi a sqrt(a/b)/(4 G C23). Where that exceeds the friction bound the cell
slides, and there the bed has one flexibility, the mean of the three weighted by |longitudinal|, |lateral| and
|spin| sqrt(ab): only then is the traction opposite to the slip, and in full sliding opposite to the rigid slip. (Three
flexibilities in the slip zone too, as FASTSIM was first written, turn it by up to 6 degrees at a/b from 0.5 to 2.)
For a patch of another shape they come from the equivalent ellipse: the one of the same area and of the same ratio of
second moments of area about its centre, for each connected part by itself; spin is about the part's centre there.
Bound "parabolic": mu p^2 scaled to the part's mu N (the paraboloid of the simplified theory on an ellipse, which goes
with these flexibilities); "elliptic": mu p itself.
Third body (dirt, water, wear debris): all flexibilities over `initial_slope` (0 to 1], so that creep forces begin with
that part of Kalker's slope and still end at mu N. Friction that changes with slip:
bem/halfspace/slip_dependent_friction.py.
Error: against the theory it discretises second order in the cell; against the full theory usually below 0.06 mu N in
force (tests/bem/test_fastsim.py). The spin moment is not to be trusted. Cost: 1 ms at 44 x 44 cells.
Source: Kalker, Vehicle System Dynamics 11 (1982) 1; Kalker (1990), section 3.7 (with the weighted mean, there for all
of the patch); errata: the bound holds mu.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from bem.creepage import LocalCreepage
from bem.exact.kalker import CreepageCoefficients
from bem.exact.kalker_table import coefficients
from bem.halfspace.coarse import FORCE_STAIRS, coarse_field, coarse_grid, edge_share, error_bound
from bem.halfspace.input import check_creepage, check_rolling, contact_bounds, friction_law
from bem.halfspace.slip_dependent_friction import LEAST, SlipDependentFriction, share_after, sliding_share
from bem.material import Elastic, Pair
from bem.patch import ContactInputError, Cost, Creepage, ErrorEstimate, Grid, Patch
from bem.patch_edge import cells_to_edge, covered_area
from bem.renamed import renamed
from kernel_cache import njit

_SHARE = 0.85  # of the changes between the grids that is taken for the error (bem/verification/estimates_study.py)


def elliptic_patch(semi_x: float, semi_y: float, load: float, cells: tuple[int, int] = (44, 44)) -> Patch:
    """Patch of a Hertz ellipse: semi-axes along x and y [m], load [N]; the cell pressures sum to the load."""
    if not (np.isfinite([semi_x, semi_y, load]).all() and semi_x > 0 and semi_y > 0 and load >= 0):
        raise ContactInputError(
            f"ellipse {semi_x!r} x {semi_y!r} m under {load!r} N: give finite numbers, axes > 0, load >= 0"
        )
    grid = Grid.over((-semi_x, semi_x), (-semi_y, semi_y), *cells)
    x, y = grid.points()
    pressure = np.sqrt(np.maximum(1 - (x / semi_x) ** 2 - (y / semi_y) ** 2, 0.0))
    pressure *= load / (pressure.sum() * grid.cell_area)
    return Patch(grid, None, pressure, np.nan, "Hertz ellipse")


def flexibilities(
    semi_x: float, semi_y: float, pair: Pair, c: CreepageCoefficients | None = None
) -> tuple[float, float, float]:
    """L1, L2, L3 [m/Pa] of an ellipse with semi-axes along x and y [m]; of rows of them, rows."""
    c = c or coefficients(semi_x / semi_y, pair.poisson)
    return (
        8 * semi_x / (3 * pair.shear * c.c11),
        8 * semi_x / (3 * pair.shear * c.c22),
        np.pi * semi_x * np.sqrt(semi_x / semi_y) / (4 * pair.shear * c.c23),
    )


def sliding_flexibility(flexibility: np.ndarray, slip: np.ndarray, size: np.ndarray | float) -> np.ndarray:
    """(...,) the mean of L1, L2, L3 (..., 3) [m/Pa] weighted by |longitudinal|, |lateral| and |spin| `size` of slips
    (..., 3), of which size (...,) is sqrt(ab) [m]."""
    weights = np.abs(slip) * np.stack(np.broadcast_arrays(1.0, 1.0, size), axis=-1)
    weights = np.where(weights.any(axis=-1, keepdims=True), weights, 1.0)
    return (flexibility * weights).sum(axis=-1) / weights.sum(axis=-1)


def equivalent_ellipse(grid: Grid, pressure: np.ndarray) -> tuple[float, float, float, float]:
    """(semi_x, semi_y, x, y) [m] of the ellipse with the patch's area, centre and ratio of second moments of area."""
    x, y = (positions[pressure > 0] for positions in grid.points())
    ratio = np.sqrt((x.var() + grid.dx**2 / 12) / (y.var() + grid.dy**2 / 12))
    radius = np.sqrt(covered_area(grid, pressure) / np.pi)
    return radius * np.sqrt(ratio), radius / np.sqrt(ratio), float(x.mean()), float(y.mean())


@renamed(first="upper", second="lower")
def fastsim(
    patch: Patch,
    upper: Elastic,
    lower: Elastic,
    friction: float | SlipDependentFriction,
    creepage: Creepage | LocalCreepage,
    *,
    bound: str = "parabolic",
    direction: int = 1,
    estimate: bool = True,
    initial_slope: float = 1.0,
) -> Patch:
    """Tractions, stick and slip of a solved normal contact by the simplified theory.

    Parameters
    ----------
    patch : Patch
        Of `normal_contact`.
    upper, lower : Elastic
        Bodies 1 and 2.
    friction : float or SlipDependentFriction
        Coefficient, or one that changes with slip; the patch's `friction` is then that without slip.
    creepage : Creepage or LocalCreepage
        Rigid slip of the upper body over the lower one per rolling speed, about x = y = 0; of a curved patch each
        strip's own.
    bound : {"parabolic", "elliptic"}
        See the module's head.
    direction : {1, -1}
        Where along x the leading edge lies.
    estimate : bool
        Also solve at doubled cell sides, for the error estimate.
    initial_slope : float
        Third-body reduction of the slope at small creepage, above 0, at most 1.

    Returns
    -------
    Patch
        With traction [Pa], slip per metre rolled [1] and stick.

    Raises
    ------
    ContactInputError
        For what is out of range, with what to give.

    Examples
    --------
    >>> window = (-0.01, 0.01), (-0.01, 0.01)
    >>> sphere = lambda x, y: (x**2 + y**2) / 0.6
    >>> patch = bem.normal_contact(sphere, bem.STEEL, bem.STEEL, load=50e3, window=window, cells=32)
    >>> rolled = bem.fastsim(patch, bem.STEEL, bem.STEEL, friction=0.3, creepage=bem.Creepage(longitudinal=0.05))
    >>> round(abs(float(rolled.tangential_force[0])) / 50e3, 3)  # all of it slides
    0.3
    """
    if bound not in ("parabolic", "elliptic"):
        raise ContactInputError(f"bound {bound!r}: give 'parabolic' or 'elliptic'")
    check_rolling(direction, initial_slope)
    started = time.perf_counter()
    law, notes = friction_law(friction)
    reach = contact_bounds(patch)
    notes += check_creepage(creepage, reach)
    pair = Pair.of(upper, lower)
    patch.refuse_other_modulus(pair.modulus)
    solve = lambda grid, pressure: _tractions(grid, pressure, pair, law, creepage, bound, direction, initial_slope)
    traction, slip, stick = solve(patch.grid, patch.pressure)
    error = replace(patch.error, tangential_force=np.nan)
    error = _estimate(patch, traction, solve) if estimate and law.static > 0 else error
    cost = patch.cost + Cost(time.perf_counter() - started, 1, 0)
    return replace(
        patch, method=f"FASTSIM ({bound} bound) on {patch.method}", traction=traction, slip=slip, stick=stick,
        friction=law.static, creepage=creepage.about((reach[2] + reach[3]) / 2), cost=cost, error=error,
        warnings=patch.warnings + notes,
        local_creepage=creepage if isinstance(creepage, LocalCreepage) else None,
    )  # fmt: skip


def _tractions(
    grid: Grid,
    pressure: np.ndarray,
    pair: Pair,
    law: SlipDependentFriction,
    creepage: Creepage | LocalCreepage,
    bound: str,
    direction: int,
    initial_slope: float,
):
    labels, count = ndimage.label(pressure > 0, structure=np.ones((3, 3)))
    limit = law.static * pressure
    rates = np.zeros((count + 1, grid.ny if isinstance(creepage, LocalCreepage) else 1, 9))
    for part in range(1, count + 1):
        own = np.where(labels == part, pressure, 0.0)
        rates[part] = _part_rates(grid, own, pair, creepage, initial_slope)
        if bound == "parabolic":
            limit = np.where(labels == part, law.static * own**2 * (own.sum() / (own**2).sum()), limit)
    traction, slip = np.zeros((*grid.shape, 2)), np.zeros((*grid.shape, 2))
    stick = np.zeros(grid.shape, bool)
    march(pressure**2, limit, law.law, labels, rates, grid.x, grid.y, grid.dx, direction, traction, slip, stick)
    return traction, slip, stick


def _part_rates(
    grid: Grid, own: np.ndarray, pair: Pair, creepage: Creepage | LocalCreepage, initial_slope: float
) -> np.ndarray:
    """(1 or ny, 9) growth of the tractions by uniform slip along x and y [Pa/m] and by spin [Pa/m^2], in stick and in
    slip; centre x, y; flexibility in slip: of all strips, or of each."""
    semi_x, semi_y, x, y = equivalent_ellipse(grid, own)
    nominal = creepage.about(y)
    slip = np.array([nominal.longitudinal - nominal.spin * y, nominal.lateral + nominal.spin * x, nominal.spin])
    flexibility = np.array(flexibilities(semi_x, semi_y, pair)) / initial_slope
    sliding = float(sliding_flexibility(flexibility, slip, np.sqrt(semi_x * semi_y)))
    if isinstance(creepage, LocalCreepage):
        return strip_rates(creepage.strips(grid.y), slip, (x, y), flexibility, sliding, grid.y)
    return patch_rates(slip[None], flexibility, np.array([sliding]), (x, y))


def patch_rates(
    slip: np.ndarray, flexibility: np.ndarray, sliding: np.ndarray, centre: tuple[float, float] = (0.0, 0.0)
) -> np.ndarray:
    """(k, 9) as of `_part_rates`, of k patches that slip by (k, 3) at their centre."""
    rest = np.stack(np.broadcast_arrays(*centre, sliding), axis=1)
    return np.concatenate([slip / flexibility, slip / sliding[:, None], rest], axis=1)


def strip_rates(
    strips: np.ndarray,
    middle: np.ndarray,
    centre: tuple[float, float],
    flexibility: np.ndarray,
    sliding: float,
    y: np.ndarray,
) -> np.ndarray:
    """(ny, 9) as of `_part_rates`, of strips at y (ny,) with creepages (ny, 3) of their own about x = 0.

    middle (3,) : creepage of the centre's strip at the centre. What a strip's longitudinal slip differs from it by is
    spin's work, and gives way as spin does.
    """
    own = strips.copy()
    own[:, 1] += own[:, 2] * centre[0]
    stick = own / flexibility
    stick[:, 0] = middle[0] / flexibility[0] + (own[:, 0] - middle[0]) / flexibility[2]
    rest = np.stack(np.broadcast_arrays(centre[0], y, sliding), axis=1)
    return np.concatenate([stick, own / sliding, rest], axis=1)


@njit(cache=True)
def march(square, limit, law, labels, rates, x, y, dx, direction, traction, slip, stick):
    """Each run of cells of one part is marched from its leading edge, from covered centre to covered centre.

    rates : (parts, 1 or ny, 9) as of `_part_rates`;  law : SlipDependentFriction.law
    A cell's value is the traction at the centre of its covered length times the share of the cell that is covered, so
    that the sums over cells are those over the patch. Its slip is opposite to the traction, and as large as the mean of
    the steps that end and begin at its centre: second order, as a step's own belongs to the step's middle. A cell whose
    centre sticks slips by half of what the step from it does: where slip begins it jumps.
    """
    nx, ny = square.shape
    laws = _laws(limit, law, labels, rates)
    for j in range(ny):
        before, share = 0, 1.0
        position, qx, qy = 0.0, 0.0, 0.0
        for step in range(nx):
            i = nx - 1 - step if direction > 0 else step
            part = labels[i, j]
            if part == 0:
                before = 0
                continue
            ahead, behind = i + direction, i - direction
            inside_behind = 0 <= behind < nx and labels[behind, j] == part
            front, rear = 0.5, 0.5
            if part != before:
                front = cells_to_edge(square[i, j], square[behind, j] if inside_behind else 0.0)
                qx, qy, share = 0.0, 0.0, 1.0
                position = x[i] + direction * front * dx
            if not inside_behind:
                rear = cells_to_edge(square[i, j], square[ahead, j] if part == before else 0.0)
            centre = x[i] + direction * (front - rear) / 2 * dx
            cover = front + rear
            bound = limit[i, j] / cover
            own = rates[part, min(j, rates.shape[1] - 1)]
            made = spring_step(qx, qy, position, centre, y[j], bound, share, laws[part], own)
            if part == before:  # the step begins at the centre of the cell ahead, in whose half slip may begin
                _end_slip(slip, ahead, j, qx, qy, made.slip)
            stick[i, j], slip[i, j, 0] = made.sticks, made.slip
            qx, qy, share = made.x, made.y, made.share
            traction[i, j, 0], traction[i, j, 1] = qx * cover, qy * cover
            if not inside_behind and not made.sticks:  # on to the trailing edge, where nothing is carried
                edge = x[i] - direction * rear * dx
                last = spring_step(qx, qy, centre, edge, y[j], 0.0, share, laws[part], own)
                _end_slip(slip, i, j, qx, qy, last.slip)
            position, before = centre, part


@njit(cache=True)
def _laws(limit, law, labels, rates):
    """(parts, 3) law of each part, its memory the least that it needs where the one given is shorter."""
    laws = np.empty((rates.shape[0], 3))
    laws[:, 0], laws[:, 1], laws[:, 2] = law
    if law[0] < 1.0:
        for i, j in np.ndindex(limit.shape):
            part = labels[i, j]
            laws[part, 2] = max(laws[part, 2], LEAST * rates[part, 0, 8] * limit[i, j] * (1.0 - law[0]))
    return laws


class _Step(NamedTuple):
    """To a cell's centre: traction there [Pa], mean slip [1], friction over that without slip, whether it sticks."""

    x: float
    y: float
    slip: float
    share: float
    sticks: bool


@njit(cache=True)
def spring_step(qx, qy, position, centre, y, bound, share, law, rates):
    """_Step from the traction and the friction at `position`."""
    length = abs(position - centre)
    across, along = y - rates[7], (position + centre) / 2 - rates[6]
    tx = qx - length * (rates[0] - rates[2] * across)
    ty = qy - length * (rates[1] + rates[2] * along)
    size = np.hypot(tx, ty)
    rested = share_after(0.0, share, length, law)
    held = bound * rested
    if size <= held:
        return _Step(tx, ty, 0.0, rested, True)
    sx = qx - length * (rates[3] - rates[5] * across)
    sy = qy - length * (rates[4] + rates[5] * along)
    slid = np.hypot(sx, sy)
    if slid <= held:  # about to slide: by its one flexibility the cell would not yet
        return _Step(tx * held / size, ty * held / size, 0.0, rested, False)
    share = sliding_share(slid, bound, rates[8], share, length, law)
    bound *= share
    return _Step(sx * bound / slid, sy * bound / slid, rates[8] * (slid - bound) / length, share, False)


@njit(cache=True)
def _end_slip(slip, i, j, qx, qy, after):
    """Slip of a cell that slides, which holds the size of the step to its centre, with that of the step from it."""
    size, traction = (slip[i, j, 0] + after) / 2, np.hypot(qx, qy)
    scale = size / traction if traction > 0 else 0.0
    slip[i, j, 0], slip[i, j, 1] = -qx * scale, -qy * scale


def _estimate(patch: Patch, traction: np.ndarray, solve: Callable) -> ErrorEstimate:
    """The same on doubled and on fourfold cell sides. solve : grid, pressure -> traction, slip, stick"""
    if not patch.contact.any():
        return patch.error
    grid, pressure, forces = patch.grid, patch.pressure, [traction.sum(axis=(0, 1))]
    for _ in range(2):
        grid, pressure = coarse_grid(grid), coarse_field(pressure, "constant")
        coarse, _, _ = solve(grid, pressure)
        forces.append(coarse.sum(axis=(0, 1)) * grid.cell_area / patch.grid.cell_area)
    fine, doubled, fourfold = forces
    least = edge_share(patch.pressure, FORCE_STAIRS)
    return replace(
        patch.error,
        tangential_force=_SHARE * error_bound(fine, doubled, fourfold, order=1, least=least),
        note="changes from doubled and fourfold cell sides: of the discretisation, not of the simplified theory",
    )
