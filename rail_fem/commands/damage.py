"""`rail-fem damage CASE`: wear, fatigue and life of a rail under many passes."""

from pathlib import Path
from typing import Annotated

import typer

from rail_fem.commands.ending import say, stop, stop_run
from rail_fem.commands.options import PoolOption, SetOption, loaded_case


def damage(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="case file (TOML) with a table [damage]")],
    out: Annotated[Path, typer.Option("--out", help="folder for everything the study writes")],
    passes: Annotated[str | None, typer.Option("--passes", help="wheel passes, in place of the case's")] = None,
    settings: SetOption = None,
    restart: Annotated[bool, typer.Option("--restart", help="go on with the study in the folder")] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="remove what is in the folder first")] = False,
    workers: Annotated[int, typer.Option(help="kinds of pass over a crossing at a time", min=1, max=1024)] = 1,
    pool: PoolOption = "processes",
) -> None:
    """Wear, profile change, rolling contact fatigue and years to a limit under many passes: figures, numbers, one
    page. A study that was stopped goes on with --restart."""
    from rail_fem.damage.study import run_study
    from rail_fem.processes.pool import Lost, Workers

    try:
        ended = run_study(loaded_case(case, settings), passes, out, restart, overwrite, say, Workers(workers, pool))
    except (ValueError, OSError, Lost) as error:
        stop(f"{case}: {error}")
    if ended:
        stop_run(f"{case}: {ended}")
