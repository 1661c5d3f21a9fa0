"""What a site that has worn shows, in numbers: bands over the laws, errors, forces, T gamma, fatigue, years."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from geometry.surfaces.depth_field import STEEPEST
from rail_fem.damage.contact_facts import ContactFacts
from rail_fem.damage.crossing_site import CrossingRate
from rail_fem.damage.evolution import Evolution, Rate
from rail_fem.damage.fatigue import fatigue_of
from rail_fem.damage.sites import maintenance_of, subsurface_of
from rail_fem.damage.traffic import EXTRAPOLATED, Event, life
from rail_fem.damage.wheel_wear import wheel_lines
from rail_fem.settings.damage import DamageSettings


def summary(settings: DamageSettings, state: Evolution, before: Rate, after: Rate) -> dict[str, Any]:
    """Numbers of a site that has worn [SI], those of each part in `bodies`; what is removed is an area of a section, a
    volume of a crossing."""
    rates = end_rates(settings, state, after)
    parts = {name: _part(settings, state, before, after, rates, b) for b, name in enumerate(state.first.parts)}
    removed, strips = state.first.amount(state.depth), state.removed - state.beyond
    own = _of_crossing if isinstance(before, CrossingRate) else _of_section
    return {
        "site": settings.site,
        "passes": state.passes,
        "began": state.began,
        "law": settings.law,
        "resets": state.resets,
        "height_ground_off": state.lost,
        "kinds": len(before.kinds),
        "deepest": state.deepest,
        "bodies": {name: found for name, found in parts.items() if found},
        "blocks": len(state.log),
        "shortest_block": shortest_block(state),
        "block_error": state.block_error,
        "smoothing_change": state.smoothing / state.deepest if state.deepest > 0 else 0.0,
        "removed": removed,
        "removed_of_strips": state.removed,
        "removed_beyond": state.beyond,
        "removed_error": abs(removed - strips) / strips if strips > 0 else 0.0,
        "largest_force": {"first": before.largest_force, "end": after.largest_force},
        "wheels": _wheels(settings, state, before),
        **own(settings, state, before, after),
    }


def _of_section(settings: DamageSettings, state: Evolution, before: Any, after: Any) -> dict[str, Any]:
    """What only a section has."""
    model = fatigue_of(settings)
    contacts = [
        {"weight": share, "region": model.region(float(row["tgamma"]))} | row
        for share, own in before.kinds
        for row in ({k: float(v[i]) for k, v in own.facts._asdict().items()} for i in range(len(own.facts.x)))
    ]
    near = _share_by("bordering", [(share, own.facts) for share, own in before.kinds])
    return {"area_correction": state.correction, "border_share": near, "contacts": contacts}


def _of_crossing(settings: DamageSettings, state: Evolution, before: Any, after: Any) -> dict[str, Any]:
    """What only a crossing has."""
    rates = (("first", before), ("end", after))
    return {
        "spread": state.worn.spread,
        "steep_share": _steep_share(before),
        "impacts": {when: _impacts(rate) for when, rate in rates},
        "removed_by_kind": {when: _removed_by_kind(settings.law, rate) for when, rate in rates},
        "transfer": {when: [own.transfer for _, own in rate.kinds] for when, rate in rates},
    }


def _part(
    settings: DamageSettings, state: Evolution, before: Rate, after: Rate, rates: dict[str, np.ndarray], b: int
) -> dict[str, Any] | None:
    """Numbers of one part; None where no wheel meets it."""
    first = [(share, own.facts.of(b)) for share, own in before.kinds]
    if not any(len(facts.x) for _, facts in first):
        return None
    shape, lead = state.first, settings.law
    every = {law: shape.part(own, b) for law, own in (state.by_law | {lead: state.depth}).items()}
    hardest = max((facts for _, facts in first if len(facts.x)), key=lambda facts: facts.tgamma.max())
    k = int(np.argmax(hardest.tgamma))
    crack = shape.part(state.crack, b), shape.part(after.crack, b)
    cracks = crack_facts(*crack)
    enlarged = np.concatenate([facts.enlarged for _, facts in first]) > 1
    coordinates = (hardest.y, hardest.z) if settings.site == "switch" else (hardest.x, hardest.y)
    return {
        "deepest_by_law": {law: float(own.max()) for law, own in every.items()},
        "deepest_at": shape.place(int(np.argmax(every[lead]))),
        "removed_by_law": {law: shape.amount(shape.part(own, b)) for law, own in state.by_law.items()},
        "largest_tgamma": float(hardest.tgamma[k]),
        "at": [float(values[k]) for values in coordinates],
        "region": fatigue_of(settings).region(float(hardest.tgamma[k])),
        "largest_pressure": float(max(facts.max_pressure.max() for _, facts in first if len(facts.x))),
        "flash_temperature": float(hardest.flash[k]),
        "enlarged_share": float(enlarged.mean()),
        "seizure_share": _share_by("seized", first),
        **cracks,
        **{name: shape.place(cracks[name]) for name in ("crack_index_at", "cracks_at")},
        "at_end": _end(after, b),
        "subsurface": _subsurface(before, b, settings),
        "subsurface_at_end": _subsurface(after, b, settings),
        "years": years_of(settings, state, every, {law: shape.part(own, b) for law, own in rates.items()}, crack),
        "flow": _flow(state, b),
    }


def _share_by(cells: str, kinds: Sequence[tuple[float, ContactFacts]]) -> float:
    """Of the wear by Archard's map, what comes from cells in seizure ("seized"), or near a border ("bordering")."""
    whole, part = (sum(share * getattr(f, name).sum() for share, f in kinds) for name in ("archard", cells))
    return float(part / whole) if whole > 0 else 0.0


def _end(after: Rate, b: int) -> dict[str, float]:
    kinds = [(share, own.facts.of(b)) for share, own in after.kinds]
    largest = lambda name: float(max((getattr(f, name).max(initial=0.0) for _, f in kinds), default=0.0))
    return {
        "largest_tgamma": largest("tgamma"),
        "largest_pressure": largest("max_pressure"),
        "largest_force": float(max((own.force[b] for _, own in after.kinds), default=0.0)),
        "seizure_share": _share_by("seized", kinds),
    }


def _subsurface(rate: Rate, b: int, settings: DamageSettings) -> dict[str, float] | None:
    """Under the patch of the largest force on a part by any wheel."""
    patches = [patch for _, own in rate.kinds if (patch := own.hardest[b]) is not None]
    return subsurface_of(max(patches, key=lambda patch: patch.normal_force), settings) if patches else None


def _flow(state: Evolution, b: int) -> dict[str, Any] | None:
    """What plastic flow did to a body: where and how deep, how much of the largest loss of height it is."""
    worn = state.worn
    if getattr(worn, "flow", None) is None:
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


def _wheels(settings: DamageSettings, state: Evolution, rate: Rate) -> list[dict[str, Any]]:
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


def _steep_share(rate: CrossingRate) -> float:
    """Share of the wear by contacts too steep for a plan."""
    total = steep = 0.0
    for share, own in rate.kinds:
        total += share * own.facts.archard.sum()
        steep += share * own.facts.archard[np.abs(own.facts.angle) > STEEPEST].sum()
    return steep / total if total > 0 else 0.0


def _removed_by_kind(law: str, rate: CrossingRate) -> list[list[Any]]:
    """Each kind of pass, and its share of the volume that a mean pass removes."""
    total = max(sum(share * own.removed[law] for share, own in rate.kinds), 1e-30)
    return [[own.label, share * own.removed[law] / total] for share, own in rate.kinds]


def _impacts(rate: CrossingRate) -> list[dict[str, Any]]:
    """The largest force of each kind of pass, the largest first, and how it came about."""
    found = [own.impact._asdict() | {"kind": own.label, "share": share} for share, own in rate.kinds]
    return sorted(found, key=lambda one: -one["force"])


def shortest_block(state: Evolution) -> float:
    """Passes of the shortest of all blocks but the last, which ends with the study; the only one's, 0 without any."""
    lengths = np.diff(state.log[:, 0], prepend=0.0)
    return float(lengths[:-1].min()) if len(lengths) > 1 else float(lengths.sum())


def end_rates(settings: DamageSettings, state: Evolution, after: Rate) -> dict[str, np.ndarray]:
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

    def first(at: np.ndarray, rate: np.ndarray, limit: float, before: float = 0.0) -> tuple[float, float]:
        """Rate [1/year] and state at the place that reaches the limit first; where one has, its mean rate so far."""
        if at.max() >= limit:
            rate = (at - before) / max(run, 1.0)
        k = int(np.argmax(rate / np.maximum(limit - at, 1e-30)))
        return max(float(rate.flat[k]), 0.0) * axles, float(at.flat[k])

    def reached(law: str, crack: tuple[float, float], planned: Sequence[Event] = ()) -> tuple[float | None, str]:
        rate, depth = first(state.lost + depths[law], rates[law], settings.depth_limit, state.lost)
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
