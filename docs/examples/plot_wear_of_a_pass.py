"""
Wear of one pass by every law
=============================

A wheel passes a crossing; the patches of wing and nose every 4 mm give tractions and slip, and each wear law its depth.
The band between the laws is what such a number is worth without a calibration from the field.
"""

import matplotlib.pyplot as plt

import rail_fem
from rail_fem.damage.crossing import PatchOptions, pass_contacts, wear_field
from rail_fem.damage.wear import dry_laws

hardness = 5e9  # worked manganese steel [Pa]
scene = rail_fem.load_case(rail_fem.example("nose_transfer")).scene
result = rail_fem.solve("rigid_hertz", scene, {"start": "200 mm", "end": "500 mm"})
contacts = pass_contacts(result, spacing=4e-3, options=PatchOptions(hardness=hardness))
laws = dry_laws(hardness)
field = wear_field(contacts, laws, spacing=4e-3)

# %%
# T gamma of every patch, and the deepest wear of one pass at every x by each law.
figure, (upper, lower) = plt.subplots(2, 1, sharex=True, figsize=(8, 6))
for number, body in enumerate(("wing", "nose")):
    own = contacts.body == number
    upper.plot(contacts.position[own, 0] * 1e3, contacts.tgamma[own], ".-", label=body)
upper.set(ylabel="T gamma [N]")
upper.legend()
for name, law in laws.items():
    lower.plot(field.x * 1e3, field.depth[name].max(axis=(0, 2)) * 1e9, label=law.label)
lower.set(yscale="log", ylim=(0.1, None), xlabel="x [mm]", ylabel="deepest wear of one dry pass [nm]")
lower.legend(fontsize=8)
plt.show()
