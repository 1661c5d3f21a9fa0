"""What can be wrong with a line of points: duplicates, gaps, reversals, loops, noise, kinks, vertical walls. Pure kernels."""

import numpy as np
from numba import njit

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


FARTHEST = 4.0  # times the noise: a point that a smoothing spline would move farther is a corner that it cannot follow


def smoothed(points: np.ndarray, corners: np.ndarray, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """Points moved across the line onto smoothing splines of its length, and corners (indices): those given and those found.

    The amount follows from the points themselves (generalised cross-validation). Where a spline would move a point by more than FARTHEST
    times the noise [m] it rounds what it cannot follow: the stretch is cut at that point, and the splines are fitted anew. A cut where the
    smoothed line turns more sharply than its noise explains is a corner that lay between points; at any other the point was an outlier,
    and the cubic through its neighbours takes its place.
    """
    corners = np.asarray(corners, int)
    cuts, known = corners, {}
    for _ in range(len(points) // 8):
        move = across(points, cuts, known)
        far, ends = np.hypot(*move.T), np.concatenate([[0], cuts, [len(points) - 1]]).astype(int)
        worst = np.array([a + int(np.argmax(far[a : b + 1])) for a, b in zip(ends[:-1], ends[1:])])
        if (far[worst] <= FARTHEST * noise).all():
            break
        cuts = np.union1d(cuts, worst[far[worst] > FARTHEST * noise])
    quiet = points + move
    sharp = corner_turns(quiet, noise)
    for k in np.setdiff1d(cuts, np.union1d(corners, np.flatnonzero(sharp) + 1)).astype(int):
        quiet[k] = from_neighbours(quiet, k)
    return quiet, np.union1d(corners, np.intersect1d(cuts, np.flatnonzero(sharp) + 1)).astype(int)


def corner_turns(points: np.ndarray, noise: float) -> np.ndarray:
    """(n - 2,)  True at inner points where the line turns by more than SHARP and than its noise makes it turn."""
    step = np.hypot(*np.diff(points, axis=0).T)
    return (np.abs(turns(points)) > SHARP) & (np.abs(turns(points)) > 8.0 * noise / np.minimum(step[:-1], step[1:]))


def from_neighbours(points: np.ndarray, k: int) -> np.ndarray:
    """(2,)  the place of point k on the cubic through two neighbours on either side; at the rims as many as there are."""
    near = np.array([i for i in (k - 2, k - 1, k + 1, k + 2) if 0 <= i < len(points)])
    s = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(points[near[0] : near[-1] + 1], axis=0).T))])
    own = near - near[0]
    weight = [np.prod([(s[k - near[0]] - s[j]) / (s[i] - s[j]) for j in own if j != i]) for i in own]
    return np.array(weight) @ points[near]


def across(points: np.ndarray, cuts: np.ndarray, known: dict[tuple[int, int], np.ndarray]) -> np.ndarray:
    """(n, 2)  way of each point across the line to the smoothing spline of its stretch between cuts; 0 at both ends of a stretch.

    known : ways of stretches found before, by their ends; it grows
    """
    out = np.zeros_like(points)
    ends = np.concatenate([[0], cuts, [len(points) - 1]]).astype(int)
    for a, b in zip(ends[:-1], ends[1:]):
        if b - a >= 7 and (a, b) not in known:
            known[a, b] = stretch_across(points[a : b + 1])
        out[a + 1 : b] = known[a, b] if b - a >= 7 else 0.0
    return out


def stretch_across(part: np.ndarray) -> np.ndarray:
    """(n - 2, 2)  way of the inner points of one stretch to its smoothing spline."""
    s = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(part, axis=0).T))])
    if np.any(np.diff(s) <= 0):
        return np.zeros((len(part) - 2, 2))
    step = np.gradient(part, axis=0)
    normal = np.column_stack([-step[:, 1], step[:, 0]]) / np.hypot(*step.T)[:, None]
    fits = np.column_stack([smoothing_spline(s / s[-1], part[:, k] / s[-1]) * s[-1] for k in (0, 1)])
    return (((fits - part) * normal).sum(axis=1)[:, None] * normal)[1:-1]


DENSE = 600  # points up to which all eigenvalues of the spline's roughness are found at once
UNEVEN = 0.1  # of the mean step: with a smaller one the small eigenvalues drown in the round-off of the largest, n^4 / UNEVEN^3


def smoothing_spline(s: np.ndarray, value: np.ndarray) -> np.ndarray:
    """(n,)  natural cubic smoothing spline at its own points s (n,), growing, its amount by generalised cross-validation.

    In the eigenvectors of the roughness K = Q R^-1 Q' the spline is value / (1 + amount * eigenvalue): every amount costs n operations.
    Source: Green and Silverman, Nonparametric Regression (1994), ch. 2 and 3. scipy's make_smoothing_spline, which stops at the
    first amount it finds, serves where there are too many points or steps of very unlike length.
    """
    from scipy.interpolate import make_smoothing_spline
    from scipy.linalg import eigh, solveh_banded
    from scipy.optimize import minimize_scalar

    n, h = len(s), np.diff(s)
    if n > DENSE or h.min() < UNEVEN * h.mean():
        return make_smoothing_spline(s, value)(s)
    q = np.zeros((n, n - 2))
    inner = np.arange(n - 2)
    q[inner, inner], q[inner + 1, inner], q[inner + 2, inner] = 1 / h[:-1], -1 / h[:-1] - 1 / h[1:], 1 / h[1:]
    band = np.vstack([np.append(0.0, h[1:-1] / 6), (h[:-1] + h[1:]) / 3])
    rough, basis = eigh(q @ solveh_banded(band, q.T))
    rough[:2] = 0.0  # straight lines
    rough = np.maximum(rough, 0.0)
    part = basis.T @ value
    share = lambda log_amount: 1 - 1 / (1 + np.exp(log_amount) * rough)
    score = lambda log_amount: np.sum((share(log_amount) * part) ** 2) / np.sum(share(log_amount)) ** 2
    amounts = -np.log(rough[-1]) + np.linspace(-5, np.log(rough[-1] / rough[2]) + 5, 40)
    best = int(np.argmin([score(a) for a in amounts]))
    found = minimize_scalar(score, bounds=(amounts[max(best - 1, 0)], amounts[min(best + 1, 39)]), method="bounded", options={"xatol": 1e-4})
    return value - basis @ (share(found.x) * part)
