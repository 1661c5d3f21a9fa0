"""What a damage study found, in numbers: bands over the laws, errors, T gamma, fatigue, years."""

from __future__ import annotations

from typing import Any

import numpy as np

from rail_fem.damage.evolution import Evolution
from rail_fem.damage.fatigue import shakedown_point
from rail_fem.damage.heat import flash_temperature
from rail_fem.damage.section import Section, WearRate
from rail_fem.damage.sites import fatigue_of, laws_of
from rail_fem.damage.traffic import life
from rail_fem.damage.wear import Archard, specific_wear
from rail_fem.scene.scene import Scene
from rail_fem.settings.damage import DamageSettings


def section_summary(
    scene: Scene, settings: DamageSettings, section: Section, state: Evolution, before: WearRate, after: WearRate
) -> dict[str, Any]:
    """Numbers of a section that has worn [SI]."""
    model = fatigue_of(settings)
    points = [(r.passing.weight, p) for r in before.records for p in r.points if p.side == "left"]
    crack = sum(weight * float(model.damage(p.tgamma)) for weight, p in points)
    bands = {name: float(depth.max()) for name, depth in state.by_law.items()}
    removed = float((state.depth * state.first.widths).sum())
    deepest = float(state.depth.max())
    return {
        "site": "switch",
        "passes": state.passes,
        "law": settings.law,
        "deepest": deepest,
        "deepest_by_law": bands,
        "area_by_law": {name: float((d * state.first.widths).sum()) for name, d in state.by_law.items()},
        "area_of_strips": state.area,
        "area_beyond": state.beyond,
        "area_removed": removed,
        "blocks": len(state.log),
        "block_error": state.block_error,
        "smoothing_change": state.smoothing / deepest if deepest > 0 else 0.0,
        "area_correction": state.correction,
        "border_share": before.border_share,
        "tgamma": {"largest": max((p.tgamma for _, p in points), default=0.0)} | _end_tgamma(after),
        "contacts": [_contact(weight, p, p.position, section, settings, model) for weight, p in points],
        "years": _years(settings, deepest / max(state.passes, 1.0), crack, bands, deepest, state.passes),
    }


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


def crossing_summary(scene: Scene, settings: DamageSettings, field, kept) -> dict[str, Any]:
    """Numbers of one mean pass over a crossing, times the passes [SI]; the shape stays what it was."""
    model, laws = fatigue_of(settings), laws_of(settings)
    bodies = {}
    for body in ("wing", "nose"):
        rows = [(share, c) for share, _, contacts in kept for c in contacts if c.body == body]
        if not rows:
            continue
        largest = max(rows, key=lambda row: row[1].tgamma)[1]
        crack = _crack_per_pass(kept, body, model)
        depth = {name: float(parts[body].max()) * settings.passes for name, parts in field.depth.items()}
        lead = depth[settings.law]
        bodies[body] = {
            "deepest_by_law": depth,
            "volume_by_law": {
                name: float(parts[body].sum()) * (field.x[1] - field.x[0]) * (field.y[1] - field.y[0]) * settings.passes
                for name, parts in field.depth.items()
            },
            "largest_tgamma": largest.tgamma,
            "at": float(largest.position[0]),
            "region": model.region(largest.tgamma),
            "largest_pressure": float(max(c.patch.max_pressure for _, c in rows)),
            "seizure_share": _seizure_share([c for _, c in rows], settings),
            "enlarged_share": float(np.mean([c.enlarged > 1 for _, c in rows])),
            "cracks_per_pass": float(crack[1].max()),
            "cracks_at": float(crack[0][np.argmax(crack[1])]),
            "flash_temperature": float(flash_temperature(largest.patch, largest.speed).max()),
            "years": _years(settings, lead / max(settings.passes, 1.0), crack[1].max(), depth, lead, settings.passes),
        }
    any_patch = kept[0][2][0]
    return {
        "site": "crossing",
        "passes": settings.passes,
        "law": settings.law,
        "kinds": len(kept),
        "bodies": bodies,
        "specific_wear": {name: specific_wear(law, any_patch.patch, any_patch.speed) for name, law in laws.items()},
        "transfer": [result.transfer_x for _, result, _ in kept],
    }


def _seizure_share(contacts, settings: DamageSettings) -> float:
    """Part of Archard's wear from cells that press more than the map's last border of pressure."""
    law = Archard(settings.hardness)
    all_of_it, seized = 0.0, 0.0
    for c in contacts:
        depth = law.cells(c.patch, c.speed)
        all_of_it += depth.sum() * c.patch.grid.dy
        seized += depth[c.patch.pressure > law.wear_map.pressure[-1] * law.hardness].sum() * c.patch.grid.dy
    return seized / all_of_it if all_of_it > 0 else 0.0


def _crack_per_pass(kept, body: str, model) -> tuple[np.ndarray, np.ndarray]:
    """Damage of one mean pass along x: positions [m] of 5 mm, and the sum over kinds of the largest in each."""
    edges = np.arange(-2.0, 3.0, 5e-3)
    total = np.zeros(len(edges))
    for share, _, contacts in kept:
        own = np.full(len(edges), -np.inf)
        for c in contacts:
            if c.body == body:
                k = int(np.searchsorted(edges, c.position[0]))
                own[k] = max(own[k], float(model.damage(c.tgamma)))
        total += share * np.where(np.isfinite(own), own, 0.0)
    return edges, total


def _years(settings, per_pass: float, crack: float, bands: dict[str, float], deepest: float, passes: float):
    """Time to the depth limit and to cracks, for the leading law and for the ends of the band."""
    axles = settings.axles_per_year
    scale = lambda depth: depth / max(passes, 1.0) * axles
    found = {name: life(scale(d), 0.0, settings.depth_limit).years for name, d in bands.items()}
    lead = life(per_pass * axles, max(crack, 0.0) * axles, settings.depth_limit)
    return {
        "depth_per_year": per_pass * axles,
        "cracks_per_year": crack * axles,
        "to_limit": lead.years,
        "limit": lead.reached,
        "to_depth_by_law": found,
    }
