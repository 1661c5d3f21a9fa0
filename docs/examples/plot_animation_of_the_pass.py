"""
Animation of the pass
=====================

The field frames of a run, one after the other: the wheel rolls over wing and nose, which are coloured by their plastic
strain. PyVista draws without a display; matplotlib makes the animation, here and as a file.
"""

import matplotlib.pyplot as plt
import numpy as np
import pyvista
from coarse_pass import coarse_pass
from matplotlib.animation import FuncAnimation, PillowWriter

pyvista.OFF_SCREEN = True
folder = coarse_pass()  # or the folder of your run: Path("runs/nose_transfer")
frames = [pyvista.read(path) for path in sorted((folder / "fields").glob("frame_*.vtu"))]
largest = 100 * max(frame["plastic_strain"][frame["region"] < 2].max() for frame in frames)


# %%
# One picture a frame, all from one camera. Field files hold the wheel where it is at that moment; of the part of
# its rim that is modelled only the edges are drawn, so that it hides nothing.
def picture(frame):
    crossing = frame.extract_cells(np.flatnonzero(frame["region"] < 2))  # 0 wing, 1 nose, 2 wheel
    wheel = frame.extract_cells(np.flatnonzero(frame["region"] == 2))
    crossing["PEEQ [%]"] = 100 * crossing["plastic_strain"]
    plotter = pyvista.Plotter(off_screen=True, window_size=(1000, 640))
    plotter.add_mesh(
        crossing,
        scalars="PEEQ [%]",
        cmap="viridis_r",
        clim=(1e-4, largest),
        below_color="#E4E4E4",
        show_scalar_bar=False,
    )
    plotter.add_mesh(wheel.extract_feature_edges(45), color="black", line_width=2)
    plotter.view_vector((-0.6, -1.0, 0.9), viewup=(0, 0, 1))
    plotter.reset_camera(bounds=frames[0].bounds)
    plotter.camera.zoom(1.4)
    image = plotter.screenshot(return_img=True)
    plotter.close()
    return image


pictures = [picture(frame) for frame in frames]
figure, axes = plt.subplots(figsize=(8, 4.8), layout="constrained")
axes.axis("off")
shown = axes.imshow(pictures[-1])
colours = plt.cm.ScalarMappable(plt.Normalize(0, largest), "viridis_r")
figure.colorbar(colours, ax=axes, shrink=0.8, label="equivalent plastic strain (PEEQ) [%]")


def draw(number):
    shown.set_data(pictures[number])
    axes.set_title(
        f"wheel (edges) over wing rail and nose, t = {1e3 * frames[number].field_data['TimeValue'][0]:.2f} ms"
    )


animation = FuncAnimation(figure, draw, frames=len(frames), interval=250)
animation.save("pass.gif", PillowWriter(fps=4))
plt.show()
