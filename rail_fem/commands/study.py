"""`rail-fem study NAME`: commands that show a part by itself, each with a table and most with a figure."""

import importlib
import runpy
import sys
from dataclasses import dataclass
from typing import Annotated

import typer


@dataclass(frozen=True)
class Study:
    """Where a study lives and what it shows. quick : the options that make it a matter of seconds or a few minutes; ()
    where there are none"""

    module: str
    meaning: str
    quick: tuple[str, ...] = ()


STUDIES = {
    "wheelset": Study(
        "rail_fem.studies.wheelset",
        "contact points, rolling radius difference and conicity of a wheelset on plain line; its states on a crossing",
        ("--quick",),
    ),
    "crossing-path": Study(
        "rail_fem.studies.crossing_path",
        "wheels over the cast crossing: contact bands, axle height, transfer, dip angle",
        ("--quick",),
    ),
    "switch": Study("rail_fem.studies.switch", "a wheelset through a switch", ("--quick",)),
    "plane-contact": Study(
        "rail_fem.studies.plane_contact",
        "the plane case studies of the thesis by boundary elements, finite elements beside them",
        ("--quick",),
    ),
    "plane-impact": Study(
        "rail_fem.studies.plane_impact",
        "a wheel strikes a rail section: waves by boundary elements, steps and schemes",
        ("--quick",),
    ),
    "plane-plastic": Study(
        "rail_fem.studies.plane_plastic",
        "a wheel pressed into a yielding rail in the plane: boundary elements, finite elements beside",
        ("--quick",),
    ),
    "plastic-ridge": Study(
        "rail_fem.studies.plastic_ridge",
        "how much more a ridge flows than a half-space under the same force, in plane strain",
        ("--quick",),
    ),
    "pressed-sphere": Study(
        "rail_fem.studies.pressed_sphere",
        "a sphere pressed into a yielding half-space: boundary elements, finite elements, published fits",
        ("--quick",),
    ),
    "rolled-indentation": Study(
        "rail_fem.studies.rolled_indentation",
        "how deep a rolling ellipsoid presses a rail in: half-space, law of the light models, explicit passes",
        ("--quick",),
    ),
    "patch-methods": Study(
        "rail_fem.studies.patch_methods",
        "one patch by every method, static finite elements as reference solution; where the half-space is wrong",
        ("--quick",),
    ),
    "patch-speed": Study(
        "rail_fem.studies.patch_speed",
        "speed against error of all patch solvers on one patch, beside CONTACT; creep curves",
        ("--quick",),
    ),
    "passage-size": Study(
        "rail_fem.studies.passage_size",
        "one pass at several element sizes: values with bars, orders and limits, cost against error",
        ("--quick",),
    ),
    "error-bars": Study(
        "rail_fem.studies.held_out_bars",
        "do the error bars of explicit passes hold? scenes they were not fitted on, against elements of half the size",
        ("--quick",),
    ),
    "ratchetting": Study(
        "rail_fem.studies.ratchetting",
        "shakedown or ratchetting under many passes of a line contact, by four laws of cyclic plasticity",
        ("--quick",),
    ),
    "repeated-passes": Study(
        "rail_fem.studies.repeated_passes",
        "wearing in or ratchetting: finished runs of the same passes with different steels",
    ),
    "damage-pair": Study(
        "rail_fem.studies.damage_pair",
        "two finished damage studies of one crossing side by side: shorter blocks, or flow beside wear",
    ),
    "transient-rolling": Study(
        "rail_fem.studies.transient_rolling",
        "friction work and wear over the wing-nose transfer where patches change as they roll, against steady ones",
        ("--quick",),
    ),
    "benchmark": Study(
        "rail_fem.studies.benchmark",
        "speed of the models: kernels beside dolfinx's own assembly, a step of a pass, ranks, light passes",
        ("--quick",),
    ),
    "verification": Study(
        "rail_fem.studies.verification",
        "the verification page: exact problems with orders, waves, estimates, hard cases, speed against error",
        ("--quick",),
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
    entry = STUDIES[name]
    if quick and not entry.quick:
        typer.echo(
            f"study {name} has no short form: see 'rail-fem study {name} --help' for what can be made smaller", err=True
        )
        raise typer.Exit(2)
    importlib.import_module(entry.module.rpartition(".")[0])
    sys.argv = [f"rail-fem study {name}", *(entry.quick if quick else ()), *context.args]
    runpy.run_module(entry.module, run_name="__main__", alter_sys=True)
