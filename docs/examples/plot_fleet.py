"""
A fleet over the nose
=====================

What one wheel in ten does: wheels, speeds and loads are drawn, each pass takes a light model a fraction of a second.
The traffic is an example, not that of a known line; `rail-fem sweep cases/rows/fleet.toml` does the same with bars of
the quantiles, and proves them by the explicit model.
"""

import matplotlib.pyplot as plt
import numpy as np

import rail_fem

scene = rail_fem.load_case(rail_fem.example("nose_transfer")).scene
window = {"start": "95 mm", "end": "700 mm"}
draw = np.random.default_rng(1)
profiles = draw.choice(["P8", "P8-worn", "P1"], size=32, p=[0.3, 0.6, 0.1])
speeds, loads = draw.normal(65, 12, 32), draw.uniform(11, 25, 32)
impact = np.empty(32)
for number, (profile, speed, load) in enumerate(zip(profiles, speeds, loads)):
    drawn = scene.replace(wheel={"profile": str(profile)}, speed=f"{speed} mph", vehicle={"axle_load": f"{load} t"})
    impact[number] = rail_fem.solve("rigid_hertz", drawn, window).peaks["impact_on_wheel"].value / 1e3

# %%
# The impact grows with the speed on the whole; profile and load scatter it by as much again.
median, tenth = np.quantile(impact, [0.5, 0.9])
print(f"half of the wheels strike with more than {median:.0f} kN, one in ten with {tenth:.0f}")
figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
for profile in np.unique(profiles):
    own = profiles == profile
    axes.plot(speeds[own], impact[own], "o", label=profile)
axes.axhline(tenth, color="grey", ls=":", label="nine tenths are below")
axes.set(xlabel="speed [mph]", ylabel="impact on the wheel [kN]", ylim=(0, None))
axes.legend()
plt.show()

# %%
# The worst of them, to be looked at by itself.
worst = int(impact.argmax())
print(f"{profiles[worst]} with {loads[worst]:.1f} t at {speeds[worst]:.0f} mph: {impact[worst]:.0f} kN")
