"""Figure of the contact patches that a result keeps: largest elastic pressure, length and width over the position."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from rail_fem.output.result import PassResult
from rail_fem.show.panels import legend_above, new_panels
from rail_fem.show.positions import label_distance, mark_positions
from rail_fem.show.style import BODY, align_labels, give_title

MARKS = {"wing": "o", "nose": "D"}
PRESSURE = {"bem_passage": "elastic pressure\n(half-space) [MPa]"}  # of a model; else of Hertz' ellipse
PANELS = (
    ("max_pressure", 1e-6, "elastic pressure\n(Hertz) [MPa]"),
    ("length", 1e3, "length [mm]"),
    ("width", 1e3, "width [mm]"),
)


def patches_figure(result: PassResult, name: str) -> Figure:
    """A mark for each patch at a kept moment. Needs a result with patches."""
    figure, panels = new_panels(10.0, len(PANELS), 1, sharex=True)
    for axes, (quantity, factor, words) in zip(panels, PANELS):
        for body, marker in MARKS.items():
            mine = [patch for patch in result.patches if patch.region == body]
            x, y = np.array([[1e3 * p.x, factor * getattr(p, quantity)] for p in mine]).reshape(-1, 2).T
            axes.plot(x, y, marker, ms=9, mfc="none", mec=BODY[body], mew=2, ls="none", label=f"patch on the {body}")
        mark_positions(axes, result, label=axes is panels[0])
        axes.margins(y=0.12)
        axes.set_ylim(bottom=0.0)
        axes.set_ylabel(PRESSURE.get(result.model, words) if quantity == "max_pressure" else words)
    legend_above(panels[0])
    label_distance(panels[-1], result)
    align_labels(figure)
    give_title(figure, f"Contact patches at {len({p.time for p in result.patches})} moments", name, result)
    return figure
