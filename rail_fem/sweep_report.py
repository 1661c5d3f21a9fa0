"""The table of a sweep: every case by every rung, and how the rungs stand to the dearest one."""

from __future__ import annotations

import numpy as np

from rail_fem.compare import NOSE_PEAKS, peak
from rail_fem.ladder import LADDER
from rail_fem.result import NAN, PassResult
from rail_fem.sweep import FAILED, Outcome, finished_results


def sweep_report(outcomes: list[Outcome], faults: list[str]) -> str:
    """Markdown: forces and strains of each case and rung, then what failed."""
    results = finished_results(outcomes)
    lines = ["# Sweep", "", *force_table(results), "", *failures(outcomes, faults)]
    return "\n".join(lines).rstrip() + "\n"


def force_table(results: dict[str, dict[str, PassResult]]) -> list[str]:
    """A row for each case: static load, peak on wing and nose by each rung [kN], plastic strain [%], transfer place [mm], core seconds."""
    rungs = [model for model in LADDER if any(model in of_case for of_case in results.values())]
    if not rungs:
        return ["No results."]
    head = ["case", "static load [kN]", *(f"{model}: wing / nose [kN]" for model in rungs), "PEEQ wing / nose [%]", "transfer x [mm]", "core seconds"]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for case, by_model in results.items():
        last = by_model[[model for model in rungs if model in by_model][-1]]
        forces = [_pair(by_model.get(model), ("force_wing",), NOSE_PEAKS, 1e-3) for model in rungs]
        strains = _pair(last, ("plastic_strain_wing",), ("plastic_strain_nose",), 100.0)
        place = "-" if np.isnan(last.transfer_x) else f"{last.transfer_x * 1e3:.0f}"
        cost = sum(r.cost.wall_time * r.cost.ranks for r in by_model.values())
        lines.append("| " + " | ".join([case, f"{last.scene.static_wheel_load / 1e3:.2f}", *forces, strains, place, f"{cost:.1f}"]) + " |")
    return lines


def _pair(result: PassResult | None, first: tuple[str, ...], second: tuple[str, ...], factor: float) -> str:
    """Two peaks in shown units; where a rung resolves neither force, that on the whole wheel."""
    values = (NAN, NAN) if result is None else (peak(result, *first), peak(result, *second))
    if not np.isnan(values).all():
        return " / ".join("-" if np.isnan(value) else f"{value * factor:.1f}" for value in values)
    if second == NOSE_PEAKS and result is not None and "force" in result.peaks:
        return f"{peak(result, 'force') * factor:.1f} (wheel)"
    return "-"


def failures(outcomes: list[Outcome], faults: list[str]) -> list[str]:
    failed = [f"- {o.job.case.path.stem} {o.job.model}: {o.reason}" for o in outcomes if o.state == FAILED]
    left_out = [f"- left out: {fault.splitlines()[0]}" for fault in faults]
    return [f"{len(failed)} run(s) failed, {len(left_out)} case file(s) left out", *failed, *left_out] if failed or left_out else ["All runs finished."]
