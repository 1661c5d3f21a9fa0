"""How deep a rolling wheel indents a rail plastically: two laws of yield load, plastic compliance and lag.

Rolled (the default): the indentation over the elastic approach is RATE (q - ONSET), q Hertz' mean pressure over the
yield stress at Tabor's representative strain, 0.2 b / R_b of the narrower direction, and follows the force over LAG
semi-axes of the patch along the rail: it takes some rolling to deepen, and a wheel that is unloaded still runs in what
it has pressed.
Source: forces that rise and fall, rolled over the elastoplastic half-space (bem.plastic) by ellipsoids with the radii
of a worn wing, a/b = 2.4 and 3.5, q = 2.3 to 3.5, Mn13: 1 % of the largest indentation (docs/models/light.md has the
table; one case is in tests/rail_fem/test_rolled_indentation.py). Error: a circular patch is indented by a fifth less;
beyond q = 5 and on rounded corners it is extrapolated.

Fully plastic (Tabor): the mean pressure cannot exceed 3 yield stresses. A fully plastic contact of a paraboloid with
relative radii R_x, R_y has the area of their intersection, 2 pi sqrt(R_x R_y) times the depth, and the mean pressure
3 Y(strain) at the representative strain above. The indentation lies in series with the elastic approach and begins
where Hertz' mean pressure reaches 3 Y. As the wheel always meets fresh material, the depth follows the force up and
down.
Source: Tabor, The Hardness of Metals (1951); K. L. Johnson, Contact Mechanics (1985), sections 6.2 and 6.3.
Error: an order-of-magnitude theory. At the nose of the reference pass, 200 kN: approach 0.64 mm against 0.63 mm of
fe_full at 2 mm.
"""

import functools
from dataclasses import replace

import numpy as np

from rail_fem.contact.contact_law import ContactLaw
from rail_fem.contact.contact_table import HEAVY, ContactTable, hertz_constants, patch_sizes
from rail_fem.passes.vertical_pass import Contacts
from rail_fem.scene.scene import Scene
from rail_fem.scene.steel import Steel
from rail_fem.settings.light import IndentationSettings

FULL = 3.0  # mean pressure over yield stress of a fully plastic contact
STRAIN = 0.2  # representative strain over contact half-width / radius
# of the rolled law: indentation over elastic approach per pressure over yield stress beyond the onset; semi-axes
RATE, ONSET, LAG = 0.137, 1.65, 0.3
SHORTEST_LAG = 1e-9  # where nothing is indented [s]
LEAST = 1e-6  # indentation per force, over the elastic approach, under the static load
NEVER = 1e15  # force of an indentation that does not begin [N]
ROUNDS = 20  # of strain and depth; each round shrinks the error at least by half


def contacts_of(scene: Scene, settings: IndentationSettings, table: ContactTable) -> Contacts:
    """The contact law along the path, wing and nose, and where the settings see them their second contacts: a power law
    through the elastic approaches under the static load and HEAVY of them, with plastic indentation where the steel
    yields and the settings want them."""
    laws = [_contacts_of(scene, settings, one) for one in as_seen(table, settings).whole]
    return lambda x: functools.reduce(ContactLaw.beside, (law(x) for law in laws))


def _contacts_of(scene: Scene, settings: IndentationSettings, table: ContactTable) -> Contacts:
    steels, load = (scene.materials.wing.steel(), scene.materials.nose.steel()), scene.static_wheel_load
    exponent, rolled = elastic_law(table, load)[1], settings.indentation_law == "rolled"
    none = np.zeros(exponent.shape)
    if not settings.plastic_indentation:
        found = none, none, none
    elif rolled:
        found = rolled_indentation(table, steels, load, scene.speed, settings.contact_law == "two loads")
    else:
        found, exponent = (*plastic_indentation(table, steels, load), none), np.full(exponent.shape, 1.5)

    def law(x: np.ndarray) -> ContactLaw:
        yield_load, compliance, lag = (table.between(x, values) for values in found)
        hertz, power = np.maximum(table.between(x, table.stiffness), 1.0), table.between(x, exponent)  # 1: out of reach
        relief = compliance * np.cbrt(yield_load) * hertz ** (2 / 3) if rolled else 0.0
        stiffness = load * (hertz / load) ** (power / 1.5)  # through the approach under the static load
        return ContactLaw(table.height_at(x), stiffness, power, 0.0 if rolled else yield_load, compliance, relief, lag)

    return law


def as_seen(table: ContactTable, settings: IndentationSettings) -> ContactTable:
    """The table with the paraboloids that the settings' contact law takes under HEAVY static loads, and the second
    contacts of a wheel that only moves up and down, where it takes them."""
    if settings.contact_law == "static load":
        return replace(table, heavy_radii=table.radii, second=None)
    vertical = getattr(settings, "degrees_of_freedom", "vertical") == "vertical"
    return table if vertical else replace(table, second=None)


def elastic_law(table: ContactTable, load: float) -> tuple[np.ndarray, np.ndarray]:
    """Elastic approach under the static load [N] (2, n) [m], and the exponent of F = K d^exponent (2, n) that leads to
    the one under HEAVY of them; out of reach any."""
    approach, exponent = np.full(table.stiffness.shape, 1e-4), np.full(table.stiffness.shape, 1.5)
    for body, modulus in enumerate(table.modulus):
        near = table.stiffness[body] > 0
        approach[body, near] = (load / table.stiffness[body, near]) ** (2 / 3)
        softer = hertz_constants(table.radii[body, near], modulus) / hertz_constants(
            table.heavy_radii[body, near], modulus
        )
        exponent[body, near] = np.log(HEAVY) / np.log((HEAVY * softer) ** (2 / 3))
    return approach, exponent


def rolled_indentation(
    table: ContactTable, steels: tuple[Steel, Steel], load: float, speed: float, grown: bool = False
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Force Y at which plastic indentation begins (2, n) [N], its depth per force C (2, n) [m/N], 0 where the steel is
    elastic, and the time in which it follows the force (2, n) [s]: p = C (F - Y^(1/3) stiffness^(2/3) e) meets the law
    under the static load [N] and HEAVY of them; Y < 0 where a contact grows flatter and is indented from the first.

    The yield stress is that at the strain under the static load. The lag is LAG semi-axes of the patch under that load,
    or grown : of the one under HEAVY of them, as long as approach and indentation make it (the root of their sum over
    the approach): in the half-space that LAG is from, under a half more
    than its mean, that is a fifth more.
    """
    approach, exponent = elastic_law(table, load)
    yield_load, compliance = np.full(approach.shape, NEVER), np.zeros(approach.shape)
    lag = np.full(approach.shape, SHORTEST_LAG)
    for body, steel in enumerate(steels):
        near = table.stiffness[body] > 0
        if steel.is_elastic or not near.any():
            continue
        light, normal = approach[body, near], load / np.cos(table.angle[body, near])
        heavy = light * HEAVY ** (1 / exponent[body, near])
        sizes, wider = (
            patch_sizes(force, radii[body, near], table.modulus[body])
            for force, radii in ((normal, table.radii), (HEAVY * normal, table.heavy_radii))
        )
        pressure = pressure_over_yield(normal, table.radii[body, near], sizes, steel)
        first = RATE * (pressure - ONSET) * light
        second = RATE * (pressure * HEAVY * sizes.prod(axis=1) / wider.prod(axis=1) - ONSET) * heavy
        share = (second - HEAVY * first) / (HEAVY * light - heavy)
        per_force = np.maximum(first + share * light, LEAST * light)  # times the static load
        compliance[body, near] = per_force / load
        yield_load[body, near] = load * ((per_force - first) / per_force) ** 3
        along = wider[:, 0] * np.sqrt(1 + np.maximum(second, 0) / heavy) if grown else sizes[:, 0]
        lag[body, near] = np.maximum(LAG * along / speed, SHORTEST_LAG)
    return yield_load, compliance, lag


def pressure_over_yield(normal: np.ndarray, radii: np.ndarray, sizes: np.ndarray, steel: Steel) -> np.ndarray:
    """Hertz' mean pressure (m,) over the yield stress at Tabor's representative strain, of normal forces (m,) [N] on
    patches of relative radii (m, 2) [m] and semi-axes (m, 2) [m]."""
    strain = STRAIN * sizes.min(axis=1) / radii.min(axis=1)
    return normal / (np.pi * sizes.prod(axis=1)) / steel.yield_stress(strain)


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
