"""Error bars of an explicit run: where its limit for vanishing elements lies, from its coarse twin.

The twin is the same pass on elements of twice the size, at a tenth of the cost or less. What converges at second order
is off by a third of the difference between the two. The bar is that times a safety factor, and the scatter with which a
quantity comes and goes as mesh lines move through the patch, which falls with the square of the size. Both were fitted
on the reference scene, 2 mm against an earlier trial at 0.5 mm; on other scenes they have not been tried yet.
"""

from __future__ import annotations

from rail_fem.output.quantities import REPORTED, reported
from rail_fem.output.result import PassResult

ORDER = 2.0
SAFETY = 3.0
# relative, at an element of SCATTER_SIZE; falls with its square
SCATTER = {"force": 0.025, "pressure": 0.05, "strain": 0.12, "volume": 0.08}
SCATTER_SIZE = 2e-3  # [m]
TRANSFER_SCATTER = 0.5  # of an element of SCATTER_SIZE


def error_bars(result: PassResult, twin: PassResult) -> dict[str, float]:
    """Half widths by the name of a reported quantity [SI]; only for what both resolve, and both pass the same stretch.

    twin : the same scene on coarser elements
    """
    size, coarse = (r.settings["element_size"] for r in (result, twin))
    if result.cut_off or twin.cut_off or not coarse > size:
        return {}
    share, there = SAFETY / ((coarse / size) ** ORDER - 1), reported(twin)
    return {
        name: share * abs(value - there[name]) + scatter(name, value, size)
        for name, value in reported(result).items()
        if name in there and (value or there[name])  # nothing on both meshes says nothing
    }


def scatter(name: str, value: float, size: float) -> float:
    """How far a quantity comes and goes with the position of mesh lines [SI]; size : of the elements [m]."""
    finer = (size / SCATTER_SIZE) ** ORDER
    if name == "transfer_x":
        return TRANSFER_SCATTER * SCATTER_SIZE * finer
    kind = {"N": "force", "Pa": "pressure", "1": "strain", "m^3": "volume"}[REPORTED[name].unit]
    return SCATTER[kind] * abs(value) * finer
