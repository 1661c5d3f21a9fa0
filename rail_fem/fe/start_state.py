"""How a pass begins: at rest under the static load, or in the middle of one, as a less expensive model has found it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rail_fem.contact.contact_table import contact_table
from rail_fem.passes.plastic_indentation import contacts_of
from rail_fem.passes.vertical_dynamics import TRACK, WHEEL
from rail_fem.passes.vertical_pass import run_pass
from rail_fem.result.events import OPEN
from rail_fem.scene.scene import GRAVITY, Scene
from rail_fem.settings.light import RigidHertzSettings

SPRUNG = 0  # index of the sprung mass in a light pass


@dataclass(frozen=True)
class StartState:
    """The scene where settling ends. Upwards positive.

    force : of contact [N];  suspension, foundation : compression of the springs [m];
    axle, sprung, crossing : velocities [m/s];  resting :
    under the static load along a straight path
    """

    force: float
    suspension: float
    foundation: float
    axle: float
    sprung: float
    crossing: float
    resting: bool


def resting(scene: Scene, vertical_speed: float) -> StartState:
    """Static load, all of the vehicle along the path at its vertical speed [m/s], the crossing at rest."""
    weight, mass = scene.static_wheel_load, scene.vehicle.wheel_sprung_mass
    return StartState(
        weight,
        mass * GRAVITY / scene.vehicle.primary_stiffness,
        weight / scene.foundation.stiffness,
        vertical_speed,
        vertical_speed,
        0.0,
        True,
    )


def from_rigid_hertz(scene: Scene, settings: RigidHertzSettings, x: float) -> StartState:
    """The state of a rigid_hertz pass when the wheel is at x [m]. Errors: ValueError where it is in the air there, or
    never comes there."""
    run = run_pass(
        scene,
        settings,
        contacts_of(scene, settings, contact_table(scene, *settings.window(scene), settings.path_spacing)),
    )
    if not min(run.x) <= x <= max(run.x):
        raise ValueError(
            f"x = {x * 1e3:g} mm lies outside the approach by rigid_hertz from {run.x[0] * 1e3:g} to"
            f" {run.x[-1] * 1e3:g} mm: give an earlier approach_start"
        )
    step = int(np.argmin(np.abs(run.x - x)))
    position, velocity, force = run.motion.position[step], run.motion.velocity[step], float(run.force[:, step].sum())
    if force < OPEN * scene.static_wheel_load:
        raise ValueError(
            f"rigid_hertz finds the wheel in the air at x = {x * 1e3:.0f} mm: begin where it is in contact"
        )
    return StartState(
        force=force,
        suspension=float(position[WHEEL] - position[SPRUNG]),
        foundation=float(-position[TRACK]),
        axle=float(velocity[WHEEL]),
        sprung=float(velocity[SPRUNG]),
        crossing=float(velocity[TRACK]),
        resting=False,
    )
