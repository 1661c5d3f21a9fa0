"""What `check` finds of a case before it runs: in words, and as plain values for scripts."""

from dataclasses import asdict
from typing import Any

import numpy as np
from pydantic import BaseModel

from rail_fem.case.casefile import Case
from rail_fem.case.estimate import available_memory, foretold
from rail_fem.case.keys import WRITTEN
from rail_fem.case.preflight import preflight_errors
from rail_fem.case.warnings import case_warnings, scene_warnings
from rail_fem.contact.rigid import window_path, window_warnings
from rail_fem.fe.plan.mass_scaling import static_patch
from rail_fem.fe.plan.travelling_window import with_window
from rail_fem.processes.progress import duration
from rail_fem.scene.crossing import FAMILY_KEYS, Crossing
from rail_fem.scene.input_errors import meaning, quantity_of
from rail_fem.scene.scene import Scene
from rail_fem.scene.units import show
from rail_fem.settings.explicit import FeSettings
from rail_fem.settings.light import BemPlasticSettings, PassSettings
from rail_fem.show.report import listed, row


def case_facts(case: Case, model: str, ranks: int) -> dict[str, Any]:
    """Scene and numerics as they are understood, what follows from them, cost, warnings, and the errors that forbid the
    run [SI]. cost : None for a light model"""
    scene, (settings, warnings, errors) = case.scene, understood(case, model, ranks)
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
        derived["rigid_transfers"] = window_path(scene, explicit.start, explicit.end).transfers
    return {
        "case": case.path,
        "title": case.title,
        "model": model,
        "scene": scene.model_dump(mode="json"),
        "settings": settings.model_dump(mode="json"),
        "derived": derived,
        "cost": asdict(foretold(scene, explicit, ranks)) | {"ranks": ranks} if explicit is not None else None,
        "warnings": warnings,
        "errors": errors,
    }


def case_report(case: Case, model: str, ranks: int, every_key: bool = False) -> tuple[str, list[str]]:
    """The scene and numerics in engineers' units, derived numbers, cost and warnings; and the input errors that forbid
    the run. every_key : also those that are not set or belong to another family of crossings"""
    scene, (settings, warnings, errors) = case.scene, understood(case, model, ranks)
    explicit = isinstance(settings, FeSettings)
    if isinstance(settings, PassSettings):
        settings = settings.model_copy(update=dict(zip(("start", "end"), settings.window(scene))))
    lines = [case.title, "", "scene", *_section(scene, every_key), *_measured(scene), "", "derived", *_derived(scene)]
    if not errors and explicit:
        lines += _rigid(scene, settings)
    lines += ["", f"run.{model}", *_section(settings, every_key)]
    if explicit and settings.start is not None and settings.end is not None:  # fe_window's stay open where errors are
        lines += ["", f"cost on {ranks} rank(s), to a factor of about two", *_cost(scene, settings, ranks)]
    elif not explicit:
        lines += ["", "cost", *_light_cost(scene, settings)]
        lines += [row("wall time", "some seconds", "most of it for the search of the surfaces")]
    if isinstance(settings, BemPlasticSettings) and not errors:
        from rail_fem.models.bem_plastic import window_cells  # a model is loaded where it is asked for

        need = max((cells.window_memory for cells in window_cells(scene, settings)), default=0)
        lines.append(_memory(need, "of the cells that travel with the wheel"))
    return "\n".join([*lines, *listed("warning(s)", warnings)]), errors


def understood(case: Case, model: str, ranks: int) -> tuple[Any, list[str], list[str]]:
    """Numerics as the model takes them, or as they are asked for where errors forbid the run; warnings; the errors."""
    scene, asked = case.scene, case.runs[model]
    if errors := preflight_errors(scene, asked, ranks, model):
        return asked, scene_warnings(scene), errors
    settings = with_window(scene, asked)
    about_path = window_warnings(scene, *settings.window(scene)) if isinstance(settings, PassSettings) else []
    return settings, case_warnings(scene, settings) + about_path, []


def _section(section: BaseModel, every_key: bool, prefix: str = "") -> list[str]:
    lines = []
    own = {"family", *FAMILY_KEYS[section.family]} if isinstance(section, Crossing) else {*type(section).model_fields}
    if isinstance(section, Scene) and section.bearers is not None:
        own.remove("foundation")  # nothing stands on it
    for name, entry in type(section).model_fields.items():
        value = getattr(section, name)
        if not every_key and (name not in own or name in WRITTEN or value is None):
            continue
        if isinstance(value, BaseModel):
            lines += _section(value, every_key, f"{prefix}{name}.")
        elif value is None and not entry.exclude:
            lines.append(row(prefix + name, "not set", meaning(entry)))
        elif value != "" and not entry.exclude:
            lines.append(row(prefix + name, _shown(value, quantity_of(entry)), meaning(entry)))
    return lines


def _shown(value, quantity) -> str:
    if quantity is None:
        return {True: "on", False: "off"}[value] if isinstance(value, bool) else str(value)
    return ", ".join(quantity.show(entry) for entry in value) if isinstance(value, tuple) else quantity.show(value)


def _measured(scene: Scene) -> list[str]:
    """What the profile doctor found in a profile file."""
    if scene.wheel.measured is None:
        return []
    return ["", "wheel profile as read", *(row(weight, text) for weight, text in scene.wheel.measured.findings)]


def _derived(scene: Scene) -> list[str]:
    patch = static_patch(scene)
    return [
        row("axle load", show(scene.axle_load, "t", 5), "sprung mass / axles + a wheelset"),
        row("static wheel load", show(scene.static_wheel_load, "kN", 5), "axle load g / 2"),
        row("sprung mass per wheel", show(scene.vehicle.wheel_sprung_mass, "kg")),
        row("unsprung mass per wheel", show(scene.vehicle.wheel_unsprung_mass, "kg")),
        row("tread datum y", show(scene.wheel_datum_y, "mm", 4), "wheelset centred in the gauge"),
        row(
            "static patch (Hertz)",
            f"{2e3 * patch.semi_x:.1f} x {2e3 * patch.semi_y:.1f} mm",
            f"on the planar top, {show(patch.max_pressure, 'MPa', 4)} elastic",
        ),
    ]


def _rigid(scene: Scene, settings) -> list[str]:
    path = window_path(scene, settings.start, settings.end)
    positions = ", ".join(show(x, "mm", 4) for x in path.transfers) or "nowhere in the window"
    steepest = np.abs(path.slope).argmax()
    return [
        row("rigid wheel changes body at", positions, "wing and nose carry at once there"),
        row(
            "steepest rigid wheel path",
            f"{path.slope[steepest] * 1e3:.3g} mrad",
            f"at x = {show(path.x[steepest], 'mm', 4)}",
        ),
    ]


def _cost(scene: Scene, settings, ranks: int) -> list[str]:
    estimate = foretold(scene, settings, ranks)
    body = "" if scene.wheel_body is None else " and the wheel condensed (two core minutes, 3.3 GB)"
    if settings.foot_depth is not None:
        body += " and the casting condensed (5 to 30 core seconds, 1 to 2 GB; foot_depth 400 mm: to 70, 4)"
    return [
        row("cells", f"{estimate.cells:.2g}"),
        row("steps", f"{estimate.steps:.2g}", f"of {estimate.step * 1e9:.0f} ns"),
        _memory(estimate.memory, "at its peak"),
        row(
            "wall time",
            duration(estimate.wall_time),
            f"{duration(estimate.preparation)} of it for meshes and the start; kernels are compiled{body} once besides",
        ),
        *_on_card(estimate.cells, scene, settings),
    ]


def _on_card(cells: float, scene: Scene, settings: FeSettings) -> list[str]:
    """What the steps need on a card, where one makes them. The time above is that of cores."""
    if settings.device != "cuda":
        return []
    from rail_fem.fe.card.fits import room_on_card

    text = "with the driver's own; the wall time is a core's, that of a card was never measured"
    return [row("on the card", f"{room_on_card(cells, scene, settings) / 1e9:.2g} GB", text)]


def _memory(need: float, text: str) -> str:
    return row("memory", f"{need / 1e9:.2g} GB", f"{text}; {available_memory() / 1e9:.3g} GB are free")


def _light_cost(scene: Scene, settings) -> list[str]:
    """Steps and searches of a model that runs over a path; nothing of a formula."""
    if not isinstance(settings, PassSettings):
        return []
    start, end = settings.window(scene)
    steps, searches = scene.travel_time(start, end) / settings.time_step, abs(end - start) / settings.path_spacing
    return [
        row("steps", f"{steps:.3g}", f"of {settings.time_step * 1e6:g} us"),
        row("contacts searched", f"{searches:.3g}", f"every {settings.path_spacing * 1e3:g} mm"),
    ]
