"""Study: the sixteen cases of the thesis over the whole crossing, leg and all, beside the nose transfer begun at rest.

    rail-fem study whole-crossing --out whole      table on the screen and in whole.md, whole_crossing.png

Each case by rigid_hertz, from plain line to behind the nose (trailing: the other way), with the benchmark's leg and
with the leg that was fitted to the thesis' launch; beside them the same case as cases/thesis has it, begun at rest
on the wing.
"""

from pathlib import Path

import numpy as np
import typer
from matplotlib.figure import Figure

from rail_fem.case.casefile import load_case
from rail_fem.case.examples import example
from rail_fem.models import rigid_hertz
from rail_fem.output.events import longest_flight, stated_peaks
from rail_fem.output.markdown import markdown_table
from rail_fem.output.result import PassResult
from rail_fem.settings.light import RigidHertzSettings
from rail_fem.show.style import GREY, NOSE, TOTAL, WING, new_figure
from rail_fem.show.table_and_figure import write_table_and_figure

LOW, HIGH = "-1500 mm", "700 mm"
PEAKS = ("largest_force_leg", "largest_force_wing", "impact_on_wheel", "largest_force_nose")
VARIANTS = (("benchmark's leg", "benchmark", NOSE), ("fitted leg", "fitted", TOTAL), ("at rest on the wing", "", GREY))


def case_files() -> list[Path]:
    """The thesis' cases, in the order of their numbers. Errors: KeyError where the installation lacks them."""
    found = sorted((example("whole_crossing").parent / "thesis").glob("case_*.toml"))
    if not found:
        raise KeyError("no cases/thesis/case_*.toml beside the example cases: is the installation whole?")
    return found


def run(file: Path, leg: str) -> PassResult:
    """One case by rigid_hertz over the whole crossing with this leg; "": as the file has it."""
    changes = {}
    if leg:
        facing = load_case(file).scene.direction == "facing"
        start, end = (LOW, HIGH) if facing else (HIGH, LOW)
        changes = {"run.rigid_hertz.start": start, "run.rigid_hertz.end": end, "scene.crossing.leg": leg}
    case = load_case(file, changes)
    return rigid_hertz.solve(case.scene, case.settings(RigidHertzSettings))


def cells(result: PassResult) -> list[str]:
    """Forces on leg, wing and nose [kN] at x [mm], longest flight."""
    peaks, flight = stated_peaks(result), longest_flight(result)
    force = lambda name: f"{peaks[name].value / 1e3:.0f} at {1e3 * peaks[name].x:.0f}" if name in peaks else "-"
    return [*(force(name) for name in PEAKS), f"{1e3 * flight.length:.0f} mm, {1e3 * flight.duration:.2f} ms"]


def table(results: dict[str, list[PassResult]]) -> str:
    """Markdown, a row a case and variant."""
    head = ["case", "variant", "leg [kN]", "wing [kN]", "impact on the wheel [kN]", "nose [kN]", "longest flight"]
    rows = [
        [name, words, *cells(result)] for name, own in results.items() for (words, _, _), result in zip(VARIANTS, own)
    ]
    return "\n".join(markdown_table(head, rows))


def largest(result: PassResult, name: str) -> float:
    """A peak in kN, NaN where there is none."""
    peaks = stated_peaks(result)
    return peaks[name].value / 1e3 if name in peaks else np.nan


def figure(results: dict[str, list[PassResult]]) -> Figure:
    """Force over x of case 2 by the three variants; below, the largest forces of all cases."""
    drawn = new_figure(11.0)
    above, below = drawn.subplots(2, 1)
    for (words, _, colour), result in zip(VARIANTS, results["case_02"]):
        above.plot(1e3 * result.history["x"], result.history["force"] / 1e3, color=colour, lw=1.6, label=words)
    above.set(xlabel="position x of the wheel [mm]", ylabel="force on the wheel [kN]")
    above.set_title("case 2: worn P8, 75 mph, facing")
    above.legend()
    at = np.arange(len(results))
    for k, (name, marker, colour) in enumerate(
        (("largest_force_leg", "s", NOSE), ("largest_force_wing", "o", WING), ("largest_force_nose", "D", TOTAL))
    ):
        for variant, filled in ((0, "none"), (1, colour)):
            values = [largest(own[variant], name) for own in results.values()]
            below.plot(
                at + 0.15 * (k - 1),
                values,
                marker,
                mfc=filled,
                mec=colour,
                mew=1.6,
                ls="none",
                label=f"{name.rsplit('_', 1)[-1]}, {VARIANTS[variant][0]}",
            )
    below.set_xticks(at, [name.removeprefix("case_") for name in results])
    below.set(xlabel="case of the thesis", ylabel="largest force [kN]", title="all cases over the whole crossing")
    below.legend(ncols=3, fontsize=9)
    drawn.suptitle("The sixteen cases from the leg on, by rigid_hertz", fontsize=14)
    return drawn


def main(out: Path = typer.Option(None, help="folder for whole.md and whole_crossing.png")) -> None:
    """The sixteen cases over the whole crossing by a light model."""
    results = {file.stem: [run(file, leg) for _, leg, _ in VARIANTS] for file in case_files()}
    text = table(results)
    print(text)
    if out is not None:
        write_table_and_figure(out / "whole.md", text, out / "whole_crossing.png", lambda: figure(results))


if __name__ == "__main__":
    typer.run(main)
