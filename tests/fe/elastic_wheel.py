"""A wheel behind a wheel's mesh and a casting below its meshes that take a second to condense, for tests of what rides
on them: coarse elements, a stiff web."""

import functools
from functools import partial

from bem.material import Elastic
from geometry.meshing.hexmesh import HexMesh
from geometry.meshing.wheel import WheelMeshSpec
from rail_fem.fe.condensed_body import Condensed, CondensedBlock
from rail_fem.processes.launcher import on_root
from rail_fem.scene.scene import Scene
from rail_fem.scene.wheel_body import WheelBody
from rail_fem.settings.explicit import FeSettings
from rail_fem.static_fe.casting_block import casting_block, footprint
from rail_fem.static_fe.wheel_base import condensed_wheel

COARSE, MODES = 40e-3, 2e3  # element of the section [m], highest mode [Hz]


def on_elastic_wheel(scene: Scene) -> Scene:
    return scene.replace_si(wheel_body=WheelBody())


@functools.cache
def coarse_wheel(radius: float = 0.425) -> Condensed:
    steel = Elastic(206e9, 0.29)
    return condensed_wheel(WheelBody(), radius, 60e-3, WheelMeshSpec.half_angle, steel, 7850.0, MODES, COARSE, 1)


def wheel_behind(scene: Scene, settings: FeSettings) -> Condensed | None:
    """In place of that of rail_fem.models.fe_full."""
    return None if scene.wheel_body is None else coarse_wheel(scene.wheel.radius)


def casting_below(scene: Scene, settings: FeSettings, mesh: HexMesh | None, **how: float) -> CondensedBlock | None:
    """In place of that of rail_fem.models.fe_full: a block of few elements, which takes a tenth of a second."""
    return None if settings.foot_depth is None else on_root(partial(coarse_block, settings, mesh, **how))


def coarse_block(settings: FeSettings, mesh: HexMesh, element: float = 50e-3, beyond: float = 1.0) -> CondensedBlock:
    bodies = tuple(body for body in (0, 1) if (mesh.region == body).any())
    prints = tuple(footprint(mesh, body) for body in bodies)
    ends = -settings.rail_depth, -settings.foot_depth
    return casting_block(prints, bodies, *ends, Elastic(206e9, 0.29), 7850.0, element, beyond=beyond)
