"""What the figures over the running distance have in common: the axis, the direction of travel, the positions that are
marked."""

import numpy as np

from rail_fem.result.events import lost_contact, settling_end
from rail_fem.result.result import PassResult
from rail_fem.show.style import GREEN, ORANGE, PURPLE


def mark_positions(axes, result: PassResult, label: bool = True) -> None:
    """A line at the transfer, shades while it settles and where contact is lost; `label`: with their words for the
    legend."""
    words = lambda text: text if label else "_nolegend_"
    history = result.history
    losses = lost_contact(history["time"], history["x"], history["force"], result.scene.static_wheel_load)
    for i, loss in enumerate(losses):
        total, longest = 1e3 * sum(one.duration for one in losses), 1e3 * max(one.length for one in losses)
        text = words(f"no contact: {len(losses)} time(s), {total:.3g} ms in all, longest {longest:.3g} mm")
        look = {"color": ORANGE, "alpha": 0.35, "lw": 1, "zorder": 0.5, "label": text if i == 0 else "_nolegend_"}
        axes.axvspan(1e3 * loss.x_start, 1e3 * loss.x_end, **look)
    time, x = settling_end(result)
    if np.isfinite(x):
        text = f"settling, until t = {time * 1e3:.3g} ms: peaks and shares are those after it"
        axes.axvspan(1e3 * history["x"][0], 1e3 * x, color=PURPLE, alpha=0.12, lw=0, zorder=0.4, label=words(text))
    if np.isfinite(result.transfer_x):
        bodies = result.scene.crossing.told("wing and nose")
        text = f"load changes between {bodies}, x = {result.transfer_x * 1e3:.1f} mm"
        axes.axvline(1e3 * result.transfer_x, color=GREEN, ls=(0, (6, 2)), lw=2, label=words(text))


def distance_words(result: PassResult) -> str:
    """What the axis of the running distance says, with the direction of travel."""
    ways = {"facing": "the wheel runs to the right \u2192", "trailing": "\u2190 the wheel runs to the left"}
    direction = ways[result.scene.direction]
    origin = result.scene.crossing.told("gauge lines intersect")
    return f"position x of the wheel's centre [mm]   ({direction}; x = 0: {origin})"


def label_distance(axes, result: PassResult) -> None:
    """The axis of the running distance."""
    axes.set_xlabel(distance_words(result))
