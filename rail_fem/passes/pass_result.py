"""From a light pass over wing and nose to its result: columns of the history, patches, peaks."""

from dataclasses import replace
from typing import Any

import numpy as np

from geometry.surfaces.bodies import BODIES
from kernel_cache import working_time
from rail_fem.contact.contact_table import ContactTable, patch_sizes
from rail_fem.passes.validity import Flag, flag_warnings
from rail_fem.passes.vertical_pass import LightPass, common_history, foundation_peak, history_rows
from rail_fem.result.events import end_warnings, force_peaks, transfer_position
from rail_fem.result.result import BearerSummary, Cost, PassResult, PatchSummary, Peak
from rail_fem.scene.scene import Scene
from rail_fem.settings.light import IndentationSettings, PassSettings


def light_result(
    model: str,
    scene: Scene,
    settings: PassSettings,
    run: LightPass,
    columns: dict[str, np.ndarray],
    flags: list[Flag],
    trust: dict[str, Any],
    errors: dict[str, float],
    search_time: float,
    started: float,
) -> PassResult:
    """What every light pass reports, whatever it resolves. columns : (m,) of the history, of every step; search_time :
    spent on the path [s]; started : clock when the path was at hand [s]"""
    load = scene.static_wheel_load
    rows = history_rows(run, settings.history_interval)
    history = {name: values[rows] for name, values in columns.items()}
    peaks = force_peaks(columns, scene.direction_sign, load, leg_end=scene.crossing.leg_end)
    bearers: tuple[BearerSummary, ...] = ()
    if run.beam is not None and scene.bearers is not None:
        from rail_fem.passes.beam_results import bearer_table

        low, high = sorted((run.x[0], run.x[-1]))
        bearers = bearer_table(run.beam, scene.bearers, run.beam_position, run.beam_velocity, low, high)
    return PassResult(
        model=model,
        scene=scene,
        settings=settings.model_dump(mode="json"),
        history=history,
        peaks=peaks | {"force_foundation": foundation_peak(run)} | ({} if run.on_beam is None else run.on_beam.peaks),
        bearers=bearers,
        energies={name[7:]: float(values[-1]) for name, values in history.items() if name.startswith("energy_")},
        cost=Cost(search_time + working_time() - started, 0, len(run.time), search_time=search_time),
        error_estimate=errors,
        trust={"validity": flags} | trust,
        warnings=flag_warnings(flags) + end_warnings(columns, peaks, load) + void_warnings(bearers),
    )


def void_warnings(bearers: tuple[BearerSummary, ...]) -> tuple[str, ...]:
    """Of bearers that hang: how deep a void must be to stay open, as this model takes it to."""
    return tuple(
        f"bearer {one.number} at x = {one.x * 1e3:.0f} mm hangs and sinks by {one.deflection * 1e3:.2g} mm: a void less"
        " deep closes, and the ballast carries again, which this model leaves out"
        for one in bearers
        if one.state == "voided"
    )


def pass_result(
    model: str,
    scene: Scene,
    settings: IndentationSettings,
    table: ContactTable,
    run: LightPass,
    patches: tuple[PatchSummary, ...],
    flags: list[Flag],
    errors: dict[str, float],
    started: float,
    more: dict[str, np.ndarray] | None = None,
) -> PassResult:
    """The result of a pass over wing and nose. started : clock when the table was at hand [s];  more : columns (m,)
    beside or instead of the common ones"""
    columns = common_history(run) | body_columns(run, table, points_at(table, run.x)) | (more or {})
    trust = {"rigid_transfers": table.transfers.tolist()}
    found = light_result(model, scene, settings, run, columns, flags, trust, errors, table.search_time, started)
    return replace(
        found,
        patches=patches,
        peaks={**found.peaks, **pressure_peaks(patches)},
        transfer_x=transfer_position(columns, scene.direction_sign, scene.static_wheel_load),
    )


def points_at(table: ContactTable, x: np.ndarray) -> np.ndarray:
    """(2, m, 3) contact points, that of the nearest position of the table moved along with the wheel [m]."""
    near = table.nearest(x)
    return table.point[:, near] + np.stack([x - table.x[near], np.zeros(len(x)), np.zeros(len(x))], axis=1)


def body_columns(run: LightPass, table: ContactTable, point: np.ndarray) -> dict[str, np.ndarray]:
    """Histories (m,) of what each body carries, where, and the force's other components."""
    near, total = table.nearest(run.x), run.force.sum(axis=0)
    share = np.divide(run.force, total, out=np.zeros_like(run.force), where=total > 0)
    centre = np.where(total > 0, np.einsum("bm,bmk->km", share, np.nan_to_num(point)), np.nan)
    return {
        "force_wing": run.force[0],
        "force_nose": run.force[1],
        "contact_x": centre[0],
        "contact_y": centre[1],
        "force_longitudinal": -(run.force * table.slope[:, near]).sum(axis=0),
        "force_lateral": -(run.force * np.tan(table.angle[:, near])).sum(axis=0),
    }


def patch_steps(run: LightPass) -> list[int]:
    """Steps whose patches are kept: start, largest force on each body, most even sharing, end."""
    shared = np.minimum(run.force[0], run.force[1])
    chosen = [0, int(np.argmax(run.force[0])), int(np.argmax(run.force[1])), len(run.time) - 1]
    return sorted({*chosen, *([int(np.argmax(shared))] if shared.max() > 0 else [])})


def patches_at(table: ContactTable, run: LightPass, steps: list[int]) -> tuple[PatchSummary, ...]:
    """Hertz ellipses of the bodies that carry at these steps; force is the normal force [N]."""
    patches = []
    for i in steps:
        near = int(table.nearest(run.x[i : i + 1])[0])
        for b, body in enumerate(BODIES):
            if run.force[b, i] <= 0:
                continue
            normal = run.force[b, i] / np.cos(table.angle[b, near])
            along, across = patch_sizes(np.array([normal]), table.radii[b, near : near + 1], table.modulus[b])[0]
            area = np.pi * along * across
            x = table.point[b, near, 0] + run.x[i] - table.x[near]
            patches.append(
                PatchSummary(
                    float(run.time[i]),
                    float(x),
                    float(table.point[b, near, 1]),
                    body,
                    float(2 * along),
                    float(2 * across),
                    float(area),
                    float(normal),
                    float(1.5 * normal / area),
                )
            )
    return tuple(patches)


def pressure_peaks(patches: tuple[PatchSummary, ...]) -> dict[str, Peak]:
    """Largest elastic pressure on each body among its patches."""
    worst = {p.region: p for p in sorted(patches, key=lambda p: p.max_pressure)}
    return {
        f"elastic_pressure_{body}": Peak(p.max_pressure, "Pa", x=p.x, y=p.y, time=p.time) for body, p in worst.items()
    }
