"""The parametric switch as a crossing of two bodies, as models of a pass take it: stock rail the wing, switch rail the
nose. Axes: geometry.axes.

The through route, facing: the straight switch rail's gauge face goes on along the gauge line, the stock rail leaves it
towards the field side. x = 0 at the toe.
"""

import numpy as np

from geometry.surfaces.leg_transition import cast_leg
from geometry.surfaces.measured_crossing import MeasuredCrossing
from geometry.surfaces.sections import SectionBody, SectionCrossing
from geometry.surfaces.switch import Switch

PLAIN = 3.0  # of plain stock rail ahead of the toe [m]
SPACING = 0.05  # of the sections [m]
TOE = 0.02  # x of the first section of the switch rail: at the toe itself it has no width [m]


def switch_rails(switch: Switch) -> MeasuredCrossing:
    """Sections of stock rail and switch rail every SPACING, cut where they are drawn."""
    x = np.r_[-PLAIN, -1.0, 0.0, TOE, np.arange(SPACING, switch.length + SPACING / 2, SPACING)]
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
