"""JSON that every reader takes: no NaN and no infinities as literals."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

NAN = float("nan")


def to_plain(value: Any) -> Any:
    """Plain values: NaN becomes null, infinities "inf" and "-inf", arrays and tuples lists, paths text."""
    if isinstance(value, Mapping):
        return {str(key): to_plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [to_plain(entry) for entry in value]
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else ("inf" if value > 0 else "-inf")
    return value


def nan_for_none(value: Any, keep: tuple[str, ...] = ()) -> Any:
    """The reverse: null becomes NaN, "inf" and "-inf" infinities. keep : keys whose values stay as they are"""
    if isinstance(value, dict):
        return {key: entry if key in keep else nan_for_none(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [nan_for_none(entry) for entry in value]
    if value is None:
        return NAN
    return {"inf": math.inf, "-inf": -math.inf}.get(value, value) if isinstance(value, str) else value


def dumps(value: Any) -> str:
    """The text, on several lines."""
    return json.dumps(to_plain(value), indent=1, allow_nan=False)


def one_line(value: Any) -> str:
    """The same on one line, which is written in a tenth of the time."""
    return json.dumps(to_plain(value), allow_nan=False)
