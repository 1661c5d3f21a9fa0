"""What a section that has worn shows, in numbers: bands over the laws, errors, T gamma, fatigue, years."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rail_fem.damage.crossing_site import CrossingRate
from rail_fem.damage.evolution import Evolution
from rail_fem.damage.fatigue import shakedown_point
from rail_fem.damage.heat import flash_temperature
from rail_fem.damage.rolling import RollingPoint
from rail_fem.damage.section import Section, WearRate
from rail_fem.damage.sites import fatigue_of, maintenance_of, subsurface_of
from rail_fem.damage.traffic import EXTRAPOLATED, Event, life
from rail_fem.damage.wear import Archard
from rail_fem.scene.scene import Scene
from rail_fem.settings.damage import DamageSettings


def section_summary(
    scene: Scene, settings: DamageSettings, section: Section, state: Evolution, before: WearRate, after: WearRate
) -> dict[str, Any]:
    """Numbers of a section that has worn [SI]."""
    model = fatigue_of(settings)
    points = [(r.passing.weight, p) for r in before.records for p in r.points if p.side == "left"]
    hardest = max((p for _, p in points), key=lambda p: p.normal_force, default=None)
    last = [(r.passing.weight, p) for r in after.records for p in r.points if p.side == "left"]
    cracks = crack_facts(state.crack, after.crack)
    bands = {name: float(depth.max()) for name, depth in state.by_law.items()}
    removed = float((state.depth * state.first.widths).sum())
    deepest = float(state.depth.max())
    return {
        "site": "switch",
        "passes": state.passes,
        "law": settings.law,
        "resets": state.resets,
        "height_ground_off": state.lost,
        "deepest": deepest,
        "deepest_by_law": bands,
        "area_by_law": {name: float((d * state.first.widths).sum()) for name, d in state.by_law.items()},
        "area_of_strips": state.removed,
        "area_beyond": state.beyond,
        "area_removed": removed,
        "blocks": len(state.log),
        "shortest_block": shortest_block(state),
        "block_error": state.block_error,
        "smoothing_change": state.smoothing / deepest if deepest > 0 else 0.0,
        "area_correction": state.correction,
        "border_share": before.border_share,
        "tgamma": {"largest": max((p.tgamma for _, p in points), default=0.0)} | _end_tgamma(after),
        "subsurface": None if hardest is None else subsurface_of(hardest.patch, settings),
        "contacts": [_contact(weight, p, p.position, section, settings, model) for weight, p in points],
        "seizure_share": seized_share(settings, last),
        **cracks,
        **{name: state.first.points[cracks[name]].tolist() for name in ("crack_index_at", "cracks_at")},
        "years": years_of(
            settings,
            state,
            state.by_law | {settings.law: state.depth},
            end_rates(settings, state, after),
            (state.crack, after.crack),
        ),
    }


def shortest_block(state: Evolution) -> float:
    """Passes of the shortest of all blocks but the last, which ends with the study; the only one's, 0 without any."""
    lengths = np.diff(state.log[:, 0], prepend=0.0)
    return float(lengths[:-1].min()) if len(lengths) > 1 else float(lengths.sum())


def _end_tgamma(after: WearRate) -> dict[str, float]:
    found = [p.tgamma for r in after.records for p in r.points if p.side == "left"]
    return {"largest_at_end": max(found, default=0.0)}


def _contact(weight, point, position, section, settings, model) -> dict[str, Any]:
    shaken = shakedown_point(point.patch, settings.shear_yield)
    return {
        "weight": weight,
        "position": [float(v) for v in position],
        "normal_force": float(point.patch.normal_force),
        "largest_pressure": float(point.patch.max_pressure),
        "angle": point.angle,
        "tgamma": point.tgamma,
        "friction_power": point.patch.frictional_power,
        "region": model.region(point.tgamma),
        "load_factor": shaken.load,
        "traction": shaken.traction,
        "fatigue_index": shaken.index,
        "flash_temperature": float(flash_temperature(point.patch, point.speed).max()),
    }


def seized_share(settings: DamageSettings, patches: Sequence[tuple[float, RollingPoint]]) -> float:
    """Of the wear by Archard's map of patches, each with its weight, what comes from cells in seizure."""
    law = Archard(settings.hardness)
    cells = [(weight * p.patch.grid.dy * law.cells(p.patch, p.speed), law.seized(p.patch)) for weight, p in patches]
    total = sum(float(depth.sum()) for depth, _ in cells)
    return sum(float(depth[there].sum()) for depth, there in cells) / total if total > 0 else 0.0


def end_rates(settings: DamageSettings, state: Evolution, after: WearRate | CrossingRate) -> dict[str, np.ndarray]:
    """What a mean pass wears off the last shape by each law, the leading one's as it changes the shape (...) [m]."""
    lead = state.worn.smoothed(after.depth[settings.law], settings.smoothing)
    return {**after.depth, settings.law: lead}


def crack_facts(index: np.ndarray, rate: np.ndarray) -> dict[str, Any]:
    """Of cracks where they fall (...): the largest index so far and its place, the largest growth by a pass over the
    last shape and its place, each a flat number of the arrays."""
    worst, fastest = int(np.argmax(index)), int(np.argmax(rate))
    return {
        "crack_index": float(index.flat[worst]),
        "crack_index_at": worst,
        "cracks_per_pass": max(float(rate.flat[fastest]), 0.0),
        "cracks_at": fastest,
    }


def years_of(
    settings: DamageSettings,
    state: Evolution,
    depths: dict[str, np.ndarray],
    rates: dict[str, np.ndarray],
    cracks: tuple[np.ndarray, np.ndarray],
) -> dict[str, Any]:
    """Time to the depth limit and to cracks by what a pass does to the last shape, at the place that comes first, for
    the leading law with and without the maintenance that the case plans, and for every law without.

    depths, rates : law -> (...) worn off so far, and by a pass over the last shape [m];  cracks : index so far and its
    growth (...)
    None where it is not told: without a calibration, after one pass or none, and beyond EXTRAPOLATED times the passes.
    """
    axles, run = settings.axles_per_year, state.passes - state.began
    now, horizon = state.passes / axles, (state.began + EXTRAPOLATED * run) / axles
    told = settings.calibration is not None and run > 1
    events = maintenance_of(settings)[int(state.resets) :]

    def first(at: np.ndarray, rate: np.ndarray, limit: float) -> tuple[float, float]:
        """Rate [1/year] and state at the place that reaches the limit first."""
        k = int(np.argmax(rate / np.maximum(limit - at, 1e-30)))
        return max(float(rate.flat[k]), 0.0) * axles, float(at.flat[k])

    def reached(law: str, crack: tuple[float, float], planned: Sequence[Event] = ()) -> tuple[float | None, str]:
        rate, depth = first(state.lost + depths[law], rates[law], settings.depth_limit)
        found = life(rate, crack[0], settings.depth_limit, planned, horizon, (now, depth, crack[1]))
        return (found.years, found.reached) if told and found.reached else (None, "")

    crack = first(*cracks, 1.0)
    alone, kept = reached(settings.law, crack), reached(settings.law, crack, events)
    rate, _ = first(state.lost + depths[settings.law], rates[settings.law], settings.depth_limit)
    return {
        "depth_per_year": rate,
        "cracks_per_year": crack[0],
        "told_up_to": horizon if told else None,
        "to_limit": alone[0],
        "limit": alone[1],
        "to_limit_maintained": kept[0],
        "limit_maintained": kept[1],
        "to_depth_by_law": {law: reached(law, (0.0, 0.0))[0] for law in depths},
    }
