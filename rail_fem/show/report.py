"""What the terminal shows: a case before it runs, a result after it, a folder in between."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydantic import BaseModel

from rail_fem.case.casefile import Case
from rail_fem.case.estimate import available_memory, estimate_run
from rail_fem.case.keys import WRITTEN
from rail_fem.case.preflight import preflight_errors
from rail_fem.case.warnings import case_warnings, scene_warnings
from rail_fem.light.mass_scaling import static_patch
from rail_fem.light.rigid import window_path, with_window
from rail_fem.output.events import flights, stated_peaks
from rail_fem.output.history import COLUMNS
from rail_fem.output.low_pass import CUTOFFS, filtered_peak
from rail_fem.output.progress import duration, read_status
from rail_fem.output.quantities import FORCES, impact_pressure
from rail_fem.output.result import PassResult, load
from rail_fem.scene.crossing import FAMILY_KEYS, Crossing
from rail_fem.scene.input_errors import meaning, quantity_of
from rail_fem.scene.scene import Scene
from rail_fem.scene.units import engineering, show
from rail_fem.settings.explicit import FeSettings
from rail_fem.settings.light import PassSettings
from rail_fem.settings.plastic import BemPlasticSettings
from rail_fem.show.bearers import bearer_rows
from rail_fem.show.metal import metal_rows, with_bar
from rail_fem.show.passes import passes_rows

MOST_FLIGHTS = 5  # that are told


def case_report(case: Case, model: str, ranks: int, every_key: bool = False) -> tuple[str, list[str]]:
    """The scene and numerics in engineers' units, derived numbers, cost and warnings; and the input errors that forbid
    the run. every_key : also those that are not set or belong to another family of crossings"""
    scene, settings = case.scene, case.runs[model]
    errors = preflight_errors(scene, settings, ranks, model)
    explicit = isinstance(settings, FeSettings)
    settings = settings if errors else with_window(scene, settings)
    if isinstance(settings, PassSettings):
        settings = settings.model_copy(update=dict(zip(("start", "end"), settings.window(scene))))
    warnings = scene_warnings(scene) if errors else case_warnings(scene, settings)
    lines = [case.title, "", "scene", *_section(scene, every_key), *_measured(scene), "", "derived", *_derived(scene)]
    if not errors and explicit:
        lines += _rigid(scene, settings)
    lines += ["", f"run.{model}", *_section(settings, every_key)]
    if explicit:
        lines += ["", f"cost on {ranks} rank(s), to a factor of about two", *_cost(scene, settings, ranks)]
    else:
        lines += ["", "cost", *_light_cost(scene, settings)]
        lines += [_row("wall time", "some seconds", "most of it for the search of the surfaces")]
    if isinstance(settings, BemPlasticSettings) and not errors:
        from rail_fem.models.bem_plastic import window_cells  # a model is loaded where it is asked for

        need = max((cells.window_memory for cells in window_cells(scene, settings)), default=0)
        lines.append(_memory(need, "of the cells that travel with the wheel"))
    return "\n".join([*lines, *_listed("warning(s)", warnings)]), errors


def _listed(what: str, texts: Sequence[str]) -> list[str]:
    """How many there are, and each in a line of its own."""
    return ["", f"{len(texts)} {what}", *(f"  {text}" for text in texts)]


def _row(name: str, value: str, text: str = "") -> str:
    return f"  {name:<34}{value:<17} {text}".rstrip()


def _section(section: BaseModel, every_key: bool, prefix: str = "") -> list[str]:
    lines = []
    own = ("family", *FAMILY_KEYS[section.family]) if isinstance(section, Crossing) else type(section).model_fields
    for name, entry in type(section).model_fields.items():
        value = getattr(section, name)
        if not every_key and (name not in own or name in WRITTEN or value is None):
            continue
        if isinstance(value, BaseModel):
            lines += _section(value, every_key, f"{prefix}{name}.")
        elif value is None and not entry.exclude:
            lines.append(_row(prefix + name, "not set", meaning(entry)))
        elif value != "" and not entry.exclude:
            lines.append(_row(prefix + name, _shown(value, quantity_of(entry)), meaning(entry)))
    return lines


def _shown(value, quantity) -> str:
    if quantity is None:
        return {True: "on", False: "off"}[value] if isinstance(value, bool) else str(value)
    return ", ".join(quantity.show(entry) for entry in value) if isinstance(value, tuple) else quantity.show(value)


def _measured(scene: Scene) -> list[str]:
    """What the profile doctor found in a profile file."""
    measured = scene.wheel.measured
    return (
        []
        if measured is None
        else ["", "wheel profile as read", *(_row(weight, text) for weight, text in measured.findings)]
    )


def _derived(scene: Scene) -> list[str]:
    patch = static_patch(scene)
    return [
        _row("axle load", show(scene.axle_load, "t", 5), "sprung mass / axles + a wheelset"),
        _row("static wheel load", show(scene.static_wheel_load, "kN", 5), "axle load g / 2"),
        _row("sprung mass per wheel", show(scene.vehicle.wheel_sprung_mass, "kg")),
        _row("unsprung mass per wheel", show(scene.vehicle.wheel_unsprung_mass, "kg")),
        _row("tread datum y", show(scene.wheel_datum_y, "mm", 4), "wheelset centred in the gauge"),
        _row(
            "static patch (Hertz)",
            f"{2e3 * patch.semi_x:.1f} x {2e3 * patch.semi_y:.1f} mm",
            f"on the planar top, {show(patch.max_pressure, 'MPa', 4)} elastic",
        ),
    ]


def _rigid(scene: Scene, settings) -> list[str]:
    path = window_path(scene, settings)
    positions = ", ".join(show(x, "mm", 4) for x in path.transfers) or "nowhere in the window"
    steepest = np.abs(path.slope).argmax()
    return [
        _row("rigid wheel changes body at", positions, "wing and nose carry at once there"),
        _row(
            "steepest rigid wheel path",
            f"{path.slope[steepest] * 1e3:.3g} mrad",
            f"at x = {show(path.x[steepest], 'mm', 4)}",
        ),
    ]


def _cost(scene: Scene, settings, ranks: int) -> list[str]:
    estimate = estimate_run(scene, settings, ranks)
    return [
        _row("cells", f"{estimate.cells:.2g}"),
        _row("steps", f"{estimate.steps:.2g}", f"of {estimate.step * 1e9:.0f} ns"),
        _memory(estimate.memory, "at its peak"),
        _row(
            "wall time",
            duration(estimate.wall_time),
            f"{duration(estimate.preparation)} of it for meshes and the start; kernels are compiled once besides",
        ),
    ]


def _memory(need: float, text: str) -> str:
    return _row("memory", f"{need / 1e9:.2g} GB", f"{text}; {available_memory() / 1e9:.3g} GB are free")


def _light_cost(scene: Scene, settings) -> list[str]:
    """Steps and searches of a model that runs over a path; nothing of a formula."""
    if not isinstance(settings, PassSettings):
        return []
    start, end = settings.window(scene)
    steps, searches = scene.travel_time(start, end) / settings.time_step, abs(end - start) / settings.path_spacing
    return [
        _row("steps", f"{steps:.3g}", f"of {settings.time_step * 1e6:g} us"),
        _row("contacts searched", f"{searches:.3g}", f"every {settings.path_spacing * 1e3:g} mm"),
    ]


def _state(result: PassResult) -> str:
    if result.fault:
        return f"FAILED: {result.fault}"
    return f"CUT OFF: {result.cut_off}" if result.cut_off else "finished"


def _flights(result: PassResult) -> list[str]:
    """Where the wheel leaves the crossing, the longest first; nothing for a model that has no history."""
    found = sorted(flights(result), key=lambda flight: -flight.length) if len(result.history["x"]) else []
    rows = [
        _row(
            f"{show(flight.x_start, 'mm', 5)} to {show(flight.x_end, 'mm', 5)}",
            f"{flight.length * 1e3:.1f} mm",
            f"{flight.duration * 1e3:.2f} ms, launched at {flight.launch_speed:.2f} m/s upwards",
        )
        for flight in found[:MOST_FLIGHTS]
    ]
    more = [_row("shorter ones", str(len(found) - MOST_FLIGHTS))] if len(found) > MOST_FLIGHTS else []
    return ["", "flights without contact", *rows, *more] if found else []


def result_report(result: PassResult) -> str:
    """What a run found, in engineers' units."""
    shown = COLUMNS["x"].unit
    pressure = "" if np.isnan(impact_pressure(result)) else with_bar(result, "impact_pressure")
    lines = [f"{result.model}: " + _state(result), "", "peaks"]
    for name, peak in stated_peaks(result).items():
        lines.append(
            _row(
                name,
                with_bar(result, name, 5) if name in FORCES else engineering(peak.value, peak.unit),
                (f"at x = {show(peak.x, shown, 5)}" if np.isfinite(peak.x) else "")
                + (f", y = {show(peak.y, shown, 4)}" if np.isfinite(peak.y) else "")
                + (f", in an element of {show(peak.size, shown, 2)}" if np.isfinite(peak.size) else ""),
            )
        )
    lines += [
        _row(f"force low-passed at {cutoff:g} Hz", engineering(low.value, "N"), f"at x = {show(low.x, shown, 5)}")
        for cutoff in CUTOFFS
        if (low := filtered_peak(result, cutoff)) is not None
    ]
    lines += _flights(result) + [
        "",
        _row(
            "transfer from wing to nose",
            "none" if np.isnan(result.transfer_x) else f"x = {with_bar(result, 'transfer_x', 5)}",
        ),
        *(["", "passes"] if result.passes else []),
        *passes_rows(result),
        *([_row("mean pressure at the first impact", pressure, "of contact, weighted by force")] if pressure else []),
        *(["", "bearers, largest forces and movement"] if result.bearers else []),
        *bearer_rows(result),
        *(["", "metal"] if result.metal else []),
        *(f"  {name:<58}{value:<21} {text}".rstrip() for name, value, text in metal_rows(result)),
        "",
        "error estimate",
    ]
    lines += [
        _row(name, "not known" if np.isnan(error) else f"{100 * error:.2g} %")
        for name, error in result.error_estimate.items()
    ] or ["  none claimed"]
    cost = result.cost
    lines += [
        "",
        "cost",
        _row("wall time", duration(cost.wall_time), f"{cost.ranks} rank(s)"),
        _row("  the model itself", f"{cost.solve_time:.3g} s"),
        _row("  contacts searched, or meshed", f"{cost.search_time:.3g} s", "kept for scenes of the same surfaces"),
        _row("  kernels compiled", f"{cost.compile_time:.3g} s", "once on a machine"),
        *([_row("elements", str(cost.elements))] if cost.elements else []),
        _row("steps", str(cost.steps)),
    ]
    if np.isfinite(cost.updates_per_second):
        lines.append(_row("element updates", f"{cost.updates_per_second / 1e6:.3g} million/s"))
    return "\n".join(
        [*lines, *_listed("warning(s)", result.warnings), *(_listed("note(s)", result.notes) if result.notes else [])]
    )


def folder_report(folder: Path) -> str:
    """The result in a folder, or else how far its run is, or which runs lie below. Errors: FileNotFoundError when it
    holds none of them."""
    folder = Path(folder)
    if (folder / "result.json").is_file():
        figures = sorted(path for path in (folder / "figures").glob("*.png")) if (folder / "figures").is_dir() else []
        return "\n".join(
            [result_report(load(folder)), *(["", "figures", *(f"  {path}" for path in figures)] if figures else [])]
        )
    below = sorted({path.parent for name in ("result.json", "status.json") for path in folder.glob(f"*/{name}")})
    if not (folder / "status.json").is_file() and below:
        return "\n".join([f"{folder}: {len(below)} run(s) below", *(f"  {_one_line(path)}" for path in below)])
    if not (folder / "status.json").is_file():
        raise FileNotFoundError(f"{folder}: holds neither a result nor a run; give the folder that run --out named")
    status = read_status(folder)
    left = (
        ""
        if status["state"] != "running"
        else f", eta {'unknown' if status['eta'] is None else duration(status['eta'])}"
    )
    where = f", process {status['pid']} on {status['host']}" if status["state"] == "running" and "pid" in status else ""
    return (
        f"{folder}: {status['state']}, {status['percent']:.1f} %, step {status['step']}{left}, written"
        f" {status['updated']}{where}\n{status['message']}".rstrip()
    )


def _one_line(folder: Path) -> str:
    """The first line of a folder's report, or what is wrong with it."""
    try:
        first = folder_report(folder).partition("\n")[0]
    except ValueError as error:
        first = str(error)
    named = (f"{folder}:", f"{folder}{os.sep}")
    return first if first.startswith(named) else f"{folder}: {first}"
