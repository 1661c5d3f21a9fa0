"""How a pass begins: at rest under the static load, or in the middle of one, as a less expensive model has found it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rail_fem.contact.contact_table import contact_table
from rail_fem.passes.plastic_indentation import contacts_of
from rail_fem.passes.track_beam import BeamMotion
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
    axle, sprung, crossing : velocities [m/s];  resting : under the static load along a straight path
    beam : what the crossing stands on, where a scene names bearers, and its motion; then `crossing` is 0, for the
        crossing moves with it
    """

    force: float
    suspension: float
    foundation: float
    axle: float
    sprung: float
    crossing: float
    resting: bool
    beam: BeamMotion | None = None

    @property
    def moves(self) -> bool:
        """Whether anything but a wheel along its path does."""
        return not self.resting or self.beam is not None


def resting(scene: Scene, vertical_speed: float, beam: BeamMotion | None = None, x: float = 0.0) -> StartState:
    """Static load, all of the vehicle along the path at its vertical speed [m/s], the crossing at rest; on a beam that
    carries the load at x [m] with the beam."""
    weight, mass = scene.static_wheel_load, scene.vehicle.wheel_sprung_mass
    sag = weight / scene.foundation.stiffness
    if beam is not None:
        sag, vertical_speed = -beam.height(x), vertical_speed + beam.rise(x, scene.velocity)
    return StartState(
        weight, mass * GRAVITY / scene.vehicle.primary_stiffness, sag, vertical_speed, vertical_speed, 0.0, True, beam
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
    beam = run.beam_at(step)
    return StartState(
        force=force,
        suspension=float(position[WHEEL] - position[SPRUNG]),
        foundation=float(-position[TRACK]) if beam is None else -beam.height(x),
        axle=float(velocity[WHEEL]),
        sprung=float(velocity[SPRUNG]),
        crossing=float(velocity[TRACK]) if beam is None else 0.0,
        resting=False,
        beam=beam,
    )
