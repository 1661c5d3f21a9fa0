"""The meshes of a scene, the wheel positioned on the crossing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from geometry.meshing.crossing_mesh import mesh_crossing
from geometry.meshing.gmsh_process import gmsh_process
from geometry.meshing.hexmesh import HexMesh, MeshError
from geometry.meshing.wheel import mesh_wheel
from geometry.surfaces.bodies import PassBody
from rail_fem.fe.initial_position import position_wheel, smallest_gap
from rail_fem.fe.running import Running
from rail_fem.light.fine_zone import crossing_spec, wheel_spec
from rail_fem.light.own_mesh import own_mesh
from rail_fem.light.rigid import datum_height, meshed_stretch
from rail_fem.scene.scene import Scene
from rail_fem.settings.explicit import FeSettings

MOST_DESCENTS, POSITIONED = 8, 1e-9  # until a user's wheel touches: tries, gap [m]


def make_mesh(scene: Scene, settings: FeSettings, running: Running) -> tuple[HexMesh, float, float]:
    """Crossing and wheel, the wheel positioned at the start; the gap it had on the rigid path [m]; the height of its D0
    [m]. Root only.

    Errors: MeshError, CrossingError, ProfileError.
    """
    if settings.mesh:
        return _positioned_own_mesh(settings, running, scene)
    crossing, path = scene.crossing.surface, running.path
    low, high = meshed_stretch(scene, settings)
    with gmsh_process():
        rail = mesh_crossing(crossing, crossing_spec(crossing, path, low, high, settings))
        wheel = mesh_wheel(scene.wheel.shape, scene.wheel.radius, wheel_spec(path, running.datum_y, settings))
    height = datum_height(scene, running.path, running.start)
    mesh, gap = position_wheel(rail, wheel, running.start, running.datum_y, height)
    return mesh, gap, height - gap


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
