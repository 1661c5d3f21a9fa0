"""Figures of a damage study: profiles before and after, and of any site depths with the band over the laws, passes,
shakedown map."""

from __future__ import annotations

from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rail_fem.damage.evolution import Evolution, Rate
from rail_fem.damage.fatigue import WholeLifeRail, shakedown_limits
from rail_fem.damage.sites import fatigue_of, laws_of
from rail_fem.damage.worn_profile import depth_between
from rail_fem.settings.damage import DamageSettings
from rail_fem.show.panels import band, curve, new_panels, ring, titled
from rail_fem.show.style import BODY, GREY, NOSE, ORANGE, PURPLE, TOTAL, new_figure

MM, UM = 1e3, 1e6
SHOWN_SPOT = 1e-3  # of the deepest: what is less deep is magnified nowhere
REGION_COLOURS = (("fatigue", "#FBE3D0"), ("mixed", "#F3F0C4"), ("wear", "#DDE9F4"))


def profiles_figure(title: str, settings: DamageSettings, state: Evolution) -> Figure:
    """The section before and after, and its worn positions magnified."""
    figure = new_figure(8.5)
    grid = figure.add_gridspec(2, 2, height_ratios=[1.1, 1.0])
    whole = figure.add_subplot(grid[0, :])
    old, new = state.first.points * MM, state.worn.points * MM
    curve(whole, old[:, 0], old[:, 1], "before", GREY, 1.4)
    curve(whole, new[:, 0], new[:, 1], "after", NOSE, 1.4, "--")
    whole.set(aspect="equal", xlabel="y [mm], + towards the field side", ylabel="z [mm]")
    whole.legend(loc="lower right")
    spots = _worn_spots(state)
    for k, (mark, at) in enumerate(zip("ab", spots, strict=False)):
        axis = figure.add_subplot(grid[1, k])
        _magnified(axis, state, at, mark)
        whole.annotate(mark, old[at], (0, 12), textcoords="offset points", ha="center", weight="bold")
        ring(whole, old[at, 0], old[at, 1], "o", TOTAL, size=6, width=1.0)
    return titled(figure, f"{title}\nsection before and after {state.passes:,.0f} passes; law: {label_of(settings)}")


def _worn_spots(state: Evolution) -> list[int]:
    """Nodes of the deepest wear, and of the deepest away from it."""
    if state.depth.max() <= 0:
        return []
    first = int(np.argmax(state.depth))
    far = np.abs(state.first.arc_length - state.first.arc_length[first]) > 8e-3
    second = int(np.argmax(np.where(far, state.depth, 0.0)))
    return [first] + ([second] if state.depth[second] > SHOWN_SPOT * state.depth[first] else [])


def _magnified(axis: Axes, state: Evolution, at: int, mark: str) -> None:
    """The line about a node, straightened: what was worn off along its normals, magnified."""
    s = (state.first.arc_length - state.first.arc_length[at]) * MM
    worn = depth_between(state.worn, state.first)
    reach = max(2.0, 1.5 * np.abs(s[(worn > 0.02 * worn[at]) & (np.abs(s) < 8)]).max())
    near = np.abs(s) <= reach
    axis.axhline(0, color=GREY, lw=1.4)
    curve(axis, s[near], -worn[near] * UM, "", NOSE, 1.6, "--")
    band(axis, s[near], 0, -worn[near] * UM, "", NOSE, 0.25)
    y, z = state.first.points[at] * MM
    axis.set(xlim=(-reach, reach), ylim=(-1.15 * worn[at] * UM, 0.15 * worn[at] * UM))
    axis.set(xlabel="along the line, straightened [mm]", ylabel="worn off along the normal [\u00b5m]")
    axis.set_title(f"{mark}: at y = {y:.1f}, z = {z:.1f} mm, {worn[at] * UM:.3g} \u00b5m deep", loc="left")


def band_figure(title: str, settings: DamageSettings, state: Evolution) -> Figure:
    """Deepest wear along each part by each law, and the band between them."""
    figure = new_figure(8.0)
    laws, parts, (along, what) = laws_of(settings), state.first.parts, state.first.along
    panels = figure.subplots(len(parts), 1, sharex=True, squeeze=False)[:, 0]
    for b, (axis, name) in enumerate(zip(panels, parts, strict=True)):
        colour = BODY.get(name, NOSE)
        deepest = lambda values, b=b: state.first.part(values, b).reshape(len(along), -1).max(axis=1) * UM
        values = np.array([deepest(own) for own in state.by_law.values()])
        top = max(values.max(), 1e-9)
        worn = values.max(axis=0) > 1e-5 * top
        positive = np.where(worn, 1.0, np.nan)
        low, high = values.min(axis=0) * positive, values.max(axis=0) * positive
        band(axis, along * MM, low, high, "band over the laws", strength=0.4)
        if len(parts) == 1:
            for law, own, style in zip(state.by_law, values * positive, cycle(("-", "--", "-.", ":"))):
                axis.plot(along * MM, own, color=GREY, ls=style, lw=1.0, label=laws[law].label)
        lead, error = deepest(state.depth) * positive, deepest(state.error)
        axis.plot(along * MM, lead, color=colour, lw=1.6, label=f"{laws[settings.law].label}, smoothed")
        bound = np.maximum(lead - error, 1e-6 * top), lead + error
        band(axis, along * MM, *bound, "bound of the blocks' error", colour, 0.25)
        axis.set(yscale="log", ylim=(top * 1e-5, 2 * top), ylabel=f"deepest on the {name} [\u00b5m]")
        axis.legend(loc="center right" if b == 0 else "center left", fontsize=10)
    if len(parts) == 1 and worn.any():
        axis.set_xlim(*(along[worn][[0, -1]] * MM + [-3, 3]))
    axis.set(xlabel=f"{what} [mm]")
    return titled(
        figure,
        f"{title}\ndepth after {state.passes:,.0f} passes by all laws on the leading law's shapes, calibration factor"
        f" {settings.factor:g}",
        13,
    )


def passes_figure(title: str, settings: DamageSettings, state: Evolution) -> Figure:
    """Deepest wear and T gamma over the passes."""
    figure, (depth, tgamma, force) = new_panels(9.0, 3, 1, sharex=True, height_ratios=[1.3, 1.0, 0.7])
    log = np.vstack([0 * state.log[:1], state.log]) if len(state.log) else np.zeros((1, 7))
    ends = np.array([d.max() for d in state.by_law.values()])
    share = log[:, 1] / max(log[-1, 1], 1e-30)
    passes, words = log[:, 0], f"deepest, {label_of(settings)}; bars: error of the blocks"
    limits = share * ends.min() * UM, share * ends.max() * UM
    band(depth, passes, *limits, "band over the laws (their end values)", strength=0.35)
    look = {"yerr": log[:, 4] * UM, "color": NOSE, "marker": "o", "ms": 4, "capsize": 3, "label": words}
    depth.errorbar(passes, log[:, 1] * UM, **look)
    depth.set(ylabel="deepest wear [\u00b5m]")
    depth.legend(loc="upper left")
    if len(state.log):
        at = state.log[:, 0]
        curve(tgamma, at, state.log[:, 2], "largest of all points", TOTAL, 1.5, marker="o", ms=4)
        curve(tgamma, at, state.log[:, 3], "mean over points and passes", ORANGE, 1.5, marker="s", ms=4)
    shade_regions(tgamma, fatigue_of(settings))
    tgamma.set(ylabel="T\u03b3 [N]")
    if tgamma.get_legend_handles_labels()[0]:  # of no pass there is nothing to name
        tgamma.legend(loc="upper right")
    if len(state.log):
        force.plot(state.log[:, 0], state.log[:, 5] / 1e3, color=PURPLE, marker="^", ms=4)
        force.set_ylim(0, 1.15 * state.log[:, 5].max() / 1e3)
    force.set(xlabel="passes", ylabel="largest force [kN]")
    return titled(figure, f"{title}\nwear, T\u03b3 and force as the shape changes")


def shade_regions(axis: Axes, model: WholeLifeRail) -> None:
    """Shade where the whole-life rail model sees fatigue, both, or wear alone."""
    top = max(axis.get_ylim()[1], 1.1 * model.balance)
    edges = (model.onset, model.peak, model.balance, top)
    for (name, colour), low, high in zip(REGION_COLOURS, edges[:-1], edges[1:], strict=True):
        axis.axhspan(low, high, color=colour, zorder=0, lw=0)
        axis.annotate(name, (0.005, (low + high) / 2), xycoords=("axes fraction", "data"), va="center", style="italic")
    axis.set_ylim(0, top)


def shakedown_figure(title: str, settings: DamageSettings, before: Rate, after: Rate, parts: tuple[str, ...]) -> Figure:
    """Load factor over traction coefficient of the patches, a crossing's as paths of the pass of the largest share,
    with the limits of point contact."""
    figure, axis = new_panels(7.0)
    mu = np.linspace(0.005, 0.6, 60)
    limits = shakedown_limits(mu)["shakedown"], shakedown_limits(mu, line=True)["shakedown"]
    curve(axis, mu, limits[0], "elastic shakedown, circular point contact")
    curve(axis, mu, limits[1], "elastic shakedown, line contact", GREY, 1.5, "--")
    top = 6.0
    paths = len(parts) > 1
    for when, rate in (("first", before), ("at the end", after)):
        kinds = [max(rate.kinds, key=lambda kind: kind[0])] if paths else rate.kinds
        for b, name in enumerate(parts):
            facts = [own.facts.of(b) for _, own in kinds]
            x, y = (np.concatenate([getattr(own, of) for own in facts]) for of in ("traction", "load"))
            look = {"color": GREY if when == "first" else BODY.get(name, NOSE), "marker": "o" if b else "s"}
            axis.plot(x, y, ms=5, lw=1.0 if paths else 0.0, alpha=0.8, label=f"{name}, {when}", **look)
            top = max(top, 1.1 * float(np.max(y, initial=0.0)))
    axis.set(xlim=(0, 0.6), ylim=(0, top), xlabel="traction coefficient T/N")
    axis.set_ylabel("largest pressure over shear yield stress, p0/k")
    axis.annotate("ratchetting beyond the lines", (0.40, 0.55 * top), style="italic")
    axis.legend(loc="upper right")
    return titled(figure, f"{title}\nshakedown map, k = {settings.shear_yield / 1e6:.0f} MPa; elastic pressures")


def label_of(settings: DamageSettings) -> str:
    """What the leading law is called."""
    return laws_of(settings)[settings.law].label
