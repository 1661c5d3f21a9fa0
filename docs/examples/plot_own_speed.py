"""
A case at one's own speed
=========================

A case file is loaded, its speed changed, and the pass solved by a light model. What is changed is checked as a case
file's keys are.
"""

import matplotlib.pyplot as plt

import rail_fem

case = rail_fem.load_case(rail_fem.example("nose_transfer"))
faster = case.scene.replace(speed="100 mph", foundation={"stiffness": "80 kN/mm"})
result = rail_fem.solve("rigid_hertz", faster, {"start": "95 mm", "end": "700 mm"})

# %%
# What was found, in engineers' units, and what the model warns of.
for name, value in result.summary_rows():
    print(f"{name:24s} {value}")
for warning in result.warnings:
    print("warning:", warning)

# %%
# Forces, the wheel's height and the crossing's along the path, as `rail-fem show` draws them, into a file; and the
# force by hand.
rail_fem.plot_force(result, "100 mph on a softer foundation").savefig("force.png")
table = result.to_dataframe()
axes = table.plot(x="x [mm]", y=["force_wing [kN]", "force_nose [kN]"], figsize=(7, 4), ylabel="contact force [kN]")
plt.show()
