"""`rail-fem show`: what a run or a sweep found, its figures, and a quantity against what varies."""

import json
import time
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from rail_fem.commands.ending import MANNER, emit, refusing, say, tell
from rail_fem.commands.options import JsonOption, not_a_runs

LOOK = 2.0  # between two looks at a sweep [s]


class Figures(StrEnum):
    """Which figures `show` draws."""

    missing = "missing"
    anew = "anew"
    none = "none"


def show(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="folder of a run or a sweep, or one that holds runs")],
    figures: Annotated[
        Figures, typer.Option(help="draw those that are missing, all anew, or none (nothing is written then)")
    ] = Figures.missing,
    quantity: Annotated[
        str | None, typer.Option(help="of a sweep: draw this, e.g. 'impact on the wheel', against --against")
    ] = None,
    against: Annotated[str | None, typer.Option(help="of a sweep: what varies, e.g. scene.speed or speed")] = None,
    model: Annotated[list[str] | None, typer.Option("--model", help="of a sweep: only this model")] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            callback=not_a_runs, help="of a sweep: PNG for the figure; default: DIR/figures/QUANTITY_against_KEY.png"
        ),
    ] = None,
    follow: Annotated[bool, typer.Option("--follow", help="of a sweep: its table as it fills, to the end")] = False,
    as_json: JsonOption = False,
) -> None:
    """Say what a run or a sweep found, or how far it is; draw figures that are missing, or a quantity against what
    varies."""
    from rail_fem.show.report import folder_report

    with refusing():
        if follow:
            follow_sweep(folder)
        elif quantity or against:
            show_against(folder, quantity, against, model or [], out)
        elif (folder / "damage.json").is_file():
            say((folder / "report.md").read_text(encoding="utf-8"))
            if as_json:
                emit(json.loads((folder / "damage.json").read_text(encoding="utf-8")))
        elif is_sweep(folder):
            tell_sweep(folder)
        else:
            if figures != Figures.none and (folder / "result.json").is_file():
                _draw_figures(folder, figures)
            say(folder_report(folder))
            if as_json:
                emit(folder_facts(folder))


def _draw_figures(folder: Path, figures: Figures) -> None:
    """Draw; where nothing can be written say so and go on."""
    from rail_fem.show.figures import draw_run

    try:
        draw_run(folder, missing_only=figures == Figures.missing)
    except OSError as error:
        tell(f"no figures drawn: {error}")


def folder_facts(folder: Path) -> dict:
    """The result of a run, or how far it is, or the folders of runs below. Errors: as rail_fem.show.report."""
    from rail_fem.processes.progress import read_status
    from rail_fem.result.result import load

    if (folder / "result.json").is_file():
        figures = sorted((folder / "figures").glob("*.png"))
        return {"folder": folder, **load(folder).summary(), "figures": figures}
    if (folder / "status.json").is_file():
        return {"folder": folder, **read_status(folder)}
    below = {path.parent for name in ("result.json", "status.json") for path in folder.glob(f"*/{name}")}
    return {"folder": folder, "runs": sorted(below)}


def is_sweep(folder: Path) -> bool:
    """Whether results lie two folders below: DIR/CASE/MODEL."""
    own = any((folder / name).is_file() for name in ("result.json", "status.json"))
    return not own and not any(folder.glob("*/result.json")) and any(folder.glob("*/*/result.json"))


def follow_sweep(folder: Path) -> None:
    """Its table, anew every LOOK seconds until every task has ended; into a file the last one alone. Errors: ValueError
    where no sweep has begun."""
    from rich.console import Console
    from rich.live import Live
    from rich.text import Text

    from rail_fem.sweeps.array import read_tasks, table_so_far

    if not read_tasks(folder):
        raise ValueError(f"{folder}: holds no list of tasks: no sweep was begun there")
    known: dict[str, str] = {}
    with Live(console=Console(), auto_refresh=False) as live:
        while True:
            lines, left = table_so_far(folder, known)
            live.update(Text("\n".join(lines), no_wrap=True), refresh=True)
            if not left:
                return
            time.sleep(LOOK)


def tell_sweep(folder: Path) -> None:
    """Its table. Errors: ValueError, OSError as reading them."""
    from rail_fem.sweeps.results import load_sweep

    found = load_sweep(folder)
    runs = sum(len(found[case]) for case in found)
    varied = ", ".join(found.varied) or "nothing"
    say("\n".join([f"{folder}: {len(found)} cases, {runs} runs; varies: {varied}", "", found.to_markdown().rstrip()]))
    for sentence in found.unusable:
        say(f"left out: {sentence}")
    if MANNER.as_json:
        emit({"folder": folder, "varied": found.varied, "rows": found.rows(), "left_out": found.unusable})


def show_against(folder: Path, quantity: str | None, against: str | None, models: list[str], out: Path | None) -> None:
    """Draw a quantity against what varies. Errors: ValueError where one of the two is missing or unknown, OSError."""
    from rail_fem.show.table_and_figure import write_figure
    from rail_fem.sweeps.parameter_figure import parameter_figure
    from rail_fem.sweeps.results import load_sweep

    if not quantity or not against:
        raise ValueError("give both --quantity and --against")
    name = f"{quantity}_against_{against}.png".replace(" ", "_").replace("/", "_")
    found, path = load_sweep(folder), out or folder / "figures" / name
    say(str(write_figure(path, lambda: parameter_figure(found, quantity, against, tuple(models)))))
    emit({"figure": path})
