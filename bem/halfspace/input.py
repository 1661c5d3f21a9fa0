"""What a contact solver refuses, and what it warns of: gaps, controls, friction, creepages, grids that cut the
patch."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from numbers import Integral
from typing import TypeAlias

import numpy as np

from bem.checks import is_finite
from bem.creepage import LocalCreepage
from bem.halfspace.slip_dependent_friction import SlipDependentFriction
from bem.material import Elastic
from bem.patch import ContactInputError, Creepage, Grid, Patch, PatchCutError

GapFunction: TypeAlias = Callable[[np.ndarray, np.ndarray], np.ndarray]
Gap: TypeAlias = np.ndarray | GapFunction

# Rigid slip above this share of the rolling speed is no rolling; above the second it deserves a look at the units.
_IMPOSSIBLE_SLIP = 1.0
_UNLIKELY_SLIP = 0.1
_USUAL_FRICTION = 1.0
_ROUND_OFF = 1e-9
_FEWEST_CELLS = 4
_STRIPS = 41  # at which a creepage that differs across the patch is looked at
_YIELDING = 0.01  # of Young's modulus, 2.1 GPa in steel: 2.3 to 4 times the yield stress of rail steels
_LARGE_STRAIN = 0.05
_SOFTEST_STEEL = 150e9  # Young's modulus [Pa] from which a body is taken for steel


def gap_values(gap: Gap, grid: Grid) -> np.ndarray:
    """Gap (nx, ny) [m] at the cell centres as floats; refuses what is no array of real numbers, has the wrong shape,
    NaN or -inf, or is nowhere finite (+inf: no surface there)."""
    given = gap(*grid.points()) if callable(gap) else gap
    try:
        values = np.asarray(given)
        if np.iscomplexobj(values):
            raise TypeError
        values = np.where(np.ma.getmask(given), np.nan, values.astype(float))
    except (TypeError, ValueError):
        raise ContactInputError(
            "gap is no array of real numbers: give distances in metres, open positive, +inf where a body has no surface"
        ) from None
    if values.shape != grid.shape:
        raise ContactInputError(
            f"gap has shape {values.shape}, the grid {grid.shape}: give one value per cell, x first"
        )
    bad = np.isnan(values) | (values == -np.inf)
    if bad.any():
        i, j = np.argwhere(bad)[0]
        raise ContactInputError(
            f"gap has {np.count_nonzero(bad)} of {values.size} cells NaN or -inf, the first at x = {grid.x[i]:g} m, "
            f"y = {grid.y[j]:g} m: fill them, or set +inf where a body has no surface"
        )
    if not np.isfinite(values).any():
        raise ContactInputError("gap is +inf in every cell: the bodies share no surface; move the grid")
    return values


def check_cells(cells: int | tuple[int, int]) -> tuple[int, int]:
    """Cells along x and y; refuses what are no whole numbers, and grids too small to hold a patch and its margin."""
    both = tuple(cells) if isinstance(cells, Iterable) else (cells, cells)
    if len(both) != 2 or not all(isinstance(count, Integral) and count >= _FEWEST_CELLS for count in both):
        raise ContactInputError(
            f"cells = {cells!r}: give whole numbers, at least {_FEWEST_CELLS} each way, as the patch needs a margin"
        )
    return int(both[0]), int(both[1])


def check_control(load: float | None, approach: float | None) -> None:
    """Exactly one of load [N] >= 0 and approach [m] is given and finite."""
    if (load is None) == (approach is None):
        raise ContactInputError(f"load = {load!r} N, approach = {approach!r} m: give exactly one of them")
    if load is not None and not (is_finite(load) and load >= 0):
        raise ContactInputError(f"load = {load!r} N: must be a finite number >= 0; a contact carries no tension")
    if approach is not None and not is_finite(approach):
        raise ContactInputError(f"approach = {approach!r} m: must be a finite number")


def check_rolling(direction: int, initial_slope: float = 1.0) -> None:
    """Refuses a direction that is not along x, and a part of Kalker's slope that is none."""
    if direction not in (1, -1):
        raise ContactInputError(f"direction {direction!r}: give +1 or -1")
    if not (is_finite(initial_slope) and 0 < initial_slope <= 1):
        raise ContactInputError(f"initial_slope {initial_slope!r}: give a part of Kalker's slope above 0, at most 1")


def contact_bounds(patch: Patch) -> tuple[float, float, float, float]:
    """Bounds of the cells in contact [m]; of the grid where none is."""
    if not patch.contact.any():
        return patch.grid.edges
    x, y = patch.grid.x[patch.contact.any(axis=1)], patch.grid.y[patch.contact.any(axis=0)]
    return float(x[0]), float(x[-1]), float(y[0]), float(y[-1])


def friction_law(friction: float | SlipDependentFriction) -> tuple[SlipDependentFriction, tuple[str, ...]]:
    """A law as it is, of a number Coulomb's; checked as by `check_friction`, with what that warns of."""
    if isinstance(friction, SlipDependentFriction):
        return friction, check_friction(friction.static)
    notes = check_friction(friction)
    return SlipDependentFriction(friction, friction, decay=np.inf), notes


def check_friction(friction: float) -> tuple[str, ...]:
    """Refuses a negative or infinite coefficient, warns of one above 1."""
    if not (is_finite(friction) and friction >= 0):
        raise ContactInputError(f"friction = {friction!r}: must be a finite number >= 0")
    if friction > _USUAL_FRICTION:
        return (f"friction {friction:g} is above {_USUAL_FRICTION:g}, which dry steel does not reach",)
    return ()


def _largest_slip(motion: Creepage | LocalCreepage, bounds: tuple[float, float, float, float]) -> float:
    x = max(abs(bounds[0]), abs(bounds[1]))
    if isinstance(motion, LocalCreepage):
        strips = np.abs(motion.strips(np.linspace(bounds[2], bounds[3], _STRIPS)))
        return float(np.hypot(strips[:, 0], strips[:, 1] + strips[:, 2] * x).max())
    y = max(abs(bounds[2]), abs(bounds[3]))
    return float(np.hypot(abs(motion.longitudinal) + abs(motion.spin) * y, abs(motion.lateral) + abs(motion.spin) * x))


def _check_finite(motion: Creepage | LocalCreepage) -> None:
    if isinstance(motion, LocalCreepage):  # which holds finite numbers only
        return
    if not isinstance(motion, Creepage):
        raise ContactInputError(f"creepage or shift {motion!r}: give a Creepage (Creepage(1e-3), for one)")
    if not all(map(is_finite, (motion.longitudinal, motion.lateral, motion.spin))):
        raise ContactInputError(f"{motion}: every part must be a finite number")


def check_creepage(creepage: Creepage | LocalCreepage, bounds: tuple[float, float, float, float]) -> tuple[str, ...]:
    """Refuses creepages whose rigid slip within the patch exceeds the rolling speed, as a spin in 1/mm or a creepage in
    percent does; warns above a tenth of it. bounds: (x_min, x_max, y_min, y_max) of the patch [m]."""
    _check_finite(creepage)
    slip = _largest_slip(creepage, bounds)
    middle = creepage.about((bounds[2] + bounds[3]) / 2)
    numbers = (
        f"creepages {middle.longitudinal:g}, {middle.lateral:g}, spin {middle.spin:g} 1/m over a patch within "
        f"{max(map(abs, bounds)):.3g} m of the origin make a rigid slip of {slip:.3g} times the rolling speed"
    )
    if slip > _IMPOSSIBLE_SLIP:
        raise ContactInputError(
            f"{numbers}: above {_IMPOSSIBLE_SLIP:g} nothing rolls; creepages are pure numbers (not percent), "
            "spin is in 1/m (a value per mm is a thousandth of it), the origin belongs near the patch"
        )
    return (f"{numbers}: check the units (spin in 1/m, creepages not in percent)",) if slip > _UNLIKELY_SLIP else ()


def check_shift(shift: Creepage, bounds: tuple[float, float, float, float]) -> None:
    """Refuses a shift longer than the patch: the half-space problem knows one position of the bodies only."""
    _check_finite(shift)
    length = max(bounds[1] - bounds[0], bounds[3] - bounds[2])
    distance = _largest_slip(shift, bounds)
    if distance > length:
        raise ContactInputError(
            f"shift of {distance:.3g} m is longer than the patch, {length:.3g} m: give it in m (sliding starts at "
            "micrometres)"
        )


def check_force(force: tuple[float | None, float | None], limit: float) -> None:
    """Refuses tangential forces [N] that friction cannot carry; limit = mu N [N]."""
    if not (isinstance(force, (tuple, list, np.ndarray)) and len(force) == 2):
        raise ContactInputError(f"tangential force {force!r}: give two along x and y [N], each a number or None")
    given = [value for value in force if value is not None]
    if not all(map(is_finite, given)):
        raise ContactInputError(f"tangential force {force!r} N: must be finite numbers")
    if given and np.hypot(*(given + [0.0])[:2]) >= limit * (1 - _ROUND_OFF):
        raise ContactInputError(
            f"tangential force {force!r} N reaches mu N = {limit:g} N: the bodies slide, no rigid slip belongs "
            "to it; lower the force or give the creepage"
        )


def check_inside(pressure: np.ndarray, grid: Grid) -> None:
    """Refuses a solution whose patch touches the grid's edge, and says on which side by how much."""
    sides = {"x_min": pressure, "x_max": pressure[::-1], "y_min": pressure.T, "y_max": pressure.T[::-1]}
    errors = []
    for name, field in sides.items():
        if field[0].any():
            step = grid.dx if name[0] == "x" else grid.dy
            errors.append(
                f"{name}: {np.count_nonzero(field[0])} cells, up to {field[0].max() / pressure.max():.0%} of the"
                f" largest pressure, extend by about {_missing(field, step):.2g} m"
            )
    if errors:
        raise PatchCutError(
            "the grid cuts the patch at "
            + "; ".join(errors)
            + " (or allow it with cut=True where the bodies end there)"
        )


def _missing(field: np.ndarray, step: float) -> float:
    """Length by which p^2, followed as a line, reaches beyond the first row; half the grid where it does not fall."""
    outer = float((field[0] ** 2).max())
    inner = float((field[1] ** 2).max()) if len(field) > 1 else outer
    return step * min(outer / (inner - outer) + 2, len(field) / 2) if inner > outer else step * (len(field) / 2 + 1)


def strain_warning(pressure: np.ndarray, first: Elastic, second: Elastic) -> tuple[str, ...]:
    """A note where the largest pressure [Pa] over the softer body's Young's modulus passes what steel bears, or what
    small strains allow."""
    young, highest = min(first.young, second.young), float(pressure.max())
    if highest <= max(_YIELDING * young, _LARGE_STRAIN * young * (young < _SOFTEST_STEEL)):
        return ()
    if highest <= _LARGE_STRAIN * young:
        return (
            f"largest pressure {highest:.3g} Pa is above {_YIELDING:g} of Young's modulus: steel yields from 1.6"
            " times its yield stress on, rail steels (500 to 900 MPa) at 0.8 to 1.4 GPa; the elastic pressure is"
            " too high and the patch too small",
        )
    return (
        f"largest pressure {highest:.3g} Pa is {highest / young:.2g} of Young's modulus: small strains no longer hold,"
        " and steel has yielded long before",
    )
