"""A crossing that a population of wheels passes: what a mean pass wears off wing and nose, on the shape that they have
now.

Every kind of pass (wheel, speed, lateral position) runs anew over the worn surfaces: contacts by the search of
rigid_hertz, forces by its dynamics, patches and tractions at every position, wear by every law. The axle moves
vertically; its lateral position is the kind's own.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace

import numpy as np

from bem.patch import Patch
from geometry.surfaces.any_crossing import AnyCrossing
from geometry.surfaces.bodies import BODIES, NO_METAL
from geometry.surfaces.worn_crossing import UnwornCrossing, WornCrossing
from rail_fem.damage.contact_facts import ContactFacts, facts_of
from rail_fem.damage.crossing import PassContacts, PatchOptions, table_contacts, wear_field
from rail_fem.damage.impacts import LargestImpact, largest_impact
from rail_fem.damage.wear import WearLaw
from rail_fem.damage.worn_surface import WornSurface
from rail_fem.light.contact_table import ContactTable, fresh_table, table_key
from rail_fem.light.plastic_indentation import contacts_of
from rail_fem.light.vertical_pass import LightPass, run_pass
from rail_fem.output.events import transfer_position
from rail_fem.scene.scene import GRAVITY, Scene
from rail_fem.scene.units import show
from rail_fem.settings.light import RigidHertzSettings

WITHIN = 3e-3  # below the body that carries, where the other is looked at: no wheel presses so deep [m]


@dataclass(frozen=True, eq=False)
class CrossingPass:
    """One kind of pass. shift : lateral position towards the field side [m];  weight : its share of all passes;
    options : of its patches;  by_load : the label says the axle load"""

    scene: Scene
    shift: float
    weight: float
    options: PatchOptions
    by_load: bool = False

    @property
    def label(self) -> str:
        """Wheel, axle load where the traffic has several, speed and lateral position."""
        aside = f", {self.shift * 1e3:+.1f} mm" if self.shift else ""
        load = f", {show(2 * self.scene.static_wheel_load / GRAVITY, 't', 3)}" if self.by_load else ""
        return f"{self.scene.wheel.name}{load} at {show(self.scene.speed, 'mph')}{aside}"


@dataclass(frozen=True, eq=False)
class PassWear:
    """What one pass of a kind did. label : of the kind;  lines : (first, last + 1) of the n lines of the plan between
    which it wore;  depth : law -> (2, m, lines) [m];  removed : law -> [m3];  work (2, m, lines) [J/m2]
    force : (2,) largest on wing and nose [N];  impact : the larger of them;  transfer : where the load changes over
    [m], NaN: nowhere;  hardest : patch of the largest normal force on wing and nose, None: carries nothing"""

    label: str
    lines: tuple[int, int]
    depth: dict[str, np.ndarray]
    removed: dict[str, float]
    work: np.ndarray
    facts: ContactFacts
    force: np.ndarray
    impact: LargestImpact
    transfer: float
    hardest: tuple[Patch | None, Patch | None]


@dataclass(frozen=True, eq=False)
class CrossingRate:
    """Mean of the passes by their shares; see rail_fem.damage.evolution.Rate. kinds : each (share, PassWear) without
    its depths."""

    depth: dict[str, np.ndarray]
    removed: dict[str, float]
    beyond: dict[str, float]
    work: np.ndarray
    kinds: tuple[tuple[float, PassWear], ...]

    @property
    def tgamma(self) -> tuple[np.ndarray, np.ndarray]:
        """T gamma (k,) [N] of all patches, and the shares of their passes (k,)."""
        values = [own.facts.tgamma for _, own in self.kinds]
        return np.concatenate(values), np.repeat([share for share, _ in self.kinds], [len(v) for v in values])

    @property
    def largest_force(self) -> float:
        """On either body by any wheel [N]."""
        return float(max(own.force.max() for _, own in self.kinds))


@dataclass(frozen=True, eq=False)
class CrossingSite:
    """base : the unworn crossing;  run : numerics of the pass;  spacing : between patches [m];  factor : of calibration
    on all laws;  hardness, shear_yield [Pa];  pool : processes that share the passes; None: this one
    flow : (2, m, n) depths by which plastic flow lowered the surfaces before they wear [m]; None: it did not"""

    base: UnwornCrossing
    passes: tuple[CrossingPass, ...]
    laws: Mapping[str, WearLaw]
    run: RigidHertzSettings
    grid: tuple[np.ndarray, np.ndarray]
    spacing: float = 2e-3
    factor: float = 1.0
    hardness: float = 5e9
    shear_yield: float = 300e6
    pool: Executor | None = field(default=None, repr=False)
    flow: np.ndarray | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        total = sum(p.weight for p in self.passes)
        if not (self.passes and abs(total - 1) < 1e-6 and all(p.weight >= 0 for p in self.passes)):
            raise ValueError(f"weights of the passes add up to {total:.6g}: give shares of 0 or more whose sum is 1")

    @property
    def starts(self) -> np.ndarray:
        """Nothing: a pass is looked for without a first guess."""
        return np.zeros(0)

    def start_from(self, starts: np.ndarray) -> None:
        """Nothing to do."""

    def afresh(self) -> CrossingSite:
        """One that remembers nothing: itself."""
        return self

    def first(self) -> WornSurface:
        """The crossing before any pass."""
        return WornSurface.unworn(*self.grid)

    def crossing(self, shape: WornSurface) -> WornCrossing:
        """Wing and nose as they are now, flow and wear together."""
        return shape.crossing(self.base, self.flow)

    def metal(self) -> np.ndarray:
        """(2, m, n) where wing and nose have a surface."""
        x, y = np.meshgrid(*self.grid, indexing="ij")
        return np.stack([self.base.heights(x.ravel(), y.ravel(), b).reshape(x.shape) > 0.5 * NO_METAL for b in BODIES])

    def rate(self, shape: WornSurface) -> CrossingRate:
        """Mean wear of one pass over the worn crossing. Errors: CrossingError where a wheel derails."""
        crossing = self.crossing(shape)
        jobs = [(self, one, crossing) for one in self.passes]
        found = list(self.pool.map(_job, jobs) if self.pool else map(_job, jobs))
        shares, metal = [one.weight for one in self.passes], self.metal()
        depth, beyond = {}, {}
        for law in self.laws:
            every = _mean(shares, found, lambda own, law=law: own.depth[law], shape.shape)
            depth[law] = np.where(metal, every, 0.0)
            beyond[law] = float((every - depth[law]).sum()) * shape.cell
        kept = tuple(
            (share, replace(own, depth={}, work=np.zeros(0))) for share, own in zip(shares, found, strict=True)
        )
        weighted = list(zip(shares, found, strict=True))
        removed = {law: sum(share * own.removed[law] for share, own in weighted) for law in self.laws}
        return CrossingRate(depth, removed, beyond, _mean(shares, found, lambda own: own.work, shape.shape), kept)

    def __getstate__(self) -> dict:
        return {name: value for name, value in self.__dict__.items() if name != "pool"} | {"pool": None}


def _mean(shares: list[float], found: list[PassWear], pick, shape: tuple[int, ...]) -> np.ndarray:
    """Of a field of each pass by its share, on the whole plan."""
    out = np.zeros(shape)
    for share, own in zip(shares, found, strict=True):
        out[:, :, slice(*own.lines)] += share * pick(own)
    return out


def _job(job: tuple[CrossingSite, CrossingPass, AnyCrossing]) -> PassWear:
    return pass_wear(*job)


def pass_wear(site: CrossingSite, one: CrossingPass, crossing: AnyCrossing) -> PassWear:
    """One pass over a crossing as it is now: forces, patches, wear."""
    table, light = dynamics(one, crossing, site.run, site.spacing)
    order = np.argsort(light.x)
    at_table = np.stack([np.interp(table.x, light.x[order], own[order]) for own in light.force])
    contacts = table_contacts(one.scene, table, at_table, one.options)
    worn = wear_field(contacts, site.laws, site.factor, site.spacing, grid=site.grid)
    touched = np.flatnonzero(
        sum(own.sum(axis=0) for parts in (worn.work, *worn.depth.values()) for own in parts.values())
    )
    lines = (int(touched[0]), int(touched[-1]) + 1) if len(touched) else (0, 0)
    stack = lambda parts: np.stack([parts[body][:, slice(*lines)] for body in BODIES])
    removed = {law: float(worn.volume(law)) for law in site.laws}
    columns = {"time": light.time, "x": light.x, "force": light.force.sum(axis=0), "force_nose": light.force[1]}
    transfer = transfer_position(columns, one.scene.direction_sign, one.scene.static_wheel_load)
    return PassWear(
        one.label,
        lines,
        {law: stack(worn.depth[law]) for law in site.laws},
        removed,
        stack(worn.work),
        facts_of(contacts, site.hardness, site.shear_yield),
        light.force.max(axis=1),
        largest_impact(light, table, one.scene.static_wheel_load),
        float(transfer),
        (_hardest(contacts, 0), _hardest(contacts, 1)),
    )


def _hardest(contacts: PassContacts, body: int) -> Patch | None:
    own = np.flatnonzero(contacts.body == body)
    return contacts[int(own[np.argmax(contacts.patches.normal_force[own])])].patch if len(own) else None


def dynamics(
    one: CrossingPass, crossing: AnyCrossing, run: RigidHertzSettings, spacing: float
) -> tuple[ContactTable, LightPass]:
    """Table of contacts on a crossing as it is now, and the pass over it."""
    scene = one.scene
    key = table_key(scene, *run.window(scene), spacing, one.shift)._replace(crossing=crossing)
    table = fresh_table(key, WITHIN)
    return table, run_pass(scene, run, contacts_of(scene, run, table))
