"""The page of a sweep: its table, its trends in words, and the figures of each group of cases."""

from __future__ import annotations

import re
from pathlib import Path

from rail_fem.atomic import write_text_atomically
from rail_fem.ladder import LADDER
from rail_fem.result import PassResult
from rail_fem.show.group import group_figure, strain_figure, summary_figure
from rail_fem.show.style import lettering, save
from rail_fem.sweep_report import Results, force_table, results_below
from rail_fem.trends import MEASURES, Group, load_groups, trend_lines

SUMMARY = {"largest force\non the nose": "nose peak", "largest force\non the wing": "wing peak", "largest plastic strain\nof the nose": "nose strain"}


def write_page(folder: Path, groups: Path, out: Path) -> Path:
    """Write out/report.md and its figures; returns the page. Errors: TrendError, FileNotFoundError without results, OSError."""
    found = load_groups(groups)
    results, unusable = results_below(folder)
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    with lettering():
        pictures = [draw_summary(results, out), *(path for group in found for path in draw_group(group, results, Path(folder), out))]
    lines = ["# Report of a sweep", "", *force_table(results), ""]
    lines += ["Left out:", "", *(f"- {sentence}" for sentence in unusable), ""] if unusable else []
    lines += trend_lines(found, results)
    lines += [f"![{path.stem}]({path.name})" for path in pictures]
    write_text_atomically(out / "report.md", "\n".join(lines) + "\n")
    return out / "report.md"


def draw_summary(results: Results, out: Path) -> Path:
    measures = {words: MEASURES[name] for words, name in SUMMARY.items()}
    return save(summary_figure(results, measures, "All cases, every rung"), out / "summary.png")


def draw_group(group: Group, results: Results, folder: Path, out: Path) -> list[Path]:
    """Histories and plastic strain of a group, by the dearest rung that all its cases have; nothing where there is none."""
    common = [model for model in LADDER if all(model in results.get(case, {}) for case in group.cases)]
    if not common:
        return []
    model, name = common[-1], re.sub(r"\W+", "_", group.title.lower())
    mine: dict[str, PassResult] = {case: results[case][model] for case in group.cases}
    paths = [save(group_figure(group.title, mine), out / f"{name}.png")]
    strain = strain_figure(group.title, {case: folder / case / model for case in group.cases}, mine)
    return paths + ([save(strain, out / f"{name}_strain.png")] if strain else [])
