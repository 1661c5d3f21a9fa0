"""Machined change from the 56E1 rail to the cast crossing's section: a loft between two lines with matching features.

Fitted to the nine sections of the benchmark crossing inside its transition (rms 0.005 to 0.036 mm): straight paths
between matching points, walked with a cubic smoothstep of x.
"""

import numpy as np

from geometry.profiles.profile import along, lengths
from geometry.profiles.rail import gauge_face, rail_head
from geometry.surfaces.crossing_surface import FLOOR, CastLeg, CrossingShape, leg_height

MM = 1e-3
CAST_SLOPE = 0.05  # of the benchmark's cast plane, rising to the field side
FACE_TANGENT = -14.5287 * MM  # depth where the corner arc of 56E1 meets its side
SPACING = 0.02 * MM  # of the rail line, whose arcs become chords: within s^2 / 8R = 4e-9 m of R12.7
# matching features: y on the (centred) rail -> y on the cast section, the benchmark's fit
RAIL_CROWN_LEFT, RAIL_CROWN_RIGHT, RAIL_CORNER = 5.8935 * MM, 5.8935 * MM, 25.6175 * MM
CAST_CROWN_LEFT = -6.805 * MM
SHOULDER_SHARE = 0.548  # of the cast shoulder's length (down to SHOULDER_DEPTH) that matches the rail's R80 arc
SHOULDER_DEPTH = -4.94 * MM


def cast_leg(slope: float = CAST_SLOPE) -> CastLeg:
    """The benchmark's cast leg: plane 1:20, gauge corner R13, gauge face 1:4.

    The gauge face 14 mm down follows from the arc: y = -35.022 mm (nominal -35). A plane of another slope turns about
    the origin and leaves the face where it is.
    """
    face, radius, centre_y = 0.25, 13.0 * MM, -21.645 * MM
    gauge_depth, root = 14 * MM, np.sqrt(1 + face**2)
    height = lambda y, lean: lean * y - radius * np.sqrt(1 + lean**2)  # of the arc's centre: it touches the plane
    centre_y += (height(centre_y, slope) - height(centre_y, CAST_SLOPE)) * face / (1 - slope * face)
    centre = centre_y, height(centre_y, slope)
    gauge_line = centre[0] - radius / root + (-gauge_depth - centre[1] - radius * face / root) * face
    side, side_radius = 35.05 * MM, 3.238 * MM
    side_start = side - side_radius * (1 + np.sin(np.arctan(slope)))
    return CastLeg(slope, gauge_line, gauge_depth, face, radius, *centre, side, side_start, side_radius)


def rail_line(floor: float = FLOOR) -> tuple[np.ndarray, float]:
    """Points (n, 2) of the 56E1 head at the crossing, its sides drawn on to the floor, and its lateral shift.

    The rail is set so that its gauge face meets that of the cast leg (0.135 mm towards the gauge side).
    """
    rail = rail_head("56E1", spacing=SPACING)
    head, shift = rail.points, cast_leg().gauge_line - gauge_face(rail)
    lean = (head[-1, 0] + (head[-1, 1] - floor) / 20, floor)
    return np.vstack([[-lean[0] + shift, floor], head + [shift, 0], [lean[0] + shift, floor]]), shift


def cast_line(c: CrossingShape, floor: float = FLOOR) -> np.ndarray:
    """Points (n, 2) of the cast leg section from gauge-side foot to field-side foot."""
    leg = c.leg
    root = np.sqrt(1 + leg.face**2)
    foot = leg.gauge_line + (floor + leg.gauge_depth) * leg.face
    face_end = leg.centre_y - leg.radius / root
    corner_end = leg.centre_y - leg.radius * leg.slope / np.sqrt(1 + leg.slope**2)
    y = np.concatenate(
        [
            np.linspace(foot, face_end, 100),
            leg.centre_y - leg.radius * np.cos(np.linspace(np.arctan(leg.face), np.pi / 2 - np.arctan(leg.slope), 800)),
            np.linspace(corner_end, leg.side_start, 300)[1:],
        ]
    )
    z = np.array([leg_height(v, c) for v in y])
    lean = np.arctan(leg.slope)
    centre = (
        leg.side_start + leg.side_radius * np.sin(lean),
        leg.slope * leg.side_start - leg.side_radius * np.cos(lean),
    )
    polar = np.linspace(np.pi / 2 + lean, 0, 400)[1:]
    arc = np.column_stack([centre[0] + leg.side_radius * np.cos(polar), centre[1] + leg.side_radius * np.sin(polar)])
    return np.vstack([np.column_stack([y, z]), arc, [[arc[-1, 0], floor]]])


def feature_lengths(c: CrossingShape) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Rail line, cast line and, on each, the lengths (8,) of the features that match."""
    rail, shift = rail_line()
    cast = cast_line(c)
    on_rail, on_cast = lengths(rail), lengths(cast)
    tops = rail[:, 1] > FACE_TANGENT - 1e-9
    sides = [rail[tops][0, 0], rail[tops][-1, 0]]
    features = shift + np.array([-RAIL_CORNER, -RAIL_CROWN_LEFT, RAIL_CROWN_RIGHT, RAIL_CORNER])
    marks = [sides[0], *features, sides[1]]
    rail_lengths = np.interp(marks, rail[:, 0], on_rail)
    corner_end = c.leg.centre_y - c.leg.radius * c.leg.slope / np.sqrt(1 + c.leg.slope**2)
    face_end = c.leg.centre_y - c.leg.radius / np.sqrt(1 + c.leg.face**2)
    plane_end = np.interp(c.leg.side_start, cast[:, 0], on_cast)
    shoulder_end = on_cast[-1] - (SHOULDER_DEPTH - cast[-1, 1])
    shoulder = plane_end + SHOULDER_SHARE * (shoulder_end - plane_end)
    ends = np.interp([face_end, corner_end, CAST_CROWN_LEFT], cast[:, 0], on_cast)
    cast_lengths = [*ends, plane_end, shoulder, shoulder_end]
    return rail, cast, np.array([0.0, *rail_lengths, on_rail[-1]]), np.array([0.0, *cast_lengths, on_cast[-1]])


def matching_points(cast_points: np.ndarray, c: CrossingShape) -> np.ndarray:
    """(n, 2)  points of the rail line that match these points (n, 2) of the cast section, in order."""
    rail, cast, rail_lengths, cast_lengths = feature_lengths(c)
    at = np.interp(progress(cast_points, cast), progress(cast, cast), lengths(cast))
    return along(rail, np.interp(at, cast_lengths, rail_lengths))


def progress(points: np.ndarray, line: np.ndarray) -> np.ndarray:
    """(n,)  a measure that grows along the line, for points (n, 2) on it: y + z up to its top, y - z behind."""
    top = line[np.argmax(line[:, 1])]
    y, z = (points - top).T
    return np.where(y < 0, y + z, y - z)


def leg_loft(c: CrossingShape, nodes: int = 240) -> np.ndarray:
    """(8, n)  both lines at matching points, `nodes` per feature: y, z, slope after, slope before of rail, then of
    cast.

    Slopes are differences within a feature, so that joints between features may be kinks. Table of loft_height.
    """
    rail, cast, rail_lengths, cast_lengths = feature_lengths(c)
    return np.vstack([slope_table(rail, rail_lengths, nodes), slope_table(cast, cast_lengths, nodes)])


def slope_table(line: np.ndarray, marks: np.ndarray, nodes: int) -> np.ndarray:
    """(4, n)  y, z, slope on leaving and on reaching each point; evenly spaced points between the marks of a line."""
    parts = [along(line, np.linspace(a, b, nodes)) for a, b in zip(marks[:-1], marks[1:])]
    slopes = [difference_slope(*part.T) for part in parts]
    points = np.vstack([part[:-1] for part in parts] + [parts[-1][-1:]])
    after = np.concatenate([slope[:-1] for slope in slopes] + [[0.0]])
    before = np.concatenate([[0.0]] + [slope[1:] for slope in slopes])
    return np.vstack([points.T, after, before])


def difference_slope(y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """dz/dy (n,) by second-order differences; 0 on a vertical line, where the height is interpolated linearly."""
    if np.min(np.diff(y)) < 1e-9:
        return np.zeros(len(y))
    return np.gradient(z, y, edge_order=2)
