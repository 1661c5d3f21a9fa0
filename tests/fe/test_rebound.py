"""Blocks thrown at a rigid wall: they never come back with more than they brought."""

import dataclasses

import numpy as np
import pytest

from geometry.meshing.blocks import mesh_box
from geometry.meshing.hexmesh import merge_bodies
from rail_fem.fe.contact.contact import Contact
from rail_fem.fe.contact.search import ContactSettings
from rail_fem.fe.contact.surface import ContactSurfaces, Surface
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.supports import RigidGroup, Supports
from tests.fe.bodies import STEEL, bottom, momentum, plastic, structure_of

SIDE = 4e-3
TRANSIT = SIDE / STEEL.wave_speed
STEELS = {"elastic": STEEL, "plastic": plastic(STEEL, 300e6, 2e9)}


def throw(steel, speed, slide=0.0, penalty=10.0, friction=0.0, gap=1e-6, tilt=0.0):
    """A cube thrown down onto a rigid plate whose nodes do not match its own, `gap` [m] above it; the run before its
    first step."""
    plate = mesh_box((3 * SIDE, 3 * SIDE, 1e-3), (9, 9, 1), name="plate")
    plate = dataclasses.replace(plate, points=plate.points - [SIDE + 0.37e-3, SIDE - 0.21e-3, 1e-3])
    cube = mesh_box((SIDE, SIDE, SIDE), (4, 4, 4), name="cube")
    sole = bottom(cube)
    c, s = np.cos(tilt), np.sin(tilt)
    points = cube.points @ np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    cube = dataclasses.replace(
        cube,
        points=points + [0.0, 0.0, gap - points[:, 2].min()],
        surface=sole,
        surface_region=np.zeros(len(sole), np.int8),
    )
    mesh = merge_bodies([plate, cube])
    structure = structure_of(mesh, STEEL, steel)
    node = structure.domain.node_input
    held = np.repeat((node < len(plate.points))[:, None], 3, axis=1)
    structure.v.reshape(-1, 3)[~held[:, 0]] = slide, 0.0, -speed
    surfaces = [Surface.from_quads(mesh.surface[mesh.surface_region == body]) for body in (0, 1)]
    stiffness = penalty * STEEL.density * STEEL.wave_speed**2 / 1e-3
    contact = Contact(ContactSurfaces(structure, *surfaces, held), ContactSettings(stiffness, friction))
    return Dynamics(structure, Supports([RigidGroup("plate", np.arange(len(plate.points)))]), contact)


def fly(dynamics, duration):
    """Step for `duration` [s]; the largest force on the way [N]."""
    dt, largest = dynamics.stable_step(), 0.0
    end = dynamics.time + duration
    while dynamics.time < end:
        dynamics.step(dt)
        largest = max(largest, -dynamics.contact.force_on_rail()[2])
    dynamics.check()
    return largest


@pytest.mark.parametrize("kind", STEELS)
@pytest.mark.parametrize("penalty", [0.1, 10.0, 1e4])
@pytest.mark.parametrize("speed", [0.1, 10.0, 100.0])
def test_a_block_never_rebounds_faster_than_it_came(kind, penalty, speed):
    """Free flight, impact and 30 wave transits after it: the speed of the centre and all kinetic energy stay below
    those of the impact.

    The step is the bodies' own, also with a contact a thousand times stiffer than they: the pressure is implicit in the
    gap.
    """
    dynamics = throw(STEELS[kind], speed, penalty=penalty)
    structure, before = dynamics.structure, dynamics.structure.kinetic_energy()
    force = fly(dynamics, 1e-6 / speed + 30 * SIDE / STEEL.wave_speed)
    assert force > 0
    mass = before / (0.5 * speed**2)
    rebound = momentum(structure)[0][2] / mass
    assert 0 < rebound <= speed
    assert structure.kinetic_energy() <= before
    assert not dynamics.contact.force.any()


@pytest.mark.parametrize(
    "tilt, slide, friction", [(0.0, 20.0, 0.3), (0.2, 0.0, 0.0), (0.2, 20.0, 0.3), (-0.2, 20.0, 1.0)]
)
def test_tilted_and_sliding_blocks_gain_no_energy(tilt, slide, friction):
    """Flat and edge first, with and without friction. Friction acts on the plate's nodes, so an edge between them
    slides freely."""
    dynamics = throw(STEELS["elastic"], 10.0, slide=slide, friction=friction, tilt=tilt)
    before = dynamics.energies()
    fly(dynamics, 40e-6)
    after = dynamics.energies()
    assert after["kinetic"] + after["elastic"] <= before["kinetic"] * (1 + 1e-3)
    assert after["friction"] >= 0.0
    assert after["friction"] > 0.0 or tilt != 0.0


def throw_on_a_post(speed, slide, friction, penalty=1e3):
    """A cube of one element without lateral contraction thrown onto a rigid post within its sole: all nodes of the post
    are under it, at all times."""
    post = mesh_box((SIDE / 2, SIDE / 2, 1e-3), (1, 1, 1), name="post")
    post = dataclasses.replace(post, points=post.points - [SIDE / 4, SIDE / 4, 1e-3])
    cube = mesh_box((SIDE, SIDE, SIDE), (1, 1, 1), name="cube")
    sole = bottom(cube)
    cube = dataclasses.replace(
        cube, points=cube.points - [SIDE / 2, SIDE / 2, -1e-6], surface=sole, surface_region=np.zeros(1, np.int8)
    )
    mesh = merge_bodies([post, cube])
    structure = structure_of(mesh, STEEL, dataclasses.replace(STEEL, poisson=0.0))
    held = np.repeat((structure.domain.node_input < len(post.points))[:, None], 3, axis=1)
    structure.v.reshape(-1, 3)[~held[:, 0]] = slide, 0.0, -speed
    top = mesh.surface[mesh.surface_region == 0]
    top = top[(mesh.points[top][:, :, 2] > -1e-9).all(axis=1)]
    surfaces = Surface.from_quads(top), Surface.from_quads(mesh.surface[mesh.surface_region == 1])
    settings = ContactSettings(penalty * STEEL.density * STEEL.wave_speed**2 / SIDE, friction)
    contact = Contact(ContactSurfaces(structure, *surfaces, held), settings)
    return Dynamics(structure, Supports([RigidGroup("post", np.arange(len(post.points)))]), contact)


def test_friction_that_holds_does_no_work():
    """The sole stops at once and stays: of what the cube brings along, friction loses only a share that goes with its
    spring, 1/1000 as soft as the cube."""
    dynamics = throw_on_a_post(speed=1.0, slide=0.2, friction=5.0)
    along = 0.5 * momentum(dynamics.structure)[0][0] * 0.2
    fly(dynamics, 1e-6 + TRANSIT)
    assert dynamics.contact.force.any() and dynamics.contact.sliding.sticking.all()
    assert 0 <= dynamics.contact.friction_work < 0.05 * along


def test_a_sliding_block_is_braked_by_friction_times_the_load_and_loses_that_times_its_way():
    """At any time: impulse along = 0.3 of the impulse up, energy = that impulse times 20 m/s, less what friction brakes
    the sole."""
    dynamics = throw_on_a_post(speed=1.0, slide=20.0, friction=0.3)
    before = momentum(dynamics.structure)[0]
    fly(dynamics, 1e-6 + 3 * TRANSIT)
    change = momentum(dynamics.structure)[0] - before
    assert change[2] > 0
    assert change[0] == pytest.approx(-0.3 * change[2], rel=1e-3)
    assert dynamics.contact.friction_work == pytest.approx(-change[0] * 20.0, rel=0.05)


def test_contact_keeps_the_momentum_of_two_free_bodies():
    """A cube strikes a free plate: the forces on both are equal and opposite."""
    dynamics = throw(STEELS["plastic"], 50.0, slide=10.0, friction=0.3)
    structure = dynamics.structure
    contact = Contact(ContactSurfaces(structure, *dynamics.contact.surfaces.each()), dynamics.contact.settings)
    free = Dynamics(structure, contact=contact)
    before = momentum(structure)[0]
    fly(free, 5e-6)
    assert np.abs(momentum(structure)[0] - before).max() < 1e-12 * np.abs(before).max()
    assert np.abs(structure.v.reshape(-1, 3)[structure.domain.node_input < 200]).max() > 1.0
