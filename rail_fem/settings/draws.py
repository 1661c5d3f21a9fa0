"""What is drawn at random for each pass of a fleet, and by which law: of a list of changes, and of a damage study."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from pydantic import Field, model_validator

from rail_fem.scene.scene import Frozen
from rail_fem.scene.series import DIGITS
from rail_fem.scene.units import Quantity, QuantityError, parse, show

Change = str | float | int | bool | dict  # of a key's value, as a case file has it


class DrawError(ValueError):
    """A law that nothing can be drawn by; the message says of which key and why."""


class Draw(Frozen):
    """One key of a pass: one of some values, each by its weight, or a number with its unit between low and high, evenly
    or normally about a mean."""

    of: tuple[Change, ...] = Field((), description="values of which one comes")
    weights: tuple[float, ...] = Field((), description="of the values, none: all alike")
    low: str | float | None = Field(None, description="least, with its unit")
    high: str | float | None = Field(None, description="most, with its unit")
    mean: str | float | None = Field(None, description="of a normal law, which low and high may cut off")
    deviation: str | float | None = Field(None, description="standard deviation of a normal law")

    @model_validator(mode="after")
    def _is_one_law(self) -> Draw:
        ends, normal = (self.low, self.high), (self.mean, self.deviation)
        if bool(self.of) == any(value is not None for value in (*ends, *normal)):
            raise ValueError("give either 'of', or low and high, or mean and deviation, which low and high may cut off")
        if not self.of and None in normal and (None in ends or normal != (None, None)):
            raise ValueError("give low and high, or mean and deviation, each with its unit")
        if self.weights and (len(self.weights) != len(self.of) or min(self.weights) < 0 or sum(self.weights) <= 0):
            raise ValueError("weights: one for each value of 'of', none negative, one at least positive")
        return self

    def values(self, key: str, quantity: Quantity | None, shares: np.ndarray) -> list[Change]:
        """Of a key and its quantity at shares (n,) of the distribution, in 0 to 1, as a case file has them. Errors:
        DrawError."""
        if self.of:
            ends = np.cumsum(self.weights or (1.0,) * len(self.of))
            at = np.searchsorted(ends / ends[-1], shares, side="right")
            return [self.of[min(number, len(self.of) - 1)] for number in at]
        unit = "" if quantity is None else quantity.unit
        read = lambda value, without: without if value is None else number_of(key, value, unit)
        low, high = read(self.low, -math.inf), read(self.high, math.inf)
        if not low < high:
            raise DrawError(f"fleet.draw: {key}: low must be less than high")
        if self.mean is None:
            found = low + shares * (high - low)
        else:
            mean, deviation = read(self.mean, 0.0), read(self.deviation, 0.0)
            if deviation <= 0:
                raise DrawError(f"fleet.draw: {key}: the deviation must be positive")
            from scipy.stats import truncnorm  # slow to import

            found = truncnorm.ppf(shares, (low - mean) / deviation, (high - mean) / deviation, mean, deviation)
        texts = [show(value, unit, DIGITS) for value in found]
        return [float(text) if quantity is None else text for text in texts]


class Draws(Frozen):
    """draw : of each key, its law;  seed : of Sobol's sequence, by which they are drawn"""

    seed: int = Field(1, ge=0, description="of the sequence, by which they are drawn")
    draw: dict[str, Draw] = Field(min_length=1, description="law of each key")

    def drawn(self, count: int, quantity: Callable[[str], Quantity | None]) -> list[dict[str, Change]]:
        """Key -> value of each of `count` passes, as a case file has them. quantity : of a key. Errors: DrawError, and
        those of `quantity` for a key that there is not."""
        from scipy.stats import qmc

        sequence = qmc.Sobol(len(self.draw), seed=self.seed).random_base2(math.ceil(math.log2(count)))
        columns = {
            key: draw.values(key, quantity(key), shares)
            for (key, draw), shares in zip(self.draw.items(), sequence[:count].T, strict=True)
        }
        return [{key: values[number] for key, values in columns.items()} for number in range(count)]


def number_of(key: str, value: Any, unit: str) -> float:
    """Of a key's value in a unit [SI]. Errors: DrawError."""
    try:
        return parse(value, unit)[0] if isinstance(value, str) else float(value)
    except QuantityError as error:
        raise DrawError(f"fleet.draw: {key}: {error}") from error
