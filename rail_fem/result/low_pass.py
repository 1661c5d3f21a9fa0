"""Low-pass filtering of histories: one filter for results, measurements and figures.

Butterworth of fourth order run forwards and backwards, so that peaks stay where they are: no phase, 6 dB at the
cut-off, eighth-order roll-off. The trade quotes P2 as a force low-passed at 20 Hz. Its weights have both signs: of a
step it makes 1.07, and of a broad peak more than was there.

A peak of what is filtered is one of the record only where the filter's length lies on it to both sides: ends are
carried on with their values, and a record that ends high is highest there.
"""

from collections.abc import Mapping

import numpy as np
from scipy.signal import butter, sosfiltfilt

from rail_fem.result.events import settled_rows
from rail_fem.result.result import PassResult, Peak

CUTOFFS = (20.0, 50.0, 500.0)  # customary [Hz]
ORDER = 4
MOST_OF_NYQUIST = 0.9  # a cut-off beyond leaves a record as it is
LEAST_PERIODS = 1e-4  # of the cut-off in a record: below that it is a constant, carried on for hours
PERIODS = 2.0  # of the cut-off by which a record is carried on at both ends, with its end values
LENGTH = 1.0  # of the filter to either side, in periods of the cut-off: 95 % of its weights, without their signs
FILTERED = ("force", "force_wing", "force_nose", "force_longitudinal", "force_lateral", "force_other",
            "wheel_height", "crossing_height")  # fmt: skip


def low_pass(values: np.ndarray, rate: float, cutoff: float) -> np.ndarray:
    """(n,) filtered values of an evenly sampled record. rate : samples per second [Hz];  cutoff [Hz], inf: none

    Errors: ValueError for a cut-off that is not positive, or values that are not finite.
    """
    values = np.asarray(values, float)
    if not (cutoff > 0 and np.isfinite(rate) and rate > 0):
        raise ValueError(f"low pass: cut-off {cutoff:g} Hz and rate {rate:g} Hz must be positive")
    if not np.isfinite(values).all():
        raise ValueError(f"low pass: {np.sum(~np.isfinite(values))} of {values.size} value(s) are not finite")
    if is_left(rate, cutoff) or len(values) < 3:
        return values.copy()
    if cutoff * len(values) < LEAST_PERIODS * rate:
        raise ValueError(
            f"low pass: a record of {len(values) / rate:.3g} s has less than {LEAST_PERIODS:g} periods of {cutoff:g} Hz"
        )
    pad = int(np.ceil(PERIODS * rate / cutoff))
    longer = np.concatenate([np.full(pad, values[0]), values, np.full(pad, values[-1])])
    filtered = sosfiltfilt(butter(ORDER, cutoff, fs=rate, output="sos"), longer, padtype=None)
    return filtered[pad : pad + len(values)]


def is_left(rate: float, cutoff: float) -> bool:
    """Whether a record of so many samples per second [Hz] passes a filter of this cut-off [Hz] as it is."""
    return cutoff >= MOST_OF_NYQUIST * rate / 2


def is_its_own(time: np.ndarray, row: int | np.ndarray, cutoff: float) -> np.ndarray:
    """Whether what is filtered at a row, or at each of (m,) rows, is the record's and not that of its ends. time : (n,)
    [s]"""
    return np.asarray(np.minimum(time[row] - time[0], time[-1] - time[row]) >= LENGTH / cutoff)


def evenly(time: np.ndarray, *columns: np.ndarray) -> tuple[np.ndarray, ...]:
    """Time (m,) at the smallest step of `time` (n,), and the columns there, linear between their rows."""
    step = float(np.min(np.diff(time)))
    even = np.linspace(time[0], time[-1], max(int(round((time[-1] - time[0]) / step)), 2) + 1)
    return (even, *(np.interp(even, time, column) for column in columns))


def low_passed(history: Mapping[str, np.ndarray], cutoff: float) -> dict[str, np.ndarray]:
    """A history with its forces and heights low-passed, other columns as they are; columns that are not resolved
    throughout are left."""
    time = history["time"]
    found = dict(history)
    if len(time) < 3:
        return found
    for name in FILTERED:
        if name in history and np.isfinite(history[name]).all():
            even, values = evenly(time, history[name])
            found[name] = np.interp(time, even, low_pass(values, 1 / (even[1] - even[0]), cutoff))
    return found


def filtered_force(result: PassResult, cutoff: float) -> float:
    """Value of `filtered_peak` [N], NaN where there is none."""
    peak = filtered_peak(result, cutoff)
    return np.nan if peak is None else peak.value


def filtered_peak(result: PassResult, cutoff: float) -> Peak | None:
    """The largest low-passed force on the wheel after the settling; None without a history of a force, and where it is
    none of the record's: the record is shorter than two of the filter's LENGTH, or ends within one of it."""
    rows = settled_rows(result)
    if len(rows["time"]) < 3 or not np.isfinite(rows["force"]).all():
        return None
    force = low_passed({"time": rows["time"], "force": rows["force"]}, cutoff)["force"]
    best = int(np.argmax(force))
    if not is_its_own(rows["time"], best, cutoff):
        return None
    return Peak(float(force[best]), "N", x=float(rows["x"][best]), time=float(rows["time"][best]))


def overshoot(result: PassResult, peak: Peak) -> str:
    """What is to be said of a `filtered_peak` above all of the force that was filtered; "" where it is not."""
    above = peak.value > settled_rows(result)["force"].max()
    return ", above the force itself: the filter overshoots" if above else ""
