"""What the surfaces say about contact along a crossing: for wing and nose, how high a wheel stands on it, where it
touches, how stiff it is.

Each contact is the paraboloid whose intersection with a plane, as deep as the virtual penetration of Kik and Piotrowski
(0.55 of the elastic approach), has the length, width and area of the intersection of the true surfaces there. So edges
and corners count by what they carry, and where the gap is no paraboloid the paraboloid is another under another force:
it is taken under the static load and under three of them. Its centre is that of the pressure. Where the intersection
is no ellipse about the contact point, Hertz' theory is a guess: `asymmetry`.
Source: Piotrowski and Kik, Vehicle Syst. Dyn. 46 (2008) 27 (idea of virtual penetration).
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bem.exact.hertz import contact_stiffness, point_contact
from bem.material import Elastic, contact_modulus
from geometry.axes import tread_datum_y
from geometry.hermite import cubic_between
from geometry.path.wheel_path import WheelPath, other_contacts, wheel_path
from geometry.profiles.profile import Profile, hermite_many
from geometry.surfaces.bodies import BODIES
from kernel_cache import working_time
from rail_fem.contact.intersection import equivalent_paraboloid, gaps_about, gaps_at
from rail_fem.scene.scene import Scene

if TYPE_CHECKING:
    from geometry.surfaces.any_crossing import AnyCrossing

HEAVY = 3.0  # second load of each contact over the static one: landings press with 2 to 4
VIRTUAL = 0.55  # virtual penetration over approach
FIRST_DEPTH = 50e-6  # of the first intersection [m]
DEPTHS = (5e-6, 300e-6)  # at least and at most [m]
ROUNDS, HEAVY_ROUNDS = 4, 3  # of intersection and depth
REACH = (14e-3, 18e-3)  # half length and half width of the position that is looked at [m]
SAMPLES = (25, 49)  # along and across, denser in the middle
HIDDEN = 1.5e-3  # what lies this far below the wheel's rigid path carries nothing [m]
# how far the gap opens between two contacts of a body, at ACROSS of their distance, or they are one [m]
VALLEY, ACROSS = 0.1e-3, np.linspace(0, 1, 21)


# of a table, with a row for each body
BY_BODY = ("height", "slope", "point", "stiffness", "radii", "heavy_radii", "angle", "centre", "asymmetry")


@dataclass(frozen=True)
class ContactTable:
    """Contacts of a scene's wheel with wing and nose (b = 0, 1) at axle positions x (n,) [m].

    height    : (2, n)    axle height, relative to plain line, at which the wheel comes into contact with the body [m];
        -inf out of reach
    slope     : (2, n)    its derivative to x [1]
    point     : (2, n, 3) where they are in contact [m]
    stiffness : (2, n)    K of F = K d^1.5, vertical force over vertical approach [N/m^1.5]; 0 out of reach
    radii     : (2, n, 2) relative radii along and across the rail [m], and
    heavy_radii : under HEAVY static loads
    angle     : (2, n)    slope angle of the surfaces there, across the track [rad]; > 0 rises towards the field side
    centre    : (2, n)    the patch's centre of pressure, from the contact point along the tangent across the rail [m]
    asymmetry : (2, n)    distance of the intersection's middle over its half-width [1]
    transfers : (k,)      x where a rigid wheel changes body [m]
    modulus   : E* of wheel and each body [Pa]
    datum     : y of the wheel's tread datum [m]
    search_time : what finding it cost, also where it was kept from another scene [s]
    second : where the wheel comes near the same bodies once more, beside: a table with rows as this; None: nowhere
    """

    x: np.ndarray
    height: np.ndarray
    slope: np.ndarray
    point: np.ndarray
    stiffness: np.ndarray
    radii: np.ndarray
    heavy_radii: np.ndarray
    angle: np.ndarray
    centre: np.ndarray
    asymmetry: np.ndarray
    transfers: np.ndarray
    modulus: tuple[float, float]
    datum: float
    search_time: float = 0.0
    second: ContactTable | None = None

    @property
    def whole(self) -> tuple[ContactTable, ...]:
        """This table and the one of second contacts."""
        return (self,) if self.second is None else (self, self.second)

    def height_at(self, x: np.ndarray) -> np.ndarray:
        """(2, m) heights at x (m,) [m]: cubic Hermite between the table's positions, -inf where one of the two is out
        of reach."""
        return np.stack([_hermite(x, self.x, h, s) for h, s in zip(self.height, self.slope)])

    def between(self, x: np.ndarray, values: np.ndarray) -> np.ndarray:
        """(2, m) values (2, n) of the table at x (m,), linear between its positions."""
        return np.stack([np.interp(x, self.x, row) for row in values])

    def nearest(self, x: np.ndarray) -> np.ndarray:
        """(m,) index of the table's position nearest to x."""
        return np.clip(np.rint((np.asarray(x) - self.x[0]) / (self.x[1] - self.x[0])).astype(int), 0, len(self.x) - 1)

    def touching(self, body: int, x: float) -> int:
        """Index of the table's position nearest to x where the wheel comes into contact with a body. Errors: ValueError
        where there is none."""
        touched = np.flatnonzero(np.isfinite(self.point[body, :, 0]))
        return int(touched[np.argmin(np.abs(self.x[touched] - x))])

    def semi_axes(self, body: int, index: int, force: float) -> np.ndarray:
        """(2,) along and across the rail of the Hertz ellipse under a normal force [N] at a position of the table
        [m]."""
        return patch_sizes(np.array([force]), self.radii[body, index : index + 1], self.modulus[body])[0]

    def carrier(self, x: float) -> tuple[int, int]:
        """Which body (of BODIES) a rigid wheel at x stands on, and the index of the table's nearest position."""
        i = int(self.nearest(x))
        return int(np.argmax(self.height[:, i])), i


def every_second(table: ContactTable) -> ContactTable:
    """The same table at twice the spacing (both ends kept when their number is odd)."""
    keep = np.unique(np.r_[np.arange(0, len(table.x), 2), len(table.x) - 1])
    second = None if table.second is None else every_second(table.second)
    rows = {name: getattr(table, name)[:, keep] for name in BY_BODY}
    return replace(table, x=table.x[keep], second=second, **rows)


def _hermite(at: np.ndarray, x: np.ndarray, height: np.ndarray, slope: np.ndarray) -> np.ndarray:
    i = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
    width = x[i + 1] - x[i]
    known = np.isfinite(height[i]) & np.isfinite(height[i + 1])
    low, high = np.where(known, height[i], 0.0), np.where(known, height[i + 1], 0.0)
    found = cubic_between((at - x[i]) / width, width, low, high, slope[i], slope[i + 1])
    return np.where(known, found.value, -np.inf)


class TableKey(NamedTuple):
    """All that a table depends on. steels : of wing, nose and wheel;  datum : y of the wheel's tread
    datum [m]"""

    crossing: AnyCrossing
    wheel: Profile
    radius: float
    datum: float
    low: float
    high: float
    spacing: float
    steels: tuple[Elastic, ...]
    load: float


def table_key(scene: Scene, start: float, end: float, spacing: float, shift: float = 0.0) -> TableKey:
    """What the table of a scene depends on; arguments as of contact_table."""
    steels = tuple(steel.elastic for steel in scene.materials.steels())
    (low, high), wheel, datum = sorted((start, end)), scene.wheel, scene.wheel_datum_y + shift
    rolls = scene.crossing.surface, wheel.shape, wheel.radius, datum
    return TableKey(*rolls, low, high, spacing, steels, scene.static_wheel_load)


def contact_table(scene: Scene, start: float, end: float, spacing: float, shift: float = 0.0) -> ContactTable:
    """The table between start and end [m], in either order, every `spacing` [m] or a little less, for a wheel that is
    moved by `shift` towards its field side [m]; heights are relative to plain line with the same shift.

    Kept for scenes that differ in speed or foundation only: the search takes a second or more.
    Errors: CrossingError where the modelled crossing ends.
    """
    return table_of(table_key(scene, start, end, spacing, shift))


@functools.lru_cache(maxsize=32)
def _path(
    crossing: AnyCrossing, wheel: Profile, radius, datum, low, high, spacing, within=np.inf
) -> tuple[WheelPath, float]:
    """Rigid path and the time that it took [s]."""
    started = working_time()
    x = np.linspace(low, high, max(2, int(np.ceil((high - low) / spacing - 1e-9))) + 1)
    path = wheel_path(wheel, crossing, x, radius, datum - tread_datum_y(), within=within)
    return path, working_time() - started


@functools.lru_cache(maxsize=64)
def table_of(key: TableKey) -> ContactTable:
    """The table of a key. Errors: as contact_table."""
    return _tabled(key, *_path(*key[:7]))


def fresh_table(key: TableKey, within: float = np.inf) -> ContactTable:
    """As table_of, but kept nowhere: of a crossing that will never be seen again; a body that stands more than `within`
    [m] below the one that carries is out of reach. Errors: as contact_table."""
    return _tabled(key, *_path.__wrapped__(*key[:7], within))


def _tabled(key: TableKey, path: WheelPath, search_time: float) -> ContactTable:
    started = working_time()
    wing, nose, own = key.steels
    moduli = contact_modulus(wing, own), contact_modulus(nose, own)
    points, gaps = np.stack([path.wing_point, path.nose_point]), np.stack([path.wing_gap, path.nose_gap])
    other_gaps, others = (
        np.stack(found) for found in zip(*(_second_contacts(key, path, b, points[b]) for b in (0, 1)))
    )

    def rows(gap: np.ndarray, point: np.ndarray, second: ContactTable | None) -> ContactTable:
        parts = [_contacts(key, b, path, point[b], moduli[b]) for b in (0, 1)]
        found = {name: np.stack([part[name] for part in parts]) for name in BY_BODY if name not in ("height", "point")}
        height = np.where(np.isfinite(gap) & np.isfinite(point[..., 0]), path.height - gap, -np.inf)
        took = search_time + working_time() - started
        return ContactTable(
            x=path.x,
            height=height,
            point=point,
            **found,
            transfers=path.transfers,
            modulus=moduli,
            datum=key.datum,
            search_time=took,
            second=second,
        )

    second = rows(other_gaps, others, None) if np.isfinite(others).any() else None
    return rows(gaps, points, second)


def _second_contacts(key: TableKey, path: WheelPath, body: int, first: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gap (n,) and point (n, 3) [m] of second contacts on one body, beside its first (n, 3); NaN where there are none,
    or only the other end of the patch of the first, as a cone's on a plane."""
    gap, point = other_contacts(key.crossing, key.wheel, path, BODIES[body], HIDDEN, key.datum - tread_datum_y())
    found = np.flatnonzero(np.isfinite(gap))
    if len(found):
        at_x, at_y = (first[found, None, :2] + ACROSS[:, None] * (point[found] - first[found])[:, None, :2]).T
        between = surface_gap(key.crossing, key.wheel, body, path.x[found], at_x, at_y, key.radius, key.datum)
        one = found[between.max(axis=0) - np.maximum(between[0], between[-1]) < VALLEY]
        gap[one], point[one] = np.nan, np.nan
    return gap, point


def _contacts(key: TableKey, body: int, path: WheelPath, point: np.ndarray, modulus: float) -> dict:
    """Slope, curvatures and stiffness at the contact points (n, 3) of one body."""
    near = np.isfinite(point[:, 0])
    x, at = path.x[near], point[near]
    wheel = key.wheel.hermite_table()
    tread, tread_slope = hermite_many(at[:, 1] - key.datum, *wheel)
    rolling, ahead, angle = key.radius - tread, at[:, 0] - x, np.arctan(tread_slope)
    along, across = (
        reach * np.sign(u) * np.abs(u) ** 1.5 for reach, u in zip(REACH, (np.linspace(-1, 1, k) for k in SAMPLES))
    )
    surfaces = wheel, BODIES[body] == "nose", *key.crossing.tables
    gap = gaps_about(x, at, along, across, np.cos(angle), key.radius, key.datum, *surfaces)
    sampled = gap, gap.min(axis=2), gap.min(axis=1), along, across
    virtual = lambda force, radii: np.clip(
        VIRTUAL * (force / np.cos(angle) / hertz_constants(radii, modulus)) ** (2 / 3), *DEPTHS
    )
    depth = np.full(len(x), FIRST_DEPTH)
    for _ in range(ROUNDS):
        radii, centre, asymmetry = equivalent_paraboloid(*sampled, depth)
        depth = virtual(key.load, radii)
    heavy = radii
    for _ in range(HEAVY_ROUNDS):
        heavy, _, _ = equivalent_paraboloid(*sampled, virtual(HEAVY * key.load, heavy))
    found = {
        "radii": radii,
        "heavy_radii": heavy,
        "slope": ahead / np.sqrt(rolling**2 - ahead**2),
        "angle": angle,
        "stiffness": hertz_constants(radii, modulus) * np.cos(angle) ** 2.5,
        "centre": centre,
        "asymmetry": asymmetry,
    }
    return {name: _placed(near, values) for name, values in found.items()}


def _placed(where: np.ndarray, values: np.ndarray) -> np.ndarray:
    into = np.zeros((len(where), *values.shape[1:]))
    into[where] = values
    return into


def surface_gap(
    crossing: AnyCrossing, wheel: Profile, body: int, x, at_x, at_y, radius: float, datum: float
) -> np.ndarray:
    """How far the wheel with its axle over x is above a body's surface at positions (at_x, at_y), up to a constant [m];
    inf without metal."""
    at = np.broadcast_arrays(x, at_x, at_y)
    x, at_x, at_y = (np.array(values, float).ravel() for values in at)
    rail = crossing.heights(at_x, at_y, BODIES[body])
    return gaps_at(x, at_x, at_y, rail, radius, datum, wheel.hermite_table()).reshape(at[0].shape)


@functools.lru_cache(maxsize=1)
def _unit_ellipses() -> tuple[np.ndarray, ...]:
    """Over the logarithm of the radii's ratio: K, long and short semi-axis for modulus 1, geometric mean radius 1,
    force 1."""
    log_ratio = np.linspace(0, np.log(1e5), 240)
    radii = [(np.exp(r / 2), np.exp(-r / 2)) for r in log_ratio]
    patches = [point_contact(1.0, *pair, 1.0) for pair in radii]
    axes = (np.array([getattr(p, name) for p in patches]) for name in ("semi_x", "semi_y"))
    return log_ratio, np.array([contact_stiffness(*pair, 1.0) for pair in radii]), *axes


def hertz_constants(radii: np.ndarray, modulus: float) -> np.ndarray:
    """K (n,) [N/m^1.5] of relative radii (n, 2) [m]; bem.exact.hertz tabulated, error 2e-5
    (tests/rail_fem/test_light_models.py)."""
    mean, ratio = np.sqrt(radii.prod(axis=1)), np.abs(np.log(radii[:, 0] / radii[:, 1]))
    table = _unit_ellipses()
    return modulus * np.sqrt(mean) * np.interp(ratio, table[0], table[1])


def patch_sizes(force: np.ndarray, radii: np.ndarray, modulus: float) -> np.ndarray:
    """Semi-axes (n, 2) [m] along and across the rail of the Hertz ellipse under force (n,) [N]."""
    mean, ratio = np.sqrt(radii.prod(axis=1)), np.log(radii[:, 0] / radii[:, 1])
    log_ratio, _, long, short = _unit_ellipses()
    scale = np.cbrt(force * mean / modulus)
    axes = (
        np.stack([np.interp(np.abs(ratio), log_ratio, long), np.interp(np.abs(ratio), log_ratio, short)], axis=1)
        * scale[:, None]
    )
    return np.where(ratio[:, None] >= 0, axes, axes[:, ::-1])
