"""Figures of one case by several models: their contact forces beneath one another, and the wheel's path with its dip
angle."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from rail_fem.light.dip import trajectory_dip
from rail_fem.output.result import PassResult
from rail_fem.show.panels import curve, legend_above, new_panels, titled
from rail_fem.show.style import BODY, GREEN, GREY, ORANGE, TOTAL, new_figure, scene_words

TANGENT = 60.0  # half length of the tangents drawn [mm]


def forces_figure(results: Mapping[str, PassResult]) -> Figure:
    """A panel for each model, all with the same axes: force on the wheel, and its shares on wing and nose."""
    figure = new_figure(1.6 + 3.6 * len(results))
    panels = np.atleast_1d(figure.subplots(len(results), 1, sharex=True, sharey=True))
    for axes, (model, result) in zip(panels, results.items()):
        x = 1e3 * result.history["x"]
        for column, words, colour, width in (
            ("force", "wheel", TOTAL, 2.6),
            ("force_wing", "wing rail", BODY["wing"], 1.5),
            ("force_nose", "nose", BODY["nose"], 1.5),
        ):
            if np.isfinite(result.history[column]).any():
                axes.plot(x, result.history[column] / 1e3, color=colour, lw=width, label=words)
        axes.axhline(result.scene.static_wheel_load / 1e3, color=GREY, ls="--", lw=1.4, label="static wheel load")
        axes.set_title(model, loc="left")
        axes.set_ylabel("vertical force [kN]")
        axes.legend(loc="upper left", ncols=4)
        axes.margins(y=0.18)
    panels[-1].set_xlabel("position x of the wheel's centre [mm]   (x = 0: gauge lines intersect)")
    return titled(figure, f"Contact force by several models\n{scene_words(next(iter(results.values())).scene)}")


def dip_figure(result: PassResult) -> Figure:
    """Heights of wheel and crossing, and the tangents between which the dip angle lies."""
    figure, axes = new_panels(6.5)
    x = 1e3 * result.history["x"]
    axes.plot(x, 1e3 * result.history["wheel_height"], color=TOTAL, lw=2.4, label="wheel")
    axes.plot(x, 1e3 * result.history["crossing_height"], color=GREEN, lw=2.0, label="crossing")
    dip = trajectory_dip(result)
    for position, height, slope in (dip.fall, dip.rise) if np.isfinite(dip.angle) else ():
        reach = np.array([-TANGENT, TANGENT])
        axes.plot(1e3 * position + reach, 1e3 * height + slope * reach, color=ORANGE, lw=2.0)
    if np.isfinite(dip.angle):
        words = f"tangents of the steepest fall and rise: dip angle {1e3 * dip.angle:.2f} mrad"
        curve(axes, [], [], words, ORANGE)
    axes.set(xlabel="position x of the wheel's centre [mm]   (x = 0: gauge lines intersect)", ylabel="height [mm]")
    legend_above(axes, 3, borderaxespad=None)
    return titled(figure, f"Vertical displacements and dip angle, model {result.model}\n{scene_words(result.scene)}")
