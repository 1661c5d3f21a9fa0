"""From a case to what is to be worn: its laws, its traffic, a switch's section, passes over a crossing."""

import functools
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from bem.patch import Patch
from geometry.surfaces.switch import Switch
from rail_fem.case.variations import quantity_at
from rail_fem.damage.crossing import friction_of
from rail_fem.damage.crossing_site import CrossingPass, CrossingSite
from rail_fem.damage.evolution import LEAST_SHARE, Stepping
from rail_fem.damage.groove import FlowLaw
from rail_fem.damage.rolling import Rolling
from rail_fem.damage.section import Passing, Section, scattered, sine_positions
from rail_fem.damage.subsurface import SubsurfaceSteel, subsurface_fatigue
from rail_fem.damage.traffic import WELD, Event, equivalent_tonnage
from rail_fem.damage.turning import wheels_between, wheels_on_line, worn_on_line
from rail_fem.damage.wear import laws_of
from rail_fem.processes.pool import Pool
from rail_fem.scene.base import InputError
from rail_fem.scene.scene import Scene, Wheel
from rail_fem.settings.damage import DamageFleet, DamageSettings, Traffic
from rail_fem.settings.light import RigidHertzSettings

PLAN = -0.05, 0.07  # y of a crossing's plan [m]
BEYOND = 0.06  # of a crossing's plan before and after the pass [m]
ROWS = 16  # of a patch, whose stress histories are judged
CROSSING_SHARE = 0.1  # of the passes done, that a block of a crossing is long at least


def stepping_of(settings: DamageSettings) -> Stepping:
    """How its passes are taken in blocks."""
    crossing = settings.site == "crossing"
    share = (CROSSING_SHARE if crossing else LEAST_SHARE) if settings.block_share is None else settings.block_share
    return Stepping(
        settings.law,
        settings.block,
        settings.tolerance,
        settings.smoothing,
        settings.depth_limit,
        share,
        settings.block_depth if crossing else np.inf,
        tuple((event.time * settings.axles_per_year, event) for event in maintenance_of(settings)),
        settings.flow_step,
        np.inf if crossing else settings.tolerance,
    )


def maintenance_of(settings: DamageSettings) -> tuple[Event, ...]:
    """Its grindings and weldings in their order. Where both fall together welding comes last."""
    events = [Event(t, removes=settings.grinding_depth) for t in settings.grindings]
    return tuple(sorted(events + [replace(WELD, time=t) for t in settings.weldings], key=lambda event: event.time))


def subsurface_of(patch: Patch, settings: DamageSettings) -> dict[str, float]:
    """Dang Van's equivalent stress over its limit, at which depth [m], and the largest fatigue parameter of Jiang and
    Sehitoglu [Pa] below a passing patch."""
    steel = SubsurfaceSteel(settings.dang_van, settings.fatigue_limit, settings.residual_stress)
    found = subsurface_fatigue(patch, steel, rows=ROWS)
    share, depth = found.worst
    return {"dang_van": share, "depth": depth, "jiang_sehitoglu": float(found.jiang.max())}


def traffic_of(scene: Scene, settings: DamageSettings) -> tuple[tuple[Scene, float], ...]:
    """The scene of each kind of pass, and its share. Errors: ValueError for a wheel or a draw that is none."""
    if settings.fleet is not None:
        return drawn_traffic(scene, settings.fleet)
    made = []
    for kind in settings.traffic or (Traffic(),):
        changes: dict[str, Any] = {"wheel": {"profile": kind.wheel, "label": ""}} if kind.wheel else {}
        changes |= {} if kind.speed is None else {"speed": kind.speed}
        changes |= {} if kind.axle_load is None else {"vehicle": {"axle_load": kind.axle_load}}
        try:
            made.append((scene.replace_si(**changes), kind.share))
        except InputError as error:
            raise ValueError(f"damage.traffic[{len(made)}]: {error}") from None
    return tuple(made)


def wheels_of(scene: Scene, settings: DamageSettings) -> tuple[tuple[Scene, float], ...]:
    """The traffic, its wheels at all ages where they are turned. Errors: those of `traffic_of`."""
    traffic, turning = traffic_of(scene, settings), settings.turning
    if turning is None or turning.until == 0:
        return traffic
    made = []
    for own, share in traffic:
        if turning.line:
            way = worn_on_line(own, laws_of(settings, wheels=True)[settings.law], settings.factor, turning.line)
            wheels = wheels_on_line(own.wheel, way, turning.until, turning.ages)
        else:
            wheels = wheels_between(own.wheel, Wheel(profile=turning.worn), turning.until, turning.ages)
        made += [(own.replace_si(wheel=wheel), share / turning.ages) for wheel in wheels]
    return tuple(made)


def drawn_traffic(scene: Scene, fleet: DamageFleet) -> tuple[tuple[Scene, float], ...]:
    """As `traffic_of` of a fleet. Errors: ValueError with the key that cannot be drawn."""
    made = []
    for number, changes in enumerate(fleet.drawn(fleet.kinds, quantity_at), 1):
        tables: dict[str, Any] = {}
        for key, value in changes.items():
            *names, last = key.split(".")[1:]
            into = functools.reduce(lambda table, name: table.setdefault(name, {}), names, tables)
            into[last] = value
        try:
            made.append((scene.replace(**tables), 1 / fleet.kinds))
        except InputError as error:
            raise ValueError(f"damage.fleet, kind {number}: {error}") from None
    return tuple(made)


def tonnage_of(scene: Scene, settings: DamageSettings) -> dict[str, float]:
    """Million gross tonnes a year, and equivalent ones (EMGTPA)."""
    traffic = traffic_of(scene, settings)
    kinds = settings.traffic or [settings.fleet or Traffic()] * len(traffic)
    rows = [
        (kind.stock, own.speed, settings.axles_per_year * share * own.axle_load / 1e9)
        for kind, (own, share) in zip(kinds, traffic, strict=True)
    ]
    return {"gross": sum(tonnes for *_, tonnes in rows), "equivalent": equivalent_tonnage(rows)}


def switch_section(scene: Scene, settings: DamageSettings) -> Section:
    """The parametric switch at the position asked for, with the case's wheels on their sine."""
    site, passings = settings.switch, []
    positions, shares = sine_positions(site.lateral, site.amplitude, site.positions)
    for own, weight in wheels_of(scene, settings):
        elastic = own.materials.wheel.steel().elastic, own.materials.nose.steel().elastic
        rolling = Rolling(own.speed, friction_of(own, settings), settings.initial_slope, settings.cells, *elastic)
        load = own.static_wheel_load
        passings += [
            Passing(own.wheel.shape, own.wheel.radius, (load, load), float(y), rolling, weight * float(share), site.yaw)
            for y, share in zip(positions, shares, strict=True)
        ]
    track = Switch().track(site.distance, scene.gauge)
    return Section(track, tuple(passings), laws_of(settings), settings, scene.back_to_back)


def crossing_site(
    scene: Scene, settings: DamageSettings, run: RigidHertzSettings | Mapping | None = None, pool: Pool | None = None
) -> CrossingSite:
    """The case's crossing with its wheels, each at every lateral position. Errors: InputError for
    numerics that are none, ValueError for a wheelset of several degrees of freedom."""
    numerics = run if isinstance(run, RigidHertzSettings) else RigidHertzSettings.model_validate(dict(run or {}))
    if numerics.degrees_of_freedom != "vertical":
        raise ValueError(
            f'run.rigid_hertz.degrees_of_freedom: "{numerics.degrees_of_freedom}": a crossing that wears is passed by'
            ' wheels whose lateral position is given (lateral_scatter): leave it out, or write "vertical"'
        )
    passes = []
    positions, shares = scattered(0.0, settings.lateral_scatter)
    drawn = settings.fleet is not None and "scene.vehicle.axle_load" in settings.fleet.draw
    by_load = drawn or any(kind.axle_load for kind in settings.traffic)
    for own, weight in wheels_of(scene, settings):
        passes += [
            CrossingPass(own, float(shift), weight * float(share), by_load)
            for shift, share in zip(positions, shares, strict=True)
        ]
    low, high = sorted(numerics.window(scene))
    x = np.arange(low - BEYOND, high + BEYOND, settings.patch_spacing)
    y = np.arange(PLAN[0], PLAN[1], settings.plan_spacing)
    return CrossingSite(
        scene.crossing.surface,
        tuple(passes),
        laws_of(settings),
        settings,
        numerics,
        (x, y),
        pool,
        FlowLaw(settings.flow_limit, settings.flow_share) if settings.plastic_flow else None,
    )
