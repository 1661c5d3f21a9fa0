"""Figure of the patches that wear a section: where a wheel touches it, and for each point pressure, tractions, depth
of cells and strips (in kind the thesis' figures 4-5 to 4-7)."""

import numpy as np
from matplotlib.figure import Figure

from bem.halfspace.figures import draw_patch, map_of_cells
from geometry.profiles.profile import hermite_many
from rail_fem.damage.evolution import Rate
from rail_fem.damage.rolling import RollingPoint
from rail_fem.damage.section import PassRecord
from rail_fem.damage.wear import laws_of
from rail_fem.damage.worn_profile import WornProfile
from rail_fem.settings.damage import DamageSettings
from rail_fem.show.panels import Panel, titled
from rail_fem.show.style import new_figure

MM, UM = 1e3, 1e6
MOST = 3  # points drawn


def shown_pass(rate: Rate) -> PassRecord:
    """That whose load two points of the section share most evenly; without such a one that of the largest force."""

    def second(record: PassRecord) -> tuple[float, float]:
        forces = [p.normal_force for p in points_of(record)] + [0.0, 0.0]
        return forces[1], forces[0]

    return max((record for _, record in rate.kinds), key=second)


def points_of(record: PassRecord) -> list[RollingPoint]:
    """On the section, the largest force first."""
    return record.on_section[:MOST]


def patches_figure(title: str, settings: DamageSettings, line: WornProfile, rate: Rate) -> Figure:
    """The pass of a rate whose load is shared most evenly, on the line (n,) that it was found on."""
    record, law = shown_pass(rate), laws_of(settings)[settings.law]
    points = points_of(record)
    figure, rows = new_figure(5.0 + 7.0 * len(points)), [["whole"] * 3]
    for k in range(len(points)):
        rows += [[f"{k}0", f"{k}1", f"{k}2"], [f"{k}3", f"{k}4", f"{k}4"]]
    axes = figure.subplot_mosaic(rows)
    touching_panel(line, record, points).draw(axes["whole"])
    for k, point in enumerate(points):
        patch, row = point.patch, [axes[f"{k}{column}"] for column in range(5)]
        draw_patch(figure, row, patch)
        depth = law.cells(patch, point.speed) * settings.factor * UM
        map_of_cells(figure, row[3], patch, depth * 1e4, "depth of a cell [1e-4 \u00b5m]", "magma_r")
        row[0].set_title(f"{'abc'[k]}: {patch.normal_force / 1e3:.1f} kN, T\u03b3 {point.tgamma:.3g} N", fontsize=11)
        row[1].set_title(f"at an angle of {np.degrees(point.angle):.1f}\u00b0", fontsize=11)
        row[2].set_title("stick (blue) and slip", fontsize=11)
        row[2].get_legend().remove()
        for axis in row[:4]:
            axis.set_aspect("auto")
            axis.invert_xaxis()  # y to the right, as the section and the strips have it
        strip = {"_strip": (patch.grid.y * MM, depth.sum(axis=0) * 1e2)}
        Panel("y lateral [mm]", "depth of a strip [0.01 \u00b5m]", strip).draw(row[4])
    return titled(
        figure, f"{title}\none pass over the first shape, wheelset at {record.lateral * MM:.2f} mm, running towards + x"
    )


def touching_panel(line: WornProfile, record: PassRecord, points: list[RollingPoint]) -> Panel:
    """The section and the wheel laid on it at its points (as it stands but for the axle's roll)."""
    lines: dict[str, tuple] = {"section": (*(line.points * MM).T, "-")}
    if points:
        wheel, at = record.passing.wheel, np.array([p.position for p in points])
        station = np.array([p.station for p in points])
        touch = np.column_stack([station, hermite_many(station, *wheel.hermite_table())[0]])
        lines["wheel"] = *((wheel.points + (at - touch).mean(axis=0)) * MM).T, "-"
        lines |= {f"touches at {'abc'[k]}": ([y * MM], [z * MM], "o") for k, (y, z) in enumerate(at)}
    return Panel("y [mm], + towards the field side", "z [mm]", lines, equal=True)
