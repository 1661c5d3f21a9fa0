"""What a section that has worn shows, in numbers: bands over the laws, errors, T gamma, fatigue, years."""

from __future__ import annotations

from typing import Any

import numpy as np

from rail_fem.damage.evolution import Evolution
from rail_fem.damage.fatigue import shakedown_point
from rail_fem.damage.heat import flash_temperature
from rail_fem.damage.section import Section, WearRate
from rail_fem.damage.sites import fatigue_of, maintenance_of, subsurface_of
from rail_fem.damage.traffic import life
from rail_fem.scene.scene import Scene
from rail_fem.settings.damage import DamageSettings


def section_summary(
    scene: Scene, settings: DamageSettings, section: Section, state: Evolution, before: WearRate, after: WearRate
) -> dict[str, Any]:
    """Numbers of a section that has worn [SI]."""
    model = fatigue_of(settings)
    points = [(r.passing.weight, p) for r in before.records for p in r.points if p.side == "left"]
    hardest = max((p for _, p in points), key=lambda p: p.normal_force, default=None)
    crack = sum(weight * float(model.damage(p.tgamma)) for weight, p in points)
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
        "years": years_of(settings, state, crack, bands | {settings.law: deepest}),
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


def years_of(settings: DamageSettings, state: Evolution, crack: float, bands: dict[str, float]) -> dict[str, Any]:
    """Time to the depth limit and to cracks at the mean rate since the last grinding or welding, for the leading law
    with and without those that the case plans, and for every law without."""
    axles, passes = settings.axles_per_year, state.passes - state.began
    scale = lambda depth: depth / max(passes, 1.0) * axles
    rates = scale(bands[settings.law]), max(crack, 0.0) * axles
    found = {name: life(scale(d), 0.0, settings.depth_limit).years for name, d in bands.items()}
    alone = life(*rates, settings.depth_limit)
    kept = life(*rates, settings.depth_limit, maintenance_of(settings))
    return {
        "depth_per_year": rates[0],
        "cracks_per_year": crack * axles,
        "to_limit": alone.years,
        "limit": alone.reached,
        "to_limit_maintained": kept.years,
        "limit_maintained": kept.reached,
        "to_depth_by_law": found,
    }
