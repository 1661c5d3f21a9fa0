"""A small cap rolls over a small plastic block, with friction, free spin, springs and, by choice, a travelling window,
by the processor's kernels or on a simulated card.

    NUMBA_ENABLE_CUDASIM=1 NUMBA_DISABLE_JIT=1 python -m tests.fe.card_job FOLDER JOB ...

A process of its own simulates the card: numba decides when it is first imported. Nothing is compiled there.
"""

import os
import subprocess
import sys
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mpi4py import MPI

from geometry.meshing.blocks import mesh_cap, mesh_grid
from geometry.meshing.hexmesh import merge_bodies
from rail_fem.fe.blocks import ElementSettings
from rail_fem.fe.dynamics import Dynamics
from rail_fem.scene.steel import MN13, cyclic_steel
from tests.fe import rolling_job

MM = 1e-3
LENGTH, START = 16 * MM, 5.13 * MM
STEP, DAMPING = 6e-8, 4e-9  # below the critical step; of the cap's kernel [s]
AHEAD, BEHIND = 3.8 * MM, 2.18 * MM
EVERY = 7  # steps to a look
FASTER = 30.0  # than the cap of rolling_job comes down: the block yields at once
LONGEST = 300  # of all jobs [s]
SOFT = MN13.scaled(0.1)  # so that few steps see it flow
BACK_STRESSES = {"modulus": [100e9, 20e9], "recovery": [2000.0, 300.0], "mixing": [1.0, 0.2]}
CYCLIC = BACK_STRESSES | {"yield_stress": 30e6, "hardening": 60e6, "hardening_rate": 50.0}
STEELS = {
    "Mn13": MN13,
    "isotropic": SOFT,
    "kinematic": replace(SOFT, hardening="kinematic"),
    "cyclic": cyclic_steel(MN13.youngs_modulus, MN13.poisson, MN13.density, **CYCLIC),
}
OF_CONTACT = ("force", "normal_force", "slip", "pressure_at", "tributary_area", "sums", "work", "friction_work")
OF_WHEEL = ("offset", "spin", "towed", "rotation")


def bodies(start: float):
    """Block of 1 mm elements and a cap above x = start [m]."""
    x, y = np.linspace(0, LENGTH, round(LENGTH / MM) + 1), np.linspace(-2 * MM, 2 * MM, 5)
    block = mesh_grid(x, y, np.linspace(-2 * MM, 0.0, 3), "block")
    size = (1.5 * MM, 1.5 * MM)
    cap = mesh_cap(rolling_job.RADIUS, rolling_job.RADIUS, size, 2 * MM, 0.8 * MM, (*size, 2 * MM), name="cap")
    cap.points[:] += [start, rolling_job.ASIDE, 0.0]
    return merge_bodies([block, cap])


def scene(window: int, element: str = "one-point", steel: str = "Mn13") -> Dynamics:
    """At its start. window : 1 for one that a slab of the block leaves in step 9, 0 for all of the block;  element,
    steel : of the block, see STEELS"""
    of_block = {"steel": STEELS[steel], "settings": ElementSettings(element), "bodies": bodies, "start": START}
    made = rolling_job.rolling(MPI.COMM_SELF, *(AHEAD, BEHIND) if window else (None, None), **of_block)
    dynamics = made.dynamics
    dynamics.structure.v *= FASTER
    made.plate.velocity *= FASTER
    dynamics.structure.damping = DAMPING
    dynamics.balance_mark = 0.0  # not looked at
    return dynamics


def regions(dynamics: Dynamics) -> np.ndarray:
    """Two bodies side by side, of each surface node of the block."""
    return np.arange(dynamics.contact.surfaces.n_rail) % 2


def found(dynamics: Dynamics, total: np.ndarray, moment: np.ndarray) -> dict[str, np.ndarray]:
    """All that steps have changed. total, moment : what is recorded of them"""
    s, c, supports = dynamics.structure, dynamics.contact, dynamics.supports
    out = {name: getattr(s, name) for name in ("x", "v", "force", "block_work", "works", "smallest_volume")}
    out |= {"state": s.finite.read(0, s.finite.rows), "back": s.finite.back, "total": total, "moment": moment}
    out["plastic strain"] = s.finite.plastic_strain()
    out |= {f"contact {name}": getattr(c, name) for name in OF_CONTACT}
    out |= {f"wheel {name}": getattr(c.wheel, name) for name in OF_WHEEL}
    out |= {name: getattr(c.search, name) for name in ("position", "steps_left")}
    for group in supports.groups:
        out |= {f"{group.name} {name}": getattr(group, name) for name in ("velocity", "displacement", "load_work")}
    out |= {link.name: link.dissipated for link in supports.links}
    return {name: np.array(value, float) for name, value in out.items()} | {"active": np.array(s.active)}


class Job(NamedTuple):
    """anew : 1 where the card takes all anew after each look, 0 where it goes on;  the others as of `scene`"""

    steps: int
    window: int = 0
    element: str = "one-point"
    steel: str = "Mn13"
    every: int = EVERY
    anew: int = 0

    @property
    def word(self) -> str:
        return "_".join(map(str, self))


def by_processor(job: Job) -> dict[str, np.ndarray]:
    from rail_fem.fe.node_kernels import add_step

    dynamics, total, moment = scene(*job[1:4]), np.zeros(5), np.zeros(4)
    c, region = dynamics.contact, regions(dynamics)
    s = c.surfaces
    for _ in range(job.steps):
        dynamics.step(STEP)
        add_step(c.force, c.normal_force, c.search.position, s.area, c.watched, s.n_rail, region, total, moment)
    return found(dynamics, total, moment)


def by_card(folder: Path, jobs: Collection[Job]) -> dict[Job, dict[str, np.ndarray]]:
    """By a process that simulates the card. Errors: RuntimeError with its last words."""
    command = [sys.executable, "-m", "tests.fe.card_job", str(folder), *(job.word for job in jobs)]
    switches = {"NUMBA_ENABLE_CUDASIM": "1", "NUMBA_DISABLE_JIT": "1"}
    answer = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST, env=os.environ | switches)
    if answer.returncode != 0:
        raise RuntimeError(f"{' '.join(command)} ended with {answer.returncode}: {answer.stderr.strip()[-800:]}")
    made = {}
    for job in jobs:
        with np.load(folder / f"{job.word}.npz") as file:
            made[job] = dict(file)
    return made


def main(folder: str, *words: str) -> None:
    from types import SimpleNamespace

    from rail_fem.fe.card.on_card import OnCard

    for word in words:
        steps, window, element, steel, every, anew = word.split("_")
        dynamics = scene(int(window), element, steel)
        recorder = SimpleNamespace(total=np.zeros(5), moment=np.zeros(4), steps=0)
        card = OnCard(dynamics, regions(dynamics))
        for first in range(0, int(steps), int(every)):
            card.advance(STEP, min(int(every), int(steps) - first), recorder)
            card.stale = anew == "1"
        assert recorder.steps == dynamics.step_count == int(steps)
        np.savez(Path(folder) / f"{word}.npz", **found(dynamics, recorder.total, recorder.moment))


if __name__ == "__main__":
    sys.setswitchinterval(1e-4)  # [s]; the simulator asks its threads in a loop whether they wait
    main(*sys.argv[1:])
