"""How far a body may travel before it touches another."""
from __future__ import annotations

import numpy as np

from bem.body import Body
from bem.curve import Curve
from bem.pairing import PairingError, smooth_gap


def _closest(curves: list[Curve], targets: list[Curve], way: np.ndarray, reach: float) -> float:
    """Least distance [m] along `way` from points of curves to targets: samples, then finer samples about the best."""
    best = np.inf
    for curve in curves:
        s = np.linspace(0, curve.length, 101)
        for _ in range(4):
            along = curve.direction(s)
            looks = along[:, 1] * way[0] - along[:, 0] * way[1] > 0.02  # the outward side looks ahead; at grazing points nothing is met first
            gap = np.full(len(s), np.inf)
            gap[looks] = smooth_gap(curve.at(s[looks]), np.broadcast_to(way, (looks.sum(), 2)), targets, reach)
            place = int(np.argmin(gap))
            best = min(best, float(gap[place]))
            if not np.isfinite(gap[place]):
                break
            s = np.linspace(s[max(place - 1, 0)], s[min(place + 1, len(s) - 1)], 13)
    return best


def distance_to_touch(fixed: Body, moving: Body, way: np.ndarray, reach: float) -> float:
    """Distance [m] along the unit vector `way` (2,) until the faces touch; negative if they overlap as placed.

    Both faces send rays, so that a corner of either is found. Raises PairingError when the faces never meet within `reach` [m].
    """
    ours, theirs = moving.outline.edge_curves(moving.face), fixed.outline.edge_curves(fixed.face)
    distance = min(_closest(ours, theirs, way, reach), _closest(theirs, ours, -way, reach))
    if not np.isfinite(distance):
        raise PairingError(f"moving along ({way[0]:.3g}, {way[1]:.3g}) the faces {moving.face!r} and {fixed.face!r} never meet within "
                           f"{reach:g} m: check positions and the direction, or raise reach")
    return distance
