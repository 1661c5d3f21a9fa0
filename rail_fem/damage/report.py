"""One page for who owns the rail: what, when, how sure, and what the numbers are not."""

from __future__ import annotations

from typing import Any

import numpy as np

from rail_fem.damage.sites import laws_of
from rail_fem.damage.traffic import HORIZON
from rail_fem.output.markdown import markdown_table
from rail_fem.settings.damage import DamageSettings

UM, MM = 1e6, 1e3


def section_report(title: str, settings: DamageSettings, found: dict[str, Any]) -> str:
    """Markdown page of a section that has worn."""
    laws, years = laws_of(settings), found["years"]
    contacts = sorted(found["contacts"], key=lambda c: -c["tgamma"])[:4]
    rows = [
        [
            laws[name].label,
            f"{found['deepest_by_law'][name] * UM:.3g}",
            f"{found['area_by_law'][name] * 1e6:.4g}",
            _years(years["to_depth_by_law"][name]),
        ]
        for name in found["deepest_by_law"]
    ]
    low, high = min(found["deepest_by_law"].values()), max(found["deepest_by_law"].values())
    lines = [
        f"# {title}",
        "",
        f"{found['passes']:,.0f} wheel passes; the shape changes by {laws[found['law']].label}, calibration factor"
        f" {settings.calibration:g} on all laws.",
        "",
        f"**Deepest wear {found['deepest'] * UM:.3g} \u00b5m** (band over the laws"
        f" {low * UM:.3g} to {high * UM:.3g} \u00b5m),"
        f" largest T\u03b3 {found['tgamma']['largest']:.0f} N at first,"
        f" {found['tgamma']['largest_at_end']:.0f} N at the end.",
        "",
        _table(["law", "deepest [\u00b5m]", "area [mm\u00b2]", f"years to {settings.depth_limit * MM:g} mm"], rows),
        "",
        f"At {settings.axles_per_year:,.0f} axles a year: {years['depth_per_year'] * MM:.3g} mm a year at"
        f" the deepest position"
        f" by the leading law; limit of {settings.depth_limit * MM:g} mm or visible cracks in"
        f" {_years(years['to_limit'])} years"
        f"{' (' + years['limit'] + ')' if years['limit'] else ''}, if wear went on at this mean rate.",
        "",
        "## How sure",
        "",
        _table(
            ["source", "size"],
            [
                [
                    "wear law (band above)",
                    f"{low / found['deepest']:.2g} to {high / found['deepest']:.2g} times"
                    if found["deepest"]
                    else "no wear",
                ],
                ["blocks of passes", f"{found['blocks']} blocks, error {found['block_error']:.2%} of the deepest"],
                ["smoothing along the line", f"{found['smoothing_change']:.2%} of the deepest, at most"],
                ["wear near a border of Archard's map", f"{found['border_share']:.0%} of the wear at first"],
                [
                    "area kept",
                    f"factor within {found['area_correction']:.1e} of 1 in each step; beyond the section"
                    f" {found['area_beyond'] * 1e6:.2g} mm\u00b2",
                ],
            ],
        ),
        "",
        "## Hardest contacts at first",
        "",
        _contact_table(contacts),
        "",
        *_limits(),
    ]
    return "\n".join(lines) + "\n"


def crossing_report(title: str, settings: DamageSettings, found: dict[str, Any]) -> str:
    """Markdown page of passes over a crossing."""
    laws = laws_of(settings)
    lines = [
        f"# {title}",
        "",
        f"{found['passes']:,.0f} wheel passes of {found['kinds']} kind(s) on the unworn shape, calibration factor"
        f" {settings.calibration:g} on all laws.",
    ]
    for body, own in found["bodies"].items():
        depth, years = own["deepest_by_law"], own["years"]
        lead, low, high = depth[found["law"]], min(depth.values()), max(depth.values())
        rows = [
            [
                laws[name].label,
                f"{depth[name] * UM:.3g}",
                f"{own['volume_by_law'][name] * 1e9:.3g}",
                _years(years["to_depth_by_law"][name]),
            ]
            for name in depth
        ]
        lines += [
            "",
            f"## {body}",
            "",
            f"**Deepest wear {lead * UM:.3g} \u00b5m** by {laws[found['law']].label} (band {low * UM:.3g}"
            f" to {high * UM:.3g}"
            f" \u00b5m). Largest T\u03b3 {own['largest_tgamma']:.0f} N at x = {own['at'] * MM:.0f} mm"
            f" ({own['region']}), flash"
            f" temperature there {own['flash_temperature']:.0f} K, largest pressure"
            f" {own['largest_pressure'] / 1e6:.0f} MPa;"
            f" {own['enlarged_share']:.0%} of the patches bounded by the hardness. {own['seizure_share']:.0%} of"
            " Archard's wear comes from cells in seizure: elastic pressures on an unworn corner, which flow and wear"
            " end within the first passes.",
            "",
            _table(
                ["law", "deepest [\u00b5m]", "volume [mm\u00b3]", f"years to {settings.depth_limit * MM:g} mm"], rows
            ),
            "",
            f"Most fatigue {own['cracks_per_pass'] * 1e6:.2g}e-6 an axle at x = {own['cracks_at'] * MM:.0f} mm:"
            f" {own['cracks_per_pass'] * settings.axles_per_year:.2g} a year at"
            f" {settings.axles_per_year:,.0f} axles (1: visible"
            " cracks, by a function fitted to plain line).",
        ]
    if "sensitivities" in found:
        rows = [[name, f"{value:+.2f}", f"{error:.2f}"] for name, _, value, error in found["sensitivities"]]
        lines += [
            "",
            "## What drives it",
            "",
            "Volume worn off the nose: change in per cent for one per cent of",
            "",
            _table(["parameter", "change [%]", "error"], rows),
        ]
    lines += [
        "",
        "The shape does not change between passes here: wear spreads a sharp contact within the first"
        " thousand, so that"
        " depths of many passes are upper ends.",
        "",
        *_limits(),
    ]
    return "\n".join(lines) + "\n"


def _limits() -> list[str]:
    return [
        "## What these numbers are not",
        "",
        "- Laws come from dry laboratory tests and differ by a factor of ten at the same friction work;"
        " field rates are"
        " an order below them. The calibration factor stands for lubrication and climate and is to be fitted.",
        "- No plastic flow: a new casting changes its shape by flow before it wears.",
        "- T\u03b3's damage function was fitted to curves of plain line in grade 220 rail.",
    ]


def _contact_table(contacts: list[dict[str, Any]]) -> str:
    rows = [
        [
            f"{c['position'][0] * MM:.1f}, {c['position'][1] * MM:.1f}",
            f"{c['normal_force'] / 1e3:.1f}",
            f"{c['largest_pressure'] / 1e6:.0f}",
            f"{np.degrees(c['angle']):.0f}",
            f"{c['tgamma']:.1f}",
            f"{c['friction_power']:.1f}",
            c["region"],
            f"{c['load_factor']:.1f}",
            f"{c['traction']:.2f}",
            f"{c['fatigue_index']:+.2f}",
            f"{c['flash_temperature']:.0f}",
        ]
        for c in contacts
    ]
    head = [
        "y, z [mm]",
        "N [kN]",
        "p0 [MPa]",
        "angle [\u00b0]",
        "T\u03b3 [N]",
        "friction power per speed [N]",
        "region",
        "p0/k",
        "T/N",
        "fatigue index",
        "flash [K]",
    ]
    return _table(head, rows)


def _table(head: list[str], rows: list[list[str]]) -> str:
    return "\n".join(markdown_table(head, rows))


def _years(value: float | None) -> str:
    return f"over {HORIZON:.0f}" if value is None or value >= HORIZON else f"{value:.3g}"
