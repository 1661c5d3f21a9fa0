"""
One's own crossing
==================

A crossing comes as a table of x, y, z along its sections, measured or drawn. Here it is one that the program makes
itself, with its wing rail 1 mm higher, in place of a measured file.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import rail_fem
from rail_fem.export.sections import crossing_sections, write_section_folder, written_range

scene = rail_fem.load_case(rail_fem.example("nose_transfer")).scene
raised = scene.replace(crossing={"wing_raise": "1 mm"})
folder = Path(tempfile.mkdtemp()) / "my_sections"
low, high = written_range(raised.crossing.surface, None, None)
x, sections = crossing_sections(raised.crossing.surface, low, high, 20e-6)
write_section_folder(folder, x, sections, "a wing rail 1 mm higher")
print(f"{len(x)} sections from x = {1e3 * low:.0f} to {1e3 * high:.0f} mm")

# %%
# In a case file this is a table [scene.crossing] with family and file; every model runs on it.
text = rail_fem.example("nose_transfer").read_text(encoding="utf-8")
case = folder.parent / "my_crossing.toml"
case.write_text(text.replace('family = "UK-cast"\nratio = 10.75', 'family = "sections"\nfile = "my_sections"'))
own = rail_fem.load_case(case).scene

# %%
# The pass by sections is that on the crossing itself, but for what they leave open between them; where wheels change
# body a millimetre of wing decides.
figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
for name, one, line in (("as drawn", scene, "-"), ("wing + 1 mm", raised, "-"), ("wing + 1 mm, by sections", own, ":")):
    result = rail_fem.solve("rigid_hertz", one, {"start": "95 mm", "end": "700 mm"})
    axes.plot(result.history["x"] * 1e3, result.history["force"] / 1e3, line, label=name)
    print(f"{name:26s} impact {result.peaks['impact_on_wheel'].value / 1e3:.0f} kN")
axes.set(xlabel="position of the wheel x [mm]", ylabel="contact force [kN]")
axes.legend()
plt.show()
