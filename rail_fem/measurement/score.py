"""A result held against a record: both filtered alike, aligned by position, scored; the scores as a table, and the one
figure, record and result at each cut-off."""

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from scipy.signal import coherence

from rail_fem.measurement.record import QUANTITIES, Record, RecordError
from rail_fem.result.low_pass import CUTOFFS, is_its_own, low_pass
from rail_fem.scene.units import SHOWN
from rail_fem.show.panels import Panel, panels_figure

LEAST_OVERLAP = 0.5  # of the shorter record, that an alignment must keep
MOST_SAMPLES = 5_000_000  # of record or result, both sampled alike
MOST_PRODUCTS = 1e11  # of samples in the search for the best shift: some minutes
NO_DEVIATION = 1e-9  # of a constant from its mean, over the constant: beyond the digits of a file, or round-off
LONGEST_PERIOD = 0.1  # of the low pass for the alignment, of the shorter record: its ends are the filter's, not theirs
LEAST_MEAN = 0.1  # over the largest, of forces that hold the static load
SEGMENTS = 4  # of the common stretch, over which coherence is averaged (with half overlap)


@dataclass(frozen=True)
class Score:
    """How a result meets a record after a low pass at `cutoff` [Hz].

    measured, computed : peaks [SI], NaN where they are those of the filter's ends;  offset : how far the computed one
        lies beyond the measured one [m]
    difference : L2 of the difference over L2 of the measured deviation from its mean, both but for the filter's ends;
        NaN for a constant record, or one that is nothing else
    coherence : mean up to the cut-off, weighted by the measured power; NaN where the stretch is too short
    """

    cutoff: float
    measured: float
    computed: float
    offset: float
    difference: float
    coherence: float


@dataclass(frozen=True, eq=False)
class Alignment:
    """shift : added to the record's position [m];  x : (n,) common positions [m];  measured, computed : (n,) raw there;
    rate : samples per second of both [Hz]"""

    shift: float
    x: np.ndarray
    measured: np.ndarray
    computed: np.ndarray
    rate: float


def align(record: Record, own: Record, reach: float | None) -> Alignment:
    """Move a record along the track to where it meets the result best, or leave it where it is.

    The shift is that of the largest normalised correlation of both, low-passed at 50 Hz or, of short ones, at ten
    periods to the shorter, to a fraction of a sample's distance (parabola through three shifts).
    reach : the largest shift looked at [m]; None: any; 0: as its positions say
    Errors: RecordError where both do not overlap, or nowhere rise and fall alike.
    """
    rate = max(record.rate, own.rate)
    step = abs(own.position[-1] - own.position[0]) / (len(own.position) - 1) * own.rate / rate
    sign = np.sign(own.position[-1] - own.position[0])
    far = lambda r: sign * r.position  # growing
    for one in (record, own):
        if not np.ptp(one.position) <= MOST_SAMPLES * step:
            raise RecordError(
                f"{one.label} over {np.ptp(one.position):.4g} m at the higher rate of both, {rate:.4g} Hz, has"
                f" {np.ptp(one.position) / step:.2g} samples, at most {MOST_SAMPLES:g} are held against each other: is"
                f" {record.label}'s unit of time or length right? Else cut it to the pass"
            )
    u, v = (np.arange(far(r)[0], far(r)[-1] + 1e-9, step) for r in (record, own))
    a, b = np.interp(u, far(record), record.values), np.interp(v, far(own), own.values)
    shift = 0.0
    if reach != 0:
        cutoff = min(max(CUTOFFS[1], rate / (LONGEST_PERIOD * min(len(a), len(b)))), rate / 4)
        smooth_record, smooth_own = (low_pass(values, rate, cutoff) for values in (a, b))
        shift = _best_shift(smooth_record, smooth_own, u[0], v[0], step, reach)
    low, high = max(u[0] + shift, v[0]), min(u[-1] + shift, v[-1])
    if high - low < 10 * step:
        raise RecordError(
            f"{record.label} covers x = {sign * (u[0] + shift):g} to {sign * (u[-1] + shift):g} m, the result"
            f" {sign * v[0]:g} to {sign * v[-1]:g} m: they do not overlap; let it be aligned, or run farther"
        )
    x = np.arange(low, high, step)
    return Alignment(float(sign * shift), sign * x, np.interp(x - shift, u, a), np.interp(x, v, b), rate)


def _best_shift(
    a: np.ndarray, b: np.ndarray, first_a: float, first_b: float, step: float, reach: float | None
) -> float:
    """Shift of a [m] at which its correlation with b over their overlap is largest."""
    least = int(LEAST_OVERLAP * min(len(a), len(b)))
    if reach is None and (len(a) + len(b)) * min(len(a), len(b)) > MOST_PRODUCTS:
        raise RecordError(f"{len(a)} samples against {len(b)}, moved anywhere: give a largest shift, or cut the record")
    lags = np.arange(-(len(a) - least), len(b) - least + 1)  # a's first sample lies on b's sample `lag`
    shifts = first_b + lags * step - first_a
    if reach is not None:
        lags, shifts = lags[np.abs(shifts) <= reach], shifts[np.abs(shifts) <= reach]
    if not len(lags):
        raise RecordError(f"no shift within {reach:g} m lets half of the record overlap the result")
    found = np.array([_correlation(a[max(0, -k) : len(b) - k], b[max(0, k) : len(a) + k]) for k in lags])
    k = int(np.argmax(found))
    if not found[k] > 0:
        raise RecordError(
            "no shift at which record and result rise and fall alike: is the record of this pass, and does it vary?"
            ' --reach "0 mm" leaves it where it is'
        )
    if not 0 < k < len(found) - 1:
        return float(shifts[k])
    before, here, after = found[k - 1 : k + 2]
    bend = before - 2 * here + after
    return float(shifts[k] + (0.5 * (before - after) / bend * step if bend < 0 else 0.0))


def _correlation(a: np.ndarray, b: np.ndarray) -> float:
    most = NO_DEVIATION * np.linalg.norm(a), NO_DEVIATION * np.linalg.norm(b)
    a, b = a - a.mean(), b - b.mean()
    size = np.linalg.norm(a), np.linalg.norm(b)
    return float(a @ b / (size[0] * size[1])) if size[0] > most[0] and size[1] > most[1] else 0.0


def score(pair: Alignment, cutoff: float) -> Score:
    """Both low-passed alike, then compared."""
    measured, computed = (low_pass(values, pair.rate, cutoff) for values in (pair.measured, pair.computed))
    one, two = int(np.argmax(np.abs(measured))), int(np.argmax(np.abs(computed)))
    time = np.arange(len(pair.x)) / pair.rate
    own = is_its_own(time, np.arange(len(time)), cutoff)
    known = np.where(own[[one, two]], 1.0, np.nan)
    within, apart = measured[own], (computed - measured)[own]
    deviation = np.linalg.norm(within - within.mean()) if len(within) else 0.0
    return Score(
        cutoff,
        float(measured[one] * known[0]),
        float(computed[two] * known[1]),
        float((pair.x[two] - pair.x[one]) * known.prod()),
        float(np.linalg.norm(apart) / deviation) if deviation > NO_DEVIATION * np.linalg.norm(within) else np.nan,
        _coherence(pair, cutoff),
    )


def _coherence(pair: Alignment, cutoff: float) -> float:
    length = 2 * len(pair.x) // (SEGMENTS + 1)
    if length < 16 or pair.rate / length > cutoff / 2:
        return np.nan
    with np.errstate(invalid="ignore"):  # of a constant: NaN
        frequency, found = coherence(pair.measured, pair.computed, fs=pair.rate, nperseg=length)
    power = np.abs(np.fft.rfft(pair.measured[:length] - pair.measured.mean())) ** 2
    inside = (frequency > 0) & (frequency <= cutoff)
    weight = power[: len(frequency)][inside]
    return float(np.average(found[inside], weights=weight)) if weight.sum() > 0 else np.nan


def score_table(record: Record, pair: Alignment, scores: list[Score]) -> str:
    """A row a cut-off, in engineers' units."""
    unit, factor = _shown(record)
    lines = [
        f"{record.label}: {record.quantity}, {len(record.values)} samples at {record.rate:.4g} Hz, moved by"
        f" {1e3 * pair.shift:+.1f} mm",
        f"{'low pass':>10}{'measured':>13}{'computed':>13}{'ratio':>10}{'peak beyond':>14}{'L2 difference':>15}"
        f"{'coherence':>11}",
    ]
    for one in scores:
        name = "none" if np.isinf(one.cutoff) else f"{one.cutoff:g} Hz"
        seen = "-" if np.isnan(one.coherence) else f"{one.coherence:.3f}"
        apart = "-" if np.isnan(one.difference) else f"{100 * one.difference:.1f} %"
        ratio = one.computed / one.measured if one.measured else np.nan
        told = (f"{one.measured * factor:.4g} {unit}", f"{one.computed * factor:.4g} {unit}", f"{ratio:.3f}")
        cells = (*told, f"{1e3 * one.offset:+.1f} mm")
        peaks = ("-" if cell.startswith(("nan", "+nan")) else cell for cell in cells)
        lines.append(
            f"{name:>10}" + "".join(f"{p:>{n}}" for p, n in zip(peaks, (13, 13, 10, 14))) + f"{apart:>15}{seen:>11}"
        )
    if any(np.isnan([one.measured, one.computed]).any() for one in scores):
        lines.append("peaks -: in a record shorter than two periods, or within one of its end, they are the filter's")
    mean = record.values.mean()
    if unit == "kN" and mean < LEAST_MEAN * np.abs(record.values).max():
        lines.append(
            f"the record's mean is {mean * factor:.3g} kN: forces here hold the static load, positive where a wheel"
            " presses: add it, or turn their sign"
        )
    return "\n".join(lines)


def _shown(record: Record) -> tuple[str, float]:
    """Unit in which a record is shown, and how many of it an SI unit is."""
    si = QUANTITIES[record.quantity][0]
    return SHOWN.get(si, (si, 1.0))


def record_figure(record: Record, pair: Alignment, cutoffs: list[float], title: str) -> Figure:
    """Record and result over the position, one panel a cut-off, both filtered alike."""
    (unit, factor), panels = _shown(record), []
    for cutoff in cutoffs:
        raw = np.isinf(cutoff)
        shown = lambda values, raw=raw, cutoff=cutoff: values if raw else low_pass(values, pair.rate, cutoff)
        both = {f"measured ({record.label})": pair.measured, "computed": pair.computed}
        lines = {words: (1e3 * pair.x, factor * shown(values)) for words, values in both.items()}
        words = "as recorded" if raw else f"both low-passed at {cutoff:g} Hz"
        panels.append(
            Panel("position x of the wheel [mm]", f"{record.quantity.replace('_', ' ')} [{unit}]", lines, words)
        )
    return panels_figure(panels, title, columns=1)
