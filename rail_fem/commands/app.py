"""`rail-fem app`: sliders in a browser on this machine, and what the light models say to them at once."""

from pathlib import Path
from typing import Annotated

import typer

from rail_fem.commands.ending import emit, refusing, say
from rail_fem.commands.options import JsonOption


def app(
    case: Annotated[Path | None, typer.Argument(metavar="CASE", help="case file; default: nose_transfer")] = None,
    out: Annotated[Path, typer.Option("--out", help="folder for runs that are started there")] = Path("runs/app"),
    port: Annotated[int, typer.Option(help="of this machine; 0: a free one", min=0, max=65535)] = 0,
    ranks: Annotated[int, typer.Option(help="of parallel models that are started there", min=1)] = 2,
    as_json: JsonOption = False,
) -> None:
    """Wheel, crossing, speed and load on sliders in a browser: forces and contact points by the light models at once,
    the case file that repeats them, a run by fe_full. For this machine alone: open the address that it says; Ctrl-C
    ends it."""
    from rail_fem.app.server import App, Server
    from rail_fem.case.examples import example

    with refusing(KeyError, ValueError, OSError, ModuleNotFoundError):
        server = Server(App(case or example("nose_transfer"), out, ranks), port)
    say(f"open {server.address}\nCtrl-C ends it, and what it runs with it")
    emit({"address": server.address})
    try:
        server.serve_forever()
    finally:
        server.app.close()
