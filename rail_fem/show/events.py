"""What happens on a history's way: end of settling, peaks, transfer, phases of lost contact. Arrays in, numbers out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rail_fem.result import NAN, PassResult, Peak

OPEN = 1e-3  # contact is lost where the force is below this part of the static load


@dataclass(frozen=True)
class Loss:
    """A phase without contact: x [m] and time [s] of its first and last row."""

    x_start: float
    x_end: float
    start: float
    end: float


def settling_end(result: PassResult) -> tuple[float, float]:
    """Time [s] and x [m] where the settling ends; NaN where there is none, or the history does not reach it."""
    time, x = result.history["time"], result.history["x"]
    end = result.settings.get("settle_time") or 0.0
    if end <= 0 or len(time) == 0 or not time[0] <= end <= time[-1]:
        return NAN, NAN
    return end, float(np.interp(end, time, x))


def lost_contact(time: np.ndarray, x: np.ndarray, force: np.ndarray, static_load: float) -> list[Loss]:
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
    return [Loss(x[i], x[k], time[i], time[k]) for i, k in zip(starts, ends)]


def peak_force(result: PassResult, name: str) -> Peak | None:
    """The peak that the run states, or else the largest value of the history after the settling; None without contact there."""
    stated = result.peaks.get(name)
    if stated is not None and np.isfinite([stated.value, stated.x]).all():
        return stated
    history = result.history
    end, _ = settling_end(result)
    after = history["time"] >= end if np.isfinite(end) else np.ones(len(history["time"]), bool)
    values = np.where(after, history[name], np.nan)
    if not np.nanmax(values, initial=0.0) > 0:
        return None
    at = int(np.nanargmax(values))
    return Peak(float(values[at]), "N", x=float(history["x"][at]), time=float(history["time"][at]))
