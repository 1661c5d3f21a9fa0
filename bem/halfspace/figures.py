"""Figures of contact patches, creep curves and speed against error. matplotlib is imported only when one is drawn."""

from __future__ import annotations

import numpy as np

from bem.patch import Patch

_MM, _MPA = 1e3, 1e-6


def _canvas(columns: int, rows: int = 1, width: float = 5.0, height: float = 4.2):
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width * columns, height * rows), constrained_layout=True)
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, squeeze=False)


def _save(figure, path: str | None):
    if path is not None:
        figure.savefig(path, dpi=130)
    return figure


def patch_figure(patch: Patch, path: str | None = None):
    """Pressure, tractions with arrows, stick and slip of one patch; without tractions the pressure alone."""
    solved = patch.traction is not None
    figure, axes = _canvas(3 if solved else 1)
    _map(figure, axes[0, 0], patch, patch.pressure * _MPA, "pressure [MPa]", "viridis")
    axes[0, 0].set_title(
        f"{patch.method}: {patch.normal_force / 1e3:.4g} kN, {patch.max_pressure * _MPA:.0f} MPa", fontsize=11
    )
    if patch.traction is not None:
        size = np.hypot(patch.traction[..., 0], patch.traction[..., 1])
        _map(figure, axes[0, 1], patch, size * _MPA, "tangential traction [MPa]", "magma")
        _arrows(axes[0, 1], patch, patch.traction)
        force = patch.tangential_force / 1e3
        axes[0, 1].set_title(f"Fx {force[0]:.4g} kN, Fy {force[1]:.4g} kN, friction {patch.friction:g}", fontsize=11)
        _stick_map(axes[0, 2], patch)
    return _save(figure, path)


def _limits(patch: Patch) -> tuple[float, float, float, float]:
    x_min, x_max, y_min, y_max = patch.grid.edges
    return y_min * _MM, y_max * _MM, x_min * _MM, x_max * _MM


def _map(figure, axes, patch: Patch, field: np.ndarray, label: str, colours: str) -> None:
    """Field seen from above: x (rolling) upwards, y to the left, as the project's axes lie."""
    image = axes.imshow(
        np.where(patch.contact, field, np.nan), origin="lower", extent=_limits(patch), cmap=colours, aspect="equal"
    )
    figure.colorbar(image, ax=axes, label=label, shrink=0.85)
    _name_axes(axes)


def _name_axes(axes) -> None:
    axes.set(xlabel="y lateral [mm]", ylabel="x rolling [mm]")
    if not axes.xaxis_inverted():
        axes.invert_xaxis()


def _arrows(axes, patch: Patch, field: np.ndarray) -> None:
    every = max(1, max(patch.grid.shape) // 18)
    x, y = (positions[::every, ::every] * _MM for positions in patch.grid.points())
    here = patch.contact[::every, ::every]
    along, across = field[::every, ::every, 0], field[::every, ::every, 1]
    axes.quiver(y[here], x[here], across[here], along[here], color="white", angles="xy", pivot="mid", width=0.004)


def _stick_map(axes, patch: Patch) -> None:
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch as Swatch

    state = np.where(patch.contact, np.where(patch.stick, 0.0, 1.0), np.nan)
    axes.imshow(
        state,
        origin="lower",
        extent=_limits(patch),
        cmap=ListedColormap(["#3b6ea5", "#e0a458"]),
        vmin=0,
        vmax=1,
        aspect="equal",
    )
    sliding = patch.sliding
    if patch.slip is not None and sliding is not None and sliding.any():
        _arrows(axes, patch, np.where(sliding[..., None], patch.slip, 0.0))
    share = np.count_nonzero(patch.stick) / max(1, np.count_nonzero(patch.contact))
    axes.legend(
        handles=[
            Swatch(color="#3b6ea5", label=f"stick {share:.0%}"),
            Swatch(color="#e0a458", label=f"slip {1 - share:.0%}"),
        ],
        loc="upper center",
        bbox_to_anchor=(0.5, -0.14),
        ncol=2,
        fontsize=11,
    )
    axes.set_title("stick and slip; arrows: slip of body 1", fontsize=11)
    _name_axes(axes)


def creep_curves_figure(curves: dict[str, dict[str, np.ndarray]], path: str | None = None):
    """Force over mu N against creepage: one panel for each kind.

    curves : kind -> {"creepage": (n,), "label": name of the abscissa, method: (n,) force / (mu N), ...}
    """
    figure, axes = _canvas(len(curves))
    for panel, (kind, data) in zip(axes[0], curves.items()):
        for method, force in data.items():
            if method not in ("creepage", "label"):
                style = "-" if method == "full theory" else ("--" if method.startswith("FASTSIM") else ":")
                panel.plot(data["creepage"], force, style, label=method)
        panel.set(xlabel=str(data["label"]), ylabel="force / (friction x load)", title=kind, ylim=(0, 1.05))
        panel.grid(alpha=0.3)
        panel.legend(fontsize=11)
    return _save(figure, path)


_SPEED_TITLES = {
    "normal": ("normal problem", "relative error of the largest pressure"),
    "tangential": ("with friction, the pressure known", "relative error of the tangential force"),
}
_SPEED_COLOURS = ("#000000", "#009E73", "#E69F00", "#D55E00", "#0072B2", "#AA4499")


def speed_error_figure(rows: list[dict], path: str | None = None):
    """Seconds against relative error, one line for each method; marks carry the cells across. Left the normal problem,
    right friction.

    rows : dicts with problem ("normal" or "tangential"), method, cells, seconds, error (NaN: a closed form, drawn as a
        level), and
    reference (True where the numbers are another program's)
    """
    problems = [problem for problem in _SPEED_TITLES if any(row["problem"] == problem for row in rows)]
    figure, axes = _canvas(len(problems), width=7.2, height=7.0)
    for panel, problem in zip(axes[0], problems):
        own = [row for row in rows if row["problem"] == problem]
        _speed_lines(panel, own)
        title, label = _SPEED_TITLES[problem]
        panel.set_title(title, fontsize=13)
        panel.set_xlabel(f"{label}, better to the left", fontsize=12)
        panel.set_ylabel("seconds on one core", fontsize=12)
        panel.grid(alpha=0.3)
        panel.legend(fontsize=10, loc="upper center", bbox_to_anchor=(0.5, -0.11), ncol=2)
    figure.suptitle(
        "Speed against error on one patch, 100 kN on an ellipse of 14.3 x 10.8 mm; numbers: cells each way", fontsize=13
    )
    return _save(figure, path)


def _speed_lines(panel, rows: list[dict]) -> None:
    colours = iter(_SPEED_COLOURS)
    for method in dict.fromkeys(row["method"] for row in rows):
        own = [row for row in rows if row["method"] == method]
        if all(np.isnan(row["error"]) for row in own) and not own[0]["reference"]:
            panel.axhline(
                own[0]["seconds"], color="#777777", linestyle="-.", linewidth=1, label=f"{method}, exact here"
            )
            continue
        own = [row for row in own if np.isfinite(row["error"]) and row["error"] > 0]
        if not own:
            continue
        kind = (
            {"color": "#777777", "linestyle": ":", "marker": "s"}
            if own[0]["reference"]
            else {"color": next(colours), "marker": "o"}
        )
        if own[0]["reference"] and any(line.get_linestyle() == ":" for line in panel.lines):
            kind |= {"marker": "D", "color": "#A0522D"}
        panel.loglog(
            [row["error"] for row in own],
            [row["seconds"] for row in own],
            markersize=5,
            linewidth=1.5,
            label=method,
            **kind,
        )
        for row in own:
            panel.annotate(
                str(row["cells"]),
                (row["error"], row["seconds"]),
                fontsize=11,
                xytext=(4, 4),
                textcoords="offset points",
                color=kind["color"],
            )
