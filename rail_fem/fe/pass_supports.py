"""What holds and loads the bodies of a pass: foundation, suspension, settling damper, guidance across the track, and
the lumped masses that make each body as heavy as the case says."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bem.exact.hertz import tangent_stiffness
from rail_fem.contact.contact_table import contact_table
from rail_fem.fe.lateral_guide import LateralGuide
from rail_fem.fe.running import Running
from rail_fem.fe.start_state import StartState
from rail_fem.fe.supports import Link, RigidGroup, Supports
from rail_fem.passes.lateral_start import LateralStart
from rail_fem.passes.plastic_indentation import plastic_indentation
from rail_fem.scene.scene import GRAVITY, Scene
from rail_fem.settings.explicit import FeSettings

# lumped mass on the wheel while it settles [kg]: little inertia, so it comes to rest within a millisecond
SETTLING_MASS = 10.0
MESH_MASS = 10.0  # about that of the wheel's mesh, which settles with it [kg]
NEXT_POSITION = 2.5e-3  # where the contact at the start is looked at once more [m]


class Supported(NamedTuple):
    """Rigid group of the sprung mass (None without suspension), all supports, the damper that is on while the wheel
    settles (None: it does not), what holds the wheelset across the track (None: its lateral position is given)."""

    sprung: RigidGroup | None
    supports: Supports
    settling: Link | None
    guide: LateralGuide | None


def build_supports(
    scene: Scene,
    settings: FeSettings,
    running: Running,
    start: StartState,
    aside: LateralStart | None,
    crossing: RigidGroup,
    axle: RigidGroup,
    factor: float = 1.0,
) -> Supported:
    """Crossing on its foundation, or at rest in the frame of a beam; axle with half a wheelset, sprung mass on the
    primary suspension; springs as the start wants them, each body as heavy as the case says.

    aside : the wheelset across the track, where it may move;  crossing, axle : groups that know the masses of their
        meshes, freed and loaded here;  factor : of mass scaling on the wheel's mesh

    While it settles the axle is pressed down so that the contact comes to carry the start's force. Vertical only: the
    lateral position and the speed of the wheel are given (thesis assumption 1).

    Errors: ValueError where a mesh is heavier than its body.
    """
    vertical = (False, False, True)
    crossing.free, axle.load[2] = vertical, -start.force
    groups, links, sprung = [crossing, axle], [], None
    if settings.suspension:
        mass = scene.vehicle.wheel_sprung_mass
        sprung = RigidGroup("sprung", np.empty(0, np.int64), mass, vertical, load=np.array([0.0, 0.0, -mass * GRAVITY]))
        groups.append(sprung)
        k = scene.vehicle.primary_stiffness
        links.append(
            Link("suspension", sprung, axle, k, scene.vehicle.primary_damping, natural_length=start.suspension)
        )
        axle.load[2] += k * start.suspension
    if settings.foundation and not settings.stands_on_beam(scene):
        k = scene.foundation.stiffness
        links.append(Link("foundation", crossing, None, k, scene.foundation.damping, natural_length=start.foundation))
    else:
        crossing.free = (False, False, False)
    settling = None
    if settings.settle_time > 0:
        rate = running.speed * float(running.slope(running.start))
        settling = Link(
            "settling",
            axle,
            None,
            0.0,
            2 * np.sqrt(loaded_stiffness(scene, running) * (SETTLING_MASS + factor * MESH_MASS)),
            rate=rate,
        )
        links.append(settling)
    set_lumped_masses(scene, settings, crossing, axle, settled=settling is None)
    guide = None if aside is None else guide_across(scene, aside, axle)
    axle.free = (False, guide is not None and settling is None, True)
    return Supported(sprung, Supports(groups, links, [guide] if guide else []), settling, guide)


def guide_across(scene: Scene, aside: LateralStart, axle: RigidGroup) -> LateralGuide:
    """The force of the vehicle and of the other wheel's inclined contact on the axle, the other half of the wheelset's
    mass, check rail and creep of the other wheel."""
    axle.load[1] = aside.force + aside.other_push
    axle.lateral_mass = scene.vehicle.wheel_unsprung_mass
    return LateralGuide(axle, aside, scene.speed, scene.friction)


def loaded_stiffness(scene: Scene, running: Running) -> float:
    """Of the wheel on the body below it at the start, under the static load [N/m]: Hertz' contact in series with the
    plastic indentation under it.

    For the settling damper, which this makes critical: a narrow nose that yields is four times softer than the wing.
    """
    load, materials = scene.static_wheel_load, scene.materials
    table = contact_table(scene, running.start, running.start + running.sign * NEXT_POSITION, NEXT_POSITION)
    body, here = table.carrier(running.start)
    yield_load, plastic_compliance = (
        values[body, here]
        for values in plastic_indentation(table, (materials.wing.steel(), materials.nose.steel()), load)
    )
    elastic = tangent_stiffness(table.stiffness[body, here], load)
    return float(1 / (1 / elastic + (plastic_compliance if load > yield_load else 0.0)))


def set_lumped_masses(
    scene: Scene, settings: FeSettings, crossing: RigidGroup, axle: RigidGroup, settled: bool
) -> None:
    """Masses that make each body, its mesh included, as heavy as the case says; while it settles the wheel carries
    SETTLING_MASS instead.

    Errors: ValueError where a mesh is heavier than its body: the case's mass is of a shorter piece of track, or of a
    lighter wheel.
    """
    axle.add_mass_up_to(scene.vehicle.wheel_unsprung_mass, "give a larger wheelset_unsprung_mass")
    if settings.track_mass and settings.foundation and not settings.stands_on_beam(scene):
        crossing.add_mass_up_to(
            scene.foundation.track_mass,
            "give a larger track_mass, a shorter window, or track_mass = false in the run for the mesh alone",
        )
    if not settled:
        axle.added_mass = SETTLING_MASS
        crossing.free = (False, False, False)
