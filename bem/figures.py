"""Figures of bem.study: convergence charts, speed against error, scaling, and the fields of a case. Needs matplotlib."""
from __future__ import annotations

from pathlib import Path

import numpy as np

from bem.contact_result import ContactResult
from bem.internal import Field

MM = 1e-3


def _file(folder: Path, title: str, ending: str) -> Path:
    return folder / ("_".join(title.replace(":", "").replace(",", "").lower().split()) + ending)


def _axes(columns: int, width: float = 6.0):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(1, columns, figsize=(width * columns, 4.2), constrained_layout=True, squeeze=False)
    return figure, axes[0]


def _save(figure, path: Path) -> Path:
    from matplotlib import pyplot
    figure.savefig(path, dpi=130)
    pyplot.close(figure)
    return path


def write_tables(folder: Path, tables: dict) -> list[Path]:
    """One CSV per table."""
    written = []
    for title, (names, rows) in tables.items():
        path = _file(folder, title, ".csv")
        np.savetxt(path, rows, delimiter=",", header=",".join(names), comments="", fmt="%.8g")
        written.append(path)
    return written


def draw_tables(folder: Path, tables: dict) -> list[Path]:
    """One PNG per table of more than one row."""
    written = []
    for title, (names, rows) in tables.items():
        if len(rows) < 2:
            continue
        if "boundary mesh" in title or "internal grid" in title:
            figure = _convergence(title, names, rows)
        elif "scaling" in title:
            figure = _scaling(title, names, rows)
        else:
            figure = _speed(title, names, rows)
        written.append(_save(figure, _file(folder, title, ".png")))
    return written


def _convergence(title: str, names: list[str], rows: np.ndarray):
    """Change and error on the left axis, time on the right, against the mesh size: the thesis' convergence charts."""
    figure, (left,) = _axes(1, 7.5)
    right = left.twinx()
    for k, name in enumerate(names):
        if name.endswith("_pct"):
            kind, quantity = name[:-4].split("_", 1)
            left.loglog(rows[:, 0], rows[:, k], "o-" if kind == "error" else "s--", label=f"{kind} of {quantity.replace('_', ' ')}")
    right.loglog(rows[:, 0], rows[:, names.index("seconds")], "k^:", label="time")
    left.invert_xaxis()
    left.set(title=title, xlabel="size [mm]", ylabel="change to the size before, error to the finest [%]")
    right.set_ylabel("time [s]")
    left.grid(True, which="both", alpha=0.3)
    handles = [axis.get_legend_handles_labels() for axis in (left, right)]
    left.legend(sum((h for h, _ in handles), []), sum((t for _, t in handles), []), fontsize=8)
    return figure


def _speed(title: str, names: list[str], rows: np.ndarray):
    figure, (axis,) = _axes(1, 6.5)
    for k, mark in ((1, "o-"), (2, "s--")):
        axis.loglog(rows[:, 3], rows[:, k], mark, label=names[k].replace("_pct", "").replace("_", " "))
    for row in rows:
        axis.annotate(f"{row[0]:g}", (row[3], row[1]), textcoords="offset points", xytext=(4, 4), fontsize=8)
    axis.set(title=title, xlabel="time [s]; labels: elements to the half contact", ylabel="error [%]")
    axis.grid(True, which="both", alpha=0.3)
    axis.legend()
    return figure


def _scaling(title: str, names: list[str], rows: np.ndarray):
    figure, (left, right) = _axes(2, 5.5)
    left.loglog(rows[:, 0], rows[:, 1], "o-", label="time [s]")
    left.loglog(rows[:, 0], rows[:, 2] / 1e3, "s-", label="peak memory [GB]")
    n = rows[:, 0]
    left.loglog(n, rows[-1, 1] * (n / n[-1]) ** 3, "k:", label="third power")
    left.loglog(n, rows[-1, 2] / 1e3 * (n / n[-1]) ** 2, "k--", label="second power")
    left.set(title=title, xlabel="densities")
    right.loglog(rows[:, 1], rows[:, 3], "o-")
    right.set(xlabel="time [s]", ylabel="error of the hoop stress at mid-wall [%]")
    left.legend(fontsize=8)
    for axis in (left, right):
        axis.grid(True, which="both", alpha=0.3)
    return figure


def draw_fields(folder: Path, name: str, result: ContactResult, field: Field) -> list[Path]:
    """Pressure along the face, von Mises stress and displacement below it, and the meshes."""
    figure, axes = _axes(4, 5.0)
    x, y = np.moveaxis(field.points, -1, 0) / MM
    for patch in result.patches():
        around = slice(max(patch.nodes[0] - 1, 0), patch.nodes[-1] + 2)
        axes[0].plot(result.interface.points[around, 0] / MM, result.last.pressure[around] / 1e6, ".-")
    axes[0].set(title=f"{name}: pressure", xlabel="y [mm]", ylabel="MPa")
    axes[0].grid(alpha=0.3)
    down = field.displacement[..., 1] / MM
    for axis, values, label in ((axes[1], field.von_mises / 1e6, "von Mises [MPa]"), (axes[2], down, "vertical displacement [mm]")):
        drawn = axis.contourf(x, y, values, 24, cmap="turbo")
        figure.colorbar(drawn, ax=axis)
        axis.set(title=label, xlabel="y [mm]", aspect="equal")
    for body in (result.fixed, result.moving):
        corners = body.mesh.vertices / MM
        axes[3].plot(*np.vstack([corners, corners[:1]]).T, ".-", markersize=2, linewidth=0.6)
    axes[3].set(title="boundary meshes", xlabel="y [mm]", aspect="equal")
    return [_save(figure, _file(folder, f"{name} fields", ".png"))]
