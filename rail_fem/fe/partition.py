"""Cells shared among ranks."""

from __future__ import annotations

import numpy as np

EQUAL = 1e-9  # of the cost, within which a share is reached


def balanced_parts(centres: np.ndarray, cost: np.ndarray, parts: int, shares: np.ndarray | None = None) -> np.ndarray:
    """Recursive bisection of cells along the longest side of their box, by cost.

    centres : (m, 3) [m];  cost : (m,) relative cost of a cell;  shares : (parts,) > 0 of the cost for each part, None:
        even.  Returns (m,) part of each cell, 0..parts-1. Root only.
    """
    part = np.zeros(len(centres), dtype=np.int32)
    if parts == 1:
        return part
    shares = np.ones(parts) if shares is None else shares
    left = parts // 2
    axis = int(np.argmax(np.ptp(centres, axis=0)))
    order = np.argsort(centres[:, axis], kind="stable")
    reached = np.cumsum(cost[order]) / cost.sum()
    split = int(np.searchsorted(reached, shares[:left].sum() / shares.sum() + EQUAL, side="right"))
    low, high = order[:split], order[split:]
    part[low] = balanced_parts(centres[low], cost[low], left, shares[:left])
    part[high] = left + balanced_parts(centres[high], cost[high], parts - left, shares[left:])
    return part
