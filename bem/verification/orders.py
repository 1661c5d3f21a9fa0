"""Error and observed order against element size for every plane problem with an exact solution
(bem/verification/exact_problems.py).

`rail-fem study verification --only orders` tabulates them; with --quick two sizes each, once each, in seconds.

The order is that of the finest pair. In contacts the patch's edge falls anywhere between two nodes, and the error
scatters with it:
there the error is the worst at 1, 1.13 and 1.29 times the fineness, and the order that of a straight line through all
(logarithms). What the theory leaves out stays as an error: Persson's radii differ by 4e-5 of themselves, Spence's
pressure is that of no friction.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import radians

import numpy as np

from bem.verification import exact_problems as exact


@dataclass(frozen=True)
class OrderStudy:
    """name; quantities whose errors `errors` returns; sizes: element sizes [m], or of a contact elements to its half;
    phases: factors on each size, of which the worst counts
    """

    name: str
    quantities: tuple[str, ...]
    errors: Callable[[float], float | tuple[float, ...]]
    sizes: tuple[float, ...]
    contact: bool = True
    phases: tuple[float, ...] = (1.0,)


PHASES = (1.0, 1.13, 1.29)


PEAK, BESIDE = ("largest pressure", "profile L2"), ("stress one element off", "displacement")
LENGTHS, FINEST = (0.2, 0.1, 0.05, 0.025), (6, 12, 24, 48, 96)


def _body(name: str, quantities: tuple[str, ...], errors: Callable) -> OrderStudy:
    return OrderStudy(name, quantities, errors, LENGTHS, contact=False)


def _contact(name: str, quantities: tuple[str, ...], errors: Callable, sizes: tuple[float, ...] = FINEST) -> OrderStudy:
    return OrderStudy(name, quantities, errors, sizes, phases=PHASES)


STUDIES = [
    _body("pressurised ring (Lame)", BESIDE, exact.ring_errors),
    _body("hole under tension (Kirsch)", BESIDE[:1], exact.kirsch_error),
    _body("point load on a half-plane (Flamant)", BESIDE[:1], exact.flamant_error),
    _contact("line contact (Hertz)", PEAK, exact.hertz_errors, (3, *FINEST)),
    *(
        _contact(
            f"pin in hole, {degrees} degrees (Persson)", PEAK, partial(exact.pin_errors, semi_angle=radians(degrees))
        )
        for degrees in (30, 45, 60, 75)
    ),
    _contact("partial slip, Q = 0.75 mu P (Cattaneo)", ("stick width", "shear L2"), exact.cattaneo_errors),
    _contact("rolling, Q = 0.64 mu P (Carter)", ("force", "stick width"), exact.carter_errors, (6, 12, 25, 50, 100)),
    OrderStudy("loading of unlike bodies (Spence)", ("stick width",), exact.spence_error, (8, 16, 32, 64)),
]


def observed_order(sizes: np.ndarray, errors: np.ndarray, contact: bool) -> float:
    """Order from sizes (k,) and errors (k,), coarse to fine; sizes of contacts are counts of cells."""
    step = np.log(1 / sizes if contact else sizes)
    part = slice(None) if contact else slice(-2, None)
    return float(np.polyfit(step[part], np.log(np.maximum(errors[part], 1e-300)), 1)[0])


def measure(study: OrderStudy, coarse: bool = False) -> tuple[np.ndarray, np.ndarray, list[float]]:
    """Sizes (k,), errors (k, quantities) and the order of each quantity. coarse : the two coarsest sizes, once each"""
    sizes = np.array(study.sizes[:2] if coarse else study.sizes, float)
    phases = study.phases[:1] if coarse else study.phases
    errors = np.array([np.max([np.atleast_1d(study.errors(s * phase)) for phase in phases], axis=0) for s in sizes])
    return sizes, errors, [observed_order(sizes, column, study.contact) for column in errors.T]


HEAD = ["problem", "error of", "fineness", "error [%] at each", "observed order"]


def lines_of(study: OrderStudy, coarse: bool = False) -> list[list[str]]:
    """Rows of the table for one problem, one for each quantity; coarse : as of `measure`"""
    sizes, errors, orders = measure(study, coarse)
    unit = "elements to the half contact" if study.contact else "element size [m], body of 1 m"
    told = lambda column: ", ".join(f"{size:g}: {error:.2g}" for size, error in zip(sizes, 100 * column))
    return [
        [study.name, quantity, unit, told(column), f"{order:.2f}"]
        for quantity, column, order in zip(study.quantities, errors.T, orders)
    ]
