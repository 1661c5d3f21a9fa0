"""The verification page, computed anew.

    rail-fem study verification --out verification [--runs DIR] [--tests]       verification.md in the folder
    rail-fem study verification --only orders                                   one section alone

Exact problems of the boundary elements with their errors and observed orders, waves among them,
estimates with the share of seeded cases that they cover,
explicit contact against Hertz, speed against error of every model over the runs in DIR, and the tests of hard cases
with what happened to each. What is not asked for, or cannot be run here, is said on the page.
"""

import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Annotated
from xml.etree import ElementTree

import typer

from bem.verification import estimates_study, orders, waves
from rail_fem.files.markdown import markdown_table
from rail_fem.hierarchy import MODELS, smoke_requested
from rail_fem.show.table_and_figure import publish
from rail_fem.studies.harness import OUT, QUICK

SEED = 100  # of the cases of the estimates
ROOT = Path(__file__).resolve().parents[2]
HARD_CASES = (
    "tests/fe/test_hard_elements.py",
    "tests/fe/test_hard_contact.py",
    "tests/fe/test_stable_step.py",
    "tests/bem/test_contact_hard.py",
    "tests/rail_fem/test_hard_profiles.py",
    "tests/rail_fem/test_hostile_cases.py",
)


def exact_problems(coarse: bool) -> str:
    """Every exact problem of the boundary elements: error at each size, observed order."""
    rows = [row for study in orders.STUDIES for row in orders.lines_of(study, coarse)]
    said = "The two coarsest sizes only: orders have no meaning.\n\n" if coarse else ""
    return said + "\n".join(markdown_table(orders.HEAD, rows)) + "\n"


def estimates(share: float) -> str:
    """Error estimates of the contact solvers on seeded cases that did not serve to choose their constants."""
    head = ["estimate of", "cases", "error within it", "median of estimate over error", "median error"]
    lines = []
    for part, (cases, _) in estimates_study.PARTS.items():
        rows = estimates_study.rows_of(part, SEED, max(1, round(share * cases)))
        for quantity, (count, covered, ratio, error) in estimates_study.summary(rows).items():
            lines.append([quantity, f"{count}", f"{covered:.0%}", f"{ratio:.1f}", f"{error:.1e}"])
    return "\n".join(markdown_table(head, lines)) + "\n"


def indentation(across: tuple[int, ...]) -> str:
    """Explicit contact at rest against Hertz, or why it was not run."""
    try:
        from rail_fem.studies.impact import indent, table
    except ImportError as error:
        return f"Not run: {error}.\n"
    return table([indent(count) for count in across])


def speed_against_error(runs: Path | None) -> str:
    """The comparison of the runs of one scene, with strain, and how the models without a run are run; or what is
    missing."""
    if runs is None:
        return "Not asked for: `--runs DIR` names a folder of runs of one scene by several models.\n"
    from rail_fem.sweeps.compare import compare
    from rail_fem.sweeps.compare_report import comparison_text

    found = compare([runs])
    absent = [model for model in MODELS if all(result.model != model for result in found.results)]
    command = f"rail-fem sweep CASE {' '.join(f'--model {model}' for model in absent)} --out {runs.parent}"
    more = [f"No run by {', '.join(absent)}: `{command}` makes it.\n"] if absent else []
    return "\n".join([comparison_text(found), *more])


def hard_cases(files: tuple[str, ...]) -> str:
    """The tests of hard cases, one row each: what is asked in words, and what happened."""
    if not (ROOT / "tests").is_dir():
        return "Not run: the tests do not come along with an installation.\n"
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.xml"
        command = [sys.executable, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", f"--junitxml={report}"]
        subprocess.run([*command, *files], cwd=ROOT, capture_output=True, check=False)
        cases = list(ElementTree.parse(report).iter("testcase"))
    rows = []
    for case in cases:
        words = (case.get("name") or "").removeprefix("test_").replace("_", " ")
        rows.append([words, f"`{(case.get('classname') or '').rpartition('.')[2]}`", outcome(case)])
    failed = sum(said.startswith("**failed**") for *_, said in rows)
    lines = markdown_table(["what is asked", "in", "what happened"], rows)
    return "\n".join(lines) + f"\n\n{len(cases)} cases, {failed} failed.\n"


def outcome(case: ElementTree.Element) -> str:
    """held, failed (with the first line of why), or not run."""
    for kind, word in (("failure", "**failed**"), ("error", "**failed**"), ("skipped", "not run")):
        found = case.find(kind)
        if found is not None:
            reason = (found.get("message") or "").partition("\n")[0]
            return f"{word}: {reason}"
    return "held"


def page(sections: dict[str, Callable[[], str]]) -> str:
    """The Markdown page: a heading, told as its minutes begin, and what its function says, in turn."""
    parts = []
    for name, said in sections.items():
        typer.echo(f"{name} ...", err=True)
        parts.append(f"## {name}\n\n{said()}")
    return "# Verification, from the runs\n\n" + "\n".join(parts)


def main(
    runs: Annotated[Path | None, typer.Option(help="folder of runs of one scene, for speed against error")] = None,
    tests: Annotated[bool, typer.Option("--tests", help="run the tests of hard cases")] = False,
    only: Annotated[str, typer.Option(help="orders, waves, estimates, contact, models or hard: that section")] = "",
    share: Annotated[float, typer.Option(help="of the seeded cases of the estimates", min=0.0, max=1.0)] = 1.0,
    quick: QUICK = False,
    out: OUT = None,
) -> None:
    """The verification page: every number on it is computed now."""
    sections: dict[str, tuple[str, Callable[[], str]]] = {
        "orders": ("Exact problems, with observed order", lambda: exact_problems(quick or smoke_requested())),
        "waves": (
            "Waves against exact solutions",
            lambda: "\n".join(markdown_table(waves.WAVE_HEAD, waves.wave_rows(2 if quick else 4))) + "\n",
        ),
        "estimates": (
            "Estimates, and how often the error lies within them",
            lambda: estimates(0.05 if quick else share),
        ),
        "contact": ("Explicit contact at rest against Hertz", lambda: indentation((2, 4) if quick else (2, 4, 8, 16))),
        "models": ("Speed against error of the models", lambda: speed_against_error(runs)),
        "hard": ("Hard cases", lambda: hard_cases(HARD_CASES) if tests else "Not asked for: `--tests` runs them.\n"),
    }
    if only and only not in sections:
        raise typer.BadParameter(f"--only {only}: no such section; there are {', '.join(sections)}")
    text = page(dict(sections[name] for name in ([only] if only else sections)))
    publish("verification", out, [], note=text.rstrip("\n"))
