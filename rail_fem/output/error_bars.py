"""Error bars of an explicit run: where its limit for vanishing elements lies, from its coarse twin.

The twin is the same pass on elements of twice the size, at a tenth of the cost or less. What converges at second order
is off by a third of the difference between the two, at first order by all of it. The bar is that third times a safety
factor, and the scatter with which a quantity comes and goes as mesh lines move through the patch, which falls with the
square of the size. A mean over a volume of a few elements is not resolved, nor is a volume of a few of them, of the run
or of its twin: no bar is claimed. Fitted on the nose of the reference scene, 2 mm against 1 mm; tried on other scenes
by rail_fem.studies.held_out_bars.
"""

from __future__ import annotations

import math

from rail_fem.output.plastic_zone import BLOCK, WORST
from rail_fem.output.quantities import REPORTED, reported
from rail_fem.output.result import PassResult

ORDER = 2.0
# means of plastic strain converge at first to second order, all else at second where it has an order
SAFETY = {"force": 3.0, "pressure": 3.0, "strain": 4.5, "volume": 3.0, "length": 3.0}
# relative, at an element of SCATTER_SIZE, of the transfer in m; falls with the square of the size
SCATTER = {"force": 0.025, "pressure": 0.05, "strain": 0.12, "volume": 0.08, "length": 1e-3}
SCATTER_SIZE = 2e-3  # [m]
KINDS = {"N": "force", "Pa": "pressure", "1": "strain", "m^3": "volume", "m": "length"}
VOLUMES = {**WORST, "block": math.prod(BLOCK)}  # over which plastic strain is averaged [m3]
LEAST_ELEMENTS = 8  # in such a volume


def error_bars(result: PassResult, twin: PassResult) -> dict[str, float]:
    """Half widths by the name of a reported quantity [SI]; only for what both resolve, and both pass the same stretch.

    twin : the same scene on coarser elements
    """
    size, coarse = (r.settings["element_size"] for r in (result, twin))
    element, larger = (r.settings["element_size"] ** 3 * r.settings.get("element_aspect", 1.0) for r in (result, twin))
    if result.cut_off or twin.cut_off or not coarse > size:
        return {}
    ratio, there = (coarse / size) ** ORDER - 1, reported(twin)
    return {
        name: SAFETY[kind(name)] / ratio * abs(value - there[name]) + scatter(name, value, size)
        for name, value in reported(result).items()
        # nothing on both meshes says nothing
        if name in there
        and (value or there[name])
        and resolved(name, value, element)
        # where the twin has next to nothing, the difference says nothing of a limit
        and (not name.startswith("volume_") or resolved(name, there[name], larger))
    }


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
