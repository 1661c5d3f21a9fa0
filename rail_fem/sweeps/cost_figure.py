"""Figure of a comparison: cost against error of each result, and their force histories."""

import numpy as np
from matplotlib.figure import Figure

from rail_fem.show.panels import curve, legend_above, new_panels, ring, titled
from rail_fem.show.style import GREEN, GREY, NOSE, ORANGE, PURPLE, SKY, TOTAL, WING, scene_words
from rail_fem.sweeps.compare import QUANTITIES, SHARE, Comparison, core_seconds

MARKERS = {  # of a quantity; colours belong to the runs
    "impact on the wheel": "o",
    SHARE: "X",
    "largest wing force": "s",
    "largest force": "^",
    "largest nose force": "v",
    "history": "D",
    "strain": "P",
}
CURVES = (WING, NOSE, GREEN, PURPLE, ORANGE, SKY)
LABELS = (0.02, 0.26)  # heights of the names, in turn, so that neighbours do not cover one another
LEAST = 1e-4  # errors below are drawn here
NAMES = 0.5  # of the height, from the bottom, that is kept for names


def cost_figure(comparison: Comparison) -> Figure:
    """Error against the reference over core seconds, both logarithmic; force histories beneath."""
    figure, (above, below) = new_panels(11.0, 2, 1, height_ratios=[1.2, 1])
    draw_errors(above, comparison)
    draw_histories(below, comparison)
    reference = comparison.names[comparison.results.index(comparison.reference)]
    return titled(figure, f"Cost against error, held against {reference}\n{scene_words(comparison.reference.scene)}")


def draw_errors(axes, comparison: Comparison) -> None:
    """Difference to the reference over core seconds, a mark a quantity."""
    for quantity, marker in MARKERS.items():
        rows = [
            (core_seconds(r), abs(comparison.error(r, quantity)))
            for r in comparison.results
            if r is not comparison.reference
        ]
        cost, error = np.array([row for row in rows if np.isfinite(row[1])]).reshape(-1, 2).T
        if len(cost):
            ring(axes, cost, np.maximum(error, LEAST), marker, TOTAL, QUANTITIES[quantity].meaning, 11, 2.2)
    for i, (name, result) in enumerate(zip(comparison.names, comparison.results)):
        axes.axvline(core_seconds(result), color=GREY, ls=":", lw=1)
        text = f"{name} (reference)" if result is comparison.reference else name
        place = {"rotation": 90, "ha": "right", "va": "bottom", "fontsize": 11}
        at = core_seconds(result), LABELS[i % len(LABELS)]
        axes.annotate(text, at, (-4, 0), ("data", "axes fraction"), textcoords="offset points", **place)
    axes.set(xscale="log", yscale="log", xlabel="time of the model itself [core seconds]", ylabel="relative error [1]")
    low, high = axes.get_ylim()
    axes.set_ylim(low * (low / high) ** (NAMES / (1 - NAMES)), high)
    legend_above(axes, borderaxespad=None)


def draw_histories(axes, comparison: Comparison) -> None:
    """Force on the whole wheel over the reference's path."""
    path = comparison.reference.history["x"]
    for name, result, colour in zip(comparison.names, comparison.results, _colours(comparison)):
        if len(result.history["x"]) and np.isfinite(result.history["force"]).any():
            look = {"width": 2.6, "zorder": 3} if result is comparison.reference else {"width": 1.6, "zorder": 2}
            curve(axes, 1e3 * result.history["x"], result.history["force"] / 1e3, name, colour, **look)
    load = comparison.reference.scene.static_wheel_load
    axes.axhline(load / 1e3, color=GREY, ls="--", lw=1.4, label="static wheel load")
    if len(path):
        axes.set_xlim(1e3 * path.min(), 1e3 * path.max())
    axes.set(xlabel="position x of the wheel's centre [mm]", ylabel="vertical force [kN]")
    axes.legend(loc="upper left", ncols=2)


def _colours(comparison: Comparison) -> list[str]:
    others = iter(CURVES * (len(comparison.results) // len(CURVES) + 1))
    return [TOTAL if result is comparison.reference else next(others) for result in comparison.results]
