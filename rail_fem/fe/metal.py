"""What a pass leaves in the metal of leg, wing and nose: plastic strain as quantities with a limit, residual stress,
and the change of the running surface.

A rank judges of each body what has yielded with the metal around it, root the running surfaces; nobody gathers the
bodies.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from geometry.meshing.cell_measures import cell_volume
from geometry.surfaces.any_crossing import AnyCrossing
from geometry.surfaces.bodies import CROSSING, NO_METAL, REGIONS
from geometry.surfaces.depth_field import STEEPEST
from rail_fem.fe.domain import Domain
from rail_fem.fe.fields import cell_rows
from rail_fem.fe.parts import cells_of, parts_of
from rail_fem.fe.run import Run
from rail_fem.result.plastic_zone import near, plastic_zone, strained_box

STRIP = 5e-3  # along the track, over which the change of the surface is looked at [m]
CLEAR = 40e-3  # from the wheel at the end of the pass: nearer, the metal is under load [m]
ASIDE = 10e-6  # by which a surface's slope is taken [m]


def metal(run: Run) -> dict[str, dict]:
    """For leg (where the pass runs over it), wing and nose the plain values of
    rail_fem.result.plastic_zone.PlasticZone, whether the block lies clear of the wheel, so that its stresses are
    residual, and the surface: see `surface_change`. Collective, replicated."""
    run.dynamics.bring_up()
    domain, passage, rows = run.dynamics.domain, run.passage, cell_rows(run.dynamics)
    relative = passage.relative
    wheel = passage.running.start + run.dynamics.contact.wheel.offset
    zones, surfaces = {}, {}
    for number, part in enumerate(parts_of(run)):
        mine = cells_of(part, domain)
        if not run.comm.allreduce(len(mine)):
            continue
        zone, whole = _yielded(domain, rows, mine, number % run.comm.size)
        positions = _positions(domain, relative, passage.rail_nodes[passage.rail_region == part.body])
        if zone is not None:
            zones[part.name] = zone[:, :24].reshape(-1, 8, 3), zone[:, 24], zone[:, 25:], whole
        if positions is not None:  # on root
            own = positions[part.holds(positions[:, 0])]
            surfaces[part.name] = surface_change(own[:, 0], own[:, 2] - own[:, 5], wheel)
    judged = run.comm.gather({name: plastic_zone(*zone).plain() for name, zone in zones.items()}, root=0)
    found = {}
    for name, surface in surfaces.items():
        (own,) = (rank[name] for rank in judged if name in rank)
        found[name] = own | {"unloaded": bool(abs(own["block"][0] - wheel) > CLEAR), "surface": surface}
    return run.comm.bcast(found, root=0)


def _yielded(domain: Domain, rows: np.ndarray, mine: np.ndarray, judge: int) -> tuple[np.ndarray | None, float]:
    """Of the cells of a part that have yielded or lie around those that did: corners, plastic strain, stresses along
    and across the track (k, 27), in input order, on rank `judge` only; at least one cell. And the part's volume [m3].
    rows : (m_local, 7) of rail_fem.fe.fields.cell_rows;  mine : (m,) this rank's cells of it. Collective."""
    comm = domain.comm
    corners, strain = domain.reference.reshape(-1, 3)[domain.cells[mine]], rows[mine, 6]
    centre = corners.mean(axis=1)
    largest = comm.allreduce(float(strain.max(initial=0.0)), op=MPI.MAX)
    box = strained_box(centre, strain, largest)
    boxes = np.array(comm.allgather(box))
    box = np.array([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])
    first = comm.allreduce(int(domain.cell_input[mine].min(initial=domain.m_global)), op=MPI.MIN)
    matters = (strain > 0) | (domain.cell_input[mine] == first)
    if largest > 0:
        matters |= near(centre, box)
    kept = np.column_stack([corners.reshape(-1, 24), strain, rows[mine, :2]])[matters]
    zone = _in_order(comm, domain.cell_input[mine[matters]], kept, judge)
    return zone, comm.allreduce(float(cell_volume(corners).sum()))


def _positions(domain: Domain, x: np.ndarray, nodes: np.ndarray) -> np.ndarray | None:
    """Reference and present positions (k, 6) [m] of input nodes, ascending. Root only. Collective."""
    local, _ = domain.local_nodes(nodes)
    both = np.column_stack([domain.reference.reshape(-1, 3)[local], x.reshape(-1, 3)[local]])
    return _in_order(domain.comm, domain.node_input[local], both)


def _in_order(comm: MPI.Comm, index: np.ndarray, rows: np.ndarray, rank: int = 0) -> np.ndarray | None:
    """Rows of all ranks, by ascending index, on one of them. Collective."""
    parts = comm.gather((index, rows), root=rank)
    if parts is None:
        return None
    return np.concatenate([part[1] for part in parts])[np.argsort(np.concatenate([part[0] for part in parts]))]


def surface_change(x: np.ndarray, fall: np.ndarray, wheel: float) -> dict[str, list[float]]:
    """How far the running surface of a body lies below what it was, strip by strip along the track.

    x, fall : (n,) of the surface's nodes: where they were, how far they have fallen beyond the crossing as a whole [m];
    wheel : its x at the end [m]
    Returns x, the middles of strips of 5 mm that lie clear of the wheel, and the largest fall of a surface node in each
    [m].
    """
    strip = np.floor(x / STRIP).astype(np.int64)
    away = np.abs((strip + 0.5) * STRIP - wheel) > CLEAR
    middles, largest = [], []
    for k in np.unique(strip[away]):
        middles.append(float((k + 0.5) * STRIP))
        largest.append(float(fall[strip == k].max()))
    return {"x": middles, "fall": largest}


def falls(run: Run, worn: np.ndarray | None) -> dict[str, np.ndarray]:
    """By how much wing and nose lie lower than before all passes, for rail_fem.passes.plastic_fields.write_arrays: of
    each body `at` (k, 2) x, y and `lowered` (k,) of its surface's nodes, and `pressed` (2,), the x between which they
    are clear of the wheel [m]. Collective, with the dynamics brought up; empty but on root.

    worn : (n,) [m] that wear has taken off each node, which does not count, on root; None: nothing
    """
    passage, running, relative = run.passage, run.passage.running, run.passage.relative
    end = running.start + run.dynamics.contact.wheel.offset - running.sign * CLEAR
    found = {"pressed": np.array(sorted((running.start, end)))}
    for body in CROSSING:
        nodes = passage.rail_nodes[passage.rail_region == body]
        positions = _positions(run.dynamics.domain, relative, nodes)
        if positions is not None:
            before, after = positions[:, :3].copy(), positions[:, 3:]
            before[:, 2] -= 0.0 if worn is None else worn[nodes]
            at, lowered = fallen(before, after, run.scene.crossing.surface, REGIONS[body])
            found |= {f"{REGIONS[body]}_at": at, f"{REGIONS[body]}_lowered": lowered}
    return found if run.comm.rank == 0 else {}


def fallen(before: np.ndarray, after: np.ndarray, crossing: AnyCrossing, body: str) -> tuple[np.ndarray, np.ndarray]:
    """Where the nodes of a surface that moved from (n, 3) to (n, 3) [m] are now, x, y (k, 2), and by how much the
    surface lies lower there (k,) [m]: what a node has sunk, less what the surface of before rises on its way. Without
    the nodes of faces that are too steep for a plan.

    Error: of second order in the nodes' way.
    """
    x, y = before[:, 0], before[:, 1]
    aside = [(ASIDE, 0.0), (-ASIDE, 0.0), (0.0, ASIDE), (0.0, -ASIDE)]
    around = np.array([crossing.heights(x + dx, y + dy, body) for dx, dy in aside])
    slope = np.stack([around[0] - around[1], around[2] - around[3]], axis=1) / (2 * ASIDE)
    known = (around > 0.5 * NO_METAL).all(axis=0) & (np.hypot(*slope.T) < np.tan(STEEPEST))
    way = after - before
    return after[known, :2], ((slope * way[:, :2]).sum(axis=1) - way[:, 2])[known]
