"""
2.5D slices against the half-space
==================================

A wheel of 460 mm presses with 50 kN on a crown of 300 mm that ends in a square edge. A half-space knows no edge: where
the rail's surface ends within the patch, its pressure rises to a spike. Slices of the true section give way beside the
edge, and the pressure moves away from it; far from any edge both agree. Static finite elements agree with the slices
(``rail-fem study patch-methods limits``).
"""

import matplotlib.pyplot as plt

from rail_fem.studies.patch_limits import HALF_SPACE, SLICES, edge_case, light_patches

distances = (7e-3, 5e-3, 3e-3)
figure, panels = plt.subplots(1, len(distances), figsize=(10, 3.6), sharey=True, layout="constrained")
for axes, distance in zip(panels, distances, strict=True):
    half_space, slices = light_patches(edge_case(distance), cells=(24, 40))
    for name, patch, style in ((HALF_SPACE, half_space, "--"), (SLICES, slices, "-")):
        middle = patch.pressure[abs(patch.grid.x).argmin()] / 1e6
        largest = f"{patch.max_pressure / 1e6:.0f} MPa"
        axes.plot(1e3 * patch.grid.y, middle, style, label=f"{name.split(', ')[-1]}, {largest}")
        print(f"edge at {1e3 * distance:.0f} mm, {name}: largest pressure {largest}")
    axes.axvline(1e3 * distance, color="black", lw=1)
    axes.set(xlabel="across the rail y [mm]", title=f"edge {1e3 * distance:.0f} mm away", xlim=(-8, 8), ylim=(0, 1800))
    axes.legend(fontsize="small", loc="upper left", title="largest pressure")
panels[0].set_ylabel("pressure under the wheel [MPa]")
plt.show()
