"""Surface of a body through sections as a table: compiled heights between sections. Axes: geometry.axes.

Between two sections points that match move on straight lines: beside the gauge face with that face, beside the far side
with that side, in between at one y. So a face that runs aslant stays sharp, and so does an edge that does not while the
face runs away from it. Along these lines heights follow cubics with the limited slopes of Fritsch and Butland, which do
not swing where unlike sections follow each other; across, a cubic through four samples (Catmull and Rom), continuous in
slope. Planes are exact, however they lie, and so are prisms.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from geometry.surfaces.bodies import NO_METAL
from geometry.surfaces.crossing_surface import smoothstep
from kernel_cache import njit

SPACING = 0.25e-3  # of the samples across [m]
STEEPEST = 20.0  # slope with which a section is carried on beyond its ends, for the cubics only
MARGIN = 3  # samples beyond the ends
NOWHERE = 1e9  # x of a body that is not there [m]
HELD, FREE = 10e-3, 25e-3  # from a side: up to there points move with it, from there on not [m]
HELD_SHARE, FREE_SHARE = 0.25, 0.5  # of the body's width, at most
LARGEST_MOVE = 12e-3  # of a side between two sections; where it jumps farther nothing moves with it [m]

_part = njit(cache=True, forceinline=True, error_model="numpy")

Line = tuple[np.ndarray, Callable[[np.ndarray], np.ndarray]]  # points (k, 2) of y, z and z(y)


class BodyGrid(NamedTuple):
    """One body at m stations and n lateral positions [m].

    x : (m,);  face, far : (m,) y of the gauge face and of the other end;  low : (m,) y where the body begins
    first, step : of the positions y;  z, slope : (m, n) heights, and their slope along the lines of matching points
    """

    x: np.ndarray
    face: np.ndarray
    far: np.ndarray
    low: np.ndarray
    first: float
    step: float
    z: np.ndarray
    slope: np.ndarray


class SectionGrids(NamedTuple):
    """Wing and nose of one crossing."""

    wing: BodyGrid
    nose: BodyGrid


def body_grid(x: np.ndarray, faces: np.ndarray, lines: list[Line], spacing: float = SPACING) -> BodyGrid:
    """Table of a body. x, faces : (m,) [m];  lines : (m,) sections"""
    low, far = (np.array([points[i, 0] for points, _ in lines]) for i in (0, -1))
    y = np.arange(low.min() - MARGIN * spacing, far.max() + (MARGIN + 1) * spacing, spacing)
    z = np.array([_carried_on(y, *line) for line in lines])
    slope = np.array([_slopes(i, x, y, faces, far, lines, z[i]) for i in range(len(x))])
    x, faces, far, low, z, slope = (np.ascontiguousarray(v, float) for v in (x, faces, far, low, z, slope))
    return BodyGrid(x, faces, far, low, float(y[0]), float(spacing), z, slope)


def every_second(grid: BodyGrid, first: int) -> BodyGrid:
    """The same through every second station alone, from number `first` on, and every second sample."""
    x, face, far, low, z = (rows[first::2] for rows in (grid.x, grid.face, grid.far, grid.low, grid.z))
    z, step = np.ascontiguousarray(z[:, ::2]), 2 * grid.step
    y = grid.first + step * np.arange(z.shape[1])
    apart = np.diff(x)[:, None]

    def rates(here: slice, there: slice) -> np.ndarray:
        ends = zip(face[here], far[here], face[there] - face[here], far[there] - far[here], z[there])
        return np.array([np.interp(y + shifts(y, *sides), y, row) for *sides, row in ends]) - z[here]

    last, rest = slice(None, -1), slice(1, None)
    ahead, behind = rates(last, rest) / apart, rates(rest, last) / -apart
    inner = limited(behind[:-1], ahead[1:], apart[:-1], apart[1:])
    return BodyGrid(x, face, far, low, grid.first, step, z, np.vstack([ahead[:1], inner, behind[-1:]]))


def no_body() -> BodyGrid:
    """A body that is nowhere."""
    pair, table = np.zeros(2), np.zeros((2, 4))
    return BodyGrid(np.array([NOWHERE, 2 * NOWHERE]), pair, pair, pair, 0.0, SPACING, table, table)


def limited(before: np.ndarray, after: np.ndarray, step_before: float, step_after: float) -> np.ndarray:
    """Slope at a station from those of the intervals beside it: their weighted harmonic mean, 0 where they differ in
    sign (Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300; the form of SciPy's PCHIP)."""
    one, two = 2 * step_after + step_before, step_after + 2 * step_before
    same = before * after > 0
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = (one + two) / (one / before + two / after)
    return np.where(same, mean, 0.0)


def heights_between(at: float, y: np.ndarray, x: np.ndarray, faces: np.ndarray, lines: list[Line]) -> np.ndarray:
    """(n,)  what grid_height tells at y (n,) between two stations, of the sections themselves, not of samples of them:
    what is wrong with it comes of their distance along x. NO_METAL beside the body."""
    i = int(np.searchsorted(x, at)) - 1
    low, far = (np.array([points[end, 0] for points, _ in lines]) for end in (0, -1))
    d = x[i + 1] - x[i]
    t = (at - x[i]) / d
    mean = lambda ends: (1 - t) * ends[i] + t * ends[i + 1]
    aside = shifts(y, mean(faces), mean(far), faces[i + 1] - faces[i], far[i + 1] - far[i])
    ends = []
    for k, matching in ((i, y - t * aside), (i + 1, y + (1 - t) * aside)):
        z = _carried_on(matching, *lines[k])
        ends.append((z, _slopes(k, x, matching, faces, far, lines, z)))
    (first, before), (last, behind) = ends
    c = t * t * (3 - 2 * t)
    height = (1 - c) * first + c * last + d * t * (1 - t) * ((1 - t) * before - t * behind)
    return np.where((y >= mean(low)) & (y <= mean(far)), height, NO_METAL)


def _slopes(i: int, x, y, faces, far, lines: list[Line], z: np.ndarray) -> np.ndarray:
    """(n,)  slope at station i along the lines of matching points through y, z."""
    rates = [_rate(i, k, x, y, faces, far, lines, z) for k in (i - 1, i + 1) if 0 <= k < len(x)]
    if len(rates) == 2:
        return limited(rates[0], rates[1], x[i] - x[i - 1], x[i + 1] - x[i])
    return rates[0] if rates else np.zeros_like(z)


def _rate(i: int, k: int, x, y, faces, far, lines: list[Line], z: np.ndarray) -> np.ndarray:
    """(n,)  mean slope from station i to its neighbour k along the lines of matching points through y."""
    moved = y + shifts(y, faces[i], far[i], faces[k] - faces[i], far[k] - far[i])
    return (_carried_on(moved, *lines[k]) - z) / (x[k] - x[i])


def _carried_on(y: np.ndarray, points: np.ndarray, height: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Heights at y; beyond the ends straight on, as steeply as the section ends."""
    inside = np.clip(y, points[0, 0], points[-1, 0])
    rise = lambda a, b: (points[b, 1] - points[a, 1]) / (points[b, 0] - points[a, 0])
    ends = np.clip([rise(0, 1), rise(-2, -1)], -STEEPEST, STEEPEST)
    return height(inside) + np.where(y < inside, *ends) * (y - inside)


@_part
def shift(y, face, far, face_move, far_move):
    """How far the point that matches y in a section lies aside in another, whose sides lie aside by these moves."""
    width = far - face
    held, free = min(HELD, HELD_SHARE * width), min(FREE, FREE_SHARE * width)
    aside = 0.0
    if abs(face_move) < LARGEST_MOVE:
        aside += face_move * (1.0 - smoothstep((y - face - held) / (free - held)))
    if abs(far_move) < LARGEST_MOVE:
        aside += far_move * (1.0 - smoothstep((far - y - held) / (free - held)))
    return aside


@njit(cache=True)
def shifts(y, face, far, face_move, far_move):
    """(n,) of `shift`."""
    out = np.empty(len(y))
    for i in range(len(y)):
        out[i] = shift(y[i], face, far, face_move, far_move)
    return out


@_part
def across(row, position):
    """Value of evenly spaced samples (n,) at a position counted in samples."""
    j = min(max(int(position), 1), len(row) - 3)
    r = position - j
    a, b, c, d = row[j - 1], row[j], row[j + 1], row[j + 2]
    return b + 0.5 * r * (c - a + r * (2.0 * a - 5.0 * b + 4.0 * c - d + r * (3.0 * (b - c) + d - a)))


@_part
def grid_height(x, y, grid):
    """Height [m] at one point; NO_METAL beside the body and before or behind it."""
    last = len(grid.x) - 1
    if not (x >= grid.x[0] and x <= grid.x[last]):
        return NO_METAL
    i = min(np.searchsorted(grid.x, x, side="right") - 1, last - 1)
    d = grid.x[i + 1] - grid.x[i]
    t = (x - grid.x[i]) / d
    low, far = (1.0 - t) * grid.low[i] + t * grid.low[i + 1], (1.0 - t) * grid.far[i] + t * grid.far[i + 1]
    if not (y >= low and y <= far):
        return NO_METAL
    face_move, far_move = grid.face[i + 1] - grid.face[i], grid.far[i + 1] - grid.far[i]
    aside = shift(y, grid.face[i] + t * face_move, far, face_move, far_move)
    here, there = (y - t * aside - grid.first) / grid.step, (y + (1.0 - t) * aside - grid.first) / grid.step
    c = t * t * (3.0 - 2.0 * t)
    height = (1.0 - c) * across(grid.z[i], here) + c * across(grid.z[i + 1], there)
    rise = t * (1.0 - t) * ((1.0 - t) * across(grid.slope[i], here) - t * across(grid.slope[i + 1], there))
    return height + d * rise


@njit(cache=True)
def grid_heights(x, y, grid):
    """(n,) heights at n points."""
    out = np.empty(len(x))
    for i in range(len(x)):
        out[i] = grid_height(x[i], y[i], grid)
    return out
