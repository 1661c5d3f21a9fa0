"""What a source gives for each case beside ours: the P2 force of the thesis' table 7-5 beside our formula and the peaks
of our models, the leg of passes over the whole crossing beside every model; and such passes beside those of another
sweep of the same cases."""

from rail_fem.files.markdown import markdown_table, table_of
from rail_fem.hierarchy import MODELS
from rail_fem.passes.dip import trajectory_dip
from rail_fem.passes.p2 import p2_force, p2_increment, unsprung_mass
from rail_fem.result.events import leg_flight
from rail_fem.result.result import PassResult
from rail_fem.result.runfolder import differences
from rail_fem.scene.scene import Scene
from rail_fem.sweeps.compare import FIRST_IMPACT, IMPACT, peak
from rail_fem.sweeps.sweep_report import FORCES, Results, forces_of, parts_of, shown
from rail_fem.sweeps.trends import MEASURES, Published, knows_leg


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


def leg_table(rows: tuple[Published, ...], results: Results) -> list[str]:
    """Markdown: a row for each case whose pass runs over the leg; nothing without such."""
    over = {
        case: mine
        for case, of_case in results.items()
        if (mine := {model: of_case[model] for model in MODELS if model in of_case and knows_leg(of_case[model])})
    }
    models = [model for model in MODELS if any(model in mine for mine in over.values())]
    if not models:
        return []
    published = {row.case: row for row in rows}
    head = ["case", "published: force [kN], PEEQ [%]"]
    head += [f"{model}: force [kN] at x [mm]; flight [mm], [ms], launch [m/s]" for model in models]
    head += ["PEEQ of 1000 mm3; of 5 x 5 x 3 mm; largest of an element, at x [mm] [%]"]
    table = []
    for case, mine in over.items():
        passes = [leg_words(mine[model]) if model in mine else "-" for model in models]
        table.append([case, published_words(published.get(case)), *passes, leg_strain(list(mine.values())[-1])])
    return markdown_table(head, table)


def published_words(row: Published | None) -> str:
    values = (None,) * 2 if row is None else (row.leg_force, row.leg_strain)
    return "-" if set(values) == {None} else ", ".join("-" if value is None else f"{value:g}" for value in values)


def leg_words(result: PassResult) -> str:
    """Largest force and where, and the longest flight that begins on the leg."""
    flight = leg_flight(result)
    force = f"{shown(result, ('largest_force_leg',), 1e-3)} at {1e3 * result.peaks['largest_force_leg'].x:.0f}"
    if flight is None or not flight.length:
        return f"{force}; none"
    return f"{force}; {1e3 * flight.length:.0f}, {1e3 * flight.duration:.2f}, {flight.launch_speed:.2f}"


def leg_strain(result: PassResult) -> str:
    """Plastic strain of the leg; "-" where a model does not resolve it."""
    if "leg" not in result.metal:
        return "-"
    words = []
    for name in ("leg strain of 1000 mm3", "leg strain"):
        measure = MEASURES[name]
        bar = measure.factor * measure.bar(result)
        words.append(f"{measure.factor * measure.of(result):.1f}" + (f"±{bar:.1f}" if bar else ""))
    largest = result.metal["leg"]
    return f"{'; '.join(words)}; {100 * largest['maximum']:.1f} at {1e3 * largest['position'][0]:.0f}"


def beside_table(results: Results, others: Results, rows: tuple[Published, ...] = ()) -> list[str]:
    """Markdown: what a source gives of a case (`rows`) and what both sweeps have of it, by the most expensive model
    that both have run."""
    table = []
    parts, published = parts_of(results), {row.case: row for row in rows}
    for case, of_case in results.items():
        common = [model for model in MODELS if model in of_case and model in others.get(case, {})]
        if not common:
            continue
        row = [case, common[-1], *([printed_forces(published.get(case), parts)] if published else [])]
        for result in (of_case[common[-1]], others[case][common[-1]]):
            row += [forces_of(result, parts), transfer_words(result)]
        table.append(row)
    columns = [f"{FORCES} {'/'.join(parts)} [kN]", "transfer x [mm]"]
    head = ["case", "model", *([f"published: largest on {'/'.join(parts)} [kN]"] if published else []), *columns]
    return markdown_table([*head, *(f"{name}, beside" for name in columns)], table) if table else []


def printed_forces(row: Published | None, parts: tuple[str, ...]) -> str:
    """What a source gives for the largest force on each part [kN]."""
    given = {} if row is None else {"leg": row.leg_force, "nose": row.peak}
    return "/".join("-" if given.get(part) is None else f"{given[part]:g}" for part in parts)


def scenes_apart(results: Results, others: Results) -> str:
    """What the scenes of another sweep have otherwise, in every case of both; "" where they are the same."""
    both = [(results[case], others[case]) for case in results if case in others]
    scene = lambda of_case: next(iter(of_case.values())).scene.plain()
    apart = [differences(scene(theirs), scene(ours)) for ours, theirs in both]
    common = [line for line in apart[0] if all(line in lines for lines in apart)] if apart else []
    return "; ".join(line.replace(" in this case (SI)", " here") for line in common)


def transfer_words(result: PassResult) -> str:
    return "-" if result.transfer_x != result.transfer_x else f"{1e3 * result.transfer_x:.0f}"
