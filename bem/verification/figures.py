"""Figures of bem.verification.plane_study: convergence charts, speed against error, scaling, and the fields of a case.
Needs matplotlib."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from bem.plane.contact_result import ContactResult
from bem.plane.internal import Field

MM = 1e-3
_LEAST = 1e-4  # [%] what is smaller is drawn here
_WORDS = {
    "pressure": "largest pressure",
    "displacement": "largest displacement",
    "von_mises": "largest von Mises stress",
}


def _file(folder: Path, title: str, ending: str) -> Path:
    return folder / (re.sub(r"[^a-z0-9.\-]+", "_", title.lower()).strip("_") + ending)


def _axes(rows: int, columns: int, size: tuple[float, float]):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(rows, columns, figsize=size, constrained_layout=True, squeeze=False)
    return figure, axes.ravel()


def _save(figure, path: Path) -> Path:
    from matplotlib import pyplot

    figure.savefig(path, dpi=110)
    pyplot.close(figure)
    return path


def _plain_numbers(axis, which: str = "both") -> None:
    """Logarithmic axes with 0.2 and 50 written as such instead of as powers of ten."""
    from matplotlib.ticker import FuncFormatter, LogLocator

    for name in ("x", "y") if which == "both" else (which,):
        side = getattr(axis, f"{name}axis")
        low, high = axis.get_xlim() if name == "x" else axis.get_ylim()
        between = (1.0,) if max(low, high) / min(low, high) > 300 else (1.0, 2.0, 5.0)
        side.set_major_locator(LogLocator(subs=between))
        side.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        side.set_minor_formatter(FuncFormatter(lambda value, _: ""))
    axis.grid(True, alpha=0.35)


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
    """Change and error against the mesh size on the left, time on the right: the thesis' convergence charts."""
    figure, (left, right) = _axes(1, 2, (13.0, 4.8))
    for k, name in enumerate(names):
        if name.endswith("_pct"):
            kind, quantity = name[:-4].split("_", 1)
            label = f"{_WORDS[quantity]}: " + (
                "error to the finest" if kind == "error" else "change from the size before"
            )
            style = {
                "color": "tab:blue" if quantity == "displacement" else "tab:red",
                "marker": "o" if kind == "error" else "s",
                "linestyle": "-" if kind == "error" else "--",
                "markerfacecolor": None if kind == "error" else "white",
            }
            left.loglog(rows[:, 0], np.maximum(rows[:, k], _LEAST), label=label, **style)
    left.set_ylim(_LEAST / 1.5, None)
    right.loglog(rows[:, 0], rows[:, names.index("seconds")], "k^-")
    for position in (0, -1):
        right.annotate(
            f"{rows[position, 1]:.0f} {names[1]}",
            (rows[position, 0], rows[position, names.index("seconds")]),
            ha="left" if position == 0 else "right",
            textcoords="offset points",
            xytext=(0, 10) if position == 0 else (-10, 0),
            fontsize=9,
        )
    what = "element size in the contact [mm]" if "boundary" in title else "spacing of the internal points [mm]"
    for axis in (left, right):
        axis.invert_xaxis()
        axis.set_xlabel(f"{what}, finer to the right")
        _plain_numbers(axis)
    left.set(title="accuracy", ylabel=f"difference [%] ({_LEAST:g}: that or less)")
    right.set(title="effort", ylabel="processor time [s]")
    left.legend(fontsize=8)
    figure.suptitle(title)
    return figure


def _speed(title: str, names: list[str], rows: np.ndarray):
    figure, (axis,) = _axes(1, 1, (7.5, 4.8))
    for k, mark, label in ((1, "o-", "whole pressure profile (L2)"), (2, "s--", "largest pressure")):
        axis.loglog(rows[:, 3], rows[:, k], mark, label=label)
    for row in rows:
        axis.annotate(f"{row[0]:g}", (row[3], row[1]), textcoords="offset points", xytext=(5, 5), fontsize=9)
    axis.set(
        title=title,
        xlabel="processor time [s] (numbers: elements to the half contact)",
        ylabel="error to the exact solution [%]",
    )
    _plain_numbers(axis)
    axis.legend()
    return figure


def _scaling(title: str, names: list[str], rows: np.ndarray):
    figure, axes = _axes(1, 3, (15.0, 4.5))
    unknowns = 2 * rows[:, 0]
    drawn = (("processor time [s]", rows[:, 1], 3, "third power"), ("peak memory [MB]", rows[:, 2], 2, "second power"))
    for axis, (label, values, power, name) in zip(axes, drawn):
        axis.loglog(unknowns, values, "o-", label=label.split(" [")[0])
        axis.loglog(unknowns, values[-1] * (unknowns / unknowns[-1]) ** power, "k:", label=f"{name} of the unknowns")
        axis.set(xlabel="unknowns (two for each density)", ylabel=label)
        axis.legend(fontsize=9)
    axes[2].loglog(rows[:, 1], rows[:, 3], "o-")
    axes[2].set(xlabel="processor time [s]", ylabel="error of the hoop stress at mid-wall [%]")
    for axis in axes:
        _plain_numbers(axis)
    figure.suptitle(f"{title} (one boundary value problem, dense matrices, one core)")
    return figure


def _mark_patches(axis, result: ContactResult) -> None:
    for patch in result.patches():
        axis.axvspan(*sorted((patch.begin[0] / MM, patch.end[0] / MM)), color="0.92", zorder=0)


def draw_fields(folder: Path, name: str, result: ContactResult, field: Field) -> Path:
    """Pressure along the face, meshes near the contact, and von Mises stress and displacement in the fixed body below
    it."""
    figure, (top, mesh, stress, moved) = _axes(2, 2, (13.0, 9.0))
    _mark_patches(top, result)
    order = np.argsort(result.interface.points[:, 0])
    y, pressure = result.interface.points[order, 0] / MM, result.last.pressure[order] / 1e6
    width = (y[pressure > 0].min() - 1, y[pressure > 0].max() + 1)
    top.plot(y, pressure, "k.-", linewidth=1)
    top.set(
        title=f"contact pressure, largest {pressure.max():.0f} MPa (grey: contact)",
        xlabel="y [mm]",
        ylabel="pressure [MPa]",
        xlim=width,
        ylim=(0, None),
    )
    top.grid(alpha=0.3)
    _draw_meshes(mesh, result, width)
    y, z = np.moveaxis(field.points, -1, 0) / MM
    down = field.displacement[..., 1] / MM
    for axis, values, label in (
        (stress, field.von_mises / 1e6, "von Mises stress [MPa]"),
        (moved, down, "displacement along z [mm]"),
    ):
        drawn = axis.contourf(y, z, values, 24, cmap="turbo")
        figure.colorbar(drawn, ax=axis, label=label)
        axis.set(xlabel="y [mm]", ylabel="z [mm]", aspect="equal")
    position = np.unravel_index(np.nanargmax(field.von_mises), field.von_mises.shape)
    stress.plot(y[position], z[position], "w+", markersize=12)
    stress.set_title(f"fixed body: von Mises stress, largest {np.nanmax(field.von_mises) / 1e6:.0f} MPa (+)")
    moved.set_title(f"fixed body: displacement along z, lowest {np.nanmin(down):.4f} mm")
    figure.suptitle(name)
    return _save(figure, _file(folder, f"{name} fields", ".png"))


def _draw_meshes(axis, result: ContactResult, width: tuple[float, float]) -> None:
    """The boundary elements' ends of both bodies around the contact; the moving body is lifted so that they can be told
    apart."""
    lift = 0.08 * (width[1] - width[0])
    for body, up, color, label in (
        (result.fixed, 0.0, "tab:blue", "fixed"),
        (result.moving, lift, "tab:orange", f"moving, drawn {lift:.1f} mm higher"),
    ):
        corners = body.mesh.vertices / MM + [0, up]
        axis.plot(
            *np.vstack([corners, corners[:1]]).T,
            ".-",
            color=color,
            markersize=4,
            linewidth=0.8,
            label=f"{label}: {body.mesh.elements} elements",
        )
    touched = result.interface.points[result.last.pressure > 0, 1] / MM
    axis.set(
        title="boundary meshes",
        xlabel="y [mm]",
        ylabel="z [mm]",
        xlim=width,
        ylim=(touched.min() - lift, touched.max() + 3 * lift),
    )
    axis.legend(fontsize=8, loc="upper right")
    axis.grid(alpha=0.3)
