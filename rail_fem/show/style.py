"""How every figure looks: colours that colour-blind readers tell apart (Okabe and Ito), letters readable at 1200
pixels, the title."""

import textwrap
from pathlib import Path

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.text import Text

from rail_fem.files.atomic import write_atomically
from rail_fem.result.result import PassResult
from rail_fem.scene.scene import Scene
from rail_fem.scene.units import show

TOTAL, WING, NOSE = "#000000", "#0072B2", "#D55E00"
GREEN, PURPLE, ORANGE, SKY, GREY = "#009E73", "#AA4499", "#E69F00", "#56B4E9", "#777777"
BODY = {"wing": WING, "nose": NOSE}
CURVES = (TOTAL, NOSE, WING, GREEN, ORANGE, PURPLE, SKY)  # where curves of one kind are told apart
# colour and marker of each model, where models are told apart
LINE_OF_MODEL = {
    "p2_formula": (GREY, "D"), "lumped": (ORANGE, "^"), "rigid_hertz": (SKY, "o"), "bem_passage": (GREEN, "s"),
    "bem_plastic": ("#332288", "X"),
    "fe_window": (PURPLE, "v"), "fe_full": (TOTAL, "P"),
}  # fmt: skip
NEVER_YIELDED = "#E4E4E4"
STRAIN_COLOURS = "viridis_r"
HALO = [withStroke(linewidth=4, foreground="white")]  # keeps letters legible over curves
WIDTH = 12.0  # inch
DOTS = 150  # per inch: 1800 pixels wide, and still readable when shrunk to 1200
LETTERS = {
    "font.family": "DejaVu Sans",
    "font.size": 12,
    "axes.labelsize": 13,
    "axes.titlesize": 13,
    "legend.fontsize": 11,
    "axes.grid": True,
    "grid.color": "#DDDDDD",
    "axes.axisbelow": True,
}


def new_figure(height: float, layout: str = "constrained") -> Figure:
    """An empty figure of the common width [inch] that needs no display."""
    figure = Figure(figsize=(WIDTH, height), dpi=DOTS, layout=layout)
    FigureCanvasAgg(figure)
    return figure


def align_labels(figure: Figure) -> None:
    """The y labels of all axes in one line; laid out a first time here, because the layout does not know of their line
    until they stand in it, and would cut off the widest."""
    figure.align_ylabels()
    if (layout := figure.get_layout_engine()) is not None:
        layout.execute(figure)


def lettering():
    """Context in which figures are made and saved; the caller's own matplotlib settings stay as they are."""
    return mpl.rc_context(LETTERS)


def save(figure: Figure, path: Path, dots: int = DOTS) -> Path:
    """Write a PNG of so many dots per inch whole or not at all. Errors: OSError.

    A title with a dollar is that title, no formula; ticks of an axis in powers of ten are."""
    for text in figure.findobj(Text):
        if "$" in (words := text.get_text()) and not words.startswith("$\\mathdefault"):
            text.set_parse_math(False)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, lambda temporary: figure.savefig(temporary, dpi=dots, facecolor="white"))
    return path


def scene_words(scene: Scene, speed: bool = True) -> str:
    """Crossing, wheel, speed if asked for, direction and load in one line."""
    wheel = scene.wheel.name
    fast = f"{show(scene.speed, 'mph', 3)} ({show(scene.speed, 'km/h', 3)}) " if speed else ""
    return (
        f"{scene.crossing.name}, wheel {wheel}, {fast}{scene.direction}, wheel"
        f" load {show(scene.static_wheel_load, 'kN', 3)}"
    )


def in_lines(words: str) -> str:
    """A title in lines that fit on a figure."""
    return "\n".join(textwrap.wrap(words, 110))


def give_title(figure: Figure, what: str, name: str, result: PassResult) -> int:
    """What is seen, of which run and case, of which scene; and that the run failed, if it did. Returns how many lines
    these are."""
    run = f"run {name}, model {result.model}" if name != result.model else f"model {result.model}"
    lines = [f"{what}: {run}", *filter(None, [in_lines(result.title)]), scene_words(result.scene)]
    if result.fault:
        lines.append(in_lines(f"THIS RUN FAILED: {result.fault}"))
    title = figure.suptitle("\n".join(lines), fontsize=14)
    return title.get_text().count("\n") + 1


def words_instead(words: str) -> Figure:
    """A figure that says why there is nothing to draw."""
    figure = new_figure(4.0)
    figure.text(0.5, 0.4, "\n".join(textwrap.wrap(words, 90)), ha="center", va="center", fontsize=14)
    return figure
