"""Plastic flow of wing and nose under a mix of wheels, in passes.

Each kind of wheel k, of share s_k, has a groove U_k(x, y) still to press (rail_fem.damage.groove); every pass does the
same part of what is left of its own, and what one kind lowers the others need not:

    df/dN = r sum_k s_k max(U_k - f, 0),   f(0) = 0

in every cell of the plan. Between the values at which a kind comes to rest this is linear with constant coefficients,
so it is solved in closed form for any number of passes: nothing limits the step, and two steps are one. Most of the
metal that leaves a groove goes out through the faces beside the running surface, where a plan has no height; a tenth
of it is heaped up beside the groove.
"""

from collections.abc import Sequence

import numpy as np
from scipy import ndimage

ALONG = 4e-3  # standard deviation along x by which what still flows is spread: a Hertz patch of 8 mm half-length [m]
LEAST = 1e-12  # sum of a line's depths that counts as a groove [m]
HEAPED = 0.1  # of a groove's metal; heaps of fe_full (2 mm) are 0.08 to 0.11 of their groove's depth, wing and nose
FLAT = 0.1e-3  # fall of a face beside the groove that counts as none [m]


def flow_in_passes(wanted: np.ndarray, shares: Sequence[float], passes: float, rate: float) -> np.ndarray:
    """f (...) [m] after passes of kinds that still want depths (k, ...) [m]; the closed form of the module's head.

    shares (k,) of the passes;  rate : r of a single kind. Error: round-off.
    """
    weights = np.broadcast_to(np.reshape(np.asarray(shares, float), (-1, *[1] * (wanted.ndim - 1))), wanted.shape)
    order = np.argsort(wanted, axis=0)
    levels = np.take_along_axis(wanted, order, axis=0)
    weights = np.take_along_axis(weights, order, axis=0)
    flow, left = np.zeros(wanted.shape[1:]), np.full(wanted.shape[1:], float(passes))
    for k in range(len(levels)):  # the kinds from k on still flow, until the depth of kind k is reached
        total = weights[k:].sum(axis=0)
        aim = (weights[k:] * levels[k:]).sum(axis=0) / np.maximum(total, 1e-300)
        with np.errstate(divide="ignore", invalid="ignore"):
            needs = np.log((aim - flow) / (aim - levels[k])) / (rate * total)
        needs = np.where(levels[k] <= flow, 0.0, np.where(aim > levels[k], needs, np.inf))
        spent = np.minimum(np.where(total > 0, needs, 0.0), left)
        reached = aim + (flow - aim) * np.exp(-rate * total * spent)
        flow = np.where(spent > 0, np.where(spent == needs, levels[k], reached), flow)
        left = left - spent
    return flow


def passes_to_flow(wanted: np.ndarray, shares: Sequence[float], depth: float, rate: float) -> float:
    """Passes in which kinds that still want depths (k, ...) [m] flow by at most a depth [m] anywhere; inf: they never
    flow as deep. A kind that is rare presses all of its own groove in the end, later. Error: 1 % of the passes."""
    deep = wanted[:, wanted.max(axis=0) > depth]
    if not deep.size:
        return float("inf")
    deepest = lambda passes: flow_in_passes(deep, shares, passes, rate).max()
    low, high = 0.0, 1.0
    while deepest(high) <= depth:
        low, high = high, 2 * high
    while high - low > 0.01 * high:
        middle = (low + high) / 2
        low, high = (middle, high) if deepest(middle) <= depth else (low, middle)
    return low or high


def with_heaps(groove: np.ndarray, heights: np.ndarray, metal: np.ndarray) -> np.ndarray:
    """Depths (2, m, n) [m] of grooves, + into the metal, less the heaps beside them that take HEAPED of their metal.

    In each line across the track the heaps are triangles from one to three half-widths of the groove (by its second
    moment) beside it, shared by how far the face (heights (2, m, n) [m]) falls away there: metal is pushed to where no
    wheel holds it. What of them lies beside the body (metal (2, m, n)) hangs over its edge as a lip that no plan shows.
    """
    at = np.arange(groove.shape[-1])
    area = groove.sum(axis=-1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        centre = (groove * at).sum(axis=-1, keepdims=True) / area
        half = np.sqrt(5 * np.maximum((groove * (at - centre) ** 2).sum(axis=-1, keepdims=True) / area, 0.2))
        aside = (at - centre) / half
    triangle = np.maximum(1 - np.abs(np.abs(aside) - 2), 0.0)
    sides = [np.where((aside < 0) == left, triangle, 0.0) for left in (True, False)]
    middle = _mean(heights, groove)
    falls = [np.maximum(middle - _mean(heights, side), 0.0) + FLAT for side in sides]
    heap = sum(side * (fall / sum(falls)) for side, fall in zip(sides, falls, strict=True))
    with np.errstate(divide="ignore", invalid="ignore"):
        heap = heap * (HEAPED * area / heap.sum(axis=-1, keepdims=True))
    return np.where((area > LEAST) & metal, groove - heap, 0.0)


def _mean(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    total = weights.sum(axis=-1, keepdims=True)
    return (values * weights).sum(axis=-1, keepdims=True) / np.where(total > 0, total, 1.0)


def spread_along(wanted: np.ndarray, spacing: float) -> np.ndarray:
    """Depths (..., m, n) of lines `spacing` [m] apart, spread along x by ALONG."""
    sigma = [0.0] * wanted.ndim
    sigma[-2] = ALONG / spacing
    return ndimage.gaussian_filter(wanted, sigma, mode="nearest")
