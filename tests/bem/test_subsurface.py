"""Stress below Hertz contacts against published maxima and quadrature of Flamant's and Boussinesq's solutions."""

import numpy as np
import pytest

from bem.exact.subsurface import line_stress, von_mises_plane
from tests.bem.closed_forms import circle_axis_stress, ellipse_axis_stress, max_shear_plane


def flamant_quadrature(x, depth, shear):
    """Half-plane under sqrt(1 - s^2) of pressure or of traction along +x, z up: s = sin(t), Gauss in t."""
    t, w = np.polynomial.legendre.leggauss(400)
    t, w = t * np.pi / 2, w * np.pi / 2
    s, w = np.sin(t), w * np.cos(t) ** 2
    across = x - s
    factor = -2 / np.pi * w / (across**2 + depth**2) ** 2
    if shear:
        return [(factor * across**3).sum(), (factor * across * depth**2).sum(), -(factor * across**2 * depth).sum()]
    return [(factor * across**2 * depth).sum(), factor.sum() * depth**3, -(factor * across * depth**2).sum()]


@pytest.mark.parametrize("x, depth", [(0.3, 0.4), (-0.7, 0.9), (1.5, 0.3), (0.0, 0.786), (-1.2, 0.2), (30.0, 5.0)])
@pytest.mark.parametrize("shear", [False, True])
def test_line_stress_is_flamants_solution_summed_up(x, depth, shear):
    closed = line_stress(x, depth, 1.0, 0.0 if shear else 1.0, 1.0 if shear else 0.0)
    np.testing.assert_allclose(closed, flamant_quadrature(x, depth, shear), atol=1e-12)


def test_line_stress_meets_the_surface_tractions():
    x = np.linspace(-2, 2, 41)
    xx, zz, xz = line_stress(x, 0.0, 1.0, 3.0, 0.5)
    profile = np.sqrt(np.clip(1 - x**2, 0, None))
    np.testing.assert_allclose(zz, -3 * profile, atol=1e-14)
    np.testing.assert_allclose(xz, 0.5 * profile, atol=1e-14)
    assert np.all(np.isfinite(xx))


def test_greatest_stresses_below_a_line_contact():
    """VERIFICATION D: 0.30028 p0 at 0.786 a; von Mises 0.5575 p0 at 0.704 a for nu 0.3."""
    depth = np.linspace(0, 3, 30001)
    stress = line_stress(0 * depth, depth, 1.0, 1.0)
    shear, mises = max_shear_plane(*stress), von_mises_plane(np.column_stack(stress), 0.3)
    assert shear.max() == pytest.approx(0.30028, abs=5e-6)
    assert depth[shear.argmax()] == pytest.approx(0.786, abs=5e-4)
    assert mises.max() == pytest.approx(0.5575, abs=5e-5)
    assert depth[mises.argmax()] == pytest.approx(0.704, abs=5e-4)


def test_greatest_stresses_below_a_circle():
    """VERIFICATION D: 0.3100 p0 at 0.481 a; von Mises 0.6200 p0 for nu 0.3."""
    depth = np.linspace(0, 3, 30001)
    xx, yy, zz = circle_axis_stress(depth, 1.0, 1.0, 0.3)
    assert (xx - zz).max() == pytest.approx(0.6200, abs=5e-5)
    assert (xx - zz).max() / 2 == pytest.approx(0.3100, abs=5e-5)
    assert depth[(xx - zz).argmax()] == pytest.approx(0.481, abs=5e-4)
    np.testing.assert_allclose(xx, yy, atol=1e-14)


def boussinesq_quadrature(depth, a, b, nu):
    """Stress on the axis: Gauss in the radius (r = sin t), midpoint rule in the angle."""
    t, w = np.polynomial.legendre.leggauss(200)
    t, w = (t + 1) * np.pi / 4, w * np.pi / 4
    radius, angle = np.meshgrid(np.sin(t), np.arange(800) / 400 * np.pi, indexing="ij")
    weight = (w * np.cos(t) ** 2)[:, None] * radius * a * b * np.pi / 400
    x, y = a * radius * np.cos(angle), b * radius * np.sin(angle)
    r2, rho = x**2 + y**2, np.sqrt(x**2 + y**2 + depth**2)

    def horizontal(u, v):
        return (1 - 2 * nu) / r2 * (
            (1 - depth / rho) * (u**2 - v**2) / r2 + depth * v**2 / rho**3
        ) - 3 * depth * u**2 / rho**5

    parts = horizontal(x, y), horizontal(y, x), -3 * depth**3 / rho**5
    return [(part * weight).sum() / (2 * np.pi) for part in parts]


@pytest.mark.parametrize("depth, a, b", [(0.5, 1, 1), (0.5, 1, 1 - 1e-8), (0.5, 2, 1), (0.5, 1, 2), (1.0, 5, 1)])
def test_ellipse_axis_stress_is_boussinesqs_solution_summed_up(depth, a, b):
    np.testing.assert_allclose(
        ellipse_axis_stress(depth, a, b, 1.0, 0.3), boussinesq_quadrature(depth, a, b, 0.3), atol=1e-10
    )


def test_long_ellipse_is_a_line_contact():
    """Error of order (b/a)^2 ln(a/b)."""
    depth = np.linspace(0, 3, 7)
    xx, yy, zz = ellipse_axis_stress(depth, 1e6, 1.0, 1.0, 0.3)
    line_xx, line_zz, _ = line_stress(0 * depth, depth, 1.0, 1.0)
    np.testing.assert_allclose(yy, line_xx, atol=1e-6)
    np.testing.assert_allclose(zz, line_zz, atol=1e-6)
    np.testing.assert_allclose(xx, 0.3 * (line_xx + line_zz), atol=1e-6)
