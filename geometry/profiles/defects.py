"""What can be wrong with a line of points: duplicates, gaps, reversals, loops, noise, kinks, vertical walls. Pure
kernels."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from geometry.profiles.profile import lengths
from kernel_cache import njit

SAME = 1e-9  # points nearer than this are one [m]
BACK = np.pi / 2  # a turn sharper than this is a reversal [rad]


def repeated(points: np.ndarray) -> np.ndarray:
    """(n,)  True for each point that repeats the one before it."""
    return np.concatenate([[False], np.hypot(*np.diff(points, axis=0).T) < SAME])


def turns(points: np.ndarray) -> np.ndarray:
    """(n - 2,)  turn of the line at its inner points, left positive, within +- pi [rad]."""
    step = np.diff(points, axis=0)
    angle = np.arctan2(step[:, 1], step[:, 0])
    return (np.diff(angle) + np.pi) % (2 * np.pi) - np.pi


def reversals(points: np.ndarray) -> np.ndarray:
    """Indices of inner points where the line turns back on itself by more than a right angle."""
    return np.flatnonzero(np.abs(turns(points)) > BACK) + 1


def without_zigzag(points: np.ndarray, most: int) -> np.ndarray:
    """Indices of the points kept when points that make the line turn back are taken out, most in all.

    Of the two ends of a backward step the one goes whose loss changes the line's length most.
    """
    keep = np.arange(len(points))
    for _ in range(most):
        bad = reversals(points[keep])
        if len(bad) == 0:
            break
        at = bad[0]
        options = [i for i in (at, at + 1) if 0 < i < len(keep) - 1]
        shorter = [np.hypot(*np.diff(points[np.delete(keep, i)], axis=0).T).sum() for i in options]
        keep = np.delete(keep, options[int(np.argmin(shorter))])
    return keep


@njit(cache=True)
def first_crossing(points):
    """Segments (i, j), i + 1 < j, that cross; (-1, -1) where the line does not cross itself."""
    n = len(points) - 1
    for i in range(n):
        ax, ay = points[i]
        bx, by = points[i + 1, 0] - ax, points[i + 1, 1] - ay
        for j in range(i + 2, n):
            if min(points[j, 0], points[j + 1, 0]) > max(ax, ax + bx) or max(points[j, 0], points[j + 1, 0]) < min(
                ax, ax + bx
            ):
                continue
            cx, cy = points[j, 0] - ax, points[j, 1] - ay
            dx, dy = points[j + 1, 0] - points[j, 0], points[j + 1, 1] - points[j, 1]
            cross = bx * dy - by * dx
            if cross == 0.0:
                continue
            s, t = (cx * dy - cy * dx) / cross, (cx * by - cy * bx) / cross
            if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0:
                return i, j
    return -1, -1


def noise_level(points: np.ndarray) -> float:
    """Scatter of the points across the line [m]: from third differences, which see no smooth curve of even spacing.

    Robust (median), so that kinks and a few spikes do not count. White noise of standard deviation s gives s.
    """
    if len(points) < 8:
        return 0.0
    s = sliding_window_view(lengths(points), 4)  # (m, 4)
    weight = np.ones(s.shape)  # of the fourth point against the parabola through the three before it
    for j in range(3):
        others = s[:, [k for k in range(3) if k != j]]
        weight[:, j] = -np.prod((s[:, 3:] - others) / (s[:, j : j + 1] - others), axis=1)
    step = points[3:] - points[:-3]
    normal = np.column_stack([-step[:, 1], step[:, 0]]) / np.maximum(np.hypot(*step.T), SAME)[:, None]
    miss = np.abs(np.einsum("mj,mkj,mk->m", weight, sliding_window_view(points, 4, axis=0), normal))
    return float(np.median(miss / np.sqrt((weight**2).sum(axis=1))) / 0.6745)


SHARP = np.radians(8.0)  # a turn that is less is no corner [rad]


def kinks(points: np.ndarray, noise: float, least: float = SHARP) -> np.ndarray:
    """Indices of points where the line turns more than its noise and its neighbours' bend explain."""
    turn = np.abs(turns(points))
    step = np.hypot(*np.diff(points, axis=0).T)
    by_noise = 8.0 * noise / np.minimum(step[:-1], step[1:])
    around = np.maximum(np.append(turn[1:], 0.0), np.concatenate([[0.0], turn[:-1]]))
    return np.flatnonzero((turn > least) & (turn > by_noise) & (turn > 3 * around)) + 1


def gaps(points: np.ndarray, least: float = 3e-3) -> np.ndarray:
    """Indices i of steps from point i to i + 1 that are long [m] and ten times the usual."""
    step = np.hypot(*np.diff(points, axis=0).T)
    return np.flatnonzero((step > least) & (step > 10 * np.median(step)))


def thinned(points: np.ndarray, corners: np.ndarray, least: float) -> np.ndarray:
    """Indices of the points left when each but the corners (indices) and both ends lies at least `least` [m] from the
    one before."""
    fixed = np.zeros(len(points), bool)
    fixed[[0, *np.asarray(corners, int).tolist(), -1]] = True
    keep = [0]
    for i in range(1, len(points)):
        near = np.hypot(*(points[i] - points[keep[-1]])) < least
        if near and fixed[i] and not fixed[keep[-1]]:
            keep[-1] = i
        elif not near or fixed[i]:
            keep.append(i)
    return np.array(keep)


def spikes(points: np.ndarray, least: float, most: int) -> list[int]:
    """Indices of single points that lie more than `least` [m] off the cubic through two neighbours on either side, the
    largest first, `most` at most.

    A spike turns the line to and fro: with the point put on that cubic the line turns by less than a third as much. At
    a corner it turns on.
    """
    points = points.copy()
    found: list[int] = []
    for _ in range(most):
        position = between_neighbours(points)
        off = np.hypot(*(position - points[2:-2]).T)
        off[[k - 2 for k in found]] = 0.0
        for i in np.argsort(-off)[:8]:
            k = int(i) + 2
            if off[i] < least:
                return found
            first = max(k - 3, 0)
            near = points[first : k + 4].copy()
            before = np.abs(turns(near)).sum()
            near[k - first] = position[i]
            if np.abs(turns(near)).sum() < before / 3:
                found.append(k)
                points[k] = position[i]
                break
        else:
            break
    return found


def between_neighbours(points: np.ndarray) -> np.ndarray:
    """(n - 4, 2)  for each point but two at either end, the cubic through two neighbours on either side where it passes
    beside the point."""
    near = np.stack([points[:-4], points[1:-3], points[3:-1], points[4:]])
    chord = near[2] - near[1]
    share = np.clip(
        ((points[2:-2] - near[1]) * chord).sum(axis=1) / np.maximum((chord**2).sum(axis=1), SAME**2), 0.0, 1.0
    )
    s = np.concatenate(
        [np.zeros((1, len(chord))), np.cumsum(np.hypot(*np.moveaxis(np.diff(near, axis=0), -1, 0)), axis=0)]
    )
    at = s[1] + share * (s[2] - s[1])
    weight = [np.prod([(at - s[j]) / (s[i] - s[j]) for j in range(4) if j != i], axis=0) for i in range(4)]
    return sum(w[:, None] * p for w, p in zip(weight, near))


def overhang(points: np.ndarray) -> tuple[float, float]:
    """How far the rising side of a line leans over its own foot at most, and how far below its top that begins [m]; (0,
    0) where it does not."""
    rising = points[: int(np.argmax(points[:, 1])) + 1][::-1]  # from the top down
    beyond = rising[:, 0] - np.minimum.accumulate(rising[:, 0])
    at = int(np.argmax(beyond))
    return float(beyond[at]), float(rising[0, 1] - rising[at, 1]) if beyond[at] > 0 else 0.0
