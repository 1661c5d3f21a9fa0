"""Rung fe_full: the pass by explicit elastoplastic finite elements, from the case to the result.

Mesh and place the wheel; let it settle under a damper while it rolls; let go; run to the end, recording; judge the run.
"""

from __future__ import annotations

import resource
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from mpi4py import MPI

from geometry.crossing import CastCrossing
from geometry.mesh import HexMesh
from geometry.mesh_loft import mesh_crossing
from geometry.mesh_quality import MeshQuality, mesh_quality
from geometry.mesh_wheel import WheelMeshSpec, mesh_wheel
from geometry.path import rolling_radius
from rail_fem.fe import trust
from rail_fem.fe.checkpoint import load_checkpoint, save_checkpoint
from rail_fem.fe.fields import gather_cells, write_collection, write_frame
from rail_fem.fe.passage import NEAR, Passage, Running, build_passage, end_settling, running_of
from rail_fem.fe.placing import crossing_spec, place_wheel, wheel_bands
from rail_fem.fe.recorder import Recorder
from rail_fem.launcher import on_root
from rail_fem.result import Cost, PassResult, Peak
from rail_fem.scene import Scene
from rail_fem.settings import FeSettings

CHECK_EVERY = 50  # steps between looks at volumes and velocities
LIMIT_EVERY = 4000  # steps between new stable steps by Lanczos
PATCH_REACH = 12e-3  # half length of a patch with room to spare [m]
HALF_BAND = 8e-3  # half width of the fine band on the crossing [m]
STOP_BALANCE = 0.10  # energy balance error over the impact's work that stops a run


def solve(scene: Scene, settings: FeSettings, folder: Path | None = None, restart: bool = False, progress=None) -> PassResult:
    """One pass. Collective on MPI.COMM_WORLD.

    folder : for mesh.npz, checkpoint.npz, fields/, figures/; None writes nothing.  restart : go on from folder/checkpoint.npz
    Errors: ValueError for what cannot be meshed or placed; ArithmeticError when the run becomes unstable (the last restart file stays).
    """
    comm, started = MPI.COMM_WORLD, time.perf_counter()
    running = on_root(lambda: running_of(scene, settings))
    mesh, first_gap, datum = placed_mesh(comm, scene, settings, running, folder, restart)
    if progress and mesh is not None:
        progress.note(f"mesh: {len(mesh.cells)} hexahedra, {len(mesh.points)} nodes")
    passage = build_passage(comm, scene, settings, running, mesh, datum)
    run = Run(comm, scene, settings, passage, folder, progress, first_gap)
    if restart and folder is not None and on_root(lambda: (folder / "checkpoint.npz").is_file()):
        run.resume()
    run.go()
    return run.result(time.perf_counter() - started)


def placed_mesh(comm, scene: Scene, settings: FeSettings, running: Running, folder: Path | None, restart: bool):
    """Mesh in place (root only), gap before placing [m], height of D0 at the start [m]. A restart reads the mesh of the run. Collective."""

    def make():
        stored = None if folder is None else folder / "mesh.npz"
        if restart and stored is not None and stored.is_file():
            return _read_mesh(stored)
        mesh, gap, datum = make_mesh(scene, settings, running)
        if stored is not None:
            folder.mkdir(parents=True, exist_ok=True)
            np.savez(stored, gap=gap, datum=datum, **{k: getattr(mesh, k) for k in MESH_ARRAYS})
            (folder / "mesh_quality.txt").write_text(mesh_quality(mesh).report(), encoding="utf-8")
        return mesh, gap, datum

    keep = {}

    def on_root_only():
        keep["mesh"], gap, datum = make()
        return gap, datum

    gap, datum = on_root(on_root_only)
    return keep.get("mesh"), gap, datum


MESH_ARRAYS = ("points", "cells", "region", "surface", "surface_region", "clamp")


def _read_mesh(path: Path):
    with np.load(path) as stored:
        mesh = HexMesh(region_names=("wing", "nose", "wheel"), **{k: stored[k] for k in MESH_ARRAYS})
        return mesh, float(stored["gap"]), float(stored["datum"])


def make_mesh(scene: Scene, settings: FeSettings, running: Running) -> tuple[HexMesh, float, float]:
    """Crossing and wheel, the wheel set down at the start. Root only. Errors: MeshError, CrossingError, ProfileError."""
    crossing, path = CastCrossing(scene.crossing.ratio), running.path
    low, high = sorted((running.start, running.end))
    rail = mesh_crossing(crossing, crossing_spec(crossing, path, low, high, settings.element_size, NEAR, PATCH_REACH, HALF_BAND))
    spec = WheelMeshSpec(settings.element_size, bands=wheel_bands(path, running.datum_y, low, high, NEAR, HALF_BAND), fine_half_length=PATCH_REACH + 4e-3)
    wheel = mesh_wheel(scene.wheel.shape, scene.wheel.radius, spec)
    height = datum_height(running, scene)
    mesh, gap = place_wheel(rail, wheel, running.start, running.datum_y, height)
    names = {name: i for i, name in enumerate(mesh.region_names)}
    order = np.array([{"wing": 0, "nose": 1, "wheel": 2}[name] for name in names], np.int8)
    mesh = replace(mesh, region=order[mesh.region], surface_region=order[mesh.surface_region], region_names=("wing", "nose", "wheel"))
    return mesh, gap, height - gap


def datum_height(running: Running, scene: Scene) -> float:
    """Height of the wheel's D0 where the rigid wheel stands at the start [m]: through its contact point."""
    path, radius = running.path, scene.wheel.radius
    i = int(np.argmin(np.abs(path.x - running.start)))
    x, y, z = path.contact_point[i]
    rolling = rolling_radius(scene.wheel.shape, radius, np.array([y - running.datum_y]))[0]
    return float(z - radius + np.sqrt(rolling**2 - (x - path.x[i]) ** 2))


class Run:
    """The time loop of one pass and what it leaves."""

    def __init__(self, comm, scene: Scene, settings: FeSettings, passage: Passage, folder: Path | None, progress, first_gap: float):
        self.comm, self.scene, self.settings, self.passage = comm, scene, settings, passage
        self.folder, self.progress, self.first_gap = folder, progress, first_gap
        self.dynamics, self.recorder = passage.dynamics, Recorder(passage)
        self.limit = self.dynamics.stable_step(1.0)
        self.dt = self.dynamics.stable_step(settings.courant)
        self.settled = passage.settling is None
        self.start_energies = None if not self.settled else self.dynamics.energies()
        self.frames: list[tuple[float, str]] = []
        self.next_row, self.next_frame, self.rechecks = settings.history_interval, 0.0, 0
        self.most_penalty, self.static_approach = 0.0, float("nan")
        self.loop_time = self.timed = 0.0  # in the steps of the whole run, and since this process began [s]
        self.last_checkpoint = time.perf_counter()

    # ---- restart

    PLAIN = ("limit", "dt", "settled", "start_energies", "frames", "next_row", "next_frame", "rechecks", "most_penalty", "loop_time", "static_approach")

    def save(self) -> None:
        """Write the restart file. Collective."""
        if self.folder is not None:
            extra = {name: getattr(self, name) for name in self.PLAIN} | {"recorder": self.recorder.state()}
            save_checkpoint(self.folder / "checkpoint.npz", self.dynamics, extra)
            self.last_checkpoint = time.perf_counter()

    def resume(self) -> None:
        """Go on from the restart file. Collective."""
        extra = load_checkpoint(self.folder / "checkpoint.npz", self.dynamics)
        self.recorder.restore(extra.pop("recorder"))
        for name, value in extra.items():
            setattr(self, name, value)
        self.frames = [tuple(frame) for frame in self.frames]

    # ---- the loop

    def go(self) -> None:
        """Run to the end of the window or to max_steps. Collective."""
        duration, d = self.passage.running.duration, self.dynamics
        most = self.settings.max_steps or np.inf
        while d.time < duration * (1 - 1e-12) and d.step_count < most:
            self._step()
        if self.recorder.steps:
            self.recorder.row(d.energies())
        self._frame("final.vtu")
        self.save()

    def _step(self) -> None:
        d, clock = self.dynamics, time.perf_counter()
        if not self.settled and d.time >= self.settings.settle_time:
            self._let_go()
        d.step(self.dt)
        self.recorder.after_step()
        if d.step_count % CHECK_EVERY == 0:
            d.check()
        if d.time >= self.next_row:
            self._report()
        if d.step_count % LIMIT_EVERY == 0:
            self._recheck_step()
        spent = time.perf_counter() - clock
        self.loop_time += spent
        self.timed += spent
        if d.time >= self.next_frame:
            self._next_frame()
        if d.step_count % CHECK_EVERY == 0 and self._checkpoint_due():
            self.save()

    def _let_go(self) -> None:
        running, d = self.passage.running, self.dynamics
        x = running.start + d.contact.offset
        rigid = float(running.height(x)) - float(running.height(running.start))
        self.static_approach = rigid - self.passage.axle.displacement[2]
        end_settling(self.passage, self.scene, self.settings)
        self.settled, self.start_energies = True, d.energies()

    def _report(self) -> None:
        d = self.dynamics
        energies = d.energies()
        self.recorder.row(energies)
        self.next_row += self.settings.history_interval
        self.most_penalty = max(self.most_penalty, energies["contact_penalty"])
        balance = self._balance_share(energies)
        if self.progress:
            self.progress.update(step=d.step_count, time=d.time, end_time=self.passage.running.duration, energy_balance=balance)
        if balance > STOP_BALANCE:
            raise ArithmeticError(
                f"energy balance error {balance:.1%} of the work of contact at step {d.step_count}, t = {d.time * 1e3:.4f} ms, "
                f"x = {self.passage.running.start * 1e3 + d.contact.offset * 1e3:.1f} mm: the run is unstable; take courant below {self.settings.courant:g}; "
                "the last restart file is kept"
            )

    def _balance_share(self, energies: dict[str, float]) -> float:
        """Balance error of the bodies over the work of contact so far (at least 5 J, so that the first steps are not judged)."""
        if self.start_energies is None:
            return 0.0
        work = trust.impact_work(np.array(self.recorder.contact_work))
        return abs(energies["balance"] - self.start_energies["balance"]) / max(work if np.isfinite(work) else 0.0, 5.0)

    def _recheck_step(self) -> None:
        self.rechecks += 1
        limit = self.dynamics.stable_step(self.settings.courant)
        self.dt = min(self.dt, limit)

    def _checkpoint_due(self) -> bool:
        due = time.perf_counter() - self.last_checkpoint > self.settings.checkpoint_interval
        return self.folder is not None and self.comm.bcast(due, root=0)

    def _next_frame(self) -> None:
        self._frame(f"frame_{len(self.frames):04d}.vtu")
        self.next_frame += self.passage.running.duration / self.settings.field_frames

    def _frame(self, name: str) -> None:
        if self.folder is None:
            return
        mesh, d = self.passage.mesh, self.dynamics
        arrays = (mesh.points, mesh.cells, mesh.region) if mesh is not None else (None, None, None)
        write_frame(self.folder / "fields" / name, d, *arrays, d.contact.offset)
        self.frames.append((d.time, name))
        if self.comm.rank == 0:
            write_collection(self.folder / "fields" / "pass.pvd", self.frames)

    # ---- what it found

    def result(self, wall_time: float) -> PassResult:
        """The result, replicated but for the element peaks, which root alone knows. Collective."""
        history = self.recorder.history()
        settled = self.settings.settle_time
        energies = self.dynamics.energies()
        quality = mesh_quality(self.passage.mesh) if self.passage.mesh is not None else None
        facts = self._trust_facts(history, settled, energies, quality)
        rows = trust.report_rows(facts)
        peaks = self._peaks(history, settled)
        slowest = self._slowest(quality)
        if self.folder is not None and self.comm.rank == 0:
            (self.folder / "trust.txt").write_text(trust.show_rows(rows, slowest), encoding="utf-8")
        d = self.dynamics
        memory = self.comm.allreduce(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)
        updates = d.domain.m_global * d.step_count / max(self.loop_time, 1e-9)
        cost = Cost(wall_time, d.domain.m_global, d.step_count, self.comm.size, updates, memory)
        last = {name: float(v) for name, v in energies.items()}
        return PassResult(
            model="fe_full",
            scene=self.scene,
            settings=self.settings.model_dump(mode="json"),
            history=history,
            peaks=peaks,
            transfer_x=transfer_place(history),
            energies=last,
            cost=cost,
            error_estimate={"energy_balance": rows[0].value, "static_load": abs(facts["static_error"])},
            trust={"rows": [row.plain() for row in rows], "slowest": slowest, "rigid_transfers": self.passage.running.path.transfers.tolist()},
            warnings=tuple(f"{row.name}: {row.shown} (rule: {row.rule})" for row in rows if row.verdict != trust.GOOD),
        )

    def _trust_facts(self, history: dict, settled: float, e: dict, quality: MeshQuality | None) -> dict:
        """Energies e now, replicated; quality of the mesh on root, None elsewhere. Collective."""
        d, start = self.dynamics, self.start_energies or e
        return {
            "balance": e["balance"] - start["balance"],
            "contact_loss": e["contact_loss"] - start["contact_loss"],
            "impact_work": trust.impact_work(np.array(self.recorder.contact_work)[history["time"] > settled]),
            "internal_energy": e["elastic"] + e["plastic"],
            "hourglass": e["hourglass"],
            "hourglass_zone": self._zone_hourglass(),
            "penalty": self.most_penalty,
            "penetration": self.recorder.deepest,
            "approach": self.static_approach if self.static_approach > 0 else float("nan"),
            "first_gap": self.first_gap,
            "static_error": static_error(history, self.passage.static_load, settled, self.passage.running),
            "step": self.dt,
            "limit": self.limit,
            "step_ratio": self.dt / self.limit,
            "element_limit": self.comm.bcast(quality.worst_step if quality else None, root=0),
            "rechecks": self.rechecks,
            "chatter": trust.chatter_share(history, self.scene.speed, self.settings.element_size, settled) if len(history["time"]) > 3 else float("nan"),
            "penalty_factor": self.settings.penalty,
            "outside": 1.0 - self.comm.allreduce(d.kernel_time) / self.comm.size / max(self.timed, 1e-9),
        }

    def _zone_hourglass(self) -> float:
        """Hourglass work over plastic work in the blocks of elements that yielded."""
        work = self.dynamics.structure.block_work
        yielded = work[:, 0] > 0
        plastic, hourglass = self.comm.allreduce(np.array([work[yielded, 0].sum(), work[yielded, 1].sum()]))
        return float(hourglass / plastic) if plastic > 0 else 0.0

    def _peaks(self, history: dict, settled: float) -> dict[str, Peak]:
        peaks = {}
        after = history["time"] > settled
        for name in ("force", "force_wing", "force_nose"):
            if after.any():
                i = np.flatnonzero(after)[np.argmax(history[name][after])]
                peaks[name] = Peak(float(history[name][i]), "N", x=float(history["x"][i]), y=float(history["contact_y"][i]), time=float(history["time"][i]))
        cells = gather_cells(self.dynamics)
        found = {}
        if cells is not None:
            mesh = self.passage.mesh
            for region, name in ((0, "wing"), (1, "nose")):
                mine = np.flatnonzero(mesh.region == region)
                if len(mine):
                    worst = mine[np.argmax(cells[mine, 6])]
                    found[f"plastic_strain_{name}"] = Peak(float(cells[worst, 6]), "1", *map(float, mesh.points[mesh.cells[worst]].mean(axis=0)))
        return peaks | self.comm.bcast(found, root=0)

    def _slowest(self, q: MeshQuality | None) -> list[str]:
        rows = None
        if q is not None:
            rows = [
                f"element {i} at ({c[0] * 1e3:.1f}, {c[1] * 1e3:.1f}, {c[2] * 1e3:.1f}) mm: V / A_max = {length * 1e3:.3f} mm"
                for i, c, length in zip(q.slowest, q.slowest_centre, q.slowest_length)
            ]
        return self.comm.bcast(rows, root=0)


def transfer_place(history: dict[str, np.ndarray]) -> float:
    """x where the nose first carries half of the force for good; NaN if it never does."""
    force, nose = history.get("force", np.empty(0)), history.get("force_nose", np.empty(0))
    carried = force > 1e3
    if not len(force) or not (carried & (nose > 0.5 * force)).any():
        return float("nan")
    other = np.flatnonzero(carried & (nose <= 0.5 * force))
    later = np.flatnonzero(carried & (nose > 0.5 * force))
    forward = history["x"][-1] > history["x"][0]
    index = (later[later > other.max(initial=-1)] if forward else later[later < other.min(initial=len(force))])
    return float(history["x"][index[0 if forward else -1]]) if len(index) else float("nan")


def static_error(history: dict[str, np.ndarray], static_load: float, settled: float, running: Running) -> float:
    """Mean force between the end of settling and the first bend of the rigid path, against the static load; NaN when there is no such stretch."""
    if not len(history["time"]):
        return float("nan")
    slope = running.slope(history["x"])
    steady = (history["time"] > settled) & (np.abs(slope - running.slope(running.start)) < 2e-4)
    ends = np.flatnonzero(~steady & (history["time"] > settled))
    last = history["x"][ends[0]] if len(ends) else history["x"][-1]
    steady &= (last - history["x"]) * running.sign > PATCH_REACH  # the patch reaches ahead of the axle
    if steady.sum() < 3:
        return float("nan")
    return float(history["force"][steady].mean() / static_load - 1)
