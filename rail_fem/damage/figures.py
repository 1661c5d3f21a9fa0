"""Figures of a damage study: sections before and after, depths with the band over the laws, passes, T gamma, shakedown
map, and of a crossing the depth on its plan and what the wheels lose."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from geometry.surfaces.bodies import BODIES
from rail_fem.damage.crossing_site import CrossingRate, CrossingSite
from rail_fem.damage.evolution import Evolution, Rate
from rail_fem.damage.fatigue import WholeLifeRail, fatigue_of, shakedown_limits
from rail_fem.damage.patch_figure import patches_figure
from rail_fem.damage.report import THOUSAND
from rail_fem.damage.wear import laws_of
from rail_fem.damage.wheel_wear import wheel_lines
from rail_fem.damage.worn_profile import depth_between
from rail_fem.settings.damage import DamageSettings
from rail_fem.show.panels import Panel, new_panels, panels_figure, titled
from rail_fem.show.style import lettering, save, words_instead

MM, UM = 1e3, 1e6
LEAST = 1e-5  # of the deepest: what is less deep is drawn nowhere
DECADES = 4  # of a depth map
APART = 40e-3  # of the stations of the sections figure at least [m]
FLOWN = 3.0  # spacings between patches from which on the wheel has flown between them
STATIONS = 4
OUTLINE = 960  # points of a section
DEEPEST_SHOWN = -20e-3  # of a section [m]


def study_figures(
    folder: Path, title: str, settings: DamageSettings, site: Any, state: Evolution, before: Any, after: Any
) -> list[Path]:
    """Draw all figures of a site that has worn; returns the files."""
    law = laws_of(settings)[settings.law].label
    done = f"after {state.passes:,.0f} passes"
    drawn: dict[str, tuple[list[Panel], str, int]] = {
        "depth_band": (band_panels(settings, state), f"depth {done} by all laws on the leading law's shapes", 1),
        "passes": (passes_panels(settings, state), f"wear by {law}, T\u03b3 and force as the shape changes", 1),
        "shakedown": (
            [shakedown_panel(before, after, state.first.parts)],
            f"shakedown map, k = {settings.shear_yield / 1e6:.0f} MPa; elastic pressures"
            + (", means bounded by the hardness" if settings.site == "crossing" else ""),
            1,
        ),
    }
    if settings.site == "switch":
        drawn["profiles"] = profile_panels(state), f"section before and {done}; law: {law}", 1
    elif state.depth.max() > 0:
        stations = stations_of(state)
        words = f"sections before and {done} where wear is deepest; below: wear, magnified"
        drawn["sections"] = section_panels(site, state, stations), words, len(stations)
        hardness = f"{settings.wheel_hardness / 1e9:g} GPa"
        words = f"wheels, around their circumference, in {THOUSAND:,} passes; law: {law}, hardness {hardness}"
        drawn["wheel_wear"] = wheel_panels(settings, site, state), words, 1
    with lettering():
        made = {name: panels_figure(panels, f"{title}\n{words}", n) for name, (panels, words, n) in drawn.items()}
        if settings.site == "switch":
            made["patches"] = patches_figure(title, settings, state.first, before)
        else:
            made["depth_plan"] = plan_figure(f"{title}\ndepth {done}; law: {law}", site, state)
            words = "T\u03b3 along the pass, a line for each kind of pass; damage of grade 220 rail on plain line"
            made["tgamma"] = panels_figure(tgamma_panels(settings, state, before, after), f"{title}\n{words}", 1)
            nothing = words_instead(f"{title}: nothing is worn off {done}")
            made = {"sections": nothing, "wheel_wear": nothing} | made
        return [save(figure, Path(folder) / f"{name}.png") for name, figure in made.items()]


def profile_panels(state: Evolution) -> list[Panel]:
    """The section before and after, and what was worn off along its line."""
    old, new = state.first.points * MM, state.worn.points * MM
    worn = state.first.arc_length * MM, depth_between(state.worn, state.first) * UM
    return [
        Panel("y [mm], + towards the field side", "z [mm]", {"before": (*old.T, ":"), "after": new.T}),
        Panel("along the line, from its gauge side [mm]", "worn off along the normal [\u00b5m]", {"_worn": worn}),
    ]


def band_panels(settings: DamageSettings, state: Evolution) -> list[Panel]:
    """Deepest wear along each part by each law, and the band between them."""
    laws, (along, what), found = laws_of(settings), state.first.along, []
    for b, name in enumerate(state.first.parts):
        deepest = lambda values, b=b: state.first.part(values, b).reshape(len(along), -1).max(axis=1) * UM
        values = {law: deepest(own) for law, own in state.by_law.items()}
        least = LEAST * max(max(own.max() for own in values.values()), 1e-9)
        shown = lambda own, least=least: np.where(own > least, own, np.nan)
        every = np.array(list(values.values()))
        bounds = shown(np.maximum(every.min(axis=0), least)), shown(every.max(axis=0))
        lines: dict[str, tuple] = {"band over the laws": (along * MM, bounds, "band")}
        if len(state.first.parts) == 1:
            lines |= {laws[law].label: (along * MM, shown(own), "--") for law, own in values.items()}
        lead, error = shown(deepest(state.depth)), deepest(state.error)
        lines[f"{name}, {laws[settings.law].label}, smoothed"] = along * MM, lead
        bound = np.maximum(lead - error, 2 * least), lead + error
        lines[f"{name}, bound of the blocks' error"] = along * MM, bound, "band"
        found.append(Panel(f"{what} [mm]", f"deepest on the {name} [\u00b5m]", lines, log="y"))
    return found


def passes_panels(settings: DamageSettings, state: Evolution) -> list[Panel]:
    """Deepest wear at the ends of the blocks of passes, T gamma and the largest force at their middles, whose shape
    they are of."""
    log = np.vstack([np.zeros((1, 7)), state.log])
    passes, deepest, largest, mean, error, force = log.T[:6]
    middles = (passes[1:] + passes[:-1]) / 2
    ends = np.array([d.max() for d in state.by_law.values()])
    share = deepest / max(deepest[-1], 1e-30) * UM
    wear = {
        "band over the laws (their end values)": (passes, (share * ends.min(), share * ends.max()), "band"),
        "deepest; bars: error of the blocks": (
            passes,
            (deepest * UM, (np.minimum(error, deepest) * UM, error * UM)),
            "bars",
        ),
    }
    tgamma = {
        "largest of all points": (middles, largest[1:], "o-"),
        "mean over points and passes": (middles, mean[1:], "s-"),
    }
    return [
        Panel("passes", "deepest wear [\u00b5m]", wear),
        Panel("passes", "T\u03b3 [N]", tgamma | region_lines(fatigue_of(settings), passes[[0, -1]])),
        Panel("passes", "largest force [kN]", {"_force": (middles, force[1:] / 1e3, "o-")}),
    ]


def region_lines(model: WholeLifeRail, x: np.ndarray) -> dict[str, tuple]:
    """Where the whole-life rail model sees fatigue, both, or wear alone, between two positions."""
    borders = {"fatigue": model.onset, "fatigue and wear": model.peak, "wear alone": model.balance}
    return {f"{name} from {border:g} N": (x, [border, border], ":") for name, border in borders.items()}


def shakedown_panel(before: Rate, after: Rate, parts: tuple[str, ...]) -> Panel:
    """Load factor over traction coefficient of the patches, a crossing's as paths of the pass of the largest share,
    with the limits of point and of line contact, beyond which steel ratchets."""
    mu = np.linspace(0.005, 0.6, 60)
    lines: dict[str, tuple] = {
        "elastic shakedown, circular point contact": (mu, shakedown_limits(mu)),
        "elastic shakedown, line contact": (mu, shakedown_limits(mu, line=True), "--"),
    }
    paths = len(parts) > 1
    for when, rate in (("first", before), ("at the end", after)):
        kinds = [max(rate.kinds, key=lambda kind: kind[0])] if paths else rate.kinds
        for b, name in enumerate(parts):
            facts = [own.facts.of(b) for _, own in kinds]
            at = (np.concatenate([getattr(own, of) for own in facts]) for of in ("traction", "load"))
            look = ("+" if when == "first" else "o") + ("-" if paths else "")
            lines[f"{name}, {when}"] = *at, look
    return Panel("traction coefficient T/N", "largest pressure over shear yield stress, p0/k", lines)


def stations_of(state: Evolution) -> list[tuple[int, int]]:
    """(body, line of the plan) of the deepest wear, then of what is deepest APART from that, by x."""
    found: list[tuple[int, int]] = []
    rest = state.depth.max(axis=2)
    while len(found) < STATIONS and rest.max() > 0:
        body, i = divmod(int(np.argmax(rest)), rest.shape[1])
        found.append((body, i))
        rest[body, np.abs(state.worn.x - state.worn.x[i]) < APART] = 0.0
    return sorted(found, key=lambda one: one[1])


def section_panels(site: CrossingSite, state: Evolution, stations: list[tuple[int, int]]) -> list[Panel]:
    """Sections before and after where wear is deepest, then what the body that counts lost by wear, and by flow before
    it."""
    sections, lost = [], []
    y, after = np.linspace(state.worn.y[0], state.worn.y[-1], OUTLINE), site.crossing(state.worn)
    for body, i in stations:
        x, name, own = np.full(len(y), state.worn.x[i]), BODIES[body], state.worn.y * MM
        heights = lambda crossing, b, x=x: crossing.heights(x, y, b)
        shown = lambda h: np.where(h > DEEPEST_SHOWN, h, np.nan) * MM
        outlines: dict[str, tuple] = {f"{b}, before": (y * MM, shown(heights(site.base, b)), ":") for b in BODIES}
        outlines |= {f"{b}, after": (y * MM, shown(heights(after, b))) for b in BODIES}
        sections.append(Panel("y [mm]", "z [mm]", outlines, f"x = {x[0] * MM:.0f} mm"))
        worn = np.flatnonzero(state.depth[body, i] > 0.01 * state.depth[body, i].max())
        near = slice(max(worn[0] - 4, 0), worn[-1] + 5)
        lines: dict[str, tuple] = {f"{name}, wear": (own[near], -state.depth[body, i, near] * UM)}
        if site.flow is not None:
            lines[f"{name}, flow before"] = own[near], -site.flow[body, i, near] * UM, ":"
        lost.append(Panel("y [mm]", "change of height [\u00b5m]", lines))
    return sections + lost


def plan_figure(title: str, site: CrossingSite, state: Evolution) -> Figure:
    """Depth by the leading law on the crossing's plan."""
    depth = state.depth.sum(axis=0).T * UM
    if depth.max() <= 0:
        return words_instead(f"{title}: nothing is worn off")
    figure, axis = new_panels(5.5)
    shown = np.ma.masked_less(depth, depth.max() * 10.0**-DECADES)
    look = {"norm": LogNorm(depth.max() * 10.0**-DECADES, depth.max()), "cmap": "viridis_r", "shading": "nearest"}
    image = axis.pcolormesh(state.worn.x * MM, state.worn.y * MM, shown, **look)
    for height, style in zip(site.heights, ("-", "--"), strict=True):
        axis.contour(state.worn.x * MM, state.worn.y * MM, height.T, [-14e-3], colors="black", linestyles=style)
    figure.colorbar(image, ax=axis, label="depth [\u00b5m]")
    axis.set(xlabel="x along the crossing [mm]; lines: wing (full) and nose, 14 mm deep")
    axis.set(ylabel="y [mm], + to the wing's field side")
    return titled(figure, title, 13)


def tgamma_panels(settings: DamageSettings, state: Evolution, before: CrossingRate, after: CrossingRate) -> list[Panel]:
    """T gamma and fatigue damage of wing and nose along the crossing, first and at the end."""
    model, lines, damage = fatigue_of(settings), {}, {}
    rates = ((f"after {state.passes:,.0f} passes", after, "-"), ("first pass", before, ":"))
    for when, rate, style in rates[: 2 if state.passes else 1]:
        for b, body in enumerate(BODIES):
            for k, (_, own) in enumerate(rate.kinds):
                facts = own.facts.of(b)
                order = np.argsort(facts.x)
                words = f"_{body}, {when}, {k}" if k or not len(order) else f"{body}, {when}"
                x, tgamma = facts.x[order], facts.tgamma[order]
                flown = np.flatnonzero(np.diff(x) > FLOWN * settings.patch_spacing) + 1  # no patch, no line
                x, tgamma = np.insert(x, flown, np.nan), np.insert(tgamma, flown, np.nan)
                lines[words] = x * MM, tgamma, style
                damage[words] = x * MM, model.damage(tgamma) * 1e6, style
    lines |= region_lines(model, state.worn.x[[0, -1]] * MM)
    at, below = "x along the crossing [mm]", "below 0 wear takes cracks away"
    return [Panel(at, "T\u03b3 of a patch [N]", lines), Panel(at, "damage by one axle [10\u207b\u2076]", damage, below)]


def wheel_panels(settings: DamageSettings, site: CrossingSite, state: Evolution) -> list[Panel]:
    """The wheels' profiles; depth over them by the leading law for each kind of pass; the mean of the traffic with the
    band over the laws."""
    depth = np.asarray(state.wheels).sum(axis=2) * (THOUSAND / (state.passes - state.began)) * UM
    y, lead = wheel_lines(settings.plan_spacing) * MM, list(state.by_law).index(settings.law)
    least = LEAST * depth[:, lead].max()
    seen = np.flatnonzero((depth[:, lead] > least).any(axis=0))
    worn = slice(seen[0], seen[-1] + 1)
    y, depth, shown = y[worn], depth[..., worn], lambda values: np.where(values > least, values, np.nan)
    mean = np.tensordot([one.weight for one in site.passes], depth, 1)  # of kinds that wear nothing there, too
    profiles = {one.scene.wheel.name: (y, one.scene.wheel.shape.height(y / MM) * MM) for one in site.passes}
    each: dict[str, tuple] = {}
    for k, (one, own) in enumerate(zip(site.passes, depth[:, lead], strict=True)):  # two kinds may have one label
        each[f"_{one.label}, {k}" if one.label in each else one.label] = y, shown(own)
    bounds = np.maximum(mean.min(axis=0), least), shown(mean.max(axis=0))
    band = {"band over the laws": (y, bounds, "band"), "leading law": (y, shown(mean[lead]))}
    at = "y on the wheel from its tread datum [mm], + to the field side"
    return [
        Panel(at, "profile, z [mm]", profiles),
        Panel(at, "worn off [\u00b5m]", each, "each kind of pass", "y"),
        Panel(at, "worn off [\u00b5m]", band, "mean of the traffic", "y"),
    ]
