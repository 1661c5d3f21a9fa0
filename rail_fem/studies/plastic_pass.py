"""Plastic strain of a pass by bem_plastic beside an explicit run of the same scene: sizes, differences, reasons.

    rail-fem study plastic-pass --judge runs/fe2 --out plastic_pass      table (plastic_pass.md), figure (.png)
    rail-fem study plastic-pass --judge runs/fe2 --changes               and one thing changed at a time

--judge names a finished run of fe_full. bem_plastic passes the same stretch on cells of several sizes; every quantity
is taken by the one definition for both (rail_fem.output.plastic_zone). The limit is of first order through the last
three sizes, the order the observed one.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import typer
from matplotlib.figure import Figure

from geometry.surfaces.bodies import BODIES
from rail_fem.light.contact_pairs import crossing_surface
from rail_fem.light.contact_table import ContactTable, TableKey, contact_table, table_key
from rail_fem.light.plastic_fields import hexahedra
from rail_fem.light.plastic_indentation import contacts_of
from rail_fem.light.vertical_pass import LightPass, run_pass
from rail_fem.models.bem_plastic import ForceHistory, flow_of
from rail_fem.output.extrapolation import limit_of
from rail_fem.output.markdown import markdown_table
from rail_fem.output.plastic_zone import PlasticZone, along_track, plan_map, plastic_zone
from rail_fem.output.result import PassResult, load
from rail_fem.scene.scene import Scene
from rail_fem.settings.plastic import BemPlasticSettings
from rail_fem.show.fields import read_crossing
from rail_fem.show.style import NOSE, STRAIN_COLOURS, TOTAL, WING, new_figure
from rail_fem.show.table_and_figure import write_table_and_figure
from rail_fem.studies.size_series import read_sizes

MM = 1e-3
COLUMN, DEPTH, SLICE = 1 * MM, 3 * MM, 4 * MM  # of the map seen from above, and of slices along the track [m]
SHOWN = {
    "block": ("5 x 5 x 3 mm [%]", 100.0, 2),
    "worst_1000": ("worst 1000 mm3 [%]", 100.0, 2),
    "integral": ("integral [mm3]", 1e9, 1),
    "volume_3": ("above 3 % [mm3]", 1e9, 0),
}


@dataclass(frozen=True)
class Strained:
    """One body after a pass: its hexahedra (m, 8, 3) [m], plastic strain (m,), what is reported of it, CPU seconds."""

    corners: np.ndarray
    strain: np.ndarray
    zone: PlasticZone
    seconds: float

    @classmethod
    def of(cls, corners: np.ndarray, strain: np.ndarray, seconds: float) -> Strained:
        return cls(corners, strain, plastic_zone(corners, strain, np.zeros((len(strain), 2))), seconds)


@dataclass(frozen=True)
class Setting:
    """The judge, and what bem_plastic needs of its scene: contacts along the path, and its own forces on it."""

    judge: PassResult
    folder: Path
    settings: BemPlasticSettings
    pairs: tuple[TableKey, ContactTable]
    run: LightPass

    @property
    def scene(self) -> Scene:
        return self.judge.scene


def prepare(folder: Path) -> Setting:
    """The stretch of a finished explicit run. Errors: those of result.load, ValueError for a run that failed."""
    judge = load(folder)
    if judge.fault or not judge.metal:
        raise ValueError(f"{folder}: a run of {judge.model} without plastic strain ({judge.fault or 'none told'})")
    x = judge.history["x"]
    settings = BemPlasticSettings(start=float(x[0]), end=float(x[-1]))
    window = settings.window(judge.scene)
    pairs = (
        table_key(judge.scene, *window, settings.path_spacing),
        contact_table(judge.scene, *window, settings.path_spacing),
    )
    run = run_pass(judge.scene, settings, contacts_of(judge.scene, settings, pairs[1]))
    return Setting(judge, folder, settings, pairs, run)


def by_judge(setting: Setting) -> dict[str, Strained]:
    """Wing and nose of the explicit run."""
    fields, seconds = read_crossing(setting.folder), setting.judge.cost.solve_time * setting.judge.cost.ranks
    mine = {body: fields.region == k for k, body in enumerate(BODIES)}
    return {
        body: Strained.of(fields.points[fields.cells[chosen]], fields.plastic_strain[chosen], seconds)
        for body, chosen in mine.items()
    }


def by_boundary_elements(
    setting: Setting, size: float, forces: ForceHistory | None = None, bodies=BODIES, **changes
) -> dict[str, Strained]:
    """Bodies after the pass on cells of a side [m], stations their length apart; forces : in place of its own."""
    settings = setting.settings.model_copy(update={"cell_size": size} | changes)
    if "step" not in changes:
        settings = settings.model_copy(update={"step": settings.cell_aspect * size})
    found = {}
    for body in bodies:
        tick, number = time.process_time(), BODIES.index(body)
        flow = flow_of(setting.scene, settings, setting.pairs, forces or setting.run, number)
        part = None if flow is None else hexahedra(flow, crossing_surface(setting.pairs[0].crossing, body), number)
        if part is not None:
            corners = part["points"][part["cells"]]
            found[body] = Strained.of(corners, part["plastic_strain"], time.process_time() - tick)
    return found


def table(sizes: list[float], runs: list[dict[str, Strained]], judge: dict[str, Strained], size: float) -> str:
    """Markdown: quantities of both bodies at every size [m], limit, order, and the judge on elements of `size` [m]."""
    lines = []
    for body in BODIES:
        if any(body not in run for run in runs):
            continue
        for name, (words, factor, digits) in SHOWN.items():
            values = [run[body].zone.values[name] * factor for run in runs]
            limit = limit_of(sizes, values, 1.0)
            there = judge[body].zone.values[name] * factor
            lines.append(
                [
                    f"{body}, {words}", *(f"{value:.{digits}f}" for value in values),
                    f"{limit.value:.{digits}f} +- {limit.doubt:.{digits}f}",
                    "-" if np.isnan(limit.order) else f"{limit.order:.1f}", f"{there:.{digits}f}",
                    f"{limit.value / there - 1:+.0%}" if there else "-",
                ]
            )  # fmt: skip
        places = [f"{run[body].zone.block[0] / MM:.0f}" for run in runs]
        lines.append([f"{body}, x of the block [mm]", *places, "", "", f"{judge[body].zone.block[0] / MM:.0f}", ""])
        seconds = [f"{run[body].seconds:.0f}" for run in runs]
        lines.append([f"{body}, CPU s", *seconds, "", "", f"{judge[body].seconds:.0f} (both)", ""])
    head = ["", *(f"cells {value / MM:g} mm" for value in sizes), "limit", "order", f"fe_full {size / MM:g} mm"]
    return "\n".join(markdown_table([*head, "limit to fe_full"], lines)) + "\n"


def changes_of(setting: Setting) -> dict[str, Callable[[float], dict[str, Strained]]]:
    """One thing changed at a time on the nose: name -> cell size [m] -> the body."""
    forces = ForceHistory.of(setting.judge)
    step = setting.settings.cell_aspect

    def run(**options):
        return lambda size: by_boundary_elements(setting, size, bodies=("nose",), **options)

    return {
        "as it is": run(),
        "forces of fe_full": run(forces=forces),
        "stations twice as far apart": lambda size: run(step=2 * step * size)(size),
        "cells three times as long": lambda size: run(cell_aspect=3 * step, step=step * size)(size),
        "kinematic hardening": run(kinematic=True),
    }


def changes_table(found: dict[str, dict[str, Strained]]) -> str:
    """Markdown: what each change does to the nose."""
    lines = []
    for words, run in found.items():
        values = run["nose"].zone.values
        cells = [f"{values[name] * factor:.{digits}f}" for name, (_, factor, digits) in SHOWN.items()]
        lines.append([words, *cells, f"{run['nose'].zone.block[0] / MM:.0f}", f"{run['nose'].seconds:.0f}"])
    heads = [words for words, _, _ in SHOWN.values()]
    return "\n".join(markdown_table(["nose", *heads, "x of the block [mm]", "CPU s"], lines)) + "\n"


def draw(setting: Setting, ours: dict[str, Strained], judge: dict[str, Strained], size: float) -> Figure:
    """The nose from above by both and their difference on one scale; plastic strain and forces along the track."""
    there, here = judge["nose"], ours["nose"]
    strained = here.corners[here.strain > 0].reshape(-1, 3), there.corners[there.strain > 0.002].reshape(-1, 3)
    points = np.vstack(strained)[:, :2]
    box = np.array([np.floor(points.min(axis=0) / COLUMN) - 2, np.ceil(points.max(axis=0) / COLUMN) + 2]) * COLUMN
    maps = [plan_map(one.corners, one.strain, box, COLUMN, DEPTH) for one in (here, there)]
    values = [np.nan_to_num(one.strain) * 100 for one in maps]
    most = max(value.max() for value in values)
    extent = [box[0, 0] / MM, box[1, 0] / MM, box[0, 1] / MM, box[1, 1] / MM]
    figure = new_figure(10.5)
    above, below = figure.subfigures(2, 1, height_ratios=[1.25, 1])
    panels = above.subplots(3, 1, sharex=True, sharey=True)
    names = f"bem_plastic, cells of {size / MM:g} mm", f"fe_full, elements of {element(setting) / MM:g} mm"
    for axis, value, name in zip(panels, [*values, values[0] - values[1]], [*names, "bem_plastic less fe_full"]):
        apart = axis is panels[2]
        image = axis.imshow(
            value.T, origin="lower", extent=extent, aspect="auto", interpolation="nearest",
            cmap="RdBu_r" if apart else STRAIN_COLOURS, vmin=-most if apart else 0, vmax=most,
        )  # fmt: skip
        axis.set_title(name, fontsize=11)
        axis.set_ylabel("y [mm]")
        axis.grid(False)
        above.colorbar(image, ax=axis, label="PEEQ [%]", aspect=8)
    panels[2].set_xlabel("x along the track [mm]")
    left, right = below.subplots(1, 2)
    edges = np.arange(setting.run.x.min() - 20 * MM, setting.run.x.max() + 20 * MM, SLICE)
    middle = (edges[1:] + edges[:-1]) / 2 / MM
    for body, colour in (("wing", WING), ("nose", NOSE)):
        for run, line, name in ((ours, "-", "bem_plastic"), (judge, "--", "fe_full")):
            if body in run:
                one = run[body]
                value = along_track(one.corners, one.strain, edges) * 1e6
                left.plot(middle, value, line, color=colour, label=f"{body}, {name}")
        right.plot(setting.run.x / MM, setting.run.force[BODIES.index(body)] / 1e3, "-", color=colour)
        right.plot(
            setting.judge.history["x"] / MM, setting.judge.history[f"force_{body}"] / 1e3, "--", color=colour, lw=1
        )
    left.set(xlabel="x [mm]", ylabel="PEEQ over the section [mm\u00b2]", ylim=(0, None))
    right.set(xlabel="x of the wheel [mm]", ylabel="force [kN]", ylim=(0, None))
    left.legend(fontsize=9)
    right.plot([], [], "-", color=TOTAL, label="bem_plastic (of rigid_hertz)")
    right.plot([], [], "--", color=TOTAL, label="fe_full")
    right.legend(fontsize=9)
    above.suptitle(
        f"Plastic strain of a pass, mean over the upper {DEPTH / MM:g} mm of the nose seen from above, widths stretched"
    )
    return figure


def element(setting: Setting) -> float:
    """Element size of the judge [m]."""
    return float(setting.judge.settings["element_size"])


def main(
    judge: Path = typer.Option(..., help="folder of a finished run of fe_full"),
    sizes: str = typer.Option("3,2,1.5", help="cells across and in depth, coarse to fine [mm]"),
    changes: bool = typer.Option(False, "--changes", help="one thing changed at a time, on the coarsest cells"),
    out: Path = typer.Option(None, help="folder for plastic_pass.md and plastic_pass.png"),
) -> None:
    """Plastic strain of a pass by bem_plastic against an explicit run: limit, difference, place, reasons."""
    setting, ordered = prepare(judge), read_sizes(sizes)
    there = by_judge(setting)
    runs = [by_boundary_elements(setting, size) for size in ordered]
    text = table(ordered, runs, there, element(setting))
    if changes:
        text += "\n" + changes_table({words: run(ordered[0]) for words, run in changes_of(setting).items()})
    print(text, end="")
    if out is not None:
        write_table_and_figure(
            out / "plastic_pass.md", text, out / "plastic_pass.png",
            lambda: draw(setting, runs[-1], there, ordered[-1]),
        )  # fmt: skip


if __name__ == "__main__":
    typer.run(main)
