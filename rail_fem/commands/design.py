"""`rail-fem design`: search for a better crossing with a light model."""

from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Annotated

import typer

from rail_fem.commands.ending import RUN_FAILED, say, stop


def design(
    file: Annotated[Path, typer.Argument(metavar="DESIGN", help="design file (TOML), e.g. cases/design/leg.toml")],
    out: Annotated[Path, typer.Option("--out", help="folder of the trials, the report and its figure")],
    workers: Annotated[int, typer.Option(help="processes that run trials", min=1, max=1024)] = 2,
) -> None:
    """Vary a case's parameters within bounds and look for what is best over a set of wheels and speeds.

    Seeded; every trial is kept in OUT/trials.csv, and started again the search goes on where it was.
    """
    from rail_fem.case.casefile import CaseError
    from rail_fem.design.problem import DesignError, read_design
    from rail_fem.design.report import write_report
    from rail_fem.design.search import search

    try:
        problem = read_design(file)
        found = search(problem, out, workers, say)
        say("\n" + write_report(problem, found, out))
    except BrokenProcessPool:
        text = "a process of the search was ended from outside (out of memory?): start again, it goes on where it was"
        stop(text, RUN_FAILED)
    except (DesignError, CaseError, OSError) as error:
        stop(str(error))
