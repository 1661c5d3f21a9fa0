"""Passes repeated on the steel that the one before has left: what each did, in words and as a figure."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from rail_fem.output.quantities import REPORTED
from rail_fem.output.result import NAN, PassResult
from rail_fem.show.metal import amount
from rail_fem.show.panels import new_panels
from rail_fem.show.style import NOSE, TOTAL, WING, give_title

MANY = 30  # passes, from which they are drawn as lines over their logarithm
LEAST_ADDED = 1e-3  # [mm3], below which nothing is drawn: the steel is at rest

COLUMNS = {
    "impact_on_wheel": "impact on wheel",
    "largest_force_wing": "largest on wing",
    "block_wing": "PEEQ block wing",
    "block_nose": "block nose",
    "integral_wing": "integral wing",
    "integral_nose": "integral nose",
}


def passes_rows(result: PassResult) -> list[str]:
    """A line for each pass, the first ten and the last ten; nothing for a single pass."""
    if not result.passes:
        return []
    lines = [f"  {'pass':>6}" + "".join(f"{head:>18}" for head in COLUMNS.values())]
    count = len(result.passes)
    for number, report in enumerate(result.passes, 1):
        if 10 < number <= count - 10:
            continue
        cells = (amount(report.get(name, NAN), REPORTED[name].unit) for name in COLUMNS)
        lines.append(f"  {number:>6}" + "".join(f"{cell:>18}" for cell in cells))
    return lines


def passes_figure(result: PassResult, name: str) -> Figure:
    """Forces, plastic strain and what each pass adds to it, against the number of the pass."""
    figure, (forces, strain, growth) = new_panels(5.2, 1, 3)
    number = np.arange(1, len(result.passes) + 1)
    many = len(number) > MANY
    dots, circle = ("-", "-") if many else ("o-", "o")

    def of(quantity: str) -> np.ndarray:
        return np.array([report.get(quantity, NAN) for report in result.passes])

    for body, colour in (("wing", WING), ("nose", NOSE)):
        forces.plot(number, of(f"largest_force_{body}") / 1e3, dots, color=colour, label=body, ms=5)
    forces.plot(number, of("impact_on_wheel") / 1e3, circle, color=TOTAL, mfc="none", label="impact on the wheel", ms=9)
    forces.set(xlabel="pass", ylabel="largest force [kN]", title="forces")
    for body, colour in (("wing", WING), ("nose", NOSE)):
        block, whole = of(f"block_{body}"), of(f"integral_{body}") * 1e9
        strain.plot(number, 100 * block, dots, color=colour, label=body, ms=5)
        added = np.diff(whole, prepend=0.0)
        growth.semilogy(number, np.where(added > LEAST_ADDED, added, np.nan), dots, color=colour, label=body, ms=5)
    strain.set(xlabel="pass", ylabel="PEEQ, mean of the worst 5 x 5 x 3 mm [%]", title="plastic strain so far")
    growth.set(xlabel="pass", ylabel="integral of PEEQ added [mm3]", title="added by the pass")
    for axes in (forces, strain, growth):
        axes.legend()
        if many:
            axes.set_xscale("log")
        else:
            axes.xaxis.get_major_locator().set_params(integer=True)
    give_title(figure, "passes on the steel that the one before has left", name, result)
    return figure
