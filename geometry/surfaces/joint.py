"""A dipped rail joint or weld: plain 56E1 rail whose running surface falls to a bend at x = 0 and rises again.

It is a crossing of one body, without a nose, so that every model takes it as it takes crossings. With a gap (an
insulated joint, whose end post carries nothing) it is two: the rail before it is the wing, the one behind it the nose.
Axes: geometry.axes.
"""

from dataclasses import dataclass

import numpy as np

from geometry.surfaces.crossing import CrossingError
from geometry.surfaces.leg_transition import rail_line
from geometry.surfaces.measured_crossing import MeasuredCrossing, measured_crossing
from geometry.surfaces.sections import SectionCrossing, split

MM = 1e-3
PLAIN = 6.0  # of plain rail on both sides of the dip [m]
ACROSS = 0.2 * MM  # between the section's points
FLANGEWAY = 2 * MM  # of floor beside the rail
STEP = 0.1  # between stations on a straight slope: a gauge face is placed at one depth, and moves as the rail sinks [m]
DEEPEST = 10 * MM  # of a dip
PARABOLA = 12  # stations on each side of a parabolic dip
CLOSEST = 0.5 * MM  # station to a rail end


@dataclass(frozen=True)
class Joint:
    """angle : between both slopes at the bend [rad];  length : of the dip on each side [m];  shape : straight slopes,
    or parabolas that leave the plain rail level;  bend : length over which slopes change, on each side [m], where there
    is no gap;  gap : between the rail ends [m]"""

    angle: float
    length: float = 1.0
    shape: str = "straight"
    bend: float = 1 * MM
    gap: float = 0.0

    def __post_init__(self):
        if self.depth > DEEPEST:
            raise CrossingError(
                f"joint: a dip of {self.angle * 1e3:g} mrad over {self.length / MM:g} mm is {self.depth / MM:.1f} mm"
                f" deep, at most {DEEPEST / MM:g} are meant: give a smaller angle or length"
            )

    @property
    def depth(self) -> float:
        """Of the dip [m]."""
        return self.angle / 2 * self.length / (1 if self.shape == "straight" else 2)

    @property
    def stations(self) -> np.ndarray:
        """(m,)  where the rail's height is given [m]; between them it follows cubics with limited slopes."""
        length, bend = self.length, self.bend
        if self.shape == "straight":
            side = np.r_[bend, np.arange(STEP, length - 2 * bend, STEP), length - bend, length, length + bend]
        else:
            side = np.r_[bend, np.linspace(0, length, PARABOLA + 1)[1:]]
        side = np.unique(np.r_[side, length + 1.0, length + PLAIN])
        if self.gap:
            side = np.r_[self.gap / 2, side[side > self.gap / 2 + CLOSEST]]
            return np.r_[-side[::-1], side]
        return np.r_[-side[::-1], 0.0, side]

    def height(self, x: np.ndarray) -> np.ndarray:
        """(m,)  of the rail at x (m,) [m]."""
        away = np.clip(1 - np.abs(x) / self.length, 0.0, 1.0)
        return -self.depth * (away if self.shape == "straight" else away**2)


def joint_rail(joint: Joint) -> MeasuredCrossing:
    """The rail with its joint as a crossing of one body, or of two with a gap between them."""
    line, _ = rail_line()
    y = np.arange(line[0, 0] - FLANGEWAY, line[-1, 0] + FLANGEWAY, ACROSS)
    z = np.interp(y, *line.T, left=line[0, 1], right=line[-1, 1])
    x = joint.stations
    sections = [np.column_stack([y, z + rise]) for rise in joint.height(x)]
    label = f"joint with a dip of {joint.angle * 1e3:g} mrad"
    if not joint.gap:
        return measured_crossing(x, sections, False, label)
    rails = [split(points, float(at))[0] for points, at in zip(sections, x)]
    left, right = (tuple(rail if side * at > 0 else None for rail, at in zip(rails, x)) for side in (-1, 1))
    return MeasuredCrossing(SectionCrossing(x, left, right), False, f"{label} and a gap of {joint.gap / MM:g} mm")
