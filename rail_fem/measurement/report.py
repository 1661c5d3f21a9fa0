"""Scores as a table, and the one figure: record and result at each cut-off."""

import numpy as np
from matplotlib.figure import Figure

from rail_fem.measurement.record import QUANTITIES, Record
from rail_fem.measurement.score import Alignment, Score
from rail_fem.output.low_pass import low_pass
from rail_fem.scene.units import si_factor
from rail_fem.show.panels import titled
from rail_fem.show.style import NOSE, TOTAL, new_figure

SHOWN = {"N": "kN", "m/s^2": "m/s^2"}


def score_table(record: Record, pair: Alignment, scores: list[Score]) -> str:
    """A row a cut-off, in engineers' units."""
    unit = SHOWN[QUANTITIES[record.quantity][0]]
    factor = 1 / si_factor(unit)
    lines = [
        f"{record.label}: {record.quantity}, {len(record.values)} samples at {record.rate:.4g} Hz, moved by"
        f" {1e3 * pair.shift:+.1f} mm",
        f"{'low pass':>10}{'measured':>13}{'computed':>13}{'ratio':>8}{'peak beyond':>14}{'L2 difference':>15}"
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
            f"{name:>10}" + "".join(f"{p:>{n}}" for p, n in zip(peaks, (13, 13, 8, 14))) + f"{apart:>15}{seen:>11}"
        )
    return "\n".join(lines)


def record_figure(record: Record, pair: Alignment, cutoffs: list[float], title: str) -> Figure:
    """Record and result over the position, one panel a cut-off, both filtered alike."""
    unit = SHOWN[QUANTITIES[record.quantity][0]]
    figure = new_figure(3.0 * len(cutoffs) + 1.5)
    panels = np.atleast_1d(figure.subplots(len(cutoffs), 1, sharex=True))
    for axes, cutoff in zip(panels, cutoffs):
        raw = np.isinf(cutoff)
        for values, words, colour, width in (
            (pair.measured, f"measured ({record.label})", NOSE, 2.4),
            (pair.computed, "computed", TOTAL, 1.6),
        ):
            shown = values if raw else low_pass(values, pair.rate, cutoff)
            axes.plot(1e3 * pair.x, shown / si_factor(unit), color=colour, lw=width, label=words)
        axes.set_title("as recorded" if raw else f"both low-passed at {cutoff:g} Hz", loc="left")
        axes.set_ylabel(f"{record.quantity.replace('_', ' ')}\n[{unit}]")
    panels[0].legend(ncols=2)
    panels[-1].set_xlabel("position x of the wheel [mm], 0 where the gauge lines intersect")
    return titled(figure, title)
