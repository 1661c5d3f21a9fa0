"""Figure of the energies: where the work of the pass goes, and how much of it the numerics take."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from rail_fem.output.history import COLUMNS
from rail_fem.output.result import PassResult
from rail_fem.show.places import label_distance, legend_above, mark_places
from rail_fem.show.style import GREEN, GREY, NOSE, ORANGE, PURPLE, SKY, TOTAL, WING, give_title, new_figure, words_instead

LINES = {
    "energy_elastic": (WING, "-"),
    "energy_plastic": (NOSE, "-"),
    "energy_friction": (ORANGE, "-"),
    "energy_damping": (GREEN, "--"),
    "energy_springs": (SKY, "--"),
    "energy_kinetic": (PURPLE, "--"),
    "energy_external": (GREY, "--"),
    "energy_viscosity": (GREEN, "-"),
    "energy_hourglass": (PURPLE, "-"),
    "energy_contact": (SKY, "-"),
    "energy_balance": (TOTAL, ":"),
}
NUMERICAL = ("energy_hourglass", "energy_contact", "energy_viscosity", "energy_balance")
SHORT = {"energy_hourglass": "hourglass", "energy_contact": "contact penalty", "energy_viscosity": "bulk viscosity", "energy_balance": "balance error"}
WORDS = {"energy_balance": "balance: what is not accounted for"}  # where a column's meaning is no name for its curve
LIMITS = {"energy_hourglass": 5.0, "energy_contact": 2.0}  # percent of the internal energy that the trust report allows


def energies_figure(result: PassResult, name: str) -> Figure:
    """All energies that the run resolves; beneath, those that are numerical, in percent of the internal energy."""
    history = result.history
    shown = [column for column in LINES if np.isfinite(history[column]).any()]
    if not shown:
        return words_instead(f"{name}: the history holds no energies, so there is nothing to draw. {result.fault}")
    internal = largest_so_far(history["energy_elastic"], history["energy_plastic"])
    numerical = [column for column in NUMERICAL if column in shown] if np.nanmax(internal, initial=0.0) > 0 else []
    figure = new_figure(11.0 if numerical else 7.0)
    panels = np.atleast_1d(figure.subplots(2 if numerical else 1, 1, sharex=True))
    for column in shown:
        colour, line = LINES[column]
        panels[0].plot(1e3 * history["x"], history[column], color=colour, ls=line, lw=2, label=WORDS.get(column, COLUMNS[column].meaning))
    mark_places(panels[0], result)
    panels[0].set_ylabel("energy [J]")
    legend_above(panels[0])
    if numerical:
        draw_shares(panels[1], result, numerical, internal)
    label_distance(panels[-1], result)
    give_title(figure, "Energies", name, result)
    return figure


def largest_so_far(*energies: np.ndarray) -> np.ndarray:
    """Running maximum of the sum of the energies (n,) that are resolved [J]; NaN until the first is known."""
    known = [values for values in energies if np.isfinite(values).any()]
    return np.fmax.accumulate(np.sum(known, axis=0)) if known else np.full(len(energies[0]), np.nan)


def draw_shares(axes, result: PassResult, columns: list[str], internal: np.ndarray) -> None:
    """Numerical energies in percent of the internal energy, with the limits of the trust report."""
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(internal > 0, 100.0 / internal, np.nan)
    for column in columns:
        colour, line = LINES[column]
        axes.plot(1e3 * result.history["x"], share * result.history[column], color=colour, ls=line, lw=2, label=SHORT[column])
    for column in columns:
        if column in LIMITS:
            axes.axhline(LIMITS[column], color=LINES[column][0], ls=(0, (5, 4)), lw=1.2, label=f"limit of {SHORT[column]}: {LIMITS[column]:g} %")
    mark_places(axes, result, label=False)
    axes.set_ylabel("in % of the largest\nelastic + plastic energy so far")
    axes.set_ylim(*share_range(share, result, columns))
    legend_above(axes, columns=3)


def share_range(share: np.ndarray, result: PassResult, columns: list[str]) -> tuple[float, float]:
    """Range that shows the last nine tenths of the way whole: the first rows divide by next to nothing."""
    late = slice(len(share) // 10, None)
    values = np.concatenate([(share * result.history[column])[late] for column in columns])
    values = values[np.isfinite(values)]
    low, high = min(values.min(initial=0.0), 0.0), max(values.max(initial=0.0), 1.1 * max(LIMITS.values()))
    return low - 0.05 * (high - low), high + 0.05 * (high - low)
