"""
One's own wheel profile
=======================

A measured profile comes as a file of points, here two columns in millimetres as many devices write them. It is read
once, judged and repaired by the profile doctor, and known by its content from then on.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import rail_fem
from rail_fem import geometry

# %%
# A surrogate for a measured file: a P8 with 0.4 mm worn off its tread, a point each 0.25 mm, 10 micrometres of scatter.
new = geometry.wheel_profile("P8")
along = np.arange(0, new.arc_length[-1], 0.25e-3)
points = 1e3 * np.column_stack([np.interp(along, new.arc_length, c) for c in new.points.T])
worn = points[:, 1] - 0.4 * np.exp(-((points[:, 0] / 25) ** 4))
noise = np.random.default_rng(1).normal(0, 0.01, len(points))
file = Path(tempfile.mkdtemp()) / "my_wheel.csv"
np.savetxt(file, np.column_stack([points[:, 0], worn + noise]), delimiter=",", header="y [mm], z [mm]")

# %%
# What the doctor says of it.
found = geometry.examine(geometry.read_raw(file, kind="wheel"))
print(found.report())

# %%
# The pass with this wheel and with the new one.
scene = rail_fem.load_case(rail_fem.example("nose_transfer")).scene
window = {"start": "95 mm", "end": "700 mm"}
figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
for wheel in ("P8", str(file)):
    result = rail_fem.solve("rigid_hertz", scene.replace(wheel={"profile": wheel}), window)
    axes.plot(result.history["x"] * 1e3, result.history["force"] / 1e3, label=Path(wheel).name)
axes.set(xlabel="position of the wheel x [mm]", ylabel="contact force [kN]")
axes.legend()
plt.show()
