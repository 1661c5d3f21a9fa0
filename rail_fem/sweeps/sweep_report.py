"""The table of a sweep: every case by every model."""

import itertools
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from rail_fem.case.casefile import load_case
from rail_fem.files.markdown import table_of
from rail_fem.hierarchy import MODELS
from rail_fem.result.events import stated_peaks
from rail_fem.result.quantities import REPORTED
from rail_fem.result.result import NAN, PassResult, load
from rail_fem.result.runfolder import differences
from rail_fem.result.trust import verdict_words
from rail_fem.sweeps.compare import FIRST_IMPACT, IMPACT, core_seconds
from rail_fem.sweeps.sweep import ELSEWHERE, FAILED, Outcome
from rail_fem.sweeps.trends import CaseChanges

FORCES = "impact on the wheel, first on the body taking over; largest on"  # of `forces_of`

UNFINISHED = FAILED, ELSEWHERE
Results = dict[str, dict[str, PassResult]]  # case -> model -> result


def sweep_report(outcomes: list[Outcome], errors: list[str]) -> str:
    """Markdown: forces and strains of each case and model, then what failed."""
    results: Results = {}
    for outcome in outcomes:
        if outcome.has_result:
            results.setdefault(outcome.job.case.name, {})[outcome.job.model] = outcome.result
    return "\n".join(["# Sweep", "", *force_table(results), "", *failures(outcomes, errors)]).rstrip() + "\n"


def results_below(
    folder: Path,
    cases: Path | None = None,
    changes: CaseChanges | None = None,
    known: Mapping[Path, PassResult] | None = None,
) -> tuple[Results, list[str]]:
    """Results of a sweep's folder DIR/CASE/MODEL by case, and a sentence on each that cannot be used.

    cases : folder of the case files; results of another scene than that of cases/CASE.toml, where there is one, are
        left out;  changes : that the sweep has made in these files;  known : folder -> what was read from it
    Errors: FileNotFoundError without any result, CaseError for a case file that cannot be read.
    """
    results: Results = {}
    unusable = []
    for path in sorted(Path(folder).glob("*/*/result.json")):
        try:
            result = (known or {}).get(path.parent) or load(path.parent)
        except (ValueError, KeyError, TypeError) as error:
            unusable.append(f"{path.parent}: written by another version of scene or result: {error}")
            continue
        if result.fault:
            unusable.append(f"{path.parent}: failed: {result.fault}")
        elif unlike := _unlike_case(result, cases, path.parent.parent.name, changes):
            unusable.append(
                f"{path.parent}: of another scene than its case file: {'; '.join(unlike[:5])}: give 'report' the --set"
                " of the sweep, or state the change in the groups file; a file that was changed since is swept into"
                " another folder"
            )
        else:
            results.setdefault(path.parent.parent.name, {})[result.model] = result
    if not results:
        more = f"; and {len(unusable) - 1} more" if len(unusable) > 1 else ""
        why = unusable[0] + more if unusable else f"run 'rail-fem sweep CASE... --out {folder}' first"
        raise FileNotFoundError(f"{folder}: no results in CASE/MODEL below it that can be used: {why}")
    return results, unusable


def _unlike_case(result: PassResult, cases: Path | None, name: str, changes: CaseChanges | None) -> list[str]:
    """How a result's scene differs from that of its case file; nothing where there is no such file."""
    file = None if cases is None else Path(cases) / f"{name}.toml"
    if file is None or not file.is_file():
        return []
    return differences(result.scene.plain(), load_case(file, changes.of(name) if changes else None).scene.plain())


def force_table(results: Results) -> list[str]:
    """A row for each case: static load, forces by each model [kN], plastic strain [%], transfer position [mm], core
    seconds; of the most expensive model the element size, bold where most cases have another, and its trust report's
    verdict. The leg stands before wing and nose where any pass runs over it."""
    models = [model for model in MODELS if any(model in of_case for of_case in results.values())]
    if not models:
        return ["No results."]
    parts = parts_of(results)
    named = "/".join(parts)
    rows, usual = [], usual_size(results)
    for case, by_model in results.items():
        last = by_model[[model for model in models if model in by_model][-1]]
        forces = {model: forces_of(by_model[model], parts) if model in by_model else "-" for model in models}
        load = f"{last.scene.axle_load / 1e3:.4g}; {last.scene.static_wheel_load / 1e3:.2f}"
        rows.append(
            {
                "case": case,
                "axle load [t]; static wheel load [kN]": load,
                **{f"{model}: {FORCES} {named} [kN]": cell for model, cell in forces.items()},
                f"PEEQ {named}: mean of 5 x 5 x 3 mm; largest of an element [%]": strains_of(last, parts),
                "transfer x [mm]": "-" if np.isnan(last.transfer_x) else f"{last.transfer_x * 1e3:.0f}",
                "core seconds": f"{sum(map(core_seconds, by_model.values())):.1f}",
                "elements [mm]": size_of(last, usual),
                "trust report": verdict_words(last.trust) or "-",
            }
        )
    return table_of(rows)


def usual_size(results: Results) -> float:
    """Element size of most explicit results [m]; NaN without any."""
    sizes = [size for of_case in results.values() for r in of_case.values() if (size := r.settings.get("element_size"))]
    return max(sizes, key=sizes.count) if sizes else NAN


def size_of(result: PassResult, usual: float) -> str:
    """Element size in mm, bold where it is not the usual one."""
    size = result.settings.get("element_size")
    return "-" if not size else f"{size * 1e3:g}" if size == usual else f"**{size * 1e3:g}**"


def parts_of(results: Results) -> tuple[str, ...]:
    """Of the crossing, in the order in which a facing wheel comes to them: the leg only where a model knows it apart
    from the wing."""
    apart = lambda r: "largest_force_leg" in r.peaks and "largest_force_wing" in r.peaks
    over_leg = any(apart(result) for of_case in results.values() for result in of_case.values())
    return ("leg", "wing", "nose") if over_leg else ("wing", "nose")


def forces_of(result: PassResult, parts: tuple[str, ...]) -> str:
    """Impact on the wheel, its first share on the body taking over; largest force on each part [kN]; where a model
    knows no bodies, that on the whole wheel."""
    impact, wheel = shown(result, IMPACT, 1e-3), shown(result, ("largest_force",), 1e-3)
    own = [shown(result, (f"largest_force_{part}",), 1e-3) for part in parts]
    if own[-2:] == ["-", "-"]:
        told = f"{impact} (P2)" if "p2" in result.peaks else impact
        return told if wheel == "-" else f"{wheel} (wheel)"
    return f"{impact}, {shown(result, FIRST_IMPACT, 1e-3)}; {'/'.join(own)}"


def strains_of(result: PassResult, parts: tuple[str, ...]) -> str:
    """Mean of the worst block of each part; largest value of an element, with the element's size [%, mm]."""
    means = [REPORTED[f"block_{part}"].of(result) for part in parts]
    blocks = [
        "-" if np.isnan(mean) else f"{100 * mean:.1f}" + _bar(result, f"block_{part}", 100.0)
        for part, mean in zip(parts, means)
    ]
    largest = [shown(result, (f"plastic_strain_{part}",), 100.0) for part in parts]
    if set(blocks) | set(largest) == {"-"}:
        return "-"
    sizes = [result.metal[part]["size"] for part in parts if part in result.metal]
    return f"{'/'.join(blocks)}; {'/'.join(largest)}" + (f" (of {1e3 * max(sizes):.1f} mm)" if sizes else "")


def _bar(result: PassResult, name: str, factor: float) -> str:
    """The error bar of a reported quantity in shown units, where the run claims one."""
    bar = result.error_bars.get(name, np.nan) * factor
    return "" if np.isnan(bar) else f"±{bar:.1f}"


def shown(result: PassResult, names: tuple[str, ...], factor: float) -> str:
    """A peak in shown units with its error bar where it has one, "-" where it is not resolved."""
    peaks = stated_peaks(result)
    name = next((name for name in names if name in peaks), "")
    return f"{peaks[name].value * factor:.1f}" + _bar(result, name, factor) if name else "-"


def failures(outcomes: list[Outcome], errors: list[str]) -> list[str]:
    """Lines on runs that failed or go on elsewhere and case files that could not be read."""
    told = [[f"- {o.job.case.name} {o.job.model}: {o.reason}" for o in outcomes if o.state == s] for s in UNFINISHED]
    told.append([f"- left out: {error.splitlines()[0]}" for error in errors])
    if not any(told):
        return ["All runs finished."]
    failed, elsewhere, left_out = map(len, told)
    others = f"{elsewhere} {ELSEWHERE}, " if elsewhere else ""
    return [f"{failed} run(s) failed, {others}{left_out} case file(s) left out", *itertools.chain(*told)]
