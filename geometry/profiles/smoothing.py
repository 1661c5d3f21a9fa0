"""Scatter taken out of a line of points by smoothing splines that leave corners sharp and put outliers back in line.
Pure kernels."""

import numpy as np

from geometry.profiles.defects import SHARP, turns

FARTHEST = 4.0  # times the noise: a point that a smoothing spline would move farther is a corner that it cannot follow


def smoothed(
    points: np.ndarray, corners: np.ndarray, noise: float, amount: float | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Points moved onto smoothing splines of its length, and corners (indices): those given and those found.

    The amount follows from the points themselves (generalised cross-validation); or the splines move points by `amount`
    [m] rms. Where a spline would move a point by more than FARTHEST times the noise [m] it rounds what it cannot
    follow: the stretch is cut at that point, and the splines are fitted anew. A cut where the smoothed line turns more
    sharply than its noise explains is a corner that lay between points; at any other the point was an outlier, and the
    cubic through its neighbours takes its place.
    """
    corners = cuts = np.asarray(corners, int)
    known: dict[tuple[int, int], np.ndarray] = {}
    for _ in range(len(points) // 8):
        move = displacements(points, cuts, known, amount)
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
    """(2,)  the position of point k on the cubic through two neighbours on either side; at the rims as many as there
    are."""
    near = np.array([i for i in (k - 2, k - 1, k + 1, k + 2) if 0 <= i < len(points)])
    s = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(points[near[0] : near[-1] + 1], axis=0).T))])
    own = near - near[0]
    weight = [np.prod([(s[k - near[0]] - s[j]) / (s[i] - s[j]) for j in own if j != i]) for i in own]
    return np.array(weight) @ points[near]


def displacements(
    points: np.ndarray, cuts: np.ndarray, known: dict[tuple[int, int], np.ndarray], amount: float | None = None
) -> np.ndarray:
    """(n, 2)  displacement of each point to the smoothing spline of its stretch between cuts; 0 at both ends of a
    stretch.

    known : displacements of stretches found before, by their ends; it grows
    """
    out = np.zeros_like(points)
    ends = np.concatenate([[0], cuts, [len(points) - 1]]).astype(int)
    for a, b in zip(ends[:-1], ends[1:]):
        if b - a >= 7 and (a, b) not in known:
            known[a, b] = stretch_move(points[a : b + 1], amount)
        out[a + 1 : b] = known[a, b] if b - a >= 7 else 0.0
    return out


def stretch_move(part: np.ndarray, amount: float | None = None) -> np.ndarray:
    """(n - 2, 2)  displacement of the inner points of one stretch to its smoothing spline."""
    s = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(part, axis=0).T))])
    if np.any(np.diff(s) <= 0):
        return np.zeros((len(part) - 2, 2))
    if amount is None:
        fits = np.column_stack([smoothing_spline(s / s[-1], part[:, k] / s[-1]) * s[-1] for k in (0, 1)])
    else:
        fits = part + displacement_across(s / s[-1], part / s[-1], amount / s[-1]) * s[-1]
    return (fits - part)[1:-1]


HALVINGS = 60  # of the interval of amounts, e^-70 to e^10


def displacement_across(s: np.ndarray, part: np.ndarray, amount: float) -> np.ndarray:
    """(n, 2)  displacement to the smoothing splines that move points (n, 2) by `amount` rms across their line (a
    straight line where even that moves less).

    The displacement grows with the splines' stiffness, which is found by halving. Source: the discrepancy principle
    (Reinsch, Numer. Math. 10 (1967) 177).
    """
    from scipy.interpolate import make_smoothing_spline

    step = np.gradient(part, axis=0)
    normal = np.column_stack([-step[:, 1], step[:, 0]]) / np.hypot(*step.T)[:, None]
    low, high = -70.0, 10.0
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        moved = np.column_stack([make_smoothing_spline(s, part[:, k], lam=np.exp(middle))(s) for k in (0, 1)]) - part
        low, high = (low, middle) if np.sqrt(np.mean((moved * normal).sum(axis=1) ** 2)) > amount else (middle, high)
    return moved


DENSE = 600  # points up to which all eigenvalues of the spline's roughness are found at once
LEAST_SHARE, FREE = 0.4, 40  # of the points beyond the first FREE: freedom that smoothing must take away
# of the mean step: with a smaller one the small eigenvalues drown in the round-off of the largest, n^4 / UNEVEN^3
UNEVEN = 0.1


def smoothing_spline(s: np.ndarray, value: np.ndarray) -> np.ndarray:
    """(n,)  natural cubic smoothing spline at its own points s (n,), growing, its amount by generalised
    cross-validation.

    In the eigenvectors of the roughness K = Q R^-1 Q' the spline is value / (1 + amount * eigenvalue): every amount
    costs n operations.
    Source: Green and Silverman, Nonparametric Regression (1994), ch. 2 and 3. scipy's make_smoothing_spline, which
    stops at the first amount it finds, serves where there are too many points or steps of very unlike length.
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
    # a spline through every point scores well by chance
    smooths = np.array([share(a).sum() > LEAST_SHARE * (n - FREE) for a in amounts])
    best = int(np.argmin(np.where(smooths, [score(a) for a in amounts], np.inf)))
    found = minimize_scalar(
        score, bounds=(amounts[max(best - 1, 0)], amounts[min(best + 1, 39)]), method="bounded", options={"xatol": 1e-4}
    )
    return value - basis @ (share(found.x) * part)
