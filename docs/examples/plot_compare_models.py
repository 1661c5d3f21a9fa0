"""
Light models of one scene beside each other
===========================================

A spring over the rigid wheel's path bounds the force from above; contacts that may be plastically indented come near
the finite elements.
"""

import matplotlib.pyplot as plt

import rail_fem

scene = rail_fem.load_case(rail_fem.example("nose_transfer")).scene
window = {"start": "95 mm", "end": "700 mm"}
runs = {
    "lumped": rail_fem.solve("lumped", scene, window),
    "rigid_hertz, elastic": rail_fem.solve("rigid_hertz", scene, {**window, "plastic_indentation": False}),
    "rigid_hertz": rail_fem.solve("rigid_hertz", scene, window),
}
formula = rail_fem.solve("p2_formula", scene)

figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
for name, result in runs.items():
    axes.plot(result.history["x"] * 1e3, result.history["force"] / 1e3, label=f"{name}, {result.cost.wall_time:.1f} s")
axes.axhline(formula.peaks["p2"].value / 1e3, color="black", ls="--", label="P2 of the formula")
axes.set(xlabel="position of the wheel x [mm]", ylabel="contact force [kN]")
axes.legend()
plt.show()
