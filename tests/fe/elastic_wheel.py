"""A wheel behind a wheel's mesh that takes a second to condense, for tests of what rides on it: a stiff web of coarse
elements."""

import functools

from bem.material import Elastic
from geometry.meshing.wheel import WheelMeshSpec
from rail_fem.fe.condensed_body import Condensed
from rail_fem.scene.scene import Scene
from rail_fem.scene.wheel_body import WheelBody
from rail_fem.settings.explicit import FeSettings
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
