"""
Plastic strain in three dimensions
==================================

The last fields of a run of an explicit model, drawn by PyVista without a display: the crossing's surface, coloured by
the equivalent plastic strain (PEEQ), and by themselves the elements that have yielded. The run here is a short one on
elements of 6 mm: enough to show where steel yields, too coarse to say how much.
"""

import matplotlib.pyplot as plt
import numpy as np
import pyvista
from coarse_pass import coarse_pass

import rail_fem

pyvista.OFF_SCREEN = True
COLOURS = plt.get_cmap("viridis_r")
fields = rail_fem.load_result(coarse_pass()).mesh()  # or of your run: load_result("runs/nose_transfer")
crossing = fields.extract_cells(np.flatnonzero(fields["region"] < 2))  # 0 wing, 1 nose, 2 wheel
crossing["PEEQ [%]"] = 100 * crossing["plastic_strain"]
yielded = crossing.threshold(1e-6, scalars="plastic_strain")
sound = crossing.threshold(1e-6, scalars="plastic_strain", method="lower")
largest = crossing["PEEQ [%]"].max()
volume = yielded.compute_cell_sizes()["Volume"].sum()
print(f"largest plastic strain {largest:.2f} %, {1e6 * volume:.1f} cm3 have yielded")


# %%
# The whole crossing, and what has yielded within its outline, both seen from the field side of the nose.
def picture(whole):
    plotter = pyvista.Plotter(off_screen=True, window_size=(1400, 900))
    plotter.add_mesh(
        yielded, scalars="PEEQ [%]", cmap=COLOURS, clim=(0, largest), show_edges=True, show_scalar_bar=False
    )
    if whole:
        plotter.add_mesh(sound, color="#E4E4E4", show_edges=True)
    else:
        plotter.add_mesh(crossing.extract_feature_edges(40), color="grey", line_width=2)
    plotter.view_vector((-0.6, -1.0, 0.9), viewup=(0, 0, 1))
    plotter.reset_camera(bounds=crossing.bounds)
    plotter.camera.zoom(1.0)
    image = plotter.screenshot(return_img=True)
    plotter.close()
    return image


first, last = 1e3 * np.array(crossing.bounds[:2])
titles = (
    f"wing rail (behind) and nose (in front), x from {first:.0f} to {last:.0f} mm",
    "elements that have yielded, by themselves",
)
figure, panels = plt.subplots(2, 1, figsize=(8, 9), layout="constrained")
for panel, image, title in zip(panels, (picture(whole=True), picture(whole=False)), titles, strict=True):
    panel.imshow(image)
    panel.set_title(title)
    panel.axis("off")
colours = plt.cm.ScalarMappable(plt.Normalize(0, largest), COLOURS)
figure.colorbar(colours, ax=panels, shrink=0.6, label="equivalent plastic strain (PEEQ) [%]")
plt.show()
