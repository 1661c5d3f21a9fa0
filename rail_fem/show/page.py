"""A page in one file that opens without a network: what runs found, as tables, curves and surfaces that turn.

Its numbers are those of the terminal's report (rail_fem.show.report), its pictures those of the figures. Whatever comes
from a case or a result is text on it: it is escaped, and a browser is told to run this page's two scripts alone.
"""

import base64
import gzip
import hashlib
import html
import json
from collections.abc import Callable, Iterable, Sequence
from importlib.resources import files
from pathlib import Path

from pydantic import ValidationError

from rail_fem.case.template import written
from rail_fem.files.atomic import write_text_atomically
from rail_fem.hierarchy import MODELS
from rail_fem.result.fields import Fields, FieldsError
from rail_fem.result.quantities import FORCES
from rail_fem.result.result import PassResult, load
from rail_fem.result.trust import GOOD
from rail_fem.show.fields import read_crossing
from rail_fem.show.figures import STRAIN, draw_run, titles
from rail_fem.show.metal import Headline, metal_rows
from rail_fem.show.page_charts import Chart, NamedResult, any_history, heights, strain_surface
from rail_fem.show.report import cost_rows, flight_rows, form_table, headlines, state
from rail_fem.show.style import scene_words

PAGE = "page.html"  # in the folder of a run
REPORTS = "report.md", "design.md", "inversion.md", "proof.md", "compare.md"
# figures of such a folder, in the order in which they are shown
FIGURES = {
    "design": "Trials, and the shapes of start and best",
    "design_forces": "Forces at the start and at best",
    "proof": "What the explicit model finds of the start and the best",
    "inversion": "What the facts say of each unknown",
    "compare": "Error of the models over their cost",
    "depth_plan": "Where it is worn, from above",
    "depth_band": "Depth of wear by each law",
    "sections": "Sections before and after",
    "profiles": "Section before and after",
    "passes": "Wear, T\u03b3 and force over the passes",
    "tgamma": "T\u03b3 and fatigue along the crossing",
    "shakedown": "Shakedown map: which contacts ratchet",
    "wheel_wear": "What the wheels lose",
    "patches": "Contact patches",
}
MOST_SURFACES = 6  # that turn: a browser draws some sixteen at most
NEED_PLOTLY = "a page needs plotly: pip install plotly, or ./setup.sh; show and the figures do without"
Part = str | Chart
Rows = Sequence[tuple[str, str, str]]

FRAME = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data: blob:; \
style-src 'unsafe-inline'; {connects}script-src {hashes}">
<meta name="viewport" content="width=device-width">
<title>{title}</title>
<style>
{style}</style>
</head>
<body>
{body}
<p id="undrawn" class="bad" hidden>The curves are not drawn: they need a browser of 2023 or later. The tables stand.</p>
<script type="text/plain" id="charts">{charts}</script>
<script type="text/plain" id="library">{library}</script>
<script>{script}</script>
</body>
</html>
"""


def text(words: str) -> str:
    """Words as a page shows them, whatever they hold."""
    return html.escape(words)


def heading(words: str) -> str:
    return f"<h2>{text(words)}</h2>"


def remark(words: str) -> str:
    return f'<p class="words">{text(words)}</p>'


def table(
    head: Sequence[str], rows: Iterable[Sequence[str]], bad: Callable[[Sequence[str]], bool] | None = None
) -> str:
    """A table of words; line ends within a cell begin smaller print. bad : which rows stand out"""

    def cell(words: str) -> str:
        first, _, more = words.partition("\n")
        return text(first) + (f"<br><small>{text(more)}</small>" if more else "")

    line = lambda cells, kind: "".join(f"<{kind}>{cell(words)}</{kind}>" for words in cells)
    body = "".join(f"<tr{' class=bad' if bad and bad(cells) else ''}>{line(cells, 'td')}</tr>\n" for cells in rows)
    top = f"<thead><tr>{line(head, 'th')}</tr></thead>" if any(head) else ""
    return f'<div class="wide"><table>{top}<tbody>\n{body}</tbody></table></div>'


def listed(words: Sequence[str]) -> str:
    return "<ul>" + "".join(f"<li>{text(one)}</li>" for one in words) + "</ul>"


def image(path: Path, words: str) -> str:
    """A PNG file, within the page."""
    data = base64.b64encode(path.read_bytes()).decode()
    return f'<img alt="{text(words)}" src="data:image/png;base64,{data}">'


def document(title: str, parts: Sequence[Part], more: str = "") -> str:
    """The page. more : a script besides its own, which may ask the server that the page came from

    Errors: ModuleNotFoundError where there is a chart and plotly is not installed, with what to do.
    """
    library = _plotly() if any(isinstance(part, Chart) for part in parts) else ""
    own = {name: files(__package__).joinpath(f"page.{name}").read_text(encoding="utf-8") for name in ("js", "css")}
    body = [_block(part) if isinstance(part, Chart) else part for part in parts]
    charts = json.dumps([part.pictures for part in parts if isinstance(part, Chart)], allow_nan=False)
    return FRAME.format(
        title=text(title),
        hashes=" ".join(f"'sha256-{_digest(script)}'" for script in (own["js"] + more, library)),
        connects="connect-src 'self'; " if more else "",
        style=own["css"],
        body="\n".join([f"<h1>{text(title)}</h1>", *body]),
        charts=_pressed(charts),
        library=_pressed(library),
        script=own["js"] + more,
    )


def _plotly() -> str:
    try:
        from plotly.offline import get_plotlyjs
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(NEED_PLOTLY, name="plotly") from error
    return get_plotlyjs()


def _block(chart: Chart) -> str:
    choices = lambda names: "".join(f'<option value="{text(name)}">{text(name)}</option>' for name in names)
    menus = " ".join(
        f"<label>{text(what)} <select>{choices(names)}</select></label>" for what, names in chart.menus.items()
    )
    nothing = '<p class="none words" hidden>No run resolves this.</p>'
    plot = f'<div class="plot" style="height: {chart.height}px"></div>'
    words = remark(chart.words) if chart.words else ""
    if chart.turns:  # what a browser draws so it does not print: a still picture takes its place
        return f'<div class="chart turns">{words}{menus}{nothing}{plot}<img alt=""></div>'
    return f'<div class="chart">{words}{menus}{nothing}{plot}</div>'


def _digest(script: str) -> str:
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()


def _pressed(words: str) -> str:
    return base64.b64encode(gzip.compress(words.encode(), mtime=0)).decode()


def write_page(folders: Sequence[Path], path: Path, names: Sequence[str] = ()) -> Path:
    """The page of one run, or of several beside each other. names : of the runs; none: their folders'

    Errors: as rail_fem.result.result.load; OSError; ModuleNotFoundError where plotly is not installed.
    """
    folders = [Path(folder) for folder in folders]
    names = names or [folder.resolve().name for folder in folders]
    runs = [NamedResult(name, load(folder)) for name, folder in zip(names, folders)]
    title = runs[0].result.title or runs[0].name if len(runs) == 1 else f"{len(runs)} runs beside each other"
    parts: list[Part] = [*_asked(runs), *numbers(runs)]
    if any(len(run.result.history["x"]) for run in runs):
        parts += [heading("Contact forces and heights"), heights(runs)]
        if (more := any_history(runs)) is not None:
            parts += [heading("Any other quantity over x"), more]
    parts += [*_strain(runs, folders), *_left(runs), *trust(runs), *shares(runs), *_cost(runs), *_again(runs)]
    write_text_atomically(path, document(title, parts))
    return path


def reports(folder: Path) -> list[Path]:
    """The reports in Markdown that a damage study, a design or a comparison has left there."""
    return [path for name in REPORTS if (path := Path(folder) / name).is_file()]


def write_report_page(folder: Path, path: Path) -> Path:
    """The page of such a folder: its reports and all its figures. Errors: OSError."""
    from markdown_it import MarkdownIt  # rich brings it

    words = [report.read_text(encoding="utf-8") for report in reports(folder)]
    title, _, rest = (
        words[0].removeprefix("# ").partition("\n") if words[0].startswith("# ") else (folder.name, "", words[0])
    )
    reader = MarkdownIt("commonmark", {"html": False}).enable("table").disable(["image", "link", "autolink"])
    within = lambda page: page.replace("<table>", '<div class="wide"><table>').replace("</table>", "</table></div>")
    parts: list[Part] = [within(reader.render(one)) for one in (rest, *words[1:])]
    order = lambda figure: ([*FIGURES, figure.stem].index(figure.stem), figure)
    for figure in sorted([*folder.glob("*.png"), *folder.glob("figures/*.png")], key=order):
        seen = FIGURES.get(figure.stem, figure.stem.replace("_", " "))
        parts += [heading(seen), image(figure, seen)]
    write_text_atomically(path, document(title, parts))
    return path


def _asked(runs: Sequence[NamedResult]) -> list[Part]:
    head = ["run", "model", "state", "case", "scene"]
    rows = [
        [run.name, run.result.model, state(run.result), run.result.title or "-", scene_words(run.result.scene)]
        for run in runs
    ]
    return [table(head, rows, bad=lambda cells: cells[2] != "finished")]


def beside(runs: Sequence[NamedResult], rows_of: Callable[[PassResult], Rows], head: Sequence[str]) -> str:
    """Rows of name, value and remark: of one run as they are, of several a column a run. "" where there are none."""
    found = [{name: (value, words) for name, value, words in rows_of(run.result)} for run in runs]
    every = list(dict.fromkeys(name for one in found for name in one))
    if not every:
        return ""
    if len(runs) == 1:
        return table(head, [[name, *found[0][name]] for name in every])
    cell = lambda one, name: "\n".join(filter(None, one[name])) if name in one else "-"
    return table(
        [head[0], *(run.name for run in runs)], [[name, *(cell(one, name) for one in found)] for name in every]
    )


def _words(result: PassResult, name: str) -> str:
    return result.scene.crossing.told(FORCES.get(name, name.replace("_", " ")))


def numbers(runs: Sequence[NamedResult]) -> list[Part]:
    """Headline numbers with both bars, and flights."""
    bar = lambda one: f" \u00b1 {one}" if one else ""

    def beside_rows(result: PassResult) -> Rows:
        form = lambda one: f"\u00b1 {one.form} by form, " if one.form else ""
        return [
            (_words(result, one.name), one.value + bar(one.elements), (form(one) + one.where).removesuffix(", "))
            for one in headlines(result)
        ]

    def row(one: Headline) -> list[str]:
        return [_words(runs[0].result, one.name), one.value, bar(one.elements) or "-", bar(one.form) or "-", one.where]

    if len(runs) == 1:
        head = ["", "value", "bar of elements", "bar of form", "where"]
        numbers = table(head, map(row, headlines(runs[0].result)))
    else:
        numbers = beside(runs, beside_rows, ["", "value", ""])
    told = (
        "Bar of elements: half width of the interval in which the run claims its limit for ever smaller elements, from"
        " a second run on elements of twice the size. Bar of form: what the number may be off by for what the model"
        ' leaves out, the root of the sum of the squares under "form" below. "-": nothing is claimed.'
    )
    away = beside(runs, lambda result: flight_rows(result), ["from x to x", "length", ""])
    return [heading("Numbers"), numbers, remark(told), *([heading("Flights without contact"), away] if away else [])]


def _strain(runs: Sequence[NamedResult], folders: Sequence[Path]) -> list[Part]:
    """Surfaces that turn, plan and section; in words what is wrong with a run's fields."""
    surfaces: dict[int, Fields] = {}
    pictures, faults = {}, []
    for number, (run, folder) in enumerate(zip(runs, folders)):
        if not set(STRAIN) & set(titles(run.result)):
            continue
        try:
            surfaces[number] = read_crossing(folder)
            draw_run(folder, missing_only=True, only=STRAIN)
            pictures[number] = [folder / "figures" / f"{title}.png" for title in STRAIN]
        except (FieldsError, OSError) as error:
            faults.append(f"{run.name}: {error}")
    if not surfaces and not faults:
        return []
    most = max((fields.plastic_strain.max() for fields in surfaces.values()), default=0.0)
    parts: list[Part] = [heading("Plastic strain"), *map(remark, faults)]
    parts += [strain_surface(runs[number], fields, most) for number, fields in [*surfaces.items()][:MOST_SURFACES]]
    parts += [image(path, f"{runs[number].name}: {path.stem}") for number, one in pictures.items() for path in one]
    return parts


def _left(runs: Sequence[NamedResult]) -> list[Part]:
    metal = beside(runs, metal_rows, ["what the pass leaves", "value", ""])
    return [heading("Metal"), metal] if metal else []


def trust(runs: Sequence[NamedResult]) -> list[Part]:
    """Rows of trust, error estimates, warnings and notes of each run."""
    parts: list[Part] = [heading("How far to trust it")]
    for run in runs:
        own = [f"<h3>{text(run.name)}</h3>"] if len(runs) > 1 else []
        rows = [[row["verdict"], row["name"], row["shown"], row["rule"]] for row in run.result.trust.get("rows", ())]
        if rows:
            own.append(table(["verdict", "quantity", "found", "rule"], rows, bad=lambda cells: cells[0] != GOOD))
        claims = [
            f"{name.replace('_', ' ')} {100 * value:.2g} %"
            for name, value in run.result.error_estimate.items()
            if value == value
        ]
        own += [remark(f"Its own error estimate: {', '.join(claims) or 'none claimed'}.")]
        for what, words in (("warning(s)", run.result.warnings), ("note(s)", run.result.notes)):
            own += [remark(f"{len(words)} {what}"), listed(words)] if words else []
        parts += own
    return parts


def shares(runs: Sequence[NamedResult]) -> list[Part]:
    """What each simplification moves the forces by: rows of the bar of form."""
    parts: list[Part] = []
    for run in runs:
        causes, rows = form_table(run.result)
        if rows:
            across = [[cause, *(cells[k] for _, cells in rows)] for k, cause in enumerate([*causes, "together"])]
            parts += [f"<h3>{text(run.name)}</h3>"] if len(runs) > 1 else []
            parts.append(table(["what is left out moves a force by [%]", *(name for name, _ in rows)], across))
    return [heading("Form"), *parts] if parts else []


def _cost(runs: Sequence[NamedResult]) -> list[Part]:
    return [heading("Cost"), beside(runs, lambda result: cost_rows(result.cost), ["", "", ""])]


def _again(runs: Sequence[NamedResult]) -> list[Part]:
    """The case file that repeats each run; keys at their defaults are left out of it."""
    parts: list[Part] = [heading("What was asked, and how to run it again")]
    for run in runs:
        result, file = run.result, f"{run.name.replace('/', '_')}.toml"
        version = ", ".join(
            f"{name} {result.versions[name]}" for name in ("rail-fem", "git") if name in result.versions
        )
        try:
            settings = MODELS[result.model].settings.model_validate(dict(result.settings))
            case = written(result.title or run.name, result.scene, result.model, settings)
        except (KeyError, ValidationError):
            parts.append(remark(f"{run.name}: written by another version of this program ({version})"))
            continue
        asked = f"Save this as {file}, then: rail-fem run {file} --out again (made by {version})"
        parts.append(f"{remark(asked)}<pre>{text(case)}</pre>")
    return parts
