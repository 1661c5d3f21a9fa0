"""From the cells of patches to a field d(x, y) in plan, each where it lay on the rail; the volume is kept."""

from typing import NamedTuple

import numpy as np

from geometry.surfaces.bodies import BODIES
from kernel_cache import njit


class Footprints(NamedTuple):
    """Grids of k patches in plan. body : (k,) 0 wing, 1 nose;  centre : (k, 2) x, y [m];  along, across : (k,) sides of
    a cell in plan [m]"""

    body: np.ndarray
    centre: np.ndarray
    along: np.ndarray
    across: np.ndarray


class ReachedLines(NamedTuple):
    """Shares of lines across the rail in the strips of k patches. first : (k,) line of the first share;  share :
    (k, l, ny), of each strip 1 in all"""

    first: np.ndarray
    share: np.ndarray


def deposit(feet: Footprints, cells: np.ndarray, scale: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(2, m, n) depths [m] on the lines of an even grid x (m,), y (n,) [m] by k patches, wing and nose: each column
    of cells across the rail goes to the two lines next to it, so that its middle along the rail is kept, and across by
    what the cells cover.

    cells : (k, nx, ny) depth of each [m];  scale : (k,) their width across along the rail's face [m] times what their
    depth is multiplied by (the path that they stand for over the lines' distance)
    Raises ValueError for a patch that begins or ends beyond the lines.
    Error: volume within the grid to round-off (tests/damage/test_deposit.py).
    """
    half = feet.along * cells.shape[1] / 2
    low, high = (feet.centre[:, 0] - half).min(initial=np.inf), (feet.centre[:, 0] + half).max(initial=-np.inf)
    if low < x[0] or high > x[-1]:
        raise ValueError(
            f"patches reach from x = {low:.3f} to {high:.3f} m, the field from {x[0]:.3f} to {x[-1]:.3f}: give a longer"
            " one"
        )
    out = np.zeros((len(BODIES), len(x), len(y)))
    lines = int(np.ceil(2 * half.max(initial=0.0) / (x[1] - x[0]))) + 2
    _deposit(feet, cells, scale, x, y, np.empty((lines, cells.shape[2])), out)
    return out


@njit(cache=True)
def _deposit(feet, cells, scale, x, y, strips, out):
    """deposit into out (2, m, n); strips (lines, ny) is memory for one patch's strips on the lines that it reaches."""
    dx, nx, ny = x[1] - x[0], cells.shape[1], cells.shape[2]
    for k in range(len(feet.body)):
        rear = (feet.centre[k, 0] - (nx - 1) / 2 * feet.along[k] - x[0]) / dx
        start = min(max(int(np.floor(rear)), 0), len(x) - 2)
        end = start
        strips[:] = 0.0
        for i in range(nx):
            at = rear + i * feet.along[k] / dx
            line = min(max(int(np.floor(at)), 0), len(x) - 2)
            near = at - line
            end = line + 1
            for j in range(ny):
                strips[line - start, j] += (1.0 - near) * cells[k, i, j]
                strips[line + 1 - start, j] += near * cells[k, i, j]
        for line in range(start, end + 1):
            add_across(feet.centre[k, 1], feet.across[k], strips[line - start], scale[k], y, out[feet.body[k], line])


def deposit_reached(
    feet: Footprints, strips: np.ndarray, scale: np.ndarray, reach: ReachedLines, x: np.ndarray, y: np.ndarray
) -> np.ndarray:
    """(2, m, n) depths [m] as of deposit by strips (k, ny) [m], each of which goes to the lines by its shares."""
    out = np.zeros((len(BODIES), len(x), len(y)))
    _deposit_reached(feet, np.asarray(strips, float), scale, reach, y, out)
    return out


@njit(cache=True)
def _deposit_reached(feet, strips, scale, reach, y, out):
    for k in range(len(feet.body)):
        for line in range(reach.share.shape[1]):
            part = strips[k] * reach.share[k, line]
            if part.any():
                into = out[feet.body[k], reach.first[k] + line]
                add_across(feet.centre[k, 1], feet.across[k], part, scale[k], y, into)


@njit(cache=True)
def deposit_across(body, centre, width, strips, y, out):
    """Add strips (k, ny), depth times width [m2], that lie about centre (k,) with widths in plan (k,) [m] to depths out
    (2, n) at y (n,), evenly spaced [m]."""
    for k in range(len(body)):
        add_across(centre[k], width[k], strips[k].copy(), 1.0, y, out[body[k]])


@njit(cache=True)
def add_across(centre, width, strips, scale, y, out):
    """Add scale times the strips (ny,), from one edge to the other about centre, to out (n,) by what they cover; they
    are summed up in their own memory."""
    dy, ny = y[1] - y[0], len(strips)
    edge = centre - ny / 2 * width
    first = max(int(np.floor((edge - y[0]) / dy + 0.5)), 0)
    last = min(int(np.floor((edge + ny * width - y[0]) / dy + 0.5)), len(y) - 1)
    for j in range(1, ny):
        strips[j] += strips[j - 1]
    before = _up_to(y[first] - dy / 2, edge, width, strips)
    for j in range(first, last + 1):
        after = _up_to(y[j] + dy / 2, edge, width, strips)
        out[j] += scale * (after - before) / dy
        before = after


@njit(cache=True)
def _up_to(y, edge, width, summed):
    """Sum of the strips up to y; summed (ny,) : up to the end of each, linear in between."""
    at = (y - edge) / width
    if at <= 0.0:
        return 0.0
    n = int(at)
    if n >= len(summed):
        return summed[-1]
    low = summed[n - 1] if n > 0 else 0.0
    return low + (at - n) * (summed[n] - low)
