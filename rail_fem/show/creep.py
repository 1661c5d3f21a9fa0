"""Figure of the longitudinal force and of the longitudinal creep over the running distance."""

import numpy as np
from matplotlib.figure import Figure

from rail_fem.result.events import settling_end
from rail_fem.result.result import PassResult
from rail_fem.show.panels import Panel
from rail_fem.show.positions import over_distance
from rail_fem.show.style import words_instead

OPEN = 1e-3  # of the static load, below which a contact has no creep to speak of


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
