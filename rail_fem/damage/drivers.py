"""What drives a crossing's wear: elasticities of the volume worn off to what the case says."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from geometry.surfaces.bodies import BODIES
from rail_fem.damage.crossing import pass_contacts, patch_options
from rail_fem.damage.wear import laws_of, worn_area
from rail_fem.hierarchy import solve
from rail_fem.scene.scene import Scene
from rail_fem.settings.damage import DamageSettings

SHAPES = ("P8", "P8-worn", "P8-hollow")
CELLS = 20  # of a patch, each way, at most
# name -> value of a scene, and the scene with another one
DRIVERS: dict[str, tuple[Callable[[Scene], float], Callable[[Scene, float], Scene]]] = {
    "speed": (lambda scene: scene.speed, lambda scene, value: scene.replace_si(speed=value)),
    "sprung mass": (
        lambda scene: scene.vehicle.vehicle_sprung_mass,
        lambda scene, value: scene.replace_si(vehicle={"vehicle_sprung_mass": value}),
    ),
    "friction": (lambda scene: scene.friction, lambda scene, value: scene.replace(friction=value)),
    "foundation stiffness": (
        lambda scene: scene.foundation.stiffness,
        lambda scene, value: scene.replace_si(foundation={"stiffness": value}),
    ),
}


class Sensitivity(NamedTuple):
    """First order: elasticity d ln(damage) / d ln(parameter) by a central difference, and what twice the step gives:
    its error."""

    name: str
    base: float
    elasticity: float
    error: float


def elasticity(name: str, base: float, damage_at) -> Sensitivity:
    """Of damage_at(parameter) at `base`, by central differences of 5 and 10 %; NaN where there is none on a side."""

    def slope(h: float) -> float:
        low, high = damage_at(base * (1 - h)), damage_at(base * (1 + h))
        return float(np.log(high / low) / np.log((1 + h) / (1 - h))) if low > 0 and high > 0 else np.nan

    fine, coarse = slope(0.05), slope(0.1)
    return Sensitivity(name, base, fine, abs(fine - coarse))


def volume(scene: Scene, settings: DamageSettings, run: Mapping[str, Any] | None) -> float:
    """Worn off the nose by one pass of the scene's wheel [m3]."""
    result, settings = solve("rigid_hertz", scene, run), settings.replace(cells=min(settings.cells, CELLS))
    contacts = pass_contacts(result, settings.patch_spacing, options=patch_options(scene, settings))
    areas = worn_area(laws_of(settings)[settings.law], contacts.patches, contacts.speed)
    return float(areas[contacts.body == BODIES.index("nose")].sum()) * settings.patch_spacing


def wheel_ratios(scene: Scene, settings: DamageSettings, run: Mapping[str, Any] | None) -> dict[str, float]:
    """Volume worn off the nose by one pass of each wheel shape of the scene's radius, over that of the scene's own."""
    own = volume(scene, settings, run)
    return {
        shape: volume(scene.replace(wheel={"profile": shape}), settings, run) / own if own > 0 else float("nan")
        for shape in SHAPES
    }


def sensitivities(scene: Scene, settings: DamageSettings, run: Mapping[str, Any] | None) -> tuple[Sensitivity, ...]:
    """d ln(volume) / d ln(parameter) of each driver, by central differences of 5 and 10 %; errors are their
    difference. A law that jumps from regime to regime has large ones."""
    return tuple(
        elasticity(name, read(scene), lambda value, change=change: volume(change(scene, value), settings, run))
        for name, (read, change) in DRIVERS.items()
    )
