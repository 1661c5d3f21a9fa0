"""Life under a fleet: each kind of wheel's part in what ends it, and its distribution over which wheels come.

At the place that comes first to the depth limit over the last shape, each of the K drawn kinds wears its own depth a
pass, the mean over its lateral positions. Which kinds a line really has is known by no more than K of them: drawing K
anew from them, with replacement, gives the scatter of the traffic (bootstrap: Efron and Tibshirani, An Introduction to
the Bootstrap (1993), chapter 6, recalled). The error of the model is that of the wear laws, told by each of them apart:
over the same kinds it is no scatter of traffic, and no number of wheels makes it less.
"""

from typing import Any

import numpy as np

from rail_fem.damage.crossing_site import CrossingRate
from rail_fem.damage.evolution import Evolution
from rail_fem.settings.damage import DamageSettings

QUANTILES = 0.05, 0.5, 0.95
RESAMPLED = 2000
WORST = 0.05  # share of the kinds whose wheels are turned
TOLD = 5  # kinds of most damage


def fleet_life(settings: DamageSettings, count: int, state: Evolution, after: CrossingRate) -> dict[str, Any]:
    """Of `count` drawn kinds: where the depth limit comes first by the leading law [m]; `worn_per_pass` [m] and
    `passes_to_limit`, from now on at the rates of the last shape, by law, each at QUANTILES over which wheels come; the
    kinds that wear it most, each with its part, and by how much less it wears without the worst of them."""
    shape, lead = state.worn, settings.law
    left = np.maximum(settings.depth_limit - state.lost - state.depth, 0.0)
    place = int(np.argmax(after.depth[lead] / np.maximum(left, 1e-30)))
    often = np.random.default_rng(0).multinomial(count, np.full(count, 1 / count), RESAMPLED) / count
    shares, kinds = zip(*after.kinds, strict=True)
    kind = lambda values: (values * shares).reshape(count, -1).sum(axis=1) * count  # over its lateral positions
    by_law = {law: kind(after.depths_at(law, place)) for law in after.depth}
    middles = kinds[len(kinds) // count // 2 :: len(kinds) // count]
    worn = {law: np.quantile(often @ depth, QUANTILES) for law, depth in by_law.items()}
    depth = by_law[lead]
    ranked = np.argsort(-depth)
    turned = ranked[: max(1, round(WORST * count))]
    rest = np.delete(depth, turned).mean()
    total = float(depth.sum())
    body, flat = divmod(place, state.depth[0].size)
    never = np.full(len(QUANTILES), np.nan)  # where nothing wears
    passes = {
        law: np.divide(left.flat[place], rates, out=never.copy(), where=rates > 0)[::-1] for law, rates in worn.items()
    }
    return {
        "body": shape.parts[body],
        "at": shape.place(flat),
        "quantiles": list(QUANTILES),
        "worn_per_pass": worn,
        "passes_to_limit": passes,
        "kinds": [[middles[k].label, float(depth[k]) / total if total > 0 else 0.0] for k in ranked[:TOLD]],
        "turned": len(turned),
        "less_without_worst": 1 - float(rest) / float(depth.mean()) if total > 0 else 0.0,
    }
