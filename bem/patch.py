"""The contact patch: one result type for every 3D contact solver (half-space, FASTSIM, 2.5D slices).

Axes and signs are those of the project's table: x forward (rolling direction), y lateral, z up, pressure >= 0.
Body 1 is above (the wheel), body 2 below (the rail). Tractions act on body 1; body 2 feels their opposite.
Slip is the velocity of body 1 relative to body 2: per rolling speed in rolling [1], as a distance in a shift [m].
Arrays over the patch have the shape (nx, ny) of the grid, first index along x. A field that was not solved is None,
a number that was not solved is NaN.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from numbers import Integral

import numpy as np
from scipy import ndimage

from bem.checks import ContactInputError
from bem.creepage import Creepage, LocalCreepage
from bem.patch_edge import covered_area, edge_positions

HALF_SPACE = "half-space"  # method of patches whose pressure is the half-space's for their gap


class NoContactError(ContactInputError):
    """The bodies do not touch at the given approach."""


class PatchCutError(ContactInputError):
    """The grid ends inside the contact patch."""


def _refuse_counts(nx: int, ny: int) -> None:
    if not all(isinstance(count, Integral) and count >= 1 for count in (nx, ny)):
        raise ContactInputError(f"grid: {nx!r} x {ny!r} cells: give whole numbers, at least one each way")


@dataclass(frozen=True)
class Grid:
    """Equal rectangular cells.

    Parameters
    ----------
    x_first, y_first : float
        Centre of cell (0, 0) [m].
    dx, dy : float
        Cell sides [m].
    nx, ny : int
        Counts.

    Examples
    --------
    >>> bem.Grid.over((-0.01, 0.01), (-0.005, 0.005), 40, 20).shape
    (40, 20)
    """

    x_first: float
    y_first: float
    dx: float
    dy: float
    nx: int
    ny: int

    def __post_init__(self) -> None:
        numbers = [self.x_first, self.y_first, self.dx, self.dy]
        if not (np.isfinite(numbers).all() and self.dx > 0 and self.dy > 0):
            raise ContactInputError(
                f"grid: cell sides {self.dx!r} x {self.dy!r} m at ({self.x_first!r}, {self.y_first!r}) "
                "m: give finite positions and positive sides"
            )
        _refuse_counts(self.nx, self.ny)

    @classmethod
    def over(cls, x_range: tuple[float, float], y_range: tuple[float, float], nx: int, ny: int) -> Grid:
        """Cells that fill a rectangle.

        Parameters
        ----------
        x_range, y_range : (float, float)
            Its edges, not centres [m].
        nx, ny : int
            Counts.

        Returns
        -------
        Grid
        """
        _refuse_counts(nx, ny)
        dx, dy = (x_range[1] - x_range[0]) / nx, (y_range[1] - y_range[0]) / ny
        return cls(x_range[0] + dx / 2, y_range[0] + dy / 2, dx, dy, nx, ny)

    @property
    def shape(self) -> tuple[int, int]:
        return self.nx, self.ny

    @property
    def cell_area(self) -> float:
        """Area of one cell [m^2]."""
        return self.dx * self.dy

    @property
    def x(self) -> np.ndarray:
        """(nx,) centres along x [m]."""
        return self.x_first + self.dx * np.arange(self.nx)

    @property
    def y(self) -> np.ndarray:
        """(ny,) centres along y [m]."""
        return self.y_first + self.dy * np.arange(self.ny)

    @property
    def edges(self) -> tuple[float, float, float, float]:
        """(x_min, x_max, y_min, y_max) of the outer cell edges [m]."""
        return (
            self.x_first - self.dx / 2,
            self.x_first + (self.nx - 0.5) * self.dx,
            self.y_first - self.dy / 2,
            self.y_first + (self.ny - 0.5) * self.dy,
        )

    def points(self) -> tuple[np.ndarray, np.ndarray]:
        """(nx, ny) x and y of the cell centres [m]."""
        return np.meshgrid(self.x, self.y, indexing="ij")


@dataclass(frozen=True)
class Cost:
    """What a solution cost: seconds of wall clock, iterations, products with the influence matrix."""

    seconds: float = np.nan
    iterations: int = 0
    products: int = 0

    def __add__(self, other: Cost) -> Cost:
        known = [one.seconds for one in (self, other) if not np.isnan(one.seconds)]
        seconds = float(sum(known)) if known else np.nan
        return Cost(seconds, self.iterations + other.iterations, self.products + other.products)


@dataclass(frozen=True)
class ErrorEstimate:
    """Estimated relative error of the solution, from the same problem at coarser cells; NaN where not estimated.

    Above the true error in at least 95 of 100 seeded cases, less than five times it in half of them
    (bem/verification/estimates_study.py).
    normal : of the approach where the load is given, of the normal force where the approach is
    """

    max_pressure: float = np.nan
    contact_area: float = np.nan
    normal: float = np.nan
    tangential_force: float = np.nan
    note: str = "not estimated"


@dataclass(frozen=True)
class PatchPart:
    """One connected contact region: area [m^2], normal force [N], centre of pressure and bounds [m], cells."""

    area: float
    normal_force: float
    centre: tuple[float, float]
    bounds: tuple[float, float, float, float]
    max_pressure: float
    cells: int


@dataclass
class Patch:
    """A solved contact.

    Parameters
    ----------
    grid : Grid
        Its cells.
    gap : (nx, ny) array or None
        Undeformed gap, open positive [m]; None for a closed form.
    pressure : (nx, ny) array
        >= 0 [Pa].
    approach : float
        Of distant points [m], positive when the bodies are pushed together.
    method : str
        That has solved it.
    traction : (nx, ny, 2) array or None
        Tangential traction on the upper body [Pa]; None where only the normal problem was solved.
    slip : (nx, ny, 2) array or None
        Of the upper body against the lower one (see the module's head).
    stick : (nx, ny) bool array or None
        Cells in contact that do not slide.
    friction : float
        Coefficient, NaN without friction.
    creepage : Creepage or None
        About x = y = 0; of a patch whose strips have their own (local_creepage) that of its centre's strip.
    cost : Cost
        What it has cost.
    error : ErrorEstimate
        Its own estimate of its error.
    warnings : tuple of str
        What is doubtful.
    local_creepage : LocalCreepage or None
        Of a patch that is laid along a curved face.
    modulus : float
        E* [Pa] of the bodies whose pressure it is, NaN where it is not known.

    Examples
    --------
    >>> window = (-0.01, 0.01), (-0.01, 0.01)
    >>> sphere = lambda x, y: (x**2 + y**2) / 0.6
    >>> patch = bem.normal_contact(sphere, bem.STEEL, bem.STEEL, load=50e3, window=window, cells=32)
    >>> round(patch.normal_force / 1e3, 6), len(patch.parts())  # [kN]
    (50.0, 1)
    """

    grid: Grid
    gap: np.ndarray | None
    pressure: np.ndarray
    approach: float
    method: str
    traction: np.ndarray | None = None
    slip: np.ndarray | None = None
    stick: np.ndarray | None = None
    friction: float = np.nan
    creepage: Creepage | None = None
    cost: Cost = field(default_factory=Cost)
    error: ErrorEstimate = field(default_factory=ErrorEstimate)
    warnings: tuple[str, ...] = ()
    local_creepage: LocalCreepage | None = None
    modulus: float = np.nan

    curved = False  # whether the grid is laid along a curved face (slices), so that no plane half-space lies below it

    def refuse_other_modulus(self, modulus: float) -> None:
        """Raise ContactInputError for bodies of another contact modulus [Pa] than those whose pressure this is."""
        if abs(self.modulus - modulus) > 1e-9 * modulus:
            raise ContactInputError(
                f"bodies of E* = {modulus:.6g} Pa on a patch whose pressure was solved for {self.modulus:.6g} Pa: solve"
                " its normal contact with the same bodies"
            )

    @cached_property
    def contact(self) -> np.ndarray:
        """(nx, ny) bool: cells that carry pressure."""
        return self.pressure > 0

    @property
    def sliding(self) -> np.ndarray | None:
        """(nx, ny) bool: cells in contact that slide."""
        return None if self.stick is None else self.contact & ~self.stick

    @cached_property
    def contact_area(self) -> float:
        """Area in contact [m^2], the cells at the edge counted in part (bem/patch_edge.py)."""
        return covered_area(self.grid, self.pressure)

    @property
    def stick_area(self) -> float:
        """Area that sticks [m^2]: its share of the cells times the contact area."""
        if self.stick is None or not self.contact.any():
            return np.nan if self.stick is None else 0.0
        return self.contact_area * np.count_nonzero(self.stick) / np.count_nonzero(self.contact)

    @property
    def closure(self) -> float:
        """Approach less the least gap [m]. Raises as `known_gap`."""
        return float(self.approach - self.known_gap.min())

    @property
    def known_gap(self) -> np.ndarray:
        """(nx, ny) the gap [m]. Raises ContactInputError for a closed form, which has none."""
        if self.gap is None:
            raise ContactInputError(f"{self.method}: a closed form carries no gap")
        return self.gap

    @property
    def max_pressure(self) -> float:
        return float(self.pressure.max())

    @property
    def normal_force(self) -> float:
        """Normal force [N], >= 0."""
        return float(self.pressure.sum() * self.grid.cell_area)

    @property
    def tangential_force(self) -> np.ndarray:
        """(2,) force of the tractions on body 1 [N]."""
        if self.traction is None:
            return np.full(2, np.nan)
        return self.traction.sum(axis=(0, 1)) * self.grid.cell_area

    @property
    def moment(self) -> np.ndarray:
        """(3,) moment on body 1 about the grid's origin (x = y = 0) [N m]; z is the spin moment."""
        x, y = self.grid.points()
        area = self.grid.cell_area
        spin = np.nan if self.traction is None else (x * self.traction[..., 1] - y * self.traction[..., 0]).sum() * area
        return np.array([(y * self.pressure).sum() * area, -(x * self.pressure).sum() * area, spin])

    @property
    def centre_of_pressure(self) -> tuple[float, float]:
        """(x, y) of the normal force [m]; NaN where there is none."""
        return _centre(self.grid, self.pressure) if self.pressure.any() else (np.nan, np.nan)

    @property
    def frictional_power(self) -> float:
        """Power lost by friction per rolling speed [N], or work in a shift [J]; >= 0."""
        if self.traction is None or self.slip is None:
            return np.nan
        return float(-(self.traction * self.slip).sum() * self.grid.cell_area)

    @property
    def extent(self) -> tuple[float, float]:
        """Length along x and width along y of the patch [m], to a fraction of a cell (bem/patch_edge.py)."""
        x_min, x_max, y_min, y_max = edge_positions(self.grid, self.pressure)
        return x_max - x_min, y_max - y_min

    def parts(self) -> list[PatchPart]:
        """The connected contact regions (cells that share a side or a corner), largest force first."""
        labels, count = ndimage.label(self.contact, structure=np.ones((3, 3)))
        found = [_part(self.grid, np.where(labels == n, self.pressure, 0.0)) for n in range(1, count + 1)]
        return sorted(found, key=lambda part: -part.normal_force)


def _centre(grid: Grid, pressure: np.ndarray) -> tuple[float, float]:
    total = pressure.sum()
    return float(grid.x @ pressure.sum(axis=1) / total), float(grid.y @ pressure.sum(axis=0) / total)


def _part(grid: Grid, pressure: np.ndarray) -> PatchPart:
    centre, bounds = _centre(grid, pressure), edge_positions(grid, pressure)
    area, force, cells = covered_area(grid, pressure), pressure.sum() * grid.cell_area, np.count_nonzero(pressure)
    return PatchPart(area, float(force), centre, bounds, float(pressure.max()), int(cells))
