"""Steel that a pass has left, for the next: shape, stress and hardening of the rail; the wheel comes new each time.

What is carried are the nodes' positions relative to the base and all that the elements hold. It is taken under the
wheel at the end of a pass and laid in before the static start of the next (rail_fem.fe.static_start), whose dynamic
relaxation lets the steel unload there and loads it from below: it strains no further than it was strained.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rail_fem.fe.checkpoint import element_state, restore_elements
from rail_fem.fe.global_rows import from_blocks, nodes_to_blocks, to_blocks
from rail_fem.fe.passage import Passage
from rail_fem.fe.run import Run


@dataclass(frozen=True)
class CarriedSteel:
    """points : (n, 3) positions of all nodes relative to the rail's base [m];  state : (m, rows) of all elements as
    restart files have it; both by input number, each rank its block (rail_fem.fe.global_rows)."""

    points: np.ndarray
    state: np.ndarray


def steel_after(run: Run) -> CarriedSteel:
    """What the run has left. Collective."""
    d = run.dynamics
    d.bring_up()
    points = nodes_to_blocks(d.domain, d.structure.x) - run.passage.crossing.displacement
    cells = d.domain.cell_input[d.structure.finite_cells]
    return CarriedSteel(points, to_blocks(d.comm, cells, element_state(d.structure.finite), d.domain.m_global))


def lay_in(passage: Passage, carried: CarriedSteel) -> None:
    """Give the rail of a new pass on the same mesh the shape and the state that were carried. Collective."""
    structure, rail = passage.dynamics.structure, ~passage.on_wheel
    domain = structure.domain
    points = from_blocks(domain.comm, carried.points, domain.node_input, domain.n_global)[rail]
    structure.x.reshape(-1, 3)[rail] = points
    if "anchor" in structure.NODAL:
        structure.anchor.reshape(-1, 3)[rail] = points
    cells = domain.cell_input[structure.finite_cells]
    restore_elements(structure.finite, from_blocks(domain.comm, carried.state, cells, domain.m_global))
