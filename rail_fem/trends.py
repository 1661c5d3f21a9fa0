"""Trends over cases: a sentence like "a faster wheel strikes the nose harder", checked on the results of every rung that resolves it.

Read from a TOML file, so that a study of one's own can state its own:

    [[group]]
    title = "Vehicle speed"
    cases = ["case_03", "case_02", "case_01"]

    [[group.trend]]
    says = "a faster wheel strikes the nose harder"
    quantity = "nose peak"
    order = ["case_03", "case_02", "case_01"]    # from the smallest to the largest
    published = "129.0, 172.5, 234.0 kN"         # what a source found, as text
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import Field, ValidationError

from rail_fem.compare import NOSE_PEAKS, peak
from rail_fem.ladder import LADDER
from rail_fem.result import PassResult
from rail_fem.scene import Frozen

SAME = 0.01  # relative change below which two values say nothing of a trend

Results = Mapping[str, Mapping[str, PassResult]]  # case -> model -> result


class TrendError(ValueError):
    """A file of trends that cannot be used; the message holds all faults."""


@dataclass(frozen=True)
class Measure:
    """A number of a result, NaN where it is not resolved; value * factor is in `unit`."""

    of: Callable[[PassResult], float]
    unit: str
    factor: float


def largest_dip(result: PassResult) -> float:
    """How far the crossing's base goes down below its place at the start [m]."""
    height = result.history["crossing_height"]
    return float(height[np.isfinite(height)][0] - np.nanmin(height)) if np.isfinite(height).any() else np.nan


MEASURES: dict[str, Measure] = {
    "nose peak": Measure(lambda r: peak(r, *NOSE_PEAKS), "kN", 1e-3),
    "wing peak": Measure(lambda r: peak(r, "force_wing"), "kN", 1e-3),
    "peak": Measure(lambda r: peak(r, "force"), "kN", 1e-3),
    "nose strain": Measure(lambda r: peak(r, "plastic_strain_nose"), "%", 100.0),
    "wing strain": Measure(lambda r: peak(r, "plastic_strain_wing"), "%", 100.0),
    "crossing dip": Measure(largest_dip, "mm", 1e3),
    "transfer x": Measure(lambda r: r.transfer_x, "mm", 1e3),
}


class Trend(Frozen):
    """quantity : of MEASURES;  order : cases from the smallest to the largest value"""

    says: str
    quantity: str
    order: tuple[str, ...] = Field(min_length=2)
    published: str = ""


class Group(Frozen):
    """Cases that belong on one figure, and what is said of them."""

    title: str
    cases: tuple[str, ...] = Field(min_length=1)
    trend: tuple[Trend, ...] = ()


class _File(Frozen):
    group: tuple[Group, ...]


def load_groups(path: Path) -> tuple[Group, ...]:
    """Groups and trends of a TOML file. Errors: TrendError with the key and what to do."""
    path = Path(path)
    try:
        found = _File.model_validate(tomllib.loads(path.read_text(encoding="utf-8"))).group
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise TrendError(f"{path}: cannot be read: {error}") from error
    except ValidationError as error:
        faults = [f"{'.'.join(map(str, fault['loc']))}: {fault['msg']}" for fault in error.errors()]
        raise TrendError("\n  ".join([f"{path}: {len(faults)} fault(s)", *faults])) from error
    for group in found:
        for trend in group.trend:
            if trend.quantity not in MEASURES:
                raise TrendError(f"{path}: group '{group.title}': quantity '{trend.quantity}' is not one of {', '.join(MEASURES)}")
    return found


@dataclass(frozen=True)
class Finding:
    """What one rung says of a trend. verdict : agrees, differs, same (no change above SAME);  values in the trend's order, shown units"""

    model: str
    verdict: str
    values: tuple[float, ...]

    def words(self, unit: str) -> str:
        return f"{self.model} {self.verdict}: {', '.join(f'{v:.4g}' for v in self.values)} {unit}"


def check(trend: Trend, results: Results) -> list[Finding]:
    """A finding for every rung that resolves the quantity in all cases of the trend, cheapest first."""
    measure, found = MEASURES[trend.quantity], []
    for model in LADDER:
        values = [measure.of(results[case][model]) if model in results.get(case, {}) else np.nan for case in trend.order]
        if np.isfinite(values).all():
            found.append(Finding(model, verdict(np.array(values)), tuple(measure.factor * v for v in values)))
    return found


def verdict(values: np.ndarray) -> str:
    """Of values (n,) that should grow: a step down by more than SAME contradicts; none up by more than SAME says nothing."""
    steps = np.diff(values) / np.maximum(np.abs(values[:-1]), 1e-300)
    if (steps < -SAME).any():
        return "differs"
    return "agrees" if (steps > SAME).any() and values[-1] > values[0] else "same"


def trend_lines(groups: tuple[Group, ...], results: Results) -> list[str]:
    """Markdown: every trend with what is published and what each rung finds."""
    lines = []
    for group in groups:
        lines += [f"## {group.title}", ""]
        for trend in group.trend:
            found = check(trend, results)
            unit = MEASURES[trend.quantity].unit
            lines.append(f"- {trend.says} ({trend.quantity}: {' < '.join(trend.order)})" + (f"; published: {trend.published}" if trend.published else ""))
            lines += [f"  - {finding.words(unit)}" for finding in found] or ["  - no rung has all of these results"]
        lines.append("")
    return lines
