"""The parts of a crossing whose metal is judged apart: leg, wing rail, nose.

The leg is the wing body as far as `leg_end`, the same limit that parts its forces from the wing rail's
(rail_fem.output.events). A pass that does not run over it has a wing and a nose alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometry.meshing.hexmesh import HexMesh
from rail_fem.fe.domain import Domain
from rail_fem.fe.run import Run

WING, NOSE = 0, 1  # regions of the mesh


@dataclass(frozen=True)
class CrossingPart:
    """A region of the mesh between two positions along the track: low <= x < high [m]."""

    name: str
    region: int
    low: float = -np.inf
    high: float = np.inf

    def holds(self, x: np.ndarray) -> np.ndarray:
        """Which positions (n,) [m] lie within its length."""
        return (x >= self.low) & (x < self.high)

    def cells(self, domain: Domain) -> np.ndarray:
        """This rank's cells (m,) whose middle lies in it, ascending."""
        own = np.flatnonzero(domain.region == self.region)
        return own[self.holds(domain.reference.reshape(-1, 3)[domain.cells[own], 0].mean(axis=1))]

    def surface_nodes(self, mesh: HexMesh) -> np.ndarray:
        """Nodes (n,) of its running surface in a whole mesh, ascending."""
        nodes = np.unique(mesh.surface[mesh.surface_region == self.region])
        return nodes[self.holds(mesh.points[nodes, 0])]


def parts_of(run: Run) -> tuple[CrossingPart, ...]:
    """What the run passes over."""
    leg_end, running = run.scene.crossing.leg_end, run.passage.running
    if min(running.start, running.end) >= leg_end:
        return CrossingPart("wing", WING), CrossingPart("nose", NOSE)
    return (
        CrossingPart("leg", WING, high=leg_end),
        CrossingPart("wing", WING, low=leg_end),
        CrossingPart("nose", NOSE),
    )
