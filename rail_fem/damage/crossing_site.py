"""A crossing that a population of wheels passes: what a mean pass wears off wing and nose, on the shape that they have
now.

Every kind of pass (wheel, speed, lateral position) runs anew over the worn surfaces: contacts by the search of
rigid_hertz, forces by its dynamics, patches and tractions at every position, wear by every law. The axle moves
vertically; its lateral position is the kind's own.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np

from bem.patch import Patch
from geometry.surfaces.any_crossing import AnyCrossing
from geometry.surfaces.bodies import BODIES, NO_METAL
from geometry.surfaces.depth_field import STEEPEST
from geometry.surfaces.worn_crossing import UnwornCrossing, WornCrossing
from rail_fem.contact.contact_law import ContactLaw
from rail_fem.contact.contact_table import ContactTable, fresh_table, patch_sizes, table_key
from rail_fem.damage.contact_facts import ContactFacts, facts_of
from rail_fem.damage.crossing import PassContacts, footprints, patch_options, table_contacts, wear_field
from rail_fem.damage.deposit import Footprints, deposit
from rail_fem.damage.evolution import Rate, Site
from rail_fem.damage.fatigue import fatigue_of
from rail_fem.damage.flowed_surface import passes_to_flow
from rail_fem.damage.groove import FlowLaw, Grooves, carried_beyond, groove_strips, grooves, mean_under
from rail_fem.damage.impacts import LargestImpact, largest_impact
from rail_fem.damage.reach import reach_of
from rail_fem.damage.wear import WearLaw, laws_of
from rail_fem.damage.wheel_wear import circumference, wheel_lines, wheel_wear
from rail_fem.damage.worn_surface import WornSurface
from rail_fem.passes.plastic_indentation import contacts_of
from rail_fem.passes.vertical_pass import LightPass, run_pass
from rail_fem.processes.pool import Pool, Workers
from rail_fem.result.events import transfer_position
from rail_fem.scene.scene import GRAVITY, Scene
from rail_fem.scene.units import show
from rail_fem.settings.damage import DamageSettings
from rail_fem.settings.light import RigidHertzSettings

LEAST_FLOW = 1e-6  # that steel has flowed, or it is virgin [m]
WITHIN = 3e-3  # below the body that carries, where the other is looked at: no wheel presses so deep [m]


@dataclass(frozen=True, eq=False)
class CrossingPass:
    """One kind of pass. shift : lateral position towards the field side [m];  weight : its share of all passes;
    by_load : the label says the axle load"""

    scene: Scene
    shift: float
    weight: float
    by_load: bool = False

    @property
    def label(self) -> str:
        """Wheel, axle load where the traffic has several, speed and lateral position."""
        aside = f", {self.shift * 1e3:+.1f} mm" if self.shift else ""
        load = f", {show(2 * self.scene.static_wheel_load / GRAVITY, 't', 3)}" if self.by_load else ""
        return f"{self.scene.wheel.name}{load} at {show(self.scene.speed, 'mph', 3)}{aside}"


@dataclass(frozen=True, eq=False)
class PassWear:
    """What one pass of a kind did. label : of the kind;  lines : (first, last + 1) of the n lines of the plan between
    which it wore;  depth : law -> (2, m, lines) [m];  removed : law -> [m3];  work (2, m, lines) [J/m2]
    crack (2, m, lines) : damage under its patches
    force : (2,) largest on wing and nose [N];  impact : the larger of them;  transfer : where the load changes over
    [m], NaN: nowhere;  hardest : patch of the largest normal force on wing and nose, None: carries nothing
    grooves : (2, 2, m, lines) depths [m] that it still presses into wing and nose, and the strains of that; empty where
    nothing flows
    wheel : (laws, 2, n) mean depth around its circumference that the wheel loses on wing and nose, over its profile [m]
    circumference : (n,) of the wheel there [m]"""

    label: str
    lines: tuple[int, int]
    depth: dict[str, np.ndarray]
    removed: dict[str, float]
    work: np.ndarray
    crack: np.ndarray
    facts: ContactFacts
    force: np.ndarray
    impact: LargestImpact
    transfer: float
    hardest: tuple[Patch | None, Patch | None]
    grooves: np.ndarray
    wheel: np.ndarray
    circumference: np.ndarray


@dataclass(frozen=True, eq=False)
class CrossingRate(Rate):
    """kinds : each (share, PassWear) without its fields but the depths;  grooves : (kinds, 2, 2, m, n) of each kind."""

    grooves: np.ndarray

    def depths_at(self, law: str, place: int) -> np.ndarray:
        """(kinds,) depths that a pass of each wears off at a place [m]. place : flat number in the plan of both"""
        b, i, j = np.unravel_index(place, self.depth[law].shape)
        inside = lambda own: own.lines[0] <= j < own.lines[1]
        return np.array([own.depth[law][b, i, j - own.lines[0]] if inside(own) else 0.0 for _, own in self.kinds])

    @property
    def wheels(self) -> np.ndarray:
        """(kinds, laws, 2, n) mean depths that wheels of each kind lose in one pass of theirs [m]."""
        return np.stack([own.wheel for _, own in self.kinds])


@dataclass(frozen=True, eq=False)
class CrossingSite(Site):
    """base : the unworn crossing;  settings : of the study, by which it wears;  run : numerics of the pass;  pool :
    processes that share the passes; None: this one
    flow_law : of the flow that goes on with the passes; None: none does
    flow : (2, m, n) depths by which plastic flow lowered the surfaces before they wear [m]; None: it did not"""

    base: UnwornCrossing
    passes: tuple[CrossingPass, ...]
    laws: Mapping[str, WearLaw]
    settings: DamageSettings
    run: RigidHertzSettings
    grid: tuple[np.ndarray, np.ndarray]
    pool: Pool | None = field(repr=False)
    flow_law: FlowLaw | None
    flow: np.ndarray | None = field(default=None, repr=False)

    def first(self) -> WornSurface:
        """The crossing before any pass."""
        return WornSurface.unworn(*self.grid, flows=self.flow_law is not None)

    def crossing(self, shape: WornSurface) -> WornCrossing:
        """Wing and nose as they are now, flow and wear together."""
        return shape.crossing(self.base, self.flow)

    @cached_property
    def heights(self) -> np.ndarray:
        """(2, m, n) of the unworn wing and nose [m]; NO_METAL where there is none."""
        x, y = np.meshgrid(*self.grid, indexing="ij")
        return np.stack([self.base.heights(x.ravel(), y.ravel(), b).reshape(x.shape) for b in BODIES])

    def metal(self) -> np.ndarray:
        """(2, m, n) where wing and nose have a surface."""
        return self.heights > 0.5 * NO_METAL

    def rate(self, shape: WornSurface) -> CrossingRate:
        """Mean wear of one pass over the worn crossing. Errors: CrossingError where a wheel derails."""
        crossing = self.crossing(shape)
        jobs = [(self, one, crossing, shape) for one in self.passes]
        found = (self.pool or Pool(Workers())).map(pass_wear, jobs)
        shares, metal = [one.weight for one in self.passes], self.metal()
        depth, beyond = {}, {}
        for law in self.laws:
            every = _mean(shares, found, lambda own, law=law: own.depth[law], shape.shape)
            depth[law] = np.where(metal, every, 0.0)
            beyond[law] = float((every - depth[law]).sum()) * shape.cell
        kept = tuple(
            (share, replace(own, work=np.zeros(0), crack=np.zeros(0), grooves=np.zeros(0)))
            for share, own in zip(shares, found, strict=True)
        )
        weighted = list(zip(shares, found, strict=True))
        removed = {law: sum(share * own.removed[law] for share, own in weighted) for law in self.laws}
        work = _mean(shares, found, lambda own: own.work, shape.shape)
        crack = np.where(metal, _mean(shares, found, lambda own: own.crack, shape.shape), 0.0)
        return CrossingRate(depth, removed, beyond, work, crack, kept, self._grooves(found, shape))

    def _grooves(self, found: list[PassWear], shape: WornSurface) -> np.ndarray:
        if self.flow_law is None:
            return np.zeros(0)
        out = np.zeros((len(found), 2, *shape.shape))
        for own, into in zip(found, out, strict=True):
            into[..., slice(*own.lines)] = own.grooves
        return out

    def flowed(self, shape: WornSurface, rate: CrossingRate, passes: float) -> WornSurface:
        """The surfaces after the flow of some passes by a rate found on them, before their wear."""
        if self.flow_law is None:
            return shape
        shares = [share for share, _ in rate.kinds]
        return shape.flowed(rate.grooves, shares, passes, self.flow_law.rate, self.heights)

    def flow_passes(self, rate: CrossingRate, depth: float) -> float:
        """Passes in which they flow by at most a depth [m]; inf: they never do."""
        if self.flow_law is None:
            return float("inf")
        return passes_to_flow(rate.grooves[:, 0], [share for share, _ in rate.kinds], depth, self.flow_law.rate)

    def __getstate__(self) -> dict:
        own = {name: value for name, value in self.__dict__.items() if name not in ("pool", "heights")}
        return own | {"pool": None}


def _mean(shares: list[float], found: list[PassWear], pick, shape: tuple[int, ...]) -> np.ndarray:
    """Of a field of each pass by its share, on the whole plan."""
    out = np.zeros(shape)
    for share, own in zip(shares, found, strict=True):
        out[:, :, slice(*own.lines)] += share * pick(own)
    return out


def pass_wear(job: tuple[CrossingSite, CrossingPass, AnyCrossing, WornSurface]) -> PassWear:
    """One pass over a crossing as it is now, its steel as a shape says: forces, patches, wear, grooves."""
    site, one, crossing, shape = job
    settings, spacing, yields = site.settings, site.settings.patch_spacing, None
    if site.flow_law is not None:
        yields = partial(left_to_flow, site.flow_law, site.grid, one.scene, shape)
    table, light = dynamics(one, crossing, site.run, spacing, yields)
    order = np.argsort(light.x)
    at_table = np.stack([np.interp(table.x, light.x[order], own[order]) for own in light.force])
    contacts = table_contacts(one.scene, table, at_table, patch_options(one.scene, settings))
    reach = reach_of(contacts, one.scene, crossing, table.datum, site.grid[0])
    worn = wear_field(contacts, site.laws, settings.factor, spacing, site.grid, reach)
    pressed, crack = groove_field(site, one.scene, contacts, shape), crack_field(site, contacts)
    wheel_laws, lines_of_wheel = laws_of(settings, wheels=True), wheel_lines(settings.plan_spacing)
    wheel = wheel_wear(contacts, one.scene, table.datum, wheel_laws, settings.factor, spacing, lines_of_wheel)
    touched = np.flatnonzero(
        sum(own.sum(axis=(0, 1)) for own in (worn.work, *worn.depth.values()))
        + pressed.sum(axis=(0, 1, 2))
        + np.abs(crack).sum(axis=(0, 1))
    )
    lines = (int(touched[0]), int(touched[-1]) + 1) if len(touched) else (0, 0)
    kept = lambda field: field[..., slice(*lines)].copy()
    columns = {"time": light.time, "x": light.x, "force": light.force.sum(axis=0), "force_nose": light.force[1]}
    transfer = transfer_position(columns, one.scene.direction_sign, one.scene.static_wheel_load)
    return PassWear(
        one.label,
        lines,
        {law: kept(depth) for law, depth in worn.depth.items()},
        dict(worn.removed),
        kept(worn.work),
        kept(crack),
        facts_of(contacts, settings),
        light.force.max(axis=1),
        largest_impact(light, table, one.scene.static_wheel_load),
        float(transfer),
        (_hardest(contacts, 0), _hardest(contacts, 1)),
        kept(pressed),
        wheel,
        circumference(one.scene, lines_of_wheel),
    )


def crack_field(site: CrossingSite, contacts: PassContacts) -> np.ndarray:
    """(2, m, n) damage of one pass on the plan: each place takes that of the patch whose middle passes it along the
    rail, across as far as the patch is wide; where several lie as near, their mean."""
    x, y = site.grid
    feet = footprints(contacts)
    wide = feet._replace(across=feet.across * contacts.patches.grid.ny)
    one, share = np.ones((len(contacts), 1)), wide.across * (site.settings.patch_spacing / (x[1] - x[0]))
    fallen = deposit(wide, one * fatigue_of(site.settings).damage(contacts.tgamma)[:, None], share, x, y)
    return fallen / np.maximum(deposit(wide, one, share, x, y), 1.0)


def groove_field(site: CrossingSite, scene: Scene, contacts: PassContacts, shape: WornSurface) -> np.ndarray:
    """(2, 2, m, n) depths that a pass still presses into wing and nose [m], and the squares of strain of that. Nothing
    where contacts are too steep for a plan. Zeros (2, 2, 1, n) where nothing flows."""
    x, y = site.grid
    if site.flow_law is None:
        return np.zeros((2, len(BODIES), 1, len(y)))
    force, cosine, spacing = contacts.patches.normal_force, np.cos(contacts.angle), site.settings.patch_spacing
    width = contacts.patches.grid.dy * contacts.patches.grid.ny / 2 * cosine
    before = mean_under(shape.known_strain, site.grid, contacts.body, contacts.position, width)
    flowed = mean_under(shape.known_flow, site.grid, contacts.body, contacts.position, 0 * width)
    depth, load = np.zeros((2, len(BODIES), len(x), len(y))), scene.static_wheel_load / cosine
    for b, body in enumerate(BODIES):
        own = (contacts.body == b) & (np.abs(contacts.angle) < STEEPEST)
        found = grooves(
            force[own],
            contacts.radii[own],
            contacts.modulus[b],
            load[own],
            getattr(scene.materials, body).steel(),
            before[own],
            site.flow_law.limit,
            flowed[own],
        )
        of, place = carried_beyond(contacts.position[own, :2], contacts.position[:, 0], spacing, x)
        flows = found.depth[of] > 0
        of, place = of[flows], place[flows]
        strips, across = groove_strips(Grooves(*(v[of] for v in found)))
        plan = across * cosine[own][of]
        feet = Footprints(np.full(len(plan), b), place, plan)
        for into, each in zip(depth, np.moveaxis(strips, 1, 0), strict=True):
            into += deposit(feet, each, across * (spacing / (x[1] - x[0])), x, y)
    return depth


def _hardest(contacts: PassContacts, body: int) -> Patch | None:
    own = np.flatnonzero(contacts.body == body)
    return contacts.patches.patch(int(own[np.argmax(contacts.patches.normal_force[own])])) if len(own) else None


def left_to_flow(
    flow_law: FlowLaw, grid: tuple[np.ndarray, np.ndarray], scene: Scene, shape: WornSurface, table: ContactTable
) -> np.ndarray:
    """(2, n) of the groove that the static load presses at each position of a table, the part that is still to press: 1
    on steel that has not flowed, 0 on steel at rest."""
    out = np.ones(table.stiffness.shape)
    for b, body in enumerate(BODIES):
        near = table.stiffness[b] > 0
        load, radii = scene.static_wheel_load / np.cos(table.angle[b, near]), table.radii[b, near]
        width = patch_sizes(load, radii, table.modulus[b])[:, 1] * np.cos(table.angle[b, near])
        at = np.full(len(load), b), table.point[b, near]
        strain = mean_under(shape.known_strain, grid, *at, width)
        flowed = np.maximum(mean_under(shape.known_flow, grid, *at, 0 * width), 0.0)
        steel = getattr(scene.materials, body).steel()
        still = grooves(load, radii, table.modulus[b], load, steel, strain, flow_law.limit, flowed).depth
        out[b, near] = np.where(flowed > LEAST_FLOW, still / np.maximum(still + flowed, LEAST_FLOW), 1.0)
    return out


def dynamics(
    one: CrossingPass,
    crossing: AnyCrossing,
    run: RigidHertzSettings,
    spacing: float,
    yields: Callable[[ContactTable], np.ndarray] | None = None,
) -> tuple[ContactTable, LightPass]:
    """Table of contacts on a crossing as it is now, and the pass over it. yields : of a table, the part (2, n) of what
    virgin steel is indented by that its steel still is; None: all"""
    scene = one.scene
    key = table_key(scene, *run.window(scene), spacing, one.shift)._replace(crossing=crossing)
    table = fresh_table(key, WITHIN)
    virgin = contacts_of(scene, run, table)
    if yields is None:
        return table, run_pass(scene, run, virgin)
    part = yields(table)

    def contacts(x: np.ndarray) -> ContactLaw:
        law = virgin(x)
        share = np.tile(table.between(x, part), (len(law.height) // len(part), 1))
        return replace(law, plastic_compliance=law.plastic_compliance * share, relief=law.relief * share)

    return table, run_pass(scene, run, contacts)
