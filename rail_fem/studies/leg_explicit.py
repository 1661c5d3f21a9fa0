"""Study: what the light model says of the leg, by the explicit model: force, flight and plastic strain.

    rail-fem study leg-explicit --out leg_explicit          elements of 4 mm: a minute or two for each row
    rail-fem study leg-explicit --size 2 --out leg_explicit

The reference case (worn P8, 1:10.75, 75 mph, facing) from the plain rail over the leg to behind the landing, with the
benchmark's leg, with two longer transitions and with the one that was fitted to the thesis by the light model; and
with a P1 on the benchmark's leg. rigid_hertz, the same with two contacts on the leg (leg_contacts) and fe_full run over
the same stretch, from rest. The explicit model computes the steel near the wheel only (a travelling window of
60 mm), masses scaled ("auto"). Runs lie in folders of their name: what is there is not run again.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import typer
from matplotlib.figure import Figure

from rail_fem.case.casefile import load_case
from rail_fem.case.examples import example
from rail_fem.models import rigid_hertz
from rail_fem.output.events import Flight, longest_flight, stated_peaks
from rail_fem.output.markdown import markdown_table
from rail_fem.output.result import PassResult
from rail_fem.settings.light import RigidHertzSettings
from rail_fem.show.style import GREY, LINE_OF_MODEL, ORANGE, new_figure
from rail_fem.show.table_and_figure import write_table_and_figure
from rail_fem.studies.leg import CROSSING, FITTED, THESIS
from rail_fem.studies.leg_contacts import LegPass, two_contact_pass
from rail_fem.studies.size_series import MODEL, faults_told, run_at
from rail_fem.sweeps.compare import core_seconds, history_error

BEFORE = 0.06  # plain rail before the leg [m]
BEHIND = {"benchmark-P1": 0.12}  # path behind it, else WHOLE: no mesh follows a P1 to the knuckle at 4 mm [m]
WHOLE = 0.25
CUBES = {f"run.{MODEL}.element_aspect": 1, f"run.{MODEL}.wheel_element_ratio": 1}
WINDOW = CUBES | {f"run.{MODEL}.window_ahead": "60 mm", f"run.{MODEL}.window_behind": "60 mm"}
P1 = {"scene.wheel.profile": "P1"}
LENGTH = CROSSING + "transition_length"
ROWS: dict[str, tuple[str, dict[str, Any]]] = {
    "benchmark": ("benchmark's leg, worn P8", {}),
    "200mm": ("transition of 200 mm, worn P8", {LENGTH: "200 mm"}),
    "300mm": ("transition of 300 mm, worn P8", {LENGTH: "300 mm"}),
    "fitted": ("fitted leg, worn P8", FITTED),
    "fitted-explicit": ("leg fitted by fe_full, worn P8", {CROSSING + "leg": "fitted-explicit"}),
    "benchmark-P1": ("benchmark's leg, P1", P1),
}


@dataclass(frozen=True)
class OneLeg:
    """One pass by the models. two : the light one with two contacts on the leg"""

    words: str
    light: PassResult
    two: LegPass
    explicit: PassResult


def changes_of(name: str) -> dict[str, Any]:
    """Changes of the case for a row, with the stretch that is run over."""
    own = ROWS[name][1]
    surface = load_case(example("whole_crossing"), own).scene.crossing.surface
    start, end = surface.leg_range[0] - BEFORE, surface.leg_range[1] + BEHIND.get(name, WHOLE)
    window = {key: f"{1e3 * x:.0f} mm" for key, x in (("start", start), ("end", end))}
    models = "rigid_hertz", MODEL
    return own | WINDOW | {f"run.{model}.{key}": value for model in models for key, value in window.items()}


def run(name: str, size: float, out: Path) -> OneLeg:
    """A row by both models; size : of the elements [m]. Collective. Errors: as of `run_at`."""
    changes = changes_of(name)
    case = load_case(example("whole_crossing"), changes)
    settings = case.settings(RigidHertzSettings)
    light = rigid_hertz.solve(case.scene, settings)
    explicit = run_at(
        example("whole_crossing"),
        {key: value for key, value in changes.items() if "rigid_hertz" not in key},
        size,
        out / f"{name}-{1e3 * size:g}mm",
        lambda line: None,
    )
    return OneLeg(ROWS[name][0], light, two_contact_pass(case.scene, settings), explicit)


def cells(words: str, result: PassResult) -> list[str]:
    """Force on the leg, flight, strain, cost of one result."""
    peak, flight = stated_peaks(result)["largest_force_leg"], longest_flight(result)
    strain = result.metal.get("leg")
    peeq = ["-", "-"]
    if strain is not None:
        maximum = f"{100 * strain['maximum']:.1f} at {1e3 * strain['position'][0]:.0f}"
        peeq = [f"{100 * strain['values']['block']:.1f} at {1e3 * strain['block'][0]:.0f}", maximum]
    return [
        words,
        result.model,
        f"{peak.value / 1e3:.0f} at {1e3 * peak.x:.0f}",
        f"{result.peaks['largest_force'].value / 1e3:.0f} at {1e3 * result.peaks['largest_force'].x:.0f}",
        *flown(flight),
        *peeq,
        f"{core_seconds(result):.0f}",
    ]


def two_cells(words: str, leg_end: float, found: LegPass) -> list[str]:
    """The same of the light model with two contacts."""
    on_leg = np.where(found.x < leg_end, found.force, 0.0)
    peak = lambda force: f"{force.max() / 1e3:.0f} at {1e3 * found.x[np.argmax(force)]:.0f}"
    flight = found.flight
    own = ["none", "-"]
    if flight is not None:
        own = [f"{1e3 * abs(flight.x_end - flight.x_start):.0f}", f"{1e3 * (flight.end - flight.start):.2f}"]
    return [words, "rigid_hertz, two contacts", peak(on_leg), peak(found.force), *own, "-", "-", "-", "-"]


def flown(flight: Flight) -> list[str]:
    """Length, time and launch speed of a flight."""
    if not flight.length:
        return ["none", "-", "-"]
    return [f"{1e3 * flight.length:.0f}", f"{1e3 * flight.duration:.2f}", f"{flight.launch_speed:.2f}"]


def table(legs: list[OneLeg]) -> str:
    """Markdown: a row a pass and model; then how far the force histories are apart."""
    head = ["leg, wheel", "model", "force on the leg [kN] at x [mm]", "largest force [kN] at x [mm]", "flight [mm]"]
    head += ["flight [ms]", "launch [m/s]", "PEEQ, worst 5 x 5 x 3 mm [%] at x [mm]", "largest element [%] at x [mm]"]
    head += ["core seconds"]
    rows = []
    for one in legs:
        rows += [cells(one.words, one.light), two_cells(one.words, one.light.scene.crossing.leg_end, one.two)]
        rows.append(cells(one.words, one.explicit))
    force, length, time, _ = THESIS
    rows.append(["thesis, case 2", "explicit FE", f"{force}", "", f"{length}", f"{time}", "", "", "22.95", ""])
    apart = [f"{one.words}: {history_error(one.light, one.explicit):.0%}" for one in legs]
    return "\n".join([*markdown_table(head, rows), "", f"Force histories apart (L2): {', '.join(apart)}."])


def figure(legs: list[OneLeg]) -> Figure:
    """Force over x by both models, a panel a row."""
    drawn = new_figure(3.4 * len(legs) + 0.8)
    for axes, one in zip(drawn.subplots(len(legs), 1, squeeze=False)[:, 0], legs):
        for result in (one.light, one.explicit):
            colour = LINE_OF_MODEL[result.model][0]
            x, force = 1e3 * result.history["x"], result.history["force"] / 1e3
            axes.plot(x, force, color=colour, lw=1.8, label=result.model)
        axes.plot(1e3 * one.two.x, one.two.force / 1e3, color=ORANGE, lw=1.4, label="rigid_hertz, two contacts")
        low, high = (1e3 * x for x in one.light.scene.crossing.surface.leg_range)
        axes.axvspan(low, high, color="#EEEEEE", zorder=-1, label="leg: plain rail to cast section")
        if "P1" not in one.words:
            axes.axhline(THESIS[0], color=GREY, ls="--", lw=1.5, label=f"thesis: {THESIS[0]} kN on the leg")
        axes.set(ylabel="force on the wheel [kN]", title=one.words, xlim=(-1140, -390))
        axes.legend(loc="upper left")
    axes.set_xlabel("position x of the wheel [mm]  (it runs to the right \u2192)")
    size = 1e3 * legs[0].explicit.settings["element_size"]
    drawn.suptitle(f"The leg at 75 mph, 1:10.75: light model and explicit model (elements of {size:g} mm)", fontsize=14)
    return drawn


def main(
    out: Path = typer.Option(Path("leg_explicit"), help="folder of the runs, of leg_explicit.md and .png"),
    size: float = typer.Option(4.0, help="element size [mm]", min=0.5, max=10),
    rows: str = typer.Option(",".join(ROWS), help="which of them"),
    quick: bool = typer.Option(False, help="elements of 6 mm, the benchmark's leg alone"),
) -> None:
    """The leg by the explicit model beside the light one."""
    names = ["benchmark"] if quick else rows.split(",")
    unknown = [name for name in names if name not in ROWS]
    if unknown:
        raise typer.BadParameter(f"--rows: {unknown[0]} is not known, there are {', '.join(ROWS)}")
    with faults_told():
        legs = [run(name, 1e-3 * (6.0 if quick else size), out) for name in names]
    text = table(legs)
    typer.echo(text)
    write_table_and_figure(out / "leg_explicit.md", text, out / "leg_explicit.png", lambda: figure(legs))


if __name__ == "__main__":
    typer.run(main)
