"""Traffic and maintenance: equivalent tonnage, inspection, time to a limit, grinding and welding."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

HORIZON = 100.0  # years that a life is looked at
EXTRAPOLATED = 3.0  # times the passes that were run, beyond which no years are told
UNITS = ((1.0 / 365.25, 14, "days"), (7 / 365.25, 9, "weeks"), (1 / 12, 24, "months"), (1.0, np.inf, "years"))


# Form and values of UIC 714, recalled, not opened: S up to a speed [m/s], K of each kind of stock
IN_KM_H = {60: 1.0, 80: 1.05, 100: 1.15, 130: 1.25, 160: 1.35, 200: 1.4, 250: 1.45, np.inf: 1.5}
SPEED_FACTORS = tuple((limit / 3.6, factor) for limit, factor in IN_KM_H.items())
STOCK_FACTORS = {"passenger": 1.0, "freight": 1.15, "tractive": 1.4}
# Intervals [weeks] of inspection by track category: switches and crossings that are strengthened, that are not (None:
# not allowed), and by a supervisor. Thesis, figure 1-6
INSPECTION: dict[str, tuple[float, float | None, float]] = {
    "1A": (1.0, None, 5.0),
    "1": (1.0, 0.5, 8.0),
    "2": (1.0, 0.5, 8.0),
    "3": (1.0, 1.0, 13.0),
    "4": (1.0, 1.0, 13.0),
    "5": (1.0, 1.0, 13.0),
    "6": (2.0, 2.0, 13.0),
}
WEEKS = 365.25 / 7  # in a year


def equivalent_tonnage(kinds: Iterable[tuple[str, float, float]]) -> float:
    """EMGTPA [Mt/year], thesis eq. 1-1: the sum of S K T over (stock, speed [m/s], T [Mt/year])."""
    factor = lambda speed: next(s for limit, s in SPEED_FACTORS if speed <= limit + 1e-9)
    return sum(factor(speed) * STOCK_FACTORS[stock] * tonnes for stock, speed, tonnes in kinds)


@dataclass(frozen=True)
class Event:
    """Grinding or welding at a time [years]: what is left of the depth, of the crack index, and what it takes off
    itself [m]."""

    time: float
    name: str = "grinding"
    keeps_depth: float = 1.0
    keeps_crack: float = 0.0
    removes: float = 0.2e-3


WELD = Event(0.0, "welding", keeps_depth=0.0, keeps_crack=0.0, removes=0.0)


class Life(NamedTuple):
    """reached : what limit ends it, and when [years]; or "" and the horizon."""

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
    now, depth, crack = begun
    for event in [*sorted((e for e in events if e.time < horizon), key=lambda e: e.time), None]:
        end = horizon if event is None else event.time
        to_depth = now + (depth_limit - depth) / depth_rate if depth_rate > 0 else np.inf
        to_crack = now + (1 - crack) / crack_rate if crack_rate > 0 else np.inf
        at = min(to_depth, to_crack)
        if at <= end:
            return Life("depth" if to_depth <= to_crack else "cracks", float(at))
        depth, crack, now = depth + depth_rate * (end - now), max(crack + crack_rate * (end - now), 0.0), end
        if event is not None:
            depth, crack = event.keeps_depth * depth + event.removes, event.keeps_crack * crack
            if depth >= depth_limit:
                return Life(f"depth, by {event.name}", float(now))
    return Life("", float(horizon))
