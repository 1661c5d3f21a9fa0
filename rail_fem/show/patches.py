"""Figure of the contact patches that a result keeps: largest elastic pressure, length and width over the position."""

import numpy as np
from matplotlib.figure import Figure

from rail_fem.result.result import PassResult
from rail_fem.show.panels import Panel
from rail_fem.show.positions import over_distance

MARKS = {"wing": "o", "nose": "D"}
PRESSURE = {"bem_passage": "elastic pressure\n(half-space) [MPa]"}  # of a model; else of Hertz' ellipse
PANELS = (
    ("max_pressure", 1e-6, "elastic pressure\n(Hertz) [MPa]"),
    ("length", 1e3, "length [mm]"),
    ("width", 1e3, "width [mm]"),
)


def patches_figure(result: PassResult, name: str) -> Figure:
    """A mark for each patch at a kept moment. Needs a result with patches."""
    panels = []
    for quantity, factor, words in PANELS:
        lines = {}
        for body, marker in MARKS.items():
            mine = [patch for patch in result.patches if patch.region == body]
            x, y = np.array([[1e3 * p.x, factor * getattr(p, quantity)] for p in mine]).reshape(-1, 2).T
            lines[f"{body}, patches"] = x, y, marker
        panels.append(Panel("", PRESSURE.get(result.model, words) if quantity == "max_pressure" else words, lines))
    return over_distance(result, panels, f"Contact patches at {len({p.time for p in result.patches})} moments", name)
