"""What can be wrong with a line of points: duplicates, gaps, reversals, loops, noise, kinks, vertical walls. Pure kernels."""

import numpy as np

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
            if min(points[j, 0], points[j + 1, 0]) > max(ax, ax + bx) or max(points[j, 0], points[j + 1, 0]) < min(ax, ax + bx):
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
    length = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    miss = []
    for i in range(0, len(points) - 3):  # the fourth point against the parabola through the three before it
        s = length[i : i + 4]
        weight = np.array([-np.prod([(s[3] - s[k]) / (s[j] - s[k]) for k in range(3) if k != j]) for j in range(3)] + [1.0])
        step = points[i + 3] - points[i]
        normal = np.array([-step[1], step[0]]) / max(np.hypot(*step), SAME)
        miss.append(abs(weight @ points[i : i + 4] @ normal) / np.sqrt(weight @ weight))
    return float(np.median(miss) / 0.6745)


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
