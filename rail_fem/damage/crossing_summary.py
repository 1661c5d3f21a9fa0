"""What a crossing that has worn shows, in numbers: bands over the laws, errors, forces, T gamma, fatigue, years."""

from __future__ import annotations

from typing import Any

import numpy as np

from geometry.surfaces.bodies import BODIES
from rail_fem.damage.crossing_site import CrossingRate
from rail_fem.damage.evolution import Evolution
from rail_fem.damage.sites import fatigue_of, subsurface_of
from rail_fem.damage.summary import crack_facts, end_rates, years_of
from rail_fem.damage.wheel_wear import wheel_lines
from rail_fem.damage.worn_surface import STEEPEST
from rail_fem.settings.damage import DamageSettings


def crossing_summary(
    settings: DamageSettings, state: Evolution, before: CrossingRate, after: CrossingRate
) -> dict[str, Any]:
    """Numbers of a crossing that has worn [SI]."""
    deepest = state.deepest
    lost, strips = state.worn.volume - state.first.volume, state.removed - state.beyond
    rates = end_rates(settings, state, after)
    parts = {body: _body(settings, state, before, after, rates, b) for b, body in enumerate(BODIES)}
    return {
        "site": "crossing",
        "passes": state.passes,
        "law": settings.law,
        "resets": state.resets,
        "height_ground_off": state.lost,
        "kinds": len(before.kinds),
        "deepest": deepest,
        "bodies": {body: found for body, found in parts.items() if found},
        "blocks": len(state.log),
        "block_error": state.block_error,
        "smoothing_change": state.smoothing / deepest if deepest > 0 else 0.0,
        "spread": state.worn.spread,
        "volume_of_strips": state.removed,
        "volume_beyond": state.beyond,
        "volume_removed": lost,
        "volume_error": abs(lost - strips) / strips if strips > 0 else 0.0,
        "steep_share": _steep_share(before),
        "largest_force": {"first": before.largest_force, "end": after.largest_force},
        "wheels": _wheels(settings, state, before),
        "impacts": {"first": _impacts(before), "end": _impacts(after)},
        "transfer": {"first": _transfers(before), "end": _transfers(after)},
    }


def _body(
    settings, state: Evolution, before: CrossingRate, after: CrossingRate, rates: dict[str, np.ndarray], b: int
) -> dict[str, Any] | None:
    model = fatigue_of(settings)
    first = [(share, own.facts.of(b)) for share, own in before.kinds]
    if not any(len(facts.x) for _, facts in first):
        return None
    depth = {name: float(own[b].max()) for name, own in state.by_law.items()}
    depth[settings.law] = float(state.depth[b].max())
    _, i, j = np.unravel_index(int(np.argmax(state.depth[b : b + 1])), (1, *state.depth.shape[1:]))
    cell = state.worn.cell
    hardest = max((facts for _, facts in first if len(facts.x)), key=lambda facts: facts.tgamma.max())
    k = int(np.argmax(hardest.tgamma))
    cracks, place = crack_facts(state.crack[b], after.crack[b]), (state.worn.x, state.worn.y)
    at = lambda flat: [float(v[i]) for v, i in zip(place, np.unravel_index(flat, state.crack.shape[1:]), strict=True)]
    every = state.by_law | {settings.law: state.depth}
    archard = sum(share * facts.archard.sum() for share, facts in first)
    seized = sum(share * facts.seized.sum() for share, facts in first)
    enlarged = np.concatenate([facts.enlarged for _, facts in first]) > 1
    return {
        "deepest_by_law": depth,
        "deepest_at": [float(state.worn.x[i]), float(state.worn.y[j])],
        "volume_by_law": {name: float(own[b].sum()) * cell for name, own in state.by_law.items()},
        "largest_tgamma": float(hardest.tgamma[k]),
        "at": float(hardest.x[k]),
        "region": model.region(float(hardest.tgamma[k])),
        "largest_pressure": float(max(f.max_pressure.max() for _, f in first if len(f.x))),
        "flash_temperature": float(hardest.flash[k]),
        "enlarged_share": float(enlarged.mean()),
        "seizure_share": seized / archard if archard > 0 else 0.0,
        **cracks,
        **{name: at(cracks[name]) for name in ("crack_index_at", "cracks_at")},
        "at_end": _end(after, b),
        "subsurface": _subsurface(before, b, settings),
        "subsurface_at_end": _subsurface(after, b, settings),
        "years": years_of(
            settings,
            state,
            {law: own[b] for law, own in every.items()},
            {law: own[b] for law, own in rates.items()},
            (state.crack[b], after.crack[b]),
        ),
        "flow": _flow(state, b),
    }


def _flow(state: Evolution, b: int) -> dict[str, Any] | None:
    """What plastic flow did to a body: where and how deep, how much of the largest loss of height it is."""
    worn = state.worn
    if worn.flow is None:
        return None
    flow, lowered = worn.flow[b], worn.lowered[b]
    i, j = np.unravel_index(int(np.argmax(lowered)), lowered.shape)
    return {
        "deepest": float(flow.max()),
        "heap": float(-flow.min()),
        "volume_moved": float(np.maximum(flow, 0.0).sum() * worn.cell),
        "strain": float(worn.strain[b].max()),
        "lowered": float(lowered[i, j]),
        "lowered_at": [float(worn.x[i]), float(worn.y[j])],
        "share": float(flow[i, j] / lowered[i, j]) if lowered[i, j] > 0 else 0.0,
    }


def _subsurface(rate: CrossingRate, b: int, settings: DamageSettings) -> dict[str, float] | None:
    """Under the patch of the largest force on a body by any wheel."""
    patches = [patch for _, own in rate.kinds if (patch := own.hardest[b]) is not None]
    return subsurface_of(max(patches, key=lambda patch: patch.normal_force), settings) if patches else None


def _wheels(settings: DamageSettings, state: Evolution, rate: CrossingRate) -> list[dict[str, Any]]:
    """What a wheel of each kind would have lost, had it made all the passes: deepest [m], section [m2] and volume [m3]
    by each law, where on the profile [m] and how much of it on the nose."""
    wheels = np.asarray(state.wheels)
    if not wheels.ndim:
        return []
    y, names = wheel_lines(settings.plan_spacing), list(state.by_law)
    found = []
    for (share, own), bodies in zip(rate.kinds, wheels, strict=True):
        depth = bodies.sum(axis=1)
        lead = names.index(settings.law)
        volume = (bodies * own.circumference).sum(axis=2) * (y[1] - y[0])
        total = float(volume[lead].sum())
        found.append(
            {
                "kind": own.label,
                "share": share,
                "deepest_by_law": dict(zip(names, map(float, depth.max(axis=1)), strict=True)),
                "deepest_at": float(y[np.argmax(depth[lead])]),
                "section_by_law": dict(zip(names, map(float, depth.sum(axis=1) * (y[1] - y[0])), strict=True)),
                "volume_by_law": dict(zip(names, map(float, volume.sum(axis=1)), strict=True)),
                "nose_share": float(volume[lead, 1]) / total if total > 0 else 0.0,
            }
        )
    return found


def _end(after: CrossingRate, b: int) -> dict[str, float]:
    facts = [own.facts.of(b) for _, own in after.kinds]
    facts = [own for own in facts if len(own.x)]
    archard, seized = (sum(getattr(own, name).sum() for own in facts) for name in ("archard", "seized"))
    largest = lambda name: float(max((getattr(own, name).max() for own in facts), default=0.0))
    return {
        "largest_tgamma": largest("tgamma"),
        "largest_pressure": largest("max_pressure"),
        "largest_force": float(max((own.force[b] for _, own in after.kinds), default=0.0)),
        "seizure_share": float(seized / archard) if archard > 0 else 0.0,
    }


def _steep_share(rate: CrossingRate) -> float:
    """Share of the wear by contacts too steep for a plan."""
    total = steep = 0.0
    for share, own in rate.kinds:
        total += share * own.facts.archard.sum()
        steep += share * own.facts.archard[np.abs(own.facts.angle) > STEEPEST].sum()
    return steep / total if total > 0 else 0.0


def _impacts(rate: CrossingRate) -> list[dict[str, Any]]:
    """The largest force of each kind of pass, the largest first, and how it came about."""
    found = [own.impact._asdict() | {"kind": own.label, "share": share} for share, own in rate.kinds]
    return sorted(found, key=lambda one: -one["force"])


def _transfers(rate: CrossingRate) -> list[float]:
    return [own.transfer for _, own in rate.kinds]
