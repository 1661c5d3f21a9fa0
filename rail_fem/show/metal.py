"""Reported quantities of a result with their bars, in words; plastic strain, residual stress and change of the running
surface."""

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from rail_fem.result.quantities import REPORTED, STRAIN
from rail_fem.result.result import PassResult
from rail_fem.scene.units import engineering

LEAST_DIGITS, MOST_DIGITS = 3, 4  # of a number beside its bars: two would tell 227 kN of a wheel and 230 of its nose


def amount(value: float, unit: str, digits: int = 4) -> str:
    """A value in engineers' units."""
    return "not resolved" if math.isnan(value) else engineering(value, unit, digits)


class Headline(NamedTuple):
    """A number that a result stands for, in words: its value, half widths of its bars of elements and of form, "" where
    none is claimed, and where it is."""

    name: str
    value: str
    elements: str
    form: str
    where: str

    @property
    def with_bar(self) -> str:
        """The value, and behind it the bar of elements where there is one."""
        return f"{self.value} +- {self.elements}" if self.elements else self.value


def told(result: PassResult, words: str, name: str, value: float, unit: str, where: str = "") -> Headline:
    """A value under the name of a reported quantity, whose bars it has."""
    bars = [result.error_bars.get(name, math.nan), result.form_bar(name)]
    elements, form = (amount(bar, unit, 2) if np.isfinite([value, bar]).all() else "" for bar in bars)
    return Headline(words, amount(value, unit, _digits_beside(value, bars)), elements, form, where)


def reported(result: PassResult, name: str, words: str = "") -> Headline:
    """A reported quantity."""
    return told(result, words, name, REPORTED[name].of(result), REPORTED[name].unit)


def _digits_beside(value: float, bars: Iterable[float]) -> int:
    """Of a number beside its bars, which have two: the widest bar's last place is the number's."""
    widest = max((abs(bar) for bar in bars if np.isfinite(bar)), default=0.0)
    if not widest or not value or math.isnan(value):
        return MOST_DIGITS
    places = math.floor(math.log10(abs(value))) - math.floor(math.log10(widest)) + 2
    return min(max(places, LEAST_DIGITS), MOST_DIGITS)


def metal_rows(result: PassResult) -> list[tuple[str, str, str]]:
    """Name, value with its bar, remark; for each body that the pass resolves. A mean over less than the most strained
    element is that element's value, and said to be."""
    if not result.metal:
        return []
    from rail_fem.result.plastic_zone import WORST

    rows = []
    for body, left in result.metal.items():
        volume = left["size"] ** 3
        for name, words in STRAIN.items():
            one = reported(result, f"{name}_{body}", f"{body}: {words}")
            remark = [f"form +- {one.form}"] if one.form else []
            remark += [f"of one element of {1e9 * volume:.2g} mm3"] if volume > WORST.get(name, np.inf) else []
            rows.append((one.name, one.with_bar, ", ".join(remark)))
        rows.append((f"{body}: largest plastic strain of an element", *_maximum(left)))
        rows += _stress(body, left) + _surface(body, left)
    return rows


def _maximum(left: Mapping) -> tuple[str, str]:
    at = ", ".join(f"{1e3 * c:.1f}" for c in left["position"])
    remark = f"of {1e3 * left['size']:.2g} mm at ({at}) mm; it grows as the elements shrink"
    return amount(left["maximum"], "1"), remark


def _stress(body: str, left: Mapping) -> list[tuple[str, str, str]]:
    from rail_fem.result.plastic_zone import BLOCK

    depth, stress = np.array(left["depth"]), np.array(left["stress"], dtype=float).reshape(-1, 2)
    inside = depth < BLOCK[2]
    if not left["unloaded"] or not np.isfinite(stress[inside]).all():
        return []
    along, across = stress[inside].mean(axis=0)
    remark = "mean of the same 5 x 5 x 3 mm; + tension"
    return [(f"{body}: residual stress along, across", f"{along / 1e6:.0f}, {across / 1e6:.0f} MPa", remark)]


def _surface(body: str, left: Mapping) -> list[tuple[str, str, str]]:
    fall = np.array(left["surface"]["fall"])
    if not len(fall):
        return []
    at = int(fall.argmax())
    where = f"at x = {1e3 * left['surface']['x'][at]:.0f} mm"
    return [(f"{body}: running surface fallen by", f"{1e3 * fall[at]:.3f} mm", where)]
