"""Graded divisions of a line: fine in the middle, growing geometrically to both ends."""

import numpy as np
from scipy.optimize import brentq

from geometry.meshing.hexmesh import MeshError


def growing_steps(start: float, length: float, growth: float, largest: float) -> np.ndarray:
    """Cell lengths that fill `length` exactly, beginning near start * growth and growing by about `growth` up to
    `largest`.

    start, length, largest in m; growth > 1. Returns (n,) lengths [m], never falling, each at least 0.7 * start
    unless `length` itself is shorter (one cell then). Empty where length is 0.
    """
    if length <= 1e-9 * start:
        return np.zeros(0)

    def steps(count, ratio):
        with np.errstate(over="ignore"):  # what overflows is cut at `largest`
            return np.minimum(start * ratio ** np.arange(1, count + 1), max(largest, start))

    count = 1
    while steps(count, growth).sum() < length:
        count += 1
    fewer = count - 1
    if fewer and count * start > length:
        count = fewer
    if count * start >= length:
        return np.full(count, length / count)
    if count * max(largest, start) <= length:
        return np.full(count, length / count)
    ratio = brentq(lambda r: steps(count, r).sum() - length, 1.0, max(2 * growth, 2 * length / start))
    return steps(count, ratio)


def graded_line(
    start: float,
    end: float,
    fine: tuple[float, float],
    size: float,
    growth: float = 1.3,
    coarse: float = np.inf,
    multiple: int = 1,
) -> np.ndarray:
    """Positions from `start` to `end` [m], equal steps of about `size` over `fine`, growing steps outside it.

    fine     : the fine range [m]; its step is the nearest to `size` that fits, never longer than `size` times 1 + 1 / n
    growth   : ratio of neighbouring steps outside the fine range; coarse : longest step there [m]
    multiple : the numbers of steps left of, in and right of the fine range are each a multiple of this
    Returns (n,) increasing positions with both ends exact. Raises MeshError where the ranges are empty or not nested.
    """
    if not (start <= fine[0] < fine[1] <= end):
        raise MeshError(
            f"the fine range {fine} m must be ordered and lie in the range [{start}, {end}] m; change one of them"
        )
    if not size > 0 or not growth > 1:
        raise MeshError(f"size {size} m must be positive and growth {growth} above 1")
    count = multiple * max(1, round((fine[1] - fine[0]) / size / multiple))
    step = (fine[1] - fine[0]) / count
    left = _outer_steps(step, fine[0] - start, growth, coarse, multiple)[::-1]
    right = _outer_steps(step, end - fine[1], growth, coarse, multiple)
    line = np.concatenate(
        [
            [start],
            start + np.cumsum(left[:-1]),
            np.linspace(*fine, count + 1)[0 if len(left) else 1 :],
            fine[1] + np.cumsum(right[:-1]),
            [end] if len(right) else [],
        ]
    )
    line[-1] = end
    return line


def _outer_steps(step, length, growth, coarse, multiple):
    """Growing steps in groups of `multiple` equal ones."""
    groups = growing_steps(step * multiple, length, growth, coarse * multiple)
    return np.repeat(groups / multiple, multiple)
