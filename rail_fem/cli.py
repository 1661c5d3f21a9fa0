"""The command line: the commands of rail_fem/commands, joined here. Every command says what it found and ends
non-zero on a fault.

What a command computes with is imported when it is called, so that help and completion are quick.
"""

from collections.abc import Callable
from typing import Annotated, Any

import typer

from rail_fem.commands import start
from rail_fem.commands.app import app as app_command
from rail_fem.commands.compare import compare
from rail_fem.commands.damage import damage
from rail_fem.commands.design import design
from rail_fem.commands.ending import EXIT_CODES, begin
from rail_fem.commands.export import crossing, export
from rail_fem.commands.measured import low_pass, measured
from rail_fem.commands.profile import profile
from rail_fem.commands.run import check, run
from rail_fem.commands.show import show
from rail_fem.commands.study import study
from rail_fem.commands.sweep import report, sweep
from rail_fem.commands.wheel_on_rail import contact, patch

app = typer.Typer(
    help="What happens when a wheel passes a railway crossing.",
    epilog="\b\nExit codes:\n" + "\n".join(f"  {code:<5}{meaning}" for code, meaning in EXIT_CODES.items()),
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
# in the order in which one needs them, with what the list of commands says in one line
COMMANDS: dict[str, tuple[Callable[..., Any], str]] = {
    "init": (start.init, "Write a commented case file to begin with"),
    "list": (start.names, "Models, wheels, rails, steels, studies"),
    "profile": (profile, "Read, judge, draw, convert a profile file"),
    "check": (check, "What a case means, costs and risks"),
    "run": (run, "Run a case"),
    "app": (app_command, "Sliders in a browser, light models at once"),
    "show": (show, "What a run or a sweep found, or how far it is"),
    "sweep": (sweep, "Run many cases, or one with values varied"),
    "compare": (compare, "Cost against error of several models"),
    "report": (report, "The page of runs or of a sweep, in one file"),
    "export": (export, "Mesh and fields of a run for other programs"),
    "crossing": (crossing, "The crossing of a case as sections or STEP"),
    "contact": (contact, "Contact points of a wheel on a rail"),
    "patch": (patch, "The patch of a wheel under a load"),
    "damage": (damage, "Wear, fatigue and life under many passes"),
    "design": (design, "Search for a better crossing or vehicle"),
    "measured": (measured, "Hold a measured record against a run"),
    "low-pass": (low_pass, "A run's history, low-passed"),
}
for name, (command, line) in COMMANDS.items():
    app.command(name, short_help=line)(command)
own_help = {"allow_extra_args": True, "ignore_unknown_options": True, "help_option_names": []}
app.command("study", short_help="Show a part by itself", context_settings=own_help)(study)
app.command("doctor", short_help="Whether this installation works")(start.doctor)


def _version(wanted: bool) -> None:
    if wanted:
        from rail_fem.result.versions import own_version

        typer.echo(f"rail-fem {own_version()}")
        raise typer.Exit


@app.callback()
def _program(
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="say the answer and faults only")] = False,
    verbose: Annotated[
        bool, typer.Option("-v", "--verbose", help="say more on standard error: versions, digests, tracebacks")
    ] = False,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="say the version and end")
    ] = False,
) -> None:
    """What happens when a wheel passes a railway crossing."""
    begin(quiet, verbose)


def main() -> None:
    app(prog_name="rail-fem")
