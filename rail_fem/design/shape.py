"""How far a crossing that was found differs from the one it was sought from: heights of the running surfaces."""

from typing import NamedTuple

import numpy as np

from geometry.surfaces.any_crossing import AnyCrossing
from geometry.surfaces.bodies import BODIES, NO_METAL

ALONG, ACROSS = 10e-3, 1e-3  # spacing of the positions that are looked at [m]
Y_RANGE = -40e-3, 120e-3  # [m]
RUNNING = -12e-3  # what lies deeper carries no tread [m]
LEAST = 5e-6  # that has a place: less is 0.00 mm [m]
STEEP = 0.5  # slope across the rail of a face that is no running surface [1]


class ShapeDifference(NamedTuple):
    """Of one body along x (n,) [m]: most metal added and most taken away (n,) [m], the y (n,) of both [m]; NaN where
    one of the two crossings has no running surface."""

    body: str
    x: np.ndarray
    added: np.ndarray
    taken: np.ndarray
    y_added: np.ndarray
    y_taken: np.ndarray


def shape_difference(before: AnyCrossing, after: AnyCrossing, low: float, high: float) -> list[ShapeDifference]:
    """Of wing (with leg) and nose between x = low and high [m]; positive where metal is added."""
    x = np.arange(low, high, ALONG)
    y = np.arange(*Y_RANGE, ACROSS)
    return [_of_body(before, after, body, x, y) for body in BODIES]


def _of_body(before: AnyCrossing, after: AnyCrossing, body: str, x: np.ndarray, y: np.ndarray) -> ShapeDifference:
    at_x, at_y = (values.ravel() for values in np.meshgrid(x, y, indexing="ij"))
    shape = len(x), len(y)
    old, new = (running_surface(crossing.heights(at_x, at_y, body).reshape(shape)) for crossing in (before, after))
    difference = new - old
    known = np.isfinite(difference).any(axis=1)
    most = np.where(np.isfinite(difference), difference, -np.inf).argmax(axis=1)
    least = np.where(np.isfinite(difference), difference, np.inf).argmin(axis=1)
    pick = lambda index: np.where(known, difference[np.arange(len(x)), index], np.nan)
    return ShapeDifference(body, x, np.maximum(pick(most), 0), np.minimum(pick(least), 0), y[most], y[least])


def running_surface(heights: np.ndarray) -> np.ndarray:
    """Heights (n, m) at ACROSS apart where they are a running surface, NaN elsewhere: faces, floors, no metal."""
    steep = np.abs(np.gradient(heights, ACROSS, axis=1)) > STEEP
    return np.where((heights > max(RUNNING, 0.5 * NO_METAL)) & ~steep, heights, np.nan)


def told(difference: ShapeDifference) -> list[str]:
    """Body, most added and most taken away [mm] with their x, y [mm], "none" below LEAST; "-" for a body that is
    nowhere in both."""
    if not np.isfinite(difference.added).any():
        return [difference.body, "-", "-"]
    top, bottom = int(np.nanargmax(difference.added)), int(np.nanargmin(difference.taken))
    where = lambda i, y: f"at x = {1e3 * difference.x[i]:.0f}, y = {1e3 * y[i]:.0f}"
    place = lambda value, i, y: f"{1e3 * value:+.2f} {where(i, y)}" if abs(value) >= LEAST else "none"
    return [
        difference.body,
        place(difference.added[top], top, difference.y_added),
        place(difference.taken[bottom], bottom, difference.y_taken),
    ]
