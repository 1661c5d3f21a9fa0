"""How deep a rolling wheel indents a rail plastically: yield load and plastic compliance of a contact whose mean
pressure cannot exceed 3 yield stresses.

A fully plastic contact of a paraboloid with relative radii R_x, R_y has the area of their intersection, 2 pi sqrt(R_x
R_y) times the depth, and the mean pressure 3 Y(strain) with the representative strain 0.2 b / R_b of the narrower
direction. The indentation lies in series with the elastic approach and begins where Hertz' mean pressure reaches 3 Y.
As the wheel always meets fresh material, the depth follows the force up and down.
Source: Tabor, The Hardness of Metals (1951); K. L. Johnson, Contact Mechanics (1985), sections 6.2 and 6.3.
Error: an order-of-magnitude theory. At the nose of the reference pass, 200 kN: approach 0.64 mm against 0.63 mm of
fe_full at 2 mm.
"""

import numpy as np

from rail_fem.light.contact_table import ContactTable, patch_sizes
from rail_fem.light.vertical_dynamics import ContactLaw
from rail_fem.light.vertical_pass import Contacts
from rail_fem.scene.scene import Scene
from rail_fem.scene.steel import Steel
from rail_fem.settings.light import IndentationSettings

FULL = 3.0  # mean pressure over yield stress of a fully plastic contact
STRAIN = 0.2  # representative strain over contact half-width / radius
NEVER = 1e15  # force of an indentation that does not begin [N]
ROUNDS = 20  # of strain and depth; each round shrinks the error at least by half


def contacts_of(scene: Scene, settings: IndentationSettings, table: ContactTable) -> Contacts:
    """The contact law along the path, with plastic indentation where the steel yields and the settings want them."""
    if not settings.plastic_indentation:
        return lambda x: ContactLaw(table.height_at(x), table.between(x, table.stiffness))
    yield_load, plastic_compliance = plastic_indentation(
        table, (scene.materials.wing.steel(), scene.materials.nose.steel()), scene.static_wheel_load
    )
    return lambda x: ContactLaw(
        *(
            table.height_at(x),
            *(table.between(x, values) for values in (table.stiffness, yield_load, plastic_compliance)),
        )
    )


def plastic_indentation(table: ContactTable, steels: tuple[Steel, Steel], load: float) -> tuple[np.ndarray, np.ndarray]:
    """Force at which plastic indentation begins (2, n) [N] and its depth per force above (2, n) [m/N]; 0 where the
    steel is elastic.

    load : vertical force at which the strain is taken [N]; hardening is weak enough for one
    """
    parts = [_indentation_of(table, b, steel, load) for b, steel in enumerate(steels)]
    return np.stack([p[0] for p in parts]), np.stack([p[1] for p in parts])


def _indentation_of(table: ContactTable, body: int, steel: Steel, load: float) -> tuple[np.ndarray, np.ndarray]:
    n = len(table.x)
    reached = table.stiffness[body] > 0
    if steel.is_elastic or not reached.any():
        return np.full(n, NEVER), np.zeros(n)
    radii, cosine = table.radii[body][reached], np.cos(table.angle[body][reached])
    area, depth = 2 * np.pi * np.sqrt(radii.prod(axis=1)), np.full(len(radii), 1e-4)
    for _ in range(ROUNDS):
        strain = STRAIN * np.sqrt(2 * depth / radii.min(axis=1))
        pressure = FULL * steel.yield_stress(strain)
        depth = load / cosine / (area * pressure)
    sizes = patch_sizes(load / cosine, radii, table.modulus[body])
    elastic = load / cosine / (np.pi * sizes.prod(axis=1))
    yield_load, plastic_compliance = np.full(n, NEVER), np.zeros(n)
    yield_load[reached] = load * (pressure / elastic) ** 3
    plastic_compliance[reached] = 1 / (area * pressure * cosine**2)
    return yield_load, plastic_compliance
