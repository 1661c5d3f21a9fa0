"""A wheel pressed into a yielding rail in the plane: boundary elements, capped return, finite elements as judge.

    rail-fem study plane-plastic --out plastic            ten minutes
    rail-fem study plane-plastic --quick                  cells of 1 mm, ten steps, a coarser judge, no means

P8 on BS113A in place (1:20, gauge 1435, back-to-back 1360), plane strain, 6.36 kN per mm of thickness in equal steps,
rail of 210 GPa and 300 MPa without hardening: section 6.3.2 of the thesis, Figs. 6-20 and 6-21 in kind. The thesis cut
the stress down to the yield surface point by point ("capped"), so that the field does not carry the load; here the
equilibrium is restored in each step, and finite elements with the same steel judge that.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import typer
from scipy.interpolate import LinearNDInterpolator

from bem.material import STEEL
from bem.plane.contact import Settings
from bem.plane.coulomb import Control
from bem.plane_plastic.cells import Cells
from bem.plane_plastic.section import flat, unflat
from bem.plane_plastic.yielding_contact import PlasticContact, Region
from bem.steel.hardening import Hardening, YieldLaw
from bem.steel.return_map import PlasticState, advanced, radial_return
from rail_fem.show.panels import Panel
from rail_fem.show.table_and_figure import Table, publish
from rail_fem.static_fe.plane_strain import Fineness
from rail_fem.static_fe.plastic_plane import PlasticPlaneContact, PlasticPlaneStep
from rail_fem.studies.harness import OUT, QUICK, spent
from rail_fem.studies.plane_contact import wheel_on_rail
from rail_fem.studies.plane_plastic_means import equivalent, means_table, of_cells, of_elements, window_of

MM, MPA = 1e-3, 1e6
LOAD, YIELD = 6.36e6, 300e6  # [N/m], [Pa]
SLOPE = 2e9  # [Pa] of the steel that hardens
SIZES, JUDGE_SIZES = (0.7e-3, 0.5e-3, 0.35e-3), (0.8e-3, 0.4e-3, 0.27e-3)  # compared in means [m]
REGION = (14e-3, 18e-3)  # half-width and depth of the cells [m]


@dataclass
class Compared:
    """One load by three methods, on the cells: von Mises (m,) [Pa] and plastic strain (m,) of the boundary elements,
    of the capped return, of the finite elements; the residuals of Newton's last solution."""

    load: float
    von_mises: tuple[np.ndarray, np.ndarray, np.ndarray]
    peeq: tuple[np.ndarray, np.ndarray, np.ndarray]
    peak_pressure: tuple[float, float]
    residuals: list[float]


def press(size: float, steps: int, slope: float = 0.0) -> tuple[PlasticContact, list[Control]]:
    """Boundary elements with cells of `size` [m], loaded in equal steps, steel of a slope [Pa]."""
    fixed, moving = wheel_on_rail(STEEL.young)
    controls = [Control.of(force=(None, -LOAD * k / steps)) for k in range(1, steps + 1)]
    contact = PlasticContact(
        fixed, moving, controls[-1], Hardening.linear(YIELD, slope), Region(*REGION, size),
        settings=Settings(size=size / 2, coarse=0.1),
    )  # fmt: skip
    for control in controls:
        contact.go_to(control)
    return contact, controls


def judge(contact: PlasticContact, size: float, steps: int, slope: float = 0.0) -> PlasticPlaneContact:
    """Finite elements of `size` [m] over the same region and loads."""
    patch = contact.elastic.patches()[0]
    x = np.linspace(patch.begin[0] - 3 * MM, patch.end[0] + 3 * MM, 9)
    y = np.interp(0.5, [0, 1], [patch.begin[1], patch.end[1]])
    positions = np.column_stack([x, np.full_like(x, y)])
    fixed, moving = wheel_on_rail(STEEL.young)
    ends = sorted([patch.begin[0], patch.end[0]])
    fine, window = Fineness(positions, size, 8 * MM, 6 * MM), (ends[0] - 3 * MM, ends[1] + 3 * MM)
    found = PlasticPlaneContact(fixed, moving, fine, window, Hardening.linear(YIELD, slope))
    for k in range(1, steps + 1):
        found.go_to(LOAD * k / steps)
    return found


def capped_return(
    strains: Sequence[np.ndarray], hardening: YieldLaw, shear: float
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """The elastic field of each load as it is; where it leaves the yield surface the deviator is returned to it and the
    difference counted as plastic strain. The stress does not balance the load.

    strains : per load 2 G elastic strain (3, m) of points, as deviators [Pa]; shear : modulus G [Pa].
    Returns per load the deviator of stress (3, m) [Pa] and the equivalent plastic strain (m,).
    """
    state, stresses, peeqs = PlasticState.virgin((strains[0].shape[1], 3, 1, 1), hardening.back_stresses), [], []
    for strain in strains:
        trial = strain.ravel() - 2 * shear * flat(state.strain)
        state = advanced(state, radial_return(unflat(trial), state, hardening, shear), hardening)
        stresses.append((strain.ravel() - 2 * shear * flat(state.strain)).reshape(3, -1))
        peeqs.append(state.peeq[:, 0, 0].copy())
    return stresses, peeqs


def on_cells(cells: Cells, step: PlasticPlaneStep) -> tuple[np.ndarray, np.ndarray]:
    """Von Mises stress and plastic strain (m,) of the finite elements, means over the cells' four points."""
    near = np.hypot(*(step.points - cells.centers.mean(axis=0)).T) < 3 * max(REGION)
    table = np.column_stack([step.von_mises, step.peeq])[near]
    values = LinearNDInterpolator(step.points[near], table)(cells.points())
    return tuple(np.nanmean(values.reshape(-1, 4, 2), axis=1).T)


def compare(size: float, judge_size: float, steps: int, shown: int = 5) -> tuple[list[Compared], PlasticContact, dict]:
    """All three, at `shown` of the steps; and CPU seconds by method."""
    boundary_seconds, (contact, controls) = spent(lambda: press(size, steps))
    strains = contact.elastic_strains(controls)
    capped, capped_peeq = capped_return(strains, contact.section.hardening, STEEL.shear)
    finite_seconds, finite = spent(lambda: judge(contact, judge_size, steps))
    rows = []
    for k in range(steps // shown - 1, steps, steps // shown):
        step, judged = contact.steps[k], finite.steps[k]
        fe = on_cells(contact.section.cells, judged)
        rows.append(
            Compared(
                LOAD * (k + 1) / steps,
                (equivalent(step.stress), np.sqrt(1.5 * (capped[k] ** 2).sum(axis=0)), fe[0]),
                (step.step.peeq, capped_peeq[k], fe[1]),
                (step.contact.pressure.max(), judged.pressure.max()),
                step.step.residuals,
            )
        )
    seconds = {"boundary elements": boundary_seconds, "finite elements": finite_seconds}
    return rows, contact, seconds


def difference(one: np.ndarray, two: np.ndarray) -> float:
    """Norm of the difference of two fields over that of the second."""
    kept = np.isfinite(one) & np.isfinite(two)
    return float(np.linalg.norm((one - two)[kept]) / max(np.linalg.norm(two[kept]), 1e-300))


HEAD = (
    "load [kN/mm]", "peak pressure BEM, FE [MPa]", "largest PEEQ BEM, FE, capped [1e-4]", "PEEQ, norm of BEM - FE",
    "capped - FE", "von Mises, norm of BEM - FE", "capped - FE", "Newton's residuals",
)  # fmt: skip


def table(rows: list[Compared]) -> Table:
    """A line for each load."""
    lines = []
    for row in rows:
        boundary, capped, finite = row.peeq
        lines.append(
            [
                f"{row.load / 1e6:.3g}",
                ", ".join(f"{value / MPA:.1f}" for value in row.peak_pressure),
                ", ".join(f"{1e4 * value.max():.2f}" for value in (boundary, finite, capped)),
                *(f"{difference(one, finite):.2%}" for one in (boundary, capped)),
                *(f"{difference(one, row.von_mises[2]):.2%}" for one in row.von_mises[:2]),
                " ".join(f"{value:.0e}" for value in row.residuals),
            ]
        )
    return Table(HEAD, lines)


def panels(rows: list[Compared], contact: PlasticContact) -> list[Panel]:
    """Largest plastic strain of the cells by their depth, by all three, a panel for each load."""
    depth = contact.section.cells.centers[:, 1] / MM
    names = "boundary elements", "capped, as in the thesis", "finite elements"
    lines = lambda row: {name: (depth, 1e4 * peeq, ".") for name, peeq in zip(names, row.peeq)}
    return [Panel("y [mm]", "PEEQ of a cell [1e-4]", lines(row), f"{row.load / 1e6:.3g} kN/mm") for row in rows]


def main(
    size: Annotated[float, typer.Option(help="cells of the boundary elements [mm]")] = 0.5,
    judge_size: Annotated[float, typer.Option(help="finite elements [mm]")] = 0.4,
    steps: Annotated[int, typer.Option(help="equal load steps")] = 50,
    means: Annotated[bool, typer.Option(help="means over equal squares by three sizes of each, two steels")] = True,
    quick: QUICK = False,
    out: OUT = None,
) -> None:
    """A wheel pressed into a yielding rail in the plane."""
    if quick:
        size, judge_size, steps, means = 1.0, 0.8, 10, False
    rows, contact, seconds = compare(size * MM, judge_size * MM, steps)
    cost = ", ".join(f"{name} {value:.1f} CPU s" for name, value in seconds.items())
    note = f"{steps} steps, {len(contact.section.active)} cells that take part: {cost}."
    texts = [note, *(compare_means() if means else ())]
    title = f"P8 on BS113A in plane strain, rail of {YIELD / MPA:g} MPa without hardening"
    publish("plane_plastic", out, [table(rows)], panels(rows, contact), title, "\n\n".join(texts))


def compare_means(steps: int = 20) -> Iterator[str]:
    """Means over equal squares at the last load, without hardening and with; Markdown."""
    for words, slope in (("no hardening", 0.0), (f"slope of {SLOPE / 1e9:g} GPa", SLOPE)):
        contacts = [press(size, steps, slope)[0] for size in SIZES]
        window = window_of(contacts[0])
        ours = [of_cells(contact, window, size) for contact, size in zip(contacts, SIZES)]
        judges = [of_elements(judge(contacts[0], size, steps, slope), window, size) for size in JUDGE_SIZES]
        yield means_table(ours, judges, words)
