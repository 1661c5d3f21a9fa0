"""Wheel profiles by name. y from the tread datum D0 towards the field side, z up, D0 at z = 0 (geometry.axes).

The standards draw the flange upwards; here it hangs down (z is the negative of theirs), as on the rail.
"""

from functools import lru_cache

import numpy as np

from geometry.axes import FLANGE_BACK, GAUGE_POINT_DEPTH
from geometry.profiles.profile import Piece, Profile, ProfileError, arc, graph, line, spline

MM = 1e-3
SPACING = 0.1 * MM  # of the samples on curves: the Hermite interpolation between them is then exact to 1e-12 m on R13
WHEEL_NAMES = ("P8", "P8-worn", "P8-hollow", "P1", "S1002")
EN_EPS = "EN 13715:2020 EPS (which includes the former British P8), flange height 30 mm, thickness 28.5 mm"

# EN 13715:2020 table D.1, transition zone D1 to C1b for thickness 28.5 mm: y = -39, -38.5, ..., -26 mm
EPS_TRANSITION = np.array([
    6.867, 6.464, 6.104, 5.780, 5.488, 5.224, 4.985, 4.768, 4.573, 4.398, 4.241, 4.101, 3.978, 3.871,
    3.776, 3.683, 3.592, 3.503, 3.417, 3.332, 3.248, 3.167, 3.088, 3.011, 2.935, 2.862, 2.790,
])  # fmt: skip

# S1002, height above D0 towards the flange tip as polynomials in y [mm], flange height 28, thickness 32.5
S1002_TREAD = (
    0.0, -3.358537058e-2, 1.565681624e-3, -2.810427944e-5, 5.844240864e-8, -1.562379023e-8, 5.309217349e-15,
    -5.957839843e-12, 2.646656573e-13,
)  # fmt: skip
S1002_ROOT = (
    -4.320221063e3, -1.038384026e3, -1.065501873e2, -6.051367875, -0.2054332446, -4.169739389e-3, -4.687195829e-5,
    -2.252755540e-7,
)  # fmt: skip


def wheel_profile(name: str, outer_slope: float = 0.067) -> Profile:
    """The wheel profile of this name, from flange back to field side.

    Source: EN 13715:2020 annexes A, B and D, numbers as in the public transcription of the standard.

    Parameters
    ----------
    name : str
        "P8" (or "EPS"), "P8-worn", "P8-hollow", "P1" or "S1002"; all but P8 and S1002 are surrogates and say so in
        their label.
    outer_slope : float
        Slope of the far tread of the P8 family beyond y = 29 mm, 0.03 to 0.2 [1].

    Returns
    -------
    Profile

    Raises
    ------
    ProfileError
        For an unknown name or a slope out of range.

    Examples
    --------
    >>> geometry.wheel_profile("P8").label
    'P8 (EN 13715 EPS h30 e28.5, far tread 6.7 %)'
    """
    name = "P8" if name == "EPS" else name
    if name not in WHEEL_NAMES:
        raise ProfileError(f"unknown wheel profile {name!r}; known: {', '.join(WHEEL_NAMES)}")
    if not 0.03 <= outer_slope <= 0.2:
        raise ProfileError(f"outer_slope {outer_slope:g} of the far tread is outside [0.03, 0.2]")
    return _build(name, float(outer_slope))


@lru_cache(maxsize=32)
def _build(name: str, outer_slope: float) -> Profile:
    if name == "P1":
        return p1_like()
    if name == "S1002":
        return s1002()
    new = eps_p8(outer_slope)
    if name == "P8-worn":
        return worn(new, 0.8 * MM, 30 * MM, "P8 worn SYNTHETIC, 0.8 mm")
    if name == "P8-hollow":
        return worn(new, 3.0 * MM, 33 * MM, "P8 hollow SYNTHETIC, 3 mm")
    return new


def flange_thickness(wheel: Profile, below: float = GAUGE_POINT_DEPTH) -> float:
    """Of a wheel's flange, from its back, `below` the tread datum [m]; there a track's gauge is measured. 0 for a
    flange that does not reach so far."""
    y, z = wheel.points.T
    tip = int(np.argmin(z))
    deep = tip + np.flatnonzero(z[tip:] < -below)
    if not len(deep):
        return 0.0
    face = slice(deep[-1], deep[-1] + 2)
    return float(np.interp(-below, z[face], y[face]) + FLANGE_BACK)


def eps_p8(outer_slope: float = 0.067) -> Profile:
    """EN 13715 EPS, h 30, e 28.5, width 135 mm: the surrogate for P8."""
    rise, tip_end, face_start, root_start = 2.0, (-51.758, 27.568), (-44.530, 17.779), (-42.427, 12.000)
    inner = np.array([-55.0, 16.0 + rise])
    outer = tip_end[0] - np.sqrt(144 - (tip_end[1] - inner[1]) ** 2)  # both centres of the tip, of one height
    edge = np.array([(inner[0] + outer) / 2, inner[1] + np.sqrt(144 - ((inner[0] - outer) / 2) ** 2)])
    pieces = [
        *flange_back(rise, edge),
        _arc(edge, tip_end, -12),
        _arc(tip_end, face_start, -(20 + 0.75 * rise)),
        _line(face_start, root_start),
        _arc(root_start, (-39.000, 6.867), 13),
    ]
    y = np.linspace(-39.0, -26.0, len(EPS_TRANSITION)) * MM
    tread = _arc((-26.0, 2.790), (-17.587, 1.487), 100)
    pieces.append(spline(y, -EPS_TRANSITION * MM, np.tan(pieces[-1].angle[-1]), np.tan(tread.angle[0]), SPACING))
    chamfer = 60.0, -0.547 - outer_slope * 31.0
    pieces += [
        tread,
        _arc((-17.587, 1.487), (19.0, -0.547), 330),
        _line((19.0, -0.547), (29.0, -0.547)),
        _line((29.0, -0.547), chamfer),
        _line(chamfer, (65.0, chamfer[1] - 5.0)),
    ]
    label = f"P8 (EN 13715 EPS h30 e28.5, far tread {100 * outer_slope:g} %)"
    return Profile.from_pieces(pieces, label, EN_EPS)


def flange_back(rise: float, edge: np.ndarray) -> list[Piece]:
    """Back and tip of a flange by EN 13715, `rise` higher than 28, up to the edge in which the tip's R12 arcs meet half
    way between their centres where the flange is thin; in mm of the standard's axes (z towards the tip)."""
    end = -62.765, 25.149 + rise
    return [_arc((-70.0, 9.519 + rise), end, -20.5), _arc(end, edge, -12)]


def worn(new: Profile, depth: float, width: float, label: str, centre: float = -2 * MM) -> Profile:
    """SYNTHETIC wear: depth * exp(-|(y - centre) / width|^4) taken off the tread [m]. Not a measurement.

    The wear fades through the flange root without a cut, so that the profile stays smooth.
    """
    y, z = new.points.T
    t = (y - centre) / width
    loss = depth * np.exp(-(t**4))
    rate = -4 * t**3 / width * loss
    before, after = (np.arctan(np.tan(a) + rate) for a in (new.angle_before, new.angle_after))
    keep = np.abs(t) > 2  # the back of the flange may stand vertical, and exp(-16) is no wear
    before, after = np.where(keep, new.angle_before, before), np.where(keep, new.angle_after, after)
    curvature = np.where(loss > 0, np.nan, new.curvature)
    source = (
        f"SYNTHETIC surrogate, not a measurement: {new.provenance}, less {depth / MM:g} mm * exp(-|(y + 2 mm) /"
        f" {width / MM:g} mm|^4)"
    )
    return Profile(np.column_stack([y, z + loss]), before, after, curvature, label, source)


def p1_like() -> Profile:
    """APPROXIMATE P1: 1:20 cone through D0, root R15.9 (5/8 in), flange face 68 degrees, thickness 28.5 mm at 10 mm.

    The flange back is that of EN 13715 (height 28.6 mm) cut by a straight chamfer. The official drawing is not public.
    """
    steep, cone, radius = np.radians(68.0), np.arctan(0.05), 15.9
    face_at_10 = np.array([-70.0 + 28.5, 10.0])
    normal_face = np.array([np.sin(steep), np.cos(steep)])  # away from the steel, standard's axes
    normal_tread = np.array([np.sin(cone), np.cos(cone)])
    centre = np.linalg.solve(np.array([normal_face, normal_tread]), [normal_face @ face_at_10 + radius, radius])
    root_start, root_end = centre - radius * normal_face, centre - radius * normal_tread
    face_top = face_at_10 + (22.0 - 10.0) * np.array([-1 / np.tan(steep), 1.0])
    rise = 28.6 - 28.0
    edge = np.array([-57.0, 16.0 + rise + np.sqrt(144 - 4.0)])
    pieces = [
        *flange_back(rise, edge),
        _line(edge, face_top),
        _line(face_top, root_start),
        _arc(root_start, root_end, radius),
        _line(root_end, (52.0, -2.6)),
    ]
    source = "APPROXIMATE construction (cone 1:20, R15.9, 68 degrees), NOT the official P1 drawing"
    return Profile.from_pieces(pieces, "P1-like APPROXIMATE (1:20 cone)", source)


def s1002() -> Profile:
    """S1002 of EN 13715 / UIC 510-2: flange height 28, thickness 32.5, far tread 6.7 %, width 130 mm."""
    pieces = [
        _arc((-70.0, 9.519259302), (-62.764706, s1002_flange(-62.764706, -49.5, 9.519259302, 20.5)), -20.5),
        _arc(
            (-62.764706, s1002_flange(-62.764706, -55, 16, 12)),
            (-49.662510, s1002_flange(-49.662510, -55, 16, 12)),
            -12,
        ),
        _arc((-49.662510, s1002_flange(-49.662510, -55, 16, 12)), (-39.764474, s1002_face(-39.764474)), -20),
        _line((-39.764474, s1002_face(-39.764474)), (-38.426669, s1002_face(-38.426669))),
        _arc((-38.426669, s1002_face(-38.426669)), (-35.0, s1002_root(-35.0)), 13),
        polynomial(S1002_ROOT, -35.0, -26.0),
        polynomial(S1002_TREAD, -26.0, 32.157964),
        _line((32.157964, 1.364323640 - 0.066666667 * 32.157964), (60.0, 1.364323640 - 0.066666667 * 60.0)),
    ]
    return Profile.from_pieces(
        pieces, "S1002 (h28 e32.5, far tread 6.7 %)", "EN 13715 / UIC 510-2, section polynomials"
    )


def s1002_flange(y: float, centre_y: float, centre_z: float, radius: float) -> float:
    return centre_z + np.sqrt(radius**2 - (y - centre_y) ** 2)


def s1002_face(y: float) -> float:
    return -93.576667419 - 2.747477419 * y


def s1002_root(y: float) -> float:
    return np.polynomial.polynomial.polyval(y, S1002_ROOT)


def polynomial(coefficients, start: float, end: float) -> Piece:
    """Piece of a polynomial in y, coefficients and bounds in mm of the standard's axes."""
    p = np.polynomial.Polynomial(coefficients)
    y = np.linspace(start, end, int(np.ceil((end - start) * MM / SPACING)) + 1)
    return graph(y * MM, -p(y) * MM, -p.deriv()(y), -p.deriv(2)(y) / MM)


def _arc(start, end, radius: float) -> Piece:
    """Arc in mm of the standard's axes; mirroring z turns a left bend into a right one."""
    return arc(_down(start), _down(end), -radius * MM, SPACING)


def _line(start, end) -> Piece:
    return line(_down(start), _down(end), 10 * SPACING)


def _down(point) -> np.ndarray:
    return np.array([point[0], -point[1]]) * MM
