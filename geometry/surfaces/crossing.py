"""Parametric UK cast crossing 1:N: cross-sections ready for lofting and exact running surface. Axes: geometry.axes."""

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from geometry.profiles.profile import along, lengths
from geometry.surfaces.bodies import CrossingError, TwoBodies
from geometry.surfaces.crossing_surface import (
    FLOOR,
    CrossingShape,
    body_heights,
    centre_line_y,
    fall_start_y,
    field_edge_y,
    knuckle_centre,
    leg_progress,
    nose_gauge_y,
    rib_height,
    topped_corner_arc,
    topping_height,
    wing_centre,
    wing_gauge_y,
    wing_plane,
)
from geometry.surfaces.leg_transition import CAST_SLOPE, cast_leg, leg_loft, matching_points

MM = 1e-3
BENCHMARK_RATIO = 9.25
PLAIN_LINE_X = -5.0  # where the axle's height on plain line is taken [m]
WING_SEGMENTS = {"face": 16, "corner": 16, "plane": 24, "shoulder": 40, "side": 12}
NOSE_SEGMENTS = {"face": 16, "corner": 16, "top": 12, "field top": 12, "field corner": 16, "field face": 16}
CAST_LIMITS = {  # of the parameters, SI
    "ratio": (4.0, 40.0),
    "flangeway": (0.030, 0.070),
    "cast_slope": (0.01, 0.07),
    "topping_slope": (0.0, 0.05),
    "topping_depth": (0.002, 0.010),
    "transition_length": (0.02, 1.0),
    "transition_smoothness": (0.0, 2.0),
    "leg_lowering": (-0.003, 0.005),
    "leg_fade": (0.05, 1.0),
    "wing_raise": (-0.006, 0.008),
    "wing_flare": (0.0, 0.05),
    "flare_start": (0.0, 1.2),
    "nose_lowering": (-0.0015, 0.005),
    "nose_widening": (-0.006, 0.006),
    "gauge_widening": (-0.002, 0.006),
}
NARROWEST_WING = 8 * MM  # between its gauge face 14 mm down and its field side
LEAST_TOP = 0.7 * MM  # of a nose between its ridge and the segment of a corner
DENSE = 300  # points by which a segment's length is measured


def feature_indices(segments: dict[str, int]) -> dict[str, int]:
    """Index of the last point of each segment; the foot is index 0."""
    return dict(zip(segments, np.cumsum(list(segments.values())).tolist()))


@dataclass(frozen=True)
class CastCrossing(TwoBodies):
    """UK cast crossing of ratio 1:N after the design rules of the 56E1-R245-1:9.25 benchmark crossing.

    Features made by the taper stretch along x with the ratio; cross-sections and the machined leg end do not.

    Parameters
    ----------
    ratio : float
        N, unit crossing angle by centre line measure, angle = 2 atan(1 / 2N).
    flangeway : float
        Between wing and nose, 14 mm down [m].
    cast_slope : float
        Of the top of leg and wing, rising to the field side about the running line (the benchmark's: 1:20) [1].
    topping_slope, topping_depth : float
        Of the topped nose where it begins (slope [1] at ratio 9.25; it falls with the stretch; depth [m]).
    transition_length : float
        Of the machined change from the 56E1 rail to the cast section; its end stays where it is [m].
    transition_smoothness : float
        0 straight between both, 1 cubic with level ends (the benchmark), 2 quintic.
    leg_lowering, leg_fade : float
        Depth by which the running surface is cut down at the end of that change, and the length over which it regains
        its height [m].
    wing_raise : float
        Height that the wing gains from the knuckle to the theoretical intersection, and keeps [m].
    wing_flare, flare_start : float
        Further opening of the flangeway [rad] behind a position x [m].
    nose_lowering, nose_widening : float
        Of the whole topping line; of the nose, half on each side [m].
    gauge_widening : float
        The nose's through-route face stands back from the gauge line by so much [m].

    Notes
    -----
    Wing: plain rail, leg, knuckle and wing rail in one body; nose: begins at nose_x with a blunt ramp.
    Not modelled: floor fillets, rail foot and web (the bodies go straight down to the floor), the heel ends.
    Error: see tests/geometry/test_crossing_benchmark.py (deviation from the benchmark's sections).
    Source: design rules fitted to the sections of the S&C benchmark (Bezin, Palsson et al., Vehicle Syst. Dyn. 61,
    2023).

    Examples
    --------
    >>> crossing = geometry.CastCrossing(ratio=9.25)
    >>> crossing.wing_section(0.2).shape[1]  # y, z [m]
    2
    """

    ratio: float = 10.75
    flangeway: float = 41.24 * MM
    cast_slope: float = CAST_SLOPE
    topping_slope: float = 0.015262
    topping_depth: float = 4.224 * MM
    transition_length: float = 116.2 * MM
    transition_smoothness: float = 1.0
    leg_lowering: float = 0.0
    leg_fade: float = 0.3
    wing_raise: float = 0.0
    wing_flare: float = 0.0
    flare_start: float = 0.5
    nose_lowering: float = 0.0
    nose_widening: float = 0.0
    gauge_widening: float = 0.0

    def __post_init__(self):
        for field in fields(self):
            low, high = CAST_LIMITS[field.name]
            value = getattr(self, field.name)
            if not (np.isfinite(value) and low <= value <= high):
                raise CrossingError(f"crossing: {field.name} = {value:g} is outside [{low:g}, {high:g}]")
        self._check_wing_width()

    def _check_wing_width(self) -> None:
        """A wing whose face has been moved through its body is no wing."""
        for x in np.linspace(0.0, self.x_range[1], 40):
            width = field_edge_y(x, self.shape) - wing_gauge_y(x, self.shape)
            if width < NARROWEST_WING:
                raise CrossingError(
                    f"crossing: at x = {x / MM:.0f} mm the wing is {width / MM:.1f} mm wide, at least"
                    f" {NARROWEST_WING / MM:g} are needed: take a smaller flangeway ({self.flangeway / MM:g} mm) or"
                    f" wing_flare ({self.wing_flare * 1e3:g} mrad from x = {self.flare_start / MM:g} mm)"
                )

    @property
    def stretch(self) -> float:
        """Length of the taper-driven features over those of the 1:9.25 benchmark crossing."""
        return self.ratio / BENCHMARK_RATIO

    @property
    def nose_x(self) -> float:
        """x where the nose begins [m]."""
        return self.stretch * self.shape.nose_x

    @property
    def x_range(self) -> tuple[float, float]:
        """Where the crossing is modelled [m]: plain rail at the near end, wing and nose still there at the far end."""
        return -10.0, 1.06 * self.stretch

    @property
    def modelled(self) -> str:
        return f"the modelled crossing 1:{self.ratio:g}"

    @cached_property
    def shape(self) -> CrossingShape:
        """The numbers of the closed-form surface."""
        return crossing_shape(self)

    @cached_property
    def loft(self) -> np.ndarray:
        """(8, n)  the two lines between which the leg transition is lofted."""
        return leg_loft(self.shape)

    plain_x = PLAIN_LINE_X  # x of plain rail, where the axle's height counts as 0 [m]

    @property
    def leg_range(self) -> tuple[float, float]:
        """x of the change from the plain rail to the cast section [m]."""
        return self.shape.leg_start, self.shape.leg_end

    @property
    def knuckle_x(self) -> float:
        """x where the wing's upper face leaves the gauge line [m]: the leg ends there."""
        return self.stretch * self.shape.knuckle_x

    @property
    def tables(self) -> tuple[CrossingShape, np.ndarray]:
        """What the compiled search takes (geometry.surfaces.surface_height)."""
        return self.shape, self.loft

    def heights(self, x: np.ndarray, y: np.ndarray, body: str) -> np.ndarray:
        """Heights (n,) [m] of "wing" or "nose" at x, y (n,); NO_METAL where the body is not."""
        return body_heights(x, y, body == "nose", self.shape, self.loft)

    def wing_section(self, x: float) -> np.ndarray:
        """(n, 2)  y, z [m] of the wing body at x, from the foot of its gauge face over the top to the field-side foot.

        Both feet lie on the floor. The same number of points and the same feature at the same index for every x: the
        segments of WING_SEGMENTS follow each other, `wing_features` holds the indices of their ends. Continuous in x.
        """
        self._check_x(x)
        if x < self.shape.leg_end:
            first, second = self._leg_points
            s = leg_progress(x, self.shape)
            return first + s * (second - first)
        return self._sample(x, "wing", self._wing_ends(x), WING_SEGMENTS)

    def nose_section(self, x: float) -> np.ndarray | None:
        """(n, 2)  y, z [m] of the nose at x, from the foot of its gauge face (negative y) to its field-side foot.

        None ahead of the nose. Same number of points and features for every x: NOSE_SEGMENTS, `nose_features`.
        """
        self._check_x(x)
        if x < self.nose_x:
            return None
        return self._sample(x, "nose", self._nose_ends(x), NOSE_SEGMENTS)

    # index of the last point of each segment of wing_section and of nose_section
    wing_features, nose_features = feature_indices(WING_SEGMENTS), feature_indices(NOSE_SEGMENTS)

    @cached_property
    def _leg_points(self) -> tuple[np.ndarray, np.ndarray]:
        cast = self._sample(self.shape.leg_end, "wing", self._wing_ends(self.shape.leg_end), WING_SEGMENTS)
        return matching_points(cast, self.shape), cast

    def _wing_ends(self, x: float) -> list[float]:
        """y of the ends of the wing's segments; the field side itself is vertical."""
        c = self.shape
        faces = (c.leg.face, c.knuckle_face, c.wing_face)
        radii = (c.leg.radius, c.knuckle_radius, c.wing_radius)
        slopes = (c.leg.slope, c.leg.slope, wing_plane(c)[1])
        centres = ((c.leg.centre_y, c.leg.centre_z), knuckle_centre(x, c), wing_centre(x, c))
        foot = max(z_to_face(FLOOR, f, r, *o) for f, r, o in zip(faces, radii, centres))
        start = max(o[0] - r / np.sqrt(1 + f**2) for f, r, o in zip(faces, radii, centres))
        end = max(o[0] - r * s / np.sqrt(1 + s**2) for r, s, o in zip(radii, slopes, centres))
        return [foot, start, end, self._plane_end(x), field_edge_y(x, c)]

    def _plane_end(self, x: float) -> float:
        """y where the wing's cast plane ends: at the fall to the pocket, at the pocket, at the cap, before the field
        edge."""
        c = self.shape
        top_z, slope = wing_plane(c)
        rib = rib_height(x, c)
        cap = max(rib / c.leg.slope, wing_gauge_y(x, c) + (rib - top_z) / slope)
        return min(max(fall_start_y(x, c), cap), field_edge_y(x, c) - (c.leg.side - c.leg.side_start))

    def _nose_ends(self, x: float) -> list[float]:
        c = self.shape
        foot = z_to_face(FLOOR, c.leg.face, c.leg.radius, c.leg.centre_y, c.leg.centre_z)
        touch, flat, _, _ = topped_corner_arc(*topping_height(x, c), c)
        face_end = c.leg.centre_y - c.leg.radius / np.sqrt(1 + c.leg.face**2)
        roof = c.leg.centre_y - c.leg.radius * c.leg.slope / np.sqrt(1 + c.leg.slope**2)
        sides = foot, min(face_end, touch), min(roof, flat)  # as through_side_y counts them
        foot, side, top = (y - c.nose_widening / 2 + c.nose_setback for y in sides)
        right, centre = nose_gauge_y(x, c), centre_line_y(x, c)
        field_top, field_side, field_foot = (
            right - (y - c.nose_widening / 2 - c.leg.gauge_line) / c.cos_angle for y in sides[::-1]
        )
        # where the corners meet in a ridge their arcs end there, not at their tops beyond it
        top, field_top = min(top, centre - LEAST_TOP), max(field_top, centre + LEAST_TOP)
        return [foot, side, top, centre, field_top, field_side, field_foot]

    def _sample(self, x: float, body: str, ends: list[float], segments: dict[str, int]) -> np.ndarray:
        """Points on the exact surface between the segments' end positions, evenly spaced along each segment's
        length."""
        points = [np.array([[ends[0], FLOOR]])]
        for (a, b), (segment, count) in zip(zip(ends[:-1], ends[1:]), segments.items()):
            dense = a + (b - a) * (1 - np.cos(np.linspace(0, np.pi, DENSE))) / 2
            line = np.column_stack([dense, self._solid_height(x, dense, body)])
            part = along(line, np.linspace(0, lengths(line)[-1], count + 1)[1:])
            if segment != "shoulder":  # it may stand vertical
                part[:, 1] = self._solid_height(x, part[:, 0], body)
            points.append(part)
        points = np.vstack(points)
        if "side" in segments:
            z = np.linspace(points[-1, 1], FLOOR, segments["side"] + 1)[1:]
            return np.vstack([points, np.column_stack([np.full(len(z), ends[-1]), z])])
        points[-1, 1] = FLOOR
        return points

    def _solid_height(self, x: float, y: np.ndarray, body: str) -> np.ndarray:
        return body_heights(np.full(len(y), float(x)), y, body == "nose", self.shape, self.loft)


def z_to_face(z: float, face: float, radius: float, centre_y: float, centre_z: float) -> float:
    """y at height z on the straight face tangent to an arc (the face extended beyond the arc)."""
    root = np.sqrt(1 + face**2)
    return centre_y - radius / root + (z - (centre_z + radius * face / root)) * face


def crossing_shape(crossing: CastCrossing) -> CrossingShape:
    """Numbers of the surface: benchmark fits [mm, 1:9.25], stretched along x by the ratio.

    The taper angle is 2 atan(1 / 2N): at 1:9.25 the benchmark's gauge lines part by 0.108425 = tan of it.
    The machined leg end keeps its length; its position follows the published 1:10.75 proposal (end at -654 mm).
    """
    stretch = crossing.stretch
    angle = 2 * np.arctan(1 / (2 * crossing.ratio))
    leg_end = (-729.1 + 116.2 - 234.3 * (stretch - 1)) * MM
    cast = cast_leg(crossing.cast_slope)
    steeper = cast.slope / CAST_SLOPE
    return CrossingShape(
        leg=cast,
        stretch=stretch,
        leg_start=leg_end - crossing.transition_length,
        leg_end=leg_end,
        tan_angle=np.tan(angle),
        cos_angle=np.cos(angle),
        tan_half_angle=np.tan(angle / 2),
        flangeway=crossing.flangeway,
        wing_reference_height=1.597 * MM * steeper,
        cap_height=3.354 * MM * steeper,
        topping_depth=crossing.topping_depth + crossing.nose_lowering,
        topping_slope=crossing.topping_slope,
        leg_smoothness=crossing.transition_smoothness,
        leg_lowering=crossing.leg_lowering,
        leg_fade=crossing.leg_fade,
        wing_raise=crossing.wing_raise,
        raise_start=-474.35 * MM * stretch,
        wing_flare=crossing.wing_flare,
        flare_start=crossing.flare_start,
        nose_setback=crossing.gauge_widening,
        nose_widening=crossing.nose_widening,
    )
