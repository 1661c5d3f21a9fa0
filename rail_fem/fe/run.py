"""The time loop of a pass: settle, let go, run to the end; records, frames, restart files, and a stop when the energies
part."""

from __future__ import annotations

import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np

from kernel_cache import working_time
from rail_fem.fe import trust
from rail_fem.fe.checkpoint import load_checkpoint, save_checkpoint
from rail_fem.fe.fields import write_collection, write_frame
from rail_fem.fe.passage import Passage, end_settling, take_up
from rail_fem.fe.recorder import Recorder
from rail_fem.fe.static_start import Relaxation, settle_in_place
from rail_fem.hierarchy import smoke_requested
from rail_fem.processes.launcher import on_root
from rail_fem.scene.scene import Scene
from rail_fem.settings.explicit import FeSettings

CHECK_EVERY = 50  # steps between looks at volumes and velocities
LIMIT_EVERY = 4000  # steps between new stable steps by Lanczos
CHECKPOINT = "checkpoint.npz"
STATIC_START = "static_start.npz"  # on the way to the first step of the pass


class Run:
    """The time loop of one pass: `go` to the end, or `resume` first. limit, dt : stable step and step in use [s]."""

    STATE = (
        "dynamics",
        "recorder",
        "limit",
        "dt",
        "at_rest",
        "settled",
        "start_energies",
        "frames",
        "next_row",
        "next_frame",
        "rechecks",
        "static_approach",
        "loop_time",
        "spent",
    )
    SCRATCH = ("started", "last_checkpoint", "card")

    def __init__(
        self,
        comm,
        scene: Scene,
        settings: FeSettings,
        passage: Passage,
        folder: Path | None,
        progress,
        identity: Mapping[str, str] | None = None,
    ):
        """folder : takes fields and restart files, None for none;  identity : what a restart file belongs to, root only
        (rail_fem.files.sealed)"""
        self.identity, self.started = identity or {}, working_time()
        self.comm, self.scene, self.settings, self.passage = comm, scene, settings, passage
        self.folder, self.progress = folder, progress
        self.dynamics, self.recorder = passage.dynamics, Recorder(passage)
        self.card = None
        if settings.device == "cuda":
            from rail_fem.fe.card.fits import unfit_for_card
            from rail_fem.fe.card.on_card import OnCard

            if unfit := unfit_for_card(scene, settings, comm.size):
                raise ValueError("; ".join(unfit))
            self.card = OnCard(self.dynamics, passage.rail_region)
        self.limit = self.dynamics.stable_step(1.0)
        self.dt = self.dynamics.stable_step(settings.courant)
        self.at_rest, self.settled = False, passage.settling is None
        self.relaxation: Relaxation | None = None  # on the way to rest
        self.start_energies = None if not self.settled else self.dynamics.energies()
        self.frames: list[list] = []  # time [s], file name
        self.next_row, self.next_frame, self.rechecks = settings.history_interval, 0.0, 0
        self.static_approach = float("nan")
        self.loop_time = self.spent = 0.0  # of the whole run, in its steps and up to the last restart file [s]
        self.last_checkpoint = time.perf_counter()

    # ---- restart

    def save(self) -> None:
        """Write the restart file, of the static contact until the pass begins. Collective."""
        if self.folder is None:
            return
        self.spent, self.started = self.wall_time, working_time()
        if self.relaxation is None:
            save_checkpoint(self.folder / CHECKPOINT, self, self.dynamics, self.identity)
            on_root(partial((self.folder / STATIC_START).unlink, missing_ok=True), self.comm)
        else:
            self.relaxation.spent = self.spent
            save_checkpoint(self.folder / STATIC_START, self.relaxation, self.relaxation.dynamics, self.identity)
        self.last_checkpoint = time.perf_counter()

    @property
    def wall_time(self) -> float:
        """Of the whole run, less what was lost at stops [s]."""
        return self.spent + working_time() - self.started

    def resume(self) -> None:
        """Go on from the restart file; begin where there is none. Collective. Errors: ValueError for a run without a
        folder."""
        if self.folder is None:
            raise ValueError("a run without a folder has no restart file: give the folder")
        folder = self.folder
        there = lambda: next((name for name in (CHECKPOINT, STATIC_START) if (folder / name).is_file()), None)
        name = on_root(there, self.comm)
        if name == CHECKPOINT:
            load_checkpoint(folder / CHECKPOINT, self, self.dynamics, self.identity)
        elif name == STATIC_START:
            self.relaxation = Relaxation(self.passage, self.scene)
            load_checkpoint(folder / STATIC_START, self.relaxation, self.relaxation.dynamics, self.identity)
            self.spent = self.relaxation.spent

    # ---- the loop

    def begin(self) -> None:
        """Bring the wheel to rest where it stands, under the load of the start. Collective."""
        most_steps = self.settings.max_steps if smoke_requested() else None
        self.relaxation = self.relaxation or Relaxation(self.passage, self.scene)
        found = settle_in_place(self.relaxation, most_steps, self._look_at_rest)
        self.at_rest, self.static_approach, self.relaxation = True, found.approach, None
        if self.settled:
            if self.passage.start.moves:
                take_up(self.passage, self.scene, self.settings)
            self.start_energies = self.dynamics.energies()

    def _look_at_rest(self, says: str) -> None:
        if self.progress:
            self.progress.before_the_first_step(says)
        if self._checkpoint_due():
            self.save()

    @property
    def element_time(self) -> float:
        """Time in which the wheel passes an element [s]."""
        return self.settings.along / self.scene.speed

    def go(self) -> None:
        """From rest, unless resumed, run to the end of the window or to max_steps. The last restart file holds the
        state before the end is recorded, so that a restart after it records it once more, and the same. Collective."""
        if not self.at_rest:
            self.begin()
        while not self._over():
            self._step()
        self.save()
        if self.recorder.steps:
            self.recorder.row(self.dynamics.energies())
        self._frame("final.vtu", "f8")

    def _over(self) -> bool:
        d = self.dynamics
        return d.time >= self.passage.running.duration * (1 - 1e-12) or d.step_count >= (
            self.settings.max_steps or np.inf
        )

    @property
    def cut_off(self) -> str:
        """Why the run ended before its path did; empty when it went to the end."""
        running, d = self.passage.running, self.dynamics
        if d.time >= running.duration * (1 - 1e-12):
            return ""
        x = running.start + d.contact.wheel.offset
        return (
            f"max_steps = {self.settings.max_steps} ended it at x = {x * 1e3:.1f} mm, {d.time / running.duration:.1%}"
            " of the pass"
        )

    def _step(self) -> None:
        d, clock = self.dynamics, working_time()
        if not self.settled and d.time >= self.settings.settle_time:
            self._let_go()
        if self.card is None:
            d.step(self.dt)
            self.recorder.after_step()
        else:
            self.card.advance(self.dt, self._steps_to_a_look(), self.recorder)
        row = d.time >= self.next_row
        checked = d.check() if self._looks(row) else None
        if row:
            self._report(checked or d.energies())
        if d.step_count % LIMIT_EVERY == 0:
            self._recheck_step()
        self.loop_time += working_time() - clock
        if d.time >= self.next_frame and not self._over():  # the last frame is the final one
            self._next_frame()
        if d.step_count % CHECK_EVERY == 0 and self._checkpoint_due():
            self.save()

    def _steps_to_a_look(self) -> int:
        """Steps up to the next after which somebody looks at the state or changes it."""
        d, settings = self.dynamics, self.settings
        ends = [self.next_row, self.next_frame, self.passage.running.duration * (1 - 1e-12)]
        time, end = d.time, min(ends if self.settled else [*ends, settings.settle_time])
        for steps in range(1, CHECK_EVERY):
            time += self.dt
            number = d.step_count + steps
            if time >= end or number % CHECK_EVERY == 0 or number == settings.max_steps:
                return steps
        return CHECK_EVERY

    def _looks(self, row: bool) -> bool:
        """Whether volumes, velocities and energies are looked at in this step: about every CHECK_EVERY steps, and where
        rows of the history come as often with one of them, which needs the energies anyway. row : whether one is due"""
        apart = max(1.0, self.settings.history_interval / self.dt)
        if apart > CHECK_EVERY:
            return self.dynamics.step_count % CHECK_EVERY == 0
        return row and len(self.recorder.rows) % round(CHECK_EVERY / apart) == 0

    def _let_go(self) -> None:
        d = self.dynamics
        before = d.energies()["balance"]
        end_settling(self.passage, self.scene, self.settings)
        self.settled, self.start_energies = True, d.energies()
        self.recorder.exchanged += self.start_energies["balance"] - before
        if self.card is not None:
            self.card.stale = True

    def _report(self, energies: dict[str, float]) -> None:
        d = self.dynamics
        self.recorder.row(energies)
        self.next_row += self.settings.history_interval
        balance, x = self._balance_share(energies), self.passage.running.start + d.contact.wheel.offset
        if self.progress:
            self.progress.update(
                step=d.step_count, time=d.time, end_time=self.passage.running.duration, energy_balance=balance
            )
        if balance > trust.STOP_BALANCE:
            raise ArithmeticError(
                f"energy balance error {balance:.1%} of the work of contact at step {d.step_count}, t ="
                f" {d.time * 1e3:.4f} ms, x = {x * 1e3:.1f} mm: the run is"
                f" unstable; take courant below {self.settings.courant:g}; the last restart file is kept"
            )

    def _balance_share(self, energies: dict[str, float]) -> float:
        """Balance error of the bodies over the work of contact so far (at least 5 J, so that the first steps are not
        judged)."""
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
        self._frame(f"frame_{len(self.frames):04d}.vtu", "f4")
        self.next_frame += self.passage.running.duration / self.settings.field_frames

    def _frame(self, name: str, dtype: str) -> None:
        if self.folder is None:
            return
        d = self.dynamics
        write_frame(self.folder / "fields" / name, d, d.contact.wheel.offset, dtype)
        self.frames.append([d.time, name])
        if self.comm.rank == 0:
            write_collection(self.folder / "fields" / "pass.pvd", self.frames)
