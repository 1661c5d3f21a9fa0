"""The largest force of a pass, and whether the wheel lands with it: how far it flew before, how fast it came down, and
what Hertz' impact of two free masses at that speed would give.

A wheel thrown up by the nose lands on it again while the track swings back up: the two meet with the sum of their
speeds. Closed form of the impact: m v^2 / 2 = 2/5 K d^2.5 with the reduced mass m of wheel and track, so that
F = (5/4 m v^2)^(3/5) K^(2/5). Weight, the suspension and stiffness that grows along the contact add to it, plastic
indentation takes off.
Source: K. L. Johnson, Contact Mechanics (1985), section 11.4.
"""

from typing import NamedTuple

import numpy as np

from rail_fem.contact.contact_table import ContactTable
from rail_fem.passes.vertical_dynamics import TRACK, WHEEL
from rail_fem.passes.vertical_pass import LightPass
from rail_fem.result.events import FALL, first_maximum, lost_contact


class LargestImpact(NamedTuple):
    """body : 0 wing, 1 nose;  x : where [m];  force [N];  flight : distance without contact that ended in this contact,
    0: none [m];  speed : of approach as it lands, wheel against track [m/s], NaN without a flight;  free : force of the
    free masses' impact at that speed [N], NaN without"""

    body: int
    x: float
    force: float
    flight: float
    speed: float
    free: float


def impact_force(mass: float, speed: float, stiffness: float) -> float:
    """Largest force [N] of a mass [kg] that meets a Hertz spring [N/m^1.5] at a speed [m/s]."""
    return float((1.25 * mass * speed**2) ** 0.6 * stiffness**0.4)


def largest_impact(light: LightPass, table: ContactTable, static_load: float) -> LargestImpact:
    """Of a finished pass over the contacts of a table. static_load [N]"""
    body, row = (int(k) for k in np.unravel_index(int(np.argmax(light.force)), light.force.shape))
    total, found = light.force.sum(axis=0), (body, float(light.x[row]), float(light.force[body, row]))
    losses = [loss for loss in lost_contact(light.time, light.x, total, static_load) if loss.end < light.time[row]]
    landing = int(np.searchsorted(light.time, losses[-1].end, side="right")) if losses else 0
    if not losses or landing + first_maximum(total[landing:], FALL * static_load) < row:
        return LargestImpact(*found, 0.0, np.nan, np.nan)
    wheel, track = light.motion.velocity[landing][[WHEEL, TRACK]]
    speed = float(abs(wheel - track - path_speed(light, table, landing, body)))
    mass = 1 / (1 / light.masses.mass[WHEEL] + 1 / light.masses.mass[TRACK])
    stiffness = float(np.interp(light.x[row], table.x, table.stiffness[body]))
    return LargestImpact(*found, losses[-1].length, speed, impact_force(mass, speed, stiffness))


def path_speed(light: LightPass, table: ContactTable, row: int, body: int) -> float:
    """How fast the height at which the wheel comes into contact changes under it [m/s]."""
    slope = float(np.interp(light.x[row], table.x, table.slope[body]))
    return slope * float(light.x[row] - light.x[row - 1]) / light.step
