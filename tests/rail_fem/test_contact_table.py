"""What a contact table interpolates is the exact value to the error that it claims."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from geometry.axes import tread_datum_y
from geometry.path.wheel_path import wheel_path
from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.crossing import CastCrossing
from rail_fem.contact.contact_table import surface_gap
from rail_fem.contact.intersection import FAR, equivalent_paraboloid, gaps_about


def test_the_centre_of_pressure_lies_where_there_is_metal():
    """Two shoulders of a groove: that of the shoulder at the contact point, its strips loaded as they lie below the
    plane; two radii: 3/8 of the difference of the half-widths, where the middle is 1/2. The gap is linear between
    samples 0.1 mm apart."""
    across, along = np.linspace(-4e-3, 4e-3, 81), np.linspace(-4e-3, 4e-3, 41)
    bowl = across**2 / (2 * 0.1) + along[:, None] ** 2 / (2 * 0.4)
    whole = bowl + np.where(across > 0, 0.5, 0.0) * across**2 / 0.1
    depth = np.array([2e-5, 2e-5, 2e-5])
    groove = np.where(np.abs(across - 1e-3) < 0.65e-3, 1e-3, bowl)
    gap = np.stack([groove, whole, bowl])
    _, centre, _ = equivalent_paraboloid(gap, gap.min(axis=2), gap.min(axis=1), along, across, depth)
    left, right = -np.sqrt(2 * 0.1 * 2e-5), np.sqrt(0.1 * 2e-5)
    piece = Polynomial([1, 0, -1 / left**2])
    up_to = lambda own, end: own.integ()(end) - own.integ()(left)
    shoulder = up_to(piece * Polynomial([0, 1]), 0.3e-3) / up_to(piece, 0.3e-3)
    assert centre[0] == pytest.approx(shoulder, abs=3e-6)
    assert centre[1] == pytest.approx(3 / 8 * (right + left), abs=3e-6)
    assert abs(centre[2]) < 1e-12


@pytest.mark.parametrize("body", [0, 1])
def test_the_gaps_about_a_contact_are_those_of_its_positions(body):
    """Along the normal, over that at the contact itself; no more than FAR beside wheel and rail. To round-off of their
    heights, some 1e-2 m."""
    crossing, wheel, x = CastCrossing(), wheel_profile("P8"), np.array([0.30, 0.32])
    path = wheel_path(wheel, crossing, x)
    at, datum, cosine = (path.wing_point, path.nose_point)[body], tread_datum_y(), np.array([1.0, 0.9])
    along, across = np.linspace(-12e-3, 12e-3, 5), np.linspace(-60e-3, 60e-3, 9)
    surfaces = wheel.hermite_table(), body == 1, *crossing.tables
    found = gaps_about(x, at, along, across, cosine, path.radius, datum, *surfaces)
    at_x, at_y = at[:, 0, None, None] + along[:, None], at[:, 1, None, None] + across * cosine[:, None, None]
    gap = surface_gap(crossing, wheel, body, x[:, None, None], at_x, at_y, path.radius, datum)
    over = np.minimum((gap - gap[:, 2:3, 4:5]) * cosine[:, None, None], FAR)
    assert (over == FAR).any() and (over < FAR).any()
    assert found == pytest.approx(over, abs=1e-16)
