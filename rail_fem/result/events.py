"""What happens on a pass: the one definition, for all models, of settling, transfer, impacts, largest forces and lost
contact.

Histories in, numbers out. A history's rows are (n,) arrays [s, m, N] in the order of time, whichever way the wheel
runs.

- *In contact*: the force on the wheel is above OPEN of the static load. All models share this threshold.
- *Transfer*: where the body that the wheel comes to (facing: the nose; trailing: the wing) takes over half of the force
for good; a
  wheel that bounces nose, wing, nose, wing has transferred at the last change. Between two rows in contact the position
  is interpolated; after a flight it is the row of the landing.
- *First impact on that body*: the first maximum of the force on it from the transfer on, that is the largest value
  before the force falls by more than FALL of the static load below it. What shakes with the mesh falls by less; what
  comes after a flight is another impact. It is that body's share: the other one may carry as well.
- *Impact on the wheel*: the largest force on the wheel while that body carries, from its first touch to the wheel's
  first maximum after the first impact on it. A force that falls at the touch is what the other body has left: it counts
  from its first minimum on.
- *Largest force*: over the whole path after the settling, of the wheel and of each body. The leg (the wing
  body as far as `leg_end`) and the wing rail behind it each have their own.
- *Flight*: a loss of contact; its launch speed is the wheel's upward speed at its first row.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType

import numpy as np

from geometry.surfaces.bodies import BODIES
from rail_fem.result.result import NAN, PassResult, Peak

OPEN = 1e-3  # of the static load: less is no contact
SHARED = 0.02  # of the force, from which on wing and nose count as carrying at once
FALL = 0.25  # of the static load: a maximum stands so much above what follows it
# column -> name of its peak
LARGEST = {"force": "largest_force", "force_wing": "largest_force_wing", "force_nose": "largest_force_nose"}
LEG = "largest_force_leg"
IMPACT = "impact_on_wheel"
SHARE = {"force_nose": "first_impact_on_nose", "force_wing": "first_impact_on_wing"}  # of the body that takes over
HIGH_END = 1.2  # of the static load: a run that ends above has not come to rest
END_STRETCH = 5e-3  # over which the force at the end is averaged [m]
NEAR_END = 10e-3  # a peak closer to an end of the path may be an accident of the window [m]
FREE_END = 40e-3  # from which on a force misses up to 1 % where no more steel is meshed than to the path's end [m]
NOTABLE = 1.05  # of the static load: below, a largest force is no peak


@dataclass(frozen=True)
class Flight:
    """A phase without contact: x [m] and time [s] of its first and last row; launch_speed : of the wheel, upward, at
    its start [m/s], NaN where its height is not resolved or not looked at"""

    x_start: float
    x_end: float
    start: float
    end: float
    launch_speed: float = NAN

    @property
    def length(self) -> float:
        """Distance covered [m]."""
        return abs(self.x_end - self.x_start)

    @property
    def duration(self) -> float:
        """Time in the air [s]."""
        return self.end - self.start


def receiving_body(sign: float) -> str:
    """The column of the body that takes the wheel over: sign > 0 facing, < 0 trailing."""
    return "force_nose" if sign > 0 else "force_wing"


def way_over(sign: float) -> str:
    """ "wing to nose", trailing "nose to wing". sign : as of receiving_body"""
    return " to ".join(BODIES[:: int(sign)])


def transfer_row(force: np.ndarray, nose: np.ndarray, sign: float, static_load: float) -> int | None:
    """The first row from which on the receiving body carries more than half whenever the wheel is in contact; None if
    it never takes over.

    force, nose : (n,) on the wheel, and its share from the nose [N]
    """
    touching = force > OPEN * static_load
    ahead = nose > 0.5 * force if sign > 0 else nose <= 0.5 * force
    behind = np.flatnonzero(touching & ~ahead)
    after = np.flatnonzero(touching & ahead)
    after = after[after > behind[-1]] if len(behind) else after[:0]
    return int(after[0]) if len(after) else None


def transfer_position(
    history: Mapping[str, np.ndarray], sign: float, static_load: float, settled: float = -np.inf
) -> float:
    """x [m] of the transfer among the rows after `settled` [s]; NaN where there is none, or where the model knows one
    body only."""
    rows = after_settling(history, settled)
    x, force, nose = (rows.get(name, np.empty(0)) for name in ("x", "force", "force_nose"))
    if len(nose) != len(force):
        return NAN
    row = transfer_row(force, nose, sign, static_load)
    if row is None:
        return NAN
    if force[row - 1] <= OPEN * static_load:
        return float(x[row])
    before, now = nose[row - 1] / force[row - 1], nose[row] / force[row]
    return float(x[row - 1] + (0.5 - before) / (now - before) * (x[row] - x[row - 1]))


def after_settling(history: Mapping[str, np.ndarray], settled: float) -> dict[str, np.ndarray]:
    """The rows after the settling, which ends at `settled` [s]."""
    after = history["time"] > settled
    return {name: values[after] for name, values in history.items()}


def settled_rows(result: PassResult) -> dict[str, np.ndarray]:
    """Those of a result; all where there is no settling."""
    return after_settling(result.history, result.settings.get("settle_time") or -np.inf)


def force_peaks(
    history: Mapping[str, np.ndarray],
    sign: float,
    static_load: float,
    settled: float = -np.inf,
    leg_end: float = -np.inf,
) -> dict[str, Peak]:
    """The impacts on the wheel and on the body that takes it over, and the largest forces; none for a body that is
    never touched or not resolved, no impact without a transfer. leg_end : x of the leg's end [m]; the largest force
    before it is the leg's, not the wing's"""
    rows, found = after_settling(history, settled), {}
    if "force_nose" in rows:
        row = transfer_row(rows["force"], rows["force_nose"], sign, static_load)
        body = receiving_body(sign)
        if row is not None:
            first = row + first_maximum(rows[body][row:], FALL * static_load)
            found[IMPACT] = peak_at(rows, "force", impact_row(rows["force"], rows[body], first, static_load))
            found[SHARE[body]] = peak_at(rows, body, first)
    leg = rows["x"] < leg_end
    for column, name in LARGEST.items():
        if column not in rows:
            continue
        own = np.where(leg, np.nan, rows[column]) if column == "force_wing" else rows[column]
        _add_largest(found, name, rows, column, own)
    if "force" in rows:
        _add_largest(found, LEG, rows, "force", np.where(leg, rows["force"], np.nan))
    return found


def _add_largest(found: dict[str, Peak], name: str, rows: Mapping[str, np.ndarray], column: str, values: np.ndarray):
    """The largest of values (n,), a column or part of it, as the peak `name`; none where nothing is above 0."""
    if np.nanmax(values, initial=0.0) > 0:
        found[name] = peak_at(rows, column, int(np.nanargmax(values)))


def impact_row(force: np.ndarray, share: np.ndarray, first: int, static_load: float) -> int:
    """The row of the impact on the wheel; never less than the share there.

    force, share : (n,) on the wheel, and of the body that takes it over [N];  first : row of the first impact on it
    """
    carries, fall = share >= min(OPEN * static_load, share[first]), FALL * static_load
    touch = int(np.argmax(carries))
    begin = touch + first_maximum(-force[touch : first + 1], fall)
    end = first + first_maximum(force[first:], fall)
    return begin + int(np.argmax(np.where(carries, force, 0.0)[begin : end + 1]))


def first_maximum(values: np.ndarray, fall: float) -> int:
    """Index of the largest of values (n,) up to where they have first fallen by more than `fall` below their largest so
    far."""
    fallen = np.flatnonzero(np.maximum.accumulate(values) - values > fall)
    return int(np.argmax(values[: fallen[0]] if len(fallen) else values))


def both_carry(history: Mapping[str, np.ndarray]) -> np.ndarray:
    """Whether wing and nose carry at once (n,): the mean of where they do lies in the flangeway."""
    return np.minimum(history["force_wing"], history["force_nose"]) > SHARED * history["force"]


def peak_at(history: Mapping[str, np.ndarray], column: str, row: int) -> Peak:
    """A force of the history as a peak: x of the wheel's centre, y of contact where known, and one body carries."""
    y = history["contact_y"][row] if "contact_y" in history and not both_carry(history)[row] else NAN
    return Peak(
        float(history[column][row]), "N", x=float(history["x"][row]), y=float(y), time=float(history["time"][row])
    )


def end_warnings(
    history: Mapping[str, np.ndarray],
    peaks: Mapping[str, Peak],
    static_load: float,
    settled: float = -np.inf,
    free_end: bool = False,
) -> tuple[str, ...]:
    """What may be an accident of the window: a start within the transfer, a force that has not settled at its end, a
    wheel in the air there, peaks close to one of its ends. free_end : no more steel is there than to the path's end"""
    rows = after_settling(history, settled)
    x, force = rows["x"], rows.get("force", np.empty(0))
    if not len(force):
        return ()
    left, warnings = np.abs(x[-1] - x), []
    if {"force_wing", "force_nose"} <= set(rows) and both_carry(rows)[0]:
        warnings.append(
            f"the run begins at x = {x[0] * 1e3:.0f} mm with wing and nose carrying at once, within the transfer: its"
            " impact lacks what the wheel does before, let it begin earlier"
        )
    at_end, before = force[left <= END_STRETCH].mean(), force[(left > END_STRETCH) & (left <= 2 * END_STRETCH)]
    if at_end > HIGH_END * static_load:
        trend = " and rising" if len(before) and at_end > before.mean() else ""
        warnings.append(
            f"the run ends at x = {x[-1] * 1e3:.0f} mm with {at_end / static_load:.2f} times the static load{trend}: a"
            " larger force may follow, let it go on"
        )
    lost = lost_contact(rows["time"], x, force, static_load)
    if lost and lost[-1].end == rows["time"][-1]:
        warnings.append(
            f"the run ends in flight, from x = {lost[-1].x_start * 1e3:.0f} mm on: its landing is not in it, and may be"
            " the largest force: let it go on"
        )
    for name, peak in peaks.items():
        to_end = abs(peak.x - x[-1])
        near = min(abs(peak.x - x[0]), to_end)
        if name not in (IMPACT, *SHARE.values(), *LARGEST.values()) or peak.value <= NOTABLE * static_load:
            continue
        if near < NEAR_END:
            end = "begins" if abs(peak.x - x[0]) < abs(peak.x - x[-1]) else "ends"
            warnings.append(
                f"{name.replace('_', ' ')} {peak.value / 1e3:.1f} kN lies {near * 1e3:.1f} mm from where the path {end}"
                f" (x = {peak.x * 1e3:.1f} mm): it may be an accident of the window"
            )
        elif free_end and round(FREE_END - to_end, 3) > 0:
            warnings.append(
                f"{name.replace('_', ' ')} {peak.value / 1e3:.1f} kN lies {to_end * 1e3:.1f} mm from where path and"
                f" steel end: about 1 % of it may be missing; let the run go on for {(FREE_END - to_end) * 1e3:.0f} mm"
            )
    return tuple(warnings)


def settling_end(result: PassResult) -> tuple[float, float]:
    """Time [s] and x [m] where the settling ends; NaN where there is none, or the history does not reach it."""
    time, x = result.history["time"], result.history["x"]
    end = result.settings.get("settle_time") or 0.0
    if end <= 0 or len(time) == 0 or not time[0] <= end <= time[-1]:
        return NAN, NAN
    return end, float(np.interp(end, time, x))


@lru_cache(maxsize=1)  # tables ask for one after the other of the same result
def stated_peaks(result: PassResult) -> Mapping[str, Peak]:
    """The forces that a result states, by name; where it states none, those of its history."""
    scene, rows = result.scene, settled_rows(result)
    found = force_peaks(rows, scene.direction_sign, scene.static_wheel_load, leg_end=scene.crossing.leg_end)
    usable = lambda name, peak: np.isfinite(peak.value) and (np.isfinite(peak.x) or name not in found)
    return MappingProxyType(found | {name: peak for name, peak in result.peaks.items() if usable(name, peak)})


def lost_contact(time: np.ndarray, x: np.ndarray, force: np.ndarray, static_load: float) -> list[Flight]:
    """Phases (of one row or more) in which the force is below OPEN * static_load, from the first contact on.

    time, x, force : (n,) [s, m, N]; rows with an unknown force (NaN) neither lose nor keep contact and end a phase.
    """
    touching = np.flatnonzero(force > OPEN * static_load)
    if not len(touching):
        return []
    lost = force <= OPEN * static_load
    lost[: touching[0]] = False
    edges = np.diff(np.concatenate([[0], lost.astype(int), [0]]))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
    return [Flight(x[i], x[k], time[i], time[k]) for i, k in zip(starts, ends)]


def flights(result: PassResult) -> list[Flight]:
    """Losses of contact after the settling, in the order of time; none for a model without a history."""
    rows = settled_rows(result)
    time, height = rows["time"], rows["wheel_height"]
    losses = lost_contact(time, rows["x"], rows["force"], result.scene.static_wheel_load)
    speed = np.gradient(height, time) if len(time) > 2 else np.full(len(time), NAN)
    return [replace(loss, launch_speed=float(speed[np.searchsorted(time, loss.start)])) for loss in losses]


def longest_flight(result: PassResult) -> Flight:
    """The longest; of no length where the wheel never leaves the crossing."""
    return max(flights(result), key=lambda flight: flight.length, default=Flight(0.0, 0.0, 0.0, 0.0))


def leg_flight(result: PassResult) -> Flight | None:
    """The longest flight that begins on the leg, of no length where the wheel never leaves it; None for a pass that
    does not run over it."""
    leg_end, x = result.scene.crossing.leg_end, result.history["x"]
    if not len(x) or x.min() >= leg_end:
        return None
    own = [flight for flight in flights(result) if flight.x_start < leg_end]
    return max(own, key=lambda flight: flight.length, default=Flight(0.0, 0.0, 0.0, 0.0))
