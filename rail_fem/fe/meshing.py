"""The meshes of a scene, the wheel positioned on the crossing."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from functools import partial

import numpy as np

from geometry.meshing.gmsh_process import gmsh_process
from geometry.meshing.hexmesh import HexMesh, MeshError, merge_bodies
from geometry.surfaces.bodies import PassBody
from rail_fem.contact.rigid import datum_height
from rail_fem.fe.initial_position import position_wheel, smallest_gap
from rail_fem.fe.plan.kept_meshes import body_meshes, is_kept, kept
from rail_fem.fe.plan.own_mesh import own_mesh
from rail_fem.fe.running import Running
from rail_fem.processes.launcher import dealt_out
from rail_fem.scene.scene import Scene
from rail_fem.settings.explicit import FeSettings

MOST_DESCENTS, POSITIONED = 8, 1e-9  # until a user's wheel touches: tries, gap [m]


Placed = tuple[HexMesh, float, float]


def make_mesh(scene: Scene, settings: FeSettings, running: Running) -> Placed | None:
    """Crossing and wheel, the wheel positioned at the start; the gap it had on the rigid path [m]; the height of its D0
    [m]. On root; None on the other ranks, which mesh some of the bodies. Collective.

    Errors: MeshError, CrossingError, ProfileError.
    """
    bodies = [] if settings.mesh else _bodies(scene, settings, running)

    def place() -> Placed:
        if settings.mesh:
            return _positioned_own_mesh(settings, running, scene)
        height = datum_height(scene, running.path, running.start)
        mesh, gap = position_wheel(merge_bodies(bodies[:-1]), bodies[-1], running.start, running.datum_y, height)
        return mesh, gap, height - gap

    placed = dealt_out([place])
    return placed[0] if placed else None


def _bodies(scene: Scene, settings: FeSettings, running: Running) -> list[HexMesh]:
    """Bodies of the crossing, then the wheel, each meshed by one of the ranks or kept from an earlier run; on root.
    Collective."""
    meshers = body_meshes(scene, settings, running.path)
    with contextlib.nullcontext() if all(map(is_kept, meshers)) else gmsh_process():
        return dealt_out([partial(kept, mesher) for mesher in meshers])


def _positioned_own_mesh(settings: FeSettings, running: Running, scene: Scene) -> tuple[HexMesh, float, float]:
    """The user's mesh with its wheel set down on the crossing at the start; how much lower its D0 then is than on the
    rigid path [m]; the height of D0 [m]. Errors: MeshError."""
    mesh, height = own_mesh(scene, settings)
    is_wheel = mesh.surface_region == PassBody.WHEEL
    wheel_nodes = np.unique(mesh.cells[mesh.region == PassBody.WHEEL])
    points = mesh.points.copy()
    for _ in range(MOST_DESCENTS):
        rail, wheel = (replace(mesh, points=points, surface=mesh.surface[part]) for part in (~is_wheel, is_wheel))
        gap = smallest_gap(rail, wheel)
        if not np.isfinite(gap):
            raise MeshError(
                f"{settings.mesh}: the wheel's contact surface has no face over the crossing's at x ="
                f" {running.start * 1e3:.4g} mm: let both reach to where they touch"
            )
        points[wheel_nodes, 2] -= gap
        height -= gap
        if abs(gap) < POSITIONED:
            break
    return replace(mesh, points=points), datum_height(scene, running.path, running.start) - height, height
