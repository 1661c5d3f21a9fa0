"""Hertz contact against published figures, limits and independent numerical solutions."""

import numpy as np
import pytest
from scipy.integrate import quad

from bem.exact.hertz import (
    HertzError,
    contact_stiffness,
    line_contact,
    line_contact_of_width,
    point_contact,
    point_contact_of_approach,
)
from bem.material import STEEL, Elastic, MaterialError, contact_modulus
from tests.bem.closed_forms import line_compression, sphere_impact

E_STAR = contact_modulus(STEEL, STEEL)


def test_line_contact_of_one_millimetre_half_width():
    """VERIFICATION D: 178.896 N/mm and 113.889 MPa; the digits given are the tolerance."""
    steel = Elastic.from_shear(82e9, 0.28)
    contact = line_contact_of_width(1e-3, 0.5, contact_modulus(steel, steel))
    assert contact.force == pytest.approx(178.896e3, abs=0.5)
    assert contact.max_pressure == pytest.approx(113.889e6, abs=500)
    assert quad(contact.pressure, -1e-3, 1e-3)[0] == pytest.approx(contact.force, rel=1e-7)


def test_ellipse_of_wheel_on_rail():
    """VERIFICATION D: a 7.1617, b 5.3872 mm, p0 1237.56 MPa."""
    contact = point_contact(100e3, 0.460, 0.300, E_STAR)
    assert contact.semi_x == pytest.approx(7.1617e-3, abs=5e-8)
    assert contact.semi_y == pytest.approx(5.3872e-3, abs=5e-8)
    assert contact.max_pressure == pytest.approx(1237.56e6, abs=5e3)
    assert 2 / 3 * contact.max_pressure * contact.area == pytest.approx(100e3, rel=1e-14)


def _potential(contact, x, y):
    """Sum of the two surfaces' displacements: integral of p / (pi E* r), in polar coordinates about (x, y)."""
    angles = (np.arange(2000) + 0.5) / 2000 * np.pi

    def along(angle):
        # p along a chord of the ellipsoid is a half ellipse of area pi/2 * peak * half chord
        cx, cy = np.cos(angle) / contact.semi_x, np.sin(angle) / contact.semi_y
        a = cx**2 + cy**2
        b = x / contact.semi_x * cx + y / contact.semi_y * cy
        c = 1 - (x / contact.semi_x) ** 2 - (y / contact.semi_y) ** 2
        return contact.max_pressure * (c + b**2 / a) * np.pi / (2 * np.sqrt(a))

    return np.mean(along(angles)) * np.pi / (np.pi * contact.modulus)


@pytest.mark.parametrize("radii", [(0.46, 0.3), (0.3, 0.46), (1.0, 1.0), (1.0, 1 - 1e-9), (5.0, 0.01)])
def test_displacement_under_the_ellipsoid_fits_the_gap(radii):
    """u(x, y) = approach - x^2/2Rx - y^2/2Ry inside; the periodic midpoint rule converges exponentially."""
    contact = point_contact(1e4, *radii, E_STAR)
    for fx, fy in [(0, 0), (0.5, 0), (0, 0.7), (-0.3, 0.6)]:
        x, y = fx * contact.semi_x, fy * contact.semi_y
        gap = x**2 / (2 * radii[0]) + y**2 / (2 * radii[1])
        assert _potential(contact, x, y) + gap == pytest.approx(contact.approach, rel=1e-10)


def test_circle_is_the_limit_of_the_ellipse():
    circle = point_contact(1e4, 0.5, 0.5, E_STAR)
    assert circle.semi_x == pytest.approx((3 * 1e4 * 0.5 / (4 * E_STAR)) ** (1 / 3), rel=1e-14)
    assert circle.approach == pytest.approx(circle.semi_x**2 / 0.5, rel=1e-14)


def test_approach_and_force_are_inverse():
    contact = point_contact(8e4, 0.46, 0.08, E_STAR)
    assert point_contact_of_approach(contact.approach, 0.46, 0.08, E_STAR).force == pytest.approx(8e4, rel=1e-13)
    assert contact_stiffness(0.46, 0.08, E_STAR) * contact.approach**1.5 == pytest.approx(8e4, rel=1e-13)


def test_unlike_materials_meet_between():
    """Steel against a rigid body halves the compliance: E* doubles; order of the bodies is nothing."""
    soft, rigid = Elastic(190e9, 0.3), Elastic(1e30, 0.3)
    assert contact_modulus(STEEL, rigid) == pytest.approx(2 * E_STAR, rel=1e-12)
    assert contact_modulus(STEEL, soft) == contact_modulus(soft, STEEL)


def test_line_compression_is_the_strain_below_summed_up():
    from bem.exact.subsurface import line_stress

    contact = line_contact(1e6, 0.5, E_STAR)

    def strain(depth):
        xx, zz, _ = line_stress(0.0, depth, contact.half_width, contact.max_pressure)
        return -((1 - 0.3**2) * zz - 0.3 * 1.3 * xx) / 210e9

    depth = 200 * contact.half_width  # remainder (a/d)^2 = 2.5e-5 of the constant term
    total = quad(strain, 0, depth, limit=500, epsrel=1e-11, points=[contact.half_width, 10 * contact.half_width])[0]
    assert line_compression(contact, depth, 0.3, STEEL.plane_modulus) == pytest.approx(total, rel=1e-5)


def test_sphere_impact_on_half_space():
    """VERIFICATION A: R 25 mm, 1 m/s: 58.70 um, 10.94 kN, 172.8 us."""
    impact = sphere_impact(7850 * 4 / 3 * np.pi * 0.025**3, 1.0, 0.025, E_STAR)
    assert impact.approach == pytest.approx(58.70e-6, abs=5e-9)
    assert impact.force == pytest.approx(10.94e3, abs=5)
    assert impact.contact_time == pytest.approx(172.8e-6, abs=5e-8)


@pytest.mark.parametrize(
    "call",
    [
        lambda: line_contact(0.0, 0.5, E_STAR),
        lambda: line_contact(-1.0, 0.5, E_STAR),
        lambda: line_contact(np.nan, 0.5, E_STAR),
        lambda: point_contact(1.0, -0.5, 0.5, E_STAR),
        lambda: point_contact(1.0, 1e13, 0.5, E_STAR),
    ],
)
def test_what_has_no_hertz_contact_is_refused(call):
    with pytest.raises(HertzError):
        call()


@pytest.mark.parametrize(
    "young, poisson", [(0.0, 0.3), (-1.0, 0.3), (np.nan, 0.3), (1.0, 0.5), (1.0, -1.0), (1.0, 0.6)]
)
def test_impossible_materials_are_refused(young, poisson):
    with pytest.raises(MaterialError):
        Elastic(young, poisson)
