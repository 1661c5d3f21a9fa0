"""
Impact on the wheel against speed
=================================

The same scene at several speeds. The surfaces are searched once and kept, so that each further speed costs a fraction
of a second.
"""

import matplotlib.pyplot as plt
import numpy as np

import rail_fem

scene = rail_fem.load_case(rail_fem.example("nose_transfer")).scene
speeds = np.arange(30, 101, 10)
window = {"start": "95 mm", "end": "700 mm"}
results = [rail_fem.solve("rigid_hertz", scene.replace(speed=f"{speed} mph"), window) for speed in speeds]

# %%
# Up to 90 mph the impact grows with the speed on the whole; beyond, the wheel comes to the nose late in the bounce that
# the wing's bend has given it, and the impact falls. From 70 mph on a later landing is harder.
figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
for name in ("impact_on_wheel", "largest_force"):
    axes.plot(speeds, [result.peaks[name].value / 1e3 for result in results], "o-", label=name.replace("_", " "))
axes.axhline(scene.static_wheel_load / 1e3, color="grey", ls=":", label="static load")
axes.set(xlabel="speed [mph]", ylabel="contact force [kN]", ylim=(0, None))
axes.legend()
plt.show()
