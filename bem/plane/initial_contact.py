"""How far a body may travel before it touches another, and where it is nearest."""

from __future__ import annotations

import numpy as np

from bem.plane.body import Body
from bem.plane.curve import Curve
from bem.plane.pairing import smooth_gap

_SAMPLES = 101
_MOST = 8  # nearest positions that are worth a look


def _distances(curve: Curve, s: np.ndarray, targets: list[Curve], heading: np.ndarray, reach: float) -> np.ndarray:
    """Distance (m,) [m] along `heading` from points of a curve to targets; inf where the curve does not look ahead or
    nothing is met."""
    along = curve.direction(s)
    looks = along[:, 1] * heading[0] - along[:, 0] * heading[1] > 0.02  # at grazing points nothing is met first
    gap = np.full(len(s), np.inf)
    gap[looks] = smooth_gap(curve.at(s[looks]), np.broadcast_to(heading, (looks.sum(), 2)), targets, reach)
    return gap


def _nearest_positions(
    curve: Curve, targets: list[Curve], heading: np.ndarray, reach: float
) -> list[tuple[float, np.ndarray]]:
    """Local minima of the distance along a curve, refined: (distance [m], point (2,) [m])."""
    coarse = np.linspace(0, curve.length, _SAMPLES)
    gap = _distances(curve, coarse, targets, heading, reach)
    padded = np.r_[np.inf, gap, np.inf]
    lowest = np.flatnonzero(np.isfinite(gap) & (gap <= padded[:-2]) & (gap <= padded[2:]))
    found = []
    for start in lowest[np.argsort(gap[lowest], kind="stable")][:_MOST]:
        s, position = coarse, start
        for _ in range(3):
            s = np.linspace(s[max(position - 1, 0)], s[min(position + 1, len(s) - 1)], 13)
            finer = _distances(curve, s, targets, heading, reach)
            position = int(np.argmin(finer))
        found.append((float(finer[position]), curve.at(s[position : position + 1])[0]))
    return found


def nearest_positions(fixed: Body, moving: Body, heading: np.ndarray, reach: float) -> list[tuple[float, np.ndarray]]:
    """Where the faces come nearest along the unit vector `heading` (2,): (distance [m], point (2,) [m] of the moving
    body), nearest first.

    Distances are negative if the bodies overlap as placed. Both faces send rays, so that a corner of either is found;
    nothing is looked for beyond `reach` [m], and the list is empty when the faces never meet.
    """
    ours, theirs = moving.outline.edge_curves(moving.face), fixed.outline.edge_curves(fixed.face)
    positions = [position for curve in ours for position in _nearest_positions(curve, theirs, heading, reach)]
    for curve in theirs:
        positions += [
            (distance, point - distance * heading)
            for distance, point in _nearest_positions(curve, ours, -heading, reach)
        ]
    positions = [position for position in positions if np.isfinite(position[0])]
    return sorted(positions, key=lambda position: position[0])[: 2 * _MOST]
