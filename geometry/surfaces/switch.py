"""A switch: a planed switch rail that closes to a stock rail. PARAMETRIC, our own shape, not a drawing. Axes:
geometry.axes, left rails.

x runs from the switch rail's toe towards the heel (facing). The stock rail lies straight with its own axes at y = 0;
the switch rail's gauge face leaves the stock rail's by width(x) = entry * x + x^2 / (2 R) towards the track. Its top
begins below the gauge corner of the stock rail and rises with its width. It is planed to fit the stock rail's head, so
that its back stands at one y.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import PchipInterpolator

from geometry.profiles.profile import Profile, ProfileError, arc, line
from geometry.profiles.rail import gauge_face, rail_head
from geometry.surfaces.leg_transition import cast_leg
from geometry.surfaces.lofted_rail import LoftedBody, RailSurface
from geometry.surfaces.measured_crossing import MeasuredCrossing
from geometry.surfaces.section_loft import SectionLoft, matched_body, upper_line
from geometry.surfaces.sections import SectionBody, SectionCrossing
from geometry.wheelset import RailPosition, Track, check_fields

MM = 1e-3
BACK = -30.5 * MM  # y of the switch rail's back
FLOOR = -36 * MM
SPACING = 0.1 * MM
PLAIN = 3.0  # of plain stock rail ahead of the toe [m]
SECTIONS = 0.05  # of the sections [m]
TOE = 0.02  # x of the first section of the switch rail: at the toe itself it has no width [m]


@dataclass(frozen=True)
class Switch:
    """A parametric switch rail beside its stock rail.

    Parameters
    ----------
    rail : str
        Head of the stock rail.
    radius : float
        Of the turnout's curve [m].
    entry : float
        Angle at the toe [rad].
    heights : tuple of (width, height)
        Of the top over growing widths [m]; beyond the last it keeps its height.
    corner : float
        Radius of the switch rail's gauge corner where it is wide [m].
    face : float
        Lean of its gauge face, dy/dz [1].
    length : float
        From the toe [m].
    spacing : float
        Of the sections from which the switch rail is lofted [m].

    Examples
    --------
    >>> switch = geometry.Switch()
    >>> switch.width(2.0) < switch.width(3.0), switch.top(1.0) < 0.0  # [m]
    (True, True)
    """

    rail: str = "56E1"
    radius: float = 290.0
    entry: float = 1 / 150
    heights: tuple[tuple[float, float], ...] = (
        (0.0, -16e-3),
        (6e-3, -10e-3),
        (14e-3, -6e-3),
        (28e-3, -3e-3),
        (50e-3, 0.0),
    )
    corner: float = 12.7e-3
    face: float = 0.1
    length: float = 6.0
    spacing: float = 0.25

    def __post_init__(self):
        check_fields("switch", self, radius=(50, 1e5), entry=(0, 0.1), corner=(1e-3, 30e-3), face=(0.01, 0.5))
        check_fields("switch", self, length=(1.0, 50.0), spacing=(0.01, 2.0))
        widths, tops = np.array(self.heights, float).T
        grow = len(widths) > 1 and (np.diff(widths) > 0).all() and (np.diff(tops) >= 0).all()
        if not (grow and tops.max() <= 2 * MM and tops.min() >= -25 * MM):
            raise ProfileError(
                f"switch: heights {self.heights} must grow in width, not fall, and lie within -25 and +2 mm"
            )

    @cached_property
    def stock(self) -> Profile:
        """Upright stock rail, the part that is a line z(y)."""
        return rail_head(self.rail)

    @cached_property
    def gauge_line(self) -> float:
        """y of the stock rail's gauge face, 14 mm down."""
        return gauge_face(self.stock)

    def width(self, x: float) -> float:
        """Distance of the switch rail's gauge face from the stock rail's, 14 mm down [m]."""
        return self.entry * x + x * x / (2 * self.radius)

    def top(self, x: float) -> float:
        """Height of the switch rail's flat top [m]."""
        widths, tops = np.array(self.heights).T
        return float(PchipInterpolator(widths, tops)(np.clip(self.width(x), widths[0], widths[-1])))

    def drawn_switch_rail(self, x: float) -> Profile:
        """The switch rail's section as drawn: gauge face, corner, flat top, back."""
        top, width = self.top(x), max(self.width(x), 0.05 * MM)
        corner = min(self.corner, 0.5 * (width + BACK - self.gauge_line))
        lean = np.arctan(self.face)
        at = self.gauge_line - width  # y of the face 14 mm below the stock rail's crown
        # the arc touches the face and the top: its centre lies `corner` below the top and beside the face
        centre_z = top - corner
        centre_y = at + (centre_z + 14 * MM) * self.face + corner / np.cos(lean)
        start = np.array([centre_y - corner * np.cos(lean), centre_z + corner * np.sin(lean)])
        foot = np.array([start[0] + (FLOOR - start[1]) * self.face, FLOOR])
        crown = np.array([centre_y, top])
        back = np.array([max(BACK, crown[0] + 0.2 * MM), top])
        pieces = [line(foot, start, 10 * SPACING), arc(start, crown, -corner, SPACING), line(crown, back, 10 * SPACING),
                  line(back, (back[0] + (top - FLOOR) / 20, FLOOR), 10 * SPACING)]  # fmt: skip
        return Profile.from_pieces(pieces, f"switch rail at {x:g} m", "PARAMETRIC, not a drawing")

    @cached_property
    def loft(self) -> SectionLoft:
        """The switch rail from its sections, as it would be from measured ones."""
        x = np.linspace(0, self.length, int(np.ceil(self.length / self.spacing)) + 1)
        return SectionLoft(x, tuple(self.drawn_switch_rail(float(at)) for at in x))

    def switch_rail(self, x: float) -> Profile:
        """The switch rail's section at x, interpolated between its sections."""
        return self.loft.section(x)

    def section(self, x: float) -> Profile:
        """What a wheel meets: the higher of stock rail and switch rail."""
        return upper_line(self.stock, self.switch_rail(x), f"switch at {x:g} m")

    def track(self, x: float, gauge: float = 1.435) -> Track:
        """Left rail: the switch; right rail: a plain head. y = 0 is the middle of the turnout's curve: half a gauge
        from the switch rail's gauge line.

        So the stock rail moves outwards by width(x), and both rails of the curve stay where they are.
        """
        section = self.section(x)
        own = Track(section, self.stock, gauge=gauge)
        wanted = gauge / 2 - self.gauge_line + self.width(x)
        return Track(
            section, self.stock, gauge=gauge, left_position=RailPosition(lateral=wanted - own.gauge_offset("left"))
        )

    def surfaces(self, spacing: float = 0.05) -> tuple[RailSurface, RailSurface]:
        """Left rail (stock rail and switch rail from 20 mm behind the toe) and right rail (a plain head along the
        turnout's curve) as surfaces.

        In the axes of the straight track, for geometry.contact.lofted_search; `track` gives the same section by section
        in those of the curve.
        """
        x = np.linspace(20 * MM, self.length, int(np.ceil(self.length / spacing)) + 1)
        switch_rail = matched_body(x, [self.drawn_switch_rail(float(at)) for at in x], label="switch rail")
        head = self.stock.graph_part()
        along = np.linspace(-1.0, self.length + 1.0, int((self.length + 2.0) / spacing) + 1)
        plain = LoftedBody.prism(head, tuple(along))
        aside = np.array([self.width(max(at, 0.0)) for at in along])[:, None]
        right = LoftedBody(plain.x, plain.y + aside, plain.z, plain.after, plain.before, "right rail")
        return RailSurface((LoftedBody.prism(head, (-1.0, self.length + 1.0)), switch_rail)), RailSurface((right,))


def switch_rails(switch: Switch) -> MeasuredCrossing:
    """The switch as a crossing of two bodies, as models of a pass take it: stock rail the wing, switch rail the nose.

    Sections every SECTIONS, cut where they are drawn. The through route, facing: the straight switch rail's gauge face
    goes on along the gauge line, the stock rail leaves it towards the field side. x = 0 at the toe.
    """
    x = np.r_[-PLAIN, -1.0, 0.0, TOE, np.arange(SECTIONS, switch.length + SECTIONS / 2, SECTIONS)]
    beside = cast_leg().gauge_line - switch.gauge_line
    stock, switch_rail = [], []
    for at in x:
        aside = beside + (switch.width(float(at)) if at > 0 else 0.0)
        stock.append(_body(switch.stock.graph_part().points, switch.gauge_line, aside))
        width = switch.width(float(at)) if at >= TOE else 0.0
        drawn = switch.drawn_switch_rail(float(at)).points if at >= TOE else None
        switch_rail.append(None if drawn is None else _body(drawn, switch.gauge_line - width, aside))
    return MeasuredCrossing(SectionCrossing(x, tuple(stock), tuple(switch_rail)), False, "parametric switch")


def _body(points: np.ndarray, face: float, aside: float) -> SectionBody:
    """A section (n, 2) with its gauge face at y = face, moved aside [m]."""
    return SectionBody(face + aside, points[:, 0] - face, points[:, 1])
