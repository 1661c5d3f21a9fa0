"""Do the error bars of explicit passes hold? Scenes that the bars were not fitted on, each against elements of half the
size.

    rail-fem study error-bars --out bars          1.5 mm with its twin of 3 mm, held against 0.75 mm, over the nose
    rail-fem study error-bars --sizes 4,2,1 --out bars

The light models' bars beside a finer explicit answer (rail_fem.run.form) are judged by the same finer runs.

A bar holds where the finer run's value lies within it. Asked for: 95 % of the quantities, and bars of at most four
times the true difference in the median (a bar that is never wrong may say nothing). Runs that are there are not run
again; bars are computed anew each time, so that a new rule can be judged without any run.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import typer

from rail_fem.case.examples import example
from rail_fem.hierarchy import MODELS, solve
from rail_fem.processes.launcher import rank
from rail_fem.result.error_bars import calibrated_bars, error_bars
from rail_fem.result.quantities import FORCES, REPORTED, reported
from rail_fem.result.result import PassResult
from rail_fem.show.table_and_figure import Table, publish
from rail_fem.studies.size_series import MODEL, read_sizes, run_at
from rail_fem.sweeps.rows import read_rows

LIGHT = "rigid_hertz", "bem_passage"
WITHOUT = "fe_full without twins"
SCENES = "rows/error_bars"  # of the examples


@dataclass(frozen=True)
class Held:
    """One quantity of one scene: its name, the bar and the true difference to the finer run [SI]."""

    name: str
    bar: float
    error: float

    @property
    def holds(self) -> bool:
        return self.error <= self.bar


def held(result: PassResult, bars: Mapping[str, float], finer: PassResult) -> list[Held]:
    """Each quantity that has a bar and that the finer run resolves."""
    there, own = reported(finer), reported(result)
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


def table(model: str, found: dict[str, list[Held]]) -> Table:
    """A row for each scene, and one for all."""
    rows = [row(words, own) for words, own in found.items()]
    rows.append(row("all", [one for own in found.values() for one in own]))
    return Table(
        ["scene", "quantities", "within the bar", "bar over true difference, median", "not within"], rows, model
    )


def held_light(model: str, finer: PassResult) -> list[Held]:
    """Each force of a light model on the finer run's scene and path, with the bar that holds fe_full's."""
    window = {name: finer.settings[name] for name in ("start", "end")}
    result = solve(model, finer.scene, MODELS[model].settings(**window))
    own, off = reported(result), (MODELS[model].off or (0.0, 0.0))[1]
    return held(result, {name: off * own[name] for name in FORCES if name in own}, finer)


def held_on(words: str, sizes: Sequence[float], out: Path) -> dict[str, list[Held]]:
    """One of SCENES, run at the sizes of twin, run and finer run [m]: by model, the light ones beside the finer run.
    Collective. Errors: as `run_at`."""
    scenes, file = read_rows(example(SCENES)), example("nose_transfer")
    changes = scenes.change | scenes.rows[words]
    folder = out / "".join(c for c in words.replace(" ", "_") if c not in ",:")
    twin, result, finer = (
        run_at(file, changes, size, folder / f"{size * 1e3:g}mm", lambda line: None) for size in sizes
    )
    light = {model: held_light(model, finer) for model in LIGHT} if rank() == 0 else {}
    own, calibrated = held(result, error_bars(result, twin), finer), held(result, calibrated_bars(result), finer)
    return {MODEL: own, WITHOUT: calibrated} | light


def main(
    out: Path = typer.Option(Path("error_bars"), help="folder of the runs and of table.md"),
    sizes: str = typer.Option("3,1.5,0.75", help="element sizes of twin, run and finer run [mm]"),
    scene: list[str] = typer.Option([], help=f"only this row of cases/{SCENES}.toml; may be given several times"),
    quick: bool = typer.Option(False, help="the first scene alone, 4, 3, 2 mm"),
):
    """How many of the error bars of explicit passes hold the answer of elements of half the size."""
    known = list(read_rows(example(SCENES)).rows)
    wanted = scene or known[: 1 if quick else None]
    if unknown := sorted(set(wanted) - set(known)):
        raise typer.BadParameter(f"{', '.join(unknown)}: no such scene; there are {'; '.join(known)}")
    chosen = read_sizes("4,3,2" if quick else sizes)
    if len(chosen) != 3:
        raise typer.BadParameter(f"--sizes {sizes}: three are needed: of the twin, of the run, of the finer run")
    found = {words: held_on(words, chosen, out) for words in wanted}
    if rank() == 0:
        models = MODEL, WITHOUT, *LIGHT
        publish("table", out, [table(model, {words: own[model] for words, own in found.items()}) for model in models])
