"""The parts of a crossing whose metal is judged apart: leg, wing rail, nose.

The leg is the wing body as far as `leg_end`, the same limit that parts its forces from the wing rail's
(rail_fem.result.events). A pass that does not run over it has a wing and a nose alone.
"""

from dataclasses import dataclass

import numpy as np

from geometry.surfaces.bodies import PassBody


@dataclass(frozen=True)
class CrossingPart:
    """A body between two positions along the track: low <= x < high [m]."""

    name: str
    body: PassBody
    low: float = -np.inf
    high: float = np.inf

    def holds(self, x: np.ndarray) -> np.ndarray:
        """Which positions (n,) [m] lie within its length."""
        return (x >= self.low) & (x < self.high)


def parts_between(start: float, end: float, leg_end: float) -> tuple[CrossingPart, ...]:
    """What a pass from x = start to end [m], either way, runs over."""
    if min(start, end) >= leg_end:
        return CrossingPart("wing", PassBody.WING), CrossingPart("nose", PassBody.NOSE)
    return (
        CrossingPart("leg", PassBody.WING, high=leg_end),
        CrossingPart("wing", PassBody.WING, low=leg_end),
        CrossingPart("nose", PassBody.NOSE),
    )
