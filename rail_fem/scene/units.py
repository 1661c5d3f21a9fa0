"""Quantities: what a physical field means, the unit engineers write it in, and the range it may have.

Inside the program every number is SI. Units exist where people write and read: case files, tables and plots.
"""

import functools
import math
import re
from dataclasses import dataclass
from types import NoneType
from typing import Any, get_args

from pydantic_core import PydanticCustomError, core_schema

LARGEST = 1e300
LONGEST = 100  # characters of a quantity; "66.25 t" has 7
MOST_FACTORS, LARGEST_EXPONENT = 8, 4
NUMBER_THEN_UNIT = re.compile(
    r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?(?:nan|inf)(?![a-z]))\s*(.*?)\s*", re.IGNORECASE
)
WITH_UNIT = r"^\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*[^\s\d].*$"  # as editors look at it
NAME = re.compile(r"[^\W\d]+|[%\u00b0]")
FACTOR = re.compile(
    rf"\s*(?P<sign>[*/\u00b7]?)\s*(?P<name>(?:{NAME.pattern}))(?:\s*(?:\^|\*\*)\s*(?P<power>[+-]?\d(?:\.5)?)|(?P<raised>[\u00b2\u00b3]))?(?![\w.^])\s*"
)
TONS = {"ton", "tons", "uston"}  # which of three tons? pint's is the short one of 907 kg
ROUNDING = 1e-12  # relative slack at the ends of a range: conversion between units rounds


# SI unit of a result -> what is shown
SHOWN = {
    "N": ("kN", 1e-3),
    "N m": ("kN m", 1e-3),
    "Pa": ("MPa", 1e-6),
    "m": ("mm", 1e3),
    "m^2": ("mm^2", 1e6),
    "m^3": ("mm3", 1e9),
    "1": ("%", 100.0),
}


SI_OF = {shown: si for si, (shown, _) in SHOWN.items()} | {"ms": "s", "mrad": "rad"}  # the other way


class QuantityError(ValueError):
    """A value that is not a number with a fitting unit; the message is the remedy."""


@functools.cache
def registry():
    """The one unit registry of the program (pint is imported only when a unit is read or shown). It knows names;
    expressions are read here."""
    import pint

    return pint.UnitRegistry()


@functools.cache
def root_units(unit: str) -> tuple[float, dict[str, float]]:
    """How many root units are in one `unit`, and which: {"gram": 1, "second": -2}. An angle is a root unit of its own,
    and so no plain number.

    unit : a product or quotient of at most 8 units with exponents up to 4 in size, whole or half: "kN s/m", "kg/m^3",
        "m s^-1"; "" is a plain number
    Errors: QuantityError, which names the part that is not understood.
    """
    if len(unit) > LONGEST:
        raise QuantityError(f"a unit of {len(unit)} characters, at most {LONGEST}")
    factor, at, divided = 1.0, 0, False
    dimension: dict[str, float] = {}
    for _ in range(MOST_FACTORS + 1):
        if at == len(unit):
            return factor, {name: power for name, power in dimension.items() if power}
        part = FACTOR.match(unit, at)
        if part is None:
            raise QuantityError(f'unknown unit "{unit[at:].strip()}"')
        if divided and not part["sign"]:
            raise QuantityError(f'unit "{unit}" has a blank behind "/": write "/" or "*" before {part["name"]}')
        power = {"\u00b2": 2.0, "\u00b3": 3.0}.get(part["raised"]) or float(part["power"] or 1)
        if abs(power) > LARGEST_EXPONENT:
            raise QuantityError(f'unit "{unit}" has the exponent {power:g}, the largest is {LARGEST_EXPONENT}')
        divided, at = part["sign"] == "/", part.end()
        scale, roots = _named(part["name"])
        power = -power if divided else power
        factor *= scale**power
        for name, own in roots.items():
            dimension[name] = dimension.get(name, 0.0) + power * own
    raise QuantityError(f'unit "{unit}" has more than {MOST_FACTORS} factors')


def _named(name: str) -> tuple[float, dict[str, float]]:
    if name.lower() in TONS:
        raise QuantityError(f'"{name}" may be 907 kg or 1016 kg: write "t" for 1000 kg')
    try:
        factor, units = registry().get_root_units(registry().parse_units(name))
    except ImportError:  # a broken environment is no unknown unit
        raise
    except Exception as error:  # pint raises many kinds
        raise QuantityError(f'unknown unit "{name}"') from error
    return float(factor), {str(unit): float(power) for unit, power in units._units.items()}


@functools.cache
def si_factor(unit: str) -> float:
    """How many SI units are in one `unit` ("" counts as dimensionless)."""
    factor, roots = root_units(unit)
    return factor * 1e-3 ** roots.get("gram", 0.0)


def show(value: float, unit: str, digits: int = 6) -> str:
    """An SI value in the given unit, e.g. show(33.528, "mph") -> "75 mph"."""
    return f"{value / si_factor(unit):.{digits}g} {unit}".strip()


def in_digits(value: float, digits: int) -> str:
    """A number in so many digits, without a power of ten: "120", not "1.2e+02"."""
    return f"{float(f'{value:.{digits}g}'):.12g}"


def engineering(value: float, unit: str, digits: int = 5) -> str:
    """A result in SI (N, Pa, m, m^2, 1) as engineers read it, e.g. engineering(1.2e5, "N") -> "120 kN"; in other units
    as it is."""
    shown, factor = SHOWN.get(unit, (unit, 1.0))
    return f"{in_digits(value * factor, digits)} {shown}"


def parse(text: str, unit: str) -> tuple[float, float]:
    """Read "75 mph"; returns (value in SI, value in `unit`).

    Errors: QuantityError, whose message says what is wrong and shows a value that would be right.
    """
    found = NUMBER_THEN_UNIT.fullmatch(text) if len(text) <= LONGEST and text.isprintable() else None
    if found is None:
        raise QuantityError(
            f"{typed(text)} is not a number with a unit, write e.g. {_example(unit)}"
            + (" (decimal point, not comma)" if "," in text else "")
        )
    number, written = float(found[1]), found[2]
    if not written and unit:
        raise QuantityError(f'{typed(text)} has no unit, write e.g. "{found[1]} {unit}"')
    if not math.isfinite(number):
        raise QuantityError(f"{typed(text)} is not a finite number")
    try:
        _, roots = root_units(written)
    except QuantityError as error:
        comma = " (decimal point, not comma)" if "," in text else ""
        raise QuantityError(f"{typed(text)}: {error}, write e.g. {_example(unit)}{comma}") from error
    if roots != root_units(unit)[1]:
        raise QuantityError(
            f"{typed(text)} has the dimension {_dimension(roots)}, not that of {unit or 'a plain number'}, write e.g."
            f" {_example(unit)}"
        )
    in_si = number * si_factor(written)
    return in_si, in_si / si_factor(unit)


def typed(value: Any) -> str:
    """A value as it was typed, for a message: on one line, cut where it is long, control characters spelled out."""
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) > 10**LONGEST:
        return f"a whole number of more than {LONGEST} digits"
    shown = (value if value.isprintable() else repr(value)[1:-1]) if isinstance(value, str) else repr(value)
    shown = shown if len(shown) <= LONGEST else f"{shown[: LONGEST - 20]}... ({len(shown)} characters)"
    return f'"{shown}"' if isinstance(value, str) else shown


def _example(unit: str) -> str:
    return f'"1 {unit}"' if unit else '"1"'


def _dimension(roots: dict[str, float]) -> str:
    """Root units as a dimension: "[mass] [time]^-2"."""
    words = {"gram": "mass", "meter": "length", "second": "time", "radian": "angle", "kelvin": "temperature"}
    parts = [
        f"[{words.get(name, name)}]" + (f"^{power:g}" if power != 1 else "") for name, power in sorted(roots.items())
    ]
    return " ".join(parts) or "of a plain number"


@dataclass(frozen=True)
class Quantity:
    """Annotation of a float field: `speed: Annotated[float, Quantity("mph", 1, 300, "running speed v")]`.

    unit    : engineers' unit; "" for a plain number
    low, high : the range allowed, in that unit
    meaning : what the field is, in a few words
    words   : that may stand in place of a value, such as "auto"

    Of a field that may be left out: `Annotated[float | None, Quantity(...)]`. Text is read with its unit and kept in
    SI. A bare number is SI, unless the validation context says `units_required` (case files do): then a field that has
    a unit refuses it.
    """

    unit: str
    low: float
    high: float
    meaning: str
    words: tuple[str, ...] = ()

    def read(self, value: Any, units_required: bool = False) -> float:
        """The value in SI. Errors: QuantityError with the value as typed and the remedy."""
        if isinstance(value, bool) or not isinstance(value, (int, float, str)):
            raise QuantityError(f"{typed(value)} is not a quantity, write e.g. {_example(self.unit)}")
        if isinstance(value, str):
            try:
                in_si, in_unit = parse(value, self.unit)
            except QuantityError as error:
                raise QuantityError(f"{error}" + "".join(f' or "{word}"' for word in self.words)) from None
        elif units_required and (remedy := self.without_unit(value)):
            raise QuantityError(remedy)
        elif abs(value) > LARGEST or value != value:
            raise QuantityError(f"{typed(value)} is not a finite number")
        else:
            in_si, in_unit = float(value), float(value) / si_factor(self.unit)
        self._check_range(value, in_unit)
        return in_si

    def without_unit(self, value: Any) -> str:
        """What to write in place of a bare number; "" where it is none, or has no unit."""
        if isinstance(value, (bool, str)) or not isinstance(value, (int, float)) or not self.unit:
            return ""
        number = f"{value:.12g}" if isinstance(value, float) else typed(value)
        return f'{number} has no unit, write e.g. "{number} {self.unit}"'

    def _check_range(self, as_typed: Any, in_unit: float) -> None:
        slack = ROUNDING * max(abs(self.low), abs(self.high))
        if not self.low - slack <= in_unit <= self.high + slack:
            own = f"{in_unit:.6g} {self.unit}".strip()
            shown = own if str(as_typed).strip() == own else f"{as_typed} = {own}"
            raise QuantityError(f"{shown} is outside {self.range()} for the {self.meaning}")

    def range(self) -> str:
        """The range allowed, in the unit: "[0.5, 350] mph"."""
        choices = "".join(f' or "{word}"' for word in self.words)
        return f"[{self.low:g}, {self.high:g}] {self.unit}".strip() + choices

    def show(self, value: float | str) -> str:
        return value if isinstance(value, str) else show(value, self.unit)

    def _validate(self, value: Any, info: core_schema.ValidationInfo) -> float | str:
        if isinstance(value, str) and value in self.words:
            return value
        try:
            return self.read(value, bool(info.context and info.context.get("units_required")))
        except QuantityError as error:
            raise PydanticCustomError("quantity", "{message}", {"message": str(error)}) from error

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> core_schema.CoreSchema:
        own = core_schema.with_info_plain_validator_function(self._validate)
        return core_schema.nullable_schema(own) if NoneType in get_args(source) else own

    def file_schema(self) -> dict[str, Any]:
        """JSON Schema of a value in a case file: text with a unit where the field has one, else a number, too."""
        if not self.unit:
            return {"anyOf": [{"type": "number", "minimum": self.low, "maximum": self.high}, {"type": "string"}]}
        pattern = "|".join([WITH_UNIT, *(f"^{word}$" for word in self.words)])
        return {"type": "string", "pattern": pattern, "examples": [f"{self.low:g} {self.unit}"]}

    def __get_pydantic_json_schema__(self, schema: core_schema.CoreSchema, handler: Any) -> dict[str, Any]:
        return self.file_schema() | {"description": f"{self.meaning}, {self.range()}"}
