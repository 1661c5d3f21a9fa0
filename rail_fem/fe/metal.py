"""What a pass leaves in the metal of wing and nose: plastic strain as quantities with a limit, residual stress, and the
change of the running surface."""

from __future__ import annotations

import numpy as np

from geometry.meshing.hexmesh import HexMesh
from rail_fem.fe.checkpoint import gather_nodes
from rail_fem.fe.fields import gather_cells
from rail_fem.fe.run import Run
from rail_fem.output.plastic_zone import plastic_zone

BODIES = {"wing": 0, "nose": 1}
STRIP = 5e-3  # along the track, over which the change of the surface is looked at [m]
CLEAR = 40e-3  # from the wheel at the end of the pass: nearer, the metal is under load [m]


def metal(run: Run) -> dict[str, dict]:
    """For wing and nose the plain values of rail_fem.output.plastic_zone.PlasticZone whether the block lies clear of
    the wheel, so that its stresses are residual, and the surface: see `surface_change`. Collective, replicated."""
    run.dynamics.bring_up()
    cells, points, mesh = (
        gather_cells(run.dynamics),
        gather_nodes(run.dynamics.domain, run.dynamics.structure.x),
        run.passage.mesh,
    )
    found = {}
    if mesh is not None and cells is not None and points is not None:
        wheel = run.passage.running.start + run.dynamics.contact.offset
        moved = points - mesh.points - run.passage.crossing.displacement
        for name, region in BODIES.items():
            mine = mesh.region == region
            if mine.any():
                zone = plastic_zone(mesh.points[mesh.cells[mine]], cells[mine, 6], cells[mine, :2]).plain()
                zone["unloaded"] = bool(abs(zone["block"][0] - wheel) > CLEAR)
                found[name] = zone | {"surface": surface_change(mesh, moved, region, wheel)}
    return run.comm.bcast(found, root=0)


def surface_change(mesh: HexMesh, moved: np.ndarray, region: int, wheel: float) -> dict[str, list[float]]:
    """How far the running surface of a body lies below what it was, strip by strip along the track.

    moved : (n, 3) displacement of the nodes beyond that of the crossing as a whole [m];  wheel : its x at the end [m]
    Returns x, the middles of strips of 5 mm that lie clear of the wheel, and the largest fall of a surface node in each
    [m].
    """
    nodes = np.unique(mesh.surface[mesh.surface_region == region])
    x, fall = mesh.points[nodes, 0], -moved[nodes, 2]
    strip = np.floor(x / STRIP).astype(np.int64)
    away = np.abs((strip + 0.5) * STRIP - wheel) > CLEAR
    middles, largest = [], []
    for k in np.unique(strip[away]):
        middles.append(float((k + 0.5) * STRIP))
        largest.append(float(fall[strip == k].max()))
    return {"x": middles, "fall": largest}
