"""Passes repeated on the steel that the one before has left: what each did, in words and as a figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from geometry.surfaces.bodies import BODIES
from rail_fem.result.quantities import REPORTED
from rail_fem.result.result import NAN, PassResult
from rail_fem.show.metal import amount

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MANY = 30  # passes, from which they are drawn as lines over their logarithm
LEAST_ADDED = 1e-3  # [mm3], below which nothing is drawn: the steel is at rest
FORETOLD = 10  # times as many passes
FROM = 8  # passes, below which nothing is foretold

COLUMNS = {
    "impact_on_wheel": "impact on wheel",
    "largest_force_wing": "largest on wing",
    "block_wing": "PEEQ block wing",
    "block_nose": "block nose",
    "integral_wing": "integral wing",
    "integral_nose": "integral nose",
}


def passes_rows(result: PassResult) -> list[str]:
    """A line for each pass, the first ten and the last ten, and what is foretold; nothing for a single pass."""
    if not result.passes:
        return []
    lines = [f"  {'pass':>6}" + "".join(f"{head:>18}" for head in COLUMNS.values())]
    count = len(result.passes)
    for number, report in enumerate(result.passes, 1):
        if 10 < number <= count - 10:
            continue
        cells = (amount(report.get(name, NAN), REPORTED[name].unit) for name in COLUMNS)
        lines.append(f"  {number:>6}" + "".join(f"{cell:>18}" for cell in cells))
    return lines + (_foretold(result.passes) if count >= FROM else [])


def _foretold(passes: Sequence[Mapping[str, float]]) -> list[str]:
    """Strain after FORETOLD times as many passes; nothing where it has stopped to grow."""
    of = lambda name: np.array([report.get(name, NAN) for report in passes])
    strains = [name for name in COLUMNS if name.startswith(("block", "integral"))]
    later = {name: after_passes(of(name), FORETOLD * len(passes)) for name in strains}
    if not np.isfinite(list(later.values())).any():
        return []
    cells = (amount(later[name], REPORTED[name].unit) if name in later else "-" for name in COLUMNS)
    words = "foretold: what the last half of the passes added goes on as a power of their number"
    return [f"  {FORETOLD * len(passes):>6}" + "".join(f"{cell:>18}" for cell in cells) + f"   {words}"]


def after_passes(values: np.ndarray, count: int) -> float:
    """What grows in each of k passes, values (k,), after `count` of them: what the last half of the passes added, as
    a power of their number by least squares of the logarithms, goes on. NaN where one of these added nothing.

    Error: none for such growth; of steel that ratchets: docs/models/cyclic.md.
    """
    number = np.arange(1, len(values) + 1)
    half = slice(len(values) // 2, None)
    added = np.diff(values, prepend=0.0)[half]
    if len(added) < 2 or not (added > 0).all():
        return NAN
    power, factor = np.polyfit(np.log(number[half]), np.log(added), 1)
    return float(values[-1] + np.exp(factor) * (np.arange(len(values) + 1, count + 1.0) ** power).sum())


def passes_figure(result: PassResult, name: str) -> Figure:
    """Forces, plastic strain and what each pass adds to it, against the number of the pass."""
    from rail_fem.show.panels import Panel, panels_figure  # matplotlib, where something is drawn
    from rail_fem.show.style import give_title

    number = np.arange(1, len(result.passes) + 1)
    log, look = ("x", "-") if len(number) > MANY else ("", "o-")
    of = lambda quantity: np.array([report.get(quantity, NAN) for report in result.passes])
    forces = {body: (number, of(f"largest_force_{body}") / 1e3, look) for body in BODIES}
    forces["impact on the wheel"] = number, of("impact_on_wheel") / 1e3, look
    strain = {body: (number, 100 * of(f"block_{body}"), look) for body in BODIES}
    added = {body: np.diff(of(f"integral_{body}") * 1e9, prepend=0.0) for body in BODIES}
    growth = {body: (number, np.where(new > LEAST_ADDED, new, np.nan), look) for body, new in added.items()}
    panels = [
        Panel("pass", "largest force [kN]", forces, "forces", log),
        Panel("pass", "PEEQ, mean of the worst 5 x 5 x 3 mm [%]", strain, "plastic strain so far", log),
        Panel("pass", "integral of PEEQ added [mm3]", growth, "added by the pass", f"{log}y"),
    ]
    figure = panels_figure(panels, "", 3)
    give_title(figure, "passes on the steel that the one before has left", name, result)
    return figure
