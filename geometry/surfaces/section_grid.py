"""Surface of a body through sections as a table: compiled heights between sections. Axes: geometry.axes.

Each section is sampled at equal distances u from its gauge face. Along the track face and heights follow the monotone
cubics of Fritsch and Carlson, which do not swing where unlike sections follow each other; across, a cubic through four
samples (Catmull and Rom), continuous in slope. Planes are exact, however they lie, and so are prisms.
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator

from geometry.surfaces.crossing_surface import NO_METAL
from kernel_cache import njit

SPACING = 0.25e-3  # of the samples across [m]
STEEPEST = 20.0  # slope with which a section is carried on beyond its ends, for the cubics only
MARGIN = 3  # samples beyond the ends
NOWHERE = 1e9  # x of a body that is not there [m]


class BodyGrid(NamedTuple):
    """One body at m stations and n distances from its gauge face [m].

    x : (m,);  face, face_slope : (m,) y of the face and dy/dx;  low, high : (m,) its ends in u
    first, step : of the distances u;  z, z_slope : (m, n) heights and dz/dx at one u
    """

    x: np.ndarray
    face: np.ndarray
    face_slope: np.ndarray
    low: np.ndarray
    high: np.ndarray
    first: float
    step: float
    z: np.ndarray
    z_slope: np.ndarray


class SectionGrids(NamedTuple):
    """Wing and nose of one crossing."""

    wing: BodyGrid
    nose: BodyGrid


def body_grid(x: np.ndarray, faces: np.ndarray, lines: list, spacing: float = SPACING) -> BodyGrid:
    """Table of a body. x, faces : (m,) [m];  lines : (m,) pairs (points (k, 2) of u, z with u growing, height(u))."""
    low, high = (np.array([line[0][i, 0] for line in lines]) for i in (0, -1))
    u = np.arange(low.min() - MARGIN * spacing, high.max() + (MARGIN + 1) * spacing, spacing)
    z = np.array([_carried_on(u, *line) for line in lines])
    slope = lambda values: PchipInterpolator(x, values, axis=0).derivative()(x)
    return BodyGrid(
        *(np.ascontiguousarray(v, float) for v in (x, faces, slope(faces), low, high)),
        float(u[0]),
        float(spacing),
        np.ascontiguousarray(z),
        np.ascontiguousarray(slope(z)),
    )


def no_body() -> BodyGrid:
    """A body that is nowhere."""
    pair, table = np.zeros(2), np.zeros((2, 4))
    return BodyGrid(np.array([NOWHERE, 2 * NOWHERE]), pair, pair, pair, pair, 0.0, SPACING, table, table)


def _carried_on(u: np.ndarray, points: np.ndarray, height) -> np.ndarray:
    """Heights at u; beyond the ends straight on, as steeply as the section ends."""
    inside = np.clip(u, points[0, 0], points[-1, 0])
    ends = [
        np.clip((points[b, 1] - points[a, 1]) / (points[b, 0] - points[a, 0]), -STEEPEST, STEEPEST)
        for a, b in ((0, 1), (-2, -1))
    ]
    return height(inside) + np.where(u < inside, ends[0], ends[1]) * (u - inside)


@njit(cache=True)
def grid_height(x, y, grid):
    """Height [m] at one point; NO_METAL beside the body and before or behind it."""
    last = len(grid.x) - 1
    if not (x >= grid.x[0] and x <= grid.x[last]):
        return NO_METAL
    i = min(np.searchsorted(grid.x, x, side="right") - 1, last - 1)
    d = grid.x[i + 1] - grid.x[i]
    t = (x - grid.x[i]) / d
    c = t * t * (3.0 - 2.0 * t)
    a, b, e = 1.0 - c, d * t * (1.0 - t) * (1.0 - t), d * t * t * (t - 1.0)
    face = a * grid.face[i] + b * grid.face_slope[i] + c * grid.face[i + 1] + e * grid.face_slope[i + 1]
    u = y - face
    if not (
        u >= grid.low[i] + t * (grid.low[i + 1] - grid.low[i])
        and u <= grid.high[i] + t * (grid.high[i + 1] - grid.high[i])
    ):
        return NO_METAL
    position = (u - grid.first) / grid.step
    j = min(max(int(position), 1), grid.z.shape[1] - 3)
    r = position - j
    z0 = a * grid.z[i, j - 1] + b * grid.z_slope[i, j - 1] + c * grid.z[i + 1, j - 1] + e * grid.z_slope[i + 1, j - 1]
    z1 = a * grid.z[i, j] + b * grid.z_slope[i, j] + c * grid.z[i + 1, j] + e * grid.z_slope[i + 1, j]
    z2 = a * grid.z[i, j + 1] + b * grid.z_slope[i, j + 1] + c * grid.z[i + 1, j + 1] + e * grid.z_slope[i + 1, j + 1]
    z3 = a * grid.z[i, j + 2] + b * grid.z_slope[i, j + 2] + c * grid.z[i + 1, j + 2] + e * grid.z_slope[i + 1, j + 2]
    return z1 + 0.5 * r * (z2 - z0 + r * (2.0 * z0 - 5.0 * z1 + 4.0 * z2 - z3 + r * (3.0 * (z1 - z2) + z3 - z0)))


@njit(cache=True)
def grid_heights(x, y, grid):
    """(n,) heights at n points."""
    out = np.empty(len(x))
    for i in range(len(x)):
        out[i] = grid_height(x[i], y[i], grid)
    return out
