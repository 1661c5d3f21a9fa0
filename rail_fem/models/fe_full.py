"""Model fe_full: the pass by explicit elastoplastic finite elements, from the case to the result.

Mesh and position the wheel; bring it to rest where it stands; let go; run to the end, recording; judge the run.
"""

from __future__ import annotations

import resource
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import cast

import numpy as np
from mpi4py import MPI

from geometry.meshing.hexmesh import HexMesh
from geometry.meshing.quality import MeshQuality, mesh_quality
from geometry.meshing.wheel import WheelMeshSpec
from geometry.surfaces.bodies import CROSSING, REGIONS
from kernel_cache import working_time
from rail_fem.contact.rigid import ends_with_path
from rail_fem.fe import trust
from rail_fem.fe.carried import SteelBefore, lay_in, steel_after, steel_before, write_steel
from rail_fem.fe.condensed_body import Condensed, CondensedBlock
from rail_fem.fe.diagnostics import outcome_on_beam, slowest_elements, strain_peaks, trust_facts
from rail_fem.fe.meshing import Placed, make_mesh
from rail_fem.fe.metal import falls, metal
from rail_fem.fe.passage import build_passage
from rail_fem.fe.plan.kept_meshes import kept
from rail_fem.fe.plan.travelling_window import with_window
from rail_fem.fe.run import Run
from rail_fem.fe.running import Running, running_of
from rail_fem.fe.start_state import StartState
from rail_fem.files.atomic import write_text_atomically
from rail_fem.files.sealed import read_sealed, write_sealed
from rail_fem.passes.lateral_start import LateralStart, lateral_start
from rail_fem.passes.pass_result import void_warnings
from rail_fem.passes.plastic_fields import write_arrays
from rail_fem.processes.launcher import dealt_out, on_root
from rail_fem.processes.progress import Progress
from rail_fem.result.error_bars import CALIBRATED_WORDS, calibrated_bars, error_bars
from rail_fem.result.events import end_warnings, force_peaks, transfer_position
from rail_fem.result.fields import MESH
from rail_fem.result.quantities import FORCES, REPORTED, reported
from rail_fem.result.result import Cost, PassResult, load
from rail_fem.result.runfolder import digest, fingerprint
from rail_fem.scene.scene import Scene
from rail_fem.settings.explicit import TWIN_COST, FeSettings
from rail_fem.static_fe.casting_block import casting_block, footprint
from rail_fem.static_fe.wheel_base import condensed_wheel

# size of the twin's elements: over the run's, the next where the first cannot be meshed or folds; at most [m] (larger
# ones cannot be meshed), and over the run's at least
TWINS, LARGEST_TWIN, LEAST_TWIN = (2.0, 1.5), 6e-3, 1.25
HIGHEST_MODE = 3e3  # of the wheel behind its mesh [Hz]
MESH_ARRAYS = ("points", "cells", "region", "surface", "surface_region", "clamp")
MESH_REMEDY = "remove it: --restart makes the mesh again, and goes on with the run if it comes out the same"


def solve(
    scene: Scene, settings: FeSettings, folder: Path | None = None, restart: bool = False, progress=None
) -> PassResult:
    """One pass. Collective on MPI.COMM_WORLD.

    folder : for mesh.npz, checkpoint.npz, fields/, figures/; None writes nothing.  restart : go on from its restart
        file
    Errors: ValueError for what cannot be meshed or placed; ArithmeticError when the run becomes unstable (the last
    restart file stays).
    """
    return solve_from(scene, settings, None, "fe_full", folder, restart, progress)


def solve_on(
    before: SteelBefore, scene: Scene, settings: FeSettings, folder: Path, restart: bool = False, progress=None
) -> PassResult:
    """As `solve` without a twin, on steel that passes of this scene and these numerics have left, and leaving its own
    in folder/steel.npz. Collective. Errors: as `solve`; SealError for a steel that is damaged or another's."""
    progress = progress or Progress(None, active=False)
    alone = settings.model_copy(update={"error_twin": False})
    return _passes(scene, alone, None, "fe_full", folder, restart, progress, working_time(), before)


def solve_from(
    scene: Scene,
    settings: FeSettings,
    start: StartState | None,
    model: str,
    folder: Path | None,
    restart: bool,
    progress,
) -> PassResult:
    """One pass from a state where settling ends (None: at rest), its result under the name of a model. Collective.
    Errors: as `solve`."""
    started, progress = working_time(), progress or Progress(None, active=False)
    solve_coarse = lambda coarse, below: solve_from(scene, coarse, start, model, below, restart, progress)
    share = TWIN_COST / (1 + TWIN_COST) if settings.has_twin else 0.0
    with progress.part(0.0, share):
        twin = _twin(settings, folder, restart, progress, solve_coarse)
    with progress.part(share, 1.0):
        result = _passes(scene, settings, start, model, folder, restart, progress, started)
    if settings.error_twin == "calibrated":
        bars = calibrated_bars(result)
        return replace(result, error_bars=bars, error_estimate=_estimate(result, bars), notes=(CALIBRATED_WORDS,))
    return result if twin is None else with_bars(result, twin)


def _passes(
    scene: Scene,
    settings: FeSettings,
    start: StartState | None,
    model: str,
    folder: Path | None,
    restart: bool,
    progress: Progress,
    started: float,
    before: SteelBefore | None = None,
) -> PassResult:
    """The passes themselves, and the result of the last, judged by all. started : by `working_time` [s];  before : what
    they begin on, None: the casting, and their steel is not kept. Collective."""
    comm, of_case, began = MPI.COMM_WORLD, scene, working_time()
    progress.note(f"rigid wheel's path and mesh, elements of {settings.element_size * 1e3:g} mm")
    settings = on_root(partial(with_window, of_case, settings))
    scene, aside = on_root(lambda: placed_across(of_case, settings))
    running = on_root(lambda: running_of(scene, settings))
    identity = {"case": digest(fingerprint(model, of_case, settings))}
    mesh, initial_clearance, datum, seal = positioned_mesh(scene, settings, running, folder, restart, identity)
    quality = _judged(mesh, folder)
    searched = working_time() - began
    if mesh is not None:
        progress.note(
            f"mesh: {len(mesh.cells)} hexahedra, {len(mesh.points)} nodes; kernels are compiled now where they are not"
            " yet (once, some minutes)"
        )
    wheel, block = wheel_behind(scene, settings), casting_below(scene, settings, mesh)
    carried, worn, results = None, None, []
    if before is not None:
        owner = {"mesh": seal, "of": before.of}
        carried, worn = steel_before(comm, before, mesh, scene.crossing.surface, owner)
    for number in range(1, settings.passes + 1):
        below = _folder_of(folder, number, settings.passes)
        passage = build_passage(comm, scene, settings, running, mesh, datum, start, aside, wheel, block)
        if number == settings.passes:
            mesh = None  # no run needs it, and all would wait for its memory
        if carried is not None:
            lay_in(passage, carried)
            carried = None
        identity = identity | {"mesh": seal, "pass": str(number)}
        run = Run(comm, scene, settings, passage, below, progress, identity)
        run.started = started
        if restart and below is not None:
            run.resume()
        name = f"pass {number} of {settings.passes}" if settings.passes > 1 else ""
        with progress.part((number - 1) / settings.passes, number / settings.passes, name):
            run.go()
        result = result_of(run, model, quality, initial_clearance)
        result = replace(result, scene=of_case, cost=replace(result.cost, search_time=searched))
        results.append(result)
        if settings.passes > 1:
            result = replace(result, passes=tuple(map(reported, results)))
        if number < settings.passes:
            carried = steel_after(run)
            del passage, run  # before the next is made
            if below is not None:
                on_root(partial(result.save, below))
    if folder is not None:
        on_root(partial(write_arrays, folder, falls(run, worn)))
        if before is not None:
            write_steel(comm, folder, steel_after(run), worn, owner)
    return judged_over_passes(result, results) if settings.passes > 1 else result


def judged_over_passes(last: PassResult, results: list[PassResult]) -> PassResult:
    """The last result, with what is worst of all in its trust, warnings and estimates of error: the first pass does
    most of all plastic strain, and its warnings are those of the whole."""
    rows = trust.worst_rows([one.trust["rows"] for one in results])
    of_rows = tuple(
        f"{row['name']}: {row['shown']} (rule: {row['rule']})" for row in rows if row["verdict"] != trust.GOOD
    )
    named = tuple(f"{row['name']}: " for row in rows)
    others = [[w for w in one.warnings if not w.startswith(named)] for one in results]
    before = [f"pass {k}: {w}" for k, own in enumerate(others[:-1], 1) for w in own if w not in others[-1]]
    worst = {name: float(np.fmax.reduce([one.error_estimate[name] for one in results])) for name in last.error_estimate}
    return replace(
        last, trust={**last.trust, "rows": rows}, warnings=(*of_rows, *before, *others[-1]), error_estimate=worst
    )


def wheel_behind(scene: Scene, settings: FeSettings) -> Condensed | None:
    """The scene's elastic wheel without what is meshed of it; None where it is rigid. Collective.

    Errors: ValueError for a wheel from a mesh file.
    """
    if (body := scene.wheel_body) is None:
        return None
    if settings.mesh:
        raise ValueError("scene.wheel_body: a wheel from a mesh file ends where it is held: leave the body out")
    steel = scene.materials.wheel.steel()
    sector = settings.wheel_depth, WheelMeshSpec.half_angle
    make = partial(condensed_wheel, body, scene.wheel.radius, *sector, steel.elastic, steel.density, HIGHEST_MODE)
    return on_root(partial(kept, make, Condensed))


def casting_below(scene: Scene, settings: FeSettings, mesh: HexMesh | None) -> CondensedBlock | None:
    """The casting between the end of its meshes and its foot; None where it is rigid. mesh : root only. Collective."""
    if (foot := settings.foot_depth) is None:
        return None
    steel = scene.materials.wing.steel()

    def make() -> CondensedBlock:
        regions = tuple(int(body) for body in CROSSING if (cast(HexMesh, mesh).region == body).any())
        prints = tuple(footprint(cast(HexMesh, mesh), body) for body in regions)
        ends = -settings.rail_depth, -foot
        return kept(partial(casting_block, prints, regions, *ends, steel.elastic, steel.density), CondensedBlock)

    return on_root(make)


def placed_across(scene: Scene, settings: FeSettings) -> tuple[Scene, LateralStart | None]:
    """The scene with its wheelset where a diverging route has it at the start, and what holds it there; the scene as it
    is on the through route. Errors: as lateral_start."""
    if scene.diverging is None:
        return scene, None
    aside = lateral_start(scene, *scene.in_order_of_travel(settings.start, settings.end))
    return scene.replace_si(diverging={"lateral": aside.across}), aside


def _folder_of(folder: Path | None, number: int, passes: int) -> Path | None:
    """Where a pass writes: the last one in the run's own folder, those before it in folders within."""
    return folder if folder is None or number == passes else folder / f"pass_{number:04d}"


def _twin(
    settings: FeSettings,
    folder: Path | None,
    restart: bool,
    progress: Progress,
    solve_coarse: Callable[[FeSettings, Path | None], PassResult],
) -> PassResult | str | None:
    """The same pass on elements up to twice as large, solved by settings and folder; why there is none; None where none
    is asked for. A restart takes the one that is there. Collective."""
    if not settings.has_twin:
        return None
    if settings.max_steps is not None:
        return "max_steps cuts the run off"
    below = None if folder is None else folder / "twin"
    if restart and below is not None and on_root(lambda: (below / "result.json").is_file()):
        return on_root(lambda: load(below))
    why = f"elements of {settings.element_size * 1e3:g} mm are too large for a coarser twin"
    sizes = dict.fromkeys(min(ratio * settings.element_size, LARGEST_TWIN) for ratio in TWINS)
    for size in (size for size in sizes if size >= LEAST_TWIN * settings.element_size):
        coarse = settings.coarser(size / settings.element_size)
        coarse = coarse.model_copy(update={"error_twin": False, "field_frames": 1})
        try:
            with progress.part(0.0, 1.0, f"coarse twin of {size * 1e3:g} mm, for the error bars"):
                result = solve_coarse(coarse, below)
        except (ValueError, ArithmeticError) as error:  # what cannot be meshed, and what folds as it yields
            why = f"no twin of {size * 1e3:g} mm: {error}"
            continue
        if below is not None:
            on_root(partial(result.save, below))
        return result
    return why


def with_bars(result: PassResult, twin: PassResult | str) -> PassResult:
    """The result with the error bars that its twin gives; with a warning where there is no twin."""
    bars = {} if isinstance(twin, str) else error_bars(result, twin)
    warnings = (
        result.warnings
        if bars
        else (*result.warnings, f"no error bars: {twin if isinstance(twin, str) else 'cut off'}")
    )
    searched = result.cost.search_time + (0.0 if isinstance(twin, str) else twin.cost.search_time)
    cost = replace(result.cost, search_time=searched)
    return replace(result, error_bars=bars, warnings=warnings, error_estimate=_estimate(result, bars), cost=cost)


def _estimate(result: PassResult, bars: Mapping[str, float]) -> dict[str, float]:
    """Of the errors, with that of the elements: the largest relative bar of a force."""
    known = [bars[name] / abs(REPORTED[name].of(result)) for name in FORCES if bars.get(name)]
    return {**result.error_estimate, "discretisation": max(known, default=float("nan"))}


def positioned_mesh(
    scene: Scene,
    settings: FeSettings,
    running: Running,
    folder: Path | None,
    restart: bool,
    identity: Mapping[str, str],
) -> tuple[HexMesh | None, float, float, str]:
    """Mesh in place (root only), gap before initial positioning [m], height of D0 at the start [m], seal of the mesh's
    file ("" without a folder).

    A restart reads the mesh of the run; identity : what its file belongs to. Collective. Errors: SealError for a file
    that is damaged or another's.
    """
    stored = None if folder is None else folder / MESH
    if restart and stored is not None and on_root(stored.is_file):
        found = dealt_out([partial(_read_mesh, stored, identity)])
    else:
        placed = cast(Placed, make_mesh(scene, settings, running))  # on root
        found = dealt_out([lambda: (*placed, "" if stored is None else _write_mesh(stored, *placed, identity))])
    gap, datum, seal = on_root(lambda: found[0][1:])
    return (found[0][0] if found else None), gap, datum, seal  # the mesh stays on root: too large to send


def _judged(mesh: HexMesh | None, folder: Path | None) -> MeshQuality:
    """How good the mesh (root only) is; told in the folder as well. Collective."""

    def judge() -> MeshQuality:
        quality = mesh_quality(cast(HexMesh, mesh))
        if folder is not None:
            write_text_atomically(folder / "mesh_quality.txt", quality.report())
        return quality

    return on_root(judge)


def _write_mesh(path: Path, mesh: HexMesh, gap: float, datum: float, identity: Mapping[str, str]) -> str:
    path.parent.mkdir(parents=True, exist_ok=True)
    return write_sealed(
        path, {"gap": gap, "datum": datum} | {name: getattr(mesh, name) for name in MESH_ARRAYS}, identity
    )


def _read_mesh(path: Path, identity: Mapping[str, str]) -> tuple[HexMesh, float, float, str]:
    stored, seal = read_sealed(path, identity, MESH_REMEDY)
    return (
        HexMesh(region_names=REGIONS, **{name: stored[name] for name in MESH_ARRAYS}),
        float(stored["gap"]),
        float(stored["datum"]),
        seal,
    )


def result_of(run: Run, model: str, quality: MeshQuality, initial_clearance: float) -> PassResult:
    """What the run found, replicated. Collective.

    quality : of the mesh;  initial_clearance : of the bodies before initial positioning [m]
    error_estimate holds what one run can know: the energy balance, the static load it should carry before the nose, and
    how much of the largest force comes and goes with each element (trust.mesh_noise). What the element size does to
    peaks and strains beyond that, no single run knows: "discretisation" is NaN unless a coarse twin says it
    (`error_twin`). rail_fem.studies.passage_size measures it by runs at several sizes.
    """
    history, energies = run.recorder.history(), run.dynamics.energies()
    facts = trust_facts(run, history, quality, initial_clearance)
    rows = trust.report_rows(facts)
    side, settled = (run.scene.direction_sign, run.scene.static_wheel_load), run.settings.settle_time
    peaks = force_peaks(history, *side, settled, run.scene.crossing.leg_end)
    beam = outcome_on_beam(run, history)
    return PassResult(
        model=model,
        scene=run.scene,
        settings=run.settings.model_dump(mode="json"),
        history=history | beam.columns,
        peaks=peaks | beam.peaks | strain_peaks(run),
        bearers=beam.bearers,
        transfer_x=transfer_position(history, *side, settled),
        energies={name: float(value) for name, value in energies.items()}
        | {name: facts[name] for name in ("impact_work", "balance_scale")},
        cost=_cost(run),
        error_estimate={
            "energy_balance": rows[0].value,
            "static_load": abs(facts["static_error"]),
            "force_mesh_noise": trust.mesh_noise(history, run.element_time, settled),
            "discretisation": float("nan"),
        },
        metal=metal(run),
        trust={
            "rows": [row.plain() for row in rows],
            "slowest": slowest_elements(quality),
            "rigid_transfers": run.passage.running.transfers.tolist(),
        },
        warnings=tuple(f"{row.name}: {row.shown} (rule: {row.rule})" for row in rows if row.verdict != trust.GOOD)
        + end_warnings(history, peaks, run.scene.static_wheel_load, settled, ends_with_path(run.scene, run.settings))
        + void_warnings(beam.bearers),
        cut_off=run.cut_off,
    )


def _cost(run: Run) -> Cost:
    """Collective."""
    elements, steps = run.dynamics.domain.m_global, run.dynamics.step_count
    memory = run.comm.allreduce(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)
    rate = run.dynamics.updates / max(run.loop_time, 1e-9)
    return Cost(run.wall_time, elements, steps, run.comm.size, rate, memory)
