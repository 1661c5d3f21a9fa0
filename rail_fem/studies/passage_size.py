"""Resolution of a pass: one case at several element sizes, the limit that each quantity tends to, and what the choices
that make it less expensive change.

    rail-fem study passage-size --out sizes                       4, 3, 2 mm over the nose: some minutes
    mpirun -n 2 python -m mpi4py -m rail_fem.studies.passage_size --case cases/nose_transfer.toml
        --sizes 4,2,1 --judged 4 --out runs/sizes

Writes table.md, passage_size.png and passage_cost.png (speed against error). Runs lie in folders of their size: what
is there is not run again, what was stopped goes on. Bars are those of `error_twin`, the next coarser run of the series
taken as the twin. The limit is by second order through the last three sizes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import typer

from rail_fem.atomic import write_text_atomically
from rail_fem.case.casefile import load_case
from rail_fem.case.examples import example
from rail_fem.case.variations import read_settings
from rail_fem.launcher import rank
from rail_fem.output.extrapolation import Limit
from rail_fem.output.markdown import markdown_table
from rail_fem.output.quantities import FORCES, REPORTED, reported
from rail_fem.output.result import PassResult
from rail_fem.scene.units import SHOWN
from rail_fem.settings.explicit import FeSettings
from rail_fem.show.metal import CUBIC_MM
from rail_fem.studies.size_cost_figure import draw_cost
from rail_fem.studies.size_figure import draw_sizes
from rail_fem.studies.size_series import MODEL, faults_told, limits, read_sizes, run_at, run_sizes, size_of
from rail_fem.sweeps.compare import core_seconds, history_error

# lengths of a travelling window: short; longer than any crossing, and short of the most a case file may ask for, for
# larger elements have a longer one
WINDOW, WHOLE = "60 mm", "4000 mm"
QUICK_STRETCH = {f"run.{MODEL}.start": "320 mm", f"run.{MODEL}.end": "400 mm"}
NAMES = [name for name in REPORTED if name not in FORCES or name.endswith(("_on_wheel", "_wing", "_nose"))]
DECIMALS = {"kN": 1, "MPa": 0, "mm": 2, "%": 2, "mm3": 0}


def judges(settings: FeSettings) -> dict[str, dict[str, str | int]]:
    """What makes a pass less expensive, or judges it, changed one at a time: name -> changed settings."""
    length, words = (WHOLE, "whole crossing") if settings.has_window else (WINDOW, f"window of {WINDOW}")
    element = "one-point" if settings.element == "full" else "full"
    others = {"small": "all", "all": "small"}[settings.scaled_elements]
    return {
        "no mass scaling": {"mass_scaling": 1},
        f"masses of {others} elements scaled": {"mass_scaling": "auto", "scaled_elements": others},
        words: {"window_ahead": length, "window_behind": length},
        f"element {element}": {"element": element},
    }


def cell(name: str, value: float, bar: float = math.nan) -> str:
    """A quantity with its bar, where there is one, in engineers' units: "194.3 +- 5.8 kN"."""
    unit = REPORTED[name].unit
    words, factor = ("mm3", CUBIC_MM) if unit == "m^3" else SHOWN[unit]
    digits = DECIMALS[words]
    return f"{value * factor:.{digits}f}{'' if math.isnan(bar) else f' +- {bar * factor:.{digits}f}'} {words}"


def own_cell(name: str, result: PassResult) -> str:
    """The same of a result."""
    return cell(name, REPORTED[name].of(result), result.error_bars.get(name, math.nan))


def size_words(size: float) -> str:
    """2e-3 -> "2 mm"."""
    return f"{size * 1e3:g} mm"


def convergence_table(results: Sequence[PassResult]) -> list[str]:
    """Markdown: a row for each quantity, its value with its bar at each size, the order, the limit, and the error of
    each size against it."""
    found = limits(results)
    head = ["quantity", *(size_words(size_of(r)) for r in results), "order", "limit", "off the limit by"]
    rows = [
        [
            REPORTED[name].meaning,
            *(own_cell(name, r) for r in results),
            "-" if math.isnan(found[name].order) else f"{found[name].order:.1f}",
            cell(name, found[name].value, found[name].doubt),
            ", ".join(off(name, REPORTED[name].of(r), found[name]) for r in results),
        ]
        for name in NAMES
        if name in found
    ]
    return markdown_table(head, rows)


def off(name: str, value: float, limit: Limit) -> str:
    """How far a value is from the limit: in mm for the transfer, else relative."""
    if REPORTED[name].unit == "m":
        return f"{(value - limit.value) * 1e3:+.2f} mm"
    return f"{value / limit.value - 1:+.1%}" if limit.value else "-"


def cost_table(results: Sequence[PassResult]) -> list[str]:
    """Markdown: a row for each size: what it cost, its force history against the finest, hourglass energy."""
    head = ["elements of", "elements", "steps", "core seconds", "force history, L2 to the finest", "hourglass energy"]
    rows = [
        [
            size_words(size_of(r)),
            str(r.cost.elements),
            str(r.cost.steps),
            f"{core_seconds(r):.0f}",
            "-" if r is results[-1] else f"{history_error(r, results[-1]):.2%}",
            hourglass(r),
        ]
        for r in results
    ]
    return markdown_table(head, rows)


def hourglass(result: PassResult) -> str:
    """Hourglass energy of all bodies over the internal energy."""
    values = [row["value"] for row in result.trust.get("rows", ()) if row["name"].startswith("hourglass energy, all")]
    return f"{values[0]:.1%}" if values else "-"


def judges_table(base: PassResult, judged: dict[str, PassResult]) -> list[str]:
    """Markdown: what each change does to the quantities of one size, and what it costs."""
    values = {name: reported(result) for name, result in judged.items()}
    rows = [
        [
            REPORTED[name].meaning,
            own_cell(name, base),
            *(off(name, own[name], Limit(REPORTED[name].of(base), 0.0, 0.0)) for own in values.values()),
        ]
        for name in NAMES
        if REPORTED[name].of(base) > 0 and all(name in own for own in values.values())
    ]
    rows.append(["force history, L2", "-", *(f"{history_error(r, base):.2%}" for r in judged.values())])
    rows.append(["hourglass energy", hourglass(base), *(hourglass(r) for r in judged.values())])
    rows.append(["steps", str(base.cost.steps), *(str(r.cost.steps) for r in judged.values())])
    rows.append(["core seconds", *(f"{core_seconds(r):.0f}" for r in (base, *judged.values()))])
    return markdown_table(["quantity", f"elements of {size_words(size_of(base))}", *judged], rows)


def page(results: Sequence[PassResult], base: PassResult | None, judged: dict[str, PassResult]) -> str:
    """The Markdown of the study."""
    lines = [*convergence_table(results), "", *cost_table(results), ""]
    if base is not None:
        lines += [*judges_table(base, judged), ""]
    return "\n".join(lines)


def main(
    case: Path = typer.Option(None, help="case file; none: nose_transfer"),
    out: Path = typer.Option(Path("passage_size"), help="folder of the runs, of table.md and of the figures"),
    sizes: str = typer.Option("4,3,2", help="element sizes [mm]"),
    setting: list[str] = typer.Option(
        [], "--set", help="KEY=VALUE in place of the case file's, e.g. scene.speed=60mph"
    ),
    judged: float = typer.Option(
        None, help="element size [mm] at which mass scaling, window and element are changed one at a time"
    ),
    quick: bool = typer.Option(False, help="80 mm over the nose alone"),
):
    """One pass at several element sizes: table of values with bars, orders and limits, and a figure."""
    with faults_told():
        path, changes = case or example("nose_transfer"), {**(QUICK_STRETCH if quick else {}), **read_settings(setting)}
        quiet = lambda line: None
        results = run_sizes(path, changes, read_sizes(sizes), out, quiet)
        base, others = None, {}
        if judged is not None:
            base = next((r for r in results if abs(size_of(r) - judged * 1e-3) < 1e-9), None)
            if base is None:
                base = run_at(path, changes, judged * 1e-3, out / f"{judged:g}mm", quiet)
            for name, settings in judges(load_case(path, changes).settings(FeSettings)).items():
                changed = changes | {f"run.{MODEL}.{key}": value for key, value in settings.items()}
                others[name] = run_at(
                    path, changed, judged * 1e-3, out / f"{judged:g}mm-{name.replace(' ', '_')}", quiet
                )
    if rank() == 0:
        text = page(results, base, others)
        write_text_atomically(out / "table.md", text)
        draw_sizes(results, others, out / "passage_size.png")
        draw_cost(results, others, out / "passage_cost.png")
        typer.echo(text)
        typer.echo(f"written: {out}/table.md, passage_size.png, passage_cost.png")


if __name__ == "__main__":
    typer.run(main)
