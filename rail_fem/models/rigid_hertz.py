"""Model rigid_hertz: the wheel rolls over the true surfaces of wing and nose, each contact with the Hertz law of its
own curvatures.

Both bodies may carry at once, or none. Resolves the force on wing and nose, where it acts, and the size and pressure of
the patches as far as they are ellipses. One contact on each body (its nearest position). Blind to conformity, edges,
plastic flow and waves, which it flags. The wheel moves up and down; with `degrees_of_freedom` it is one of a wheelset
that rolls, and moves laterally and in yaw, on crossing and stock rail.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from rail_fem.light.contact_table import BODIES, ContactTable, contact_table, patch_sizes
from rail_fem.light.plastic_indentation import contacts_of
from rail_fem.light.validity import Flag, flag_warnings, hertz_flags
from rail_fem.light.vertical_pass import (
    LightPass,
    common_history,
    force_change,
    foundation_peak,
    history_rows,
    lift_offs,
    run_pass,
    step_error,
)
from rail_fem.light.wheelset_pass import run_wheelset, surfaces_of
from rail_fem.output.clock import working_time
from rail_fem.output.events import end_warnings, force_peaks, transfer_position
from rail_fem.output.result import Cost, PassResult, Patch, Peak
from rail_fem.scene.scene import Scene
from rail_fem.settings.light import IndentationSettings, RigidHertzSettings


def solve(
    scene: Scene, settings: RigidHertzSettings, folder: Path | None = None, restart: bool = False, progress=None
) -> PassResult:
    """One pass. Error: second order in the step, measured by twice the step, and by twice the spacing of the surface
    search.

    Errors: CrossingError where the window leaves the crossing, ValueError.
    """
    if settings.degrees_of_freedom != "vertical":
        return solve_wheelset(scene, settings)
    table = contact_table(scene, *settings.window(scene), settings.path_spacing)
    started = working_time()
    contacts = contacts_of(scene, settings, table)
    run = run_pass(scene, settings, contacts)
    coarse = run_pass(scene, settings, contacts, 2 * run.step)
    sparse = run_pass(scene, settings, contacts_of(scene, settings, every_second(table)))
    patches = patches_at(table, run, moments(run))
    flags = hertz_flags(scene, table, run, patches, lift_offs(run, scene.static_wheel_load))
    errors = {"time_step": step_error(run, coarse), "path_spacing": force_change(run, sparse)}
    return pass_result("rigid_hertz", scene, settings, table, run, patches, flags, errors, started)


def solve_wheelset(scene: Scene, settings: RigidHertzSettings) -> PassResult:
    """One pass of a wheelset that may roll, and by choice move laterally and in yaw. Errors: also ValueError where it
    leaves lateral_range."""
    surfaces = surfaces_of(scene, settings)
    started = working_time()
    # kept from another scene or not, the search counts
    search_time = sum(t.search_time for t in surfaces.over + surfaces.plain)
    table = replace(surfaces.over[len(surfaces.over) // 2], search_time=search_time)
    contacts = contacts_of(scene, settings, table)
    found = run_wheelset(scene, settings, contacts, surfaces)
    run, coarse = found.light, run_wheelset(scene, settings, contacts, surfaces, 2 * found.light.step).light
    patches = patches_at(table, run, moments(run))
    flags = hertz_flags(scene, table, run, patches, lift_offs(run, scene.static_wheel_load))
    return pass_result(
        "rigid_hertz",
        scene,
        settings,
        table,
        run,
        patches,
        flags,
        {"time_step": step_error(run, coarse)},
        started,
        found.columns,
    )


def pass_result(
    model: str,
    scene: Scene,
    settings: IndentationSettings,
    table: ContactTable,
    run: LightPass,
    patches: tuple[Patch, ...],
    flags: list[Flag],
    errors: dict[str, float],
    started: float,
    more: dict[str, np.ndarray] | None = None,
) -> PassResult:
    """The result of a pass over wing and nose. started : clock when the table was at hand [s];  more : columns (m,)
    beside or instead of the common ones"""
    point, rows = points_at(table, run.x), history_rows(run, settings.history_interval)
    columns = common_history(run) | body_columns(run, table, point) | (more or {})
    history = {name: values[rows] for name, values in columns.items()}
    side = scene.direction_sign, scene.static_wheel_load
    peaks = force_peaks(columns, *side, leg_end=scene.crossing.leg_end)
    return PassResult(
        model=model,
        scene=scene,
        settings=settings.model_dump(mode="json"),
        history=history,
        patches=patches,
        peaks=peaks | {"force_foundation": foundation_peak(run)} | pressure_peaks(patches),
        transfer_x=transfer_position(columns, *side),
        energies={name[7:]: float(values[-1]) for name, values in history.items() if name.startswith("energy_")},
        cost=Cost(table.search_time + working_time() - started, 0, len(run.time), search_time=table.search_time),
        error_estimate=errors,
        trust={"validity": flags, "rigid_transfers": table.transfers.tolist()},
        warnings=flag_warnings(flags) + end_warnings(columns, peaks, scene.static_wheel_load),
    )


def every_second(table: ContactTable) -> ContactTable:
    """The same table at twice the spacing (both ends kept when their number is odd)."""
    keep = np.unique(np.r_[np.arange(0, len(table.x), 2), len(table.x) - 1])
    return ContactTable(
        table.x[keep],
        *(
            getattr(table, name)[:, keep]
            for name in ("height", "slope", "point", "stiffness", "radii", "angle", "asymmetry")
        ),
        table.transfers,
        table.modulus,
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


def moments(run: LightPass) -> list[int]:
    """Steps whose patches are kept: start, largest force on each body, most even sharing, end."""
    shared = np.minimum(run.force[0], run.force[1])
    chosen = [0, int(np.argmax(run.force[0])), int(np.argmax(run.force[1])), len(run.time) - 1]
    return sorted({*chosen, *([int(np.argmax(shared))] if shared.max() > 0 else [])})


def patches_at(table: ContactTable, run: LightPass, steps: list[int]) -> tuple[Patch, ...]:
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
                Patch(
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


def pressure_peaks(patches: tuple[Patch, ...]) -> dict[str, Peak]:
    """Largest pressure on each body among its patches."""
    worst = {p.region: p for p in sorted(patches, key=lambda p: p.max_pressure)}
    return {f"pressure_{body}": Peak(p.max_pressure, "Pa", x=p.x, y=p.y, time=p.time) for body, p in worst.items()}
