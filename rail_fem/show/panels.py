"""The kit that figures are made of: panels of what against what, the marks on them, the words around."""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize, to_rgba
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from rail_fem.show.style import BODY, CURVES, NEVER_YIELDED, SKY, STRAIN_COLOURS, TOTAL, new_figure

WITHIN_TEN = (1, 1.5, 2, 3, 5, 7)  # ticks of a logarithmic axis of less than a power of ten
LONGEST_WORDS = 75  # of a curve, in a legend of two columns
LEAST_SPAN = 0.01  # of an axis, of its values: less would draw round-off as a trend


def new_panels(height: float, *shape: int, layout: str = "constrained", **grid: Any) -> tuple[Figure, Any]:
    """A figure of the common width [inch] and its axes, rows and columns as matplotlib's subplots gives them."""
    figure = new_figure(height, layout)
    return figure, figure.subplots(*shape, **grid)


class Panel(NamedTuple):
    """What against what. lines : by its words (x, y), and a third that says how it looks where it is no line: marks and
    dashes as matplotlib has them, "band" of y = (low, high), "bars" of y = (values, half widths, or below and above).
    What begins with a body's name has its colour, what begins with "_" stands in no legend.  log : the logarithmic
    axes, e.g. "xy";  equal : one scale on both."""

    xlabel: str
    ylabel: str
    lines: Mapping[str, Sequence[Any]]
    title: str = ""
    log: str = ""
    equal: bool = False

    def draw(self, axes) -> None:
        """On these axes, lines in the order of the common colours."""
        bodies = [BODY.get(words.lstrip("_").partition(",")[0].partition(" ")[0]) for words in self.lines]
        others = itertools.cycle(colour for colour in CURVES if colour not in bodies)
        for of_body, (words, (x, y, *look)) in zip(bodies, self.lines.items()):
            colour = of_body or next(others)
            if look == ["band"]:
                band(axes, x, y[0], y[1], words, colour)
            elif look == ["bars"]:
                widths = np.asarray(y[1]).tolist()  # matplotlib 3.10 takes an array of one for a number
                axes.errorbar(x, y[0], widths, fmt="o", capsize=3, color=colour, label=words)
            else:
                axes.plot(x, y, *look, color=colour, mfc="none", label=words)
        axes.set(xlabel=self.xlabel, ylabel=self.ylabel, title=self.title)
        positive = dict(zip("xy", np.isfinite(axes.dataLim.minpos)))  # without, a logarithmic axis warns
        scales = {f"{name}scale": "log" for name in self.log if positive[name]}
        axes.set(**scales, aspect="equal" if self.equal else "auto")
        for name in self.log:
            low, high = getattr(axes, f"get_{name}lim")()
            if high < 10 * low:  # powers of ten would stand as 6 x 10^-1, wider than their room
                plain = {"major_locator": LogLocator(subs=WITHIN_TEN), "major_formatter": "{x:g}"}
                getattr(axes, f"{name}axis").set(**plain, minor_formatter=NullFormatter())
        low, high = axes.get_ylim()
        if "y" not in self.log and high - low < (least := LEAST_SPAN * max(abs(low), abs(high))):
            axes.set_ylim((low + high - least) / 2, (low + high + least) / 2)
        if any(not words.startswith("_") for words in self.lines):
            axes.legend(fontsize=9)


def panels_figure(panels: Sequence[Panel], title: str, columns: int = 2) -> Figure:
    """Panels side by side, so many in a row."""
    rows, columns = -(-len(panels) // columns), min(columns, len(panels))
    figure, axes = new_panels(4.2 * rows + 0.8, rows, columns, squeeze=False)
    for axis, panel in zip(axes.flat, panels):
        panel.draw(axis)
    for axis in axes.flat[len(panels) :]:
        axis.remove()
    return titled(figure, title)


def curve(axes, x, y, words: str = "", colour: str = TOTAL, width: float = 2.0, line: Any = "-", **look: Any) -> None:
    """A line, or marks alone where `line` is "". words : in the legend, by choice"""
    axes.plot(x, y, ls=line, color=colour, lw=width, label=words, **look)


def band(axes, x, low, high, words: str = "", colour: str = SKY, strength: float = 0.3) -> None:
    """What lies between two lines over x."""
    axes.fill_between(x, low, high, color=colour, alpha=strength, lw=0, label=words)


def ring(axes, x, y, marker: str, colour: str, words: str = "", size: float = 9.0, width: float = 2.0, **look) -> None:
    """Open marks."""
    axes.plot(x, y, marker, ms=size, mfc="none", mec=colour, mew=width, ls="none", label=words, **look)


def legend_above(axes, columns: int = 2, **look: Any) -> None:
    """The legend over the axes, where it hides no curve; in one column where words would lie over each other."""
    if max(map(len, axes.get_legend_handles_labels()[1]), default=0) > LONGEST_WORDS:
        columns = 1
    place = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0, 1.0, 0.1), "mode": "expand", "borderaxespad": 0.2}
    axes.legend(**{**place, "ncols": columns, "frameon": False, **look})


def cells(axes, polygons, paint, edges="none", width: float | None = None) -> None:
    """Polygons [(corners, 2)] or (k, corners, 2) in the colours `paint`, without a grid over them."""
    axes.add_collection(PolyCollection(polygons, facecolors=paint, edgecolors=edges, linewidths=width))
    axes.grid(False)


def strain_scale(most: float) -> ScalarMappable:
    """Colours of plastic strain from 0 to `most` [%]."""
    return ScalarMappable(Normalize(0.0, most), STRAIN_COLOURS)


def strain_paint(colours: ScalarMappable, strain: np.ndarray) -> np.ndarray:
    """(k, 4) colours of plastic strains (k,) [%]; grey where steel has never yielded."""
    return np.where((strain > 0)[:, None], colours.to_rgba(strain), to_rgba(NEVER_YIELDED))


def strain_bar(figure: Figure, colours: ScalarMappable, axes, of: str = "", share: float = 0.05) -> None:
    """The scale beneath, with its words. share : of the height"""
    bar = figure.colorbar(colours, ax=axes, orientation="horizontal", aspect=60, shrink=0.9, fraction=share)
    bar.set_label(f"equivalent plastic strain (PEEQ){of} [%]; grey: never yielded, white: not meshed")


def titled(figure: Figure, title: str, size: float = 14.0) -> Figure:
    """The figure, with its title: of one line or more."""
    figure.suptitle(title, fontsize=size)
    return figure
