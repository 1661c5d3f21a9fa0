"""How the wheel runs: the rigid path around its travel, direction, speed and spin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometry.path.wheel_path import WheelPath, rolling_radius
from geometry.profiles.profile import Profile
from rail_fem.contact.rigid import anchored_path, meshed_stretch
from rail_fem.scene.scene import Scene
from rail_fem.settings.explicit import FeSettings


@dataclass(frozen=True)
class Running:
    """How the wheel runs: sign (+1 facing, -1 trailing), start and end x [m], signed speed [m/s], spin about y at the
    start [rad/s]:
    that of pure rolling there, the rigid path around its travel, lateral position of the wheel's D0 [m], its
    profile."""

    sign: float
    start: float
    end: float
    speed: float
    spin: float
    path: WheelPath
    datum_y: float
    profile: Profile

    @property
    def duration(self) -> float:
        return (self.end - self.start) / self.speed

    def creep(self, spin: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Longitudinal creep (n,) of contacts at lateral positions y [m]: (speed - spin * rolling radius) / speed, +
        where the wheel is braked."""
        return 1.0 - spin * rolling_radius(self.profile, self.path.radius, y - self.datum_y) / self.speed

    @property
    def transfers(self) -> np.ndarray:
        """x where the rigid wheel is in contact with wing and nose at once on its travel (k,) [m]."""
        low, high = sorted((self.start, self.end))
        return self.path.transfers[(self.path.transfers >= low) & (self.path.transfers <= high)]

    def height(self, x) -> np.ndarray:
        return np.interp(x, self.path.x, self.path.height)

    def slope(self, x) -> np.ndarray:
        return np.interp(x, self.path.x, self.path.slope)


def running_of(scene: Scene, settings: FeSettings) -> Running:
    """The rigid path around the window and the direction of travel. Errors: CrossingError, ProfileError."""
    start, end = scene.in_order_of_travel(settings.start, settings.end)
    path = anchored_path(scene, *meshed_stretch(scene, settings))
    shape, radius, datum = scene.wheel.shape, scene.wheel.radius, scene.wheel_datum_y
    first = path.contact_point[int(np.argmin(np.abs(path.x - start)))]
    rolling = float(rolling_radius(shape, radius, first[1:2] - datum)[0])
    return Running(scene.direction_sign, start, end, scene.velocity, scene.velocity / rolling, path, datum, shape)
