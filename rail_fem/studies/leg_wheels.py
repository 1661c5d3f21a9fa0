"""Study: four wheels on the leg, and why a P1 does there what it does.

    rail-fem study leg-wheels --out leg_wheels       tables on the screen and in leg_wheels.md, figure leg_wheels.png

By rigid_hertz at 75 mph over the benchmark's leg, the fitted one, and the benchmark's with a shorter transition.
A wheel follows its rigid path as long as this falls away no faster than load and mass let it fall: V^2 |h''|
below P0 / Mu (172 m/s^2, 17.5 times gravity). The thesis (section 7.5.5): a P1 loses contact at 0.65 m, drops until
about 0.7 m and strikes hardest of all wheels; a worn P8 is thrown up, a nominal one lands earlier, a hollow one has
favourable forces.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import typer
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from geometry.path.wheel_path import WheelPath
from geometry.profiles.profile import hermite_many
from rail_fem.light.rigid import rigid_path
from rail_fem.output.events import longest_flight, stated_peaks
from rail_fem.output.markdown import markdown_table
from rail_fem.output.result import PassResult
from rail_fem.scene.scene import Scene
from rail_fem.show.style import GREEN, NOSE, TOTAL, WING, new_figure
from rail_fem.show.table_and_figure import write_table_and_figure
from rail_fem.studies.leg import CROSSING, END, FITTED, run

WHEELS = {"P8": "nominal P8", "P8-worn": "worn P8", "P8-hollow": "hollow P8", "P1": "P1"}
COLOURS = dict(zip(WHEELS, (WING, TOTAL, GREEN, NOSE)))
LEGS: dict[str, dict[str, Any]] = {"benchmark's": {}, "fitted": FITTED}
LENGTHS = 20, 40, 60, 80  # of shorter transitions [mm]
SHORT = {END: "-350 mm"}
SPACING, STRETCH = 1e-3, 2e-3  # of the path, and of the chords over which its curvature is taken [m]


@dataclass(frozen=True)
class OnLeg:
    """A wheel on a leg: its pass and its rigid path from before the leg to behind it."""

    wheel: str
    result: PassResult
    path: WheelPath

    @property
    def scene(self) -> Scene:
        """Of the pass."""
        return self.result.scene

    @property
    def falls_away(self) -> float:
        """Largest V^2 |h''| of the path where it bends downwards, over P0 / Mu [1]."""
        step = round(STRETCH / SPACING)
        bend = (self.path.slope[step:] - self.path.slope[:-step]) / STRETCH
        able = self.scene.static_wheel_load / self.scene.vehicle.wheel_unsprung_mass
        return float(self.scene.speed**2 * max(-bend.min(), 0.0) / able)

    def contact_y(self, x: float) -> float:
        """Lateral position of the rigid wheel's contact over x [m]."""
        return float(self.path.contact_point[np.argmin(np.abs(self.path.x - x)), 1])


def on_leg(wheel: str, changes: dict[str, Any]) -> OnLeg:
    """A wheel's pass over a leg, from plain line to behind the landing."""
    result = run(SHORT | changes | {"scene.wheel.profile": wheel})
    low, high = result.scene.crossing.surface.leg_range
    return OnLeg(wheel, result, rigid_path(result.scene, np.arange(low - 0.03, high + 0.05, SPACING)))


def row(words: str, found: OnLeg) -> list[str]:
    """What the leg does to the wheel."""
    path, (low, high) = found.path, found.scene.crossing.surface.leg_range
    peak, flight = stated_peaks(found.result)["largest_force_leg"], longest_flight(found.result)
    height = 1e3 * (path.height - path.height[0])
    return [
        words,
        f"{1e3 * found.contact_y(low):.1f}, {1e3 * found.contact_y(high):.1f}",
        f"{height.min():+.2f}, {height[-1]:+.2f}",
        f"{1e3 * path.slope.min():.1f}, {1e3 * path.slope.max():+.1f}",
        f"{found.falls_away:.2f}",
        f"{peak.value / 1e3:.0f}",
        f"{found.result.peaks['largest_force'].value / 1e3:.0f}",
        f"{1e3 * flight.length:.0f} from {1e3 * flight.x_start:.0f}" if flight.length else "none",
    ]


def table(rows: list[list[str]]) -> list[str]:
    """Markdown."""
    head = ["leg, wheel", "contact y on plain rail, cast section [mm]", "path: lowest, behind the leg [mm]"]
    head += ["steepest fall, climb [mrad]", "V^2 abs(h'') over P0 / Mu, downwards", "force on the leg [kN]"]
    head += ["largest force [kN]", "flight [mm] from x [mm]"]
    return markdown_table(head, rows)


def figure(wheels: list[OnLeg], shorter: list[OnLeg]) -> Figure:
    """Sections with a P1 and a worn P8 on them; rigid paths of the four wheels; force of a P1 by the transition's
    length."""
    drawn = new_figure(13.0)
    axes = drawn.subplot_mosaic([["rail", "cast"], ["path", "path"], ["force", "force"]])
    low, high = wheels[0].scene.crossing.surface.leg_range
    chosen = [one for one in wheels if one.wheel in ("P1", "P8-worn")]
    for name, x, words in (("rail", low - 0.01, "plain rail"), ("cast", high + 0.005, "cast section: a plane of 1:20")):
        _draw_section(axes[name], chosen, x)
        axes[name].set(title=words, xlabel="y, gauge side on the left [mm]", ylabel="z [mm]")
    axes["rail"].legend(loc="lower center")
    for one in wheels:
        height = 1e3 * (one.path.height - one.path.height[0])
        axes["path"].plot(1e3 * one.path.x, height, color=COLOURS[one.wheel], lw=2, label=WHEELS[one.wheel])
    axes["path"].set(ylabel="rigid path [mm]", title="The benchmark's leg lifts three of the wheels and lowers a P1")
    axes["path"].legend(loc="upper left")
    for one, style in zip(shorter, ("-", "--", "-.", ":", "-")):
        length = 1e3 * np.subtract(*one.scene.crossing.surface.leg_range[::-1])
        history, colour = one.result.history, NOSE if length < 100 else TOTAL
        axes["force"].plot(
            1e3 * history["x"], history["force"] / 1e3, color=colour, ls=style, lw=1.8, label=f"{length:.0f} mm"
        )
    axes["force"].set(
        xlabel="position x of the wheel [mm]",
        ylabel="force on the wheel [kN]",
        title="A P1 by the length of the leg's transition: cut shorter than about 90 mm it flies and strikes",
        xlim=(-800, -400),
    )
    axes["force"].legend(title="transition", loc="upper right")
    drawn.suptitle("Four wheels on the leg at 75 mph, 1:10.75, by rigid_hertz", fontsize=14)
    return drawn


def _draw_section(axes: Axes, wheels: list[OnLeg], x: float) -> None:
    """Running surface at x and the wheels that stand on it."""
    y = np.linspace(-28e-3, 38e-3, 1321)
    scene = wheels[0].scene
    rail = scene.crossing.surface.heights(np.full(len(y), x), y, "wing")
    seen = rail > -1e-2
    axes.fill_between(1e3 * y[seen], 1e3 * rail[seen], -5, color="#CCCCCC")
    for one in wheels:
        wheel = one.scene.wheel.shape
        tread = hermite_many(y - one.scene.wheel_datum_y, *wheel.hermite_table())[0]
        gap = np.where(seen, tread - rail, np.inf)
        at = int(np.nanargmin(gap))
        colour = COLOURS[one.wheel]
        axes.plot(1e3 * y, 1e3 * (tread - gap[at]), color=colour, lw=2, label=WHEELS[one.wheel])
        axes.plot(1e3 * y[at], 1e3 * rail[at], "o", color=colour, ms=9)
    axes.set(xlim=(-28, 38), ylim=(-3.5, 3.0))


def main(out: Path = typer.Option(None, help="folder for leg_wheels.md and leg_wheels.png")) -> None:
    """Four wheels on the leg, and why a P1 does there what it does."""
    found = {legs: [on_leg(wheel, changes) for wheel in WHEELS] for legs, changes in LEGS.items()}
    length = lambda mm: {CROSSING + "transition_length": f"{mm} mm"}
    shorter = {mm: [on_leg(wheel, length(mm)) for wheel in ("P8-worn", "P1")] for mm in LENGTHS}
    rows = [row(f"{legs} leg, {WHEELS[one.wheel]}", one) for legs, own in found.items() for one in own]
    of_length = [row(f"transition of {mm} mm, {WHEELS[one.wheel]}", one) for mm, own in shorter.items() for one in own]
    text = "\n".join([*table(rows), "", *table(of_length)])
    print(text)
    if out is not None:
        cones = [own[-1] for own in shorter.values()] + [found["benchmark's"][-1]]
        write_table_and_figure(
            out / "leg_wheels.md", text, out / "leg_wheels.png", lambda: figure(found["benchmark's"], cones)
        )


if __name__ == "__main__":
    typer.run(main)
