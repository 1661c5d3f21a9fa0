"""Figure of the longitudinal force and of the longitudinal creep over the running distance."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from rail_fem.output.events import settling_end
from rail_fem.output.result import PassResult
from rail_fem.show.panels import band, curve, legend_above
from rail_fem.show.positions import label_distance, mark_positions
from rail_fem.show.style import GREY, TOTAL, align_labels, give_title, new_figure, words_instead

OPEN = 1e-3  # of the static load, below which a contact has no creep to speak of


def creep_figure(result: PassResult, name: str) -> Figure:
    """Longitudinal force between the bounds that friction sets, above; creep beneath, where the model resolves it."""
    history = result.history
    if not np.isfinite(history["force_longitudinal"]).any():
        return words_instead(
            f"{name}: the history holds no longitudinal force, so there is no creep to draw. {result.fault}"
        )
    creep = told_creep(result)
    figure = new_figure(9.0 if creep is not None else 6.0)
    panels = figure.subplots(1 if creep is None else 2, 1, sharex=True, squeeze=False)[:, 0]
    draw_force(panels[0], result)
    if creep is not None:
        draw_creep(panels[1], result, creep)
    label_distance(panels[-1], result)
    align_labels(figure)
    give_title(figure, "Longitudinal force" + (" and creep" if creep is not None else ""), name, result)
    return figure


def draw_force(axes, result: PassResult) -> None:
    """Force on the wheel along x, between plus and minus friction times the vertical force."""
    x, force = result.history["x"], result.history["force_longitudinal"]
    bound = result.scene.friction * result.history["force"]
    worst = int(np.nanargmax(np.abs(force)))
    words = f"on the wheel along x: largest {force[worst] / 1e3:+.1f} kN at x = {x[worst] * 1e3:.1f} mm"
    limits = f"friction {result.scene.friction:g} times the vertical force"
    band(axes, 1e3 * x, -bound / 1e3, bound / 1e3, limits, GREY, 0.15)
    curve(axes, 1e3 * x, force / 1e3, words)
    mark_positions(axes, result)
    axes.set_ylabel("longitudinal force [kN]")
    legend_above(axes)


def told_creep(result: PassResult) -> np.ndarray | None:
    """Creep where the wheel is in contact, after settling, NaN elsewhere; None for a model without creep."""
    history = result.history
    end, _ = settling_end(result)
    told = (history["force"] > OPEN * result.scene.static_wheel_load) & ~(history["time"] < end)
    creep = np.where(told, history["creep_longitudinal"], np.nan)
    return creep if np.isfinite(creep).any() else None


def draw_creep(axes, result: PassResult, creep: np.ndarray) -> None:
    """Creep over the distance; + where the wheel is braked."""
    axes.plot(1e3 * result.history["x"], 1e2 * creep, color=TOTAL, lw=2)
    axes.axhline(0.0, color=GREY, lw=1.2, ls="--")
    mark_positions(axes, result, label=False)
    axes.set_ylabel("longitudinal creep [%]")
