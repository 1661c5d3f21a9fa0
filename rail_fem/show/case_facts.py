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
    scene, settings = case.scene, case.runs[model]
    errors = preflight_errors(scene, settings, ranks, model)
    explicit = isinstance(settings, FeSettings)
    settings = settings if errors else with_window(scene, settings)
    patch = static_patch(scene)
    derived = {
        "static_wheel_load": scene.static_wheel_load,
        "wheel_sprung_mass": scene.vehicle.wheel_sprung_mass,
        "wheel_unsprung_mass": scene.vehicle.wheel_unsprung_mass,
        "wheel_datum_y": scene.wheel_datum_y,
        "static_patch_length": 2 * patch.semi_x,
        "static_patch_width": 2 * patch.semi_y,
        "static_patch_max_pressure": patch.max_pressure,
    }
    if explicit and not errors:
        derived["rigid_transfers"] = window_path(scene, settings).transfers
    return {
        "case": case.path,
        "title": case.title,
        "model": model,
        "scene": scene.model_dump(mode="json"),
        "settings": settings.model_dump(mode="json"),
        "derived": derived,
        "cost": asdict(estimate_run(scene, settings, ranks)) | {"ranks": ranks} if explicit and not errors else None,
        "warnings": scene_warnings(scene) if errors else case_warnings(scene, settings),
        "errors": errors,
    }
