"""A pass of a few masses over contacts: from a scene and its contacts to histories, for the models lumped and
rigid_hertz.

q = (sprung mass, wheel, track): heights [m]; the wheel's is that of its axle less the rolling radius, the track's that
of its position at rest without load. Where a scene names bearers there is no track mass: the wheel runs on a beam
(rail_fem.passes.track_beam); where it gives the wheel's body, its modes are masses more (rail_fem.passes.wheel_modes).
Vertical only; the wheel runs straight on at the scene's speed (assumptions of the
thesis, section 7.2.1.1).
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from geometry.surfaces.bodies import BODIES
from rail_fem.contact.contact_law import ContactLaw, contact_energies
from rail_fem.passes.vertical_dynamics import SPRUNG, TRACK, BeamStart, Masses, PassMotion, integrate, static_distance
from rail_fem.result.events import peak_at
from rail_fem.result.result import Peak
from rail_fem.scene.scene import GRAVITY, Scene
from rail_fem.settings.light import PassSettings

if TYPE_CHECKING:
    from rail_fem.passes.beam_results import BeamResults
    from rail_fem.passes.track_beam import BeamMotion, TrackBeam
    from rail_fem.passes.wheelset_dynamics import WheelsetSystem

Contacts = Callable[[np.ndarray], ContactLaw]  # wheel positions x (m,) [m] -> the law there
March = Callable[..., "LightPass"]  # as run_pass

MOST_STEPS = 20_000_000
MOST_BEAM_VALUES = 2e8  # degrees of freedom times steps: 3 GB with positions and velocities


def _middles(at_ends: np.ndarray | None) -> np.ndarray:
    """(m, k) at the middles of the steps, from (m + 1, k) at their ends. Errors: ValueError without a beam."""
    if at_ends is None:
        raise ValueError("the crossing is a rigid mass in this pass: no beam moves")
    return (at_ends[1:] + at_ends[:-1]) / 2


@dataclass(frozen=True)
class LightPass:
    """A finished pass at the middles of its m steps: time (m,) [s], x (m,) [m], force (bodies, m) [N], and the motion
    itself, of a wheelset that of the wheel over the crossing.

    energies : columns (m,) of the whole, worked out when asked for;  columns : (m,) that only what moves here has
    """

    time: np.ndarray
    x: np.ndarray
    force: np.ndarray
    motion: PassMotion
    masses: Masses
    step: float
    energies: Callable[[], dict[str, np.ndarray]]
    beam: TrackBeam | None = None
    columns: Mapping[str, np.ndarray] = field(default_factory=dict)

    @property
    def position(self) -> np.ndarray:
        """(m, n) heights at the middles of the steps [m]."""
        return (self.motion.position[1:] + self.motion.position[:-1]) / 2

    @property
    def beam_position(self) -> np.ndarray:
        """(m, k) of the beam's degrees of freedom at the middles of the steps."""
        return _middles(self.motion.beam_position)

    @property
    def beam_velocity(self) -> np.ndarray:
        """(m, k) of the beam's degrees of freedom at the middles of the steps."""
        return _middles(self.motion.beam_velocity)

    def beam_at(self, step: int) -> BeamMotion | None:
        """The beam when a step begins; None on a rigid mass."""
        motion = self.motion
        if self.beam is None or motion.beam_position is None or motion.beam_velocity is None:
            return None
        from rail_fem.passes.track_beam import BeamMotion

        return BeamMotion(self.beam, motion.beam_position[step], motion.beam_velocity[step])

    @functools.cached_property
    def on_beam(self) -> BeamResults | None:
        """Moments and stresses of the beam; None on a rigid mass."""
        if self.beam is None:
            return None
        from rail_fem.passes.beam_results import beam_results

        return beam_results(self.beam, self.beam_position, self.force.sum(axis=0), self.x, self.time)

    @property
    def wheel_height(self) -> np.ndarray:
        """(m,) of the wheel's centre, which its own modes move too, at the middles of the steps [m]: of what the
        suspension holds."""
        held = -self.masses.stiffness[SPRUNG] / self.masses.stiffness[SPRUNG, SPRUNG]
        held[SPRUNG] = 0.0
        return self.position @ held

    @property
    def track_height(self) -> np.ndarray:
        """(m,) of the track mass, or of the beam under the wheel, at the middles of the steps [m]."""
        return self.position[:, TRACK] if self.beam is None else self.beam.heights(self.beam_position, self.x)

    @property
    def foundation_force(self) -> np.ndarray:
        """(m,) force of the track on its spring [N], damper left out: what the P2 formula calls P2. On bearers: of all
        of them on the ballast."""
        if self.beam is None:
            return -self.masses.stiffness[TRACK, TRACK] * self.position[:, TRACK]
        from rail_fem.passes.beam_results import ballast_force

        return ballast_force(self.beam, self.beam_position)


def scene_masses(scene: Scene) -> Masses:
    """Sprung mass, half a wheelset and track mass, on suspension and foundation, each under its weight.

    The suspension's spring is taken without its static length, so that the sprung mass is as high as the wheel when it
    carries nothing.
    """
    vehicle, foundation = scene.vehicle, scene.foundation
    mass = np.array([vehicle.wheel_sprung_mass, vehicle.wheel_unsprung_mass, foundation.track_mass])
    if scene.bearers is None and not (mass > 0).all():
        raise ValueError(
            f"scene.foundation.track_mass: {foundation.track_mass:g} kg, the light models need a mass under the"
            " contact: give more than 0 kg"
        )
    between = np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
    under = np.diag([0.0, 0.0, 1.0])
    load = np.array([-mass[0], -mass[1], 0.0]) * GRAVITY  # the track's own weight is in its position at rest
    masses = Masses(
        mass,
        vehicle.primary_stiffness * between + foundation.stiffness * under,
        vehicle.primary_damping * between + foundation.damping * under,
        load,
        np.array([0.0, 1.0, -1.0]),
    )
    return masses if scene.bearers is None else without_track(masses)


def without_track(masses: Masses) -> Masses:
    """The same without the track's mass, for a wheel on a beam."""
    keep = np.array([i for i in range(len(masses.mass)) if i != TRACK])
    cut = lambda values: np.ascontiguousarray(values[np.ix_(*[keep] * values.ndim)])
    return Masses(*map(cut, masses))


def run_pass(scene: Scene, settings: PassSettings, contacts: Contacts, step: float | None = None) -> LightPass:
    """March from static equilibrium over the window.

    Errors: ValueError for a step count beyond reason, FloatingPointError.
    """
    step, x = half_steps(scene, settings, step)
    law, beam, modes, masses = contacts(x), beam_of(scene, settings), None, scene_masses(scene)
    if scene.wheel_body is not None:
        from rail_fem.passes.wheel_modes import bent, modes_of, with_modes

        modes = modes_of(scene.wheel_body, scene, settings.wheel_modes)
        masses = with_modes(masses, scene.vehicle, modes, scene.wheel_body.damping_ratio)
    position, velocity = static_start(scene, masses, law, step)
    on_beam = None
    if beam is not None:
        speed = (x[1] - x[0]) / (step / 2)
        start = beam.under(scene.static_wheel_load, x[0], speed)
        on_beam = BeamStart(beam.band(step), start.position, start.velocity, x)
        position, velocity = position + start.height(x[0]), velocity + start.rise(x[0], speed)
    if modes is not None:
        position, velocity = bent(scene, modes, position), np.r_[velocity, np.zeros(len(modes.mass))]
    motion = integrate(masses, position, velocity, step, law, on_beam)
    height, laws = law.arrays
    distance = motion.position @ masses.coupling
    if beam is not None:
        distance = distance - beam.heights(motion.beam_position, x[::2])
    stored = lambda: contact_energies(distance, height[:, ::2] - motion.dent, laws[:, ::2])
    energies = lambda: energy_columns(masses, motion, stored(), beam)
    steps = motion.force.shape[1]
    # second contacts stand behind the bodies' first
    force = (
        motion.force if len(motion.force) <= len(BODIES) else motion.force.reshape(-1, len(BODIES), steps).sum(axis=0)
    )
    return LightPass((np.arange(steps) + 0.5) * step, x[1::2], force, motion, masses, step, energies, beam)


def beam_of(scene: Scene, settings: PassSettings) -> TrackBeam | None:
    """The beam that the wheel runs on, where the scene names bearers."""
    if scene.bearers is None:
        return None
    from rail_fem.passes.track_beam import track_beam

    low, high = sorted(settings.window(scene))
    beam = track_beam(scene.bearers, low, high, settings.beam_element, settings.beam_reach)
    values = len(beam.mass) * (high - low) / (scene.speed * settings.time_step)
    if values > MOST_BEAM_VALUES:
        raise ValueError(
            f"scene.bearers: {len(beam.mass)} degrees of freedom over this pass are {values:.2g} values, at most"
            f" {MOST_BEAM_VALUES:.2g} are kept: take a longer time_step or beam_element, or a shorter window"
        )
    return beam


def half_steps(scene: Scene, settings: PassSettings, step: float | None = None) -> tuple[float, np.ndarray]:
    """Time step [s], the settings' or `step` or a little less, and wheel positions x (2 m + 1,) [m] at ends and middles
    of m steps over the window.

    Errors: ValueError for a step count beyond reason.
    """
    start, end = settings.window(scene)
    duration = scene.travel_time(start, end)
    count = max(2, int(np.ceil(duration / (step or settings.time_step) - 1e-9)))
    if count > MOST_STEPS:
        raise ValueError(
            f"time_step: {settings.time_step:g} s makes {count:.3g} steps of a pass of {duration:.3g} s: take more than"
            f" {duration / MOST_STEPS:.1g} s"
        )
    return duration / count, np.linspace(start, end, 2 * count + 1)


def static_start(scene: Scene, masses: Masses, law: ContactLaw, step: float):
    """Heights and velocities (n,), (n,) of steady running along the path's first slope under the static load; without
    a track mass those over the beam."""
    load = scene.static_wheel_load
    distance = static_distance(load, law)
    track = -load / scene.foundation.stiffness if scene.bearers is None else 0.0
    wheel = distance + track
    sprung = wheel - masses.mass[0] * GRAVITY / scene.vehicle.primary_stiffness
    rate = (np.max(law.height[:, 1]) - np.max(law.height[:, 0])) / (step / 2)
    if scene.bearers is not None:
        return np.array([sprung, wheel]), np.array([rate, rate])
    return np.array([sprung, wheel, track]), np.array([rate, rate, 0.0])


def history_rows(run: LightPass, interval: float) -> slice:
    """Which steps become rows of the history."""
    return slice(0, None, max(1, int(round(interval / run.step))))


def common_history(run: LightPass) -> dict[str, np.ndarray]:
    """Columns (m,) of rail_fem.result.history that a light pass resolves whatever it touches; energies at the ends of
    the steps."""
    on_beam = {} if run.on_beam is None else {"bending_moment": run.on_beam.moment, "foot_stress": run.on_beam.stress}
    return {
        "time": run.time,
        "x": run.x,
        "force": run.force.sum(axis=0),
        "wheel_height": run.wheel_height,
        "crossing_height": run.track_height,
        **on_beam,
        **run.energies(),
        **run.columns,
    }


def energy_columns(
    system: Masses | WheelsetSystem, motion: PassMotion, contact: np.ndarray, beam: TrackBeam | None = None
) -> dict[str, np.ndarray]:
    """Energies (m,) [J] after each step. contact : (m + 1,) in the contacts at the ends of the steps [J]

    external : weight and the motion over the path;  friction : taken by creep forces, < 0: given;  balance : what the
    scheme loses, second order in the step.
    """
    q, v, summed = motion.position, motion.velocity, lambda work: np.r_[0.0, np.cumsum(work)]
    parts = {
        "kinetic": 0.5 * v**2 @ system.mass,
        "springs": 0.5 * np.einsum("mi,ij,mj->m", q, system.stiffness, q),
        "contact": contact,
        "damping": summed(motion.loss),
    }
    if beam is not None:
        parts["kinetic"] = parts["kinetic"] + beam.energy(beam.mass, motion.beam_velocity)
        parts["springs"] = parts["springs"] + beam.energy(beam.stiffness, motion.beam_position)
    if motion.friction is not None:
        parts["friction"] = summed(motion.friction)
    external = summed(motion.path_work) + (q - q[0]) @ system.load
    balance = sum(parts.values()) - external
    parts |= {"external": external, "balance": balance - balance[0]}
    return {f"energy_{name}": values[1:] for name, values in parts.items()}


def foundation_peak(run: LightPass) -> Peak:
    """Largest force on the foundation's spring."""
    forces = {"time": run.time, "x": run.x, "foundation": run.foundation_force}
    return peak_at(forces, "foundation", int(np.argmax(run.foundation_force)))


def step_error(fine: LightPass, coarse: LightPass) -> float:
    """Relative error of the force history from twice the step, second order: L2 of the difference over three of L2 of
    the fine one."""
    difference = np.interp(coarse.time, fine.time, fine.force.sum(axis=0)) - coarse.force.sum(axis=0)
    return float(np.linalg.norm(difference) / np.linalg.norm(coarse.force.sum(axis=0)) / 3)


def force_change(run: LightPass, other: LightPass) -> float:
    """Relative L2 change of the force history."""
    one, two = run.force.sum(axis=0), other.force.sum(axis=0)
    return float(np.linalg.norm(one - two) / np.linalg.norm(one))


def run_with_errors(
    scene: Scene, settings: PassSettings, contacts: Contacts, sparse: Contacts | None, march: March = run_pass
) -> tuple[LightPass, dict[str, float]]:
    """A pass, and by passes beside it its relative error: of the step by twice the step; the force's change over
    contacts searched at twice the spacing (sparse), on bearers by elements of twice the length, and by half more track
    on both sides."""
    run = march(scene, settings, contacts)
    errors = {"time_step": step_error(run, march(scene, settings, contacts, 2 * run.step))}
    if scene.bearers is not None:
        changes = {"beam_element": 2 * settings.beam_element, "beam_reach": 1.5 * settings.beam_reach}
        again = {name: settings.model_copy(update={name: value}) for name, value in changes.items()}
        errors |= {name: force_change(run, march(scene, changed, contacts)) for name, changed in again.items()}
    if sparse is not None:
        errors["path_spacing"] = force_change(run, march(scene, settings, sparse))
    return run, errors
