"""Creepages of a plane patch belong to its centre of pressure: kinematics, and half-space rolling on the true gaps."""

import numpy as np
import pytest

import rail_fem
from bem.halfspace.fastsim import elliptic_patch
from bem.halfspace.normal import normal_contact
from bem.halfspace.tangential import rolling_contact
from bem.material import STEEL
from bem.patch import Creepage
from rail_fem.contact.contact_table import contact_table, patch_sizes, surface_gap
from rail_fem.damage.crossing import PatchOptions, table_contacts
from rail_fem.damage.strips import plane_creepages, point_creepages

CASE = "damage/crossing_transfer"
WING = 0
WINDOW = (-14e-3, 14e-3), (-18e-3, 18e-3)


@pytest.fixture(scope="module")
def scene():
    return rail_fem.load_case(CASE).scene


@pytest.fixture(scope="module")
def table(scene):
    """Along the wing before the transfer, where contact points lie 1.6 to 2.3 mm beside the intersections' middles."""
    return contact_table(scene, 0.25, 0.33, 20e-3)


def test_every_strip_of_a_plane_patch_slips_as_the_wheel_does_at_its_position(scene, table):
    """Longitudinal creepage - spin y is the wheel's velocity at y from the patch's position in the plan: to 1e-9."""
    forces = np.full((2, len(table.x)), 60e3)
    contacts = table_contacts(scene, table, forces, PatchOptions(cells=12))
    own = contacts.body == WING
    carries = np.flatnonzero(table.stiffness[WING] > 0)[:: int(scene.direction_sign)]
    y, angle = contacts.patches.grid.y[own], contacts.angle[own]
    longitudinal, lateral, spin = contacts.patches.creepage[own].T
    assert np.abs(contacts.position[own] - table.point[WING, carries]).max() > 0.5e-3
    for k in (0, 5, 11):
        aside = np.stack([0 * angle, np.cos(angle), np.sin(angle)], axis=1) * y[:, k, None]
        wheel = point_creepages(scene, table, WING, carries, contacts.position[own] + aside, angle)
        np.testing.assert_allclose(longitudinal - spin * y[:, k], wheel[:, 0], atol=1e-9)
        np.testing.assert_allclose(spin, wheel[:, 2], rtol=1e-12)


def test_work_on_the_ellipses_of_the_wing_is_that_on_the_true_gaps(scene, table):
    """Half-spaces under 80 kN: what the wheel puts into lopsided patches by the plane's exact slip, and into the
    ellipses that are put for them. About the centre of pressure they take 2 to 4 % too much, at 22 as at 88 cells each
    way; about the contact point 5 to 16 % are missing."""
    load, every = 80e3, np.array([0, 4])
    at_point = point_creepages(scene, table, WING, every, table.point[WING, every], table.angle[WING, every])
    at_centre = plane_creepages(scene, table, WING, every)
    sizes = patch_sizes(np.full(len(every), load), table.radii[WING, every], table.modulus[WING])
    put = lambda pressed, own: work_put_in(rolled(scene, pressed, own))
    for k, size, centre, point in zip(every, sizes, at_centre, at_point, strict=True):
        pressed = normal_contact(
            gap_about(scene, table, k), STEEL, STEEL, load=load, window=WINDOW, cells=22, estimate=False
        )
        ellipse, truth = elliptic_patch(*map(float, size), load, (22, 22)), put(pressed, point)
        assert 0.01 < put(ellipse, centre) / truth - 1 < 0.045
        assert put(ellipse, point) / truth - 1 < -0.045
        across = pressed.pressure.sum(axis=0)
        middle = (across * pressed.grid.y).sum() / across.sum()
        assert 0.5e-3 < middle < table.centre[WING, k] < middle + 0.45e-3


def rolled(scene, patch, creepage):
    """Half-spaces on a patch about its origin."""
    own, direction = Creepage(*map(float, creepage)), int(scene.direction_sign)
    return rolling_contact(patch, STEEL, STEEL, scene.friction, own, direction=direction, estimate=False)


def work_put_in(patch):
    """Of the rigid slip against the tractions per metre rolled [N]."""
    slip = patch.creepage.rigid_slip(*patch.grid.points())
    return -(np.moveaxis(patch.traction, -1, 0) * slip).sum() * patch.grid.cell_area


def gap_about(scene, table, k):
    """Gap (x, y) [m] of the wheel at the table's position k above the wing, in the tangent plane at the contact."""
    x, point, cosine = table.x[k], table.point[WING, k], np.cos(table.angle[WING, k])
    gap = lambda at_x, at_y: surface_gap(
        scene.crossing.surface, scene.wheel.shape, WING, x, at_x, at_y, scene.wheel.radius, table.datum
    )
    return lambda u, v: (gap(point[0] + u, point[1] + v * cosine) - gap(*point[:2])) * cosine
