"""A round pin in a hole of almost its own radius, in closed form: the conformal contact of like materials without
friction.

The plate is infinite, the pin is loaded at its centre; b = tan(semi_angle / 2).
Source: Persson, On the stress distribution of cylindrical elastic bodies in contact (Chalmers, 1964), as in Ciavarella
and Decuzzi, Int. J. Solids Struct. 38 (2001) 4507, for Dundurs' constants of zero. Its constants were checked against
the table of E* dR / P and p0 R / P that the tests quote.
"""

import numpy as np


class PinError(ValueError):
    """An angle or clearance at which a pin has no contact that the closed form describes."""


def _refuse_no_angle(semi_angle: float) -> None:
    if not 0 < semi_angle < np.pi:
        raise PinError(f"semi-angle {semi_angle!r} rad: must lie between 0 and pi")


def pin_clearance(semi_angle: float) -> float:
    """E* dR / P for a contact over +-semi_angle [rad]; E* the contact modulus, dR the clearance, P the load per
    thickness."""
    _refuse_no_angle(semi_angle)
    b2 = np.tan(semi_angle / 2) ** 2
    return float((2 - np.log1p(b2) - 2 * b2**2) / (2 * np.pi * b2 * (1 + b2)))


def pin_pressure(angle: np.ndarray, semi_angle: float) -> np.ndarray:
    """p R / P at angles [rad] from the line of the load, zero outside the contact."""
    _refuse_no_angle(semi_angle)
    b, y = np.tan(semi_angle / 2), np.tan(np.asarray(angle, float) / 2)
    edge, far = np.sqrt(np.clip(b**2 - y**2, 0, None)), np.sqrt(b**2 + 1)
    smooth = 2 * edge / (np.pi * far * (1 + y**2))
    return smooth + np.log((far + edge) / (far - edge)) / (2 * np.pi * b**2 * (1 + b**2))
