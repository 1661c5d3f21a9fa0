"""What holds a wheelset across the track beside the crossing itself: check rail on the other flange's back, and
the other wheel's creep on its rail.

The other wheel is not meshed: its normal force and the inclination of its contact are those of the start's equilibrium
(rail_fem.passes.lateral_start), its creep force follows the wheelset's lateral velocity by the light models' law. The
wheelset moves across without rolling about the track.
"""

from __future__ import annotations

from dataclasses import dataclass

from rail_fem.fe.supports import RigidGroup
from rail_fem.passes.lateral_start import LateralStart
from rail_fem.passes.wheelset_dynamics import friction_share


@dataclass
class LateralGuide:
    """Forces on the axle along y, in the manner of rail_fem.fe.supports.Link; `dissipated` so far [J]."""

    axle: RigidGroup
    start: LateralStart
    speed: float  # V > 0 [m/s]
    friction: float
    dissipated: float = 0.0

    STATE = ("dissipated",)

    def across(self) -> float:
        """Lateral position of the wheelset, + towards the crossing's field side [m]."""
        return self.start.across + float(self.axle.displacement[1])

    def check_force(self) -> float:
        """Of the check rail, >= 0, towards -y [N]."""
        return self.start.check_stiffness * max(self.across() - self.start.clearance, 0.0)

    def spring_force(self) -> float:
        """Of the check rail on the axle along y [N]."""
        return -self.check_force()

    def spring_energy(self) -> float:
        """In the check rail [J]."""
        return 0.5 * self.start.check_stiffness * max(self.across() - self.start.clearance, 0.0) ** 2

    def spring_power(self) -> float:
        """Power of the check rail on the axle [W]."""
        return self.spring_force() * float(self.axle.velocity[1])

    def creep_force(self) -> float:
        """Of the other wheel's rail on the axle along y [N]."""
        s = self.start
        if self.friction <= 0 or s.other_force <= 0:
            return 0.0
        along = -s.creep[0] * s.creep_along
        aside = -s.creep[1] * (float(self.axle.velocity[1]) / self.speed - s.heading)
        return float(friction_share(along, aside, self.friction, s.other_force)) * aside

    def book(self, force: float, old: float, dt: float) -> None:
        """Add the work that a creep force [N] took from the axle in a step from lateral velocity `old` [m/s]."""
        self.dissipated -= dt * force * 0.5 * (old + float(self.axle.velocity[1]))
