"""Study: a dipped rail joint, the P2 formula's own scene, by the light models.

    rail-fem study joint --out joint              table on the screen and in joint.md, figure joint.png

The formula's wheel comes down one straight slope, strikes the track mass at the bend and moves on with it up the other,
without damping, on one stiff contact; what it calls P2 is then the largest force of the track on its spring. Taken
away one after the other: the stiff contact, the missing damping, the long slopes. The standard's factor 1.2 is left out
everywhere but in the line that shows P2 itself; the unsprung mass is that of one wheel.
"""

from pathlib import Path

import numpy as np
import typer

from rail_fem.atomic import write_text_atomically
from rail_fem.light.p2 import p2_force, p2_increment
from rail_fem.models import lumped, rigid_hertz
from rail_fem.output.low_pass import filtered_peak, low_passed
from rail_fem.output.markdown import markdown_table
from rail_fem.output.result import PassResult
from rail_fem.scene.scene import Foundation, Scene, Vehicle, Wheel
from rail_fem.settings.light import LumpedSettings, RigidHertzSettings
from rail_fem.show.style import CURVES, GREY, lettering, new_figure, save, scene_words

ANGLES = np.array([0.0, 0.5, 1.0, 2.0, 4.0, 7.0, 10.0, 15.0]) * 1e-3  # of the dip [rad]
DRAWN = 10e-3  # whose histories are drawn [rad]
WINDOW = -0.4, 1.0  # [m]
STIFF = 5e13  # Hertz constant of a contact that hardly gives way [N/m^1.5]
HEAD = ("", *(f"{1e3 * angle:g} mrad" for angle in ANGLES))


def joint_scene(angle: float, damping: bool = True, length: float = 1.2, shape: str = "straight") -> Scene:
    """Case 2's vehicle and track on plain rail with a joint. angle [rad];  length : of the dip on each side [m]"""
    dampers = (55.4e3, 10e3) if damping else (0.0, 0.0)
    return Scene(
        crossing={"family": "joint", "dip_angle": angle, "dip_length": length, "dip_shape": shape},
        wheel=Wheel(profile="P8"),
        vehicle=Vehicle(vehicle_sprung_mass=66250.0, wheelset_unsprung_mass=1000.0, primary_damping=dampers[1]),
        foundation=Foundation(stiffness=1.6e8, damping=dampers[0], track_mass=750.0),
        speed="75 mph",
        direction="facing",
    )


def formula(scene: Scene) -> float:
    """Increment of the P2 formula for a joint [N]."""
    foundation, vehicle = scene.foundation, scene.vehicle
    return p2_increment(
        scene.crossing.dip_angle, scene.speed, vehicle.wheel_unsprung_mass, foundation.track_mass, foundation.stiffness
    )


def as_the_formula(angle: float) -> PassResult:
    """Stiff contact, no damping, long slopes: what the formula assumes."""
    settings = LumpedSettings(start=WINDOW[0], end=WINDOW[1], contact="linear", contact_stiffness=STIFF, time_step=2e-6)
    return lumped.solve(joint_scene(angle, damping=False), settings)


def hertz(angle: float, **changes) -> PassResult:
    """The same by rigid_hertz: Hertz contact that may open and yield."""
    return rigid_hertz.solve(joint_scene(angle, **changes), RigidHertzSettings(start=WINDOW[0], end=WINDOW[1]))


VARIANTS = {
    "stiff contact, no damping, slopes of 1.2 m": as_the_formula,
    "Hertz contact": lambda angle: hertz(angle, damping=False),
    "and damped track": hertz,
    "and a parabolic dip of 0.5 m a side": lambda angle: hertz(angle, length=0.5, shape="parabolic"),
}


def increment(result: PassResult) -> float:
    """Of the track's spring over the static load [N]."""
    return result.peaks["force_foundation"].value - result.scene.static_wheel_load


def table(found: dict[str, list[PassResult]]) -> list[list[str]]:
    """Rows of increments [kN] by formula and variants, then of the damped joint's contact force [kN]."""
    kilo = lambda values: [f"{value / 1e3:.1f}" for value in values]
    damped = found["and damped track"]
    return [
        ["formula, increment [kN]", *kilo(formula(result.scene) for result in damped)],
        *([f"{name}: on the track's spring [kN]", *kilo(map(increment, results))] for name, results in found.items()),
        ["damped: contact force [kN]", *kilo(result.peaks["largest_force"].value for result in damped)],
        *(
            [f"damped: contact force at {cutoff:g} Hz [kN]", *kilo(filtered_peak(r, cutoff).value for r in damped)]
            for cutoff in (500.0, 50.0, 20.0)
        ),
        ["P2 with the factor 1.2 [kN]", *kilo(_p2(result.scene) for result in damped)],
    ]


def _p2(scene: Scene) -> float:
    return p2_force(scene.static_wheel_load, formula(scene))


def joint_figure(found: dict[str, list[PassResult]]):
    """Increments over the dip angle; histories of the contact force at DRAWN."""
    figure = new_figure(8.5)
    left, right = figure.subplots(1, 2)
    angles = 1e3 * ANGLES
    scene = found["and damped track"][0].scene
    left.plot(angles, [formula(r.scene) / 1e3 for r in found["and damped track"]], color=GREY, lw=4, label="P2 formula")
    for (name, results), colour, marker in zip(found.items(), CURVES, "osv^"):
        left.plot(angles, [increment(r) / 1e3 for r in results], color=colour, marker=marker, lw=1.5, label=name)
    left.set(
        xlabel="dip angle [mrad]",
        ylabel="track on its spring, over the static load [kN]",
        title="What the formula derives, its assumptions\ntaken away one after the other",
    )
    left.legend(loc="upper left")
    drawn = found["and damped track"][int(np.argmin(np.abs(ANGLES - DRAWN)))]
    x = 1e3 * drawn.history["x"]
    for cutoff, colour in ((np.inf, CURVES[0]), (500.0, CURVES[2]), (50.0, CURVES[3]), (20.0, CURVES[1])):
        label = "as computed" if np.isinf(cutoff) else f"low-passed at {cutoff:g} Hz"
        force = drawn.history["force"] if np.isinf(cutoff) else low_passed(drawn.history, cutoff)["force"]
        right.plot(x, force / 1e3, color=colour, lw=1 if np.isinf(cutoff) else 2, label=label)
    right.axhline(_p2(drawn.scene) / 1e3, color=GREY, ls="--", lw=2, label="P2 with the standard's factor 1.2")
    right.axhline(
        (drawn.scene.static_wheel_load + formula(drawn.scene)) / 1e3, color=GREY, ls=":", lw=2, label="P2 without"
    )
    right.set(
        xlabel="x of the wheel [mm]; the bend is at 0",
        ylabel="contact force [kN]",
        title=f"Contact force, dip of {1e3 * DRAWN:g} mrad, damped track",
    )
    right.legend(loc="upper right")
    words = scene_words(scene).partition(", ")[2]
    figure.suptitle(f"A dipped rail joint by light models and by the P2 formula\n{words}", fontsize=14)
    return figure


def main(out: Path = typer.Option(None, help="folder for joint.md and joint.png")) -> None:
    """A dipped rail joint: the P2 formula where its assumptions hold, and where they do not."""
    found = {name: [variant(float(angle)) for angle in ANGLES] for name, variant in VARIANTS.items()}
    text = "\n".join(markdown_table(HEAD, table(found)))
    print(text)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        write_text_atomically(out / "joint.md", text + "\n")
        with lettering():
            save(joint_figure(found), out / "joint.png")


if __name__ == "__main__":
    typer.run(main)
