"""
A run that is cut off goes on
=============================

On a cluster a job may reach its time limit or be moved. The same command, with ``--restart``, goes on from the last
restart file; ``cases/slurm.sh`` submits it so that a requeued job does this by itself. The result is the same to the
last bit, which is shown here: a pass is cut off after some steps, goes on, and is compared with one that was not.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from coarse_pass import CHANGES, coarse_pass

import rail_fem
from rail_fem.run.job import run_case

example = rail_fem.example("nose_transfer")
case = rail_fem.load_case(example, CHANGES)
short = rail_fem.load_case(example, CHANGES | {"run.fe_full.max_steps": 300})  # takes the place of the time limit
folder = Path(tempfile.mkdtemp()) / "run"


def quiet(report):
    """Takes the place of print: the run's report is not shown here."""


# %%
# The command line is ``rail-fem run CASE --out DIR`` and later ``rail-fem run CASE --out DIR --restart``.
run_case(short, "fe_full", folder, restart=False, overwrite=False, say=quiet)
before = rail_fem.load_result(folder)
print("cut off:", before.cut_off)
run_case(case, "fe_full", folder, restart=True, overwrite=False, say=quiet)
after = rail_fem.load_result(folder)

# %%
# The pass that was never cut off.
whole = rail_fem.load_result(coarse_pass())
for name, column in whole.history.items():
    assert np.array_equal(column, after.history[name], equal_nan=True), f"the histories of {name} differ"
print(f"{len(whole.history)} columns of {len(whole.history['x'])} rows: all the same to the last bit")

# %%
figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
axes.plot(1e3 * whole.history["x"], whole.history["force"] / 1e3, color="black", lw=4, alpha=0.3, label="in one piece")
axes.plot(1e3 * after.history["x"], after.history["force"] / 1e3, "--", label="cut off and restarted")
axes.axvline(1e3 * before.history["x"][-1], color="tab:red", lw=1, label="cut off here")
axes.set(xlabel="position of the wheel x [mm]", ylabel="contact force [kN]")
axes.legend()
plt.show()
