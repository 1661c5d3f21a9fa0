"""Figure of a contact patch. matplotlib is imported only when it is drawn."""

from __future__ import annotations

import numpy as np

from bem.patch import Patch

_MM, _MPA = 1e3, 1e-6


def patch_figure(patch: Patch, path: str | None = None):
    """Pressure, tractions with arrows, stick and slip of one patch; without tractions the pressure alone.

    Parameters
    ----------
    patch : Patch
        A solved contact.
    path : str, optional
        Of a file that is written.

    Returns
    -------
    matplotlib Figure

    Examples
    --------
    >>> window = (-0.01, 0.01), (-0.01, 0.01)
    >>> sphere = lambda x, y: (x**2 + y**2) / 0.6
    >>> patch = bem.normal_contact(sphere, bem.STEEL, bem.STEEL, load=50e3, window=window, cells=32)
    >>> len(bem.patch_figure(patch).axes) > 0
    True
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns = 1 if patch.traction is None else 3
    figure = Figure(figsize=(5.0 * columns, 4.2), constrained_layout=True)
    FigureCanvasAgg(figure)
    draw_patch(figure, figure.subplots(1, columns, squeeze=False)[0], patch)
    if path is not None:
        figure.savefig(path, dpi=130)
    return figure


def draw_patch(figure, axes, patch: Patch) -> None:
    """The same on one's own axes, three of them where tractions are solved."""
    map_of_cells(figure, axes[0], patch, patch.pressure * _MPA, "pressure [MPa]", "viridis")
    axes[0].set_title(
        f"{patch.method}: {patch.normal_force / 1e3:.4g} kN, {patch.max_pressure * _MPA:.0f} MPa", fontsize=11
    )
    if patch.traction is not None:
        size = np.hypot(patch.traction[..., 0], patch.traction[..., 1])
        map_of_cells(figure, axes[1], patch, size * _MPA, "tangential traction [MPa]", "magma")
        _arrows(axes[1], patch, patch.traction)
        force = patch.tangential_force / 1e3
        axes[1].set_title(f"Fx {force[0]:.4g} kN, Fy {force[1]:.4g} kN, friction {patch.friction:g}", fontsize=11)
        _stick_map(axes[2], patch)


def _limits(patch: Patch) -> tuple[float, float, float, float]:
    x_min, x_max, y_min, y_max = patch.grid.edges
    return y_min * _MM, y_max * _MM, x_min * _MM, x_max * _MM


def map_of_cells(figure, axes, patch: Patch, field: np.ndarray, label: str, colours: str) -> None:
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
