"""Traffic and maintenance: tonnage, damage per year, time to a limit, grinding and welding, inspection intervals."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rail_fem.damage.wear import WearError

TONNE = 1000.0  # [kg]
HORIZON = 100.0  # years that a life is looked at
EXTRAPOLATED = 3.0  # times the passes that were run, beyond which no years are told
UNITS = ((1.0 / 365.25, 14, "days"), (7 / 365.25, 9, "weeks"), (1 / 12, 24, "months"), (1.0, np.inf, "years"))


class TrafficError(WearError):
    """Traffic that cannot be: what, how large, what to do."""


@dataclass(frozen=True)
class Emgtpa:
    """Equivalent million gross tonnes per annum, thesis eq. 1-1: S_p (K_p T_p + K_t T_tp) + S_f (K_f T_f + K_t T_tf).

    speed : ((up to [m/s], S), ...), the last up to inf;  passenger K_p, freight K_f, tractive K_t (of tractive stock;
    the thesis calls it a track coefficient). Defaults: form and values of UIC 714, recalled, not opened.
    """

    speed: tuple[tuple[float, float], ...] = tuple(
        (limit / 3.6, s)
        for limit, s in (
            (60, 1.0),
            (80, 1.05),
            (100, 1.15),
            (130, 1.25),
            (160, 1.35),
            (200, 1.40),
            (250, 1.45),
            (np.inf, 1.5),
        )
    )
    passenger: float = 1.0
    freight: float = 1.15
    tractive: float = 1.40

    def __post_init__(self) -> None:
        limits = [limit for limit, _ in self.speed]
        if limits != sorted(set(limits)) or not np.isinf(limits[-1]):
            raise TrafficError(f"EMGTPA: speed limits {limits} m/s must grow, the last one be inf")
        for value in (self.passenger, self.freight, self.tractive, *(s for _, s in self.speed)):
            if not (np.isfinite(value) and value > 0):
                raise TrafficError(f"EMGTPA: coefficient {value!r}: give one above 0")

    def speed_factor(self, speed: float) -> float:
        """S at a speed [m/s]."""
        return self.speed[bisect_left([limit for limit, _ in self.speed], speed - 1e-9)][1]

    def value(
        self,
        passenger: tuple[float, float, float] = (0.0, 0.0, 0.0),
        freight: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> float:
        """EMGTPA [Mt/year] of (speed [m/s], hauled, tractive [Mt/year]) of each kind."""
        for row in (passenger, freight):
            if not (np.isfinite(row).all() and min(row) >= 0):
                raise TrafficError(f"tonnage {row}: speed and tonnages must be finite and 0 or more")
        part = lambda row, k: self.speed_factor(row[0]) * (k * row[1] + self.tractive * row[2]) if sum(row[1:]) else 0.0
        return part(passenger, self.passenger) + part(freight, self.freight)


# Intervals [weeks]: strengthened S&C, not strengthened (None: not allowed), supervisor. Thesis Fig. 1-6.
INSPECTION: Mapping[str, tuple[float, float | None, float]] = {
    "1A": (1.0, None, 5.0),
    "1": (1.0, 0.5, 8.0),
    "2": (1.0, 0.5, 8.0),
    "3": (1.0, 1.0, 13.0),
    "4": (1.0, 1.0, 13.0),
    "5": (1.0, 1.0, 13.0),
    "6": (2.0, 2.0, 13.0),
}


def category(table: Sequence[tuple[str, float, float]], emgtpa: float, speed: float) -> str:
    """First category whose limits hold the traffic: rows (category, most EMGTPA, highest speed [m/s]) of the owner's
    standard, from the lightest to the heaviest duty. None is shipped: the published borders are a picture's curves."""
    for name, tonnage, fastest in table:
        if name not in INSPECTION:
            raise TrafficError(f"category {name!r}: known are {', '.join(INSPECTION)}")
        if emgtpa <= tonnage and speed <= fastest:
            return name
    raise TrafficError(f"EMGTPA {emgtpa:.3g} at {speed * 3.6:.0f} km/h lies beyond every row of the category table")


@dataclass(frozen=True)
class Mix:
    """Axles per year of each kind of vehicle: name -> (axles a year, axle load [N])."""

    axles: Mapping[str, tuple[float, float]]

    def __post_init__(self) -> None:
        for name, (count, load) in self.axles.items():
            if not (np.isfinite([count, load]).all() and count >= 0 and load > 0):
                raise TrafficError(f"traffic {name}: {count!r} axles a year of {load!r} N: give 0 or more, above 0")
        if not sum(count for count, _ in self.axles.values()) > 0:
            raise TrafficError("traffic: no axle runs in a year; nothing wears")

    @property
    def total(self) -> float:
        """Axles a year."""
        return sum(count for count, _ in self.axles.values())

    @property
    def gross(self) -> float:
        """Million gross tonnes a year."""
        return sum(count * load for count, load in self.axles.values()) / 9.81 / TONNE / 1e6

    @property
    def weights(self) -> dict[str, float]:
        """Share of each kind in the axles."""
        return {name: count / self.total for name, (count, _) in self.axles.items()}

    def per_year(self, damage: Mapping[str, float]) -> float:
        """Damage a year from damage per axle of each kind."""
        missing = set(self.axles) - set(damage)
        if missing:
            raise TrafficError(f"no damage per axle is known for {', '.join(sorted(missing))}")
        return sum(count * damage[name] for name, (count, _) in self.axles.items())


@dataclass(frozen=True)
class Event:
    """Grinding or welding at a time [years]: what is left of the depth, of the crack index, and what it takes off
    itself [m]."""

    time: float
    name: str = "grinding"
    keeps_depth: float = 1.0
    keeps_crack: float = 0.0
    removes: float = 0.2e-3

    def __post_init__(self) -> None:
        if not (0 <= self.keeps_depth <= 1 and 0 <= self.keeps_crack <= 1 and self.removes >= 0 and self.time >= 0):
            raise TrafficError(
                f"{self.name} at {self.time} years: shares kept lie in [0, 1], what is removed is 0 or more"
            )


WELD = Event(0.0, "welding", keeps_depth=0.0, keeps_crack=0.0, removes=0.0)


def maintenance(grindings: Sequence[float], weldings: Sequence[float], removes: float) -> tuple[Event, ...]:
    """Grindings and weldings at times [years], in their order; removes : that a grinding takes off [m]. Where both fall
    together welding comes last."""
    events = [Event(t, removes=removes) for t in grindings] + [replace(WELD, time=t) for t in weldings]
    return tuple(sorted(events, key=lambda event: event.time))


@dataclass(frozen=True)
class Life:
    """time [years], depth [m] and crack index (n,) at the moments where anything changes; reached : what limit ends it
    and when, or "" and the horizon."""

    time: np.ndarray
    depth: np.ndarray
    crack: np.ndarray
    reached: str
    years: float


def time_in_words(years: float | None, digits: int = 1) -> str:
    """A time to so many digits in the unit that suits it; "-" where it is not told."""
    if years is None:
        return "-"
    size, _, unit = next(row for row in UNITS if years < row[0] * row[1])
    return f"{float(f'{years / size:.{digits}g}'):g} {unit}"


def life(
    depth_rate: float,
    crack_rate: float,
    depth_limit: float,
    events: Sequence[Event] = (),
    horizon: float = HORIZON,
    begun: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Life:
    """When the depth [m/year] or the crack index [1/year] reaches its limit (depth_limit [m]; 1), with events between.

    begun : time [years], depth [m] and crack index from which it goes on
    A negative crack rate (wear removes cracks) keeps the index at 0.
    """
    if not (np.isfinite([depth_rate, crack_rate]).all() and depth_rate >= 0 and depth_limit > 0):
        raise TrafficError(
            f"depth {depth_rate!r} m a year, cracks {crack_rate!r} a year, limit {depth_limit!r} m: give finite rates,"
            " a depth of 0 or more and a limit above 0"
        )
    rows, (now, depth, crack) = [begun], begun
    for event in [*sorted((e for e in events if e.time < horizon), key=lambda e: e.time), None]:
        end = horizon if event is None else event.time
        to_depth = now + (depth_limit - depth) / depth_rate if depth_rate > 0 else np.inf
        to_crack = now + (1 - crack) / crack_rate if crack_rate > 0 else np.inf
        at = min(to_depth, to_crack)
        if at <= end:
            depth, crack = depth + depth_rate * (at - now), max(crack + crack_rate * (at - now), 0.0)
            return _life([*rows, (at, depth, crack)], "depth" if to_depth <= to_crack else "cracks", at)
        depth, crack, now = depth + depth_rate * (end - now), max(crack + crack_rate * (end - now), 0.0), end
        rows.append((now, depth, crack))
        if event is not None:
            depth, crack = event.keeps_depth * depth + event.removes, event.keeps_crack * crack
            rows.append((now, depth, crack))
            if depth >= depth_limit:
                return _life(rows, f"depth, by {event.name}", now)
    return _life(rows, "", horizon)


def _life(rows: list[tuple[float, float, float]], reached: str, years: float) -> Life:
    time, depth, crack = np.array(rows).T
    return Life(time, depth, crack, reached, float(years))


@dataclass(frozen=True)
class Sensitivity:
    """First order: elasticity d ln(damage) / d ln(parameter) by a central difference, and what twice the step gives:
    its error."""

    name: str
    elasticity: float
    error: float
    base: float = field(default=np.nan)


def elasticity(name: str, base: float, damage_at, step: float = 0.05) -> Sensitivity:
    """Of damage_at(parameter) > 0 at `base`; step relative. Central differences at `step` and twice that."""

    def slope(h: float) -> float:
        low, high = damage_at(base * (1 - h)), damage_at(base * (1 + h))
        if not (low > 0 and high > 0):
            raise TrafficError(f"{name}: damage {low!r} and {high!r} on either side: an elasticity needs both above 0")
        return float(np.log(high / low) / np.log((1 + h) / (1 - h)))

    fine, coarse = slope(step), slope(2 * step)
    return Sensitivity(name, fine, abs(fine - coarse), base)
