"""Do the error bars of explicit passes hold? Scenes that the bars were not fitted on, each against elements of half the
size.

    rail-fem study error-bars --out bars          1.5 mm with its twin of 3 mm, held against 0.75 mm, over the nose
    rail-fem study error-bars --sizes 4,2,1 --out bars

The light models' bars beside a finer explicit answer (rail_fem.run.form) are judged by the same finer runs.

A bar holds where the finer run's value lies within it. Asked for: 95 % of the quantities, and bars of at most four
times the true difference in the median (a bar that is never wrong may say nothing). Runs that are there are not run
again; bars are computed anew each time, so that a new rule can be judged without any run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import typer

from rail_fem.case.examples import example
from rail_fem.files.atomic import write_text_atomically
from rail_fem.files.markdown import markdown_table
from rail_fem.hierarchy import MODELS, solve
from rail_fem.processes.launcher import rank
from rail_fem.result.error_bars import calibrated_bars, error_bars
from rail_fem.result.quantities import FORCES, REPORTED, reported
from rail_fem.result.result import PassResult
from rail_fem.studies.size_series import MODEL, faults_told, read_sizes, run_at

LIGHT = "rigid_hertz", "bem_passage"
WITHOUT = "fe_full without twins"
NOSE = "290 mm", "430 mm"  # a worn P8 passes to the nose within this stretch
SCENES: dict[str, tuple[dict[str, Any], tuple[str, ...]]] = {
    "100 mph": ({"scene.speed": "100 mph"}, NOSE),
    "nose four times as strong": ({"scene.materials.nose": {"grade": "Mn13", "strength": "400 %"}}, NOSE),
    "1:9.25, 92 t, 50 mph": (
        {"scene.crossing.ratio": 9.25, "scene.vehicle.vehicle_sprung_mass": "92 t", "scene.speed": "50 mph"},
        ("170 mm", "370 mm"),
    ),
    "trailing, 90 mph, friction 0.45": (
        {"scene.direction": "trailing", "scene.speed": "90 mph", "scene.friction": 0.45},
        ("440 mm", "230 mm"),
    ),
    "wheel of 500 mm, harder wing, 40 mph": (
        {
            "scene.wheel.radius": "500 mm",
            "scene.materials.wing": {"grade": "Mn13", "strength": "130 %"},
            "scene.speed": "40 mph",
        },
        ("230 mm", "420 mm"),
    ),
    "1:13.5, wheel of 460 mm, 100 mph, friction 0.4": (
        {"scene.crossing.ratio": 13.5, "scene.wheel.radius": "460 mm", "scene.speed": "100 mph", "scene.friction": 0.4},
        ("300 mm", "520 mm"),
    ),
    "rail on bearers of which one hangs, 60 mph": (
        {
            "scene.bearers": {
                "position": "60 mm",
                "pad_stiffness": "120 kN/mm",
                "pad_damping": "20 kN s/m",
                "mass": "120 kg",
                "ballast_stiffness": "60 kN/mm",
                "ballast_damping": "50 kN s/m",
                "voided": [1],
            },
            "scene.speed": "60 mph",
        },
        NOSE,
    ),
    "new P8, 1.4 t, 60 mph, friction 0.1": (  # not to be meshed with elements of 4 mm
        {
            "scene.wheel.profile": "P8",
            "scene.vehicle.wheelset_unsprung_mass": "1.4 t",
            "scene.speed": "60 mph",
            "scene.friction": 0.1,
        },
        ("200 mm", "400 mm"),
    ),
}


@dataclass(frozen=True)
class Held:
    """One quantity of one scene: its name, the bar and the true difference to the finer run [SI]."""

    name: str
    bar: float
    error: float

    @property
    def holds(self) -> bool:
        return self.error <= self.bar


def held(result: PassResult, twin: PassResult | None, finer: PassResult) -> list[Held]:
    """Each quantity that has a bar, without a twin a calibrated one, and that the finer run resolves."""
    there, own = reported(finer), reported(result)
    bars = calibrated_bars(result) if twin is None else error_bars(result, twin)
    return [
        Held(name, bar, abs(own[name] - there[name]))
        for name, bar in bars.items()
        if name in there and not _told_twice(name, own)
    ]


def _told_twice(name: str, values: dict[str, float]) -> bool:
    """The largest force anywhere is that of a body, and that of a body or the wheel may be the first impact on it."""
    others = {
        "largest_force": ("largest_force_wing", "largest_force_nose", "impact_on_wheel"),
        "largest_force_wing": ("first_impact_on_wing",),
        "largest_force_nose": ("first_impact_on_nose",),
        "impact_on_wheel": ("first_impact_on_wing", "first_impact_on_nose"),
    }
    return any(values.get(other) == values[name] for other in others.get(name, ()))


def median_ratio(found: Sequence[Held]) -> float:
    """Bar over true difference in the median."""
    return float(np.median([one.bar / max(one.error, 1e-300) for one in found])) if found else float("nan")


def row(words: str, found: Sequence[Held]) -> list[str]:
    """Of the table: how many, how many hold, the median of bar over difference, those that do not hold."""
    missed = [f"{REPORTED[one.name].meaning} ({one.error / one.bar:.1f} bars off)" for one in found if not one.holds]
    count = sum(one.holds for one in found)
    return [
        words,
        str(len(found)),
        f"{count} ({count / max(len(found), 1):.0%})",
        f"{median_ratio(found):.1f}",
        "; ".join(missed) or "-",
    ]


def table(found: dict[str, list[Held]]) -> str:
    """Markdown: a row for each scene, and one for all."""
    rows = [row(words, own) for words, own in found.items()]
    rows.append(row("all", [one for own in found.values() for one in own]))
    head = ["scene", "quantities", "within the bar", "bar over true difference, median", "not within"]
    return "\n".join(markdown_table(head, rows)) + "\n"


def held_light(model: str, finer: PassResult) -> list[Held]:
    """Each force of a light model on the finer run's scene and path, with the bar that holds fe_full's."""
    window = {name: finer.settings[name] for name in ("start", "end")}
    own = reported(solve(model, finer.scene, MODELS[model].settings(**window)))
    there, off = reported(finer), (MODELS[model].off or (0.0, 0.0))[1]
    return [
        Held(name, off * own[name], abs(own[name] - there[name]))
        for name in FORCES
        if name in own and name in there and not _told_twice(name, own)
    ]


def held_on(words: str, sizes: Sequence[float], out: Path) -> dict[str, list[Held]]:
    """One of SCENES, run at the sizes of twin, run and finer run [m]: by model, the light ones beside the finer run.
    Collective. Errors: as `run_at`."""
    changes, (start, end) = SCENES[words]
    keys = {f"run.{MODEL}.start": start, f"run.{MODEL}.end": end, f"run.{MODEL}.element": "one-point"}
    folder = out / "".join(c for c in words.replace(" ", "_") if c not in ",:")
    twin, result, finer = (
        run_at(example("nose_transfer"), changes | keys, size, folder / f"{size * 1e3:g}mm", lambda line: None)
        for size in sizes
    )
    light = {model: held_light(model, finer) for model in LIGHT} if rank() == 0 else {}
    return {MODEL: held(result, twin, finer), WITHOUT: held(result, None, finer)} | light


def main(
    out: Path = typer.Option(Path("error_bars"), help="folder of the runs and of table.md"),
    sizes: str = typer.Option("3,1.5,0.75", help="element sizes of twin, run and finer run [mm]"),
    scene: list[str] = typer.Option([], help=f"only this one of: {'; '.join(SCENES)}; may be given several times"),
    quick: bool = typer.Option(False, help="the first scene alone, 4, 3, 2 mm"),
):
    """How many of the error bars of explicit passes hold the answer of elements of half the size."""
    wanted = scene or list(SCENES)[: 1 if quick else None]
    if unknown := sorted(set(wanted) - set(SCENES)):
        raise typer.BadParameter(f"{', '.join(unknown)}: no such scene; there are {'; '.join(SCENES)}")
    chosen = read_sizes("4,3,2" if quick else sizes)
    if len(chosen) != 3:
        raise typer.BadParameter(f"--sizes {sizes}: three are needed: of the twin, of the run, of the finer run")
    with faults_told():
        found = {words: held_on(words, chosen, out) for words in wanted}
    if rank() == 0:
        by_model = {model: {words: own[model] for words, own in found.items()} for model in (MODEL, WITHOUT, *LIGHT)}
        text = "\n".join(f"{model}\n\n{table(own)}" for model, own in by_model.items())
        write_text_atomically(out / "table.md", text)
        typer.echo(text)
