"""All figures of a damage study; here those of a crossing alone: sections before and after, depth on the plan, T gamma
along it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from geometry.surfaces.any_crossing import AnyCrossing
from geometry.surfaces.bodies import BODIES
from rail_fem.damage.crossing_site import CrossingRate, CrossingSite
from rail_fem.damage.evolution import Evolution
from rail_fem.damage.figures import (
    MM,
    UM,
    band_figure,
    label_of,
    passes_figure,
    profiles_figure,
    shade_regions,
    shakedown_figure,
)
from rail_fem.damage.patch_figure import patches_figure
from rail_fem.damage.sites import fatigue_of
from rail_fem.damage.wheel_figure import wheel_figure
from rail_fem.settings.damage import DamageSettings
from rail_fem.show.panels import band, curve, new_panels, titled
from rail_fem.show.style import BODY, GREY, lettering, save, words_instead

DECADES = 4  # of a depth map
APART = 40e-3  # of the stations of the sections figure at least [m]
STATIONS = 4
OUTLINE = 960  # points of a section
DEEPEST_SHOWN = -20e-3  # of a section [m]


def study_figures(
    folder: Path, title: str, settings: DamageSettings, site: Any, state: Evolution, before: Any, after: Any
) -> list[Path]:
    """Draw all figures of a site that has worn; returns the files."""
    with lettering():
        made = {
            "depth_band": band_figure(title, settings, state),
            "passes": passes_figure(title, settings, state),
            "shakedown": shakedown_figure(title, settings, before, after, state.first.parts),
        }
        if settings.site == "switch":
            made["profiles"] = profiles_figure(title, settings, state)
            made["patches"] = patches_figure(title, settings, state.first, before)
        else:
            made["sections"] = sections_figure(title, site, state)
            made["depth_plan"] = plan_figure(title, settings, site.base, state)
            made["tgamma"] = tgamma_figure(title, settings, state, before, after)
            made["wheel_wear"] = wheel_figure(title, settings, site, state)
        return [save(figure, Path(folder) / f"{name}.png") for name, figure in made.items()]


def stations_of(state: Evolution) -> list[tuple[int, int]]:
    """(body, line of the plan) of the deepest wear of each body, then of what is deepest APART from those, by x."""
    deepest, found = state.depth.max(axis=2), []
    near = np.zeros_like(deepest, bool)
    for body in (0, 1):
        if deepest[body].max() > 0:
            found.append((body, int(np.argmax(deepest[body]))))
    for _ in range(STATIONS):
        for body, i in found:
            near[body] |= np.abs(state.worn.x - state.worn.x[i]) < APART
        rest = np.where(near, 0.0, deepest)
        if len(found) >= STATIONS or rest.max() <= 0:
            break
        found.append(divmod(int(np.argmax(rest)), rest.shape[1]))
    return sorted(found, key=lambda one: one[1])


def sections_figure(title: str, site: CrossingSite, state: Evolution) -> Figure:
    """Sections before and after where wear is deepest, and below each what was worn off, magnified."""
    stations = stations_of(state)
    if not stations:
        return words_instead(f"{title}: no passes, nothing is worn off")
    figure, axes = new_panels(6.5, 2, len(stations), squeeze=False, height_ratios=[1.0, 2.4])
    for column, (body, i) in enumerate(stations):
        _section(axes[0, column], site, state, float(state.worn.x[i]))
        _lost(axes[1, column], site, state, body, i)
        axes[0, column].set_title(f"x = {state.worn.x[i] * MM:.0f} mm", loc="left")
    axes[0, 0].set_ylabel("z [mm]")
    axes[1, 0].set_ylabel("worn off, vertically [\u00b5m]")
    axes[1, 0].legend(*axes[0, 0].get_legend_handles_labels(), loc="lower left", fontsize=9)
    return titled(
        figure,
        f"{title}\nsections before and after {state.passes:,.0f} passes where wear is deepest; below: wear, magnified",
        13,
    )


def _section(axis: Axes, site: CrossingSite, state: Evolution, x: float) -> None:
    y = np.linspace(state.worn.y[0], state.worn.y[-1], OUTLINE)
    after = site.crossing(state.worn)
    for body in BODIES:
        old, new = (c.heights(np.full(len(y), x), y, body) for c in (site.base, after))
        shown = old > DEEPEST_SHOWN
        before = "" if body == BODIES[0] else "before"
        curve(axis, y * MM, np.where(shown, old, np.nan) * MM, before, GREY, 2.2)
        curve(axis, y * MM, np.where(shown, new, np.nan) * MM, f"{body} after", BODY[body], 1.3, "--")
    axis.set(ylim=(-21, 6), xlim=(y[0] * MM, y[-1] * MM))


def _lost(axis: Axes, site: CrossingSite, state: Evolution, body: int, i: int) -> None:
    """What the body that counts lost at a station by wear, and by flow before."""
    lost, y, colour = state.depth[body, i] * UM, state.worn.y * MM, BODY[BODIES[body]]
    curve(axis, y, -lost, "", colour, 1.5)
    band(axis, y, 0, -lost, "", colour, 0.25)
    if site.flow is not None and site.flow[body, i].any():
        axis.plot(y, -site.flow[body, i] * UM, color=colour, ls=":", lw=1.2)
        axis.annotate("dotted: by flow, before", (0.04, 0.94), xycoords="axes fraction", style="italic", fontsize=9)
    worn = np.flatnonzero(lost > 0.01 * lost.max())
    axis.set(xlim=(y[worn[0]] - 2, y[worn[-1]] + 2), ylim=(-1.35 * lost.max(), 0.1 * lost.max()))
    axis.set_xlabel(f"y on the {BODIES[body]} [mm]")


def plan_figure(title: str, settings: DamageSettings, base: AnyCrossing, state: Evolution) -> Figure:
    """Depth by the leading law on the crossing's plan."""
    depth = state.depth.sum(axis=0).T * UM
    if depth.max() <= 0:
        return words_instead(f"{title}: no passes, nothing is worn off")
    figure, axis = new_panels(5.5)
    x, y, top = state.worn.x * MM, state.worn.y * MM, depth.max()
    for body, style in zip(BODIES, ("-", "--"), strict=True):
        mesh = np.meshgrid(state.worn.x, state.worn.y[::2], indexing="ij")
        metal = base.heights(mesh[0].ravel(), mesh[1].ravel(), body).reshape(mesh[0].shape) > -14e-3
        if metal.any() and not metal.all():
            axis.contour(x, y[::2], metal.T, [0.5], colors=BODY[body], linewidths=1.2, linestyles=style)
        axis.plot([], [], color=BODY[body], ls=style, label=f"{body}, where it is less than 14 mm deep")
    shown = np.ma.masked_less(depth, top * 10.0**-DECADES)
    norm = LogNorm(top * 10.0**-DECADES, top)
    image = axis.pcolormesh(x, y, shown, norm=norm, cmap="viridis_r", shading="nearest")
    rows, columns = np.flatnonzero(~shown.mask.all(axis=1)), np.flatnonzero(~shown.mask.all(axis=0))
    axis.set_xlim(x[columns[0]] - 20, x[columns[-1]] + 20)
    axis.set_ylim(y[rows[0]] - 12, y[rows[-1]] + 12)
    figure.colorbar(image, ax=axis, label="depth [\u00b5m]")
    axis.set(xlabel="x along the crossing [mm]", ylabel="y [mm], + to the wing's field side")
    axis.legend(loc="upper left", fontsize=10)
    return titled(figure, f"{title}\ndepth after {state.passes:,.0f} passes; law: {label_of(settings)}", 13)


def tgamma_figure(title, settings, state: Evolution, before: CrossingRate, after: CrossingRate) -> Figure:
    """T gamma and fatigue damage of wing and nose along the crossing, first and at the end."""
    figure, (upper, lower) = new_panels(8.0, 2, 1, sharex=True)
    model = fatigue_of(settings)
    rates = ((f"after {state.passes:,.0f} passes", after, "-", 1.5), ("first pass", before, ":", 1.2))
    for when, rate, style, width in rates[: 2 if state.passes else 1]:
        for b, body in enumerate(BODIES):
            for k, (_, own) in enumerate(rate.kinds):
                facts = own.facts.of(b)
                order, alpha = np.argsort(facts.x), 1.0 if len(rate.kinds) == 1 else 0.45
                words = f"{body}, {when}" if k == 0 and len(order) else ""
                damage = model.damage(facts.tgamma[order]) * 1e6
                for axis, values in ((upper, facts.tgamma[order]), (lower, damage)):
                    curve(axis, facts.x[order] * MM, values, words, BODY[body], width, style, alpha=alpha)
    upper.set_ylim(0, 1.25 * upper.get_ylim()[1])
    shade_regions(upper, model)
    upper.set(ylabel="T\u03b3 of a patch [N]")
    upper.legend(loc="upper right", ncols=4)
    lower.axhline(0, color="black", lw=0.8)
    lower.set(xlabel="x along the crossing [mm]", ylabel="damage by one axle [10\u207b\u2076]")
    lower.annotate("below 0: wear takes cracks away", (0.01, 0.04), xycoords="axes fraction", style="italic")
    return titled(
        figure,
        f"{title}\nT\u03b3 along the pass, a line for each kind of pass; damage function of grade 220 rail on"
        " plain line, not of castings",
        13,
    )
