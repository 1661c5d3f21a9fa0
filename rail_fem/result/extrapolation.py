"""What values at several element sizes tend to as the elements vanish, and the order with which they do."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

ORDERS = 0.2, 6.0  # within which an order is looked for


def extrapolated(sizes: np.ndarray, values: np.ndarray, order: float) -> tuple[float, float]:
    """Limit for size 0 of value = limit + c size^order by least squares through all, and the largest miss of a point,
    or half the last step, whichever is more."""
    sizes, values = np.asarray(sizes, float), np.asarray(values, float)
    if len(values) < 2:
        return float(values[-1]), float("nan")
    powers = np.column_stack([np.ones(len(sizes)), sizes**order])
    (limit, slope), *_ = np.linalg.lstsq(powers, values, rcond=None)
    return float(limit), float(max(np.abs(powers @ [limit, slope] - values).max(), abs(limit - values[-1]) / 2))


@dataclass(frozen=True)
class Limit:
    """What a quantity tends to as elements vanish.

    value : by the order that is expected, through the last three sizes;  doubt : the largest miss of a point, or half
        of what is added to the finest, whichever is more
    order : observed with the last three; NaN where they do not approach a limit: the scatter is larger than the change
    """

    value: float
    doubt: float
    order: float


def limit_of(sizes: Sequence[float], values: Sequence[float], order: float) -> Limit:
    """Of values at sizes (k,), coarse to fine, that should approach it with this order."""
    last = slice(-3, None)
    value, doubt = extrapolated(np.array(sizes[last]), np.array(values[last]), order)
    return Limit(value, doubt, observed_order(sizes[last], values[last]))


def observed_order(sizes: Sequence[float], values: Sequence[float]) -> float:
    """Order p with which three values approach a limit, value = limit + c size^p, at any three sizes; NaN for values
    that do not, for fewer, or where p is outside ORDERS."""
    if len(sizes) < 3:
        return math.nan
    (h1, h2, h3), (f1, f2, f3) = (tuple(map(float, three[-3:])) for three in (sizes, values))
    if not (f1 - f2) * (f2 - f3) > 0:
        return math.nan
    ratio = (f1 - f2) / (f2 - f3)
    excess = lambda p: (h1**p - h2**p) / (h2**p - h3**p) - ratio
    low, high = ORDERS
    return float(brentq(excess, low, high)) if excess(low) * excess(high) < 0 else math.nan
