"""Study: why the leg throws the wheel: one thing changed at a time, over the whole crossing, by a light model.

    rail-fem study leg --out leg                   table on the screen, leg.md and leg.png in the folder `leg`
    rail-fem study leg --sections uk_crossing.slcs --out leg     and the public 1:9.25 sections themselves

Each row is a pass of rigid_hertz with one change of the reference case (worn P8, 1:10.75, 75 mph, facing). A wheel of
half a wheelset's mass under the static load that is thrown up at v flies for 2 v m / P0; the launch speed that is shown
is the wheel's own, upwards, as contact is lost. The thesis: 263.6 kN, flight of 28.49 mm and 0.85 ms (0.07 m/s).
"""

from pathlib import Path
from typing import Any

import numpy as np
import typer
from matplotlib.figure import Figure

from rail_fem.case.casefile import load_case
from rail_fem.case.examples import example
from rail_fem.light.rigid import rigid_path
from rail_fem.models import rigid_hertz
from rail_fem.output.events import Flight, leg_flight, stated_peaks
from rail_fem.output.markdown import markdown_table
from rail_fem.output.result import PassResult
from rail_fem.settings.light import RigidHertzSettings
from rail_fem.show.style import GREEN, GREY, NOSE, PURPLE, TOTAL, WING, new_figure
from rail_fem.show.table_and_figure import write_table_and_figure

START, END = "run.rigid_hertz.start", "run.rigid_hertz.end"
WINDOW = {START: "-1500 mm", END: "300 mm"}
THESIS = (263.6, 28.49, 0.85, 0.07)  # kN, mm, ms, m/s: Coleman's thesis, sections 7.4 and 7.5
CROSSING, FOUNDATION = "scene.crossing.", "scene.foundation."
FITTED = {CROSSING + "leg": "fitted"}
SHALFORD = {CROSSING + "ratio": 6.0, "scene.speed": "70 mph"}  # section 7.4, after Hsu's measurement
NEW_WHEEL = {"scene.wheel.profile": "P8"}
VARIATIONS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("reference: worn P8, 1:10.75, 75 mph", {}),
    ("casting not stretched: 1:9.25", {CROSSING + "ratio": 9.25}),
    ("transition of 200 mm (116)", {CROSSING + "transition_length": "200 mm"}),
    ("transition of 350 mm", {CROSSING + "transition_length": "350 mm"}),
    ("transition of 600 mm", {CROSSING + "transition_length": "600 mm"}),
    ("transition straight (cubic)", {CROSSING + "transition_smoothness": 0}),
    ("transition quintic", {CROSSING + "transition_smoothness": 2}),
    ("leg cut 0.5 mm lower", {CROSSING + "leg_lowering": "0.5 mm"}),
    ("leg cut 1 mm lower", {CROSSING + "leg_lowering": "1 mm"}),
    ("wheel: nominal P8", NEW_WHEEL),
    ("wheel: P1", {"scene.wheel.profile": "P1"}),
    ("wheel: hollow P8", {"scene.wheel.profile": "P8-hollow"}),
    ("wheel 3 mm towards the field side", {"scene.gauge": "1429 mm"}),
    ("wheel 3 mm towards the gauge side", {"scene.gauge": "1441 mm"}),
    ("foundation 40 kN/mm (160)", {FOUNDATION + "stiffness": "40 kN/mm"}),
    ("track mass 250 kg (750)", {FOUNDATION + "track_mass": "250 kg"}),
    ("track mass 150 kg", {FOUNDATION + "track_mass": "150 kg"}),
    ("track mass 140 kg", {FOUNDATION + "track_mass": "140 kg"}),
    ("track mass 120 kg", {FOUNDATION + "track_mass": "120 kg"}),
    ("track mass 100 kg", {FOUNDATION + "track_mass": "100 kg"}),
    ("foundation undamped", {FOUNDATION + "damping": "0 kN s/m"}),
    ("elastic: no plastic indentation", {"run.rigid_hertz.plastic_indentation": False}),
    ("50 mph", {"scene.speed": "50 mph"}),
    ("as at Shalford: 1:6, 70 mph (thesis: 22.0 mm, 0.70 ms)", SHALFORD),
    ("as at Shalford, track mass 100 kg", SHALFORD | {FOUNDATION + "track_mass": "100 kg"}),
    ("as at Shalford, track mass 100 kg, nominal P8", SHALFORD | {FOUNDATION + "track_mass": "100 kg"} | NEW_WHEEL),
    ("leg found by search to fly as in the thesis", FITTED),
)


def run(changes: dict[str, Any]) -> PassResult:
    """The reference case, whole crossing, with these changes, by rigid_hertz."""
    case = load_case(example("whole_crossing"), WINDOW | changes)
    return rigid_hertz.solve(case.scene, case.settings(RigidHertzSettings))


def first_flight(result: PassResult) -> Flight | None:
    """The longest flight that begins on the leg; None where the wheel never leaves it."""
    flight = leg_flight(result)
    return flight if flight is not None and flight.length else None


def row(words: str, result: PassResult) -> list[str]:
    """What the leg does to the wheel: climb of the rigid path, force, flight."""
    scene = result.scene
    x = np.arange(scene.crossing.surface.leg_range[0] - 0.1, scene.crossing.leg_end, 2e-3)
    path, peak, flight = rigid_path(scene, x), stated_peaks(result).get("largest_force_leg"), first_flight(result)
    steepest = int(np.argmax(path.slope))
    flown = (
        ["none", "-", "-", "-"]
        if flight is None
        else [
            f"{flight.length * 1e3:.0f}",
            f"{flight.duration * 1e3:.2f}",
            f"{flight.launch_speed:.2f}",
            f"{ballistic_speed(flight, result):.2f}",
        ]
    )
    force = f"{peak.value / 1e3:.0f} at {peak.x * 1e3:.0f}" if peak else "-"
    return [
        words,
        f"{path.slope[steepest] * 1e3:.1f}",
        f"{(path.height[-1] - path.height[0]) * 1e3:+.2f}",
        force,
        *flown,
    ]


def ballistic_speed(flight: Flight, result: PassResult) -> float:
    """Launch speed of a wheel that flies so long under the static load [m/s]."""
    return flight.duration * result.scene.static_wheel_load / (2 * result.scene.vehicle.wheel_unsprung_mass)


def table(rows: list[list[str]]) -> str:
    """Markdown."""
    head = ["what is changed", "climb [mrad]", "lift [mm]", "leg force [kN] at x [mm]"]
    head += ["flight [mm]", "flight [ms]", "launch [m/s]", "v of the flight's time [m/s]"]
    force, length, time, speed = THESIS
    last = ["Coleman's thesis, case 2 (explicit FE, another casting)", "", "", f"{force}"]
    last += [f"{length}", f"{time}", "", f"{speed}"]
    return "\n".join(markdown_table(head, [*rows, last]))


SHOWN = (
    ("reference", 0, TOTAL),
    ("transition of 350 mm", 3, WING),
    ("transition of 600 mm", 4, GREEN),
    ("nominal P8", 9, PURPLE),
    ("fitted to the thesis", len(VARIATIONS) - 1, NOSE),
)


def figure(results: list[PassResult]) -> Figure:
    """Rigid path, force and wheel height over the leg, for some of the rows."""
    drawn = new_figure(11.0)
    above, middle, below = drawn.subplots(3, 1, sharex=True, gridspec_kw={"height_ratios": [1, 1.5, 1]})
    for words, k, colour in SHOWN:
        result = results[k]
        history, x = result.history, np.arange(-1.2, -0.2, 2e-3)
        above.plot(1e3 * x, 1e3 * rigid_path(result.scene, x).height, color=colour, lw=2)
        middle.plot(1e3 * history["x"], history["force"] / 1e3, color=colour, lw=1.8, label=words)
        below.plot(1e3 * history["x"], 1e3 * (history["wheel_height"] - history["wheel_height"][0]), color=colour, lw=2)
    middle.axhline(THESIS[0], color=GREY, ls="--", lw=1.5, label=f"thesis: {THESIS[0]} kN on the leg")
    middle.legend(ncols=3, loc="upper left", bbox_to_anchor=(0, 1.28))
    above.set(ylabel="rigid path [mm]", xlim=(-1100, -250))
    middle.set(ylabel="force on the wheel [kN]")
    below.set(ylabel="wheel height [mm]", xlabel="position x of the wheel [mm]  (it runs to the right \u2192)")
    drawn.suptitle("The leg at 75 mph by rigid_hertz: path of the rigid wheel, force, height of the wheel", fontsize=14)
    return drawn


def main(
    out: Path = typer.Option(None, help="folder for leg.md and leg.png"),
    sections: Path = typer.Option(None, help="a .slcs of the 1:9.25 crossing's own sections, as a further row"),
) -> None:
    """Why the leg throws the wheel, one thing changed at a time."""
    variations = VARIATIONS
    if sections is not None:
        file = {CROSSING + "family": "sections", CROSSING + "file": str(sections.resolve()), CROSSING + "ratio": 10.75}
        variations += (("the benchmark's own 148 sections, 1:9.25", file),)
    results = [run(changes) for _, changes in variations]
    text = table([row(words, result) for (words, _), result in zip(variations, results)])
    print(text)
    if out is not None:
        write_table_and_figure(out / "leg.md", text, out / "leg.png", lambda: figure(results))


if __name__ == "__main__":
    typer.run(main)
