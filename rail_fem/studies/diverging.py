"""Study: the diverging route of the crossing at 40 mph, the other wheel on the check rail.

    rail-fem study diverging --out diverging              light model, and the explicit one on elements of 4 mm
    rail-fem study diverging --out diverging --quick      light model alone

The case of cases/nose_transfer.toml (worn P8, 1:10.75, facing) at 40 mph: through route, and diverging route in a curve
of 645 m (cant deficiency 76 mm) with check rails at several distances and angles of attack. Runs of the explicit model
lie in folders of their name: what is there is not run again.
"""

from pathlib import Path
from typing import Any

import numpy as np
import typer
from matplotlib.figure import Figure

from rail_fem.case.casefile import load_case
from rail_fem.case.examples import example
from rail_fem.models import rigid_hertz
from rail_fem.output.markdown import markdown_table
from rail_fem.output.result import PassResult
from rail_fem.settings.light import RigidHertzSettings
from rail_fem.show.style import CURVES, GREY, new_figure
from rail_fem.show.table_and_figure import write_table_and_figure
from rail_fem.studies.size_series import MODEL, faults_told, run_at

CASE = "nose_transfer"
ROUTE = "scene.diverging"
CURVE = {"radius": "645 m"}
LIGHT = {
    "start": "95 mm",
    "end": "500 mm",
    "degrees_of_freedom": "lateral_roll",
    "lateral_range": "8 mm",
    "path_spacing": "5 mm",
}
ROWS: dict[str, dict[str, Any]] = {
    "through route": {},
    "curve, no angle of attack, 41 mm": {ROUTE: CURVE | {"check_rail": "41 mm", "angle_of_attack": "0 mrad"}},
    "curve, 1 mrad, 41 mm": {ROUTE: CURVE | {"check_rail": "41 mm", "angle_of_attack": "1 mrad"}},
    "curve, 3 mrad, 41 mm": {ROUTE: CURVE | {"check_rail": "41 mm", "angle_of_attack": "3 mrad"}},
    "curve, 6 mrad, 41 mm": {ROUTE: CURVE | {"check_rail": "41 mm", "angle_of_attack": "6 mrad"}},
    "curve, 3 mrad, 38 mm": {ROUTE: CURVE | {"check_rail": "38 mm", "angle_of_attack": "3 mrad"}},
    "curve, 3 mrad, 44 mm": {ROUTE: CURVE | {"check_rail": "44 mm", "angle_of_attack": "3 mrad"}},
}
EXPLICIT = ("through route", "curve, 3 mrad, 41 mm")
EXPLICIT_WINDOW = {
    f"run.{MODEL}.start": "250 mm",
    f"run.{MODEL}.end": "430 mm",
    f"run.{MODEL}.element_aspect": 1.0,
    f"run.{MODEL}.wheel_element_ratio": 1.0,
    f"run.{MODEL}.window_ahead": "60 mm",
    f"run.{MODEL}.window_behind": "60 mm",
}
HEAD = [
    "route, angle of attack, check rail's flangeway",
    "model",
    "at the start: across [mm]",
    "check rail [kN]",
    "largest check rail force [kN]",
    "nose carries from x [mm]",
    "largest force [kN] at x [mm]",
    "PEEQ, worst 5 x 5 x 3 mm of the nose [%]",
]


def light(name: str) -> PassResult:
    """A row by rigid_hertz. Errors: CaseError, ValueError."""
    case = load_case(example(CASE), {"scene.speed": "40 mph", "run": {"rigid_hertz": dict(LIGHT)}, **ROWS[name]})
    return rigid_hertz.solve(case.scene, case.settings(RigidHertzSettings))


def explicit(name: str, size: float, out: Path) -> PassResult:
    """A row by fe_full, elements of `size` [m], in out/name-size. Collective. Errors: as of `run_at`."""
    folder = out / f"{name.replace(',', '').replace(' ', '_')}-{1e3 * size:g}mm"
    return run_at(
        example(CASE), {"scene.speed": "40 mph", **EXPLICIT_WINDOW, **ROWS[name]}, size, folder, lambda _: None
    )


def cells(name: str, result: PassResult) -> list[str]:
    """Of HEAD."""
    h = result.history
    show = lambda value, factor=1e-3: "-" if not np.isfinite(value) else f"{factor * value:.1f}"
    across, check = h["wheel_lateral"], h["force_check"]
    nose = np.flatnonzero(h["force_nose"] > h["force_wing"])
    strain = result.metal.get("nose")
    return [
        name,
        result.model,
        "-" if np.isnan(across[0]) else f"{1e3 * across[0]:.2f}",
        show(check[0]),
        show(check.max()),
        f"{1e3 * h['x'][nose[0]]:.0f}" if len(nose) else "-",
        f"{result.peaks['largest_force'].value / 1e3:.1f} at {1e3 * result.peaks['largest_force'].x:.0f}",
        "-" if strain is None else f"{100 * strain['values']['block']:.1f}",
    ]


def table(rows: list[tuple[str, PassResult]]) -> str:
    """Markdown: a row a pass and model."""
    return "\n".join(markdown_table(HEAD, [cells(*row) for row in rows]))


def figure(rows: list[tuple[str, PassResult]]) -> Figure:
    """Wheel force, check rail force and lateral position over x: light model in lines, explicit model dashed."""
    drawn = new_figure(11.0)
    panels = drawn.subplots(3, 1, sharex=True)
    names = list(dict.fromkeys(name for name, _ in rows))
    colour = {name: GREY if name == "through route" else CURVES[k % len(CURVES)] for k, name in enumerate(names)}
    for name, result in rows:
        is_light = result.model == "rigid_hertz"
        style = {"color": colour[name], "lw": 1.6 if is_light else 1.2, "ls": "-" if is_light else "--"}
        x = 1e3 * result.history["x"]
        for axes, column, factor in zip(panels, ("force", "force_check", "wheel_lateral"), (1e-3, 1e-3, 1e3)):
            axes.plot(x, factor * result.history[column], **style, label=name if is_light else f"{name}: {MODEL}")
    panels[0].set(ylabel="force on the wheel\non the crossing [kN]")
    panels[1].set(ylabel="force of the check rail\non the other wheel [kN]")
    panels[2].set(
        ylabel="wheelset to the outside [mm]", xlabel="position x of the wheel [mm]  (it runs to the right →)"
    )
    panels[0].legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    drawn.suptitle("Diverging route at 40 mph, R 645 m, 1:10.75, worn P8: angle of attack and check rail's flangeway")
    return drawn


def main(
    out: Path = typer.Option(Path("diverging"), help="folder of the explicit runs, of diverging.md and .png"),
    size: float = typer.Option(4.0, help="element size of the explicit model [mm]", min=1, max=6),
    quick: bool = typer.Option(False, help="the light model alone, two rows"),
) -> None:
    """The diverging route at 40 mph by the light and the explicit model."""
    names = list(EXPLICIT) if quick else list(ROWS)
    rows = [(name, light(name)) for name in names]
    if not quick:
        with faults_told():
            rows += [(name, explicit(name, 1e-3 * size, out)) for name in EXPLICIT]
    text = table(rows)
    typer.echo(text)
    write_table_and_figure(out / "diverging.md", text, out / "diverging.png", lambda: figure(rows))


if __name__ == "__main__":
    typer.run(main)
