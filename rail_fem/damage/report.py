"""One page for who owns the rail: what, when, how sure, and what the numbers are not."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from geometry.surfaces.bodies import BODIES
from rail_fem.damage.sites import maintenance_of
from rail_fem.damage.traffic import EXTRAPOLATED, INSPECTION, WEEKS, time_in_words
from rail_fem.damage.wear import laws_of
from rail_fem.files.markdown import markdown_table, page_of, table_of
from rail_fem.settings.damage import DamageSettings

UM, MM = 1e6, 1e3
MOST_KINDS = 12  # of pass in a table
THOUSAND = 1000  # passes to which wear is told
NARROW = 1.1  # ratio of the times by the laws, below which a time has two digits


def study_report(title: str, settings: DamageSettings, found: dict[str, Any]) -> str:
    """Markdown page of a site that has worn."""
    crossing, law = found["site"] == "crossing", laws_of(settings)[found["law"]].label
    force = found["largest_force"]
    moves = found.get("transfer")
    goes_over = (
        f"; the load goes over at {_range(moves['first'])} at first, {_range(moves['end'])} at the end" if moves else ""
    )
    blocks: list[str | Sequence[str]] = [
        f"# {title}",
        *([f"**Ended before its {settings.passes:,.0f} passes: {found['ended']}**"] if "ended" in found else []),
        f"{found['passes']:,.0f} wheel passes of {found['kinds']} kind(s) and position(s); the"
        f" shape changes by {law}, forces and patches are found anew on the changed shape {found['blocks']} times;"
        f" calibration factor {settings.factor:g} on all laws.{_resets(found)}",
        f"Largest force {force['first'] / 1e3:.0f} kN at first, {force['end'] / 1e3:.0f} kN at the end{goes_over}.",
        *(_impacts(found["impacts"]) if crossing else []),
        _traffic(settings, found["tonnage"]),
    ]
    for name, own in found["bodies"].items():
        blocks += [f"## {name}", *_part(settings, found, own)]
    blocks += [*_fleet(settings, found), *_wheels(settings, found)]
    if "sensitivities" in found:
        rows = [[name, _ratio(value, "+.2f"), _ratio(error)] for name, _, value, error in found["sensitivities"]]
        ratios = ", ".join(f"{name} {_ratio(value)}" for name, value in found["wheel_ratios"].items())
        blocks += [
            "## What drives it",
            "Volume worn off the nose: change in per cent for one per cent of",
            markdown_table(["parameter", "change [%]", "error"], rows),
            f"By the wheel's shape, over the case's own: {ratios}.",
        ]
    blocks += ["## How sure", markdown_table(["source", "size"], _sources(settings, found))]
    if not crossing:
        hardest = sorted(found["contacts"], key=lambda c: -c["tgamma"])[:4]
        blocks += ["## Hardest contacts at first", table_of([*map(_contact_row, hardest)])]
    if settings.explicit:
        stops = found["explicit"]
        words = (
            f"At each stop {settings.explicit.passes} pass(es) of {stops[0]['kind']}, told from x ="
            f" {stops[0]['start'] * MM:.0f} to {stops[0]['end'] * MM:.0f} mm, their last sections held beyond."
        )
        blocks += ["## Plastic flow by fe_full", words, table_of([*map(_stop_row, stops)])]
    return page_of([*blocks, *_limits(settings, found.get("flow_before"))])


def _traffic(settings: DamageSettings, tonnage: dict[str, float]) -> str:
    """A year's axles as tonnage, and how often somebody looks at them."""
    axles = settings.axles_per_year
    told = (
        f"{axles:,.0f} axles a year are {tonnage['gross']:.3g} million gross tonnes, {tonnage['equivalent']:.3g}"
        " equivalent ones (EMGTPA; factors recalled of UIC 714)."
    )
    if settings.track_category is None:
        return told
    strengthened, plain, supervisor = INSPECTION[settings.track_category]
    other = "not allowed where it is not strengthened" if plain is None else f"every {plain:g} where it is not"
    return (
        f"{told} In track category {settings.track_category} it is inspected every {strengthened:g} week(s) where it is"
        f" strengthened ({strengthened / WEEKS * axles:,.0f} axles between), {other}, and by a supervisor every"
        f" {supervisor:g}."
    )


def _removed(found: dict[str, Any]) -> tuple[str, str, float]:
    """What is removed, its unit, and how many of them a square or cubic metre is."""
    return ("volume", "mm\u00b3", 1e9) if found["site"] == "crossing" else ("area", "mm\u00b2", 1e6)


def _part(settings: DamageSettings, found: dict[str, Any], own: dict[str, Any]) -> list[str | list[str]]:
    """Paragraphs and table of one body."""
    laws, depth, years, end = laws_of(settings), own["deepest_by_law"], own["years"], own["at_end"]
    what, unit, scale = _removed(found)
    axes = "x, y" if found["site"] == "crossing" else "y, z"
    at = lambda name, of: f"at {axes} = {', '.join(f'{v * MM:.1f}' for v in own[name])} mm" if of else "nowhere"
    rows = [
        {
            "law": laws[name].label,
            "deepest [\u00b5m]": f"{depth[name] * UM:.3g}",
            f"{what} [{unit}]": f"{own['removed_by_law'][name] * scale:.3g}",
            f"time to {settings.depth_limit * MM:g} mm": time_in_words(years["to_depth_by_law"][name]),
        }
        for name in depth
    ]
    bounded = f"{own['enlarged_share']:.0%} of the patches bounded by the hardness, " if own["enlarged_share"] else ""
    below, lead, tgamma = own["subsurface"], depth[found["law"]], own["largest_tgamma"]
    return [
        f"**Deepest wear {lead * UM:.3g} \u00b5m** by {laws[found['law']].label} (band"
        f" {min(depth.values()) * UM:.3g} to {max(depth.values()) * UM:.3g} \u00b5m), {at('deepest_at', lead)}. At"
        f" first: largest T\u03b3 {tgamma:.0f} N {at('at', tgamma)} ({own['region']}), flash temperature there"
        f" {own['flash_temperature']:.0f} K, largest pressure {own['largest_pressure'] / 1e6:.0f} MPa;"
        f" {bounded}{own['seizure_share']:.0%} of Archard's wear from cells in seizure. At the end: T\u03b3"
        f" {end['largest_tgamma']:.0f} N, force {end['largest_force'] / 1e3:.0f} kN, pressure"
        f" {end['largest_pressure'] / 1e6:.0f} MPa, {end['seizure_share']:.0%} in seizure."
        + (f" {_subsurface(below, settings)}" if below else "")
        + (f" At the end {own['subsurface_at_end']['dang_van']:.2f}." if own["subsurface_at_end"] else ""),
        _flow(own["flow"]),
        table_of(rows),
        f"Crack index {own['crack_index']:.2g} {at('crack_index_at', own['crack_index'])} (1: visible cracks, by a"
        f" function fitted to plain line); a pass over the last shape adds {own['cracks_per_pass'] * 1e6:.2g}e-6"
        f" {at('cracks_at', own['cracks_per_pass'])}."
        f" {_to_limit(settings, years, end['seizure_share'])}",
    ]


def _sources(settings: DamageSettings, found: dict[str, Any]) -> list[list[str]]:
    """Rows of what the numbers are uncertain by."""
    what, unit, scale = _removed(found)
    rows = [
        [
            "blocks of passes",
            f"{found['blocks']} blocks, bound of their error {found['block_error']:.2%} of the deepest"
            f"{_shortened(settings, found)}",
        ],
        ["smoothing", f"{found['smoothing_change']:.2%} of the deepest, at most"],
        [
            what,
            f"{found['removed'] * scale:.4g} {unit} lost, {found['removed_error']:.1e} from the sum of all strips;"
            f" {found['removed_beyond'] * scale:.2g} {unit} lay beside the metal",
        ],
    ]
    if found["site"] == "switch":
        return [
            *rows,
            ["wear near a border of Archard's map", f"{found['border_share']:.0%} of the wear at first"],
            ["area kept", f"factor within {found['area_correction']:.1e} of 1 in each step"],
        ]
    along, across = (f"{spread * MM:.2f} mm" for spread in found["spread"])
    return [
        *rows,
        ["the surface spreads a depth by", f"{along} along, {across} across (standard deviation)"],
        ["contacts too steep for a plan", f"{found['steep_share']:.1%} of the wear at first"],
    ]


def _flow(found: dict[str, Any] | None) -> str:
    """A paragraph on plastic flow, where the study lets the steel flow."""
    if found is None:
        return ""
    x, y = found["lowered_at"]
    return (
        f"**Plastic flow** up to {found['deepest'] * UM:.3g} \u00b5m deep, {found['volume_moved'] * 1e9:.3g} mm\u00b3"
        f" pressed away, heaps of up to {found['heap'] * UM:.3g} \u00b5m, strain up to {found['strain']:.1%}. Flow and"
        f" wear together lower it most at x = {x * MM:.0f}, y = {y * MM:.1f} mm: {found['lowered'] * UM:.3g} \u00b5m,"
        f" {found['share']:.0%} of it flow."
    )


def _shortened(settings: DamageSettings, found: dict[str, Any]) -> str:
    """Of a study whose told blocks were too long."""
    if (
        found["site"] == "crossing"
        or settings.block is None
        or found["shortest_block"] > 0.999 * min(settings.block, found["passes"])
    ):
        return ""
    return (
        f"; the shortest of {found['shortest_block']:.3g} passes, where {settings.block:g} at once would pass the"
        f" tolerance of {settings.tolerance:.2%} of the deepest or turned the line over"
    )


def _fleet(settings: DamageSettings, found: dict[str, Any]) -> list[str | list[str]]:
    """Life as a distribution over which wheels come, by each law, and who wears it most."""
    own = found.get("fleet")
    if own is None or settings.fleet is None:
        return []
    low, _, high = own["quantiles"]
    farthest = (EXTRAPOLATED - 1) * (found["passes"] - found["began"])
    told = lambda passes: f"{passes:.2g}" if passes is not None and passes <= farthest else f"beyond {farthest:.2g}"
    x, y = own["at"]
    kinds = "; ".join(f"{kind} ({share:.0%})" for kind, share in own["kinds"])
    limit = f"{settings.depth_limit * MM:g} mm"
    rows = [
        {
            "law": laws_of(settings)[law].label,
            f"worn by {THOUSAND:,} passes [\u00b5m]": ", ".join(f"{THOUSAND * one * UM:.3g}" for one in worn),
            f"passes from now to {limit}": ", ".join(map(told, own["passes_to_limit"][law])),
        }
        for law, worn in own["worn_per_pass"].items()
    ]
    return [
        "## The fleet",
        f"At x = {x * MM:.0f}, y = {y * MM:.1f} mm of the {own['body']}, where {limit} come first, at the rate of the"
        f" last shape. Across a row: which of {settings.fleet.kinds} drawn kinds of pass come ({low:.0%}, median,"
        f" {high:.0%}), down the column: the model, by what the laws differ.",
        table_of(rows),
        f"Most of it by {kinds}. Were the worst {own['turned']} kind(s) turned into the mean of the others, it would"
        f" wear {own['less_without_worst']:.0%} less.",
    ]


def _wheels(settings: DamageSettings, found: dict[str, Any]) -> list[str | list[str]]:
    """What wheels of each kind lose in a thousand passes over the crossing as it wears."""
    if not found["wheels"]:
        return []
    rows, per = [], THOUSAND / (found["passes"] - found["began"])
    for one in found["wheels"][:MOST_KINDS]:
        depth, section, volume = (one[f"{name}_by_law"] for name in ("deepest", "section", "volume"))
        lead = found["law"]
        band = lambda values, unit: (
            f"{min(values.values()) * per * unit:.3g} to {max(values.values()) * per * unit:.3g}"
        )
        rows.append(
            {
                "kind of pass": one["kind"],
                "deepest [\u00b5m] (band over the laws)": f"{depth[lead] * per * UM:.3g} ({band(depth, UM)})",
                "at y from the tread datum [mm]": f"{one['deepest_at'] * MM:+.0f}" if depth[lead] else "",
                "section [mm\u00b2] (band)": f"{section[lead] * per * 1e6:.3g} ({band(section, 1e6)})",
                "volume [mm\u00b3]": f"{volume[lead] * per * 1e9:.3g}",
                "of it on the nose": f"{one['nose_share']:.0%}",
            }
        )
    return [
        "## Wheels",
        f"What a wheel of each kind loses in {THOUSAND:,} passes of its own over this crossing as it wears, spread over"
        f" its circumference; hardness {settings.wheel_hardness / 1e9:g} GPa, the same laws and calibration factor:",
        table_of(rows),
        "The wheels' shapes stand for a population and do not change.",
    ]


def _impacts(found: dict[str, list[dict[str, Any]]]) -> list[str | list[str]]:
    """The largest forces by kind of pass, at first."""
    rows = []
    for one in found["first"][:MOST_KINDS]:
        landing = f"{one['flight'] * MM:.0f}", f"{one['speed']:.2f}", f"{one['free'] / 1e3:.0f}"
        flight, speed, free = landing if one["flight"] else ("",) * 3
        rows.append(
            {
                "kind of pass": one["kind"],
                "share": f"{one['share']:.0%}",
                "largest force [kN]": f"{one['force'] / 1e3:.0f}",
                "on": BODIES[one["body"]],
                "x [mm]": f"{one['x'] * MM:.0f}",
                "after a flight of [mm]": flight,
                "landing at [m/s]": speed,
                "free masses at that speed [kN]": free,
            }
        )
    return [
        table_of(rows),
        "A wheel that lands meets a track that swings back as one mass on one spring: forces of a second impact depend"
        " on all that went before, and are less sure than those of the first.",
    ]


def _limits(settings: DamageSettings, before: dict[str, float] | None = None) -> list[str | list[str]]:
    """before : plastic flow by a run before all wear, of damage.flow"""
    flow = "No plastic flow in this study: new steel changes its shape by flow before it wears."
    if settings.plastic_flow:
        flow = (
            "Plastic flow goes by a law whose limit and strain were read off one explicit run (docs/models/damage.md)."
        )
    if settings.explicit:
        flow = (
            "Plastic flow is that of the most frequent kind of pass by fe_full, held from stop to stop: passes between"
            " two stops, and other kinds of pass, press nothing of their own."
        )
    if before is not None:
        flow = (
            f"Plastic flow, up to {before['deepest'] * UM:.3g} \u00b5m deep, is that of the run in damage.flow, before"
            f" all wear; it does not go on with the passes. That run went from x = {before['start'] * MM:.0f} to"
            f" {before['end'] * MM:.0f} mm, and its last sections are held beyond."
        )
    return [
        "## What these numbers are not",
        [
            "- Laws come from dry laboratory tests and differ by factors of 10 to 100 at the same friction work;"
            " field rates are an order below them. The calibration factor stands for lubrication and climate and is to"
            " be fitted.",
            f"- {flow}",
            "- T\u03b3's damage function was fitted to curves of plain line in grade 220 rail.",
        ],
    ]


def _stop_row(stop: dict[str, Any]) -> dict[str, str]:
    return {
        "after passes": f"{stop['passes']:.6g}",
        "deepest flow of wing, nose [\u00b5m]": f"{stop['wing'] * UM:.3g}, {stop['nose'] * UM:.3g}",
        "impact of the last explicit pass [kN]": f"{stop['impact'] / 1e3:.1f}",
        "it added to the nose's integral of plastic strain [mm\u00b3]": f"{stop['added'] * 1e9:.3g}",
    }


def _contact_row(c: dict[str, Any]) -> dict[str, str]:
    return {
        "y, z [mm]": f"{c['y'] * MM:.1f}, {c['z'] * MM:.1f}",
        "N [kN]": f"{c['normal_force'] / 1e3:.1f}",
        "p0 [MPa]": f"{c['max_pressure'] / 1e6:.0f}",
        "angle [\u00b0]": f"{np.degrees(c['angle']):.0f}",
        "T\u03b3 [N]": f"{c['tgamma']:.1f}",
        "friction power per speed [N]": f"{c['power']:.1f}",
        "region": c["region"],
        "p0/k": f"{c['load']:.1f}",
        "T/N": f"{c['traction']:.2f}",
        "fatigue index": f"{c['index']:+.2f}",
        "flash [K]": f"{c['flash']:.0f}",
    }


def _resets(found: dict[str, Any]) -> str:
    if not found["resets"]:
        return ""
    return (
        f" Ground or welded {found['resets']:.0f} time(s), {found['height_ground_off'] * MM:.3g} mm of height ground"
        " off; all depths below are since the last time."
    )


def _to_limit(settings: DamageSettings, years: dict[str, Any], seized: float) -> str:
    """What a pass wears off the last shape, and the time to the limit where it may be told. seized : share of that"""
    axles = settings.axles_per_year
    wears = float(f"{years['depth_per_year'] / axles * UM * THOUSAND:.2g}")
    limit = f"{settings.depth_limit * MM:g} mm"
    rate = f"Where {limit} come first {THOUSAND:,} passes over the last shape wear {wears:g} \u00b5m."
    if years["told_up_to"] is None:
        why = "one pass or none says nothing of how wear goes on"
        if settings.calibration is None:
            why = "`calibration` is not given, a laboratory's rates are no site's"
        return f"{rate} No years are told: {why}."
    if years["to_limit"] is None:
        return (
            f"{rate} No years are told: neither that depth nor visible cracks come within {EXTRAPOLATED:g} times the"
            f" passes that were run ({time_in_words(years['told_up_to'])} at {axles:,.0f} axles a"
            f" year).{_maintained(settings, years)}"
        )
    laws = list(years["to_depth_by_law"].values())
    known = [v for v in laws if v is not None]
    digits = 2 if len(known) == len(laws) and max(known) < NARROW * min(known) else 1
    low = time_in_words(min(known, default=None))
    high = time_in_words(max(known)) if len(known) == len(laws) else f"beyond {time_in_words(years['told_up_to'])}"
    flows = (
        f", though {seized:.0%} of Archard's wear then comes from steel in seizure, which flows first" if seized else ""
    )
    return (
        f"{rate} At {axles:,.0f} axles a year that depth or visible cracks come after"
        f" {time_in_words(years['to_limit'], digits)} ({years['limit']}; depth by the laws {low} to {high}), if all"
        f" goes on as over the last shape{flows}.{_maintained(settings, years)}"
    )


def _maintained(settings: DamageSettings, years: dict[str, Any]) -> str:
    events = maintenance_of(settings)
    if not events or years["to_limit"] == years["to_limit_maintained"]:
        return ""
    listed = ", ".join(f"{event.name} at {event.time:g}" for event in events)
    why = f" ({years['limit_maintained']})" if years["limit_maintained"] else ""
    return f" With {listed} years: {time_in_words(years['to_limit_maintained'])}{why}."


def _subsurface(found: dict[str, float], settings: DamageSettings) -> str:
    return (
        f"Below the surface, {found['depth'] * MM:.1f} mm deep, Dang Van's stress is {found['dang_van']:.2f} of the"
        f" limit of {settings.fatigue_limit / 1e6:.0f} MPa (above 1: cracks begin), and Jiang and Sehitoglu's"
        f" fatigue parameter at most {found['jiang_sehitoglu'] / 1e6:.2g} MPa (its limit is not known here), by"
        " elastic stresses under the largest force."
    )


def _ratio(value: float | None, form: str = ".2f") -> str:
    return f"{value:{form}}" if value is not None and np.isfinite(value) else "none"


def _range(values: list[float]) -> str:
    there = [v for v in values if v is not None and np.isfinite(v)]
    if not there:
        return "nowhere"
    low, high = min(there) * MM, max(there) * MM
    return f"x = {low:.0f} mm" if high - low < 1 else f"x = {low:.0f} to {high:.0f} mm"
