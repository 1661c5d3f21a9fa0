"""Trends in words: what is published, what each model finds, why it differs, and what the controls say."""

from __future__ import annotations

from pathlib import Path

from rail_fem.sweeps.controls import AS_IT_IS, control_words
from rail_fem.sweeps.trends import MEASURES, CaseChanges, Group, Results, TrendFinding, check


def trend_lines(
    group: Group, results: Results, cases: Path, swept: CaseChanges = AS_IT_IS, beside: Results | None = None
) -> list[str]:
    """Markdown of a group's trends. cases : folder of the case files, for the controls;  swept : what was changed in
    them;  beside : of another sweep of the cases, whose most expensive model is told where it finds
    otherwise"""
    lines = []
    for trend in group.trend:
        found = check(trend, results)
        lines.append(
            f"- **{trend.says}** ({trend.statement})" + (f"; published: {trend.published}" if trend.published else "")
        )
        unit = MEASURES[trend.quantity].unit
        lines += [f"  - {words}" for words in finding_words(found, unit)]
        there = check(trend, beside or {})[-1:]
        lines += [f"  - beside: {one.words(unit)}" for one in there if not found or one.verdict != found[-1].verdict]
        lines += [f"  - {word} because: {trend.because}"] if trend.because and (word := reason_word(found)) else []
        lines += [f"  - control: {control_words(control, trend, cases, swept)}" for control in trend.control]
    return lines


def finding_words(found: list[TrendFinding], unit: str) -> list[str]:
    """A line for the most expensive model with its values, and for each other one that does not find the same."""
    if not found:
        return ["no model has all of these results"]
    *others, last = found
    like = [other.model for other in others if other.verdict == last.verdict]
    alone = [other.words(unit) for other in others if other.verdict != last.verdict]
    return [*alone, last.words(unit, f" (so {', '.join(like)})" if like else "")]


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
    count = lambda verdict, among=judged: sum(finding.verdict == verdict for _, _, finding in among)
    sure = sum(finding.verdict == "agrees" and finding.sure for _, _, finding in judged)
    by_group = {group.title: [one for one in judged if one[0] is group] for group in groups}
    return [
        f"{count('agrees')} of {len(judged)} trends agree by the most expensive model that resolves them, {sure} of"
        f" these by more than the bars; {count('differs')} differ, {count('same')} show no change above 1 %. By group: "
        + ", ".join(f"{name} {count('agrees', of)} of {len(of)}" for name, of in by_group.items())
        + "."
    ]
