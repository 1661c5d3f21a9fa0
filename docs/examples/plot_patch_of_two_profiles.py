"""
Contact patch of two profiles
=============================

A P8 wheel stands centred on a 60E1 rail. Where does it touch, and what does the patch look like under 100 kN?
"""

import matplotlib.pyplot as plt
import numpy as np

from rail_fem import bem
from rail_fem.contact.contact_pairs import plain_rail_pair

# %%
# The pair: the wheel lowered onto the rail, seen from the point where it first touches.
pair = plain_rail_pair(rail="60E1")

# %%
# The patch: pressure of two elastic half-spaces on the true gap of the two profiles.
patch = bem.normal_contact(
    pair.gap, pair.wheel_steel, pair.rail_steel, load=pair.normal_force(100e3), window=pair.window()
)
print(
    f"largest pressure {patch.max_pressure / 1e6:.0f} MPa, approach {patch.approach * 1e6:.1f} um, area"
    f" {patch.contact_area * 1e6:.1f} mm2"
)

# %%
# Its map. The lateral axis points to the left as axles look.
x, y = patch.grid.x, patch.grid.y
figure, axes = plt.subplots(figsize=(5, 4), layout="constrained")
shown = axes.pcolormesh(1e3 * y, 1e3 * x, np.ma.masked_equal(patch.pressure, 0.0) / 1e6, cmap="viridis")
axes.set(xlabel="lateral y [mm]", ylabel="along the rail x [mm]", aspect="equal", title="P8 on 60E1, 100 kN")
figure.colorbar(shown, label="pressure [MPa]")
plt.show()
