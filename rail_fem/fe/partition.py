"""Cells shared among ranks."""

from __future__ import annotations

import numpy as np


def balanced_parts(centres: np.ndarray, cost: np.ndarray, parts: int) -> np.ndarray:
    """Recursive bisection of cells along the longest side of their box, by cost.

    centres : (m, 3) [m];  cost : (m,) relative cost of a cell.  Returns (m,) part of each cell, 0..parts-1. Root only.
    """
    part = np.zeros(len(centres), dtype=np.int32)
    if parts == 1:
        return part
    left = parts // 2
    axis = int(np.argmax(np.ptp(centres, axis=0)))
    order = np.argsort(centres[:, axis], kind="stable")
    share = np.cumsum(cost[order]) / cost.sum()
    split = int(np.searchsorted(share, left / parts))
    low, high = order[:split], order[split:]
    part[low] = balanced_parts(centres[low], cost[low], left)
    part[high] = left + balanced_parts(centres[high], cost[high], parts - left)
    return part
