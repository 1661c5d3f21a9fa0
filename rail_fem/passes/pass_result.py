"""From a light pass over wing and nose to its result: columns of the history, patches, peaks."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from geometry.surfaces.bodies import BODIES
from kernel_cache import working_time
from rail_fem.contact.contact_table import ContactTable, patch_sizes
from rail_fem.passes.validity import LOADED, Flag, flag_warnings, lift_flags, step_flags, window_flags
from rail_fem.passes.vertical_pass import LightPass, common_history, foundation_peak, history_rows
from rail_fem.result.events import end_warnings, force_peaks, transfer_position
from rail_fem.result.result import NAN, BearerSummary, Cost, PassResult, PatchSummary, Peak
from rail_fem.scene.scene import Scene
from rail_fem.scene.units import in_digits
from rail_fem.settings.light import PassSettings


def light_result(
    model: str,
    scene: Scene,
    settings: PassSettings,
    table: ContactTable,
    run: LightPass,
    errors: dict[str, float],
    flags: Iterable[Flag],
    started: float,
    patches: tuple[PatchSummary, ...] | None = None,
    trust: Mapping[str, Any] | None = None,
) -> PassResult:
    """What a light pass reports.

    flags : beside that the wheel leaves the rail;  started : clock when the table was at hand [s]
    patches : on wing and nose, whose histories then are there; None of one contact for both
    """
    load, sign, columns = scene.static_wheel_load, scene.direction_sign, common_history(run)
    about, transfer, changes = {**(trust or {})}, NAN, len(table.transfers) > 0
    if patches is not None:
        columns = body_columns(run, table, points_at(table, run.x)) | columns
        about["rigid_transfers"] = table.transfers.tolist()
        transfer = transfer_position(columns, sign, load)
        changes = bool(np.isfinite(transfer))
    peaks = force_peaks(columns, sign, load, leg_end=scene.crossing.leg_end)
    rows = history_rows(run, settings.history_interval)
    history = {name: values[rows] for name, values in columns.items()}
    found = [*lift_flags(history, load), *window_flags(scene, run, changes), *step_flags(errors), *flags]
    about["validity"] = found
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
        peaks={
            **peaks,
            "force_foundation": foundation_peak(run),
            **({} if run.on_beam is None else run.on_beam.peaks),
            **pressure_peaks(patches or ()),
        },
        patches=patches or (),
        bearers=bearers,
        transfer_x=transfer,
        energies={name[7:]: float(values[-1]) for name, values in history.items() if name.startswith("energy_")},
        cost=Cost(table.search_time + working_time() - started, 0, len(run.time), search_time=table.search_time),
        error_estimate=errors,
        trust=about,
        warnings=tuple(map(scene.crossing.told, flag_warnings(found)))
        + end_warnings(columns, peaks, load)
        + void_warnings(bearers),
    )


def void_warnings(bearers: tuple[BearerSummary, ...]) -> tuple[str, ...]:
    """Of bearers that hang: how deep a void must be to stay open, as this model takes it to."""
    return tuple(
        f"bearer {one.number} at x = {one.x * 1e3:.0f} mm hangs and sinks by {in_digits(one.deflection * 1e3, 2)} mm: a"
        " void less deep closes, and the ballast carries again, which this model leaves out"
        for one in bearers
        if one.state == "voided"
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


def patch_steps(table: ContactTable, run: LightPass, load: float) -> list[int]:
    """Steps whose patches are kept: start, largest force on each body, largest Hertz pressure on each where it carries
    more than LOADED of the static load [N], most even sharing, end."""
    near, pressure = table.nearest(run.x), np.zeros_like(run.force)
    for b, force in enumerate(run.force):
        carries = force > LOADED * load
        normal = force[carries] / np.cos(table.angle[b, near[carries]])
        axes = patch_sizes(normal, table.radii[b, near[carries]], table.modulus[b])
        pressure[b, carries] = normal / axes.prod(axis=1)
    largest = [values for values in (*run.force, *pressure, run.force.min(axis=0)) if values.max() > 0]
    return sorted({0, len(run.time) - 1, *(int(np.argmax(values)) for values in largest)})


def patches_at(table: ContactTable, run: LightPass, steps: list[int]) -> tuple[PatchSummary, ...]:
    """Hertz ellipses of the bodies that carry at these steps; force is the normal force [N]."""
    patches = []
    for i in steps:
        near = int(table.nearest(run.x[i : i + 1])[0])
        for b, body in enumerate(BODIES):
            if run.force[b, i] <= 0:
                continue
            normal = run.force[b, i] / np.cos(table.angle[b, near])
            along, across = table.semi_axes(b, near, normal)
            area = np.pi * along * across
            x = table.point[b, near, 0] + run.x[i] - table.x[near]
            sizes = map(float, (2 * along, 2 * across, area, normal, 1.5 * normal / area))
            patches.append(PatchSummary(float(run.time[i]), float(x), float(table.point[b, near, 1]), body, *sizes))
    return tuple(patches)


def pressure_peaks(patches: tuple[PatchSummary, ...]) -> dict[str, Peak]:
    """Largest elastic pressure on each body among its patches."""
    worst = {p.region: p for p in sorted(patches, key=lambda p: p.max_pressure)}
    return {
        f"elastic_pressure_{body}": Peak(p.max_pressure, "Pa", x=p.x, y=p.y, time=p.time) for body, p in worst.items()
    }
