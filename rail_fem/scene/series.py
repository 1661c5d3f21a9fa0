"""A series of a quantity as it is typed: "30 mph:100 mph:8" for eight values evenly from one to the other."""

from dataclasses import dataclass

import numpy as np

from rail_fem.scene.units import NUMBER_THEN_UNIT, QuantityError, parse, show, typed

MOST_VALUES = 100_000
DIGITS = 9  # of a value of a series written as text


@dataclass(frozen=True)
class Series:
    """values : (n,) [SI]; unit : as the first was typed"""

    values: np.ndarray
    unit: str

    def texts(self) -> list[str]:
        """The values as a case file has them: "30 mph"."""
        return [show(value, self.unit, DIGITS) for value in self.values]


def is_series(text: str) -> bool:
    """Whether a text has the form FIRST:LAST:COUNT."""
    return text.count(":") == 2


def read_series(text: str, unit: str) -> Series:
    """One value "3 mm", or "-6 mm:6 mm:13". unit : whose dimension they must have; "" is a plain number.

    Errors: QuantityError with what is wrong and how it is written.
    """
    parts = text.split(":")
    if len(parts) not in (1, 3) or (len(parts) == 3 and not _is_count(parts[2])):
        raise QuantityError(
            f'{typed(text)} is no series: write e.g. "{f"-6 {unit}".strip()}:{f"6 {unit}".strip()}:13" for 13 values'
            f" from one to the other, 2 to {MOST_VALUES}"
        )
    ends = [parse(part.strip(), unit)[0] for part in parts[:2]]
    written = NUMBER_THEN_UNIT.fullmatch(parts[0].strip())
    return Series(
        np.linspace(*ends, int(parts[2])) if len(ends) == 2 else np.array(ends), written[2] if written else unit
    )


def _is_count(text: str) -> bool:
    return text.strip().isdigit() and len(text.strip()) < 8 and 2 <= int(text) <= MOST_VALUES
