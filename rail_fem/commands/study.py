"""`rail-fem study NAME`: commands that show a part by itself, each with a table and most with a figure."""

import importlib
import sys
from typing import Annotated

import typer

from rail_fem.commands.ending import refusing

STUDIES = {
    "wheelset": "contact points, rolling radii and conicity of a wheelset on plain line; its states on a crossing",
    "crossing-path": "wheels over the cast crossing: contact bands, axle height, transfer, dip angle",
    "switch": "a wheelset through a switch",
    "plane-contact": "the plane case studies of the thesis by boundary elements, finite elements beside them",
    "plane-impact": "a wheel strikes a rail section: waves by boundary elements, steps and schemes",
    "plane-plastic": "a wheel pressed into a yielding rail in the plane: boundary elements, finite elements beside",
    "plastic-ridge": "how much more a ridge flows than a half-space under the same force, in plane strain",
    "pressed-sphere": "a sphere pressed into a yielding half-space: boundary elements, finite elements, published fits",
    "rolled-indentation": "how deep a rolling ellipsoid presses a rail in: half-space, light law, explicit passes",
    "patch-methods": "one patch by every method, beside static finite elements; where the half-space is wrong",
    "patch-speed": "speed against error of all patch solvers on one patch, beside CONTACT",
    "passage-size": "one pass at several element sizes: values with bars, orders and limits, cost against error",
    "error-bars": "do the error bars of explicit passes hold? other scenes, against elements of half the size",
    "ratchetting": "shakedown or ratchetting under many passes of a line contact, by four laws of cyclic plasticity",
    "transient-rolling": "friction work and wear over the transfer: patches that change as they roll, or steady",
    "benchmark": "speed of the explicit model: kernels beside dolfinx's own assembly, a step of a pass, ranks, a card",
    "verification": "the verification page: exact problems, orders, waves, estimates, hard cases, speed against error",
}


def study(
    context: typer.Context,
    name: Annotated[str, typer.Argument(help="one of those that 'rail-fem list' names")] = "",
    quick: Annotated[bool, typer.Option("--quick", help="a look in short time")] = False,
) -> None:
    """Run a study; further options go to it ('rail-fem study NAME --help' lists them)."""
    there = "\n".join(f"  {key:18s} {meaning}" for key, meaning in STUDIES.items())
    if name in ("", "--help"):
        typer.echo(
            f"Usage: rail-fem study NAME [OPTIONS]   (rail-fem study NAME --help lists them)\n\nStudies:\n{there}"
        )
        raise typer.Exit(0 if name else 2)
    if name not in STUDIES:
        typer.echo(f"no study '{name}'; there are:\n{there}", err=True)
        raise typer.Exit(2)
    sys.argv = [f"rail-fem study {name}", *(["--quick"] if quick else []), *context.args]
    from rail_fem.run.job import JobError

    with refusing(ValueError, OSError, JobError):
        program = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
        program.command()(importlib.import_module(f"rail_fem.studies.{name.replace('-', '_')}").main)
        program()
