"""Study: the P2 formula beside what it is quoted for, a force low-passed at 20 Hz, in the sixteen cases of the thesis.

    rail-fem study p2 --out p2                    table on the screen and in p2.md

P2 by the formula from the dip of the rigid wheel's path and from that of the wheel's own trajectory in rigid_hertz;
beside it the largest contact force of that pass as it is and low-passed at 500, 50 and 20 Hz, and the largest force of
the track on its spring, which is what the formula derives. The formula's wheel meets one kink between long straight
slopes and moves on with the track mass for a quarter of their period: pi / 2 sqrt((Mu + Mt) / Kt), 5 ms or 170 mm at
75 mph. A crossing's path bends again before that is over, so that the formula's dip does not last; and a low pass at
20 Hz (a period of 50 ms, 1.7 m) averages over the whole window that is run here.
"""

from pathlib import Path

import numpy as np
import typer

from rail_fem.case.casefile import load_case
from rail_fem.light.dip import trajectory_dip
from rail_fem.light.p2 import p2_force, p2_increment
from rail_fem.models import p2_formula, rigid_hertz
from rail_fem.output.low_pass import filtered_force
from rail_fem.output.markdown import markdown_table
from rail_fem.scene.scene import Scene
from rail_fem.settings.light import P2Settings, RigidHertzSettings
from rail_fem.show.table_and_figure import write_table_and_figure
from rail_fem.studies.whole_crossing import case_files

CUTOFFS = (np.inf, 500.0, 50.0, 20.0)
HEAD = (
    "case",
    "dip of the path [mrad]",
    "P2 [kN]",
    "dip of the trajectory [mrad]",
    "P2 [kN]",
    "contact [kN]",
    "500 Hz [kN]",
    "50 Hz [kN]",
    "20 Hz [kN]",
    "on the track's spring [kN]",
)


def p2_of(scene: Scene, dip: float, reading: str, mass: float) -> float:
    """P2 [kN] of a dip angle [rad]."""
    foundation = scene.foundation
    increment = p2_increment(dip, scene.speed, mass, foundation.track_mass, foundation.stiffness)
    return p2_force(scene.static_wheel_load, increment, reading) / 1e3


def row(file: Path) -> list[str]:
    """One case."""
    case = load_case(file)
    settings = case.settings(P2Settings)
    formula, found = (
        p2_formula.solve(case.scene, settings),
        rigid_hertz.solve(case.scene, case.settings(RigidHertzSettings)),
    )
    own = trajectory_dip(found).angle
    forces = [filtered_force(found, cutoff) for cutoff in CUTOFFS]
    dips, mass = (formula.trust["dip_angle"], own), formula.trust["unsprung_mass"]
    p2 = [p2_of(case.scene, dip, settings.reading, mass) for dip in dips]
    return [
        file.stem,
        f"{1e3 * formula.trust['dip_angle']:.1f}",
        f"{p2[0]:.0f}",
        f"{1e3 * own:.1f}",
        f"{p2[1]:.0f}",
        *(f"{force / 1e3:.0f}" for force in forces),
        f"{found.peaks['force_foundation'].value / 1e3:.0f}",
    ]


def main(out: Path = typer.Option(None, help="folder for p2.md")) -> None:
    """The P2 formula against forces low-passed as the trade quotes them."""
    text = "\n".join(markdown_table(HEAD, [row(file) for file in case_files()]))
    print(text)
    if out is not None:
        write_table_and_figure(out / "p2.md", text)


if __name__ == "__main__":
    typer.run(main)
