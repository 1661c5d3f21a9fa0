"""Error bars of an explicit run: where its limit for vanishing elements lies, from its coarse twin.

The twin is the same pass on elements of twice the size, at a tenth of the cost or less. What converges at second order
is off by a third of the difference between the two. The bar is that times a safety factor, and no less than the scatter
with which a quantity comes and goes as mesh lines move through the patch. Factor and scatter were fitted on some scenes
and hold on others (docs/speed.md).
"""

from __future__ import annotations

from rail_fem.output.quantities import REPORTED, reported
from rail_fem.output.result import PassResult

ORDER = 2.0
SAFETY = 1.5
# least bar over the value, at an element of SCATTER_SIZE; falls with the size
SCATTER = {"force": 0.01, "strain": 0.02, "volume": 0.03}
SCATTER_SIZE = 2e-3  # [m]
TRANSFER_SCATTER = 0.15  # of an element's size


def error_bars(result: PassResult, twin: PassResult) -> dict[str, float]:
    """Half widths by the name of a reported quantity [SI]; only for what both resolve, and both pass the same stretch.

    twin : the same scene on coarser elements
    """
    size, coarse = (r.settings["element_size"] for r in (result, twin))
    if result.cut_off or twin.cut_off or not coarse > size:
        return {}
    share, there = SAFETY / ((coarse / size) ** ORDER - 1), reported(twin)
    return {
        name: max(share * abs(value - there[name]), least_bar(name, value, size))
        for name, value in reported(result).items()
        if name in there
    }


def least_bar(name: str, value: float, size: float) -> float:
    """The scatter of a quantity with the position of mesh lines [SI]; size : of the elements [m]."""
    if name == "transfer_x":
        return TRANSFER_SCATTER * size
    kind = {"N": "force", "1": "strain", "m^3": "volume"}[REPORTED[name].unit]
    return SCATTER[kind] * abs(value) * size / SCATTER_SIZE
