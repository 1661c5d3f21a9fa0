"""Steel that a pass has left, for the next: shape, stress and hardening of the rail; the wheel comes new each time.

What is carried are the nodes' positions relative to the base and all that the elements hold. It is taken under the
wheel at the end of a pass and laid in before the static start of the next (rail_fem.fe.static_start), whose dynamic
relaxation lets the steel unload there and loads it from below: it strains no further than it was strained.

Between two passes steel may wear off: the nodes of the surface go down by as much, those below by a part that fades
with depth. Stress and strain are the elements' own, which are integrated in time, so that this strains nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import cast

import numpy as np
from scipy.ndimage import map_coordinates

from geometry.meshing.hexmesh import HexMesh
from geometry.surfaces.any_crossing import AnyCrossing
from geometry.surfaces.bodies import CROSSING, NO_METAL, REGIONS
from rail_fem.fe.checkpoint import element_state, restore_elements
from rail_fem.fe.global_rows import block_starts, from_blocks, nodes_to_blocks, to_blocks
from rail_fem.fe.passage import Passage
from rail_fem.fe.run import Run
from rail_fem.files.sealed import read_sealed, write_sealed
from rail_fem.processes.launcher import on_root

STEEL = "steel.npz"
FADES = 10e-3  # below the surface, over which what wears off it moves the mesh [m]


@dataclass(frozen=True, eq=False)
class SteelBefore:
    """What passes begin on. folder : of passes that have left their steel there; None: the casting is new;  x (m,),
    y (n,), worn (2, m, n) : even grid and depths worn off wing and nose since the casting was new [m];  of : what the
    steel belongs to, in words"""

    folder: Path | None
    x: np.ndarray = field(repr=False)
    y: np.ndarray = field(repr=False)
    worn: np.ndarray = field(repr=False)
    of: str = ""


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
    points = nodes_to_blocks(d.domain, run.passage.relative)
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


def write_steel(comm, folder: Path, steel: CarriedSteel, worn: np.ndarray, identity: dict[str, str]) -> None:
    """folder/steel.npz of what each rank has; worn (n,) : height taken off each node so far [m], root only. Collective.
    Errors: OSError."""
    parts = comm.gather((steel.points, steel.state))

    def write() -> None:
        points, state = map(np.concatenate, zip(*parts, strict=True))
        write_sealed(folder / STEEL, {"points": points, "state": state, "worn": worn}, identity)

    on_root(write)


def steel_before(
    comm, before: SteelBefore, mesh: HexMesh | None, crossing: AnyCrossing, identity: dict[str, str]
) -> tuple[CarriedSteel | None, np.ndarray]:
    """Each rank's block of the steel that passes begin on, None: as it was cast; and the height (n,) taken off each
    node so far [m], on root. mesh : root only. Collective. Errors: SealError for a file that is damaged or another's.
    """
    folder = before.folder
    if folder is None:
        return None, np.zeros(0 if mesh is None else len(mesh.points))

    def read() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        stored, _ = read_sealed(folder / STEEL, identity, "begin again with --overwrite")
        points, total = stored["points"], height_off(cast(HexMesh, mesh), stored["points"], crossing, before)
        points[:, 2] -= total - stored["worn"]
        return points, stored["state"], total

    points, state, worn = on_root(read)
    blocks = [rows[slice(*block_starts(len(rows), comm.size)[comm.rank : comm.rank + 2])] for rows in (points, state)]
    return CarriedSteel(*blocks), worn


def height_off(mesh: HexMesh, points: np.ndarray, crossing: AnyCrossing, before: SteelBefore) -> np.ndarray:
    """Height (n,) [m] by which wear has lowered each node of a mesh, whose nodes lie at points (n, 3) [m] now."""
    x, y = before.x, before.y
    at = (points[:, 0] - x[0]) / (x[1] - x[0]), (points[:, 1] - y[0]) / (y[1] - y[0])
    out = np.zeros(len(points))
    for body in CROSSING:
        nodes = np.unique(mesh.cells[mesh.region == body])
        across, along = np.ascontiguousarray(mesh.points[nodes, 1]), np.ascontiguousarray(mesh.points[nodes, 0])
        top = crossing.heights(along, across, REGIONS[body])
        part = np.clip(1 - (top - mesh.points[nodes, 2]) / FADES, 0, 1)
        worn = map_coordinates(before.worn[body], [at[0][nodes], at[1][nodes]], order=1, mode="constant")
        out[nodes] = np.where(top > 0.5 * NO_METAL, part * worn, 0.0)
    return out
