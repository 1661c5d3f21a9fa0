"""Where the wheelset of a diverging route stands when a pass begins, and what holds it there: for the explicit model,
which meshes one of its wheels."""

from typing import NamedTuple

import numpy as np

from geometry.surfaces.crossing import CrossingError
from rail_fem.contact.contact_table import contact_table
from rail_fem.passes.plastic_indentation import contacts_of
from rail_fem.passes.vertical_pass import half_steps
from rail_fem.passes.wheelset_dynamics import (
    LATERAL,
    YAW,
    WheelsetContacts,
    WheelsetSystem,
    for_kernels,
    static_forces,
    surface,
)
from rail_fem.passes.wheelset_pass import (
    LATERAL_SPACING,
    Surfaces,
    centred,
    refuse_flange_on_nose,
    start_of,
    surfaces_of,
    wheelset_contacts,
    wheelset_system,
)
from rail_fem.scene.scene import Scene
from rail_fem.settings.explicit import FeSettings
from rail_fem.settings.light import RigidHertzSettings

WIDEST = 12e-3  # of the lateral positions that are looked at [m]
BEYOND_CHECK = 2e-3  # of them behind the check rail's face [m]
SPACING = 6e-3  # of positions along the track that are looked at [m]
LENGTH = 2 * SPACING  # of track that is looked at from the start on [m]
NOSE_SPACING = 10e-3  # between positions where the flange may strike the nose [m]


class LateralStart(NamedTuple):
    """The wheelset at the start of a pass. Towards +y positive.

    across : lateral position at rail level [m];  heading : angle of attack [rad];  force : of the vehicle across it [N]
    clearance, check_stiffness : of the check rail [m], [N/m];  other_force : normal force of the other wheel [N]
    other_push : of its inclined contact on the wheelset [N];  creep : longitudinal and lateral creep coefficient of the
        other wheel under its force [N];  creep_along : its longitudinal creep
    """

    across: float
    heading: float
    force: float
    clearance: float
    check_stiffness: float
    other_force: float
    other_push: float
    creep: tuple[float, float]
    creep_along: float


def lateral_start(scene: Scene, start: float, end: float) -> LateralStart:
    """At the beginning of a pass from `start` to `end` [m] of a scene with a diverging route.

    Errors: ValueError where the wheelset finds no equilibrium, derails, overturns, or strikes the nose with its flange;
    CrossingError.
    """
    surfaces, system, contacts, position = _standing(scene, _settings(scene, start, end))
    across = float(system.across(position))
    along_pass = contact_table(centred(scene), start, end, NOSE_SPACING, across)
    one = Surfaces(np.array([across]), (along_pass,), surfaces.plain[:1], surfaces.level[:1])
    refuse_flange_on_nose(scene, system, one, position[None])
    return _start_at(system, contacts, position, across)


def start_errors(scene: Scene, settings: FeSettings | RigidHertzSettings) -> list[str]:
    """Why the wheelset of a diverging route cannot begin the pass of these settings, with start and end."""
    try:
        if isinstance(settings, FeSettings):
            lateral_start(scene, *scene.in_order_of_travel(settings.start, settings.end))
        else:
            start, end = settings.window(scene)
            first = {"start": start, "end": _first_stretch(start, end), "path_spacing": SPACING}
            _standing(scene, settings.model_copy(update=first))
    except (CrossingError, ValueError, FloatingPointError) as error:
        return [str(error)]
    return []


def _standing(
    scene: Scene, settings: RigidHertzSettings
) -> tuple[Surfaces, WheelsetSystem, WheelsetContacts, np.ndarray]:
    """Position (8,) of the wheelset where the settings' pass begins, and what it stands on. Errors: ValueError."""
    surfaces = surfaces_of(scene, settings)
    law = contacts_of(scene, settings, surfaces.over[len(surfaces.over) // 2])
    step, x = half_steps(scene, settings, None)
    contacts, system = wheelset_contacts(scene, law(x), surfaces, x), wheelset_system(scene, settings)
    position, _ = start_of(scene, system, contacts, step)
    refuse_flange_on_nose(scene, system, surfaces, position[None])
    return surfaces, system, contacts, position


def _first_stretch(start: float, end: float) -> float:
    return start + float(np.copysign(LENGTH, end - start))


def _settings(scene: Scene, start: float, end: float) -> RigidHertzSettings:
    """Of the search: as far across as the check rail lets the wheelset, or the given position lies."""
    route = scene.diverging
    if route is None:
        raise ValueError("the scene has no diverging route")
    clearance = min(abs(route.clearance(scene.gauge, scene.back_to_back)), WIDEST)
    reach = min(max(abs(route.lateral or 0.0) + LATERAL_SPACING, clearance + BEYOND_CHECK), WIDEST)
    return RigidHertzSettings(
        start=start,
        end=_first_stretch(start, end),
        path_spacing=SPACING,
        degrees_of_freedom="lateral_roll",
        lateral_range=reach,
    )


def _start_at(system: WheelsetSystem, contacts: WheelsetContacts, position: np.ndarray, across: float) -> LateralStart:
    """What holds the wheelset at a position (8,); the other wheel's contact is the last one."""
    force = static_forces(for_kernels(system), for_kernels(contacts), position).contact
    u = contacts.side * across
    radius = np.array([np.interp(u[c], contacts.shift, contacts.radius[c, 0]) for c in range(len(u))])
    mean, middle = force @ radius / force.sum(), force @ contacts.contact_y[:, 0] / force.sum()
    _, inclination, _ = surface(u[-1], contacts.shift, contacts.height[-1, 0].copy(), contacts.slope[-1, 0].copy())
    grown = (force[-1] / contacts.reference) ** (2 / 3)
    lever = contacts.contact_y[-1, 0] - middle
    return LateralStart(
        across,
        float(position[YAW]),
        float(system.load[LATERAL]),
        *system.stop,
        float(force[-1]),
        float(-contacts.side[-1] * force[-1] * inclination),
        (float(contacts.creep[-1, 0, 0] * grown), float(contacts.creep[-1, 0, 1] * grown)),
        float(-(radius[-1] - mean) / system.rolling_radius + system.curvature * lever),
    )
