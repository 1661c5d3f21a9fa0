"""Scores as a table, and the one figure: record and result at each cut-off."""

import numpy as np
from matplotlib.figure import Figure

from rail_fem.measurement.record import QUANTITIES, Record
from rail_fem.measurement.score import Alignment, Score
from rail_fem.result.low_pass import low_pass
from rail_fem.scene.units import si_factor
from rail_fem.show.panels import Panel, panels_figure

SHOWN = {"N": "kN", "m/s^2": "m/s^2"}


def score_table(record: Record, pair: Alignment, scores: list[Score]) -> str:
    """A row a cut-off, in engineers' units."""
    unit = SHOWN[QUANTITIES[record.quantity][0]]
    factor = 1 / si_factor(unit)
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
    if unit == "kN" and record.values.mean() < 0:
        lines.append("the record's forces are negative, here a wheel that presses has a positive one: turn their sign")
    return "\n".join(lines)


def record_figure(record: Record, pair: Alignment, cutoffs: list[float], title: str) -> Figure:
    """Record and result over the position, one panel a cut-off, both filtered alike."""
    unit = SHOWN[QUANTITIES[record.quantity][0]]
    panels = []
    for cutoff in cutoffs:
        raw = np.isinf(cutoff)
        shown = lambda values, raw=raw, cutoff=cutoff: values if raw else low_pass(values, pair.rate, cutoff)
        both = {f"measured ({record.label})": pair.measured, "computed": pair.computed}
        lines = {words: (1e3 * pair.x, shown(values) / si_factor(unit)) for words, values in both.items()}
        words = "as recorded" if raw else f"both low-passed at {cutoff:g} Hz"
        panels.append(
            Panel("position x of the wheel [mm]", f"{record.quantity.replace('_', ' ')} [{unit}]", lines, words)
        )
    return panels_figure(panels, title, columns=1)
