"""All figures of a run's folder.

from rail_fem.show.figures import draw_run
draw_run("runs/nose_transfer")
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from rail_fem.hierarchy import MODELS
from rail_fem.output.result import PassResult, load
from rail_fem.show.creep import creep_figure
from rail_fem.show.energies import LINES, energies_figure
from rail_fem.show.fields import CrossingFields, FieldsError, read_crossing
from rail_fem.show.force import force_figure
from rail_fem.show.mesh import mesh_figure
from rail_fem.show.passes import passes_figure
from rail_fem.show.patches import patches_figure
from rail_fem.show.plan import plan_figure
from rail_fem.show.section import section_figure
from rail_fem.show.stress import stress_figure
from rail_fem.show.style import lettering, save, words_instead

HISTORIES: dict[str, Callable[[PassResult, str], Figure]] = {
    "force": force_figure,
    "creep": creep_figure,
    "patches": patches_figure,
    "energies": energies_figure,
    "passes": passes_figure,
}
STRAIN: dict[str, Callable[[PassResult, CrossingFields, str], Figure]] = {
    "plastic_strain_plan": plan_figure,
    "plastic_strain_section": section_figure,
}
FIELDS: dict[str, Callable[[PassResult, Path, str], Figure]] = {  # of the explicit models, which keep all stresses
    "stress_section": stress_figure,
    "mesh": mesh_figure,
}


def draw_run(folder: Path, missing_only: bool = False) -> list[Path]:
    """Draw histories, plastic strain, stresses and mesh of the run in `folder` into folder/figures; returns the PNG
    files that were drawn.

    What a model does not resolve is not drawn; what a run lacks though its model resolves it (lost fields, nothing
    yielded, a failure) gives a figure that says so in words.
    Root only under MPI. Needs no display. Errors: FileNotFoundError without a result, ValueError for another version of
    it, OSError where the folder cannot be written.
    """
    folder = Path(folder)
    result, name = load(folder), folder.resolve().name
    paths = {title: folder / "figures" / f"{title}.png" for title in titles(result)}
    wanted = {title: path for title, path in paths.items() if not (missing_only and path.is_file())}
    with lettering():
        drawn = {title: draw(result, name) for title, draw in HISTORIES.items() if title in wanted}
        if set(STRAIN) & set(wanted):
            drawn |= strain_figures(folder, result, name)
        drawn |= {title: field_figure(title, folder, result, name) for title in FIELDS if title in wanted}
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
        **dict.fromkeys(STRAIN, explicit or resolves_strain(result)),
        **dict.fromkeys(FIELDS, explicit),
    }
    return [title for title, there in has.items() if there]


def resolves_strain(result: PassResult) -> bool:
    """Whether the result names a plastic strain."""
    return any(name.startswith("plastic_strain") for name in result.peaks)


def strain_figures(folder: Path, result: PassResult, name: str) -> dict[str, Figure]:
    """The figures that need fields; in words what is wrong with them, if anything is."""
    try:
        fields = read_crossing(folder)
    except FieldsError as error:
        return {title: words_instead(str(error)) for title in STRAIN}
    return {title: draw(result, fields, name) for title, draw in STRAIN.items()}


def field_figure(title: str, folder: Path, result: PassResult, name: str) -> Figure:
    """One of FIELDS; in words what is wrong with the fields, if anything is."""
    try:
        return FIELDS[title](result, folder, name)
    except FieldsError as error:
        return words_instead(str(error))
