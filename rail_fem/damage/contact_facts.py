"""What is kept of the patches of one pass over a crossing once their cells have been used."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rail_fem.damage.crossing import PassContacts
from rail_fem.damage.fatigue import shakedown_point
from rail_fem.damage.heat import flash_temperature
from rail_fem.damage.wear import Archard, to_cells


class ContactFacts(NamedTuple):
    """Of k patches, each (k,). body : 0 wing, 1 nose;  x, y, z of the patch [m];  angle [rad];  tgamma, power (friction
    work per metre), normal_force [N];  max_pressure [Pa];  load, traction, index : on the shakedown map;  flash :
    largest temperature [K];  enlarged : factor on its axes;  archard, seized : area per pass by the map's middle, and
    what of it comes from cells beyond the map's last border of pressure [m2]"""

    body: np.ndarray
    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    angle: np.ndarray
    tgamma: np.ndarray
    power: np.ndarray
    normal_force: np.ndarray
    max_pressure: np.ndarray
    load: np.ndarray
    traction: np.ndarray
    index: np.ndarray
    flash: np.ndarray
    enlarged: np.ndarray
    archard: np.ndarray
    seized: np.ndarray

    def of(self, body: int) -> ContactFacts:
        """Those of one body."""
        own = self.body == body
        return ContactFacts(*(values[own] for values in self))


def facts_of(contacts: PassContacts, hardness: float, shear_yield: float) -> ContactFacts:
    """Of solved patches. hardness of the rail and shear yield stress of its surface [Pa]"""
    if not len(contacts):
        nothing = dict.fromkeys(ContactFacts._fields, np.zeros(0))
        return ContactFacts(**nothing)._replace(body=np.zeros(0, int))
    law, patches, speed = Archard(hardness), contacts.patches, contacts.speed
    x, y, z = contacts.position.T
    point = shakedown_point(patches, shear_yield)
    depth = law.cells(patches, speed) * to_cells(patches.grid.dy)
    seized = np.where(law.seized(patches), depth, 0.0)
    return ContactFacts(
        contacts.body,
        x,
        y,
        z,
        contacts.angle,
        contacts.tgamma,
        patches.frictional_power,
        patches.normal_force,
        patches.max_pressure,
        point.load,
        point.traction,
        point.index,
        flash_temperature(patches, speed).max(axis=(1, 2)),
        contacts.enlarged,
        depth.sum(axis=(1, 2)),
        seized.sum(axis=(1, 2)),
    )
