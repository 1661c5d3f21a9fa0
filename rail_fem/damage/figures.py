"""Figures of a damage study: profiles before and after, depths with the band over the laws, T gamma, shakedown map."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rail_fem.damage.evolution import Evolution
from rail_fem.damage.fatigue import WholeLifeRail, shakedown_limits, shakedown_point
from rail_fem.damage.patch_figure import patches_figure
from rail_fem.damage.section import WearRate
from rail_fem.damage.sites import fatigue_of, laws_of
from rail_fem.damage.worn_profile import depth_between
from rail_fem.settings.damage import DamageSettings
from rail_fem.show.style import GREEN, GREY, NOSE, ORANGE, PURPLE, SKY, TOTAL, WING, lettering, new_figure, save

MM, UM = 1e3, 1e6
SHOWN_SPOT = 1e-3  # of the deepest: what is less deep is magnified nowhere
REGION_COLOURS = (("fatigue", "#FBE3D0"), ("mixed", "#F3F0C4"), ("wear", "#DDE9F4"))


def section_figures(folder, title, settings: DamageSettings, section, state: Evolution, before, after) -> list[Path]:
    """Draw all figures of a section that has worn; returns the files."""
    with lettering():
        made = {
            "profiles": profiles_figure(title, settings, state),
            "depth": depth_figure(title, settings, state),
            "patches": patches_figure(title, settings, state.first, before),
            "passes": passes_figure(title, settings, state),
            "shakedown": section_shakedown(title, settings, before),
        }
        return [save(figure, Path(folder) / f"{name}.png") for name, figure in made.items()]


def profiles_figure(title: str, settings: DamageSettings, state: Evolution) -> Figure:
    """The section before and after, and its worn positions magnified."""
    figure = new_figure(8.5)
    grid = figure.add_gridspec(2, 2, height_ratios=[1.1, 1.0])
    whole = figure.add_subplot(grid[0, :])
    old, new = state.first.points * MM, state.worn.points * MM
    _outlines(whole, old, new)
    whole.set(aspect="equal", xlabel="y [mm], + towards the field side", ylabel="z [mm]")
    whole.legend(loc="lower right")
    spots = _worn_spots(state)
    for k, (mark, at) in enumerate(zip("ab", spots, strict=False)):
        axis = figure.add_subplot(grid[1, k])
        _magnified(axis, state, at, mark)
        whole.annotate(mark, old[at], (0, 12), textcoords="offset points", ha="center", weight="bold")
        whole.plot(*old[at], "o", ms=6, mfc="none", mec="black")
    figure.suptitle(
        f"{title}\nsection before and after {state.passes:,.0f} passes; law: {label_of(settings)}", fontsize=14
    )
    return figure


def _worn_spots(state: Evolution) -> list[int]:
    """Nodes of the deepest wear, and of the deepest away from it."""
    if state.depth.max() <= 0:
        return []
    first = int(np.argmax(state.depth))
    far = np.abs(state.first.arc_length - state.first.arc_length[first]) > 8e-3
    second = int(np.argmax(np.where(far, state.depth, 0.0)))
    return [first] + ([second] if state.depth[second] > SHOWN_SPOT * state.depth[first] else [])


def _outlines(axis: Axes, old: np.ndarray, new: np.ndarray) -> None:
    axis.plot(*old.T, color=GREY, lw=1.4, label="before")
    axis.plot(*new.T, color=NOSE, lw=1.4, ls="--", label="after")


def _magnified(axis: Axes, state: Evolution, at: int, mark: str) -> None:
    """The line about a node, straightened: what was worn off along its normals, magnified."""
    s = (state.first.arc_length - state.first.arc_length[at]) * MM
    worn = depth_between(state.worn, state.first)
    reach = max(2.0, 1.5 * np.abs(s[(worn > 0.02 * worn[at]) & (np.abs(s) < 8)]).max())
    near = np.abs(s) <= reach
    axis.axhline(0, color=GREY, lw=1.4)
    axis.plot(s[near], -worn[near] * UM, color=NOSE, lw=1.6, ls="--")
    axis.fill_between(s[near], 0, -worn[near] * UM, color=NOSE, alpha=0.25, lw=0)
    y, z = state.first.points[at] * MM
    axis.set(
        xlim=(-reach, reach),
        ylim=(-1.15 * worn[at] * UM, 0.15 * worn[at] * UM),
        xlabel="along the line, straightened [mm]",
        ylabel="worn off along the normal [\u00b5m]",
    )
    axis.set_title(f"{mark}: at y = {y:.1f}, z = {z:.1f} mm, {worn[at] * UM:.3g} \u00b5m deep", loc="left")


def depth_figure(title: str, settings: DamageSettings, state: Evolution) -> Figure:
    """Depth along the line by every law."""
    figure = new_figure(6.5)
    axis = figure.add_subplot()
    laws, s = laws_of(settings), state.first.arc_length * MM
    every = np.array(list(state.by_law.values())) * UM
    axis.fill_between(s, every.min(axis=0), every.max(axis=0), color=SKY, alpha=0.35, lw=0, label="band over the laws")
    styles = ("-", "--", "-.", ":", "-", "--", "-.")
    colours = (GREY, WING, WING, WING, GREEN, PURPLE, TOTAL)
    for (name, depth), style, colour in zip(state.by_law.items(), styles, colours, strict=False):
        axis.plot(s, depth * UM, ls=style, lw=1.2, color=colour, label=laws[name].label)
    axis.plot(s, state.depth * UM, color=NOSE, lw=1.8, label="worn off (leading law, smoothed)")
    lead = state.depth * UM
    axis.fill_between(
        s, lead - state.error * UM, lead + state.error * UM, color=NOSE, alpha=0.3, lw=0, label="error of the blocks"
    )
    worn = np.flatnonzero(every.max(axis=0) > 1e-3 * every.max())
    if len(worn):
        axis.set(xlim=(s[worn[0]] - 3, s[worn[-1]] + 3), yscale="log", ylim=(1e-4 * every.max(), 2 * every.max()))
    axis.set(xlabel="along the line, from its gauge side [mm]", ylabel="depth worn off along the normal [\u00b5m]")
    axis.legend(loc="upper center", fontsize=10)
    figure.suptitle(
        f"{title}\n{state.passes:,.0f} passes, calibration factor {settings.factor:g}: what each law"
        f" wears off on the leading law's shapes",
        fontsize=13,
    )
    return figure


def passes_figure(title: str, settings: DamageSettings, state: Evolution) -> Figure:
    """Deepest wear and T gamma over the passes."""
    figure = new_figure(9.0)
    depth, tgamma, force = figure.subplots(3, 1, sharex=True, height_ratios=[1.3, 1.0, 0.7])
    log = np.vstack([0 * state.log[:1], state.log]) if len(state.log) else np.zeros((1, 7))
    ends = np.array([d.max() for d in state.by_law.values()])
    share = log[:, 1] / max(log[-1, 1], 1e-30)
    depth.fill_between(
        log[:, 0],
        share * ends.min() * UM,
        share * ends.max() * UM,
        color=SKY,
        alpha=0.35,
        lw=0,
        label="band over the laws (their end values)",
    )
    depth.errorbar(
        log[:, 0],
        log[:, 1] * UM,
        yerr=log[:, 4] * UM,
        color=NOSE,
        marker="o",
        ms=4,
        capsize=3,
        label=f"deepest, {label_of(settings)}; bars: error of the blocks",
    )
    depth.set(ylabel="deepest wear [\u00b5m]")
    depth.legend(loc="upper left")
    if len(state.log):
        tgamma.plot(state.log[:, 0], state.log[:, 2], color=TOTAL, marker="o", ms=4, label="largest of all points")
        tgamma.plot(
            state.log[:, 0], state.log[:, 3], color=ORANGE, marker="s", ms=4, label="mean over points and passes"
        )
    shade_regions(tgamma, fatigue_of(settings))
    tgamma.set(ylabel="T\u03b3 [N]")
    tgamma.legend(loc="upper right")
    if len(state.log):
        force.plot(state.log[:, 0], state.log[:, 5] / 1e3, color=PURPLE, marker="^", ms=4)
        force.set_ylim(0, 1.15 * state.log[:, 5].max() / 1e3)
    force.set(xlabel="passes", ylabel="largest force [kN]")
    figure.suptitle(f"{title}\nwear, T\u03b3 and force as the shape changes", fontsize=14)
    return figure


def shade_regions(axis: Axes, model: WholeLifeRail) -> None:
    """Shade where the whole-life rail model sees fatigue, both, or wear alone."""
    top = max(axis.get_ylim()[1], 1.1 * model.balance)
    edges = (model.onset, model.peak, model.balance, top)
    for (name, colour), low, high in zip(REGION_COLOURS, edges[:-1], edges[1:], strict=True):
        axis.axhspan(low, high, color=colour, zorder=0, lw=0)
        axis.annotate(name, (0.005, (low + high) / 2), xycoords=("axes fraction", "data"), va="center", style="italic")
    axis.set_ylim(0, top)


def section_shakedown(title: str, settings: DamageSettings, before: WearRate) -> Figure:
    """Points of a section's passes on the shakedown map."""
    points = [
        shakedown_point(p.patch, settings.shear_yield) for r in before.records for p in r.points if p.side == "left"
    ]
    traction, load = [p.traction for p in points], [p.load for p in points]
    return shakedown_figure(title, settings, {"points of the passes, first shape": (traction, load, NOSE, False, "o")})


def shakedown_figure(title: str, settings: DamageSettings, series) -> Figure:
    """Load factor over traction coefficient, with the limits of point contact. series : label -> (traction
    coefficients, load factors, colour, joined, marker)"""
    figure = new_figure(7.0)
    axis = figure.add_subplot()
    mu = np.linspace(0.005, 0.6, 60)
    axis.plot(
        mu, shakedown_limits(mu)["shakedown"], color=TOTAL, lw=2, label="elastic shakedown, circular point contact"
    )
    axis.plot(
        mu,
        shakedown_limits(mu, line=True)["shakedown"],
        color=GREY,
        lw=1.5,
        ls="--",
        label="elastic shakedown, line contact",
    )
    top = 6.0
    for label, (x, y, colour, joined, marker) in series.items():
        axis.plot(x, y, color=colour, marker=marker, ms=5, lw=1.0 if joined else 0.0, alpha=0.8, label=label)
        top = max(top, 1.1 * float(np.max(y, initial=0.0)))
    axis.set(
        xlim=(0, 0.6),
        ylim=(0, top),
        xlabel="traction coefficient T/N",
        ylabel="largest pressure over shear yield stress, p0/k",
    )
    axis.annotate("ratchetting beyond the lines", (0.40, 0.55 * top), style="italic")
    axis.legend(loc="upper right")
    figure.suptitle(f"{title}\nshakedown map, k = {settings.shear_yield / 1e6:.0f} MPa; elastic pressures", fontsize=14)
    return figure


def label_of(settings: DamageSettings) -> str:
    """What the leading law is called."""
    return laws_of(settings)[settings.law].label
