"""Running surface of a cast crossing as compiled closed forms: height z (up) of wing and nose at (x, y) [m].

Every body is the common part of simple cuts, as it is machined: a height is the lowest of their heights.
The wing's leg transition is a loft between two tabulated lines. The numbers are in CrossingShape, built by
geometry.surfaces.crossing.
"""

from typing import NamedTuple

import numpy as np

from geometry.hermite import cubic_between
from geometry.surfaces.bodies import NO_METAL
from kernel_cache import njit

MM = 1e-3
FLOOR = -55e-3  # height of the flangeway's floor [m]
# one copy, inside its caller: handed over by value, the numbers of a shape cost more than a height
_part = njit(cache=True, forceinline=True, error_model="numpy")


class CastLeg(NamedTuple):
    """The cast section at the end of the transition [m]."""

    slope: float  # of its top plane, rising to the field side
    gauge_line: float  # y of the through route's gauge face, gauge_depth (14 mm) down
    gauge_depth: float
    face: float  # dy/dz of the gauge face (batter 1:4) of leg and nose, as a positive number
    radius: float  # of the gauge corner of leg and full nose
    centre_y: float  # of the gauge corner
    centre_z: float
    side: float  # y of its vertical field side
    side_start: float  # y where the top bends down to it
    side_radius: float


class CrossingShape(NamedTuple):
    """Numbers of one crossing; lengths in m, x of the taper-driven features before the stretch by ratio / 9.25."""

    leg: CastLeg
    stretch: float  # ratio / 9.25: taper-driven features lie at x = stretch * X
    leg_start: float  # transition from the plain rail, x
    leg_end: float
    tan_angle: float  # dy/dx between the two gauge lines
    cos_angle: float
    tan_half_angle: float
    flangeway: float
    wing_reference_height: float  # of the travelling top plane at wing_reference
    cap_height: float
    topping_depth: float
    topping_slope: float  # dz/dX
    leg_smoothness: float  # of the transition's blend, 0 straight, 1 cubic, 2 quintic
    leg_lowering: float  # of the running surface at the end of the transition
    leg_fade: float  # x over which the leg regains its height
    wing_raise: float  # of the running surface between raise_start and raise_end, held behind
    raise_start: float
    wing_flare: float  # further dy/dx of the wing's faces behind flare_start
    flare_start: float
    nose_setback: float  # of the nose's through-route face from the gauge line
    nose_widening: float  # of the nose, half on each side
    # of every crossing: fits to the benchmark's sections
    knuckle_x: float = -474.35 * MM  # X where the upper wing face leaves the gauge line
    knuckle_rate: float = 0.087554  # dy/dX of that face
    knuckle_face: float = 0.2657  # dy/dz of that face
    knuckle_radius: float = 6.05 * MM  # its gauge corner
    cross_x: float = -3.53 * MM  # X where the gauge lines cross
    wing_face: float = 0.0503  # dy/dz of the lower wing face (1:20)
    wing_radius: float = 6.05 * MM
    wing_reference: float = 10 * MM  # distance from the wing's gauge line
    pocket_x: float = -1.9 * MM  # X where the pocket beside the wing reaches the cap
    pocket_rate: float = 0.021755  # its rise dz/dX
    fall_y: float = 33.989 * MM  # edge of the fall from the cast plane to the pocket
    fall_width: float = 6.674 * MM  # width of the fall: fall_width + fall_spread * its depth
    fall_spread: float = 0.168
    fall_radius: float = 5.187 * MM  # of its edge
    fall_foot_radius: float = 5.293 * MM
    fall_length: float = 45 * MM  # x over which the leg's vertical side becomes the fall
    edge_radius: float = 4.1 * MM
    edge_x: float = 662.87 * MM  # X of ...
    edge_y: float = 126.23 * MM  # ... a point of the field edge; it runs parallel to the centre line
    topping_x: float = 162.188 * MM  # X where the topping line starts
    blunt_radius: float = 56.872 * MM  # of the blend between topping line and blunt ramp, in X and z
    blunt_slope: float = 0.72230  # of the blunt ramp, dz/dX
    nose_x: float = 118.94 * MM  # X of the first metal of the nose
    nose_radius: float = 6.95 * MM  # of the topped nose's corners
    raise_end: float = 0.0


@_part
def smoothstep(t):
    """0 below 0, 1 above 1, cubic between: continuous slope."""
    t = min(max(t, 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


@_part
def blend(t, smoothness):
    """0 below 0, 1 above 1; between: straight (smoothness 0), cubic with level ends (1), quintic with straight ends
    too (2), and mixtures."""
    t = min(max(t, 0.0), 1.0)
    cubic = t * t * (3.0 - 2.0 * t)
    if smoothness <= 1.0:
        return t + smoothness * (cubic - t)
    return cubic + (smoothness - 1.0) * (t * t * t * (10.0 + t * (6.0 * t - 15.0)) - cubic)


@_part
def leg_progress(x, c):
    """How far the leg transition has gone at x: 0 plain rail, 1 cast section."""
    return blend((x - c.leg_start) / (c.leg_end - c.leg_start), c.leg_smoothness)


@_part
def wing_lift(x, c):
    """By how much the wing body lies above the benchmark's at x: raised towards the nose, lowered about the leg's
    end."""
    lift = c.wing_raise * smoothstep((x - c.raise_start) / (c.raise_end - c.raise_start))
    return lift - c.leg_lowering * leg_progress(x, c) * (1.0 - smoothstep((x - c.leg_end) / c.leg_fade))


@_part
def corner(y, face, radius, centre_y, centre_z, slope):
    """Height of a body with a gauge face (dy/dz = face), a corner arc and a top of this slope, tangent to each other.

    The arc's centre is given; face and top follow from tangency.
    """
    steep = 1.0 / face
    face_y = centre_y - radius * steep / np.sqrt(1.0 + steep * steep)
    top_y = centre_y - radius * slope / np.sqrt(1.0 + slope * slope)
    if y < face_y:
        return centre_z + radius / np.sqrt(1.0 + steep * steep) + (y - face_y) * steep
    if y < top_y:
        return centre_z + np.sqrt(radius * radius - (y - centre_y) ** 2)
    return centre_z + radius / np.sqrt(1.0 + slope * slope) + (y - top_y) * slope


@_part
def corner_centre(face_y, face_z, face, radius, top_z, slope):
    """Centre (y, z) of the arc tangent to the face through (face_y, face_z) and to the top z = top_z + slope * (y -
    face_y)."""
    steep = 1.0 / face
    offset_face = radius * np.sqrt(1.0 + steep * steep)  # the centre lies this far below the face's line, vertically
    offset_top = radius * np.sqrt(1.0 + slope * slope)
    y = face_y + (top_z - offset_top - face_z + offset_face) / (steep - slope)
    return y, top_z + slope * (y - face_y) - offset_top


@_part
def nose_gauge_y(x, c):
    """y of the nose's flangeway-side gauge line."""
    return c.leg.gauge_line + c.tan_angle * (x - c.stretch * c.cross_x)


@_part
def wing_gauge_y(x, c):
    """y of the wing's lower gauge face, 14 mm down: parallel to the nose, or flared from it."""
    return nose_gauge_y(x, c) + c.flangeway + c.wing_flare * max(x - c.flare_start, 0.0)


@_part
def knuckle_gauge_y(x, c):
    """y of the wing's upper face, 14 mm down, extended to both sides of its range."""
    return c.leg.gauge_line + c.knuckle_rate * (x / c.stretch - c.knuckle_x)


@_part
def knuckle_centre(x, c):
    face_y = knuckle_gauge_y(x, c)
    return corner_centre(
        face_y, -c.leg.gauge_depth, c.knuckle_face, c.knuckle_radius, c.leg.slope * face_y, c.leg.slope
    )


@_part
def wing_plane(c):
    """Height at the wing's gauge line and slope of the top plane that travels with the wing (below the fixed one
    further on)."""
    slope = c.leg.slope * c.cos_angle
    return c.wing_reference_height - slope * c.wing_reference, slope


@_part
def wing_centre(x, c):
    top_z, slope = wing_plane(c)
    return corner_centre(wing_gauge_y(x, c), -c.leg.gauge_depth, c.wing_face, c.wing_radius, top_z, slope)


@_part
def field_edge_y(x, c):
    """y of the field side of the wing rail."""
    free = c.edge_y + c.tan_half_angle * (x - c.stretch * c.edge_x)
    blend = smoothstep((x - c.leg_end) / c.fall_length)
    return c.leg.side + blend * (free - c.leg.side)


@_part
def rib_height(x, c):
    """Height of the pocket beside the wing, which rises to the cap."""
    return min(c.cap_height, c.cap_height + c.pocket_rate * (x / c.stretch - c.pocket_x))


@_part
def fall_shape(x, c):
    """Edge of the fall from the cast plane to the pocket: y of the edge, angle of the fall, radius at its top and foot.

    The leg's vertical side turns into the fall behind the leg transition.
    """
    blend = smoothstep((x - c.leg_end) / c.fall_length)
    drop = max(c.leg.slope * c.fall_y - rib_height(x, c), 0.0)
    angle = np.arctan(drop / (c.fall_width + c.fall_spread * drop))
    edge_y = c.leg.side + blend * (c.fall_y - c.leg.side)
    radius = c.leg.side_radius + blend * (c.fall_radius - c.leg.side_radius)
    return edge_y, np.pi / 2 + blend * (angle - np.pi / 2), radius, blend * c.fall_foot_radius


@_part
def fall_start_y(x, c):
    """y where the cast plane begins to bend down to the pocket."""
    edge_y, angle, radius, _ = fall_shape(x, c)
    lean = np.arctan(c.leg.slope)
    return edge_y - radius * np.tan((lean + angle) / 2) * np.cos(lean)


@_part
def fall_height(x, y, c):
    """Height of the fall above the pocket: arc from the cast plane, straight line, arc into the pocket; NO_METAL beyond
    it."""
    edge_y, angle, radius, foot_radius = fall_shape(x, c)
    lean, sine, cosine = np.arctan(c.leg.slope), np.sin(angle), np.cos(angle)
    start_y = fall_start_y(x, c)
    if y <= start_y:
        return c.leg.slope * y
    centre_y, centre_z = start_y + radius * np.sin(lean), c.leg.slope * start_y - radius * np.cos(lean)
    end_y, end_z = centre_y + radius * sine, centre_z + radius * cosine
    if y < end_y:
        return centre_z + np.sqrt(radius * radius - (y - centre_y) ** 2)
    rib = rib_height(x, c)
    if end_z <= rib or cosine < 1e-6:
        return NO_METAL
    foot_radius = min(foot_radius, (end_z - rib) / (1.0 - cosine))
    foot_y = end_y + (end_z - rib - foot_radius) * cosine / sine + foot_radius / sine
    if y < foot_y - foot_radius * sine:
        return end_z - (y - end_y) * sine / cosine
    if y < foot_y:
        return rib + foot_radius - np.sqrt(foot_radius**2 - (foot_y - y) ** 2)
    return NO_METAL


@_part
def wing_top(x, y, below, c):
    """Height of the wing's top without its gauge corner: cast plane, cap, fall, pocket, field edge; of `below`, the
    height of the faces and corners, the lower of the two."""
    top_z, slope = wing_plane(c)
    face_y = wing_gauge_y(x, c)
    plane = min(c.leg.slope * y, top_z + slope * (y - face_y))
    edge = field_edge_y(x, c)
    if y > edge:
        return NO_METAL
    rib = rib_height(x, c)
    centre_y = edge - c.edge_radius
    centre_z = min(rib, top_z + slope * (centre_y - face_y)) - c.edge_radius
    if y > centre_y:
        rib = min(rib, centre_z + np.sqrt(max(c.edge_radius**2 - (y - centre_y) ** 2, 0.0)))
    if rib >= plane or below <= rib:  # however high the fall is: most of its cost is its angle
        return min(plane, below)
    return min(below, min(plane, max(rib, fall_height(x, y, c))))


@_part
def leg_height(y, c):
    """Height of the cast leg's gauge face, corner and plane; also the through side of the full nose."""
    return corner(y, c.leg.face, c.leg.radius, c.leg.centre_y, c.leg.centre_z, c.leg.slope)


@_part
def wing_height(x, y, c, loft):
    """Height of the wing body (plain rail, leg, knuckle, wing) at one point."""
    if x < c.leg_end:
        height = loft_height(y, leg_progress(x, c), loft)
        return height + wing_lift(x, c) if height > 0.5 * NO_METAL else height
    knuckle_y, knuckle_z = knuckle_centre(x, c)
    height = min(leg_height(y, c), corner(y, c.knuckle_face, c.knuckle_radius, knuckle_y, knuckle_z, c.leg.slope))
    wing_y, wing_z = wing_centre(x, c)
    height = min(height, corner(y, c.wing_face, c.wing_radius, wing_y, wing_z, wing_plane(c)[1]))
    height = wing_top(x, y, height, c)
    return height + wing_lift(x, c) if height > 0.5 * NO_METAL else height


@_part
def loft_height(y, s, loft):
    """Height of the line (1 - s) * first + s * second at y; cubic between the tabulated points, NO_METAL beside it.

    loft : (8, n)  rows y, z, slope after, slope before of the first and of the second line, at matching points
    """
    n = loft.shape[1]
    low, high = 0, n - 1
    if y < (1 - s) * loft[0, 0] + s * loft[4, 0] or y > (1 - s) * loft[0, high] + s * loft[4, high]:
        return NO_METAL
    while high - low > 1:
        middle = (low + high) // 2
        if (1 - s) * loft[0, middle] + s * loft[4, middle] <= y:
            low = middle
        else:
            high = middle
    y0, y1 = (1 - s) * loft[0, low] + s * loft[4, low], (1 - s) * loft[0, high] + s * loft[4, high]
    z0, z1 = (1 - s) * loft[1, low] + s * loft[5, low], (1 - s) * loft[1, high] + s * loft[5, high]
    h = y1 - y0
    if h <= 0.0:
        return max(z0, z1)
    leaving = lofted_slope(loft, low, high, low, 2, s)
    reaching = lofted_slope(loft, low, high, high, 3, s)
    t, rise = (y - y0) / h, z1 - z0
    if abs(rise) > 5.0 * h:
        return z0 + t * rise
    return cubic_between(t, h, z0, z1, leaving, reaching).value


@_part
def lofted_slope(loft, low, high, at, row, s):
    """Slope at one end of an interval of the lofted line: both lines run through it at the same pace."""
    first, second = (1 - s) * (loft[0, high] - loft[0, low]), s * (loft[4, high] - loft[4, low])
    return (first * loft[row, at] + second * loft[row + 4, at]) / (first + second)


@_part
def centre_line_y(x, c):
    """y of the nose's centre line, which halves the angle between its gauge lines."""
    return c.leg.gauge_line + c.tan_half_angle * (x - c.stretch * c.cross_x)


@_part
def centre_line_x(x, y, c):
    """x of the foot of (x, y) on the nose's centre line: what is symmetric about that line depends on it alone."""
    return x + (y - centre_line_y(x, c)) * c.tan_half_angle / (1.0 + c.tan_half_angle**2)


@_part
def through_side_y(x, y, c):
    """y at the same distance from the through route's gauge line as (x, y) is from the nearer gauge face of the
    nose."""
    near, far = y - c.nose_setback, c.leg.gauge_line + c.cos_angle * (nose_gauge_y(x, c) - y)
    return min(near, far) + 0.5 * c.nose_widening


@_part
def topping_height(x, c):
    """Height and fall (-dz/dX) of the topping line and, ahead of it, of the blunt ramp, along the nose's centre
    line."""
    ahead = c.topping_x - x / c.stretch
    start = c.topping_slope / np.sqrt(1.0 + c.topping_slope**2)  # sine of the slope angle
    end = c.blunt_slope / np.sqrt(1.0 + c.blunt_slope**2)
    if ahead <= 0.0:
        return -c.topping_depth - c.topping_slope * ahead, c.topping_slope
    radius = c.blunt_radius
    if ahead < radius * (end - start):
        sine = start + ahead / radius
        cosine = np.sqrt(1.0 - sine**2)
        return -c.topping_depth - radius * (np.sqrt(1.0 - start**2) - cosine), sine / cosine
    blend = radius * (np.sqrt(1.0 - start**2) - np.sqrt(1.0 - end**2))
    return -c.topping_depth - blend - c.blunt_slope * (ahead - radius * (end - start)), c.blunt_slope


@_part
def topped_corner_arc(top, fall, c):
    """Corner arc between the through side of the nose and its flat top: y where it touches the side, centre y, z,
    height.

    Its radius holds across the edge it rounds: on the blunt ramp, which falls steeply, the cross-section is an ellipse,
    higher than wide. That is drawn where the arc touches the straight face and fades above, where the ramp is gentle.
    """
    radius, steep = c.nose_radius, 1.0 / c.leg.face
    inner, root = c.leg.radius - radius, np.sqrt(1.0 + steep * steep)
    # the arc touches the face where its centre lies lower
    face_z = c.leg.centre_z + c.leg.radius / root - radius / root
    fade = smoothstep((face_z - (top - radius)) / radius)
    height = radius * (1.0 + fade * (np.sqrt(1.0 + (fall / c.stretch) ** 2) - 1.0))
    depth = top - height
    if depth < face_z:
        offset = np.sqrt((radius * steep) ** 2 + height**2)  # of the ellipse's centre below the face, vertically
        face_y = c.leg.centre_y - c.leg.radius * root / steep  # the face at the height of the leg's corner centre
        centre_y = face_y + (depth + offset - c.leg.centre_z) / steep
        return centre_y - radius * radius * steep / offset, centre_y, depth, height
    if depth < c.leg.centre_z + inner / np.sqrt(1.0 + c.leg.slope**2):
        centre_y = c.leg.centre_y - np.sqrt(max(inner * inner - (depth - c.leg.centre_z) ** 2, 0.0))
        return c.leg.centre_y + (centre_y - c.leg.centre_y) * c.leg.radius / inner, centre_y, depth, height
    lean = np.arctan(c.leg.slope)
    touch_y = (depth + radius * np.cos(lean)) / c.leg.slope
    return touch_y, touch_y + radius * np.sin(lean), depth, height


@_part
def nose_height(x, y, c):
    """Height of the nose at one point: full outline (faces, corners, roof), topped; NO_METAL ahead of it."""
    if x < c.stretch * c.nose_x:
        return NO_METAL
    side_y = through_side_y(x, y, c)
    top, fall = topping_height(centre_line_x(x, y, c), c)
    side = leg_height(side_y, c)
    if side <= top - c.nose_radius * np.sqrt(1.0 + (fall / c.stretch) ** 2):  # below the arc's centre at its highest
        return side
    touch_y, centre_y, centre_z, height = topped_corner_arc(top, fall, c)
    if side_y <= touch_y:
        return side
    if side_y >= centre_y:
        return top
    return centre_z + height * np.sqrt(1.0 - ((side_y - centre_y) / c.nose_radius) ** 2)


@njit(cache=True)
def body_heights(x, y, nose, c, loft):
    """Heights (n,) of one body at n points; nose: True for the nose, False for the wing."""
    out = np.empty(len(x))
    for i in range(len(x)):
        out[i] = nose_height(x[i], y[i], c) if nose else wing_height(x[i], y[i], c, loft)
    return out
