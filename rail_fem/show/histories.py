"""Figures of a few panels over the running distance: longitudinal force and creep; the contact patches that a result
keeps."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from rail_fem.result.events import settling_end
from rail_fem.result.result import PassResult
from rail_fem.show.panels import Panel, legend_above, new_panels
from rail_fem.show.positions import label_distance, mark_positions
from rail_fem.show.style import align_labels, give_title, words_instead

OPEN = 1e-3  # of the static load, below which a contact has no creep to speak of
MARKS = {"wing": "o", "nose": "D"}
PRESSURE = {"bem_passage": "elastic pressure\n(half-space) [MPa]"}  # of a model; else of Hertz' ellipse
PANELS = (
    ("max_pressure", 1e-6, "elastic pressure\n(Hertz) [MPa]"),
    ("length", 1e3, "length along x [mm]"),
    ("width", 1e3, "width along y [mm]"),
)


def over_distance(result: PassResult, panels: Sequence[Panel], what: str, name: str) -> Figure:
    """Panels over the running distance beneath one another, the positions marked in all of them and told in the
    first."""
    figure, axes = new_panels(3.0 + 3.0 * len(panels), len(panels), 1, sharex=True, squeeze=False)
    for axis, panel in zip(axes[:, 0], panels):
        panel.draw(axis)
        mark_positions(axis, result, label=panel is panels[0])
    legend_above(axes[0, 0])
    label_distance(axes[-1, 0], result)
    align_labels(figure)
    give_title(figure, what, name, result)
    return figure


def creep_figure(result: PassResult, name: str) -> Figure:
    """Longitudinal force between the bounds that friction sets, above; creep beneath, where the model resolves it."""
    history = result.history
    x, force = history["x"], history["force_longitudinal"]
    if not np.isfinite(force).any():
        return words_instead(
            f"{name}: the history holds no longitudinal force, so there is no creep to draw. {result.fault}"
        )
    bound, worst = result.scene.friction * history["force"] / 1e3, int(np.nanargmax(np.abs(force)))
    words = f"on the wheel along x: largest {force[worst] / 1e3:+.1f} kN at x = {x[worst] * 1e3:.1f} mm"
    limits = f"friction {result.scene.friction:g} times the vertical force"
    forces = {words: (1e3 * x, force / 1e3), limits: (1e3 * x, (-bound, bound), "band")}
    panels, creep = [Panel("", "longitudinal force [kN]", forces)], told_creep(result)
    if creep is not None:
        panels.append(Panel("", "longitudinal creep [%]", {"_creep": (1e3 * x, 1e2 * creep)}))
    return over_distance(result, panels, "Longitudinal force" + (" and creep" if creep is not None else ""), name)


def told_creep(result: PassResult) -> np.ndarray | None:
    """Creep in contact, after settling, + where the wheel is braked, NaN elsewhere; None for a model without creep."""
    history = result.history
    end, _ = settling_end(result)
    told = (history["force"] > OPEN * result.scene.static_wheel_load) & ~(history["time"] < end)
    creep = np.where(told, history["creep_longitudinal"], np.nan)
    return creep if np.isfinite(creep).any() else None


def patches_figure(result: PassResult, name: str) -> Figure:
    """Largest elastic pressure, length and width, a mark for each patch at a kept moment. Needs a result with
    patches."""
    panels = []
    for quantity, factor, words in PANELS:
        lines = {}
        for body, marker in MARKS.items():
            mine = [patch for patch in result.patches if patch.region == body]
            x, y = np.array([[1e3 * p.x, factor * getattr(p, quantity)] for p in mine]).reshape(-1, 2).T
            lines[f"{body}, patches"] = x, y, marker
        panels.append(Panel("", PRESSURE.get(result.model, words) if quantity == "max_pressure" else words, lines))
    return over_distance(result, panels, f"Contact patches at {len({p.time for p in result.patches})} moments", name)
