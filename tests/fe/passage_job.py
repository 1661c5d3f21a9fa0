"""A short coarse pass, started by test_passage.py on 1, 2 and 3 ranks: prints its last numbers, and can be cut off and
gone on with.

    python -m mpi4py tests/fe/passage_job.py STEPS [FOLDER [copy|restart|full|small|elastic|foot|bearers]]

copy: half way the folder is copied to FOLDER_cut, as a kill at that moment would leave it; full: with the fully
integrated element; small: with heavier small elements; elastic: on the coarse elastic wheel of
tests/fe/elastic_wheel.py; foot: on the coarse casting of that in a travelling window; bearers: on a beam.
"""

import hashlib
import json
import shutil
import sys
from pathlib import Path
from unittest.mock import patch

from mpi4py import MPI

from rail_fem.case.casefile import load_case
from rail_fem.models import fe_full
from rail_fem.run.form import PANEL
from tests.fe.elastic_wheel import casting_below, on_elastic_wheel, wheel_behind


def main(steps: int, folder: Path | None = None, how: str = "") -> None:
    case = load_case("nose_transfer")
    settings = case.runs["fe_full"].model_copy(
        update={
            "max_steps": steps,
            "element_size": 5e-3,
            "element_aspect": 1.0,
            "wheel_element_ratio": 1.0,
            "start": 0.30,
            "end": 0.42,
            "settle_time": 5e-5,
            "mass_scaling": {"small": 9.0, "foot": 25.0}.get(how, 1.0),
            "scaled_elements": "small",
            "error_twin": False,
            "window_ahead": 0.06 if how == "foot" else None,
            "window_behind": 0.06 if how == "foot" else None,
            "foot_depth": 0.1 if how == "foot" else None,
            "history_interval": 2e-5,
            "field_frames": 2,
            "element": "full" if how == "full" else "one-point",
        }
    )
    scene = on_elastic_wheel(case.scene) if how == "elastic" else case.scene
    scene = scene.replace_si(bearers=PANEL) if how == "bearers" else scene
    step = fe_full.Run._step

    def copy_half_way(run):  # no last row, no result: what is on the disk after a restart file
        step(run)
        if run.dynamics.step_count == steps // 2:
            run.save()
            if MPI.COMM_WORLD.rank == 0:
                shutil.copytree(folder, f"{folder}_cut")
            MPI.COMM_WORLD.barrier()

    stepping = patch.object(fe_full.Run, "_step", copy_half_way if how == "copy" else step)
    coarse = patch.multiple(fe_full, wheel_behind=wheel_behind, casting_below=casting_below)
    with stepping, coarse:
        result = fe_full.solve(scene, settings, folder, restart=how == "restart")
    if MPI.COMM_WORLD.rank == 0:
        names = (
            "time",
            "x",
            "force",
            "force_wing",
            "force_nose",
            "wheel_height",
            "crossing_height",
            "energy_plastic",
            "energy_hourglass",
            "energy_balance",
            "energy_springs",
        )
        digest = hashlib.sha256(
            b"".join(result.history[name].tobytes() for name in sorted(result.history) if name != "time")
        ).hexdigest()
        print(json.dumps({"digest": digest, **{name: result.history[name].tolist() for name in names}}))


if __name__ == "__main__":
    main(int(sys.argv[1]), *map(Path, sys.argv[2:3]), *sys.argv[3:])
