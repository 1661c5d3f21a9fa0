"""Closed forms that judge and that nothing else asks for: impact of spheres, compression and stress below Hertz
contacts, spheres in partial slip, Kalker's linear theory. The others: bem.exact."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.special import elliprd, elliprf, gamma

from bem.exact.conformal import pin_clearance
from bem.exact.hertz import LineContact
from bem.exact.kalker import CreepageCoefficients
from bem.material import Elastic, Pair
from bem.patch import Creepage


@dataclass(frozen=True)
class SphereImpact:
    """Largest approach [m], largest force [N], duration of contact [s]."""

    approach: float
    force: float
    contact_time: float


# contact time * speed / approach = 2 * integral of dx / sqrt(1 - x^2.5) over (0, 1) = 2.9433
_TIME_FACTOR = 2 * np.sqrt(np.pi) * gamma(1.4) / gamma(0.9)


def sphere_impact(mass: float, speed: float, radius: float, modulus: float) -> SphereImpact:
    """Elastic impact of spheres, quasi-static Hertz (waves neglected).

    mass : effective mass [kg], 1/m = 1/m1 + 1/m2 (a half-space is infinite); speed : of approach [m/s]
    radius : relative [m]; modulus : E* [Pa]. Source: Johnson (1985), eq. 11.20 to 11.24.
    """
    approach = (15 * mass * speed**2 / (16 * np.sqrt(radius) * modulus)) ** 0.4
    force = 4 / 3 * modulus * np.sqrt(radius) * approach**1.5
    return SphereImpact(approach, force, _TIME_FACTOR * approach / speed)


def line_compression(contact: LineContact, depth: float, poisson: float, plane_modulus: float) -> float:
    """Approach [m] of the contact's middle to a point `depth` [m] below it in a half-plane, depth >> half-width.

    Line contact has no approach of its own: displacement grows as the logarithm of the depth. Error: of order
    (half_width/depth)^2. Source: Johnson (1985), eq. 5.57.
    """
    return (
        contact.force / (np.pi * plane_modulus) * (2 * np.log(2 * depth / contact.half_width) - poisson / (1 - poisson))
    )


def pin_semi_angle(clearance: float) -> float:
    """Semi-angle [rad] for a given E* dR / P; 84.8 degrees at zero clearance, more for an interference."""
    return float(brentq(lambda angle: pin_clearance(angle) - clearance, 1e-6, np.pi - 1e-6, xtol=1e-14))


def ellipse_axis_stress(
    depth: np.ndarray, semi_x: float, semi_y: float, max_pressure: float, poisson: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stress on the axis below an ellipsoidal pressure (the shear stresses vanish there).

    depth : (n,) [m] >= 0; semi_x, semi_y : semi-axes [m]; max_pressure [Pa]
    Returns sigma_xx, sigma_yy, sigma_zz, each (n,) [Pa].
    Error: round-off, for any axis ratio (tests/bem/test_subsurface.py: quadrature of Boussinesq's solution).
    Source: Thomas and Hoersch (1930) as in Boresi and Schmidt, Advanced Mechanics of Materials, section 17.4;
    rewritten with Carlson's integrals so that the circle is no special case.
    """
    if semi_x < semi_y:
        yy, xx, zz = ellipse_axis_stress(depth, semi_y, semi_x, max_pressure, poisson)
        return xx, yy, zz
    s = np.asarray(depth, float) / semi_x
    k = semi_y / semi_x
    n = np.sqrt((k**2 + s**2) / (1 + s**2))
    sine2, cosine2 = 1 / (1 + s**2), s**2 / (1 + s**2)  # of phi = arctan(semi_x / depth)
    delta2 = cosine2 + k**2 * sine2
    first = np.sqrt(sine2) * elliprf(cosine2, delta2, 1.0)  # F(phi)
    d = sine2**1.5 * elliprd(cosine2, delta2, 1.0) / 3  # (F - E)/e^2
    edge = 1 / ((1 + s**2) * (1 + n))  # (1 - n)/e^2
    other = (edge - 1 + s * (first - d)) / k**2
    xx = (-edge / 2 + s * d) + poisson * other
    yy = (edge / (2 * n) + other) + poisson * (-edge + s * d)
    zz = -1 / (2 * n * (1 + s**2))  # -(1/n - n)/(2 e^2)
    scale = 2 * k * max_pressure
    return scale * xx, scale * yy, scale * zz


def circle_axis_stress(
    depth: np.ndarray, radius: float, max_pressure: float, poisson: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stress on the axis below a Hertz circle: sigma_xx = sigma_yy, sigma_zz [Pa] (see ellipse_axis_stress)."""
    return ellipse_axis_stress(depth, radius, radius, max_pressure, poisson)


def max_shear_plane(xx: np.ndarray, zz: np.ndarray, xz: np.ndarray) -> np.ndarray:
    """Largest shear stress in the plane [Pa]."""
    return np.hypot((xx - zz) / 2, xz)


def cattaneo_sphere(
    tangential: float, limit: float, radius: float, first: Elastic, second: Elastic
) -> tuple[float, float]:
    """Stick radius [m] and shift [m] of distant points of a circular contact of the given radius [m]; limit is mu P
    (Johnson (1985), eq. 7.41 to 7.43)."""
    left = 1 - abs(tangential) / limit
    compliance = (2 - first.poisson) / first.shear + (2 - second.poisson) / second.shear
    return radius * left ** (1 / 3), 3 * limit / (16 * radius) * compliance * (1 - left ** (2 / 3))


def linear_creep_forces(
    semi_x: float, semi_y: float, pair: Pair, creepage: Creepage, coefficients: CreepageCoefficients
) -> tuple[float, float, float]:
    """Fx, Fy [N] and Mz [N m] on body 1 by the linear theory, for creepages about the ellipse's centre."""
    c = coefficients
    size = np.sqrt(semi_x * semi_y)
    return (
        -pair.shear * size**2 * c.c11 * creepage.longitudinal,
        -pair.shear * (size**2 * c.c22 * creepage.lateral + size**3 * c.c23 * creepage.spin),
        pair.shear * (size**3 * c.c23 * creepage.lateral - size**4 * c.c33 * creepage.spin),
    )
