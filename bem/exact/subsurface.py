"""Stress below Hertz line contacts in closed form; equivalent stresses.

Axes of geometry/axes.py: x along the surface, z up, out of the body; `depth` = -z >= 0. Tension positive.
"""

from __future__ import annotations

import numpy as np

from bem.checks import refuse_unless_finite, refuse_unless_positive
from bem.exact.hertz import HertzError


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
    x, depth = np.broadcast_arrays(np.asarray(x, float), np.asarray(depth, float))
    if (depth < 0).any():
        raise HertzError(f"depth {depth.min():g} m lies above the surface: give depths >= 0")
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
