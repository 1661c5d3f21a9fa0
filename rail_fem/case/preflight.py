"""Everything that forbids a run and can be known before anything is meshed or written. What judges one kind of model is
imported where a run asks for it."""

from typing import Any

import numpy as np

from geometry.surfaces.crossing import CrossingError
from rail_fem.case.casefile import late_approach
from rail_fem.contact.rigid import rigid_path, window_errors
from rail_fem.scene.scene import Frozen, Scene
from rail_fem.settings.explicit import FeSettings, FeWindowSettings
from rail_fem.settings.light import BemPlasticSettings, P2Settings, PassSettings, unfit_parts


def preflight_errors(scene: Scene, asked: Frozen, ranks: int, model: str) -> list[str]:
    """Parts of the scene that the model does not take, no track mass under light models, a wheel's body that cannot be,
    too little memory, more ranks than cells, mass scaling that no body allows, a window that leaves the crossing or
    settles across a transfer, a path without a dip, a wheelset that cannot begin on the diverging route, too few
    bearers, a travelling window that is too short, elements too large for it, error bars that were never calibrated, a
    mesh of one's own that cannot be run, what a graphics card does not take, cells of the plastic half-space beyond
    what it takes; one line each with the remedy."""
    if unfit := unfit_parts(scene, asked):
        return [f"run.{model}: {error}" for error in unfit]
    try:
        if isinstance(asked, (PassSettings, FeWindowSettings)):
            from rail_fem.passes.vertical_pass import scene_masses

            scene_masses(scene)
        if scene.wheel_body is not None:
            from rail_fem.passes.wheel_modes import refuse_impossible

            refuse_impossible(scene.wheel_body, scene)
    except ValueError as error:
        return [str(error)]
    if isinstance(asked, P2Settings):
        return _dip_errors(scene, asked, model)
    if isinstance(asked, BemPlasticSettings):
        return _window_errors(scene, asked, model)
    if isinstance(asked, PassSettings):
        return _path_errors(scene, asked, model)
    if not isinstance(asked, FeSettings):
        return []
    from rail_fem.case.estimate import impossible
    from rail_fem.fe.card.fits import unfit_for_card
    from rail_fem.fe.plan.fine_zone import mesh_errors
    from rail_fem.fe.plan.travelling_window import length_errors, with_window
    from rail_fem.result.error_bars import why_not_calibrated

    try:
        settings = with_window(scene, asked)
        errors = window_errors(scene, settings, model)
        _hold_track(scene, settings, settings.start, settings.end)
        if not errors:  # on a window that leaves the crossing there is nothing to estimate
            errors = impossible(scene, settings, ranks, model) + length_errors(scene, settings, model)
    except (CrossingError, ValueError) as error:
        return [f"run.{model}.start, end: {error}"]
    if settings.error_twin == "calibrated" and (apart := why_not_calibrated(scene, settings)):
        errors.append(f'run.{model}.error_twin: "calibrated" was never tried on runs like this: {apart}; take true')
    errors += [f"run.{model}.{error}" for error in unfit_for_card(scene, settings, ranks)]
    errors += [f"run.{model}.{error}" for error in late_approach(scene, settings.start, settings)]
    errors = errors or _start_errors(scene, settings, model)
    if settings.mesh:
        return errors or own_mesh_errors(scene, settings, model)
    return errors or mesh_errors(scene, settings, model)


def _dip_errors(scene: Scene, settings: P2Settings, model: str) -> list[str]:
    """Why the rigid wheel's path has no dip angle, where none is given: it changes body nowhere, or elsewhere."""
    if settings.dip_angle is not None:
        return []
    from rail_fem.models.p2_formula import dip_table, rigid_dip

    try:
        rigid_dip(dip_table(scene))
    except (CrossingError, ValueError) as error:
        return [f"run.{model}: {error}"]
    return []


def _window_errors(scene: Scene, settings: BemPlasticSettings, model: str) -> list[str]:
    """Why the half-space's cells cannot be held, or the wheel not rolled over them."""
    from bem.patch import ContactInputError
    from rail_fem.models.bem_plastic import window_cells

    try:
        for cells in window_cells(scene, settings):
            cells.refuse_too_large(cells.window_memory)
    except ContactInputError as error:
        return [f"run.{model}.cell_size: {settings.cell_size * 1e3:g} mm: {error}"]
    except (CrossingError, ValueError) as error:
        return [f"run.{model}: {error}"]
    return []


def _path_errors(scene: Scene, settings: PassSettings, model: str) -> list[str]:
    """Why the wheel cannot stand at both ends of its path, or a wheelset that is held across not at its first."""
    try:
        rigid_path(scene, np.sort(settings.window(scene)))
        _hold_track(scene, settings, *settings.window(scene))
    except (CrossingError, ValueError) as error:
        return [f"run.{model}.start, end: {error}"]
    return _start_errors(scene, settings, model)


def _hold_track(scene: Scene, settings: Any, *ends: float) -> None:
    """Errors: ValueError where too few bearers carry the track about these ends of a window [m]."""
    if scene.bearers is not None:
        from rail_fem.passes.track_beam import track_beam

        track_beam(scene.bearers, *sorted(ends), settings.beam_element, settings.beam_reach)


def _start_errors(scene: Scene, settings: Any, model: str) -> list[str]:
    if scene.diverging is None and getattr(settings, "check_rail", None) is None:
        return []
    from rail_fem.passes.lateral_start import start_errors

    return [f"run.{model}: {error}" for error in start_errors(scene, settings)]


def own_mesh_errors(scene: Scene, settings: FeSettings, model: str) -> list[str]:
    """Why a mesh from a file cannot be run."""
    from geometry.meshing.hexmesh import MeshError
    from rail_fem.fe.plan.own_mesh import own_mesh

    try:
        own_mesh(scene, settings)
    except (MeshError, OSError) as error:
        return [f"run.{model}.mesh: {error}"]
    return []
