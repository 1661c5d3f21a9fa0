"""Figure: speed against error of the explicit model: how far each run is from the limit of vanishing elements, and what
it cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from rail_fem.output.extrapolation import Limit
from rail_fem.output.quantities import REPORTED
from rail_fem.output.result import PassResult
from rail_fem.scene.units import show
from rail_fem.show.style import CURVES, GREY, lettering, new_figure, save, scene_words
from rail_fem.studies.size_series import limits, size_of
from rail_fem.sweeps.compare import core_seconds

PANELS = {
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


def draw_cost(results: Sequence[PassResult], judged: Mapping[str, PassResult], path: Path) -> Path:
    """Write the figure. results : coarse to fine;  judged : name -> run of one of the sizes with one thing changed."""
    found = limits(results)
    first, settings = results[0], results[0].settings
    with lettering():
        figure = new_figure(7.5)
        axes = figure.subplots(1, len(PANELS), sharex=True)
        for axis, (title, names) in zip(axes, PANELS.items()):
            for name, colour, marker in zip(names, CURVES, MARKERS):
                if name in found and found[name].value:
                    _errors(axis, name, names[name], found[name], results, judged.values(), colour, marker)
            _costs(axis, results, judged)
            axis.set_title(title)
            axis.set_xlabel("core seconds of the pass")
            axis.set_ylabel("error against the limit [%]")
            axis.legend(loc="lower left", fontsize=10)
        stretch = f"x = {settings['start'] * 1e3:g} to {settings['end'] * 1e3:g} mm"
        figure.suptitle(
            f"Speed against error of the explicit model, {stretch}; open: one thing changed at one size;\n"
            f"bars: what is not known of the limit. {scene_words(first.scene)}",
            fontsize=12,
        )
        return save(figure, path)


def _errors(axis, name, words, limit: Limit, results, judged, colour, marker) -> None:
    quantity, scale = REPORTED[name], abs(limit.value)
    for runs, filled in ((results, True), (judged, False)):
        costs = [core_seconds(r) for r in runs]
        errors = [max(abs(quantity.of(r) - limit.value) / scale, LEAST) for r in runs]
        above = [100 * limit.doubt / scale] * len(errors)
        axis.errorbar(
            costs, [100 * e for e in errors], yerr=[[0.0] * len(errors), above], color=colour, marker=marker, ms=7,
            mfc=colour if filled else "white", ls="-" if filled else "none", lw=1.2, elinewidth=0.8, capsize=3,
            label=words if filled else None,
        )  # fmt: skip
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_ylim(100 * LEAST / 8, 1000)  # room below for the legend, above for the names


def _costs(axis, results, judged: Mapping[str, PassResult]) -> None:
    """A line up each run's cost that names it."""
    names = {show(size_of(r), "mm", 2): r for r in results} | {
        f"{show(size_of(r), 'mm', 2)}, {words}": r for words, r in judged.items()
    }
    for words, result in names.items():
        axis.axvline(core_seconds(result), color=GREY, lw=0.7, ls=":", zorder=0)
        axis.text(core_seconds(result), 900, words, rotation=90, va="top", ha="right", fontsize=9, color=GREY, zorder=0)
