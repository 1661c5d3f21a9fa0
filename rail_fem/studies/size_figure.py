"""Figure: reported quantities with their error bars against element size, the limit, and runs that judge the series."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from rail_fem.output.extrapolation import Limit
from rail_fem.output.quantities import REPORTED
from rail_fem.output.result import PassResult
from rail_fem.scene.units import SHOWN, show
from rail_fem.show.metal import CUBIC_MM
from rail_fem.show.style import CURVES, GREY, TOTAL, lettering, new_figure, save, scene_words
from rail_fem.studies.size_series import limits, size_of

PANELS = (
    ("impact_on_wheel", "largest_force_wing", "largest_force_nose", "transfer_x"),
    ("block_nose", "worst_100_nose", "integral_nose", "volume_3_nose"),
    ("block_wing", "worst_100_wing", "integral_wing", "volume_1_wing"),
)
TITLES = {
    "impact_on_wheel": "impact on the wheel",
    "largest_force_wing": "largest force,\nwing rail",
    "largest_force_nose": "largest force,\nnose",
    "transfer_x": "transfer from wing\nto nose, x",
    "block": "PEEQ, mean of the worst\n5 x 5 x 3 mm",
    "worst_100": "PEEQ, mean of the worst\n100 mm$^3$",
    "integral": "PEEQ over the volume,\nintegral",
    "volume_1": "volume above\n1 % PEEQ",
    "volume_3": "volume above\n3 % PEEQ",
}
MARKERS = "s^Dv"


def draw_sizes(results: Sequence[PassResult], judged: Mapping[str, PassResult], path: Path) -> Path:
    """Write the figure. results : coarse to fine, with their bars;  judged : name -> run of one of the sizes with one
    thing changed."""
    found = limits(results)
    with lettering():
        figure = new_figure(10.0)
        axes = figure.subplots(len(PANELS), len(PANELS[0]))
        for row, names in zip(axes, PANELS):
            for axis, name in zip(row, names):
                if name in found:
                    _panel(axis, name, results, judged, found[name])
                else:
                    axis.axis("off")
                    axis.text(0.5, 0.5, f"{_title(name)}:\nnone", ha="center", va="center", color=GREY)
        handles, words = next(axis.get_legend_handles_labels() for axis in axes.flat if axis.has_data())
        figure.get_layout_engine().set(rect=(0, 0.07, 1, 0.93))
        figure.legend(handles, words, loc="lower center", ncols=3)
        first, settings = results[0], results[0].settings
        stretch = f"x = {settings['start'] * 1e3:g} to {settings['end'] * 1e3:g} mm"
        what = f"One pass at several element sizes, {stretch} (PEEQ: equivalent plastic strain)"
        figure.suptitle(f"{what}\n{scene_words(first.scene)}", fontsize=14)
        return save(figure, path)


def _title(name: str) -> str:
    body = name.rpartition("_")[2]
    plain = TITLES.get(name) or f"{TITLES[name.rpartition('_')[0]]}, {body}"
    return plain


def _factor(unit: str) -> tuple[str, float]:
    return ("mm$^3$", CUBIC_MM) if unit == "m^3" else SHOWN.get(unit, (unit, 1.0))


def _panel(axis, name: str, results: Sequence[PassResult], judged: Mapping[str, PassResult], limit: Limit) -> None:
    quantity = REPORTED[name]
    unit, factor = _factor(quantity.unit)
    sizes = np.array([size_of(r) * 1e3 for r in results])
    values = np.array([quantity.of(r) for r in results]) * factor
    bars = np.array([r.error_bars.get(name, np.nan) for r in results]) * factor
    axis.axhspan(*(factor * (limit.value + side * limit.doubt) for side in (-1, 1)), color="#DDDDDD", zorder=0)
    axis.axhline(
        factor * limit.value, color=GREY, ls="--", lw=1.2, label="limit by second order, with its doubt (grey)"
    )
    axis.plot(sizes, values, "-", color=TOTAL, lw=0.8)
    known = np.isfinite(bars)
    axis.errorbar(
        sizes[known],
        values[known],
        bars[known],
        fmt="o",
        color=TOTAL,
        capsize=5,
        ms=6,
        label="run, bar by its coarse twin",
    )
    if (~known).any():
        axis.plot(sizes[~known], values[~known], "o", mfc="white", color=TOTAL, ms=6, label="run without a coarser one")
    for (words, result), colour, marker in zip(judged.items(), CURVES[1:], MARKERS):
        axis.plot(
            [1e3 * size_of(result)], [factor * quantity.of(result)], marker, mfc="none", mew=1.8, ms=9, color=colour,
            ls="none", label=f"{words}, {show(size_of(result), 'mm', 2)}",
        )  # fmt: skip
    axis.set_xscale("log")
    axis.set_xticks(sizes, [f"{size:g}" for size in sizes])
    axis.minorticks_off()
    axis.set_xlim(0.8 * sizes.min(), 1.25 * sizes.max())
    axis.set_title(_title(name), fontsize=12)
    axis.set_xlabel("element size [mm]")
    axis.set_ylabel(f"[{unit}]")
