"""Figure of the contact force and of the heights of wheel and crossing over the running distance."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from geometry.surfaces.crossing import CrossingError
from rail_fem.contact.rigid import rigid_path
from rail_fem.result.events import IMPACT, LARGEST, LEG, SHARE, settling_end, stated_peaks
from rail_fem.result.quantities import FORCES as QUANTITIES
from rail_fem.result.result import PassResult, Peak
from rail_fem.scene.crossing import JOINT
from rail_fem.show.panels import curve, legend_above, new_panels, ring
from rail_fem.show.positions import label_distance, mark_positions
from rail_fem.show.style import BODY, GREY, HALO, ORANGE, PURPLE, TOTAL, align_labels, give_title, words_instead

PATH_POINTS = 150  # of the rigid wheel path
FORCES = (
    ("force", "whole wheel", TOTAL, 3.0, 2.0),
    ("force_wing", "on the wing rail", BODY["wing"], 1.4, 2.2),
    ("force_nose", "on the nose", BODY["nose"], 1.4, 2.3),
)
# named in the legend: peak, marker, colour
MARKED = ((IMPACT, "*", TOTAL), *((share, "D", PURPLE) for share in SHARE.values()), (LEG, "s", ORANGE))
WORDS = 0.105, 0.045  # width and height of a value with its bar, of the axes


def force_figure(result: PassResult, title: str = "", ax: Any = None) -> Any:
    """Force above; wheel with the rigid wheel's path, and crossing, beneath.

    Parameters
    ----------
    result : PassResult
        With its history.
    title : str, optional
        None: the model.
    ax : matplotlib Axes, optional
        One's own, on which the forces alone are drawn.

    Returns
    -------
    matplotlib Figure, or `ax`

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> scene = rail_fem.load_case(rail_fem.example("nose_transfer")).scene
    >>> result = rail_fem.solve("lumped", scene, {"start": "300 mm", "end": "400 mm"})
    >>> rail_fem.plot_force(result, ax=Figure().subplots()).get_ylabel()
    'vertical force [kN]'
    """
    name = title or result.model
    history = result.history
    if ax is not None:
        draw_forces(ax, result)
        label_distance(ax, result)
        return ax
    if len(history["x"]) == 0 or not np.isfinite(history["force"]).any():
        why = "has no rows" if len(history["x"]) == 0 else "holds no contact force"
        return words_instead(f"{name}: the history {why}, so there is no force to draw. {result.fault}")
    figure, (above, middle, below) = new_panels(11.5, 3, 1, sharex=True, height_ratios=[2.4, 1.5, 1])
    draw_forces(above, result)
    draw_wheel(middle, result)
    draw_crossing(below, result)
    label_distance(below, result)
    align_labels(figure)
    give_title(figure, "Contact force and heights", name, result)
    return figure


def resolved_forces(result: PassResult) -> list[tuple[str, str, str, float, float]]:
    """The rows of FORCES that the result has, in the words of its crossing: a joint has no nose."""
    crossing = result.scene.crossing
    return [
        (column, crossing.told(words), colour, width, order)
        for column, words, colour, width, order in FORCES
        if np.isfinite(result.history[column]).any() and (column, crossing.family) != ("force_nose", JOINT)
    ]


def draw_forces(axes, result: PassResult) -> None:
    """Forces over x in kN, the largest of each named in the legend."""
    history, peaks, bars, crossing = result.history, stated_peaks(result), result.error_bars, result.scene.crossing
    marks = []
    for column, words, colour, width, order in resolved_forces(result):
        values, peak = history[column], peaks.get(LARGEST[column])
        found = f"largest {peak.value / 1e3:.1f} kN at x = {peak.x * 1e3:.1f} mm" if peak else "never touched"
        axes.plot(1e3 * history["x"], values / 1e3, color=colour, lw=width, zorder=order, label=f"{words}: {found}")
        if peak and column != "force":
            marks.append((LARGEST[column], "o", colour))
    rings, pale = [], "pale bar: what is left out moves it by (form)"
    whose = "thin bar: elements, calibrated on other scenes" if result.calibrated else "_nolegend_"
    for name, marker, colour in (*MARKED, *marks):
        if peak := peaks.get(name):
            found = f"{crossing.told(QUANTITIES[name])}: {peak.value / 1e3:.1f} kN at x = {peak.x * 1e3:.1f} mm"
            bar, form = bars.get(name, 0.0), result.form_bar(name)
            if form > 0:
                axes.errorbar(
                    1e3 * peak.x, peak.value / 1e3, form / 1e3, color=colour, lw=7, alpha=0.25, zorder=2.9, label=pale
                )
                pale = "_nolegend_"
            mark_peak(
                axes, peak, marker, colour, found if (name, marker, colour) in MARKED else "_nolegend_", bar, whose
            )
            whose = "_nolegend_"
            rings.append((peak, colour, bar))
    load = result.scene.static_wheel_load
    axes.axhline(load / 1e3, color=GREY, ls="--", lw=1.6, zorder=1.5, label=f"static wheel load: {load / 1e3:.1f} kN")
    mark_positions(axes, result)
    axes.margins(y=0.1)
    axes.set_ylim(bottom=-0.03 * axes.get_ylim()[1])
    axes.set_ylabel("vertical force [kN]")
    write_values(axes, rings)
    legend_above(axes)


def mark_peak(axes, peak: Peak, marker: str, colour: str, words: str, bar: float, whose: str = "_nolegend_") -> None:
    """A ring around a force with its error bar [N]; whose : the bar is, in words for the legend."""
    x, force = 1e3 * peak.x, peak.value / 1e3
    if bar > 0:
        axes.errorbar(x, force, yerr=bar / 1e3, color=colour, capsize=5, lw=2, zorder=3, label=whose)
    ring(axes, x, force, marker, colour, words, size=15 if marker == "*" else 9, zorder=3)


def write_values(axes, rings: Sequence[tuple[Peak, str, float]]) -> None:
    """Value and error bar beside each ring, once where several stand on one force, clear of one another. rings : peak,
    colour, bar [N]"""
    written: list[tuple[float, float]] = []  # left, foot; of the axes
    once = {(peak.x, peak.value): (peak, colour, bar) for peak, colour, bar in reversed(rings)}
    for peak, colour, bar in sorted(once.values(), key=lambda one: one[0].value):
        x, y = axes.transLimits.transform((1e3 * peak.x, peak.value / 1e3))
        left = x + 0.008 if x < 0.93 else x - 0.008 - WORDS[0]
        foot = y + 0.015
        while any(abs(left - a) < WORDS[0] and abs(foot - b) < WORDS[1] for a, b in written):
            foot += WORDS[1] / 4
        written.append((left, foot))
        text = f"{peak.value / 1e3:.0f} kN" if not bar > 0 else f"{peak.value / 1e3:.0f} \u00b1 {bar / 1e3:.0f} kN"
        axes.text(left, foot, text, transform=axes.transAxes, color=colour, weight="bold", path_effects=HALO)


def draw_wheel(axes, result: PassResult) -> None:
    """Height of the wheel, and the path of a rigid one lowered so that both meet where the settling ends."""
    x, height, rigid = result.history["x"], result.history["wheel_height"], shifted_path(result)
    known = np.isfinite(height).any()
    if known:
        axes.plot(1e3 * x, 1e3 * height, color=TOTAL, lw=2, label="wheel in this run")
    if rigid is not None:
        words = f"rigid wheel on a rigid crossing, shifted by {rigid.shift * 1e3:+.2f} mm to meet it"
        curve(axes, 1e3 * rigid.x, 1e3 * rigid.height, words, GREY, 1.6, "--")
    if known or rigid is not None:
        legend_above(axes)
    else:
        axes.text(0.5, 0.5, "wheel height not resolved", transform=axes.transAxes, ha="center")
    mark_positions(axes, result, label=False)
    axes.set_ylabel("wheel height [mm]")


def draw_crossing(axes, result: PassResult) -> None:
    """The crossing's height over x in mm."""
    x, height = result.history["x"], result.history["crossing_height"]
    if np.isfinite(height).any():
        axes.plot(1e3 * x, 1e3 * height, color=TOTAL, lw=2)
    else:
        axes.text(0.5, 0.5, "crossing height not resolved", transform=axes.transAxes, ha="center")
    mark_positions(axes, result, label=False)
    axes.set_ylabel("crossing\nheight [mm]")


class ShiftedPath(NamedTuple):
    """A rigid wheel's path, x and height of its axle (n,) [m], and what it was shifted by [m]."""

    x: np.ndarray
    height: np.ndarray
    shift: float


def shifted_path(result: PassResult) -> ShiftedPath | None:
    """The rigid wheel's path shifted to meet the wheel where the settling ends, or at the first row: the one that the
    run itself states, trust["rigid_path"] = {"x": [...], "height": [...]} [m], or over the history's x; None where the
    modelled crossing does not reach."""
    x, wheel, stated = result.history["x"], result.history["wheel_height"], result.trust.get("rigid_path")
    if stated:
        path_x, height = np.asarray(stated["x"], float), np.asarray(stated["height"], float)
    else:
        path_x = np.linspace(np.nanmin(x), np.nanmax(x), PATH_POINTS)
        try:
            height = rigid_path(result.scene, path_x).height
        except (CrossingError, ValueError, OSError):  # the profile's file may be gone by now
            return None
    known = np.flatnonzero(np.isfinite(wheel))
    if not len(known):
        return ShiftedPath(path_x, height, 0.0)
    end, _ = settling_end(result)
    after = known[result.history["time"][known] >= end] if np.isfinite(end) else known
    first = after[0] if len(after) else known[0]
    shift = float(wheel[first] - np.interp(x[first], path_x, height))
    return ShiftedPath(path_x, height + shift, shift)
