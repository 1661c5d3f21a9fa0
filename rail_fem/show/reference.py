"""Figures of one case by several models: their contact forces beneath one another, and the wheel's path with its dip
angle."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from rail_fem.passes.dip import trajectory_dip
from rail_fem.result.result import PassResult
from rail_fem.show.panels import Panel, panels_figure
from rail_fem.show.style import scene_words

TANGENT = 60.0  # half length of the tangents drawn [mm]
DISTANCE = "position x of the wheel's centre [mm]   (x = 0: gauge lines intersect)"


def forces_figure(results: Mapping[str, PassResult]) -> Figure:
    """A panel for each model: force on the wheel, and its shares on wing and nose."""
    panels = []
    for model, result in results.items():
        x, load = 1e3 * result.history["x"], result.scene.static_wheel_load / 1e3
        lines: dict[str, tuple] = {
            words: (x, result.history[column] / 1e3)
            for words, column in (("wheel", "force"), ("wing rail", "force_wing"), ("nose", "force_nose"))
            if np.isfinite(result.history[column]).any()
        }
        lines["static wheel load"] = x[[0, -1]], [load, load], "--"
        panels.append(Panel(DISTANCE, "vertical force [kN]", lines, model))
    scene = scene_words(next(iter(results.values())).scene)
    return panels_figure(panels, f"Contact force by several models\n{scene}", columns=1)


def dip_figure(result: PassResult) -> Figure:
    """Heights of wheel and crossing, and the tangents between which the dip angle lies."""
    x, dip, reach = 1e3 * result.history["x"], trajectory_dip(result), np.array([-TANGENT, TANGENT])
    lines: dict[str, tuple] = {body: (x, 1e3 * result.history[f"{body}_height"]) for body in ("wheel", "crossing")}
    words = f"tangents of the steepest fall and rise: dip angle {1e3 * dip.angle:.2f} mrad", "_rise"
    for name, (position, height, slope) in zip(words, (dip.fall, dip.rise) if np.isfinite(dip.angle) else ()):
        lines[name] = 1e3 * position + reach, 1e3 * height + slope * reach, "--"
    title = f"Vertical displacements and dip angle, model {result.model}\n{scene_words(result.scene)}"
    return panels_figure([Panel(DISTANCE, "height [mm]", lines)], title)
