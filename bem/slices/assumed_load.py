"""Contact patch by slices, driven by load: the 2.5D method (a), as in the thesis.

The patch's length is Hertz's. How the load is shared along it is assumed: the load per length of a slice follows an
ellipse or a parabola over that length. Each slice is then a plane contact of the sections there under its share
(bem/plane/contact.py).

Three-dimensional: the gap, and the sum of the loads. Not three-dimensional: everything elastic. Slices do not feel each
other, so each gives way as if its load went on for ever along x; each has an approach of its own, though the bodies
have one; and the patch is as long as was assumed. For Hertz's ellipse the parabola is the exact line load, and still
the largest pressure is sqrt(3 P E* / (4 pi a R_y)), which is below Hertz's by 11.4 % for a circle, 1.6 % for a = 5 b
and 36 % for b = 5 a: the loss comes from the missing coupling, not from the sharing. bem/slices/coupled.py, driven by
one approach with coupled slices, has neither. The sections' elasticity is that of x = 0; only the gap changes from
slice to slice.

Error against the method's own closed form: tests/bem/test_slice_load.py.
Source: thesis, 6.2.1 and 6.2.2; equations 6-1 and 6-2 as errata.md reads them (each normalised to the wheel load).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from numbers import Integral

import numpy as np
from scipy.spatial import cKDTree

from bem.exact.hertz import point_contact
from bem.halfspace.coarse import relative_change
from bem.halfspace.input import check_control, strain_warning
from bem.material import contact_modulus
from bem.patch import ContactInputError, Cost, ErrorEstimate, Grid
from bem.plane.contact import Settings, solve_contact
from bem.plane.contact_result import ContactResult
from bem.plane.coulomb import Control, solve_step
from bem.plane.zone import runs
from bem.slices.coupled import SlicePatch
from bem.slices.slices import SliceGap, Slices

Sharing = str | Callable[[np.ndarray], np.ndarray]
_MARGIN = 1.5  # cells between patch and grid edge
_CHORD = 0.1  # of the semi-axes, over which the radii at the initial contact are taken


@dataclass
class LoadedSlicePatch(SlicePatch):
    """slice_approach : (nx,) approach of each slice [m]; one number in truth, so its spread shows what the sharing gets
    wrong."""

    slice_approach: np.ndarray | None = None


def elliptic(x: np.ndarray, semi_length: float) -> np.ndarray:
    """Share of the load between -semi_length and x [1], line load as sqrt(1 - x^2 / a^2)."""
    u = np.clip(x / semi_length, -1, 1)
    return 0.5 + (u * np.sqrt(1 - u**2) + np.arcsin(u)) / np.pi


def parabolic(x: np.ndarray, semi_length: float) -> np.ndarray:
    """Share of the load between -semi_length and x [1], line load as 1 - x^2 / a^2."""
    u = np.clip(x / semi_length, -1, 1)
    return 0.5 + (3 * u - u**3) / 4


def loaded_slices(
    slices: Slices,
    *,
    load: float,
    sharing: Sharing = "parabolic",
    semi_length: float | None = None,
    cells: tuple[int, int] = (50, 80),
    estimate: bool = True,
) -> LoadedSlicePatch:
    """Frictionless contact of the two bodies of `slices`, each slice under an assumed share of the load.

    Parameters
    ----------
    slices : Slices
        With direction (0, -1).
    load : float
        Downwards [N].
    sharing : {"elliptic", "parabolic"} or function
        Or x (n,) [m] -> line load (n,), of any scale.
    semi_length : float, optional
        Half the patch's length [m]; None: Hertz's for the radii where the bodies touch.
    cells : (int, int)
        Slices along the patch, cells across it.
    estimate : bool
        Also solve with doubled cells, for the error estimate; it knows nothing of the method's own error.

    Returns
    -------
    LoadedSlicePatch
        Its `approach` is NaN: there is none.

    Raises
    ------
    ContactInputError
        And its kinds, with what is wrong and what to do.

    Examples
    --------
    >>> from rail_fem.bem.plane.outline import block_behind
    >>> y = np.linspace(-0.04, 0.04, 161)
    >>> crown, tread = np.column_stack([y, -(y**2) / 0.6]), np.column_stack([y, y**2 / 2.0])
    >>> rail, wheel = (bem.Body(block_behind(line, end), bem.STEEL) for line, end in ((crown, -0.1), (tread, 0.1)))
    >>> rolled = lambda x: [tread + [0.0, x**2 / 0.92]]  # of a wheel of 0.46 m
    >>> slices = bem.Slices(rail, wheel, upper_section=rolled)
    >>> patch = bem.loaded_slices(slices, load=50e3, cells=(8, 12), estimate=False)
    >>> bool(abs(patch.normal_force / 50e3 - 1) < 0.01)
    True
    """
    started = time.perf_counter()
    check_control(load, None)
    _check(slices, load, sharing, semi_length, cells)
    gap = SliceGap(slices)
    semi_length = semi_length or hertz_of(gap, load).semi_x
    patch = _solve(gap, load, sharing, semi_length, cells)
    if estimate:
        coarse = _solve(gap, load, sharing, semi_length, (max(cells[0] // 2, 1), max(cells[1] // 2, 4)))
        patch.error = ErrorEstimate(
            relative_change(coarse.max_pressure, patch.max_pressure),
            relative_change(coarse.contact_area, patch.contact_area),
            note="change from doubled cells, first order assumed; the sharing of the load is not judged",
        )
    patch.warnings += strain_warning(patch.pressure, slices.upper.material, slices.lower.material)
    patch.cost = replace(patch.cost, seconds=time.perf_counter() - started)
    return patch


def hertz_of(gap: SliceGap, load: float):
    """Hertz's contact [bem.exact.hertz.PointContact] of the radii at the initial contact, from chords of a tenth of the
    semi-axes."""
    modulus = contact_modulus(gap.slices.upper.material, gap.slices.lower.material)
    chord = np.full(2, 1e-3 * (gap.window[1] - gap.window[0]))
    for _ in range(6):
        radius_x, radius_y = _radii(gap, chord)
        contact = point_contact(load, radius_x, radius_y, modulus)
        chord = _CHORD * np.array([contact.semi_x, contact.semi_y])
    return contact


def _radii(gap: SliceGap, chord: np.ndarray) -> np.ndarray:
    across = np.array([-chord[1], 0.0, chord[1]]) + gap.first_point[0]
    along = np.array([-chord[0], 0.0, chord[0]])
    x, y = np.meshgrid(along, across, indexing="ij")
    g = gap(x, y)
    rise = np.array([g[0, 1] + g[2, 1], g[1, 0] + g[1, 2]]) / 2 - g[1, 1]
    if not (np.isfinite(rise).all() and (rise > 0).all()):
        raise ContactInputError(
            f"half the patch's length cannot be taken from Hertz: within {chord[0]:.3g} x {chord[1]:.3g} m of the"
            f" initial contact the gap rises by {rise[0]:.3g} m along and {rise[1]:.3g} m across, so a radius is"
            " infinite or not defined; give semi_length [m]"
        )
    return chord**2 / (2 * rise)


def _check(slices: Slices, load: float, sharing: Sharing, semi_length: float | None, cells: tuple[int, int]) -> None:
    if not load > 0:
        raise ContactInputError(
            f"load {load!r} N: slices controlled by load need a load > 0; for the empty patch of 0 N use slice_contact"
        )
    if not (callable(sharing) or sharing in ("elliptic", "parabolic")):
        raise ContactInputError(f"sharing {sharing!r}: give 'elliptic', 'parabolic' or a function of x [m]")
    if semi_length is not None and not (np.isfinite(semi_length) and semi_length > 0):
        raise ContactInputError(
            f"semi_length {semi_length!r} m: give half the patch's length, a finite positive number"
        )
    if slices.direction != (0.0, -1.0):
        raise ContactInputError(
            f"direction {slices.direction}: slices controlled by load press along (0, -1); turn both bodies so that"
            " this is their approach"
        )
    whole = np.shape(cells) == (2,) and all(isinstance(count, Integral) for count in cells)
    if not whole or cells[0] < 1 or cells[1] < 4:
        raise ContactInputError(f"cells {cells!r}: give at least 1 slice and 4 cells across")


def _line_loads(load: float, sharing: Sharing, semi_length: float, slices: int) -> tuple[np.ndarray, np.ndarray]:
    """Middles of the slices (n,) [m] and their mean line loads (n,) [N/m], which add up to the load."""
    edges = np.linspace(-semi_length, semi_length, slices + 1)
    middles, step = (edges[1:] + edges[:-1]) / 2, edges[1] - edges[0]
    if callable(sharing):
        shares = np.asarray(sharing(middles), float)
        if shares.shape != middles.shape or not np.isfinite(shares).all() or shares.min() < 0 or not shares.sum() > 0:
            raise ContactInputError(
                f"sharing gave {shares!r} for {slices} positions: give as many finite line loads >= 0, not all zero"
            )
        return middles, load * shares / shares.sum() / step
    return middles, load * np.diff({"elliptic": elliptic, "parabolic": parabolic}[sharing](edges, semi_length)) / step


def _solve(
    gap: SliceGap, load: float, sharing: Sharing, semi_length: float, cells: tuple[int, int]
) -> LoadedSlicePatch:
    x, line_load = _line_loads(load, sharing, semi_length, cells[0])
    size, plane = _plane_contact(gap, float(line_load.max()), cells[1])
    y = _coordinates(gap, plane.interface.points)
    order = np.argsort(y)
    states = _slices(gap, plane, x, y, line_load)
    squares = np.array([_squares(y[order], state.pressure[order]) for state in states])
    grid = _grid(semi_length, y[order], squares, cells)
    place = gap.place(grid.y)
    pressure = np.sqrt(np.maximum([np.interp(grid.y, y[order], row) for row in squares], 0.0))
    # cells hold what the elements carry
    pressure *= load / ((pressure @ -(place["normals"] @ place["direction"])).sum() * grid.cell_area)
    pressed = np.any(squares > 0, axis=0)
    coarsest = np.diff(y[order])[pressed[1:] | pressed[:-1]].max()
    notes: tuple[str, ...] = ()
    if coarsest > 2 * size:
        notes = (
            f"a slice touches where elements are {coarsest:.2g} m long, {coarsest / size:.1f} times those of the middle"
            " slice",
        )
    patch = LoadedSlicePatch(grid, gap(*grid.points()), pressure, np.nan, "2.5D slices by load", **place)
    patch.cost, patch.warnings = Cost(np.nan, sum(s.iterations for s in states), 0), notes
    patch.slice_approach = np.array([-state.motion[1] for state in states])
    return patch


def _plane_contact(gap: SliceGap, line_load: float, across: int) -> tuple[float, ContactResult]:
    """Element size [m] and contact of the middle slice under the largest line load: first coarse for its width, then at
    that size."""
    control = Control.of(force=(None, -line_load))
    coarse = solve_contact(gap.slices.lower, gap.upper, control, settings=Settings(accuracy=0.05))
    size = sum(patch.width for patch in coarse.patches()) / max(across - 2 * _MARGIN, 4)
    return size, solve_contact(gap.slices.lower, gap.upper, control, settings=Settings(size=size))


def _coordinates(gap: SliceGap, points: np.ndarray) -> np.ndarray:
    """The grid's lateral coordinate (n,) [m] of points (n, 2) near the lower face."""
    y = np.linspace(*gap.window, 4001)
    near = y[cKDTree(gap.face(y)[0]).query(points)[1]]
    for _ in range(3):
        at, normals = gap.face(near)
        near = near + ((points - at) * np.column_stack([normals[:, 1], -normals[:, 0]])).sum(axis=1)
        near = np.clip(near, *gap.window)
    return near


def _slices(gap: SliceGap, plane: ContactResult, x: np.ndarray, y: np.ndarray, line_load: np.ndarray) -> list:
    """State of each slice: the middle slice's compliance, its own gap, its own load."""
    own = gap(np.broadcast_to(np.r_[0.0, x][:, None], (len(x) + 1, len(y))), np.broadcast_to(y, (len(x) + 1, len(y))))
    with np.errstate(invalid="ignore"):
        change = own[1:] - own[0]
    change[~np.isfinite(change)] = gap.reach
    states: list = [None] * len(x)
    start = plane.last.state
    middle = len(x) // 2
    for positions in (range(middle, len(x)), range(middle - 1, -1, -1)):
        state = start
        for k in positions:
            system = replace(plane.system, gap=plane.system.gap + change[k])
            states[k] = solve_step(system, Control.of(force=(None, -line_load[k])), 0.0, state=state)
            state = states[k].state
    return states


def _squares(y: np.ndarray, pressure: np.ndarray) -> np.ndarray:
    """Pressure squared at nodes in order; beside each run of pressed nodes the square is led on linearly below zero."""
    squares = pressure**2
    for run in runs(pressure > 0):
        for edge, direction in ((run[0], -1), (run[-1], 1)):
            outside, inside = edge + direction, edge - direction
            if 0 <= outside < len(y) and pressure[outside] <= 0:
                slope = (
                    (squares[edge] - squares[inside]) / abs(y[edge] - y[inside])
                    if len(run) > 1
                    else -squares[edge] / abs(y[outside] - y[edge])
                )
                led = squares[edge] + min(slope, 0.0) * abs(y[outside] - y[edge])
                squares[outside] = min(squares[outside], min(led, -1e-6 * squares[edge]))
    return squares


def _grid(semi_length: float, y: np.ndarray, squares: np.ndarray, cells: tuple[int, int]) -> Grid:
    """Cells over all that is pressed in any slice, with a margin; slices fill the patch's length."""
    pressed = np.flatnonzero((squares > 0).any(axis=0))
    low, high = y[max(pressed[0] - 1, 0)], y[min(pressed[-1] + 1, len(y) - 1)]
    margin = (high - low) * max(_MARGIN - 1, 0) / max(cells[1] - 2 * _MARGIN, 1)
    return Grid.over((-semi_length, semi_length), (low - margin, high + margin), *cells)
