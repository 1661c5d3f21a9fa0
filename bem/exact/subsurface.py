"""Stress below Hertz contacts in closed form: line (everywhere), circle and ellipse (on the axis).

Axes of geometry/axes.py: x along the surface, z up, out of the body; `depth` = -z >= 0. Tension positive.
"""

from __future__ import annotations

import numpy as np
from scipy.special import elliprd, elliprf

from bem.checks import refuse_unless_finite, refuse_unless_positive
from bem.exact.hertz import HertzError


def _refuse_above(depth: np.ndarray) -> None:
    depth = np.asarray(depth, float)
    if (depth < 0).any():
        raise HertzError(f"depth {depth.min():g} m lies above the surface: give depths >= 0")


def line_stress(
    x: np.ndarray, depth: np.ndarray, half_width: float, max_pressure: float, max_shear_traction: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stress in a half-plane under elliptic pressure and elliptic shear traction on |x| < half_width.

    x, depth           : arrays of one shape [m], depth >= 0
    max_pressure       : p0 of pressure p0 sqrt(1 - x^2/a^2) pressing on the body [Pa]
    max_shear_traction : q0 of a traction q0 sqrt(1 - x^2/a^2) acting on the body along +x [Pa]
    Returns sigma_xx, sigma_zz, sigma_xz [Pa], z up. Plane strain adds sigma_yy = nu (sigma_xx + sigma_zz).
    Source: McEwen's form, Johnson (1985), eq. 4.49 and 7.8, there with z down: sigma_xz changes sign.
    """
    refuse_unless_positive(HertzError, half_width=half_width)
    refuse_unless_finite(HertzError, max_pressure=max_pressure, max_shear_traction=max_shear_traction)
    _refuse_above(depth)
    x, depth = np.broadcast_arrays(np.asarray(x, float), np.asarray(depth, float))
    a = half_width
    part = a**2 - x**2 + depth**2
    modulus = np.hypot(part, 2 * x * depth)
    m2 = np.where(part > 0, modulus + part, 4 * x**2 * depth**2 / np.where(part > 0, 1, modulus - part + 1e-300)) / 2
    n2 = np.where(part < 0, modulus - part, 4 * x**2 * depth**2 / np.where(part < 0, 1, modulus + part + 1e-300)) / 2
    m, n = np.sqrt(m2), np.copysign(np.sqrt(n2), x)
    total = np.where(modulus > 0, m2 + n2, 1.0)  # zero only at the edges, where every stress of this field vanishes
    share = (depth**2 + n2) / total
    normal_xx = -(m * (1 + share) - 2 * depth) / a
    normal_zz = -m * (1 - share) / a
    normal_xz = n * (m2 - depth**2) / total / a
    shear_xx = (n * (2 - (depth**2 - m2) / total) - 2 * x) / a
    return (
        max_pressure * normal_xx + max_shear_traction * shear_xx,
        max_pressure * normal_zz - max_shear_traction * normal_xz,
        max_pressure * normal_xz - max_shear_traction * normal_xx,
    )


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
    refuse_unless_positive(HertzError, semi_x=semi_x, semi_y=semi_y)
    refuse_unless_finite(HertzError, max_pressure=max_pressure, poisson=poisson)
    _refuse_above(depth)
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


def von_mises(stress: np.ndarray) -> np.ndarray:
    """Von Mises stress [Pa] of stresses (..., 6), order xx, yy, zz, yz, xz, xy."""
    xx, yy, zz, yz, xz, xy = np.moveaxis(stress, -1, 0)
    return np.sqrt(((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2 + 3 * (yz**2 + xz**2 + xy**2))


def von_mises_plane(stress: np.ndarray, poisson: float) -> np.ndarray:
    """Von Mises stress (...) [Pa] in plane strain of stresses (..., 3), two normal ones and the shear stress."""
    xx, zz, xz = np.moveaxis(stress, -1, 0)
    out = poisson * (xx + zz)
    none = np.zeros_like(out)
    return von_mises(np.stack(np.broadcast_arrays(xx, zz, out, none, none, xz), axis=-1))


def max_shear_plane(xx: np.ndarray, zz: np.ndarray, xz: np.ndarray) -> np.ndarray:
    """Largest shear stress in the plane [Pa]."""
    return np.hypot((xx - zz) / 2, xz)
