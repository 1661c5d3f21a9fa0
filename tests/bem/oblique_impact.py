"""A solid elastic sphere that strikes a half-space of its own steel at an angle, with friction and without spin.


Waves are left out: at every instant pressure is Hertz', and bem.halfspace marches the tangential contact from shift to
shift. Velocities of the point of contact along the face, over the normal one, in the numbers psi of Maw, Barber and
Fawcett, Wear 38 (1976) 101 (not looked at; defined here): psi = 2 (1 - nu) / (2 - nu) v / (mu v_normal), before and
after. What the springs share with the cells is the motion of the sphere alone. Closed, from momentum and from when
sliding begins and ends (tests/bem/test_oblique_impact.py): psi_after = psi - slide, slide = 14 (1 - nu) / (2 - nu),
from psi = slide - 1 on; sticking at the start below psi = 1.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bem.halfspace.tangential import shift_contact
from bem.material import Elastic, Pair
from bem.patch import Creepage, Grid, Patch

RADIUS, DENSITY, FRICTION, NORMAL_VELOCITY = 0.1, 7850.0, 0.3, 0.01  # [m], [kg/m^3], [1], [m/s]
LOOSENESS = 3.5  # 1 + R^2 / k^2 of a solid sphere: how much faster its surface is than a mass, by the same force
HERTZ_TIME = 2.943  # of contact, times largest approach over velocity; the march ends where the bodies part

TangentialForce = Callable[[float, float], float]  # approach of this instant [m], shift since the last [m] -> [N]


@dataclass(frozen=True)
class ObliqueImpact:
    """The sphere and its steel. friction, normal velocity, radius and density drop out of psi (a test)."""

    poisson: float = 0.3
    friction: float = FRICTION
    velocity: float = NORMAL_VELOCITY

    @property
    def steel(self) -> Elastic:
        """Of the sphere and of what it strikes."""
        return Elastic(210e9, self.poisson)

    @property
    def pair(self) -> Pair:
        """Both bodies together."""
        return Pair.of(self.steel, self.steel)

    @property
    def mass(self) -> float:
        """[kg]"""
        return 4 / 3 * np.pi * RADIUS**3 * DENSITY

    @property
    def largest_approach(self) -> float:
        """Hertz' [m]: kinetic energy is 8/15 E* R^1/2 approach^5/2."""
        return float((15 / 16 * self.mass * self.velocity**2 / self.pair.modulus / np.sqrt(RADIUS)) ** 0.4)

    @property
    def unit(self) -> float:
        """Tangential velocity [m/s] of psi = 1."""
        nu = self.pair.poisson
        return self.friction * self.velocity * (2 - nu) / (2 * (1 - nu))

    @property
    def slide(self) -> float:
        """What psi loses where all slides all the time: friction times the whole normal impulse."""
        nu = self.pair.poisson
        return 4 * LOOSENESS * (1 - nu) / (2 - nu)


def rebound(impact: ObliqueImpact, psi: float, force: TangentialForce, steps: int) -> float:
    """psi after the impact, by the leapfrog method with so many steps in Hertz' time of contact; second order."""
    step = HERTZ_TIME * impact.largest_approach / impact.velocity / steps
    approach, down, along = 0.0, impact.velocity, psi * impact.unit
    while True:
        approach += step * down
        if approach <= 0:
            return along / impact.unit
        hertz = 4 / 3 * impact.pair.modulus * np.sqrt(RADIUS) * approach**1.5
        down -= step * hertz / impact.mass
        along += step * LOOSENESS * force(approach, step * along) / impact.mass


class SlidingCells:
    """Tangential force on the sphere by bem.halfspace, on a grid of so many cells over the largest contact."""

    def __init__(self, impact: ObliqueImpact, across: int) -> None:
        self.impact = impact
        self.before: Patch | None = None
        half = 1.02 * np.sqrt(RADIUS * impact.largest_approach)
        self.grid = Grid.over((-half, half), (-half, half), across, across)
        x, y = self.grid.points()
        self.square = x**2 + y**2

    def __call__(self, approach: float, shift: float) -> float:
        impact, modulus = self.impact, self.impact.pair.modulus
        radius = np.sqrt(RADIUS * approach)
        pressure = np.sqrt(np.maximum(1 - self.square / radius**2, 0.0))
        load = 4 / 3 * modulus * radius**3 / RADIUS
        if not pressure.any():  # smaller than a cell
            return 0.0
        pressure *= load / (pressure.sum() * self.grid.cell_area)
        patch = Patch(self.grid, None, pressure, approach, "Hertz")
        after = shift_contact(
            patch, impact.steel, impact.steel, impact.friction, Creepage(shift), previous=self.before, estimate=False,
            tolerance=1e-4,
        )  # fmt: skip
        self.before = after
        return float(after.tangential_force[0])


class SlidingSprings:
    """The same by a row of springs that stick and slide each for itself: normal stiffness E* and tangential stiffness
    2 E* (1 - nu) / (2 - nu) a length, under the profile x^2 / R. The row has the forces of the sphere in Cattaneo's and
    Mindlin's theory on any path (Popov and Hess, Method of Dimensionality Reduction in Contact Mechanics and Friction,
    2015, from memory; tests hold it to Cattaneo's closed form)."""

    def __init__(self, impact: ObliqueImpact, count: int) -> None:
        half, nu = np.sqrt(RADIUS * impact.largest_approach), impact.pair.poisson
        self.length = half / count
        self.profile = ((np.arange(count) + 0.5) * self.length) ** 2 / RADIUS
        self.normal = impact.pair.modulus
        self.along = self.normal * 2 * (1 - nu) / (2 - nu)
        self.friction, self.stretch = impact.friction, np.zeros(count)

    def __call__(self, approach: float, shift: float) -> float:
        most = self.friction * self.normal / self.along * np.maximum(approach - self.profile, 0.0)
        self.stretch = np.clip(self.stretch + shift, -most, most)
        return float(-2 * self.along * self.length * self.stretch.sum())
