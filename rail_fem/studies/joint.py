"""Study: a dipped rail joint, the P2 formula's own scene, by the light models.

    rail-fem study joint --out joint              tables on the screen and in joint.md, figure joint.png

First the formula's assumptions taken away one after the other, over the dip angle; then each by itself at one angle.
The standard's factor 1.2 is left out everywhere but in the line that shows P2 itself.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import typer
from matplotlib.figure import Figure

from rail_fem.light.p2 import p2_force, p2_increment
from rail_fem.output.low_pass import filtered_force, low_passed
from rail_fem.output.markdown import markdown_table
from rail_fem.output.result import PassResult
from rail_fem.scene.scene import Scene
from rail_fem.show.style import CURVES, GREY, new_figure, scene_words
from rail_fem.show.table_and_figure import write_table_and_figure
from rail_fem.studies.joint_passes import (
    NO_SUSPENSION,
    REAL,
    SUSPENSION_DAMPING,
    TRACK_DAMPING,
    OnSpring,
    formula,
    half_period,
    hertz,
    hertz_pass,
    joint_scene,
    over_formula,
    stiff,
)

ANGLES = np.array([0.2, 0.5, 1.0, 2.0, 4.0, 7.0, 10.0, 15.0]) * 1e-3  # of the dip [rad]
DRAWN = 10e-3  # of the second table, and whose histories are drawn [rad]
bare = lambda angle, **changes: joint_scene(angle, damping=False, suspension=NO_SUSPENSION, **changes)

VARIANTS: dict[str, Callable[[float], OnSpring]] = {
    "as the formula: stiff contact that cannot open": lambda angle: stiff(bare(angle)),
    "the stiff contact may open": lambda angle: stiff(bare(angle), opens=True),
    "Hertz contact and suspension spring": lambda angle: hertz(joint_scene(angle, damping=False)),
    "and dampers of track and suspension": lambda angle: hertz(joint_scene(angle)),
    "and a parabolic dip of 0.5 m a side": lambda angle: hertz(joint_scene(angle, length=0.5, shape="parabolic")),
}


def causes(angle: float) -> list[list[str]]:
    """Rows: one thing changed at a time in what the formula assumes, and what of the formula's increment is then
    found."""
    base = stiff(bare(angle))
    whole = stiff(joint_scene(angle, damping=False))
    own = lambda found: [f"{over_formula(found):.3f}", f"{found.force.max() / formula(found.scene):.3f}"]
    mass = base.scene.vehicle
    wheelset = p2_increment(
        angle, base.scene.speed, mass.wheelset_unsprung_mass, base.scene.foundation.track_mass, 1.6e8
    ) / formula(base.scene)
    damped = bare(angle, track_damping=TRACK_DAMPING)
    factor = formula(damped, damped=True) / formula(damped)
    return [
        ["as the formula: stiff contact that cannot open, no suspension, no damping", *own(base)],
        ["path looked at every 1 mm (2.5)", *own(stiff(bare(angle), spacing=1e-3))],
        ["contact as stiff as wheel on rail, cannot open", *own(stiff(bare(angle), constant=REAL))],
        ["stiff contact that may open", *own(stiff(bare(angle), opens=True))],
        ["suspension spring of 1.2 MN/m", *own(whole)],
        [f"track damper; the formula with its damping says {factor:.3f}", *own(stiff(damped))],
        ["suspension damper of 10 kN s/m", *own(stiff(bare(angle, suspension_damping=SUSPENSION_DAMPING)))],
        ["dip of 0.5 m a side, parabolic", *own(stiff(bare(angle, length=0.5, shape="parabolic")))],
        ["formula with the wheelset's mass for one wheel's", f"{wheelset:.3f}", ""],
        ["formula with the angle of one side", "0.500", ""],
    ]


def angle_table(found: dict[str, list[OnSpring]], damped: list[PassResult]) -> list[str]:
    """Markdown: increments over the formula's by variants, then the damped joint's contact force [kN]."""
    kilo = lambda values: [f"{value / 1e3:.1f}" for value in values]
    scenes = [result.scene for result in damped]
    rows = [
        ["formula, increment [kN]", *kilo(map(formula, scenes))],
        *([f"{name}: over the formula", *(f"{over_formula(r):.3f}" for r in own)] for name, own in found.items()),
        [
            "formula with the track's damping, over the one without",
            *(f"{formula(s, True) / formula(s):.3f}" for s in scenes),
        ],
        ["damped: contact force [kN]", *kilo(result.peaks["largest_force"].value for result in damped)],
        *(
            [f"damped: contact force at {cutoff:g} Hz [kN]", *kilo(filtered_force(r, cutoff) for r in damped)]
            for cutoff in (500.0, 50.0, 20.0)
        ),
        ["P2 with the factor 1.2 [kN]", *kilo(map(_p2, scenes))],
    ]
    return markdown_table(["", *(f"{1e3 * angle:g} mrad" for angle in ANGLES)], rows)


def cause_table(angle: float) -> list[str]:
    """Markdown of `causes`."""
    head = [f"dip of {1e3 * angle:g} mrad", "first peak over the formula", "largest up to 1 m behind the bend"]
    return markdown_table(head, causes(angle))


def _p2(scene: Scene) -> float:
    return p2_force(scene.static_wheel_load, formula(scene))


def joint_figure(found: dict[str, list[OnSpring]], damped: list[PassResult]) -> Figure:
    """Increments over the formula's against the dip angle; at DRAWN, the track's force on its spring and the contact
    force."""
    figure = new_figure(13.0)
    axes = figure.subplot_mosaic([["angle", "angle"], ["spring", "contact"]])
    drawn = int(np.argmin(np.abs(ANGLES - DRAWN)))
    scene = damped[drawn].scene
    for (name, own), colour, marker in zip(found.items(), CURVES, "osv^D"):
        axes["angle"].plot(
            1e3 * ANGLES, [over_formula(r) for r in own], color=colour, marker=marker, lw=1.8, label=name
        )
        of_drawn = own[drawn]
        axes["spring"].plot(1e3 * of_drawn.x, of_drawn.force / 1e3, color=colour, lw=1.6)
    axes["angle"].axhline(1, color=GREY, lw=4, zorder=0, label="P2 formula")
    ratio = formula(scene, damped=True) / formula(scene)
    axes["angle"].axhline(ratio, color=GREY, lw=2, ls="--", zorder=0, label="P2 formula with the track's damping")
    axes["angle"].set(
        xlabel="dip angle between both slopes [mrad]",
        ylabel="first peak on the track's spring\nover the formula's increment",
        title="Met where its assumptions hold; they are taken away one after the other",
        ylim=(0.85, 1.4),
    )
    axes["angle"].legend(loc="upper right", ncols=2)
    axes["spring"].axhline(formula(scene) / 1e3, color=GREY, lw=4, zorder=0)
    axes["spring"].axvspan(0, 1e3 * half_period(scene), color="#EEEEEE", zorder=-1)
    axes["spring"].set(
        xlabel="x of the wheel [mm]; grey: half a period behind the bend",
        ylabel="track on its spring, over the static load [kN]",
        title=f"The same at {1e3 * DRAWN:g} mrad",
        xlim=(-100, 700),
    )
    _draw_contact(axes["contact"], damped[drawn])
    words = scene_words(scene).partition(", ")[2]
    figure.suptitle(f"A dipped rail joint by light models and by the P2 formula\n{words}", fontsize=14)
    return figure


def _draw_contact(axes, result: PassResult) -> None:
    x = 1e3 * result.history["x"]
    for cutoff, colour in ((np.inf, CURVES[0]), (500.0, CURVES[2]), (50.0, CURVES[3]), (20.0, CURVES[1])):
        label = "as computed" if np.isinf(cutoff) else f"low-passed at {cutoff:g} Hz"
        force = result.history["force"] if np.isinf(cutoff) else low_passed(result.history, cutoff)["force"]
        axes.plot(x, force / 1e3, color=colour, lw=1 if np.isinf(cutoff) else 2, label=label)
    axes.axhline(_p2(result.scene) / 1e3, color=GREY, ls="--", lw=2, label="P2 with the standard's factor 1.2")
    without = result.scene.static_wheel_load + formula(result.scene)
    axes.axhline(without / 1e3, color=GREY, ls=":", lw=2, label="P2 without")
    axes.set(
        xlabel="x of the wheel [mm]; the bend is at 0",
        ylabel="contact force [kN]",
        title=f"Contact force at {1e3 * DRAWN:g} mrad, damped",
        ylim=(None, 380),
    )
    axes.legend(loc="upper left")


def main(out: Path = typer.Option(None, help="folder for joint.md and joint.png")) -> None:
    """A dipped rail joint: the P2 formula where its assumptions hold, and why it parts where they do not."""
    found = {name: [variant(float(angle)) for angle in ANGLES] for name, variant in VARIANTS.items()}
    damped = [hertz_pass(joint_scene(float(angle))) for angle in ANGLES]
    text = "\n".join([*angle_table(found, damped), "", *cause_table(DRAWN)])
    print(text)
    if out is not None:
        write_table_and_figure(out / "joint.md", text, out / "joint.png", lambda: joint_figure(found, damped))


if __name__ == "__main__":
    typer.run(main)
