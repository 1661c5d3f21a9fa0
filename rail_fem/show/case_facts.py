"""What `check` finds of a case, as plain values for scripts."""

from dataclasses import asdict
from typing import Any

from rail_fem.case.casefile import Case
from rail_fem.case.estimate import estimate_run
from rail_fem.case.preflight import preflight_errors
from rail_fem.case.warnings import case_warnings, scene_warnings
from rail_fem.light.mass_scaling import static_patch
from rail_fem.light.rigid import window_path, with_window
from rail_fem.settings.explicit import FeSettings


def case_facts(case: Case, model: str, ranks: int) -> dict[str, Any]:
    """Scene and numerics as they are understood, what follows from them, cost, warnings, and the errors that forbid the
    run [SI]. cost : None for a light model"""
    scene, asked = case.scene, case.runs[model]
    errors = preflight_errors(scene, asked, ranks, model)
    settings = asked if errors else with_window(scene, asked)
    explicit = settings if isinstance(settings, FeSettings) and not errors else None
    patch = static_patch(scene)
    derived = {
        "axle_load": scene.axle_load,
        "static_wheel_load": scene.static_wheel_load,
        "wheel_sprung_mass": scene.vehicle.wheel_sprung_mass,
        "wheel_unsprung_mass": scene.vehicle.wheel_unsprung_mass,
        "wheel_datum_y": scene.wheel_datum_y,
        "static_patch_length": 2 * patch.semi_x,
        "static_patch_width": 2 * patch.semi_y,
        "static_patch_max_pressure": patch.max_pressure,
    }
    if explicit is not None:
        derived["rigid_transfers"] = window_path(scene, explicit).transfers
    return {
        "case": case.path,
        "title": case.title,
        "model": model,
        "scene": scene.model_dump(mode="json"),
        "settings": settings.model_dump(mode="json"),
        "derived": derived,
        "cost": asdict(estimate_run(scene, explicit, ranks)) | {"ranks": ranks} if explicit is not None else None,
        "warnings": scene_warnings(scene) if errors else case_warnings(scene, settings),
        "errors": errors,
    }
