"""Plane contact of a yielding body by static finite elements: the judge of bem/plane_plastic.

The bodies, elements and mortar contact are those of plane_strain.py and plane_contact.py; J2 plasticity at the three
Gauss points of each triangle. The plastic strain acts as initial stress on the elastic stiffness, and strain, contact
and plastic strain are brought to agree by Anderson's mixing.
Error: second order in the element (rail_fem/studies/plane_plastic.py shows two sizes).
"""

from dataclasses import dataclass

import numpy as np

from bem.plane.body import Body
from bem.plastic.mixing import Mixing
from bem.steel.deviator import equivalent_stress
from bem.steel.hardening import Hardening
from rail_fem.static_fe.plane_contact import PressedBodies
from rail_fem.static_fe.plane_strain import Fineness
from rail_fem.static_fe.small_strain import SmallStrainError

_MOST_TURNS = 400


@dataclass
class PlasticPlaneStep:
    """Gauss points (p, 2) [m] of the fixed body, triangle by triangle; von Mises stress (p,) [Pa] and plastic strain
    (p,) there; x, pressure (n,) of the contact [m, Pa]; approach [m]."""

    points: np.ndarray
    von_mises: np.ndarray
    peeq: np.ndarray
    x: np.ndarray
    pressure: np.ndarray
    approach: float


class PlasticPlaneContact:
    """The fixed body yields, the moving one is elastic; the upper is pressed down by loads one after the other."""

    def __init__(
        self, fixed: Body, moving: Body, fineness: Fineness, window: tuple[float, float], hardening: Hardening
    ) -> None:
        self.pressed = PressedBodies.build(fixed, moving, fineness, window, hardening)
        self.plastic, self.steps = self.pressed.below.virgin(), list[PlasticPlaneStep]()

    def go_to(self, load: float, tolerance: float = 1e-5) -> PlasticPlaneStep:
        """load : downward force [N/m]; tolerance : of plastic stress over yield stress."""
        pressed, body = self.pressed, self.pressed.below
        twice, limit = 2 * body.elastic.shear, np.sqrt(2 / 3) * body.hardening.first_yield
        mixing, stress = Mixing(depth=10), twice * self.plastic.strain
        for _ in range(_MOST_TURNS):
            moved = body.displacement(body.force(stress)[:, None])[:, 0]
            pressure, approach = pressed.solve(load, moved)
            answer = body.respond(pressed.yielded @ pressure + moved, self.plastic)
            found = twice * answer.plastic.strain
            if np.sqrt(((found - stress) ** 2).sum(axis=1)).max() <= tolerance * limit:
                self.plastic = answer.plastic
                step = PlasticPlaneStep(
                    body.points.reshape(-1, 2), equivalent_stress(answer.stress).ravel(), answer.plastic.peeq.ravel(),
                    pressed.x, pressure, approach,
                )  # fmt: skip
                self.steps.append(step)
                return step
            stress = mixing(stress, found)
        raise SmallStrainError(f"load {load:g} N/m: no equilibrium after {_MOST_TURNS} turns: take smaller steps")
