"""Waves in plane bodies by boundary elements: which steps are stable, what happens to the energy, how a bar swings.

    python -m rail_fem.studies.plane_waves --out waves      tables (waves.md), stability map (stability.png), a bar over
                                                            twenty periods (bar.png)

Stability is read off the assembled operator: with lambda = 1 / omega^2 the eigenvalues of flexibility times mass, a
step h multiplies each mode by a 3 x 3 matrix of h^2 / lambda. Collocated cells give an operator that is not symmetric;
a body that is no rectangle shows what that does.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import typer
from matplotlib.figure import Figure

from bem.dynamic.body import DynamicBody, Inertial
from bem.dynamic.cells import fill_with_cells
from bem.dynamic.convolution import Conditions, LaplaceBody, convolve, transfer
from bem.dynamic.marching import InstabilityError, March, respond
from bem.dynamic.schemes import BACKWARD_EULER, TRAPEZOIDAL, Scheme, generalised_alpha, spectral_radius
from bem.material import Elastic
from bem.plane.body import Body
from bem.plane.mesh import Sizing, mesh_outline
from bem.plane.outline import Edge, Outline
from bem.verification.bar import HEIGHT, LENGTH, MATERIAL, bar, box, edge_pattern, tip_displacement
from rail_fem.output.markdown import markdown_table
from rail_fem.show.style import CURVES, GREY, new_figure
from rail_fem.show.table_and_figure import write_figure, write_table_and_figure

SHARES = (0.3, 0.6, 1.0, 2.0)  # steps over the time in which a dilatational wave crosses a cell
STEPS = np.logspace(-1.5, 1.0, 26)  # the same, drawn
SCHEMES = (BACKWARD_EULER, TRAPEZOIDAL, generalised_alpha(0.8))
MATERIAL_2D = Elastic(1.0, 0.3)


def skew_block(size: float, collocated: bool) -> DynamicBody:
    """A quadrilateral of no symmetry held on its left, in cells of `size` [m] cut off along three of its sides."""
    corners = np.array([[0, 0], [1.0, 0.13], [0.83, 0.71], [0.0, 0.5]])
    names = ("bottom", "face", "top", "held")
    ends = np.roll(corners, -1, axis=0)
    outline = Outline([[Edge(np.array([a, b]), name) for a, b, name in zip(corners, ends, names)]])
    mesh = mesh_outline(outline, Sizing(size))
    cells = fill_with_cells(mesh, Sizing(size))
    pattern = edge_pattern(mesh, "face", (1.0, 0.3))
    return DynamicBody(Inertial(Body(outline, MATERIAL_2D), mesh, cells, 1.0), pattern, collocated)


def growth(body: DynamicBody, scheme: Scheme, step: float) -> float:
    """Largest amplification of any mode in a step, less one."""
    inverse = body.inverse_frequencies
    return float(spectral_radius(scheme, step**2 / inverse).max() - 1)


def energy_table(bodies: dict[str, DynamicBody], size: float) -> str:
    """Markdown: energy gained or lost in 1,000 steps under a load that is put on in the first, over the largest."""
    rows = []
    for name, body in bodies.items():
        for scheme in SCHEMES:
            row = [name, scheme.name]
            for share in SHARES:
                march = March(body, share * size / body.waves.dilatational, scheme)
                try:
                    left = respond(march, lambda t: [1.0], 1000).imbalance
                    row.append(f"{left[np.argmax(np.abs(left))]:+.1e}")
                except InstabilityError:
                    row.append("unbounded")
            rows.append(row)
    return "\n".join(markdown_table(["operator", "scheme", *(f"step {s:g} h/c" for s in SHARES)], rows)) + "\n"


def stability_map(bodies: dict[str, DynamicBody], size: float) -> dict[tuple[str, str], np.ndarray]:
    """Growth in a step (26,) over STEPS, by operator and scheme."""
    return {
        (name, scheme.name): np.array([growth(body, scheme, share * size / body.waves.dilatational) for share in STEPS])
        for name, body in bodies.items()
        for scheme in SCHEMES
    }


def stability_table(found: dict[tuple[str, str], np.ndarray]) -> str:
    """Markdown: growth in a step of some lengths."""
    rows = [
        [*key, *(f"{values[np.argmin(np.abs(STEPS - share))]:+.1e}" for share in SHARES)]
        for key, values in found.items()
    ]
    return "\n".join(markdown_table(["operator", "scheme", *(f"step {s:g} h/c" for s in SHARES)], rows)) + "\n"


def draw_map(found: dict[tuple[str, str], np.ndarray]) -> Figure:
    """Growth of the worst mode over the step, an operator a panel."""
    figure = new_figure(6.0)
    axes = figure.subplots(1, 2, sharey=True)
    for axis, operator in zip(axes, dict.fromkeys(name for name, _ in found)):
        for scheme, colour, line in zip(SCHEMES, CURVES, ("-", "--", ":")):
            values = found[operator, scheme.name]
            axis.plot(STEPS, np.maximum(values, 1e-16), line, color=colour, linewidth=2, label=scheme.name)
        axis.set(xscale="log", yscale="log", ylim=(1e-16, 10), title=operator)
        axis.set_xlabel("step over the time in which a wave crosses a cell, c\u2081 \u0394t / h")
    axes[0].set_ylabel("growth of the worst mode in a step\n(amplification less 1; bottom: none)")
    axes[0].legend()
    axes[0].axhspan(1e-16, 1e-12, color="#DDEEDD", zorder=0)
    axes[1].axhspan(1e-16, 1e-12, color="#DDEEDD", zorder=0)
    figure.suptitle("Stability of cells with inertia in plane boundary elements (green: stable to round-off)")
    return figure


def bar_runs(cells: int, periods: int, share: float) -> tuple[np.ndarray, dict[str, tuple[np.ndarray, float]]]:
    """Times and tip displacements of the bar under a step load by every route, with the CPU time [s] of each."""
    body, step = bar(cells), share * HEIGHT / cells
    count = round(periods * 4 * LENGTH / step)
    found = {}
    for scheme in SCHEMES:
        tick = time.process_time()
        history = respond(March(body, step, scheme), lambda t: [1.0], count)
        found[scheme.name] = (history.q[:, 0] / HEIGHT, time.process_time() - tick)
    mesh = mesh_outline(box(LENGTH, HEIGHT), Sizing(HEIGHT / cells))
    held = np.zeros((mesh.densities, 2), bool)
    held[mesh.of_edge("held")] = True
    laplace = LaplaceBody(mesh, MATERIAL, 1.0)
    conditions = Conditions(held, edge_pattern(mesh, "face", (1.0, 0.0)))
    point = np.array([[LENGTH - 1e-9, HEIGHT / 2]])
    for rule in ("trapezoidal", "BDF2"):
        tick = time.process_time()
        answer = convolve(lambda s: transfer(laplace, conditions, s, point), np.ones((count, 1)), step, rule)
        found[f"convolution, {rule}"] = (np.r_[0.0, answer[:, 0]], time.process_time() - tick)
    return step * np.arange(count + 1), found


def bar_table(moment: np.ndarray, found: dict[str, tuple[np.ndarray, float]]) -> str:
    """Markdown: error of the tip over the largest displacement, in the first and the last period."""
    exact = tip_displacement(moment, lambda t: t)
    period = np.searchsorted(moment, 4 * LENGTH)
    rows = []
    for name, (tip, spent) in found.items():
        error = np.abs(tip - exact) / exact.max()
        late, rms = slice(-period, None), np.sqrt(np.mean((tip - exact)[-period:] ** 2)) / exact.max()
        rows.append(
            [
                name, f"{error[:period].max():.2%}", f"{error[late].max():.2%}", f"{rms:.2%}",
                f"{tip[late].min():+.3f} to {tip[late].max():.3f}", f"{spent:.1f}",
            ]
        )  # fmt: skip
    head = ["route", "first period", "last period", "its mean", "tip between (exact 0 to 2)", "CPU [s]"]
    return "\n".join(markdown_table(head, rows)) + "\n"


def draw_bar(moment: np.ndarray, found: dict[str, tuple[np.ndarray, float]]) -> Figure:
    """The tip in the first and in the last two periods."""
    exact, periods = tip_displacement(moment, lambda t: t), moment / (4 * LENGTH)
    figure = new_figure(8.0)
    axes = figure.subplots(2, 1)
    for axis, begin in zip(axes, (0, round(periods[-1]) - 2)):
        shown = (periods >= begin) & (periods <= begin + 2)
        axis.plot(periods[shown], exact[shown], color=GREY, linewidth=4, alpha=0.5, label="exact (d'Alembert)")
        for (name, (tip, _)), colour, line in zip(found.items(), CURVES, ("-", "-", "--", "--", ":")):
            axis.plot(periods[shown], tip[shown], line, color=colour, linewidth=1.4, label=name)
        axis.set(ylabel="tip displacement / (\u03c3L/E)", xlim=(begin, begin + 2), ylim=(-0.3, 2.3))
    axes[0].legend(ncols=3, fontsize=10, loc="lower center")
    axes[1].set_xlabel("time in periods of the bar, t c / 4L")
    figure.suptitle("A bar held at one end under a step load at the other")
    return figure


def main(
    cells: int = typer.Option(4, help="cells over the bar's height and half the block's"),
    periods: int = typer.Option(20, help="periods of the bar"),
    share: float = typer.Option(0.5, help="the bar's step over the time in which a wave crosses a cell"),
    out: Path = typer.Option(None, help="folder for waves.md, stability.png and bar.png"),
) -> None:
    """Stability, energy and a bar under a step load, by cells with inertia and by convolution quadrature."""
    size = 0.25 / cells
    bodies = {"collocated, as printed": skew_block(size, True), "means over cells, symmetric": skew_block(size, False)}
    inverse = np.asarray(bodies["collocated, as printed"].inverse_frequencies)
    turned = np.abs(inverse.imag) > 1e-9 * np.abs(inverse)
    text = (
        f"Skew block, {len(bodies['collocated, as printed'].cells)} cells. Eigenvalues of the collocated operator:"
        f" {turned.sum()} of {len(inverse)} complex, {np.sum(inverse.real < 0)} negative; of the symmetric one:"
        f" {np.sum(bodies['means over cells, symmetric'].inverse_frequencies < 0)} negative,"
        f" {bodies['means over cells, symmetric'].repaired} repaired.\n\nGrowth of the worst mode in a step:\n\n"
    )
    stability = stability_map(bodies, size)
    text += stability_table(stability)
    text += "\nEnergy beyond the work done, largest in 1,000 steps, over the largest energy so far:\n\n"
    text += energy_table(bodies, size)
    moment, found = bar_runs(cells, periods, share)
    text += f"\nBar under a step load, {periods} periods, {len(moment) - 1} steps of {share:g} h/c:\n\n"
    text += bar_table(moment, found)
    print(text, end="")
    if out is not None:
        write_table_and_figure(out / "waves.md", text, out / "stability.png", lambda: draw_map(stability))
        write_figure(out / "bar.png", lambda: draw_bar(moment, found))


if __name__ == "__main__":
    typer.run(main)
