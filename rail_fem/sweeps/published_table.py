"""What a source gives for the P2 force of each case, beside the same by our formula and the peaks of our models: the
thesis' table 7-5."""

from rail_fem.files.markdown import table_of
from rail_fem.hierarchy import MODELS
from rail_fem.passes.dip import trajectory_dip
from rail_fem.passes.p2 import p2_force, p2_increment, unsprung_mass
from rail_fem.scene.scene import Scene
from rail_fem.sweeps.compare import FIRST_IMPACT, IMPACT, peak
from rail_fem.sweeps.sweep_report import Results
from rail_fem.sweeps.trends import Published


def published_table(rows: tuple[Published, ...], results: Results) -> list[str]:
    """Markdown: a row for each published case that the sweep has; nothing without rows."""
    models = [model for model in MODELS if any(model in of_case for of_case in results.values())]
    mine = [row for row in rows if row.case in results and None not in (row.dip, row.p2, row.peak)]
    if not mine or not models:
        return []
    moving = [model for model in models if model not in ("p2_formula", "lumped")]
    return table_of([published_row(row, results[row.case], moving) for row in mine])


def published_row(row: Published, results: dict, moving: list[str]) -> dict[str, str]:
    """Cells of one case: the published dip and force beside ours.

    results : by model;  moving : the models with a history, of which the most expensive is told
    """
    assert row.dip is not None and row.p2 is not None and row.peak is not None
    scene = next(iter(results.values())).scene
    ours = p2_of(scene, row.dip * 1e-3) / 1e3
    rigid = results["p2_formula"].trust["dip_angle"] if "p2_formula" in results else None
    dynamic = [trajectory_dip(results[model]).angle for model in moving[::-1] if model in results][:1]
    dips = [rigid, *dynamic]
    say = lambda values, factor, digits: ", ".join(
        "-" if v is None or v != v else f"{v * factor:.{digits}f}" for v in values
    )
    wanted = IMPACT, FIRST_IMPACT, ("largest_force_nose",)
    told = [results.get(model) for model in moving[-1:]]
    forces = ["-" if one is None else say([peak(one, *names) for names in wanted], 1e-3, 1) for one in told]
    impacts = "impact on the wheel, first on the nose, largest on nose [kN]"
    return {
        "case": row.case,
        "published 2a [mrad]": f"{row.dip:.2f}",
        "published P2 [kN]": f"{row.p2:.2f}",
        "our P2 with that 2a [kN]": f"{ours:.2f}",
        "our 2a: rigid path, trajectory [mrad]": say(dips, 1e3, 2),
        "our P2: rigid path, trajectory [kN]": say([None if d is None else p2_of(scene, d) for d in dips], 1e-3, 1),
        "published FE peak [kN]": f"{row.peak:.2f}",
        **{f"{model}: {impacts}": cell for model, cell in zip(moving[-1:], forces)},
    }


def p2_of(scene: Scene, dip: float) -> float:
    """P2 [N] as table 7-5 has it, for a dip angle [rad]."""
    increment = p2_increment(
        dip, scene.speed, unsprung_mass(scene, "wheelset"), scene.foundation.track_mass, scene.foundation.stiffness
    )
    return p2_force(scene.static_wheel_load, increment)
