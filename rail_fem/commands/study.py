"""`rail-fem study NAME`: commands that show a part by itself, each with a table and most with a figure."""

import importlib
import sys
from typing import Annotated, NamedTuple

import typer


class Study(NamedTuple):
    """What the module of a name in rail_fem.studies shows. quick : whether it has a short form, of seconds or a few
    minutes"""

    meaning: str
    quick: bool = True


STUDIES = {
    "wheelset": Study(
        "contact points, rolling radius difference and conicity of a wheelset on plain line; its states on a crossing"
    ),
    "crossing-path": Study("wheels over the cast crossing: contact bands, axle height, transfer, dip angle"),
    "switch": Study("a wheelset through a switch"),
    "plane-contact": Study("the plane case studies of the thesis by boundary elements, finite elements beside them"),
    "plane-impact": Study("a wheel strikes a rail section: waves by boundary elements, steps and schemes"),
    "plane-plastic": Study(
        "a wheel pressed into a yielding rail in the plane: boundary elements, finite elements beside"
    ),
    "plastic-ridge": Study("how much more a ridge flows than a half-space under the same force, in plane strain"),
    "pressed-sphere": Study(
        "a sphere pressed into a yielding half-space: boundary elements, finite elements, published fits"
    ),
    "rolled-indentation": Study(
        "how deep a rolling ellipsoid presses a rail in: half-space, law of the light models, explicit passes"
    ),
    "patch-methods": Study(
        "one patch by every method, static finite elements as reference solution; where the half-space is wrong"
    ),
    "patch-speed": Study("speed against error of all patch solvers on one patch, beside CONTACT"),
    "passage-size": Study("one pass at several element sizes: values with bars, orders and limits, cost against error"),
    "error-bars": Study(
        "do the error bars of explicit passes hold? scenes they were not fitted on, against elements of half the size"
    ),
    "ratchetting": Study(
        "shakedown or ratchetting under many passes of a line contact, by four laws of cyclic plasticity"
    ),
    "repeated-passes": Study(
        "wearing in or ratchetting: finished runs of the same passes with different steels", False
    ),
    "damage-pair": Study(
        "two finished damage studies of one crossing side by side: shorter blocks, or flow beside wear", False
    ),
    "transient-rolling": Study(
        "friction work and wear over the wing-nose transfer where patches change as they roll, against steady ones"
    ),
    "benchmark": Study(
        "speed of the models: kernels beside dolfinx's own assembly, a step of a pass, ranks, light passes"
    ),
    "verification": Study(
        "the verification page: exact problems with orders, waves, estimates, hard cases, speed against error"
    ),
}


def study(
    context: typer.Context,
    name: Annotated[str, typer.Argument(help="one of those that 'rail-fem list' names")] = "",
    quick: Annotated[bool, typer.Option("--quick", help="a look in short time, where the study has one")] = False,
) -> None:
    """Run a study; further options go to it ('rail-fem study NAME --help' lists them)."""
    there = "\n".join(f"  {key:18s} {entry.meaning}" for key, entry in STUDIES.items())
    if name in ("", "--help"):
        typer.echo(
            f"Usage: rail-fem study NAME [OPTIONS]   (rail-fem study NAME --help lists them)\n\nStudies:\n{there}"
        )
        raise typer.Exit(0 if name else 2)
    if name not in STUDIES:
        typer.echo(f"no study '{name}'; there are:\n{there}", err=True)
        raise typer.Exit(2)
    if quick and not STUDIES[name].quick:
        typer.echo(
            f"study {name} has no short form: see 'rail-fem study {name} --help' for what can be made smaller", err=True
        )
        raise typer.Exit(2)
    sys.argv = [f"rail-fem study {name}", *(["--quick"] if quick else []), *context.args]
    typer.run(importlib.import_module(f"rail_fem.studies.{name.replace('-', '_')}").main)
