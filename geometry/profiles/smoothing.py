"""Scatter taken out of a line of points by smoothing splines that leave corners sharp and put outliers back in line.
Pure kernels."""

import numpy as np

from geometry.profiles.defects import SHARP, turns
from geometry.profiles.profile import lengths
from kernel_cache import njit

FARTHEST = 4.0  # times the noise: a point that a smoothing spline would move farther is a corner that it cannot follow


def smoothed(
    points: np.ndarray, corners: np.ndarray, noise: float, amount: float | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Points moved onto smoothing splines of its length, and corners (indices): those given and those found.

    The amount follows from the points themselves (generalised cross-validation); or the splines move points by `amount`
    [m] rms. Where a spline would move a point by more than FARTHEST times the noise [m] it rounds what it cannot
    follow: the stretch is cut at that point, and the splines are fitted anew. A cut where the smoothed line turns more
    sharply than its noise explains is a corner that lay between points; one where it turns to and fro was an outlier,
    and the cubic through its neighbours takes its place.
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
    sharp, turn = np.flatnonzero(corner_turns(quiet, noise)) + 1, np.pad(turns(quiet), 1)
    # a point off a straight line makes it turn by half as much before and after, and back
    share = np.array([turn[:-2], turn[2:]]) / np.where(turn[1:-1] == 0.0, np.inf, -turn[1:-1])
    to_and_fro = np.flatnonzero(((share > 0.25) & (share < 1.0)).all(axis=0)) + 1
    for k in np.intersect1d(np.setdiff1d(cuts, np.union1d(corners, sharp)), to_and_fro).astype(int):
        quiet[k] = from_neighbours(quiet, k)
    return quiet, np.union1d(corners, np.intersect1d(cuts, sharp)).astype(int)


def corner_turns(points: np.ndarray, noise: float) -> np.ndarray:
    """(n - 2,)  True at inner points where the line turns by more than SHARP, than its noise makes it turn, and than it
    bends two points away (one of few points turns so much along a curve)."""
    step, turn = np.hypot(*np.diff(points, axis=0).T), np.abs(turns(points))
    beyond = np.pad(turn, 2)
    around = np.maximum(beyond[:-4], beyond[4:])
    return (turn > SHARP) & (turn > 8.0 * noise / np.minimum(step[:-1], step[1:])) & (turn > 3.0 * around)


def from_neighbours(points: np.ndarray, k: int) -> np.ndarray:
    """(2,)  the position of point k on the cubic through two neighbours on either side; at the rims as many as there
    are."""
    near = np.array([i for i in (k - 2, k - 1, k + 1, k + 2) if 0 <= i < len(points)])
    s = lengths(points[near[0] : near[-1] + 1])
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
    s = lengths(part)
    if np.any(np.diff(s) <= 0):
        return np.zeros((len(part) - 2, 2))
    if amount is None:
        fits = np.column_stack([smoothing_spline(s / s[-1], part[:, k] / s[-1]) * s[-1] for k in (0, 1)])
    else:
        fits = part + displacement_across(s / s[-1], part / s[-1], amount / s[-1]) * s[-1]
    return (fits - part)[1:-1]


HALVINGS = 60  # of the interval of amounts, e^-70 to e^10


def normals(line: np.ndarray) -> np.ndarray:
    """(n, 2)  unit normals of a line at its points, to the left."""
    step = np.gradient(line, axis=0)
    return np.column_stack([-step[:, 1], step[:, 0]]) / np.hypot(*step.T)[:, None]


def displacement_across(s: np.ndarray, part: np.ndarray, amount: float) -> np.ndarray:
    """(n, 2)  displacement to the smoothing splines that move points (n, 2) by `amount` rms across their line (a
    straight line where even that moves less).

    The displacement grows with the splines' stiffness, which is found by halving. Source: the discrepancy principle
    (Reinsch, Numer. Math. 10 (1967) 177).
    """
    h, lines, fits = steps_of(s), np.ascontiguousarray(part.T), np.empty((2, len(s)))
    normal = normals(part)
    low, high = -70.0, 10.0
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        for k in (0, 1):
            spline_at(np.exp(middle), lines[k], h, fits[k])
        moved = fits.T - part
        low, high = (low, middle) if np.sqrt(np.mean((moved * normal).sum(axis=1) ** 2)) > amount else (middle, high)
    return moved


LEAST_SHARE, FREE = 0.4, 40  # of the points beyond the first FREE: freedom that smoothing must take away
LEAST_STEP = 1e-4  # of the mean: points nearer to one another are taken as so far apart, or their factors drown
WORST = 1e100  # score of what is not allowed; the minimiser takes differences of scores
SLOWEST = 4.73  # wave number times length of a free beam's first bending mode: the roughness' least eigenvalue but 0


def steps_of(s: np.ndarray) -> np.ndarray:
    """(n - 1,)  steps between points (n,), growing, none below LEAST_STEP of their mean."""
    return np.maximum(np.diff(s), LEAST_STEP * (s[-1] - s[0]) / len(s))


def smoothing_spline(s: np.ndarray, value: np.ndarray) -> np.ndarray:
    """(n,)  natural cubic smoothing spline at its own points s (n,), growing, its amount by generalised
    cross-validation: the best of amounts from that of the roughest to that of the smoothest mode, then refined."""
    from scipy.optimize import minimize_scalar

    n, length, fit = len(s), s[-1] - s[0], np.empty(len(s))
    h = steps_of(s)
    amounts = np.arange(np.log(h.min() ** 3 / 48) - 5, np.log(n / length / (SLOWEST / length) ** 4) + 5, 0.5)

    def score(log_amount: float) -> float:
        error, freedom = spline_at(np.exp(log_amount), value, h, fit)
        # a spline through every point scores well by chance
        return error / freedom**2 if freedom > max(LEAST_SHARE * (n - FREE), 0.0) else WORST

    best = int(np.argmin([score(a) for a in amounts]))
    around = amounts[max(best - 1, 0)], amounts[min(best + 1, len(amounts) - 1)]
    score(minimize_scalar(score, bounds=around, method="bounded", options={"xatol": 1e-4}).x)
    return fit


@njit(cache=True)
def spline_at(amount, value, h, fit):
    """Natural cubic smoothing spline of values (n,) over steps h (n - 1,) -> fit (n,) at its points; the sum of squares
    it leaves, and the freedom it takes away, tr(I - A).

    With Q second differences and R the hats' products: (R + amount Q'Q) g = Q' value, value - fit = amount Q g, and
    tr(I - A) = amount tr(Q'Q (R + amount Q'Q)^-1), for which the five bands of the inverse follow from its factors.
    Source: Reinsch (1967); Green and Silverman, Nonparametric Regression (1994), ch. 2 and 3; Hutchinson and de Hoog,
    Numer. Math. 47 (1985) 99 (from memory, not verified).
    """
    m = len(value) - 2
    rough, beside, beyond = np.empty(m), np.zeros(m), np.zeros(m)  # bands of Q'Q
    diagonal, first, second, g = np.empty(m), np.zeros(m), np.zeros(m), np.empty(m)  # L D L'
    for i in range(m):
        p, q = 1 / h[i], 1 / h[i + 1]
        rough[i] = p * p + (p + q) ** 2 + q * q
        g[i] = (value[i + 2] - value[i + 1]) * q - (value[i + 1] - value[i]) * p
        diagonal[i] = (h[i] + h[i + 1]) / 3 + amount * rough[i]
        if i + 1 < m:
            beside[i] = -q * (p + q) - q * (q + 1 / h[i + 2])
            first[i] = h[i + 1] / 6 + amount * beside[i]
        if i + 2 < m:
            beyond[i] = q / h[i + 2]
            second[i] = amount * beyond[i]
        if i >= 1:
            diagonal[i] -= diagonal[i - 1] * first[i - 1] ** 2
            first[i] -= diagonal[i - 1] * first[i - 1] * second[i - 1]
            g[i] -= first[i - 1] * g[i - 1]
        if i >= 2:
            diagonal[i] -= diagonal[i - 2] * second[i - 2] ** 2
            g[i] -= second[i - 2] * g[i - 2]
        first[i] /= diagonal[i]
        second[i] /= diagonal[i]
    near, across, far = 0.0, 0.0, 0.0  # of the inverse at (i + 1, i + 1), (i + 1, i + 2), (i + 2, i + 2)
    trace = 0.0
    fit[:] = value
    for i in range(m - 1, -1, -1):
        g[i] /= diagonal[i]
        if i + 1 < m:
            g[i] -= first[i] * g[i + 1]
        if i + 2 < m:
            g[i] -= second[i] * g[i + 2]
        one, two = -first[i] * near - second[i] * across, -first[i] * across - second[i] * far
        own = 1 / diagonal[i] - first[i] * one - second[i] * two
        trace += rough[i] * own + 2 * (beside[i] * one + beyond[i] * two)
        near, across, far = own, one, near
        fit[i] -= amount * g[i] / h[i]
        fit[i + 1] += amount * g[i] * (1 / h[i] + 1 / h[i + 1])
        fit[i + 2] -= amount * g[i] / h[i + 1]
    return np.sum((value - fit) ** 2), amount * trace
