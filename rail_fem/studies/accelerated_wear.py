"""Study: accelerated wear of a switch, in kind the thesis' figure 4-10 (a, b): one Archard k in place of the map.

    rail-fem study accelerated-wear --out accelerated        some seven minutes of one processor

The case is cases/damage/switch_section.toml; blocks are as long as its tolerance lets them be, 50 passes at most.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import typer
from matplotlib.figure import Figure

from rail_fem.damage.evolution import Evolution, evolve
from rail_fem.damage.sites import stepping_of, switch_section
from rail_fem.damage.worn_profile import WornOutError, depth_between
from rail_fem.output.markdown import markdown_table
from rail_fem.show.style import GREEN, GREY, NOSE, ORANGE, PURPLE, new_figure
from rail_fem.show.table_and_figure import write_table_and_figure
from rail_fem.studies.damage_numbers import damage_case

COEFFICIENT, BLOCK = 0.1, 50.0
SHOWN = 100.0, 500.0, 1000.0, 2000.0  # passes
BACK = -30.5e-3  # y of the switch rail's back: beyond it is the stock rail [m]
WORN = 0.05  # of the deepest: what counts as the groove's width
COLOURS = ORANGE, GREEN, PURPLE, NOSE
MM, UM = 1e3, 1e6


class Worn(NamedTuple):
    """A study's states at the ends of its blocks, and the sentence with which it ended, if before its last pass."""

    states: list[Evolution]
    ended: str


def wear(coefficient: float, passes: float, block: float = BLOCK) -> Worn:
    """The case's switch worn by one k."""
    scene, settings = damage_case("switch_section", wear_coefficient=coefficient, block=block)
    section: Any = switch_section(scene, settings)
    states: list[Evolution] = []
    try:
        for state in evolve(section, passes, stepping_of(settings)):
            states.append(state)
            typer.echo(f"{state.passes:8.1f} passes, deepest {state.deepest * UM:.1f} um")
    except WornOutError as error:
        return Worn(states, str(error))
    return Worn(states, "")


def shown(found: Worn) -> list[Evolution]:
    """The states nearest to the passes that are shown, each once."""
    done = np.array([state.passes for state in found.states])
    return [found.states[k] for k in np.unique([np.argmin(np.abs(done - passes)) for passes in SHOWN])]


def row(state: Evolution) -> list[str]:
    """Of the table."""
    depth, on_switch = depth_between(state.worn, state.first), state.first.points[:, 0] < BACK
    groove = on_switch & (depth > WORN * depth[on_switch].max())
    y, z = state.first.points[np.argmax(np.where(on_switch, depth, 0.0))] * MM
    area = depth * state.first.widths * MM**2
    return [
        f"{state.passes:.0f}",
        f"{depth[on_switch].max() * UM:.0f}",
        f"{y:.1f}, {z:.1f}",
        f"{state.first.widths[groove].sum() * MM:.1f}",
        f"{area[on_switch].sum():.2f}",
        f"{depth[~on_switch].max() * UM:.0f}",
        f"{area[~on_switch].sum():.2f}",
        f"{state.log[-1, 2]:.0f}",
        f"{state.block_error:.1%}",
    ]


def table(found: Worn) -> str:
    """Markdown."""
    head = [
        "passes",
        "switch rail, deepest [µm]",
        "at y, z [mm]",
        "width [mm]",
        "area [mm²]",
        "stock rail, deepest [µm]",
    ]
    head += ["area [mm²]", "largest Tγ [N]", "bound of the blocks' error"]
    text = "\n".join(markdown_table(head, [row(state) for state in shown(found)])) + "\n"
    return text + (f"\nEnded: {found.ended}\n" if found.ended else "")


def draw(found: Worn, coefficient: float) -> Figure:
    """Section, switch rail's corner and stock rail's head before and after, both magnified alike."""
    figure = new_figure(9.5)
    grid = figure.add_gridspec(2, 2, height_ratios=[1.0, 1.3])
    states, first = shown(found), found.states[0].first.points * MM
    places = ("section", "a: switch rail, magnified", "b: stock rail's head, magnified alike")
    axes = [figure.add_subplot(grid[0, :]), figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[1, 1])]
    for axis, name in zip(axes, places, strict=True):
        axis.plot(*first.T, color=GREY, lw=2.0, label="new")
        for state, colour in zip(states, COLOURS, strict=False):
            axis.plot(*(state.worn.points * MM).T, color=colour, lw=1.3, label=f"{state.passes:,.0f} passes")
        axis.set(aspect="equal", xlabel="y [mm], + towards the field side", ylabel="z [mm]")
        axis.set_title(name, loc="left")
    depth, on_switch = depth_between(states[-1].worn, states[-1].first), first[:, 0] < BACK * MM
    for axis, own, mark in zip(axes[1:], (on_switch, ~on_switch), "ab", strict=True):
        at = first[np.argmax(np.where(own, depth, 0.0))]
        axis.set(xlim=(at[0] - 4, at[0] + 4), ylim=(at[1] - 4, at[1] + 4))
        axes[0].annotate(mark, at, (0, 10), textcoords="offset points", ha="center", weight="bold")
    axes[1].legend(loc="lower right")
    figure.suptitle(
        f"Switch 1 m from its toe, P8 on a sine in and out of flange contact; accelerated wear, k = {coefficient:g}",
        fontsize=13,
    )
    return figure


def main(
    out: Annotated[Path, typer.Option(help="folder for table and figure")],
    coefficient: Annotated[float, typer.Option(help="Archard's k", min=1e-5, max=1.0)] = COEFFICIENT,
    passes: Annotated[float, typer.Option(help="wheel passes", min=1, max=1e5)] = SHOWN[-1],
) -> None:
    """Accelerated wear of a switch section."""
    found = wear(coefficient, passes)
    if not found.states:
        raise SystemExit(f"no block could be worn: {found.ended}")
    text = table(found)
    typer.echo(text)
    figure = out / "accelerated_wear.png"
    write_table_and_figure(out / "accelerated_wear.md", text, figure, lambda: draw(found, coefficient))
    typer.echo(str(figure))


if __name__ == "__main__":
    typer.run(main)
