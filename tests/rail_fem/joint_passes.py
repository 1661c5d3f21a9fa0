"""A wheel over a dipped rail joint by light models, from what the P2 formula assumes to a real contact.

The formula's wheel comes down one straight slope, strikes the track mass at the bend without rebound and moves on with
it up the other; nothing but the static load and the track's spring acts on the two. P2 is then the largest force of the
track on that spring, a quarter of a period behind the bend. Here the impact without rebound is a stiff linear contact
that cannot open: what wheel and track do against one another then is a small vibration about the formula's motion.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from bem.exact.hertz import tangent_stiffness
from rail_fem.contact.contact_table import contact_table
from rail_fem.models import rigid_hertz
from rail_fem.models.lumped import one_contact
from rail_fem.passes.p2 import p2_increment
from rail_fem.passes.vertical_dynamics import TRACK, integrate
from rail_fem.passes.vertical_pass import half_steps, run_pass, scene_masses, static_start
from rail_fem.result.result import PassResult
from rail_fem.scene.scene import Scene
from rail_fem.settings.light import LumpedSettings, RigidHertzSettings

WINDOW = -0.4, 1.0  # [m]
FILTERED = -2.0, 2.4  # the same for a low pass at 20 Hz, a period to both sides of its peak [m]
STIFF = 5e13  # Hertz constant of a contact that hardly gives way [N/m^1.5]
REAL = 1e11  # about that of a wheel on a rail
NO_SUSPENSION = 1e4  # of the suspension spring: a hundredth of a real one [N/m]
TRACK_DAMPING, SUSPENSION_DAMPING, SUSPENSION = 55.4e3, 10e3, 1.2e6
ENOUGH = 3.0  # pretension over the largest force of wheel on track that the contact would have to pull


class OnSpring(NamedTuple):
    """Force of the track on its spring over the static load (m,) [N] at wheel positions x (m,) [m]."""

    scene: Scene
    x: np.ndarray
    force: np.ndarray


def joint_scene(
    angle: float,
    damping: bool = True,
    length: float = 1.2,
    shape: str = "straight",
    suspension: float = SUSPENSION,
    track_damping: float | None = None,
    suspension_damping: float | None = None,
) -> Scene:
    """Case 2's vehicle and track on plain rail with a joint.

    angle : of the dip [rad];  length : of the dip on each side [m];  track_damping, suspension_damping : none: as
        `damping` says [N s/m]
    """
    of_track, of_suspension = (TRACK_DAMPING, SUSPENSION_DAMPING) if damping else (0.0, 0.0)
    return Scene.model_validate(
        {
            "crossing": {"family": "joint", "dip_angle": angle, "dip_length": length, "dip_shape": shape},
            "wheel": {"profile": "P8"},
            "vehicle": {
                "vehicle_sprung_mass": 66250.0,
                "wheelset_unsprung_mass": 1000.0,
                "primary_stiffness": suspension,
                "primary_damping": of_suspension if suspension_damping is None else suspension_damping,
            },
            "foundation": {
                "stiffness": 1.6e8,
                "damping": of_track if track_damping is None else track_damping,
                "track_mass": 750.0,
            },
            "speed": "75 mph",
            "direction": "facing",
        }
    )


def formula(scene: Scene, damped: bool = False) -> float:
    """Increment of the P2 formula for a joint, the unsprung mass that of one wheel [N]."""
    foundation = scene.foundation
    return p2_increment(
        scene.crossing.dip_angle,
        scene.speed,
        scene.vehicle.wheel_unsprung_mass,
        foundation.track_mass,
        foundation.stiffness,
        foundation.damping if damped else 0.0,
    )


def half_period(scene: Scene) -> float:
    """Distance that the wheel covers while wheel and track mass swing once down and up [m]."""
    together = scene.vehicle.wheel_unsprung_mass + scene.foundation.track_mass
    return scene.speed * np.pi * np.sqrt(together / scene.foundation.stiffness)


def increment(found: OnSpring) -> float:
    """The formula's: largest within half a period behind the bend, over the static load [N]."""
    first = (found.x >= 0) & (found.x <= half_period(found.scene))
    return float(found.force[first].max())


def over_formula(found: OnSpring) -> float:
    """The same over the formula without damping [1]."""
    return increment(found) / formula(found.scene)


def stiff(scene: Scene, opens: bool = False, constant: float = STIFF, spacing: float = 2.5e-3) -> OnSpring:
    """One linear contact with the stiffness of a Hertz constant [N/m^1.5] under the static load, that may open or
    not."""
    settings = LumpedSettings(start=WINDOW[0], end=WINDOW[1], time_step=2e-6, path_spacing=spacing)
    table, load = contact_table(scene, *settings.window(scene), spacing), scene.static_wheel_load
    stiffness = tangent_stiffness(constant, load)
    contacts = one_contact(table, constant, "linear", load)
    if opens:
        run = run_pass(scene, settings, contacts)
        return OnSpring(scene, run.x, run.foundation_force - load)
    held = ENOUGH * (load + contact_amplitude(scene, stiffness))
    step, x = half_steps(scene, settings)
    law, masses = contacts(x), scene_masses(scene)
    start = static_start(scene, masses, law, step)
    pressed = masses._replace(load=masses.load - held * masses.coupling)  # wheel and track together, beside the load
    motion = integrate(pressed, *start, step, replace(law, height=law.height + held / stiffness))
    if not motion.force.min() > 0:
        raise ArithmeticError(
            f"joint of {1e3 * scene.crossing.dip_angle:g} mrad: a contact that cannot open has opened"
        )
    height = (motion.position[1:, TRACK] + motion.position[:-1, TRACK]) / 2
    return OnSpring(scene, x[1::2], -scene.foundation.stiffness * height - load)


def contact_amplitude(scene: Scene, stiffness: float) -> float:
    """Force of wheel on track as they vibrate against one another on the contact's spring [N/m] behind the bend [N]."""
    wheel, track = scene.vehicle.wheel_unsprung_mass, scene.foundation.track_mass
    return scene.crossing.dip_angle * scene.speed * np.sqrt(stiffness * wheel * track / (wheel + track))


def hertz_pass(scene: Scene, window: tuple[float, float] = WINDOW) -> PassResult:
    """By rigid_hertz: Hertz contact that may open and yield."""
    return rigid_hertz.solve(scene, RigidHertzSettings(start=window[0], end=window[1]))


def hertz(scene: Scene) -> OnSpring:
    """The same, the track's spring alone."""
    history = hertz_pass(scene).history
    force = -scene.foundation.stiffness * history["crossing_height"] - scene.static_wheel_load
    return OnSpring(scene, history["x"], force)
