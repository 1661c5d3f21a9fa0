"""Figures of a pass at several element sizes: reported quantities with their bars and limits; speed against error."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from rail_fem.output.extrapolation import Limit
from rail_fem.output.quantities import REPORTED
from rail_fem.output.result import PassResult
from rail_fem.scene.units import SHOWN, show
from rail_fem.show.metal import CUBIC_MM
from rail_fem.show.panels import new_panels, titled
from rail_fem.show.style import CURVES, GREY, TOTAL, new_figure, scene_words
from rail_fem.studies.size_series import limits, size_of
from rail_fem.sweeps.compare import core_seconds

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
    "worst_100": "PEEQ, mean of the worst\n100 mm³",
    "integral": "PEEQ over the volume,\nintegral",
    "volume_1": "volume above\n1 % PEEQ",
    "volume_3": "volume above\n3 % PEEQ",
}
COST_PANELS = {
    "Forces": {"impact_on_wheel": "impact on the wheel", "largest_force_wing": "largest force, wing rail"},
    "Plastic strain (PEEQ)": {
        "block_nose": "worst 5 x 5 x 3 mm, nose",
        "block_wing": "worst 5 x 5 x 3 mm, wing rail",
        "integral_nose": "integral, nose",
        "integral_wing": "integral, wing rail",
    },
}
MARKERS = "osD^"
LEAST = 1e-4  # of an error that is drawn: a smaller one stands there


def draw_sizes(results: Sequence[PassResult]) -> Figure:
    """results : coarse to fine, with their bars"""
    found = limits(results)
    figure, axes = new_panels(10.0, len(PANELS), len(PANELS[0]))
    for axis, name in zip(axes.flat, [name for names in PANELS for name in names]):
        if name in found:
            _panel(axis, name, results, found[name])
        else:
            axis.axis("off")
            axis.text(0.5, 0.5, f"{_title(name)}:\nnone", ha="center", va="center", color=GREY)
    handles, words = next(axis.get_legend_handles_labels() for axis in axes.flat if axis.has_data())
    figure.get_layout_engine().set(rect=(0, 0.07, 1, 0.93))
    figure.legend(handles, words, loc="lower center", ncols=3)
    what = f"One pass at several element sizes, {stretch(results)} (PEEQ: equivalent plastic strain)"
    return titled(figure, f"{what}\n{scene_words(results[0].scene)}")


def stretch(results: Sequence[PassResult]) -> str:
    """Which part of the crossing was run over."""
    settings = results[0].settings
    return f"x = {settings['start'] * 1e3:g} to {settings['end'] * 1e3:g} mm"


def _title(name: str) -> str:
    body = name.rpartition("_")[2]
    plain = TITLES.get(name) or f"{TITLES[name.rpartition('_')[0]]}, {body}"
    return plain


def _factor(unit: str) -> tuple[str, float]:
    return ("mm³", CUBIC_MM) if unit == "m^3" else SHOWN.get(unit, (unit, 1.0))


def _panel(axis, name: str, results: Sequence[PassResult], limit: Limit) -> None:
    quantity = REPORTED[name]
    unit, factor = _factor(quantity.unit)
    sizes = np.array([size_of(r) * 1e3 for r in results])
    values = np.array([quantity.of(r) for r in results]) * factor
    bars = np.array([r.error_bars.get(name, np.nan) for r in results]) * factor
    axis.axhspan(*(factor * (limit.value + side * limit.doubt) for side in (-1, 1)), color="#DDDDDD", zorder=0)
    words = "limit by second order, with its doubt (grey)"
    axis.axhline(factor * limit.value, color=GREY, ls="--", lw=1.2, label=words)
    axis.plot(sizes, values, "-", color=TOTAL, lw=0.8)
    known = np.isfinite(bars)
    look = {"fmt": "o", "color": TOTAL, "capsize": 5, "ms": 6}
    axis.errorbar(sizes[known], values[known], bars[known], label="run, bar by its coarse twin", **look)
    if (~known).any():
        axis.plot(sizes[~known], values[~known], "o", mfc="white", color=TOTAL, ms=6, label="run without a coarser one")
    axis.set_xscale("log")
    axis.set_xticks(sizes, [f"{size:g}" for size in sizes])
    axis.minorticks_off()
    axis.set_xlim(0.8 * sizes.min(), 1.25 * sizes.max())
    axis.set_title(_title(name), fontsize=12)
    axis.set_xlabel("element size [mm]")
    axis.set_ylabel(f"[{unit}]")


def draw_cost(results: Sequence[PassResult]) -> Figure:
    """How far each run is from the limit of vanishing elements, and what it cost; results : coarse to fine."""
    found, figure = limits(results), new_figure(7.5)
    costs = [core_seconds(r) for r in results]
    for axis, (title, names) in zip(figure.subplots(1, len(COST_PANELS), sharex=True), COST_PANELS.items()):
        for (name, words), colour, marker in zip(names.items(), CURVES, MARKERS):
            if name not in found or not found[name].value:
                continue
            limit, scale = found[name], abs(found[name].value)
            errors = [100 * max(abs(REPORTED[name].of(r) - limit.value) / scale, LEAST) for r in results]
            doubt = [[0.0] * len(errors), [100 * limit.doubt / scale] * len(errors)]
            axis.errorbar(costs, errors, yerr=doubt, color=colour, marker=marker, ms=7, lw=1.2, capsize=3, label=words)
        for cost, result in zip(costs, results):
            axis.axvline(cost, color=GREY, lw=0.7, ls=":", zorder=0)
            axis.text(cost, 900, show(size_of(result), "mm", 2), rotation=90, va="top", ha="right", color=GREY)
        axis.set(xscale="log", yscale="log", ylim=(100 * LEAST / 8, 1000), title=title)
        axis.set(xlabel="core seconds of the pass", ylabel="error against the limit [%]")
        axis.legend(loc="lower left", fontsize=10)
    return titled(
        figure,
        f"Speed against error of the explicit model, {stretch(results)};\nbars: what is not known of the limit."
        f" {scene_words(results[0].scene)}",
        12,
    )
