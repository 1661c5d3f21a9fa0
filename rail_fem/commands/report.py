"""`rail-fem report`: the page of a sweep."""

from pathlib import Path
from typing import Annotated

import typer

from rail_fem.commands.ending import say, stop
from rail_fem.commands.options import SetOption


def report(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="folder of a sweep: DIR/CASE/MODEL")],
    groups: Annotated[
        Path, typer.Option(help="TOML file of groups of cases and trends, e.g. cases/thesis/trends.toml")
    ],
    out: Annotated[
        Path | None, typer.Option("--out", help="folder for report.md and its figures; default: DIR/report")
    ] = None,
    digest: Annotated[
        Path | None,
        typer.Option(help="instead: this one Markdown file, with the figures named by --show beside it, small"),
    ] = None,
    beside: Annotated[
        Path | None, typer.Option(help="folder of another sweep of the same cases, for a table of both")
    ] = None,
    settings: SetOption = None,
    show: Annotated[
        list[str] | None,
        typer.Option("--show", help="figure of the digest, by its name in the report; may be given several times"),
    ] = None,
) -> None:
    """The page of a sweep: tables, trends in words checked on every model with reasons and controls, figures of each
    group. --set : what the sweep was given."""
    from rail_fem.case.variations import read_settings
    from rail_fem.sweeps.sweep_page import read_sweep, write_digest, write_page

    try:
        found = read_sweep(folder, groups, beside, read_settings(settings or ()))
        if digest is None:
            say(str(write_page(found, out or folder / "report")))
        else:
            say(str(write_digest(found, digest, tuple(show or ()))))
    except (ValueError, OSError) as error:
        stop(error)
