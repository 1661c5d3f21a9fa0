"""The parts of a crossing (rail_fem.result.parts) in an explicit run: their cells and the nodes of their surface."""

from __future__ import annotations

import numpy as np

from geometry.meshing.hexmesh import HexMesh
from rail_fem.fe.domain import Domain
from rail_fem.fe.run import Run
from rail_fem.result.parts import CrossingPart, parts_between


def parts_of(run: Run) -> tuple[CrossingPart, ...]:
    """What the run passes over."""
    running = run.passage.running
    return parts_between(running.start, running.end, run.scene.crossing.leg_end)


def cells_of(part: CrossingPart, domain: Domain) -> np.ndarray:
    """This rank's cells (m,) whose middle lies in a part, ascending."""
    own = np.flatnonzero(domain.region == part.body)
    return own[part.holds(domain.reference.reshape(-1, 3)[domain.cells[own], 0].mean(axis=1))]


def surface_nodes(part: CrossingPart, mesh: HexMesh) -> np.ndarray:
    """Nodes (n,) of a part's running surface in a whole mesh, ascending."""
    nodes = np.unique(mesh.surface[mesh.surface_region == part.body])
    return nodes[part.holds(mesh.points[nodes, 0])]
