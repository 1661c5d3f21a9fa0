"""The meshes of a scene, the wheel positioned on the crossing."""

from __future__ import annotations

import numpy as np

from geometry.meshing.crossing import mesh_crossing
from geometry.meshing.gmsh_process import gmsh_process
from geometry.meshing.hexmesh import HexMesh
from geometry.meshing.wheel import mesh_wheel
from geometry.path.wheel_path import rolling_radius
from rail_fem.fe.initial_position import position_wheel
from rail_fem.fe.passage import Running
from rail_fem.light.fine_zone import crossing_spec, wheel_spec
from rail_fem.scene.scene import Scene
from rail_fem.settings.explicit import FeSettings


def make_mesh(scene: Scene, settings: FeSettings, running: Running) -> tuple[HexMesh, float, float]:
    """Crossing and wheel, the wheel positioned at the start; the gap it had on the rigid path [m]; the height of its D0
    [m]. Root only.

    Errors: MeshError, CrossingError, ProfileError.
    """
    crossing, path = scene.crossing.surface, running.path
    low, high = sorted((running.start, running.end))
    with gmsh_process():
        rail = mesh_crossing(crossing, crossing_spec(crossing, path, low, high, settings.element_size))
        wheel = mesh_wheel(
            scene.wheel.shape, scene.wheel.radius, wheel_spec(path, running.datum_y, settings.wheel_size)
        )
    height = datum_height(running, scene)
    mesh, gap = position_wheel(rail, wheel, running.start, running.datum_y, height)
    return mesh, gap, height - gap


def datum_height(running: Running, scene: Scene) -> float:
    """Height of the wheel's D0 where the rigid wheel stands at the start [m]: through its contact point."""
    path, radius = running.path, scene.wheel.radius
    i = int(np.argmin(np.abs(path.x - running.start)))
    x, y, z = path.contact_point[i]
    rolling = rolling_radius(scene.wheel.shape, radius, np.array([y - running.datum_y]))[0]
    return float(z - radius + np.sqrt(rolling**2 - (x - path.x[i]) ** 2))
