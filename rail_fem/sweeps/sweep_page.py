"""The page of a sweep: its tables, its trends in words with reasons and controls, the figures of each group, which
figure of a source each stands for."""

import re
import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from rail_fem.case.variations import as_setting
from rail_fem.files.atomic import write_text_atomically
from rail_fem.files.markdown import markdown_table, page_of
from rail_fem.hierarchy import MODELS
from rail_fem.result.result import PassResult
from rail_fem.result.trust import GOOD
from rail_fem.result.versions import versions
from rail_fem.show.reference import dip_figure, forces_figure
from rail_fem.show.style import lettering, save
from rail_fem.sweeps.compare import core_seconds
from rail_fem.sweeps.group_figure import Marks, group_figure, strain_figure, summary_figure
from rail_fem.sweeps.published_table import beside_table, leg_table, published_table, scenes_apart
from rail_fem.sweeps.sweep_report import Results, force_table, parts_of, results_below
from rail_fem.sweeps.trend_words import count_lines, trend_lines
from rail_fem.sweeps.trends import MEASURES, Group, Source, load_source

SUMMARY = {
    "impact on\nthe wheel": "impact on the wheel",
    "largest force": "largest force",
    "largest force\non the wing": "largest wing force",
    "mean plastic strain of the\nnose's worst 5 x 5 x 3 mm": "nose strain",
}
OVER_LEG = {
    "largest force\non the leg": "largest leg force",
    "largest force\non the wing": "largest wing force",
    "largest force\non the nose": "largest nose force",
    "mean plastic strain of the\nleg's worst 1000 mm3": "leg strain of 1000 mm3",
    "longest flight\noff the leg": "flight off the leg",
}  # in place of the former, where any pass runs over the leg
# panels beside which the source's largest force belongs, which is that on the nose
PEAKS = ("impact on\nthe wheel", "largest force", "largest force\non the nose")
BESIDE = ("rigid_hertz", "fe_full")  # models whose forces are drawn beneath one another
UNKNOWN, DIRTY = "unknown", "-dirty"  # of commits, as rail_fem.result.versions.git_revision has them
COMPACT = 80  # dots per inch of a page for a repository


@dataclass(frozen=True)
class Picture:
    """A figure of the page: file name, what it shows, which figures of the source it stands for, how it is drawn (None:
    nothing to draw)."""

    name: str
    words: str
    stands_for: str
    draw: Callable[[], Figure | None]


@dataclass(frozen=True)
class Sweep:
    """A sweep that a page is about. folder : of its results, groups : its file of groups, read as `source`, with the
    settings that the sweep was given; beside : folder of another sweep of the same cases, and its results"""

    folder: Path
    groups: Path
    source: Source
    results: Results
    unusable: list[str]
    beside: Path | None = None
    others: Results = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def options(self) -> str:
        """Of the command that made the sweep, and of the one that makes its page."""
        return "".join(f" --set {shlex.quote(as_setting(key, value))}" for key, value in self.settings.items())


def read_sweep(
    folder: Path | str, groups: Path | str, beside: Path | str | None = None, settings: Mapping[str, Any] | None = None
) -> Sweep:
    """beside : folder of another sweep of the same cases, their scenes changed or not;  settings : values that the
    sweep was given in place of the files' and the groups'. Errors: TrendError, CaseError, FileNotFoundError without
    results."""
    folder, groups, settings = Path(folder), Path(groups), dict(settings or {})
    beside = None if beside is None else Path(beside)
    source = load_source(groups).with_settings(settings)
    results, unusable = results_below(folder, groups.parent, source)
    others, unfit = ({}, []) if beside is None else results_below(beside)
    return Sweep(folder, groups, source, results, unusable + unfit, beside, others, settings)


def write_page(sweep: Sweep, out: Path) -> Path:
    """Write out/report.md and its figures; returns the page. Errors: TrendError, CaseError, OSError."""
    source, results = sweep.source, sweep.results
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    drawn = draw_all(pictures(source, results, sweep.folder), out)
    blocks = page_blocks(sweep, f"--out {out}", drawn, "")
    images = [f"![{picture.words}]({picture.name}.png)" for picture in drawn]
    write_text_atomically(out / "report.md", page_of([*blocks, images]))
    return out / "report.md"


def write_digest(sweep: Sweep, page: Path, shown: tuple[str, ...]) -> Path:
    """The same page as one Markdown file for a repository, with the figures named in `shown` beside it, small. Errors:
    as write_page, ValueError for a figure that is not there."""
    source, results, page = sweep.source, sweep.results, Path(page)
    found = pictures(source, results, sweep.folder)
    absent = sorted(set(shown) - {picture.name for picture in found})
    if absent:
        raise ValueError(
            f"--show {', '.join(absent)}: no such figure; there are {', '.join(picture.name for picture in found)}"
        )
    page.parent.mkdir(parents=True, exist_ok=True)
    prefix = f"{page.stem}_"
    drawn = draw_all([picture for picture in found if picture.name in shown], page.parent, prefix, COMPACT)
    how = " ".join([f"--digest {page}", *(f"--show {name}" for name in shown)])
    blocks = page_blocks(sweep, how, found, f"{sweep.folder}/report/")
    images = (f"![{picture.words}]({prefix}{picture.name}.png)\n\n*{picture.words}.*" for picture in drawn)
    write_text_atomically(page, page_of([*blocks, *images]))
    return page


def draw_all(wanted: list[Picture], out: Path, prefix: str = "", dots: int | None = None) -> list[Picture]:
    """Draw and save; returns those that had something to show."""
    drawn = []
    with lettering():
        for picture in wanted:
            figure = picture.draw()
            if figure is not None:
                save(figure, out / f"{prefix}{picture.name}.png", *(() if dots is None else (dots,)))
                drawn.append(picture)
    return drawn


def page_blocks(sweep: Sweep, how: str, found: list[Picture], place: str) -> list[str | list[str]]:
    """How it was made, tables, trends, which figures there are. how : options of the command that writes the page;
    place : of the figures found, before their names"""
    source, results, groups = sweep.source, sweep.results, sweep.groups
    own = load_source(groups)
    changed = (f" --groups {groups}" if own.change or own.only else "") + sweep.options
    beside = f" --beside {sweep.beside}" if sweep.beside else ""
    made = (
        f"Runs by `rail-fem sweep {groups.parent}/case_*.toml{changed} --out {sweep.folder}`; this page by"
        f" `rail-fem report {sweep.folder} --groups {groups}{beside}{sweep.options} {how}` at commit"
        f" {versions().get('git') or UNKNOWN}."
    )
    blocks: list[str | list[str]] = [f"# {source.title}", source.intro, made]
    blocks += [state_lines(results), absent_lines(sweep, changed), count_lines(source.group, results)]
    blocks += ["## All cases, every model", force_table(results), trust_lines(results)]
    if sweep.unusable:
        blocks += ["Left out:", [f"- {sentence}" for sentence in sweep.unusable]]
    tables = {
        "P2 force: published, by formula, and the peaks of the models": published_table(source.published, results),
        "The leg: published, and by every model": leg_table(source.published, results),
        f"Beside {sweep.beside}": beside_lines(sweep),
    }
    blocks.append(cost_lines(results))
    for title, table in tables.items():
        if table:
            blocks += [f"## {title}", table]
    for group in source.group:
        blocks += [f"## {group.title}", trend_lines(group, results, groups.parent, source, sweep.others)]
    return [*blocks, "## Figures", figure_table(source, found, place)]


def beside_lines(sweep: Sweep) -> list[str]:
    """The other sweep of the same cases: how its scenes differ, its trends counted, the forces of both; nothing without
    it."""
    table = beside_table(sweep.results, sweep.others, sweep.source.published)
    if not table:
        return []
    apart = scenes_apart(sweep.results, sweep.others) or "the same scenes"
    said = [f"Common to all its cases [SI]: {apart}.", *state_lines(sweep.others)]
    counted = [*count_lines(sweep.source.group, sweep.others), "Below, a trend that is found otherwise there says so."]
    return [" ".join(said), "", " ".join(counted), "", *table]


def state_lines(results: Results) -> list[str]:
    """At which commits the runs were made; which run at which where it is not one, committed."""
    of_state: dict[str, list[str]] = {}
    for case, of_case in results.items():
        for model, result in of_case.items():
            of_state.setdefault(result.versions.get("git", "") or UNKNOWN, []).append(f"{case} {model}")
    first, *others = sorted(of_state)
    if not others and not first.endswith(DIRTY):
        return [f"All runs at commit {first}."]
    return [
        f"**Not of one committed state** (what differs from a commit is marked {DIRTY}):",
        "",
        *(f"- {state}: {', '.join(of_state[state])}" for state in sorted(of_state)),
    ]


def absent_lines(sweep: Sweep, changed: str) -> list[str]:
    """Cases of the groups that the most expensive model of the sweep has not run, and how to go on."""
    results = sweep.results
    model = [model for model in MODELS if any(model in of_case for of_case in results.values())][-1]
    named = sorted({case for group in sweep.source.group for case in group.cases})
    absent = [case for case in named if model not in results.get(case, {})]
    if not absent:
        return []
    files = " ".join(f"{sweep.groups.parent}/{case}.toml" for case in absent)
    return [
        f"{model} has not run {', '.join(absent)}: `rail-fem sweep {files}{changed} --model {model} --out"
        f" {sweep.folder}` goes on; trends are checked on the models that have all their cases."
    ]


def trust_lines(results: Results) -> list[str]:
    """How many of the explicit runs fail rows of their own trust reports, and which rows."""
    reports = [r.trust["rows"] for of_case in results.values() for r in of_case.values() if r.trust.get("rows")]
    failed = [row["name"] for rows in reports for row in rows if row["verdict"] != GOOD]
    if not reports:
        return []
    which = "; ".join(f"{name} in {failed.count(name)}" for name in dict.fromkeys(failed)) or "none"
    return [
        f"Element size and trust report are those of the most expensive model of a row. Of {len(reports)} explicit"
        f" runs, {sum(any(row['verdict'] != GOOD for row in rows) for rows in reports)} fail rows of their own trust"
        f" report: {which}. A size in bold is not that of the other rows."
    ]


def cost_lines(results: Results) -> list[str]:
    """What each model took over all its cases."""
    costs = {
        model: [core_seconds(of_case[model]) for of_case in results.values() if model in of_case] for model in MODELS
    }
    return [
        "Core seconds of all cases (figures and start of the program left out): "
        + ", ".join(
            f"{model} {sum(spent):.{0 if sum(spent) > 100 else 1}f} s over {len(spent)}"
            for model, spent in costs.items()
            if spent
        )
        + "."
    ]


def figure_table(source: Source, found: list[Picture], place: str) -> list[str]:
    """Which figure of the source each picture stands for, and which have no like."""
    rows = [[picture.stands_for or "-", f"`{place}{picture.name}.png`", picture.words] for picture in found]
    absent = [[sentence.split(":")[0], "-", sentence.partition(":")[2].strip()] for sentence in source.absent]
    head = ["figure of the source", "here", "what it shows"]
    return markdown_table(head, [*rows, *absent])


def published_marks(source: Source) -> Marks:
    """What the source gives beside ours: its largest force of the wheel, that on the leg [kN]."""
    known = lambda name: {row.case: value for row in source.published if (value := getattr(row, name)) is not None}
    peaks, force = known("peak"), known("leg_force")
    marks = dict.fromkeys(PEAKS, ("published FE peak", peaks)) if peaks else {}
    return marks | ({"largest force\non the leg": ("published, on the leg", force)} if force else {})


def pictures(source: Source, results: Results, folder: Path) -> list[Picture]:
    """All figures that this sweep can give, in order."""
    wanted = OVER_LEG if "leg" in parts_of(results) else SUMMARY
    measures = {words: MEASURES[name] for words, name in wanted.items()}
    draw = lambda: summary_figure(results, measures, "All cases, every model", published_marks(source))
    words = "Largest forces and plastic strain of all cases, every model"
    found = [Picture("summary", words, source.summary_figures, draw)]
    of_reference = results.get(source.reference, {})
    beside = {model: of_reference[model] for model in BESIDE if model in of_reference}
    if beside:
        (forces, heights), most_expensive = source.reference_figures, list(beside.values())[-1]
        by, dip = f"by {' and '.join(beside)}", f"Displacements and dip angle of {source.reference}"
        found += [
            Picture(
                "reference_forces", f"Contact force of {source.reference} {by}", forces, lambda: forces_figure(beside)
            ),
            Picture("reference_dip", dip, heights, lambda: dip_figure(most_expensive)),
        ]
    for group in source.group:
        found += group_pictures(group, results, folder)
    return found


def group_pictures(group: Group, results: Results, folder: Path) -> list[Picture]:
    """Histories and plastic strain of a group, by the most expensive model that all its cases have; nothing where there
    is none."""
    common = [model for model in MODELS if all(model in results.get(case, {}) for case in group.cases)]
    if not common:
        return []
    model, name = common[-1], re.sub(r"\W+", "_", group.title.lower())
    mine: dict[str, PassResult] = {case: results[case][model] for case in group.cases}
    folders = {case: folder / case / model for case in group.cases}
    words = f"{group.title}: force, wheel, crossing, lateral position of contact ({model})"
    found = [Picture(name, words, group.figures[0], lambda: group_figure(group.title, mine))]
    if any((path / "fields").is_dir() for path in folders.values()):
        words = f"{group.title}: plastic strain seen from above, common legend ({model})"
        draw = lambda: strain_figure(group.title, folders, mine)
        found.append(Picture(f"{name}_strain", words, group.figures[1], draw))
    return found
