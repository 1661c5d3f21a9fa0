"""
A ball pressed into a rail steel
================================

What remains after a load beyond yield? The pressure under load is flatter than Hertz'; unloading leaves a dent, plastic
strain below it and residual stress.
"""

import matplotlib.pyplot as plt
import numpy as np

from rail_fem import bem
from rail_fem.bem.plastic.contact import PlasticHalfSpace
from rail_fem.bem.steel.deviator import MEAN
from rail_fem.bem.steel.hardening import Hardening

RADIUS, LOAD = 0.1, 12e3  # m, N
hertz = bem.point_contact(LOAD, RADIUS, RADIUS, bem.contact_modulus(bem.STEEL, bem.STEEL))
half = 2.4 * hertz.semi_x
grid = bem.Grid.over((-half, half), (-half, half), 36, 36)
x, y = grid.points()
gap = (x**2 + y**2) / (2 * RADIUS)

# %%
# Body 2 yields at 500 MPa and hardens by 5 GPa per unit of plastic strain; the load grows in steps, then goes.
body = PlasticHalfSpace(grid, grid.dx, 24, bem.STEEL, bem.STEEL, Hardening.linear(500e6, 5e9))
for share in (0.4, 0.7, 1.0):
    loaded = body.press(gap, share * LOAD)
left = body.press(gap, 0.001 * LOAD)

# %%
# Under load and after it, in the plane through the middle.
row = grid.ny // 2
figure, axes = plt.subplots(1, 3, figsize=(12, 3.6), layout="constrained")
distance = grid.x * 1e3
axes[0].plot(distance, loaded.patch.pressure[:, row] / 1e6, color="black", label="with plastic flow")
axes[0].plot(distance, hertz.pressure(grid.x, 0 * grid.x) / 1e6, ls="--", color="grey", label="Hertz, elastic")
axes[0].set(xlabel="distance from the middle [mm]", ylabel="pressure under load [MPa]")
axes[0].legend(loc="lower center")
axes[1].plot(distance, -left.surface[:, row] * 1e6, color="black")
axes[1].set(xlabel="distance from the middle [mm]", ylabel="surface after unloading [um]")
depth = np.append(left.depths - grid.dx / 2, left.depths[-1] + grid.dx / 2) * 1e3
edges = np.append(grid.x - grid.dx / 2, grid.x[-1] + grid.dx / 2) * 1e3
strain = np.ma.masked_equal(100 * left.state.peeq[:, :, row], 0)  # white: never yielded
shown = axes[2].pcolormesh(edges, depth, strain, cmap="viridis_r")
axes[2].set(xlabel="distance from the middle [mm]", ylabel="depth [mm]", ylim=(depth[16], 0))
figure.colorbar(shown, label="equivalent plastic strain [%]")
plt.show()
mean = left.residual @ MEAN
print(
    f"dent {left.surface.max() * 1e6:.1f} um, residual mean stress {mean.min() / 1e6:.0f} to {mean.max() / 1e6:.0f} MPa"
)
