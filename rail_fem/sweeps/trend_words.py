"""Trends in words: what is published, what each model finds, why it differs, and what the controls say."""

from __future__ import annotations

from pathlib import Path

from rail_fem.sweeps.controls import AS_IT_IS, control_words
from rail_fem.sweeps.trends import MEASURES, CaseChanges, Group, Results, TrendFinding, check


def trend_lines(group: Group, results: Results, cases: Path, swept: CaseChanges = AS_IT_IS) -> list[str]:
    """Markdown of a group's trends. cases : folder of the case files, for the controls;  swept : what was changed in
    them."""
    lines = []
    for trend in group.trend:
        found = check(trend, results)
        unit = MEASURES[trend.quantity].unit
        between = " = " if trend.unchanged else " < "
        within = f", within {100 * trend.unchanged:g} %" if trend.unchanged else ""
        lines.append(
            f"- **{trend.says}** ({trend.quantity}: {between.join(trend.order)}{within})"
            + (f"; published: {trend.published}" if trend.published else "")
        )
        lines += [f"  - {finding.words(unit)}" for finding in found] or ["  - no model has all of these results"]
        lines += [f"  - {word} because: {trend.because}"] if trend.because and (word := reason_word(found)) else []
        lines += [f"  - control: {control_words(control, trend, cases, swept)}" for control in trend.control]
    return lines


def reason_word(found: list[TrendFinding]) -> str:
    """What the most expensive model that resolves the trend makes of it, if it does not agree; "differs" where a less
    expensive one does; "" where all agree."""
    verdicts = [finding.verdict for finding in found]
    if not verdicts or set(verdicts) == {"agrees"}:
        return ""
    if verdicts[-1] == "agrees":
        return "some models differ" if "differs" in verdicts else "some models see no change"
    return {"differs": "differs", "same": "no change"}[verdicts[-1]]


def count_lines(groups: tuple[Group, ...], results: Results) -> list[str]:
    """How many trends agree by the most expensive model of each, and which do not."""
    judged = [
        (group, trend, found[-1]) for group in groups for trend in group.trend if (found := check(trend, results))
    ]
    named = lambda verdict: [
        f"{group.title}: {trend.says} ({trend.quantity}; {finding.model})"
        for group, trend, finding in judged
        if finding.verdict == verdict
    ]
    differ, same = named("differs"), named("same")
    lines = [
        f"{len(judged) - len(differ) - len(same)} of {len(judged)} trends agree by the most expensive model that"
        " resolves them."
    ]
    lines += [f"{len(differ)} differ: " + "; ".join(differ) + "."] if differ else []
    return lines + ([f"{len(same)} show no change above 1 %: " + "; ".join(same) + "."] if same else [])
