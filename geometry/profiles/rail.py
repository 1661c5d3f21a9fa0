"""Plain rail heads by name: 56E1 (BS113A), 60E1, 60E2 of EN 13674-1, upright or inclined. Axes: geometry.axes."""

from dataclasses import dataclass, replace

import numpy as np

from geometry.hermite import cubic_between
from geometry.profiles.profile import STEEP, Profile, ProfileError, arc, line

MM = 1e-3
SPACING = 0.1 * MM


@dataclass(frozen=True)
class HeadArcs:
    """One half of a symmetric rail head, from the crown outwards [mm].

    radii : of the arcs from the crown to the side face
    ends : y where each arc ends;  depths : below the crown there
    The side face leans outward 1:20 down to `bottom`, where the lower fillet begins.
    """

    radii: tuple[float, ...]
    ends: tuple[float, ...]
    depths: tuple[float, ...]
    bottom: float


def tangent_arcs(radii: tuple[float, ...], ends: tuple[float, ...], bottom: float) -> HeadArcs:
    """Head whose arcs follow each other tangentially from the crown (0, 0), so that the depths follow from radii and
    ends."""
    centre, depths = np.array([0.0, radii[0]]), []
    for i, (radius, end) in enumerate(zip(radii, ends)):
        depth = centre[1] - np.sqrt(radius**2 - (end - centre[0]) ** 2)
        depths.append(float(depth))
        if i + 1 < len(radii):
            towards_centre = (centre - [end, depth]) / radius
            centre = np.array([end, depth]) + radii[i + 1] * towards_centre
    return HeadArcs(radii, ends, tuple(depths), bottom)


HEADS = {
    "56E1": tangent_arcs((305.0, 80.0, 12.7), (5.8935, 25.6175, 34.925), 36.0),
    "60E1": tangent_arcs((300.0, 80.0, 13.0), (10.228, 26.0265, 36.0), 37.0),
    "60E2": tangent_arcs((200.0, 70.0, 16.0, 8.0), (11.889, 24.4565, 35.387, 36.0), 37.0),
}
ALSO_CALLED = {"BS113A": "56E1", "UIC60": "60E1"}  # older names of the same heads


def rail_head(name: str, inclination: float = 0.0, spacing: float = SPACING) -> Profile:
    """Running part of a rail head, from the bottom of its gauge side face over the crown to the field side face.

    The highest point has z = 0; the gauge face keeps, 14 mm below it, the y of the upright rail.
    Source: EN 13674-1:2017, numbers as in the public transcription of the standard.

    Parameters
    ----------
    name : str
        "56E1" (BS113A), "60E1" (UIC60) or "60E2".
    inclination : float
        Lean towards the track, as a slope: 0 upright, 1/20 or 1/40, at most 0.1 [1].
    spacing : float
        Of the samples on arcs [m].

    Returns
    -------
    Profile

    Raises
    ------
    ProfileError
        For an unknown name or an inclination out of range.

    Examples
    --------
    >>> rail = geometry.rail_head("60E1", inclination=1 / 40)
    >>> bool(abs(rail.points[:, 1].max()) < 1e-9)  # crown at z = 0 [m]
    True
    """
    name = ALSO_CALLED.get(name, name)
    if name not in HEADS:
        raise ProfileError(f"unknown rail {name!r}; known: {', '.join(HEADS)}")
    if not 0 <= inclination <= 0.1:
        raise ProfileError(f"rail inclination {inclination:g} is outside [0, 0.1]; 1:20 is 0.05")
    upright = _upright(name, spacing)
    return upright if inclination == 0 else inclined(upright, inclination)


def _upright(name: str, spacing: float) -> Profile:
    head = HEADS[name]
    y = [0.0, *head.ends, head.ends[-1] + (head.bottom - head.depths[-1]) / 20]
    z = [0.0, *(-d for d in head.depths), -head.bottom]
    corners = [np.array(p) * MM for p in zip(y, z)]
    right = [(a, b, r) for a, b, r in zip(corners[1:-1], corners[2:-1], head.radii[1:])]
    crown = (corners[1] * [-1, 1], corners[1], head.radii[0])
    left = [(b * [-1, 1], a * [-1, 1], r) for a, b, r in reversed(right)]
    pieces = [line(corners[-1] * [-1, 1], corners[-2] * [-1, 1], 10 * spacing)]
    pieces += [arc(a, b, -r * MM, spacing) for a, b, r in (*left, crown, *right)]
    pieces.append(line(corners[-2], corners[-1], 10 * spacing))
    return Profile.from_pieces(pieces, f"{name} upright", "EN 13674-1:2017, head arcs")


def inclined(upright: Profile, inclination: float) -> Profile:
    """The head turned towards the track (anticlockwise) and set back to z = 0 and to its gauge."""
    turned = upright.turned(np.arctan(inclination))
    turned = turned.shifted(0.0, -turned.points[:, 1].max())
    label = upright.label.replace("upright", f"inclined {inclination:g}")
    return replace(turned, label=label).shifted(gauge_face(upright) - gauge_face(turned), 0.0)


def gauge_face(rail: Profile, depth: float = 14 * MM) -> float:
    """y of the gauge face at this depth below z = 0 [m], y(z) a cubic between the points and along their tangents; its
    end where it ends above. Error: O(spacing^4) on smooth faces."""
    y, z = rail.points[: np.argmax(rail.points[:, 1]) + 1].T
    k = np.flatnonzero(z <= -depth).max(initial=-1)
    if k < 0:
        return float(y[0])
    h = z[k + 1] - z[k]
    lean = 1 / np.tan([rail.angle_after[k], rail.angle_before[k + 1]])  # dy/dz
    if np.abs(lean).max() > STEEP:
        lean[:] = (y[k + 1] - y[k]) / h
    return float(cubic_between((-depth - z[k]) / h, h, y[k], y[k + 1], *lean).value)
