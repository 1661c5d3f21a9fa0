"""All figures of a run's folder.

from rail_fem.show.figures import draw_run
draw_run("runs/nose_transfer")
"""

import functools
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from rail_fem.hierarchy import MODELS
from rail_fem.result.result import PassResult, load
from rail_fem.show.energies import LINES, energies_figure
from rail_fem.show.force import force_figure
from rail_fem.show.histories import creep_figure, patches_figure
from rail_fem.show.passes import passes_figure
from rail_fem.show.style import lettering, save, words_instead

HISTORIES: dict[str, Callable[[PassResult, str], Figure]] = {
    "force": force_figure,
    "creep": creep_figure,
    "patches": patches_figure,
    "energies": energies_figure,
    "passes": passes_figure,
}
STRAIN = "plastic_strain_plan", "plastic_strain_section"
FIELDS = (*STRAIN, "stress_section", "mesh")  # stresses and meshes are the explicit models' alone


def draw_run(folder: Path, missing_only: bool = False, only: Sequence[str] = ()) -> list[Path]:
    """Draw histories, plastic strain, stresses and mesh of the run in `folder` into folder/figures; returns the PNG
    files that were drawn. only : their titles; none: all

    What a model does not resolve is not drawn; what a run lacks though its model resolves it (lost fields, nothing
    yielded, a failure) gives a figure that says so in words.
    Root only under MPI. Needs no display. Errors: FileNotFoundError without a result, ValueError for another version of
    it, OSError where the folder cannot be written.
    """
    folder = Path(folder)
    result, name = load(folder), folder.resolve().name
    paths = {title: folder / "figures" / f"{title}.png" for title in titles(result) if not only or title in only}
    wanted = {title: path for title, path in paths.items() if not (missing_only and path.is_file())}
    with lettering():
        drawn = {title: draw(result, name) for title, draw in HISTORIES.items() if title in wanted}
        if missing := [title for title in FIELDS if title in wanted]:
            drawn |= field_figures(folder, result, name, missing)
        return [save(drawn[title], path) for title, path in wanted.items()]


def titles(result: PassResult) -> list[str]:
    """The figures that a run of this model has."""
    explicit = result.model not in MODELS or MODELS[result.model].parallel
    has = {
        "force": len(result.history["x"]) or result.fault,
        "creep": np.isfinite(result.history["force_longitudinal"]).any(),
        "patches": len(result.patches),
        "passes": result.passes,
        "energies": any(np.isfinite(result.history[column]).any() for column in LINES),
        **dict.fromkeys(FIELDS, explicit),
        **dict.fromkeys(STRAIN, explicit or any(name.startswith("plastic_strain") for name in result.peaks)),
    }
    return [title for title, there in has.items() if there]


def field_figures(folder: Path, result: PassResult, name: str, wanted: Sequence[str] = FIELDS) -> dict[str, Figure]:
    """The figures that need fields; in words what is wrong with these, if anything is."""
    from rail_fem.show.fields import FieldsError, read_crossing
    from rail_fem.show.mesh import mesh_figure
    from rail_fem.show.plan import plan_figure
    from rail_fem.show.section import section_figure
    from rail_fem.show.stress import stress_figure

    crossing = functools.cache(lambda: read_crossing(folder))
    draw: dict[str, Callable[[], Figure]] = {
        "plastic_strain_plan": lambda: plan_figure(result, crossing(), name),
        "plastic_strain_section": lambda: section_figure(result, crossing(), name),
        "stress_section": lambda: stress_figure(result, folder, name),
        "mesh": lambda: mesh_figure(result, folder, name),
    }
    found = {}
    for title in wanted:
        try:
            found[title] = draw[title]()
        except FieldsError as error:
            found[title] = words_instead(str(error))
    return found
