"""The bodies of a pass by number and name; what every crossing consists of, wing and nose, and how it answers for
their heights. Axes: geometry.axes."""

from enum import IntEnum
from typing import Any

import numpy as np


class PassBody(IntEnum):
    """A body by its number in every mesh, table of steels and field file of a pass."""

    WING = 0
    NOSE = 1
    WHEEL = 2


CROSSING = PassBody.WING, PassBody.NOSE
REGIONS = tuple(body.name.lower() for body in PassBody)  # names, in the order of the numbers
BODIES = tuple(REGIONS[body] for body in CROSSING)
NO_METAL = -1.0  # height where a body is not: far below any floor [m]


class CrossingError(ValueError):
    """A crossing, or a position on it, that does not exist: says what, where, how large."""


class TwoBodies:
    """A crossing of two bodies; a family adds `heights`, `x_range`, and `modelled`, what lies within it in words."""

    def heights(self, x: np.ndarray, y: np.ndarray, body: str) -> np.ndarray:
        """Heights (n,) [m] of "wing" or "nose" at x, y (n,); NO_METAL where the body is not."""
        raise NotImplementedError

    def _check_x(self: Any, x: np.ndarray | float) -> None:
        low, high = self.x_range
        x = np.asarray(x, float)
        outside = ~((x >= low) & (x <= high))
        if outside.any():
            raise CrossingError(f"x = {x[outside][0]:g} m is outside {self.modelled}, {low:g} to {high:g} m")

    def top_height(self, x: np.ndarray, y: np.ndarray, body: str) -> np.ndarray:
        """Height z [m] of the surface of "wing" or "nose" at x, y [m] (broadcast), as exact as `heights`; NaN where the
        body is not. Raises CrossingError for positions outside the crossing, and for other bodies."""
        x, y = (np.array(v, float) for v in np.broadcast_arrays(x, y))
        self._check_x(x)
        if body not in BODIES:
            raise CrossingError(f"unknown body {body!r}; known: {', '.join(BODIES)}")
        height = self.heights(x.ravel(), y.ravel(), body).reshape(x.shape)
        return np.where(height > 0.5 * NO_METAL, height, np.nan)
