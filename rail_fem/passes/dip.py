"""Dip angle of a wheel's own path in a pass: between its steepest fall before and its steepest rise after its lowest
point at the transfer.

The standard takes the angle from the simulated trajectory, and the P2 column of the thesis' table 7-5 from that of its
dynamic model. The rigid path's angle (p2_formula) is that of the surfaces alone.
"""

from dataclasses import dataclass

import numpy as np

from rail_fem.result.result import NAN, PassResult

BEFORE, AFTER = 0.10, 0.12  # distance before the transfer and after it that is looked at [m]
CHORD = 10e-3  # over which slopes are taken [m]


@dataclass(frozen=True)
class Dip:
    """angle [rad]; the two tangents as x, height [m] and slope in the direction of +x [1]; NaN where there is none."""

    angle: float
    fall: tuple[float, float, float]
    rise: tuple[float, float, float]


NO_DIP = Dip(NAN, (NAN,) * 3, (NAN,) * 3)


def trajectory_dip(result: PassResult) -> Dip:
    """The dip at the transfer; NO_DIP where the pass has no transfer or no height on both sides of it."""
    distance, height = result.history["x"] * result.scene.direction_sign, result.history["wheel_height"]
    at = result.transfer_x * result.scene.direction_sign
    known = np.isfinite(height)
    if not np.isfinite(at) or known.sum() < 2:
        return NO_DIP
    positions = np.arange(at - BEFORE, at + AFTER, 1e-3)
    positions = positions[
        (positions > distance[known].min() + CHORD / 2) & (positions < distance[known].max() - CHORD / 2)
    ]
    if not len(positions):
        return NO_DIP
    heights = lambda s: np.interp(s, distance[known], height[known])
    slope = (heights(positions + CHORD / 2) - heights(positions - CHORD / 2)) / CHORD
    lowest = int(np.argmin(np.where(positions >= at, heights(positions), np.inf)))
    if lowest in (0, len(positions) - 1):
        return NO_DIP
    fall, rise = int(np.argmin(slope[:lowest])), lowest + int(np.argmax(slope[lowest:]))
    tangent = lambda i: (
        float(positions[i] * result.scene.direction_sign),
        float(heights(positions[i])),
        float(slope[i] * result.scene.direction_sign),
    )
    return Dip(float(np.arctan(slope[rise]) - np.arctan(slope[fall])), tangent(fall), tangent(rise))
