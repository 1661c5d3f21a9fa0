"""Resolution of a pass: one case at several element sizes, and the limit that each quantity tends to. What the choices
that make it less expensive change is a list for sweep, cases/rows/passage_choices.toml.

    rail-fem study passage-size --out sizes                       4, 3, 2 mm over the nose: some minutes
    mpirun -n 2 python -m mpi4py -m rail_fem study passage-size --case cases/nose_transfer.toml --sizes 4,2,1

Writes table.md and passage_size.png (values, and speed against error). Runs lie in folders of their size: what is there
is not run again, what was stopped goes on. Bars are those of `error_twin`, the next coarser run of the series
taken as the twin. The limit is by second order through the last three sizes.
"""

import math
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from rail_fem.case.examples import example
from rail_fem.case.variations import read_settings
from rail_fem.files.atomic import write_text_atomically
from rail_fem.files.markdown import table_of
from rail_fem.processes.launcher import rank
from rail_fem.result.extrapolation import Limit
from rail_fem.result.quantities import FORCES, REPORTED
from rail_fem.result.result import PassResult
from rail_fem.scene.units import SHOWN
from rail_fem.show.panels import Panel, panels_figure
from rail_fem.show.style import scene_words
from rail_fem.show.table_and_figure import write_figure
from rail_fem.studies.harness import QUICK
from rail_fem.studies.size_series import MODEL, limits, read_sizes, run_sizes, size_of
from rail_fem.sweeps.compare import core_seconds, history_error

OWN = Path("passage_size")
QUICK_STRETCH = {f"run.{MODEL}.start": "320 mm", f"run.{MODEL}.end": "400 mm"}
NAMES = [name for name in REPORTED if name not in FORCES or name.endswith(("_on_wheel", "_wing", "_nose"))]
SHOWN_NAMES = "impact_on_wheel", "largest_force_wing", "block_nose", "integral_nose", "block_wing", "integral_wing"
DECIMALS = {"kN": 1, "MPa": 0, "mm": 2, "%": 2, "mm3": 0}


def cell(name: str, value: float, bar: float = math.nan) -> str:
    """A quantity with its bar, where there is one, in engineers' units: "194.3 +- 5.8 kN"."""
    words, factor = SHOWN[REPORTED[name].unit]
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
    found, rows = limits(results), []
    for name in (name for name in NAMES if name in found):
        limit = found[name]
        rows.append(
            {
                "quantity": REPORTED[name].meaning,
                **{size_words(size_of(r)): own_cell(name, r) for r in results},
                "order": "-" if math.isnan(limit.order) else f"{limit.order:.1f}",
                "limit": cell(name, limit.value, limit.doubt),
                "off the limit by": ", ".join(off(name, REPORTED[name].of(r), limit) for r in results),
            }
        )
    return table_of(rows)


def off(name: str, value: float, limit: Limit) -> str:
    """How far a value is from the limit: in mm for the transfer, else relative."""
    if REPORTED[name].unit == "m":
        return f"{(value - limit.value) * 1e3:+.2f} mm"
    return f"{value / limit.value - 1:+.1%}" if limit.value else "-"


def cost_table(results: Sequence[PassResult]) -> list[str]:
    """Markdown: a row for each size: what it cost, its force history against the finest, hourglass energy."""
    rows = [
        {
            "elements of": size_words(size_of(r)),
            "elements": str(r.cost.elements),
            "steps": str(r.cost.steps),
            "core seconds": f"{core_seconds(r):.0f}",
            "force history, L2 to the finest": "-" if r is results[-1] else f"{history_error(r, results[-1]):.2%}",
            "hourglass energy": hourglass(r),
        }
        for r in results
    ]
    return table_of(rows)


def hourglass(result: PassResult) -> str:
    """Hourglass energy of all bodies over the internal energy."""
    values = [row["value"] for row in result.trust.get("rows", ()) if row["name"].startswith("hourglass energy, all")]
    return f"{values[0]:.1%}" if values else "-"


def page(results: Sequence[PassResult]) -> str:
    """The Markdown of the study."""
    return "\n".join([*convergence_table(results), "", *cost_table(results), ""])


def panels(results: Sequence[PassResult]) -> list[Panel]:
    """How far each run is from the limit of vanishing elements, over its elements and over what it cost; then values
    with their bars, and the limits."""
    found, sizes = limits(results), [1e3 * size_of(r) for r in results]
    shown = [name for name in SHOWN_NAMES if name in found and found[name].value]
    error = lambda name: [100 * abs(REPORTED[name].of(r) / found[name].value - 1) for r in results]
    drawn = []
    costs = "core seconds of the pass", [core_seconds(r) for r in results]
    for words, x, hidden in (("element size [mm]", sizes, "_"), (*costs, "")):  # one legend for both
        lines = {f"{hidden}{REPORTED[name].meaning}": (x, error(name), "o-") for name in shown}
        drawn.append(Panel(words, "error against the limit [%]", lines, log="xy"))
    for name in shown:
        unit, factor = SHOWN[REPORTED[name].unit]
        values = np.array([[REPORTED[name].of(r), r.error_bars.get(name, 0.0)] for r in results]).T * factor
        limit = (sizes, [factor * found[name].value] * len(sizes), "--")
        own = {"run, bar by its coarse twin": (sizes, values, "bars"), "limit by second order": limit}
        title = textwrap.fill(REPORTED[name].meaning, 55)
        drawn.append(Panel("element size [mm]", f"[{unit}]", own, title, log="x"))
    return drawn


def main(
    case: Annotated[Path | None, typer.Option(help="case file; none: nose_transfer")] = None,
    sizes: Annotated[str, typer.Option(help="element sizes [mm]")] = "4,3,2",
    setting: Annotated[
        list[str] | None, typer.Option("--set", help="KEY=VALUE in place of the case file's, e.g. scene.speed=60mph")
    ] = None,
    quick: QUICK = False,
    out: Annotated[Path, typer.Option(help="folder of the runs, of table.md and of the figure")] = OWN,
) -> None:
    """One pass at several element sizes: table of values with bars, orders and limits, and a figure."""
    changes = {**(QUICK_STRETCH if quick else {}), **read_settings(setting or [])}
    results = run_sizes(case or example("nose_transfer"), changes, read_sizes(sizes), out, lambda line: None)
    if rank() == 0:
        text = page(results)
        write_text_atomically(out / "table.md", text)
        write_figure(out / "passage_size.png", lambda: panels_figure(panels(results), scene_words(results[0].scene)))
        typer.echo(f"{text}written: {out}/table.md, passage_size.png")
