"""From the strips of patches to a field d(x, y) in plan, each where it lay on the rail; the volume is kept."""

from typing import NamedTuple

import numpy as np

from geometry.surfaces.bodies import BODIES
from kernel_cache import njit


class Footprints(NamedTuple):
    """Strips of k patches in plan. body : (k,) 0 wing, 1 nose;  centre : (k, 2) x, y [m];  across : (k,) width of a
    strip in plan [m]"""

    body: np.ndarray
    centre: np.ndarray
    across: np.ndarray


class ReachedLines(NamedTuple):
    """Shares of lines across the rail in the strips of k patches. first : (k,) line of the first share;  share :
    (k, l, ny), of each strip 1 in all"""

    first: np.ndarray
    share: np.ndarray


def deposit(feet: Footprints, strips: np.ndarray, scale: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(2, m, n) depths [m] on the lines of an even grid x (m,), y (n,) [m] by k patches, wing and nose: each goes to
    the two lines next to it, so that its middle along the rail is kept, and across by what the strips cover.

    strips : (k, ny) depth of each [m];  scale : (k,) their width along the rail's face [m] times what their depth is
    multiplied by (the path that they stand for over the lines' distance)
    Raises ValueError for a patch beyond the lines.
    Error: volume within the grid to round-off (tests/damage/test_deposit.py).
    """
    low, high = feet.centre[:, 0].min(initial=np.inf), feet.centre[:, 0].max(initial=-np.inf)
    if low < x[0] or high > x[-1]:
        raise ValueError(
            f"patches reach from x = {low:.3f} to {high:.3f} m, the field from {x[0]:.3f} to {x[-1]:.3f}: give a longer"
            " one"
        )
    at = (feet.centre[:, 0] - x[0]) / (x[1] - x[0])
    first = np.clip(np.floor(at).astype(int), 0, len(x) - 2)
    share = np.stack([1 - (at - first), at - first], axis=1)
    return _on_plan(feet, share[:, :, None] * strips[:, None], scale, first, x, y)


def deposit_reached(
    feet: Footprints, strips: np.ndarray, scale: np.ndarray, reach: ReachedLines, x: np.ndarray, y: np.ndarray
) -> np.ndarray:
    """(2, m, n) depths [m] as of deposit by strips (k, ny) [m], each of which goes to the lines by its shares."""
    return _on_plan(feet, strips[:, None] * reach.share, scale, reach.first, x, y)


def _on_plan(
    feet: Footprints, strips: np.ndarray, scale: np.ndarray, first: np.ndarray, x: np.ndarray, y: np.ndarray
) -> np.ndarray:
    """(2, m, n) by strips (k, l, ny) on l lines from line first (k,) on."""
    out = np.zeros((len(BODIES), len(x), len(y)))
    add_across(feet.body, first, feet.centre[:, 1], feet.across, strips * scale[:, None, None], y, out)
    return out


@njit(cache=True)
def add_across(body, first, centre, width, strips, y, out):
    """Add strips (k, l, ny), depth times width [m2], on l lines from first (k,) on, to depths out (2, m, n) at y (n,),
    evenly spaced [m], by what they cover: they lie about centre (k,), each `width` (k,) wide in plan [m], and are
    summed up in their own memory. Lines beyond the last are left out."""
    for k in range(len(body)):
        for line in range(min(strips.shape[1], out.shape[1] - first[k])):
            if strips[k, line].any():
                _add_line(centre[k], width[k], strips[k, line], y, out[body[k], first[k] + line])


@njit(cache=True)
def _add_line(centre, width, strips, y, out):
    """Add the strips (ny,), from one edge to the other about centre, to out (n,)."""
    dy, ny = y[1] - y[0], len(strips)
    edge = centre - ny / 2 * width
    first = max(int(np.floor((edge - y[0]) / dy + 0.5)), 0)
    last = min(int(np.floor((edge + ny * width - y[0]) / dy + 0.5)), len(y) - 1)
    for j in range(1, ny):
        strips[j] += strips[j - 1]
    before = _up_to(y[first] - dy / 2, edge, width, strips)
    for j in range(first, last + 1):
        after = _up_to(y[j] + dy / 2, edge, width, strips)
        out[j] += (after - before) / dy
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
