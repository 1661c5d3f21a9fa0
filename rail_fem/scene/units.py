"""Quantities: what a physical field means, the unit engineers write it in, and the range it may have.

Inside the program every number is SI. Units exist where people write and read: case files, tables and plots.
"""

import functools
import math
import re
from dataclasses import dataclass
from typing import Any

from pydantic_core import PydanticCustomError, core_schema

NUMBER_THEN_UNIT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?(?:nan|inf))\s*((?:[a-z%\u00b5\u03bc\u00b0][^,]*?)?)\s*", re.IGNORECASE)
ROUNDING = 1e-12  # relative slack at the ends of a range: conversion between units rounds


class QuantityError(ValueError):
    """A value that is not a number with a fitting unit; the message is the remedy."""


@functools.cache
def registry():
    """The one unit registry of the program (pint is imported only when a unit is read or shown)."""
    import pint

    return pint.UnitRegistry()


@functools.cache
def si_factor(unit: str) -> float:
    """How many SI units are in one `unit` ("" counts as dimensionless)."""
    return float(registry().Quantity(1.0, unit or "dimensionless").to_base_units().magnitude)


def show(value: float, unit: str, digits: int = 6) -> str:
    """An SI value in the given unit, e.g. show(33.528, "mph") -> "75 mph"."""
    return f"{value / si_factor(unit):.{digits}g} {unit}".strip()


def parse(text: str, unit: str) -> tuple[float, float]:
    """Read "75 mph"; returns (value in SI, value in `unit`).

    Errors: QuantityError, whose message says what is wrong and shows a value that would be right.
    """
    found = NUMBER_THEN_UNIT.fullmatch(text)
    if found is None:
        raise QuantityError(f'"{text}" is not a number with a unit, write e.g. "{_example(unit)}"'
                            + (" (decimal point, not comma)" if "," in text else ""))
    number, written = float(found[1]), found[2]
    if not written and unit:
        raise QuantityError(f'"{text}" has no unit, write e.g. "{found[1]} {unit}"')
    if not math.isfinite(number):
        raise QuantityError(f'"{text}" is not a finite number')
    try:
        quantity = registry().Quantity(number, registry().Unit(written or "dimensionless"))  # Unit refuses a hidden factor ("m 3")
        in_unit, in_si = float(quantity.to(unit or "dimensionless").magnitude), float(quantity.to_base_units().magnitude)
    except Exception as error:  # pint raises many kinds: unknown unit, wrong dimension, syntax
        raise QuantityError(_unit_fault(text, written, unit)) from error
    return in_si, in_unit


def _example(unit: str) -> str:
    return f"1 {unit}".strip()


def _unit_fault(text: str, written: str, unit: str) -> str:
    try:
        dimension = registry().Unit(written).dimensionality
    except Exception:  # the unit itself cannot be read
        return f'"{text}": unknown unit "{written}", write e.g. "{_example(unit)}"'
    return f'"{text}" has the dimension {dimension}, not that of {unit or "a plain number"}, write e.g. "{_example(unit)}"'


@dataclass(frozen=True)
class Quantity:
    """Annotation of a float field: `speed: Annotated[float, Quantity("mph", 1, 300, "running speed v")]`.

    unit    : engineers' unit; "" for a plain number
    low, high : the range allowed, in that unit
    meaning : what the field is, in a few words

    Text is read with its unit and kept in SI. A bare number is SI, unless the validation context says
    `units_required` (case files do): then a field that has a unit refuses it.
    """

    unit: str
    low: float
    high: float
    meaning: str

    def read(self, value: Any, units_required: bool = False) -> float:
        """The value in SI. Errors: QuantityError with the value as typed and the remedy."""
        if isinstance(value, bool) or not isinstance(value, (int, float, str)):
            raise QuantityError(f'{value!r} is not a quantity, write e.g. "{_example(self.unit)}"')
        if isinstance(value, str):
            in_si, in_unit = parse(value, self.unit)
        elif units_required and self.unit:
            raise QuantityError(f'{value!r} has no unit, write e.g. "{value!r} {self.unit}"')
        elif not math.isfinite(value):
            raise QuantityError(f"{value!r} is not a finite number")
        else:
            in_si, in_unit = float(value), float(value) / si_factor(self.unit)
        self._check_range(value, in_unit)
        return in_si

    def _check_range(self, typed: Any, in_unit: float) -> None:
        slack = ROUNDING * max(abs(self.low), abs(self.high))
        if not self.low - slack <= in_unit <= self.high + slack:
            shown = f"{typed} = {in_unit:.6g} {self.unit}".strip()
            raise QuantityError(f"{shown} is outside [{self.low:g}, {self.high:g}] for the {self.meaning}")

    def show(self, value: float) -> str:
        return show(value, self.unit)

    def _validate(self, value: Any, info: core_schema.ValidationInfo) -> float:
        try:
            return self.read(value, bool(info.context and info.context.get("units_required")))
        except QuantityError as error:
            raise PydanticCustomError("quantity", "{fault}", {"fault": str(error)}) from error

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> core_schema.CoreSchema:
        return core_schema.with_info_plain_validator_function(self._validate)
