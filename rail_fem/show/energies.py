"""Figure of the energies: where the work of the pass goes, and how much of it the numerics take."""

import numpy as np
from matplotlib.figure import Figure

from rail_fem.result.history import COLUMNS
from rail_fem.result.result import PassResult
from rail_fem.result.trust import largest_internal, last_known, numerical_shares
from rail_fem.show.panels import curve, legend_above
from rail_fem.show.positions import label_distance, mark_positions
from rail_fem.show.style import GREY, NOSE, PURPLE, SKY, TOTAL, WING, give_title, new_figure, words_instead

# one meaning a colour, in both panels; none is that of the lines and shades that mark positions
ROSE, BROWN, OLIVE, WINE, INDIGO = "#CC6677", "#661100", "#999933", "#882255", "#332288"
LINES = {
    "energy_elastic": (WING, "-"),
    "energy_plastic": (NOSE, "-"),
    "energy_friction": (ROSE, "-"),
    "energy_damping": (BROWN, "--"),
    "energy_springs": (SKY, "--"),
    "energy_kinetic": (PURPLE, "--"),
    "energy_external": (GREY, "--"),
    "energy_viscosity": (OLIVE, "-"),
    "energy_hourglass": (WINE, "-"),
    "energy_contact": (INDIGO, "-"),
    "energy_balance": (TOTAL, ":"),
}
SHARES = {  # of rail_fem.result.trust: words, colour, line, which limit of the trust report
    "energy_hourglass": ("hourglass, of the largest internal energy so far", WINE, "-"),
    "energy_contact": ("contact penalty, of the same", INDIGO, "-"),
    "energy_viscosity": ("bulk viscosity, of the same", OLIVE, "-"),
    "balance_bodies": ("balance of the bodies, as in the trust report", TOTAL, ":"),
    "balance_contact": ("balance of the contact, as in the trust report", GREY, ":"),
}
# rows of the trust report whose limits are drawn
ROWS = {"hourglass energy, all bodies": "energy_hourglass", "penalty energy": "energy_contact"}
# their size says nothing
CHANGES, CHANGED = ("energy_springs", "energy_kinetic", "energy_external"), ", since the start"
# where a column's meaning is no name for its curve
WORDS = {
    "energy_balance": "balance: what is not accounted for",
    "energy_kinetic": "kinetic energy",
    "energy_damping": "work of the dampers",
}


def energies_figure(result: PassResult, name: str) -> Figure:
    """All energies that the run resolves; beneath, those that are numerical, as the trust report measures them."""
    history = result.history
    shown = [column for column in LINES if np.isfinite(history[column]).any()]
    if not shown:
        return words_instead(f"{name}: the history holds no energies, so there is nothing to draw. {result.fault}")
    shares = resolved_shares(result)
    figure = new_figure(11.0 if shares else 7.0)
    panels = np.atleast_1d(figure.subplots(2 if shares else 1, 1, sharex=True))
    for column in shown:
        if column == "energy_external" and "energy_kinetic" in shown:
            continue
        colour, line = LINES[column]
        words, values = balance_curve(result, column)
        curve(panels[0], 1e3 * history["x"], values, words, colour, line=line)
    mark_positions(panels[0], result)
    panels[0].set_ylabel("energy [J]")
    legend_above(panels[0])
    if shares:
        draw_shares(panels[1], result, shares)
    label_distance(panels[-1], result)
    give_title(figure, "Energies", name, result)
    return figure


def balance_curve(result: PassResult, column: str) -> tuple[str, np.ndarray]:
    """Words and values (n,) [J] of a column's curve. What drives the train on and what its speed and spin hold nearly
    cancel: drawn as their difference."""
    values = result.history[column]
    if column == "energy_contact" and not np.isfinite(result.history["energy_elastic"]).any():
        return "elastic energy in the contact, by its force law", values
    if column not in CHANGES:
        return WORDS.get(column, COLUMNS[column].meaning), values
    values = values - start_value(result, column)
    if column == "energy_kinetic" and np.isfinite(result.history["energy_external"]).any():
        return f"kinetic energy less work of weight and prescribed motion{CHANGED}", values - result.history[
            "energy_external"
        ] + start_value(result, "energy_external")
    return WORDS.get(column, COLUMNS[column].meaning) + CHANGED, values


def start_value(result: PassResult, column: str) -> float:
    """The value where the wheel has been let go: of the second row after the settling, the first may still end in it;
    of the first known row where there is none."""
    known = np.isfinite(result.history[column])
    after = known & (result.history["time"] > (result.settings.get("settle_time") or 0.0))
    return float(result.history[column][np.flatnonzero(after)[1] if after.sum() > 1 else np.flatnonzero(known)[0]])


def resolved_shares(result: PassResult) -> dict[str, np.ndarray]:
    """Numerical energies after the settling [1], where they and what they are measured by are known; none for a model
    without elastic energy."""
    if not np.nanmax(largest_internal(result.history), initial=0.0) > 0:
        return {}
    scale = result.energies.get("balance_scale", result.energies.get("impact_work", np.nan))
    shares = numerical_shares(result.history, result.settings.get("settle_time") or 0.0, scale)
    return {name: shares[name] for name in SHARES if np.isfinite(shares[name]).any()}


def draw_shares(axes, result: PassResult, shares: dict[str, np.ndarray]) -> None:
    """Numerical energies in percent, with the limits that the run's trust report holds them to; their last values are
    its numbers."""
    for name, values in shares.items():
        words, colour, line = SHARES[name]
        words = f"{words}: {100 * last_known(values):.2g} % at the end"
        curve(axes, 1e3 * result.history["x"], 100 * values, words, colour, line=line)
    for row in result.trust.get("rows", ()):
        energy = ROWS.get(row["name"])
        if energy in shares:
            limit, look = 100 * row["limit"], {"color": SHARES[energy][1], "ls": (0, (5, 4)), "lw": 1.2}
            axes.axhline(limit, label=f"{row['name']}, limit: {limit:g} %", **look)
    mark_positions(axes, result, label=False)
    axes.set_ylabel("numerical energy\nafter settling [%]")
    low, high = share_range(shares)
    axes.set_ylim(low, high)
    legend_above(axes)


def share_range(shares: dict[str, np.ndarray]) -> tuple[float, float]:
    """Range in percent that shows the last nine tenths of the path whole: the first rows divide by next to nothing."""
    values = np.concatenate([100 * v[len(v) // 10 :] for v in shares.values()])
    values = values[np.isfinite(values)]
    low, high = min(values.min(initial=0.0), 0.0), max(values.max(initial=0.0), 6.0)
    return low - 0.05 * (high - low), high + 0.05 * (high - low)
