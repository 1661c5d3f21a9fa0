#!/usr/bin/env python3
"""The plastic strain that a run left, in three dimensions: a script to copy and change.

    .venv/bin/python cases/plot_plastic_strain.py runs/nose_transfer
    .venv/bin/python cases/plot_plastic_strain.py runs/nose_transfer --window   (to turn it with the mouse)

It reads fields/final.vtu (or the file given) with pyvista and writes figures/plastic_strain_3d.png, without a display
(VTK draws through EGL or OSMesa). It imports nothing of this program on purpose: numba and VTK do not get on in one
process.
"""

import argparse
import sys
from pathlib import Path

import pyvista as pv

WING, NOSE, WHEEL = 0, 1, 2


def read_mesh(given: Path) -> pv.UnstructuredGrid:
    """The fields of a run folder, or of a file; ends the program with a sentence where there are none."""
    path = given
    if given.is_dir():
        frames = sorted((given / "fields").glob("frame_*.vtu"))
        path = given / "fields" / "final.vtu"
        if not path.is_file() and frames:
            path = frames[-1]
    if not path.is_file():
        sys.exit(f"{path}: no such file; give the folder of a run, or one of its fields/*.vtu")
    mesh = pv.read(path)
    missing = [name for name in ("region", "plastic_strain") if name not in mesh.cell_data]
    if missing:
        sys.exit(f"{path}: holds no {', '.join(missing)}; is it a field file of this program?")
    return mesh


def build_scene(mesh: pv.UnstructuredGrid, magnify: float, show_wheel: bool, off_screen: bool) -> pv.Plotter:
    """Crossing coloured by plastic strain in percent, the wheel as a shadow; displacements magnified by `magnify`."""
    mesh = mesh.copy()
    mesh.points *= 1e3  # mm
    if magnify:
        mesh.points += 1e3 * magnify * mesh.point_data["displacement"]
    mesh.cell_data["plastic strain [%]"] = 100 * mesh.cell_data["plastic_strain"]
    crossing = mesh.extract_cells(mesh.cell_data["region"] != WHEEL)
    most = max(float(crossing.cell_data["plastic strain [%]"].max()), 1e-3)
    least = 1e-6 * most  # what has never yielded lies below and stays grey
    plotter = pv.Plotter(off_screen=off_screen, window_size=(1600, 1000))
    bar = {
        "title": "equivalent plastic strain [%], grey: never yielded",
        "title_font_size": 24,
        "label_font_size": 20,
        "fmt": "%.2f",
        "color": "black",
    }
    bar |= {"fill": True, "background_color": "white", "position_x": 0.3, "width": 0.6, "height": 0.11}
    plotter.add_mesh(
        crossing, scalars="plastic strain [%]", cmap="viridis_r", clim=(least, most), below_color="lightgrey",
        show_edges=True, edge_opacity=0.15, scalar_bar_args=bar,
    )  # fmt: skip
    plotter.scalar_bar.SetDrawBelowRangeSwatch(False)  # VTK draws it black, whatever its colour
    wheel = mesh.extract_cells(mesh.cell_data["region"] == WHEEL)
    if show_wheel and wheel.n_cells:
        plotter.add_mesh(wheel.extract_geometry(), color="lightsteelblue", opacity=0.25)
    look_at_worst(plotter, crossing)
    plotter.add_axes(xlabel="x", ylabel="y", zlabel="z")
    return plotter


def look_at_worst(plotter: pv.Plotter, crossing: pv.UnstructuredGrid) -> None:
    """From above and behind onto the element with the largest plastic strain."""
    worst = int(crossing.cell_data["plastic strain [%]"].argmax())
    x, y, z = crossing.get_cell(worst).center
    plotter.camera_position = [(x - 130, y - 90, z + 130), (x, y, z), (0, 0, 1)]


def main() -> None:
    parser = argparse.ArgumentParser(description="Plastic strain of a run in three dimensions.")
    parser.add_argument("run", type=Path, help="folder of a run, or a .vtu file")
    parser.add_argument(
        "--out", type=Path, help="picture to write (default: figures/plastic_strain_3d.png in the folder)"
    )
    parser.add_argument(
        "--magnify", type=float, default=0.0, help="draw displacements this many times larger (default: not at all)"
    )
    parser.add_argument("--wheel", action="store_true", help="show the wheel as a shadow")
    parser.add_argument("--window", action="store_true", help="open a window instead of writing a picture")
    given = parser.parse_args()
    plotter = build_scene(read_mesh(given.run), given.magnify, given.wheel, off_screen=not given.window)
    if given.window:
        plotter.show()
        return
    folder = given.run if given.run.is_dir() else given.run.parent
    out = given.out or folder / "figures" / "plastic_strain_3d.png"
    out.parent.mkdir(parents=True, exist_ok=True)
    plotter.screenshot(out)
    print(out)


if __name__ == "__main__":
    main()
