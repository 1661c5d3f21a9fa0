"""FASTSIM on many Hertz ellipses at once: the patches of a wheel along a rail.

On grids of as many cells each way all ellipses are one picture, scaled: which cells carry, the shape of the pressure,
the equivalent ellipse. What is left for each is its flexibilities and the march, in compiled code.
Result: as of `fastsim(elliptic_patch(...))` one by one, to round-off (tests/bem/test_rolled_ellipses.py).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from bem.exact.kalker_table import coefficient_rows
from bem.halfspace.fastsim import (
    elliptic_patch,
    equivalent_ellipse,
    flexibilities,
    march,
    patch_rates,
    sliding_flexibility,
    strip_rates,
)
from bem.halfspace.input import check_creepage, check_rolling, friction_law
from bem.halfspace.slip_dependent_friction import SlipDependentFriction
from bem.material import Elastic, Pair
from bem.patch import ContactInputError, Creepage, Grid, Patch
from bem.patch_edge import covered_area
from kernel_cache import njit

METHOD = "FASTSIM (parabolic bound) on Hertz ellipse"
ROWS = "pressure", "traction", "slip", "stick", "creepage", "contact_area", "friction"  # of RolledEllipses


class Grids(NamedTuple):
    """k grids about their patches' middles. dx, dy : (k,) cell sides [m];  nx, ny : counts"""

    dx: np.ndarray
    dy: np.ndarray
    nx: int
    ny: int

    @property
    def shape(self) -> tuple[int, int]:
        return self.nx, self.ny

    @property
    def cell_area(self) -> np.ndarray:
        """(k,) [m2]."""
        return self.dx * self.dy

    @property
    def y(self) -> np.ndarray:
        """(k, ny) centres along y [m]."""
        return self.dy[:, None] * (np.arange(self.ny) - (self.ny - 1) / 2)


@dataclass(frozen=True, eq=False)
class RolledEllipses:
    """k patches with fields and numbers as of bem.patch.Patch, each with a first axis (k, ...).

    pressure, stick (k, nx, ny);  traction, slip (k, nx, ny, 2);  creepage (k, 3): longitudinal, lateral, spin
    contact_area (k,) [m2];  friction : coefficient without slip of each (k,)
    """

    grid: Grids
    pressure: np.ndarray
    traction: np.ndarray
    slip: np.ndarray
    stick: np.ndarray
    creepage: np.ndarray
    contact_area: np.ndarray
    friction: np.ndarray
    method: str = METHOD

    def __len__(self) -> int:
        return len(self.pressure)

    @property
    def max_pressure(self) -> np.ndarray:
        """(k,) [Pa]."""
        return self.pressure.max(axis=(1, 2), initial=0.0)

    @property
    def normal_force(self) -> np.ndarray:
        """(k,) [N]."""
        return self.pressure.sum(axis=(1, 2)) * self.grid.cell_area

    @property
    def tangential_force(self) -> np.ndarray:
        """(k, 2) of the tractions on body 1 [N]."""
        return self.traction.sum(axis=(1, 2)) * self.grid.cell_area[:, None]

    @property
    def frictional_power(self) -> np.ndarray:
        """(k,) power lost by friction per rolling speed [N]."""
        return -(self.traction * self.slip).sum(axis=(1, 2, 3)) * self.grid.cell_area

    def patch(self, i: int) -> Patch:
        """One of them by itself."""
        half = (self.grid.nx - 1) / 2, (self.grid.ny - 1) / 2
        dx, dy = float(self.grid.dx[i]), float(self.grid.dy[i])
        grid = Grid(-half[0] * dx, -half[1] * dy, dx, dy, *self.grid.shape)
        fields, friction = (self.traction[i], self.slip[i], self.stick[i]), float(self.friction[i])
        creepage = Creepage(*map(float, self.creepage[i]))
        return Patch(grid, None, self.pressure[i], np.nan, self.method, *fields, friction, creepage)

    def taken(self, order: np.ndarray) -> RolledEllipses:
        """Those at indices `order`, in that order."""
        grid = self.grid._replace(dx=self.grid.dx[order], dy=self.grid.dy[order])
        return replace(self, grid=grid, **{name: getattr(self, name)[order] for name in ROWS})

    def joined(self, other: RolledEllipses) -> RolledEllipses:
        """These and then those of another row of as many cells."""
        if self.grid.shape != other.grid.shape:
            raise ContactInputError(f"patches of {self.grid.shape} and {other.grid.shape} cells do not go in one row")
        dx, dy = (np.concatenate([getattr(row.grid, side) for row in (self, other)]) for side in ("dx", "dy"))
        fields = {name: np.concatenate([getattr(self, name), getattr(other, name)]) for name in ROWS}
        return replace(self, grid=self.grid._replace(dx=dx, dy=dy), **fields)


def rolled_ellipses(
    semi: np.ndarray,
    load: np.ndarray,
    first: Elastic,
    second: Elastic,
    friction: float | SlipDependentFriction,
    creepage: np.ndarray,
    cells: tuple[int, int] = (44, 44),
    *,
    direction: int = 1,
    initial_slope: float = 1.0,
    strips: np.ndarray | None = None,
) -> RolledEllipses:
    """Tractions, slip and stick of k rolling ellipses.

    semi (k, 2) : along x and y [m];  load (k,) [N];  creepage (k, 3) : longitudinal, lateral, spin [1, 1, 1/m]; the
    rest as of bem.halfspace.fastsim.fastsim. strips (k, ny, 3) : creepages of the strips at the grids' y about x = 0,
    where the ellipses are laid along curved faces (bem/creepage.py); None: those of plane ones.
    Errors: ContactInputError as there.
    """
    semi, load, creepage = (
        np.asarray(v, float).reshape(-1, *s) for v, s in ((semi, (2,)), (load, ()), (creepage, (3,)))
    )
    law, _ = friction_law(friction)
    _check(semi, load, creepage, direction, initial_slope)
    if strips is not None:
        _check_strips(strips, (len(load), cells[1], 3))
    unit = elliptic_patch(1.0, 1.0, 1.0, cells)
    pressure = unit.pressure * (load / semi.prod(axis=1))[:, None, None]
    grid = Grids(2 * semi[:, 0] / cells[0], 2 * semi[:, 1] / cells[1], *cells)
    shape = (len(load), *cells)
    traction, slip, stick = np.zeros((*shape, 2)), np.zeros((*shape, 2)), np.zeros(shape, bool)
    labels, _ = ndimage.label(unit.pressure > 0, structure=np.ones((3, 3)))
    paraboloid = unit.pressure**2 * (unit.pressure.sum() / (unit.pressure**2).sum())
    rates = _rates(unit, semi, Pair.of(first, second), creepage, initial_slope, strips)
    bounds, centres = (paraboloid, law.static * load / semi.prod(axis=1)), (unit.grid.x, unit.grid.y)
    _march_all(unit.pressure**2, *bounds, law.law, labels, rates, semi, centres, direction, traction, slip, stick)
    area = covered_area(unit.grid, unit.pressure) * semi.prod(axis=1)
    empty = load == 0
    slip[empty], stick[empty], area[empty] = 0.0, False, 0.0
    return RolledEllipses(grid, pressure, traction, slip, stick, creepage, area, np.full(len(load), law.static))


def _check(semi, load, creepage, direction, initial_slope) -> None:
    check_rolling(direction, initial_slope)
    good = np.isfinite(semi).all(axis=1) & (semi > 0).all(axis=1) & np.isfinite(load) & (load >= 0)
    if not good.all():
        k = int(np.argmin(good))
        raise ContactInputError(
            f"ellipse {k + 1} of {len(load)}, {semi[k, 0]!r} x {semi[k, 1]!r} m under {load[k]!r} N: give finite"
            " numbers, axes > 0, load >= 0"
        )
    for (a, b), own in zip(semi, creepage, strict=True):
        check_creepage(Creepage(*map(float, own)), (-a, a, -b, b))


def _check_strips(strips: np.ndarray, shape: tuple[int, ...]) -> None:
    if np.shape(strips) != shape or not np.isfinite(strips).all():
        raise ContactInputError(f"strips of shape {np.shape(strips)}: give finite creepages of shape {shape}")


def _rates(
    unit: Patch, semi: np.ndarray, pair: Pair, creepage: np.ndarray, initial_slope: float, strips: np.ndarray | None
) -> np.ndarray:
    """(k, 2, 1 or ny, 9): of no part and of the patch, as fastsim's for one."""
    wide, deep, _, _ = equivalent_ellipse(unit.grid, unit.pressure)
    a, b = wide * semi[:, 0], deep * semi[:, 1]
    c = coefficient_rows(a / b, pair.poisson)
    flexibility = np.stack(flexibilities(a, b, pair, c), axis=1) / initial_slope
    sliding = sliding_flexibility(flexibility, creepage, np.sqrt(a * b))
    rates = np.zeros((len(semi), 2, 1 if strips is None else unit.grid.ny, 9))
    if strips is None:
        rates[:, 1, 0] = patch_rates(creepage, flexibility, sliding)
        return rates
    for k, own in enumerate(strips):
        y = unit.grid.y * semi[k, 1]
        rates[k, 1] = strip_rates(own, creepage[k], (0.0, 0.0), flexibility[k], sliding[k], y)
    return rates


@njit(cache=True)
def _march_all(square, limit, scale, law, labels, rates, semi, centres, direction, traction, slip, stick):
    """fastsim's march of every ellipse; square and limit are those of the unit circle, scale its bound over theirs."""
    own = np.empty_like(limit)
    for k in range(len(semi)):
        own[:] = limit * scale[k]
        x, y = centres[0] * semi[k, 0], centres[1] * semi[k, 1]
        march(square, own, law, labels, rates[k], x, y, x[1] - x[0], direction, traction[k], slip[k], stick[k])
