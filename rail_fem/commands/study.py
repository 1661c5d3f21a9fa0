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
    "plain-line": Study(
        "rail_fem.studies.plain_line",
        "contact points, rolling radius difference and conicity of a wheelset on plain line",
    ),
    "crossing-path": Study(
        "rail_fem.studies.crossing_path",
        "five wheels over the cast crossing: contact bands, axle height, transfer, dip angle",
    ),
    "leg": Study("rail_fem.studies.leg", "why the leg throws the wheel: one thing changed at a time, by a light model"),
    "leg-wheels": Study("rail_fem.studies.leg_wheels", "four wheels on the leg, and why a P1 does there what it does"),
    "leg-explicit": Study(
        "rail_fem.studies.leg_explicit", "the leg by the explicit model beside the light one", ("--quick",)
    ),
    "p2": Study("rail_fem.studies.p2_filtered", "the P2 formula beside forces low-passed as the trade quotes them"),
    "joint": Study("rail_fem.studies.joint", "a dipped rail joint by light models, against the P2 formula"),
    "flexible-parts": Study(
        "rail_fem.studies.flexible_parts", "a wheel that vibrates and a casting on bearers, in the reference pass"
    ),
    "whole-crossing": Study(
        "rail_fem.studies.whole_crossing", "the sixteen cases from the leg on, beside the nose transfer begun at rest"
    ),
    "crossing-contact": Study(
        "rail_fem.studies.crossing_contact", "time against error of a loaded wheelset state on a crossing"
    ),
    "light-speed": Study(
        "rail_fem.studies.light_speed",
        "processor time of the light models over a whole crossing, and of a design's passes",
    ),
    "switch": Study("rail_fem.studies.switch", "a wheelset through a switch"),
    "diverging": Study(
        "rail_fem.studies.diverging", "the diverging route at 40 mph, the other wheel on the check rail", ("--quick",)
    ),
    "sites": Study("rail_fem.studies.thesis_sites", "the six measured sites of the thesis"),
    "sections": Study("rail_fem.studies.sections", "the plane case studies of the thesis by boundary elements"),
    "plane-contact": Study("rail_fem.studies.plane_contact", "boundary elements against finite elements in the plane"),
    "plane-waves": Study(
        "rail_fem.studies.plane_waves",
        "waves by boundary elements: stability map, energy over 1,000 steps, a bar over twenty periods",
        ("--cells", "2", "--periods", "2"),
    ),
    "wave-orders": Study(
        "bem.verification.waves",
        "waves by boundary elements against exact solutions: a bar, a cavity, Lamb's line load, with their orders",
        ("--quick",),
    ),
    "plane-impact": Study(
        "rail_fem.studies.plane_impact",
        "a wheel strikes a rail section: waves by boundary elements, steps and schemes, finite elements as judge",
        ("--step", "20", "--step", "5"),
    ),
    "plane-plastic": Study(
        "rail_fem.studies.plane_plastic",
        "a wheel pressed into a yielding rail in the plane: boundary elements, finite elements beside",
        ("--quick",),
    ),
    "plastic-pass": Study(
        "rail_fem.studies.plastic_pass",
        "plastic strain of a pass by bem_plastic on several sizes of cells, beside a finished explicit run",
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
        "rail_fem.studies.patch_methods", "one patch by every method, static finite elements as reference solution"
    ),
    "accelerated-wear": Study(
        "rail_fem.studies.accelerated_wear", "a switch worn by one k = 0.1: a groove on its corner"
    ),
    "wear-patch": Study("rail_fem.studies.wear_patch", "wear of one patch: Hertz against slices and the half-space"),
    "patch-limits": Study("rail_fem.studies.patch_limits", "where the half-space is wrong and the slices are right"),
    "patch-speed": Study("rail_fem.studies.patch_speed", "speed against error of all patch solvers on one patch"),
    "impact": Study("rail_fem.studies.impact", "explicit contact held to Hertz at several element sizes"),
    "passage-size": Study(
        "rail_fem.studies.passage_size",
        "one pass at several element sizes: values with bars, orders and limits, and what mass scaling, window and"
        " element change",
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
    "flow-and-wear": Study(
        "rail_fem.studies.flow_and_wear",
        "plastic flow and wear on one crossing against wear alone: two finished damage studies",
    ),
    "block-error": Study(
        "rail_fem.studies.block_error",
        "how far a crossing's wear depends on the length of its blocks: two finished damage studies",
    ),
    "transient-rolling": Study(
        "rail_fem.studies.transient_rolling",
        "friction work and wear over the wing-nose transfer where patches change as they roll, against steady ones",
        ("--quick",),
    ),
    "damage-numbers": Study(
        "rail_fem.studies.damage_numbers",
        "every number asked of the damage part, measured anew: passes, grids, blocks, laws, friction, shakedown",
        ("--quick",),
    ),
    "kernel-speed": Study("rail_fem.studies.kernel_speed", "element kernels against dolfinx's own assembly"),
    "verification": Study(
        "rail_fem.studies.verification",
        "the verification page: exact problems, estimates, hard cases, speed against error",
        ("--share", "0.05", "--across", "4"),
    ),
    "plane-orders": Study(
        "bem.verification.orders", "plane boundary elements against exact solutions, with their orders"
    ),
    "estimates": Study(
        "bem.verification.estimates_study", "are the error estimates of the contact solvers bounds? 200 seeded cases"
    ),
    "plane-speed": Study("bem.verification.plane_study", "plane boundary elements: convergence, speed, memory"),
    "halfspace": Study(
        "bem.verification.halfspace_study", "half-space solvers: speed against error, creep curves", ("--quick",)
    ),
    "halfspace-speed": Study("bem.verification.halfspace_speed", "half-space solvers in full, beside CONTACT"),
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
