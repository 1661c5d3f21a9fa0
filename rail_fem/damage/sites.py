"""From a case to what is to be worn: its laws, its traffic, a switch's section, passes over a crossing."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bem.halfspace.falling_friction import FallingFriction
from bem.material import Elastic
from geometry.surfaces.switch import Switch
from rail_fem.damage.crossing import CrossingContact, WearField, pass_contacts, wear_field
from rail_fem.damage.evolution import Stepping
from rail_fem.damage.fatigue import WholeLifeRail
from rail_fem.damage.rolling import Rolling
from rail_fem.damage.section import Passing, Section, scattered, sine_positions
from rail_fem.damage.wear import Archard, WearLaw, dry_laws
from rail_fem.hierarchy import solve
from rail_fem.output.result import PassResult
from rail_fem.scene.scene import Scene
from rail_fem.settings.damage import DamageSettings

LEADING = "archard"


def laws_of(settings: DamageSettings) -> dict[str, WearLaw]:
    """The laws of a study, by name."""
    laws = dry_laws(settings.hardness)
    if settings.wear_coefficient is not None:
        k = settings.wear_coefficient
        laws["archard"] = Archard(settings.hardness, coefficient=k, label=f"Archard, k = {k:g}")
    return laws


def stepping_of(settings: DamageSettings) -> Stepping:
    """How its passes are taken in blocks."""
    return Stepping(settings.law, settings.block, settings.tolerance, settings.smoothing, settings.depth_limit)


def fatigue_of(settings: DamageSettings) -> WholeLifeRail:
    """Its damage function."""
    return WholeLifeRail(settings.onset, settings.peak, settings.balance)


def friction_of(scene: Scene, settings: DamageSettings, speed: float) -> float | FallingFriction:
    """Friction at a rolling speed [m/s]."""
    if settings.kinetic_friction is None:
        return scene.friction
    return FallingFriction.at_speed(scene.friction, settings.kinetic_friction, settings.decay_speed, speed)


def traffic_of(scene: Scene, settings: DamageSettings) -> tuple[tuple[Scene, float], ...]:
    """The scene of each kind of pass, and its share. Errors: pydantic.ValidationError for a wheel that is none."""
    wheels = settings.wheels or (None,)
    weights, speeds = settings.weights or (1.0,), settings.speeds or (None,) * len(wheels)
    made = []
    for wheel, weight, speed in zip(wheels, weights, speeds, strict=True):
        changes = {} if wheel is None else {"wheel": {"profile": wheel}}
        made.append((scene.replace(**changes, **({} if speed is None else {"speed": speed})), weight))
    return tuple(made)


def switch_section(scene: Scene, settings: DamageSettings) -> Section:
    """The parametric switch at the position asked for, with the case's wheels on their sine."""
    site, passings = settings.switch, []
    positions, shares = sine_positions(site.lateral, site.amplitude, site.positions)
    for own, weight in traffic_of(scene, settings):
        steels = (own.materials.wheel.steel(), own.materials.nose.steel())
        elastic = [Elastic(steel.youngs_modulus, steel.poisson) for steel in steels]
        rolling = Rolling(
            own.speed, friction_of(own, settings, own.speed), settings.initial_slope, settings.cells, *elastic
        )
        load = own.static_wheel_load
        passings += [
            Passing(own.wheel.shape, own.wheel.radius, (load, load), float(y), rolling, weight * float(share), site.yaw)
            for y, share in zip(positions, shares, strict=True)
        ]
    track = Switch().track(site.distance, scene.gauge)
    return Section(
        track, tuple(passings), laws_of(settings), settings.calibration, site.rail_stiffness, scene.back_to_back
    )


def crossing_passes(scene: Scene, settings: DamageSettings, run: Mapping | None = None):
    """For each kind of pass and lateral position: (share, result of rigid_hertz, its contacts); yields one after the
    other."""
    positions, shares = scattered(0.0, settings.lateral_scatter)
    for own, weight in traffic_of(scene, settings):
        result = solve("rigid_hertz", own, run)
        for shift, share in zip(positions, shares, strict=True):
            yield weight * float(share), result, contacts_of_pass(result, settings, float(shift))


def contacts_of_pass(result: PassResult, settings: DamageSettings, shift: float = 0.0) -> tuple[CrossingContact, ...]:
    """Patches of one pass as the study wants them."""
    scene = result.scene
    return pass_contacts(
        result,
        settings.patch_spacing,
        friction=friction_of(scene, settings, scene.speed),
        initial_slope=settings.initial_slope,
        cells=settings.cells,
        shift=shift,
        hardness=settings.hardness,
    )


def mean_field(fields: list[tuple[float, WearField]]) -> WearField:
    """Mean of fields on one grid, by their shares; its contacts are those of the first."""
    first = fields[0][1]
    mean = lambda pick: sum(weight * pick(field) for weight, field in fields)
    depth = {
        law: {b: mean(lambda f, law=law, b=b: f.depth[law][b]) for b in parts} for law, parts in first.depth.items()
    }
    work = {b: mean(lambda f, b=b: f.work[b]) for b in first.work}
    return WearField(first.x, first.y, depth, work, first.contacts)


def field_of(contacts: tuple[CrossingContact, ...], settings: DamageSettings, grid) -> WearField:
    """Wear of one pass on a common grid: x and y [m]."""
    return wear_field(contacts, laws_of(settings), settings.calibration, settings.patch_spacing, grid=grid)


def common_grid(scene: Scene, result: PassResult, settings: DamageSettings) -> tuple[np.ndarray, np.ndarray]:
    """x and y [m] of a plan that holds the whole pass."""
    x = result.history["x"]
    step = settings.patch_spacing
    return np.arange(x.min() - 0.06, x.max() + 0.06, step), np.arange(-0.06, 0.09, 0.5e-3)
