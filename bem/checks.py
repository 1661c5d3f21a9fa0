"""What a caller gives: numbers that are finite, or positive, and points of the right shape; refused by name and
value."""

from __future__ import annotations

from numbers import Real
from typing import Any

import numpy as np


class ContactInputError(ValueError):
    """Input that no contact solver can answer: what, where, how large, what to do."""


def is_finite(value: object) -> bool:
    """Whether a value is a finite real number."""
    return isinstance(value, (Real, np.number)) and bool(np.isfinite(value))


def _shown(value: object) -> str:
    """As Python writes it, also NumPy's own numbers."""
    return repr(value.item() if isinstance(value, np.number) else value)


def refuse_unless_finite(error: type[ValueError], **values: object) -> None:
    """Raise `error` for the first value that is no finite number."""
    for name, value in values.items():
        if not is_finite(value):
            raise error(f"{name} = {_shown(value)}: must be a finite number")


def refuse_unless_positive(error: type[ValueError], **values: Any) -> None:
    """Raise `error` for the first value that is no finite number above zero."""
    for name, value in values.items():
        if not (is_finite(value) and value > 0):
            raise error(f"{name} = {_shown(value)}: must be a finite positive number")


def point_text(point: np.ndarray) -> str:
    """A point (2,) [m] as a message shows it, the same under every NumPy."""
    return f"({point[0]:.9g}, {point[1]:.9g})"


def plane_points(points: Any, error: type[ValueError]) -> np.ndarray:
    """Points (n, 2) [m] as floats; raises `error` for another shape, for what is no number, and for the first that is
    not finite."""
    try:
        points = np.asarray(points, float)
    except (TypeError, ValueError):
        raise error("points are no array of numbers: give an array (n, 2) of coordinates in metres") from None
    if points.ndim != 2 or points.shape[1] != 2:
        raise error(f"points have the shape {points.shape}: give an array (n, 2)")
    finite = np.isfinite(points).all(axis=1)
    if not finite.all():
        first = int(np.argmin(finite))
        raise error(
            f"point {first} of {len(points)} is {point_text(points[first])}, not finite: drop or repair it"
            f" ({int((~finite).sum())} such points)"
        )
    return points
