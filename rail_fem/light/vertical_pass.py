"""A pass of a few masses over contacts: from a scene and its contacts to histories, for the models lumped and
rigid_hertz.

q = (sprung mass, wheel, track): heights [m]; the wheel's is that of its axle less the rolling radius, the track's that
of its position at rest without load. Vertical only; the wheel runs straight on at the scene's speed (assumptions of the
thesis, section 7.2.1.1).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rail_fem.light.vertical_dynamics import (
    ContactLaw,
    Masses,
    VerticalMotion,
    contact_energies,
    integrate,
    static_distance,
)
from rail_fem.output.events import OPEN, peak_at
from rail_fem.output.result import Peak
from rail_fem.scene.scene import GRAVITY, Scene
from rail_fem.settings.light import PassSettings

Contacts = Callable[[np.ndarray], ContactLaw]  # wheel positions x (m,) [m] -> the law there

WHEEL, TRACK = 1, 2
MOST_STEPS = 20_000_000


@dataclass(frozen=True)
class LightPass:
    """A finished pass at the middles of its m steps: time (m,) [s], x (m,) [m], force (bodies, m) [N], and the motion
    itself."""

    time: np.ndarray
    x: np.ndarray
    force: np.ndarray
    motion: VerticalMotion
    masses: Masses
    step: float
    contact_energy: np.ndarray

    @property
    def position(self) -> np.ndarray:
        """(m, 3) heights at the middles of the steps [m]."""
        return (self.motion.position[1:] + self.motion.position[:-1]) / 2

    @property
    def foundation_force(self) -> np.ndarray:
        """(m,) force of the track on its spring [N], damper left out: what the P2 formula calls P2."""
        return -self.masses.stiffness[TRACK, TRACK] * self.position[:, TRACK]


def scene_masses(scene: Scene) -> Masses:
    """Sprung mass, half a wheelset and track mass, on suspension and foundation, each under its weight.

    The suspension's spring is taken without its static length, so that the sprung mass is as high as the wheel when it
    carries nothing.
    """
    vehicle, foundation = scene.vehicle, scene.foundation
    mass = np.array([vehicle.wheel_sprung_mass, vehicle.wheel_unsprung_mass, foundation.track_mass])
    if not (mass > 0).all():
        raise ValueError(
            f"scene.foundation.track_mass: {foundation.track_mass:g} kg, the light models need a mass under the"
            " contact: give more than 0 kg"
        )
    between = np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
    under = np.diag([0.0, 0.0, 1.0])
    load = np.array([-mass[0], -mass[1], 0.0]) * GRAVITY  # the track's own weight is in its position at rest
    return Masses(
        mass,
        vehicle.primary_stiffness * between + foundation.stiffness * under,
        vehicle.primary_damping * between + foundation.damping * under,
        load,
        np.array([0.0, 1.0, -1.0]),
    )


def run_pass(scene: Scene, settings: PassSettings, contacts: Contacts, step: float | None = None) -> LightPass:
    """March from static equilibrium over the window. Errors: ValueError for a step count beyond reason,
    FloatingPointError."""
    step, x = half_steps(scene, settings, step)
    law, masses = contacts(x), scene_masses(scene)
    position, velocity = static_start(scene, masses, law, step)
    motion = integrate(masses, position, velocity, step, law)
    height, stiffness, exponent = law.arrays
    energy = contact_energies(motion.position @ masses.coupling, height[:, ::2], stiffness[:, ::2], exponent)
    return LightPass(
        (np.arange(motion.force.shape[1]) + 0.5) * step, x[1::2], motion.force, motion, masses, step, energy
    )


def half_steps(scene: Scene, settings: PassSettings, step: float | None = None) -> tuple[float, np.ndarray]:
    """Time step [s], the settings' or `step` or a little less, and wheel positions x (2 m + 1,) [m] at ends and middles
    of m steps over the window.

    Errors: ValueError for a step count beyond reason.
    """
    start, end = settings.window(scene)
    duration = abs(end - start) / scene.speed
    count = max(2, int(np.ceil(duration / (step or settings.time_step) - 1e-9)))
    if count > MOST_STEPS:
        raise ValueError(
            f"time_step: {settings.time_step:g} s makes {count:.3g} steps of a pass of {duration:.3g} s: take more than"
            f" {duration / MOST_STEPS:.1g} s"
        )
    return duration / count, np.linspace(start, end, 2 * count + 1)


def static_start(scene: Scene, masses: Masses, law: ContactLaw, step: float):
    """Heights and velocities (3,), (3,) of steady running along the path's first slope under the static load."""
    load = scene.static_wheel_load
    distance = static_distance(load, law)
    track = -load / scene.foundation.stiffness
    wheel = distance + track
    sprung = wheel - masses.mass[0] * GRAVITY / scene.vehicle.primary_stiffness
    rate = (np.max(law.height[:, 1]) - np.max(law.height[:, 0])) / (step / 2)
    return np.array([sprung, wheel, track]), np.array([rate, rate, 0.0])


def history_rows(run: LightPass, interval: float) -> slice:
    """Which steps become rows of the history."""
    return slice(0, None, max(1, int(round(interval / run.step))))


def common_history(run: LightPass) -> dict[str, np.ndarray]:
    """Columns (m,) of rail_fem.output.history that every light pass resolves; energies at the ends of the steps."""
    position = run.position
    return {
        "time": run.time,
        "x": run.x,
        "force": run.force.sum(axis=0),
        "wheel_height": position[:, WHEEL],
        "crossing_height": position[:, TRACK],
        **energy_columns(run),
    }


def energy_columns(run: LightPass) -> dict[str, np.ndarray]:
    """Energies (m,) [J] after each step. external: weight and the motion over the path; balance: what the scheme loses,
    second order in the step."""
    q, v, masses = run.motion.position, run.motion.velocity, run.masses
    kinetic = 0.5 * (v**2) @ masses.mass
    springs = 0.5 * np.einsum("mi,ij,mj->m", q, masses.stiffness, q)
    external = np.r_[0.0, np.cumsum(run.motion.path_work)] + (q - q[0]) @ masses.load
    damping = np.r_[0.0, np.cumsum(run.motion.loss)]
    total = kinetic + springs + run.contact_energy + damping - external
    columns = {
        "energy_kinetic": kinetic,
        "energy_springs": springs,
        "energy_contact": run.contact_energy,
        "energy_damping": damping,
        "energy_external": external,
        "energy_balance": total - total[0],
    }
    return {name: values[1:] for name, values in columns.items()}


def foundation_peak(run: LightPass) -> Peak:
    """Largest force on the foundation's spring."""
    forces = {"time": run.time, "x": run.x, "foundation": run.foundation_force}
    return peak_at(forces, "foundation", int(np.argmax(run.foundation_force)))


def lift_offs(run: LightPass, static_load: float) -> tuple[int, float]:
    """How often the wheel lifts off, and for how long in all [s]."""
    lifted = run.force.sum(axis=0) < OPEN * static_load
    starts = np.count_nonzero(np.diff(np.r_[False, lifted].astype(int)) == 1)
    return int(starts), float(lifted.sum() * run.step)


def step_error(fine: LightPass, coarse: LightPass) -> float:
    """Relative error of the force history from twice the step, second order: L2 of the difference over three of L2 of
    the fine one."""
    difference = np.interp(coarse.time, fine.time, fine.force.sum(axis=0)) - coarse.force.sum(axis=0)
    return float(np.linalg.norm(difference) / np.linalg.norm(coarse.force.sum(axis=0)) / 3)


def force_change(run: LightPass, other: LightPass) -> float:
    """Relative L2 change of the force history."""
    one, two = run.force.sum(axis=0), other.force.sum(axis=0)
    return float(np.linalg.norm(one - two) / np.linalg.norm(one))
