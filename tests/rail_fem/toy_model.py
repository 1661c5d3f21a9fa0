"""A model small enough for tests of the machinery: a mass dropped onto a spring, by central differences.

It keeps a restart file, reports progress, and fails on demand, as a real model does.
"""

import json
import os
import signal
from pathlib import Path
from time import sleep

import numpy as np

from rail_fem.processes import launcher
from rail_fem.result.result import Cost, PassResult, Peak
from rail_fem.scene.scene import GRAVITY
from rail_fem.settings.explicit import FeSettings


class ToySettings(FeSettings):
    def smoke(self):
        return self.model_copy(update={"max_steps": 10})


def solve(scene, settings, folder=None, restart=False, progress=None):
    mass, stiffness = scene.vehicle.wheel_unsprung_mass, scene.foundation.stiffness
    step = 0.1 * np.sqrt(mass / stiffness)
    duration = abs(settings.end - settings.start) / scene.speed
    count = int(np.ceil(duration / step))
    rows, z, v, first = [], 0.0, 0.0, 0
    saved = Path(folder) / "restart.json" if folder and launcher.rank() == 0 else None
    if restart and saved.is_file():
        first, z, v, rows = json.loads(saved.read_text())
    for i in range(first, min(count, settings.max_steps or count)):
        if os.environ.get("TOY_FAULT") == str(i) and os.environ.get("TOY_RANK", str(launcher.rank())) == str(
            launcher.rank()
        ):
            raise ArithmeticError(f"unstable at step {i}, x = {settings.start:.3f} m")
        if os.environ.get("TOY_SIGNAL") == str(i):
            os.kill(os.getpid(), signal.SIGTERM)
            sleep(60)
        if os.environ.get("TOY_PAUSE"):
            sleep(float(os.environ["TOY_PAUSE"]))
        v += step * (-GRAVITY - stiffness * z / mass)
        z += step * v
        rows.append([i * step, settings.start + scene.direction_sign * scene.speed * i * step, -stiffness * z])
        if progress:
            progress.update(step=i, time=i * step, end_time=duration, energy_balance=0.0)
        if saved:
            saved.write_text(json.dumps([i + 1, z, v, rows]))
    if launcher.rank_count() > 1:
        from mpi4py import MPI

        MPI.COMM_WORLD.barrier()  # ranks need each other, as in a real model
    time, x, force = np.array(rows).T
    return PassResult(
        "toy",
        scene,
        settings.model_dump(mode="json"),
        {"time": time, "x": x, "force": force},
        peaks={"force": Peak(force.max(), "N", x=x[force.argmax()])},
        cost=Cost(0.1, 1, len(time)),
        fault=os.environ.get("TOY_RESULT_FAULT", ""),
        cut_off="" if len(time) == count else f"max_steps = {settings.max_steps} ended it",
    )
