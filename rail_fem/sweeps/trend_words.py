"""Trends in words: what is published, what each model finds, why it differs, and what the controls say.

A control is the same cases with one thing changed, run by a light model, to see whether that thing makes the trend: a
reason why a trend differs from a source is no more than a guess until the change that it names has been made.
"""

from pathlib import Path

from rail_fem.case.casefile import load_case
from rail_fem.hierarchy import solve
from rail_fem.sweeps.trends import MEASURES, CaseChanges, ControlExperiment, Group, Results, Trend, TrendFinding, check

AS_IT_IS = CaseChanges()


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


def run_control(
    control: ControlExperiment, trend: Trend, folder: Path, swept: CaseChanges = AS_IT_IS
) -> TrendFinding | None:
    """What the control's model finds, None where it does not resolve the quantity. folder : of the case files
    CASE.toml;  swept : what the sweep has changed in them, the control changes that. Errors: CaseError, the model's
    own."""
    own = {"quantity": control.quantity or trend.quantity, "order": control.order or trend.order}
    asked, results = trend.model_copy(update=own), {}
    for name in dict.fromkeys(asked.order):
        case = load_case(Path(folder) / f"{name}.toml", swept.of(name) | control.of(name)).by(control.model)
        results[name] = {control.model: solve(control.model, case.scene, case.runs[control.model])}
    return next(iter(check(asked, results)), None)


def control_words(control: ControlExperiment, trend: Trend, folder: Path, swept: CaseChanges = AS_IT_IS) -> str:
    """The control in a line, with what came out, or that nothing did on this scene; what it changes stands in the file
    of groups."""
    quantity, found = control.quantity or trend.quantity, run_control(control, trend, folder, swept)
    order = f" ({quantity}: {' < '.join(control.order or trend.order)})" if control.quantity or control.order else ""
    told = found.words(MEASURES[quantity].unit) if found else f"{control.model} does not resolve it on this scene"
    return f"{control.says}{order}: {told}"
