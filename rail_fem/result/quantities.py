"""The numbers that a result reports, by name: the one list for tables, comparisons and error bars."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rail_fem.result.events import SHARE, stated_peaks
from rail_fem.result.result import NAN, PassResult

BODIES = ("nose", "wing", "leg")
FORCES = {
    "impact_on_wheel": "impact on the wheel",
    "first_impact_on_nose": "first impact on the nose",
    "first_impact_on_wing": "first impact on the wing rail",
    "largest_force": "largest force on the wheel",
    "largest_force_leg": "largest force on the leg",
    "largest_force_wing": "largest force on the wing rail",
    "largest_force_nose": "largest force on the nose",
}
MEANS = {
    "worst_10": "mean plastic strain of the worst 10 mm3",
    "worst_100": "mean plastic strain of the worst 100 mm3",
    "worst_1000": "mean plastic strain of the worst 1000 mm3",
    "block": "mean plastic strain of the worst 5 x 5 x 3 mm",
}
VOLUMES = {
    "integral": "plastic strain integrated over the volume",
    "volume_1": "volume with more than 1 % plastic strain",
    "volume_3": "volume with more than 3 % plastic strain",
    "volume_5": "volume with more than 5 % plastic strain",
    "volume_10": "volume with more than 10 % plastic strain",
}
STRAIN = MEANS | VOLUMES


@dataclass(frozen=True)
class ReportedQuantity:
    """unit : SI;  meaning : in words;  of : result -> value, NaN where it is not resolved"""

    unit: str
    meaning: str
    of: Callable[[PassResult], float]


def _force(name: str) -> Callable[[PassResult], float]:
    return lambda result: peaks[name].value if name in (peaks := stated_peaks(result)) else NAN


def _strain(body: str, name: str) -> Callable[[PassResult], float]:
    return lambda result: result.metal[body]["values"].get(name, NAN) if body in result.metal else NAN


def impact_pressure(result: PassResult) -> float:
    """Mean contact pressure, weighted by the force, while one element passes at the first impact on the body that takes
    the wheel over [Pa]."""
    peak = next((result.peaks[name] for name in SHARE.values() if name in result.peaks), None)
    size = result.settings.get("element_size", NAN) * result.settings.get("element_aspect", 1.0)
    x, pressure = result.history["x"], result.history["contact_pressure"]
    if peak is None or not size == size:
        return NAN
    near = (np.abs(x - peak.x) <= size / 2) & np.isfinite(pressure)
    return float(pressure[near].mean()) if near.any() else NAN


REPORTED: dict[str, ReportedQuantity] = {
    **{name: ReportedQuantity("N", words, _force(name)) for name, words in FORCES.items()},
    "impact_pressure": ReportedQuantity(
        "Pa", "mean contact pressure, weighted by the force, at the first impact on nose or wing", impact_pressure
    ),
    "transfer_x": ReportedQuantity("m", "transfer", lambda result: result.transfer_x),
    **{
        f"{name}_{body}": ReportedQuantity("1" if name in MEANS else "m^3", f"{words}, {body}", _strain(body, name))
        for body in BODIES
        for name, words in STRAIN.items()
    },
}


def reported(result: PassResult) -> dict[str, float]:
    """All quantities that the result resolves, by name [SI]."""
    values = {name: quantity.of(result) for name, quantity in REPORTED.items()}
    return {name: value for name, value in values.items() if value == value}
