"""The diverging route: the wheel on the crossing runs on the outer rail of a curve, a check rail guides the other one.

A cast crossing is symmetric about its nose's centre line. Looked at in a mirror, the wheel of the diverging route
passes the crossing that a wheel of the through route passes; what differs is the curve, which presses the wheelset
outwards, towards the field side of the wheel on the crossing (+y), and the check rail, which holds it by the other
flange's back. Within the crossing both gauge lines are straight.
"""

from typing import Annotated

from rail_fem.scene.base import GRAVITY, Frozen
from rail_fem.scene.units import Quantity

HEAD_WIDTH = 0.070  # of a rail: wheels stand so much farther apart than the gauge [m]


class Diverging(Frozen):
    """The curve, what the vehicle does on it, and the check rail; even empty it makes the route the diverging one."""

    radius: Annotated[
        float | None, Quantity("m", 50, 1e5, "radius of the curve through the crossing; none: straight")
    ] = None
    cant: Annotated[float, Quantity("mm", -200, 200, "height of the outer rail over the inner one")] = 0.0
    lateral_force: Annotated[
        float | None,
        Quantity(
            "kN",
            -300,
            300,
            "quasi-static force of the vehicle across the wheelset, + to the outside; none: of radius, cant, speed",
        ),
    ] = None
    angle_of_attack: Annotated[
        float | None,
        Quantity(
            "mrad", -30, 30, "by which the suspension lets the axle head to the outside; none: it turns freely from 0"
        ),
    ] = None
    check_rail: Annotated[
        float | None, Quantity("mm", 30, 200, "flangeway of the check rail beside the other rail; none: no check rail")
    ] = None
    check_stiffness: Annotated[
        float, Quantity("kN/mm", 1, 5000, "stiffness of the check rail across the track (from memory, not verified)")
    ] = 50e6
    lateral: Annotated[
        float | None,
        Quantity(
            "mm", -15, 15, "lateral position of the wheelset at the start, + to the outside; none: that of equilibrium"
        ),
    ] = None

    @property
    def curvature(self) -> float:
        """Of the track [1/m]."""
        return 0.0 if self.radius is None else 1 / self.radius

    def acceleration(self, speed: float, gauge: float) -> float:
        """Across the track, to the outside, that cant does not balance [m/s2]: V^2 / R - g cant / distance of the
        wheels' contacts (small angles)."""
        return self.curvature * speed**2 - GRAVITY * self.cant / (gauge + HEAD_WIDTH)

    def clearance(self, gauge: float, back_to_back: float) -> float:
        """How far the centred wheelset may move to the outside before the other flange's back meets the check rail [m];
        inf without one."""
        return float("inf") if self.check_rail is None else self.check_rail - (gauge - back_to_back) / 2
