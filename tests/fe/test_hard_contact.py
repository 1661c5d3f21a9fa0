"""Contact from hard starts: a gap, exact initial contact, overlaps, several patches, bodies that come from far."""

import dataclasses

import numpy as np
import pytest
from scipy.optimize import brentq

from bem.exact.hertz import point_contact
from bem.material import STEEL as ELASTIC
from bem.material import contact_modulus
from geometry.meshing.blocks import mesh_cap
from geometry.meshing.hexmesh import merge_bodies
from rail_fem.fe.contact.contact import Contact
from rail_fem.fe.contact.search import ContactSettings
from rail_fem.fe.contact.surface import ContactSurfaces, Surface
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.supports import RigidGroup, Supports
from rail_fem.studies.impact import settle
from tests.fe.bodies import STEEL, momentum, structure_of
from tests.fe.test_rebound import SIDE, STEELS, fly, throw

TRANSITS = SIDE / STEEL.wave_speed
RADIUS, LOAD = 0.05, 5e3
EXACT = point_contact(LOAD, RADIUS, RADIUS, contact_modulus(ELASTIC, ELASTIC))


def test_a_gap_of_a_micrometre_closes_in_its_time():
    """No force before gap / speed, force within two steps after it."""
    dynamics, gap, speed = throw(STEELS["elastic"], 1.0, gap=1e-6), 1e-6, 1.0
    dt = dynamics.stable_step()
    while not dynamics.contact.force.any():
        dynamics.step(dt)
    assert gap / speed - dt <= dynamics.time <= gap / speed + 2 * dt


def test_exact_touch_at_rest_stays_without_force():
    dynamics = throw(STEELS["elastic"], 0.0, gap=0.0)
    # round-off of the surfaces' positions, eps times 12 mm, times the penalty stiffness on 16 mm2
    bound = 1e-15 * 12e-3 * dynamics.contact.settings.stiffness * SIDE**2
    assert fly(dynamics, 20 * TRANSITS) <= 10 * bound
    assert np.abs(dynamics.structure.v).max() < 1e-6


def test_an_overlap_of_a_micrometre_is_pushed_out_gently():
    """What happens: the bodies part with at most the overlap's penalty energy; nothing yields, nothing is shifted
    silently."""
    dynamics = throw(STEELS["elastic"], 0.0, gap=-1e-6)
    stored = 0.5 * dynamics.contact.settings.stiffness * (1e-6) ** 2 * SIDE**2
    fly(dynamics, 30 * TRANSITS)
    assert not dynamics.contact.force.any()
    energies = dynamics.energies()
    assert 0 < energies["kinetic"] + energies["elastic"] <= stored
    assert momentum(dynamics.structure)[0][2] > 0


def test_an_overlap_of_a_hundredth_millimetre_throws_the_bodies_apart_without_harm():
    """What happens: they part with no more than the overlap's penalty energy, 0.2 J here: a start that the user must
    see to."""
    dynamics = throw(STEELS["plastic"], 0.0, gap=-1e-5)
    stored = 0.5 * dynamics.contact.settings.stiffness * 1e-5**2 * SIDE**2
    fly(dynamics, 30 * TRANSITS)
    energies = dynamics.energies()
    assert 0 < energies["kinetic"] + energies["elastic"] + energies["plastic"] <= stored


def test_a_quarter_millimetre_of_overlap_stops_the_run_with_its_place():
    """What happens: the penalty turns cells inside out, and the check names them."""
    with pytest.raises(ArithmeticError, match=r"turned inside out, the first is element \d+ at \("):
        fly(throw(STEELS["plastic"], 0.0, gap=-0.25e-3), 5 * TRANSITS)


@pytest.mark.parametrize("overlap", [1.01e-3, 1.2e-3, 3e-3])
def test_a_millimetre_of_overlap_is_refused_with_its_depth_and_place(overlap):
    dynamics = throw(STEELS["plastic"], 0.0, gap=-overlap)
    with pytest.raises(ValueError, match=rf"starts inside the rail: .* the worst by {overlap * 1e3:.3f} mm at \("):
        dynamics.step(dynamics.stable_step())


def two_caps(step):
    """Forces [N] of two equal caps under one loaded plate, at rest on a block, and the plate's descent [m]; the second
    starts `step` [m] higher."""
    block = mesh_cap(np.inf, np.inf, (20e-3, 8e-3), 10e-3, 0.6e-3, (8.4e-3, 1.2e-3, 1.2e-3), facing="up", name="block")
    cap = mesh_cap(RADIUS, RADIUS, (4e-3, 4e-3), 6e-3, 0.6e-3, (1.2e-3, 1.2e-3, 1.2e-3), facing="down")
    caps = [
        dataclasses.replace(cap, points=cap.points + [x, 0.0, z], region_names=(name,))
        for name, x, z in (("left", -7.2e-3, 0.0), ("right", 7.2e-3, step))
    ]
    mesh = merge_bodies([block, *caps])
    structure = structure_of(mesh, *[STEEL] * 3, small=(0, 1, 2))
    split = len(block.clamp)
    plate = RigidGroup("plate", mesh.clamp[split:], free=(False, False, True), load=np.array([0.0, 0.0, -2 * LOAD]))
    rail, wheel = (
        Surface.from_quads(mesh.surface[mesh.surface_region == 0]),
        Surface.from_quads(mesh.surface[mesh.surface_region > 0]),
    )
    settings = ContactSettings(10 * STEEL.density * STEEL.wave_speed**2 / 0.6e-3)
    contact = Contact(ContactSurfaces(structure, rail, wheel), settings)
    frequency = np.sqrt(3 * LOAD / EXACT.approach / structure.mass.sum())
    dynamics = Dynamics(
        structure, Supports([RigidGroup("base", mesh.clamp[:split]), plate]), contact, mass_damping=1.4 * frequency
    )
    settle(dynamics, 2 * LOAD, 100 * LOAD * EXACT.approach, 5e-3)
    x, force = contact.surfaces.reference[: contact.surfaces.n_rail, 0], -contact.force[: contact.surfaces.n_rail, 2]
    return np.array([force[x < 0].sum(), force[x > 0].sum()]), -plate.displacement[2]


def test_two_patches_share_the_load_as_their_approaches_say():
    """Equal heights: equal halves. One 5 um higher: approaches (F / K)^(2/3) + C F that differ by 5 um, K of Hertz, and
    C, what the finite bodies lack or add, from the equal pair."""
    equal, descent = two_caps(0.0)
    assert equal == pytest.approx([LOAD, LOAD], rel=2e-4)
    step, compliance = 5e-6, (descent - EXACT.approach) / LOAD

    def approach(force):
        return EXACT.approach * (force / LOAD) ** (2 / 3) + compliance * force

    unequal, _ = two_caps(step)
    lower = brentq(lambda force: approach(force) - approach(2 * LOAD - force) - step, LOAD, 1.9 * LOAD)
    assert unequal.sum() == pytest.approx(2 * LOAD, rel=2e-4)
    # with 4 elements across a patch its tangent stiffness jumps by a quarter from node to node
    assert unequal[0] - unequal[1] == pytest.approx(2 * lower - 2 * LOAD, rel=0.25)
