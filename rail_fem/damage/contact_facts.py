"""What is kept of the patches of one pass once their cells have been used."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from rail_fem.damage.crossing import PassContacts
from rail_fem.damage.fatigue import shakedown_point
from rail_fem.damage.heat import flash_temperature
from rail_fem.damage.rolling import RollingPoint
from rail_fem.damage.wear import Archard, Patches, to_cells
from rail_fem.settings.damage import DamageSettings


class ContactFacts(NamedTuple):
    """Of k patches, each (k,). body : 0 wing or a section, 1 nose;  x, y, z of the patch [m], x of a section 0;
    angle [rad];  tgamma [N];  enlarged : factor on its axes;  power (friction work per metre), normal_force [N];
    max_pressure [Pa];  load, traction, index : on the shakedown map;  flash : largest temperature [K];  archard,
    seized, bordering : area per pass by the map's middle, and what of it comes from cells beyond the map's last border
    of pressure, and near any border [m2]"""

    body: np.ndarray
    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    angle: np.ndarray
    tgamma: np.ndarray
    enlarged: np.ndarray
    power: np.ndarray
    normal_force: np.ndarray
    max_pressure: np.ndarray
    load: np.ndarray
    traction: np.ndarray
    index: np.ndarray
    flash: np.ndarray
    archard: np.ndarray
    seized: np.ndarray
    bordering: np.ndarray

    def of(self, body: int) -> ContactFacts:
        """Those of one body."""
        own = self.body == body
        return ContactFacts(*(values[own] for values in self))


def facts_of(contacts: PassContacts, settings: DamageSettings) -> ContactFacts:
    """Of solved patches, by the rail's hardness and the shear yield stress of its surface."""
    if not len(contacts):
        return facts_of_points((), settings)
    cells = _of_cells(contacts.patches, contacts.speed, settings)
    x, y, z = contacts.position.T
    return ContactFacts(contacts.body, x, y, z, contacts.angle, contacts.tgamma, contacts.enlarged, *cells)


def facts_of_points(points: Sequence[RollingPoint], settings: DamageSettings) -> ContactFacts:
    """Of points on a section; as of facts_of."""
    rows = [(0.0, 0.0, *p.position, p.angle, p.tgamma, 1.0, *_of_cells(p.patch, p.speed, settings)) for p in points]
    return ContactFacts(*np.array(rows, float).reshape(-1, len(ContactFacts._fields)).T)


def _of_cells(patches: Patches, speed: float, settings: DamageSettings) -> tuple[Any, ...]:
    """From `power` on."""
    law, point = Archard(settings.hardness), shakedown_point(patches, settings.shear_yield)
    depth = law.cells(patches, speed) * to_cells(patches.grid.dy)
    felt = patches.frictional_power, patches.normal_force, patches.max_pressure
    row = *felt, point.load, point.traction, point.index, flash_temperature(patches, speed).max(axis=(-2, -1))
    area = lambda cells: np.where(cells, depth, 0.0).sum(axis=(-2, -1))
    return *row, area(True), area(law.seized(patches)), area(law.near_border(patches, speed))
