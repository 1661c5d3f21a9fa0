"""How a command speaks and ends: on rank 0 alone, with the exit codes that `rail-fem --help` names."""

from typing import NoReturn

import typer

from rail_fem import launcher

DONE, RUN_FAILED, REFUSED = 0, 1, 2


def say(text: str) -> None:
    """Print on rank 0."""
    if launcher.rank() == 0:
        typer.echo(text)


def stop(text: str, code: int = REFUSED) -> NoReturn:
    """End with a fault that all ranks have met: the text on rank 0's standard error, the same exit code on every
    rank."""
    if launcher.rank() == 0:
        typer.echo(text, err=True)
    launcher.end_together()
    raise typer.Exit(code)


def stop_run(text: str) -> NoReturn:
    """End after a fault in the run, with this rank's words: when all ranks meet it the root ends the job before the
    others speak."""
    typer.echo(text if launcher.rank() == 0 else f"rank {launcher.rank()}: {text}", err=True)
    raise typer.Exit(RUN_FAILED)
