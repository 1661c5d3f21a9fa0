"""The parts of a crossing (rail_fem.result.parts) in an explicit run, and their cells."""

from __future__ import annotations

import numpy as np

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
