"""Error bars of an explicit run: where its limit for vanishing elements lies, from its coarse twin.

The twin is the same pass on elements of twice the size, at a tenth of the cost or less. What converges at second order
is off by a third of the difference between the two, at first order by all of it. The bar is that third times a safety
factor, and the scatter with which a quantity comes and goes as mesh lines move through the patch, which falls with the
square of the size. Plastic strain of a body all of which grows, or all of which falls, as elements shrink has a tail of
first order: there the bar is the whole difference times a factor.

Run and twin may agree by accident. All forces come from one motion: none counts as nearer to its twin than they are in
the root mean square. A volume above a level of strain moves with the strain there: its relative bar is no less than
that of the body's integral times how steeply volume falls with level.

A mean over a volume of a few elements is not resolved, nor is a volume of a few of them, of the run or of its twin: no
bar is claimed. Fitted on the nose of the reference scene, 2 mm against 1 mm; tried on other scenes by
rail_fem.studies.error_bars.

Scenes of one class differ from their twins alike: there a bar without a twin is the share that held 95 % of what other
scenes of the class were off (`calibrated_bars`).

Run and twin have the same waves. How well bars hold was found with those of `CALIBRATED_WAVES`: what slower ones move
in steps made longer by heavier elements is a part of its own (`inertia`).
"""

import math
from collections.abc import Mapping
from typing import Any

from rail_fem.result.plastic_zone import BLOCK, LEVELS, WORST
from rail_fem.result.quantities import BODIES, FORCES, REPORTED, STRAIN, reported
from rail_fem.result.result import PassResult
from rail_fem.scene.crossing import CAST
from rail_fem.scene.scene import Scene
from rail_fem.settings.explicit import FeSettings

ORDER = 2.0
# means of plastic strain converge at first to second order, all else at second where it has an order
SAFETY = {"force": 3.0, "pressure": 3.0, "strain": 4.5, "volume": 3.0, "length": 3.0}
FIRST_ORDER_SAFETY = 1.5  # on the whole of what first order leaves: on twice the size that of strains above
# relative, at an element of SCATTER_SIZE, of the transfer in m; falls with the square of the size
SCATTER = {"force": 0.025, "pressure": 0.05, "strain": 0.12, "volume": 0.08, "length": 1e-3}
SCATTER_SIZE = 2e-3  # [m]
KINDS = {"N": "force", "Pa": "pressure", "1": "strain", "m^3": "volume", "m": "length"}
VOLUMES = {**WORST, "block": math.prod(BLOCK)}  # over which plastic strain is averaged [m3]
LEAST_ELEMENTS = 8  # in such a volume
# without a twin: share of a quantity at elements of CALIBRATED_SIZE, of the transfer in m, and the order with which it
# falls: within what 95 % of each kind are off the limit in the sixteen cases of docs/sixteen_cases.md, by 2 and 1 mm
CALIBRATED = {
    "force": (0.02, 2.0),
    "pressure": (0.04, 2.0),
    "strain": (0.4, 1.0),
    "volume": (0.3, 1.0),
    "length": (0.5e-3, 2.0),
}
CALIBRATED_WORDS = "error bars are calibrated: without a twin, by what other scenes of this class were off"
CALIBRATED_SIZE, LARGEST_CALIBRATED = 1e-3, 2e-3  # [m]
# what heavier small elements move a quantity by, relative, the transfer in m, where waves under the wheel are
# CALIBRATED_WAVES times as fast as it; grows with the wheel's speed over theirs (docs/models/explicit.md)
INERTIA = {"force": 0.01, "pressure": 0.01, "strain": 0.02, "volume": 0.03, "length": 0.2e-3}
CALIBRATED_WAVES = 20.0


def error_bars(result: PassResult, twin: PassResult) -> dict[str, float]:
    """Half widths by the name of a reported quantity [SI]; only for what both resolve, and both pass the same stretch.

    twin : the same scene on coarser elements
    """
    size, coarse = (r.settings["element_size"] for r in (result, twin))
    element, larger = (r.settings["element_size"] ** 3 * r.settings.get("element_aspect", 1.0) for r in (result, twin))
    if result.cut_off or twin.cut_off or not coarse > size:
        return {}
    own, there, ratio = reported(result), reported(twin), coarse / size
    apart = {
        name: value - there[name]
        for name, value in own.items()
        # nothing on both meshes says nothing
        if name in there
        and (value or there[name])
        and resolved(name, value, element)
        # where the twin has next to nothing, the difference says nothing of a limit
        and (not name.startswith("volume_") or resolved(name, there[name], larger))
    }
    share = {name: SAFETY[kind(name)] / (ratio**ORDER - 1) for name in apart}
    for body in BODIES:
        mine = [name for name in apart if name in {f"{quantity}_{body}" for quantity in STRAIN}]
        if len({apart[name] > 0 for name in mine}) == 1:
            share |= {name: max(share[name], FIRST_ORDER_SAFETY / (ratio - 1)) for name in mine}
    forces = [apart[name] / own[name] for name in apart if name in FORCES and own[name]]
    of_forces = math.sqrt(sum(part**2 for part in forces) / max(len(forces), 1))
    bars = {}
    for name, difference in apart.items():
        counted = max(abs(difference), of_forces * abs(own[name])) if name in FORCES else abs(difference)
        bars[name] = share[name] * counted + scatter(name, own[name], size)
    return _whole(bars, result, own, element)


def calibrated_bars(result: PassResult) -> dict[str, float]:
    """Half widths by the name of a reported quantity [SI] without a twin, for a result of the class of
    `why_not_calibrated`; only for what a twin of twice the size would resolve as well."""
    size, own, bars = result.settings["element_size"], reported(result), {}
    element = size**3 * result.settings.get("element_aspect", 1.0)
    for name, value in own.items():
        if (
            value
            and not result.cut_off
            and resolved(name, value, 8 * element if name.startswith("volume_") else element)
        ):
            share, order = CALIBRATED[kind(name)]
            bars[name] = share * (size / CALIBRATED_SIZE) ** order * (1.0 if kind(name) == "length" else abs(value))
    return _whole(bars, result, own, element)


def _whole(bars: dict[str, float], result: PassResult, own: dict[str, float], element: float) -> dict[str, float]:
    """Bars of elements, with what their inertia adds and what integrals say of volumes."""
    bars = {name: math.hypot(bar, inertia(name, own[name], result.settings)) for name, bar in bars.items()}
    return {name: max(bar, _by_level(name, own, bars, element)) for name, bar in bars.items()}


def inertia(name: str, value: float, settings: Mapping[str, Any]) -> float:
    """What slower waves than `CALIBRATED_WAVES` move a reported quantity by [SI]; 0 where they are as fast."""
    if settings.get("mass_scaling") != "auto" or settings.get("scaled_elements") != "small":
        return 0.0
    slower = (CALIBRATED_WAVES / settings.get("wave_ratio", CALIBRATED_WAVES)) ** 2 - 1
    share = INERTIA[kind(name)] * math.sqrt(max(0.0, slower))
    return share * (1.0 if kind(name) == "length" else abs(value))


def why_not_calibrated(scene: Scene, settings: FeSettings) -> str:
    """What sets a run apart from those that `CALIBRATED` was found by; "" for one of their class: a cast crossing, its
    through route behind the leg, one pass, elements of one point and shape in a travelling window."""
    ends = [x for x in (settings.start, settings.end) if x is not None]
    apart = {
        f"the crossing's family is {scene.crossing.family}": scene.crossing.family != CAST,
        "a path over the leg, behind which it flies": min(ends, default=math.inf) < scene.crossing.leg_end,
        "the diverging route": scene.diverging is not None,
        "bearers under the crossing": scene.bearers is not None,
        "several passes": settings.passes > 1,
        "element = full": settings.element != "one-point",
        "no travelling window": not settings.has_window,
        f"mass_scaling = {settings.mass_scaling}": settings.mass_scaling != "auto",
        f"elements above {LARGEST_CALIBRATED * 1e3:g} mm": settings.element_size > LARGEST_CALIBRATED,
        "elements longer than twice their size": not 1 <= settings.element_aspect <= 2,
        "a wheel coarser than 1.5 times the rail": settings.wheel_element_ratio > 1.5,
    }
    return ", ".join(words for words, differs in apart.items() if differs)


def _by_level(name: str, own: dict[str, float], bars: dict[str, float], element: float) -> float:
    """What the bar of the body's integral says of its volume above a level; 0 of all else.

    Were strain everywhere off by a factor, the volume above a level would be that above the level over the factor: off
    by as much to the power by which volume falls with level, the steeper of those to the next levels, at least 1.
    """
    quantity, _, body = name.rpartition("_")
    total = f"integral_{body}"
    if quantity not in LEVELS or total not in bars or not own[total]:
        return 0.0
    levels = list(LEVELS)
    at, powers = levels.index(quantity), [1.0]
    for other in (levels[i] for i in (at - 1, at + 1) if 0 <= i < len(levels)):
        volume = own.get(f"{other}_{body}", 0.0)
        if volume and own[name] and resolved(f"{other}_{body}", volume, element):
            powers.append(-math.log(volume / own[name]) / math.log(LEVELS[other] / LEVELS[quantity]))
    return max(powers) * bars[total] / own[total] * own[name]


def kind(name: str) -> str:
    """What a reported quantity is, by its unit."""
    return KINDS[REPORTED[name].unit]


def resolved(name: str, value: float, element: float) -> bool:
    """Whether elements of a volume [m3] are small enough for a quantity: a mean needs some of them in its volume, and a
    volume of what has flowed is one of some of them."""
    volume = value if name.startswith("volume_") else VOLUMES.get(name.rpartition("_")[0], math.inf)
    return volume >= LEAST_ELEMENTS * element


def scatter(name: str, value: float, size: float) -> float:
    """How far a quantity comes and goes with the position of mesh lines [SI]; size : of the elements [m]."""
    own = SCATTER[kind(name)] * (size / SCATTER_SIZE) ** ORDER
    return own if kind(name) == "length" else own * abs(value)
