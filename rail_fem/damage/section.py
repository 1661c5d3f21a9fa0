"""A rail section that a population of wheels passes: what one pass of each wears off it, on the shape that it has now.

The section stands on the left, a plain rail on the right, both are looked at as prisms. What wears is the left section;
the rail keeps its position while it wears.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bem.patch import Patch
from geometry.contact.prismatic_search import ContactSearch
from geometry.profiles.profile import Profile
from geometry.wheelset import RailPosition, Track, Wheelset
from rail_fem.damage.contact_facts import ContactFacts, facts_of_points
from rail_fem.damage.evolution import Rate, Site
from rail_fem.damage.fatigue import fatigue_of
from rail_fem.damage.rolling import Rolling, RollingPoint, equilibrium_on_yielding_rails, roll
from rail_fem.damage.wear import WearLaw, friction_work
from rail_fem.damage.worn_profile import WornProfile
from rail_fem.settings.damage import DamageSettings


@dataclass(frozen=True, eq=False)
class Passing:
    """One kind of pass. wheel, radius [m];  loads : of left and right wheel [N];  lateral [m], yaw [rad];  rolling;
    weight : its share of all passes, which sum to 1."""

    wheel: Profile
    radius: float
    loads: tuple[float, float]
    lateral: float
    rolling: Rolling
    weight: float
    yaw: float = 0.0


@dataclass(frozen=True, eq=False)
class PassRecord:
    """What one kind of pass did: its points on the worn rail, the lateral position it took [m], facts of its points on
    the section."""

    passing: Passing
    points: tuple[RollingPoint, ...]
    lateral: float
    facts: ContactFacts

    @property
    def on_section(self) -> list[RollingPoint]:
        """Its points there, the largest force first."""
        return sorted((p for p in self.points if p.side == "left"), key=lambda p: -p.normal_force)

    @property
    def force(self) -> tuple[float]:
        """Largest on the section, normal [N]."""
        return (max((p.normal_force for p in self.on_section), default=0.0),)

    @property
    def hardest(self) -> tuple[Patch | None]:
        """Patch of that force; None where none carries."""
        return (self.on_section[0].patch if self.on_section else None,)


@dataclass(frozen=True, eq=False)
class Section(Site):
    """The left rail's position is that of `track`, whatever wears. laws : by name;  settings : of the study, by
    which it wears"""

    track: Track
    passings: tuple[Passing, ...]
    laws: dict[str, WearLaw]
    settings: DamageSettings
    back_to_back: float
    positions: dict[int, float] = field(default_factory=dict, repr=False)  # found last, to begin from

    @property
    def starts(self) -> np.ndarray:
        """(k,) lateral position at which each kind of pass was found last, from which the next is looked for [m]."""
        return np.array([self.positions.get(k, np.nan) for k in range(len(self.passings))])

    def start_from(self, starts: np.ndarray) -> None:
        """Look for the next equilibria from these positions (k,) [m], NaN: from their own."""
        self.positions.clear()
        self.positions.update({k: float(y) for k, y in enumerate(starts) if np.isfinite(y)})

    def first(self) -> WornProfile:
        """The section before any pass."""
        return WornProfile.of(self.track.left)

    def standing(self, worn: WornProfile) -> Track:
        """The track with the worn section where the first one lay."""
        line, own = worn.profile, self.track
        sunk = float(line.points[:, 1].max())
        at = own.gauge_offset("left") + own.left_position.lateral
        shifted = line.shifted(0.0, -sunk)
        offset = Track(shifted, own.profile("right"), own.gauge).gauge_offset("left")
        position = RailPosition(at - offset, own.left_position.vertical + sunk, own.left_position.roll)
        return Track(
            shifted, own.profile("right"), own.gauge, left_position=position, right_position=own.right_position
        )

    def records(self, worn: WornProfile) -> tuple[PassRecord, ...]:
        """All passes over the worn section."""
        track, found, searches = self.standing(worn), [], {}
        for k, p in enumerate(self.passings):
            wheel = id(p.wheel), p.radius
            if wheel not in searches:  # its tables are the same wherever the wheelset stands
                wheelset = Wheelset(p.wheel, radius=p.radius, back_to_back=self.back_to_back)
                searches[wheel] = ContactSearch(wheelset, track)
            search = searches[wheel]
            state = equilibrium_on_yielding_rails(
                search, p.loads, p.lateral, p.yaw, self.settings.switch.rail_stiffness, self.positions.get(k)
            )
            at = _middle(state)
            self.positions[k] = at
            points = roll(search, state, p.rolling)
            left = [point for point in points if point.side == "left"]
            found.append(PassRecord(p, points, at, facts_of_points(left, self.settings)))
        return tuple(found)

    def rate(self, worn: WornProfile) -> Rate:
        """Mean wear of one pass over the worn section; each of its kinds (share, PassRecord)."""
        depth = {name: np.zeros(len(worn.points)) for name in self.laws}
        area, beyond = dict.fromkeys(self.laws, 0.0), dict.fromkeys(self.laws, 0.0)
        work, crack = np.zeros(len(worn.points)), np.zeros(len(worn.points))
        records, fatigue = self.records(worn), fatigue_of(self.settings)
        for record in records:
            for point in record.points:
                if point.side != "left":
                    continue
                patch, weight = point.patch, record.passing.weight
                centre = worn.position(*point.position)
                for name, law in self.laws.items():
                    strips = self.settings.factor * weight * law.depth(patch, point.speed)
                    own, lost = worn.deposit(centre, point.outwards, strips, patch.grid.dy)
                    depth[name] += own
                    area[name] += float(strips.sum() * patch.grid.dy)
                    beyond[name] += lost
                work += worn.deposit(centre, point.outwards, weight * friction_work(patch), patch.grid.dy)[0]
                fallen = np.full(patch.grid.ny, weight * float(fatigue.damage(point.tgamma)))
                crack += worn.deposit(centre, point.outwards, fallen, patch.grid.dy)[0]
        kinds = tuple((record.passing.weight, record) for record in records)
        return Rate(depth, area, beyond, work, crack, kinds)


def _middle(state) -> float:
    """Lateral position [m] of a resting wheelset at the level of the rail (static_equilibrium's `lateral`)."""
    s = state.state
    return s.y + s.radius * np.sin(s.roll) * np.cos(s.yaw)


def sine_positions(mean: float, amplitude: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Places (count,) [m] of a sine about a mean and their shares (count,): equal parts of a cycle."""
    phase = (np.arange(count) + 0.5) / count * np.pi
    return mean + amplitude * np.cos(phase), np.full(count, 1 / count)


def scattered(mean: float, deviation: float) -> tuple[np.ndarray, np.ndarray]:
    """Places [m] of a normal distribution and their shares, by Gauss and Hermite's rule of five; one at no scatter."""
    if deviation == 0:
        return np.array([mean]), np.ones(1)
    nodes, weights = np.polynomial.hermite_e.hermegauss(5)
    return mean + deviation * nodes, weights / weights.sum()
