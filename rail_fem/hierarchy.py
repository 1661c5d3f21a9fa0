"""The hierarchy of models: each model is one file in rail_fem/models with `solve(scene, settings, ...) -> PassResult`.

A model is imported only when it is asked for, so the light part runs without dolfinx and MPI.
"""

import importlib
import logging
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from rail_fem.result.versions import HOW_TO_GET
from rail_fem.scene.input_errors import suggest
from rail_fem.scene.scene import Frozen, Scene
from rail_fem.settings.explicit import FeSettings, FeWindowSettings
from rail_fem.settings.light import (
    BemPassageSettings,
    BemPlasticSettings,
    LumpedSettings,
    P2Settings,
    RigidHertzSettings,
    unfit_parts,
)

if TYPE_CHECKING:
    from rail_fem.processes.progress import Progress
    from rail_fem.result.result import PassResult


LOG = logging.getLogger(__name__)
OWN_PACKAGES = ("rail_fem", "bem", "geometry")


class ModelUnavailable(RuntimeError):
    """A model whose libraries are not installed; the message says how to get them."""


@dataclass(frozen=True)
class Model:
    """Where a model lives and what its numerics are called. parallel: runs on all ranks of mpirun;  off : relative,
    within which nine tenths and all of its forces are of fe_full's in docs/sixteen_cases.md; None: not told there"""

    module: str
    settings: type[Frozen]
    parallel: bool
    meaning: str
    off: tuple[float, float] | None = None


MODELS: dict[str, Model] = {
    "p2_formula": Model(
        "rail_fem.models.p2_formula",
        P2Settings,
        False,
        "the standard's formula for the force at the nose",
        (0.68, 0.81),
    ),
    "lumped": Model(
        "rail_fem.models.lumped",
        LumpedSettings,
        False,
        "a few masses and one contact spring over the rigid wheel path",
        (1.89, 2.40),
    ),
    "rigid_hertz": Model(
        "rail_fem.models.rigid_hertz",
        RigidHertzSettings,
        False,
        "Hertz contacts on the true surfaces of wing and nose",
        (0.10, 0.20),
    ),
    "bem_passage": Model(
        "rail_fem.models.bem_passage",
        BemPassageSettings,
        False,
        "as rigid_hertz, with stiffness and patches from boundary elements",
        (0.10, 0.25),
    ),
    "bem_plastic": Model(
        "rail_fem.models.bem_plastic",
        BemPlasticSettings,
        False,
        "forces as rigid_hertz, rolled over an elastoplastic half-space along wing and nose",
        (0.10, 0.20),
    ),
    "fe_window": Model(
        "rail_fem.models.fe_window",
        FeWindowSettings,
        True,
        "explicit elastoplastic FE of the nose alone, begun as rigid_hertz arrives there",
    ),
    "fe_full": Model(
        "rail_fem.models.fe_full", FeSettings, True, "explicit elastoplastic FE of the whole window, the reference"
    ),
}
"""The models by name, from the least expensive to the most expensive."""


def smoke_requested() -> bool:
    """RAIL_FEM_SMOKE=1 in the environment: the same path through the program in a few coarse steps."""
    return os.environ.get("RAIL_FEM_SMOKE", "") not in ("", "0")


def load(model: str) -> ModuleType:
    """Import one model. Errors: KeyError for an unknown model, ModelUnavailable when its libraries are missing."""
    if model not in MODELS:
        raise KeyError(f"no model {model!r}{suggest(str(model), MODELS)}: choose among {', '.join(MODELS)}")
    try:
        return importlib.import_module(MODELS[model].module)
    except ImportError as error:
        if (error.name or "").partition(".")[0] in OWN_PACKAGES:
            raise
        raise ModelUnavailable(
            f"model {model} needs {error.name}, which cannot be imported ({error}): {HOW_TO_GET}"
        ) from error


def solve(
    model: str,
    scene: Scene,
    settings: Frozen | Mapping[str, Any] | None = None,
    folder: Path | str | None = None,
    restart: bool = False,
    progress: "Progress | None" = None,
) -> "PassResult":
    """Run one model. Collective for parallel models. What goes on is logged (`logging`, names beginning with
    "rail_fem").

    Parameters
    ----------
    model : str
        A name of `rail_fem.MODELS`.
    scene : Scene
        What is there, as `load_case(FILE).scene`.
    settings : settings of the model or mapping, optional
        Its numerics; a mapping is checked as a case file's section, so lengths have units ("300 mm"). None: the
        defaults.
    folder : Path or str, optional
        Where fields, figures and restart files go; None writes nothing.
    restart : bool
        Go on from the restart files in `folder`.
    progress : Progress, optional
        Told each report.

    Returns
    -------
    PassResult

    Raises
    ------
    KeyError
        For an unknown model.
    ModelUnavailable
        Where its libraries are missing, with how to get them.
    TypeError
        For what is no scene, and for settings of another model.
    ValueError
        For settings that are none (InputError), or that the scene does not allow; beside it the model's own errors.

    Examples
    --------
    >>> scene = rail_fem.load_case(rail_fem.example("nose_transfer")).scene
    >>> result = rail_fem.solve("p2_formula", scene)
    >>> bool(result.peaks["p2"].value > scene.static_wheel_load)  # [N]
    True
    """
    solver, kind = load(model), MODELS[model].settings
    if not isinstance(scene, Scene):
        raise TypeError(f"{model}: a {type(scene).__name__} is no Scene: give load_case(FILE).scene")
    if settings is None or isinstance(settings, Mapping):
        settings = kind.as_written(settings or {})
    if not isinstance(settings, kind):
        raise TypeError(f"{model} takes {kind.__name__}, not {type(settings).__name__}: give its own, or a dict")
    if unfit := unfit_parts(scene, settings):
        raise ValueError(f"{model}: {unfit[0]}")
    from kernel_cache import compile_time

    folder, before = None if folder is None else Path(folder), compile_time()
    LOG.info("%s: begun", model)
    result = solver.solve(scene, settings, folder=folder, restart=restart, progress=progress)
    compiled = compile_time() - before
    LOG.info("%s: %s in %.1f s", model, result.fault or result.cut_off or "finished", result.cost.wall_time)
    for warning in result.warnings:
        LOG.warning("%s: %s", model, warning)
    cost = replace(result.cost, wall_time=result.cost.wall_time + compiled, compile_time=compiled)
    return replace(result, cost=cost)
