"""Figure of what wheels lose by their passes over a crossing, over their profiles."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from rail_fem.damage.crossing_site import CrossingSite
from rail_fem.damage.evolution import Evolution
from rail_fem.damage.figures import MM, UM, label_of
from rail_fem.damage.report import THOUSAND
from rail_fem.settings.damage import DamageSettings
from rail_fem.show.panels import band, curve, new_panels, titled
from rail_fem.show.style import CURVES, words_instead

LINES = "-", "--", ":", "-."
SHOWN = 1e-3  # of the deepest, from which on a part of the profile is shown
AROUND = 12.0  # of the worn part [mm]


def wheel_figure(title: str, settings: DamageSettings, site: CrossingSite, state: Evolution) -> Figure:
    """Depth over the profile by the leading law for each kind of pass, the band over the laws of their mean, and the
    profiles themselves."""
    wheels = np.asarray(state.wheels)
    if not wheels.ndim or not wheels.any():
        return words_instead(f"{title}: no passes, no wheel wears")
    depth = wheels.sum(axis=2) * (THOUSAND / (state.passes - state.began)) * UM
    y, lead = site.wheel_lines * MM, list(state.by_law).index(settings.law)
    figure, (profile, each, mean_of) = new_panels(9.0, 3, 1, sharex=True, height_ratios=[0.8, 1.3, 1.0])
    shapes: dict[str, list[str]] = {}
    for k, one in enumerate(site.passes):
        name = one.scene.wheel.name
        styles = shapes.setdefault(name, [])
        colour = CURVES[list(shapes).index(name) % len(CURVES)]
        if not styles:
            profile.plot(y, one.scene.wheel.shape.height(site.wheel_lines) * MM, color=colour, lw=1.2, label=name)
        each.plot(y, depth[k, lead], color=colour, ls=LINES[len(styles) % len(LINES)], lw=1.4, label=one.label)
        styles.append(one.label)
    mean = np.tensordot([one.weight for one in site.passes], depth, 1)
    band(mean_of, y, mean.min(axis=0), mean.max(axis=0), "band over the laws", strength=0.4)
    curve(mean_of, y, mean[lead], label_of(settings), width=1.6)
    worn = np.flatnonzero(depth[:, lead].max(axis=0) > SHOWN * depth[:, lead].max())
    low, high = y[worn[0]] - AROUND, y[worn[-1]] + AROUND
    inside = (y > low) & (y < high)
    heights = [one.scene.wheel.shape.height(site.wheel_lines[inside]) * MM for one in site.passes]
    bottom, top = np.nanmin(heights), np.nanmax(heights)
    profile.set(xlim=(low, high), ylim=(bottom - 1, top + 1), ylabel="profile, z [mm]")
    each.set(yscale="log", ylim=(1e-3 * depth[:, lead].max(), 2 * depth[:, lead].max()))
    each.set(ylabel=f"worn off in {THOUSAND:,} passes [\u00b5m]", title="each kind of pass")
    mean_of.set(yscale="log", ylim=(1e-4 * mean.max(), 2 * mean.max()), title="mean of the traffic")
    mean_of.set(xlabel="y on the wheel from its tread datum [mm], + to the field side")
    mean_of.set(ylabel=f"in {THOUSAND:,} passes [\u00b5m]")
    for axis, columns in ((profile, 5), (each, 2), (mean_of, 1)):
        axis.legend(fontsize=9, ncols=columns, loc="best")
    return titled(
        figure,
        f"{title}\nwheels, around their circumference, mean over {state.passes - state.began:,.0f} passes; law:"
        f" {label_of(settings)}, hardness"
        f" {settings.wheel_hardness / 1e9:g} GPa",
        13,
    )
