"""A rung small enough for tests of the machinery: a mass dropped onto a spring, by central differences.

It keeps a restart file, reports progress, and fails on demand, as a real rung does.
"""

import json
import os
from pathlib import Path
from typing import Annotated, ClassVar

import numpy as np

from rail_fem.result import Cost, PassResult, Peak
from rail_fem.scene import GRAVITY, Frozen
from rail_fem.units import Quantity


class ToySettings(Frozen):
    free_on_restart: ClassVar[tuple[str, ...]] = ("max_steps",)
    element_size: Annotated[float, Quantity("mm", 0.1, 20, "size")] = 1e-3
    start: Annotated[float, Quantity("mm", -2000, 3000, "start")] = 0.2
    end: Annotated[float, Quantity("mm", -2000, 3000, "end")] = 0.5
    courant: float = 0.5
    penalty: float = 1.0
    settle_time: float = 0.0
    max_steps: int | None = None

    def smoke(self):
        return self.model_copy(update={"max_steps": 10})


def solve(scene, settings, folder=None, restart=False, progress=None):
    mass, stiffness = scene.vehicle.wheel_unsprung_mass, scene.foundation.stiffness
    step = settings.courant * 2 * np.sqrt(mass / stiffness) / 10
    duration = abs(settings.end - settings.start) / scene.speed
    count = int(np.ceil(duration / step))
    rows, z, v, first = [], 0.0, 0.0, 0
    saved = Path(folder) / "restart.json" if folder else None
    if restart and saved.is_file():
        first, z, v, rows = json.loads(saved.read_text())
    for i in range(first, min(count, settings.max_steps or count)):
        if os.environ.get("TOY_FAULT") == str(i):
            raise RuntimeError(f"unstable at step {i}, x = {settings.start:.3f} m")
        v += step * (-GRAVITY - stiffness * z / mass)
        z += step * v
        rows.append([i * step, settings.start + scene.direction_sign * scene.speed * i * step, -stiffness * z])
        if progress:
            progress.update(step=i, time=i * step, end_time=duration, energy_balance=0.0)
        if saved:
            saved.write_text(json.dumps([i + 1, z, v, rows]))
    time, x, force = np.array(rows).T
    return PassResult("toy", scene, settings.model_dump(mode="json"), {"time": time, "x": x, "force": force},
                      peaks={"force": Peak(force.max(), "N", x=x[force.argmax()])}, cost=Cost(0.1, 1, len(time)),
                      fault=os.environ.get("TOY_RESULT_FAULT", ""))
