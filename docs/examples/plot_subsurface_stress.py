"""
Stress below a contact patch
============================

Where does steel yield first? Below the surface: von Mises' stress on the axis of the patch, from the pressure of the
half-space solution.
"""

import matplotlib.pyplot as plt
import numpy as np

from rail_fem import bem
from rail_fem.bem.exact.subsurface import von_mises

patch = bem.normal_contact(
    lambda x, y: (x**2 + y**2) / 0.6, bem.STEEL, bem.STEEL, load=100e3, window=((-0.02, 0.02), (-0.02, 0.02))
)
depths = np.linspace(0.2e-3, 12e-3, 40)
stress = bem.subsurface_stress(patch, depths, bem.STEEL.poisson)
middle = tuple(np.array(patch.grid.shape) // 2)

# %%
# Components in the order of geometry.axes: xx, yy, zz, yz, xz, xy.
below = stress[(slice(None), *middle)]
figure, axes = plt.subplots(figsize=(5, 4.5), layout="constrained")
axes.plot(von_mises(below) / patch.max_pressure, depths * 1e3, color="black", label="von Mises")
axes.plot(-below[:, 2] / patch.max_pressure, depths * 1e3, ls="--", label="pressure along z")
axes.axhline(0.48 * patch.extent[0] / 2 * 1e3, color="grey", ls=":", label="0.48 of the radius (Hertz)")
axes.invert_yaxis()
axes.set(xlabel="stress over the largest pressure [1]", ylabel="depth [mm]")
axes.legend()
plt.show()
